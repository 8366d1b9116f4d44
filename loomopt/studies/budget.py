"""Torque budget of a design in its scene, with remarks, and the errors where a scene has none."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from loomopt.base import arguments
from loomopt.base.errors import refusal
from loomopt.jobs import registry
from loomopt.model import budget
from loomopt.model.budget import MotorSize, TorqueBudget, TorqueShare
from loomopt.model.session import working
from loomopt.physics import balance
from loomopt.physics.effects.kinds import Event, Load, Speed, State
from loomopt.scenes import designs
from loomopt.scenes.scene import Scene

UNITS = {"at_peak": "N*m", "peak": "N*m", "rms": "N*m", "energy": "J", "share": "1"}
MOTOR_UNITS = {
    "rms_torque": "N*m",
    "mean_power": "W",
    "peak_power": "W",
    "regenerated": "W",
    "energy_swing": "J",
    "flywheel": "kg*m^2",
}
"""SI units of the columns of a row, and of the motor's quantities."""


@dataclass(frozen=True, repr=False)
class BudgetResult:
    """Shares of the effects in the crank torque of a design, and size of motor and flywheel; SI and rad.

    remarks: sentences on effects without a share. undefined: reasons for quantities of the motor that are None.
    """

    scene: Scene
    torque: TorqueBudget
    remarks: tuple[str, ...]
    undefined: Mapping[str, str]

    @property
    def rows(self) -> tuple[TorqueShare, ...]:
        """Shares of the effects in the crank torque, in the order of the job."""
        return self.torque.rows

    @property
    def total(self) -> TorqueShare:
        """Total crank torque."""
        return self.torque.total

    @property
    def motor(self) -> MotorSize:
        """Size of the motor."""
        return self.torque.motor

    def as_dict(self) -> dict[str, Any]:
        """The object that `budget --json` prints."""
        torque = self.torque
        return {
            "problem": self.scene.name,
            "rows": [row._asdict() for row in torque.rows],
            "total": {name: value for name, value in torque.total._asdict().items() if name != "effect"},
            "motor": torque.motor._asdict(),
            "angle": torque.angle,
            "fluctuation": torque.fluctuation,
            "undefined": dict(self.undefined),
            "remarks": list(self.remarks),
            "units": {**UNITS, **MOTOR_UNITS, "angle": "rad", "fluctuation": "1"},
        }


@working()
def compute(scene: Scene, design: designs.Design, fluctuation: float | None = None) -> BudgetResult:
    """Torque budget of a design.

    design: SI, today's values where it names none. fluctuation: allowed relative fluctuation of the speed. Raises
    BadInput.
    """
    allowed = "more than 0, at most 1"
    if fluctuation is not None:
        remedy = "Give 0.02, or leave it out"
        if not 0.0 < arguments.number(fluctuation, "fluctuation", allowed, remedy) <= 1.0:
            raise refusal("it is out of range", "", "fluctuation", fluctuation, allowed, remedy)
        fluctuation = float(fluctuation)
    job = registry.of(scene)
    sampler = job.sampler(scene, {**job.today(scene), **designs.flat(design)})
    if not sampler.model.loads:
        names = [name for name, effect in scene.schema.effects.items() if isinstance(effect, Load | State)]
        remedy = f"Put one on: {', '.join(names)}"
        problem = "no effect acts on the crank, so there is no torque"
        raise refusal(problem, scene.origin, "effects", remedy=remedy)
    for load in sampler.model.loads:
        if isinstance(load, Load) and load.known_in(sampler.model.words_of(load.name)):
            problem = f"effect {load.name} is defined in a part of the turn only, but a budget needs the whole turn"
            remedy = f"Take it off (--without {load.name}), or choose other values"
            raise refusal(problem, scene.origin, f"effects.{load.name}", remedy=remedy)
    torque = budget.budget(sampler, fluctuation)
    return BudgetResult(scene, torque, tuple(_remarks(scene, sampler.model.loads)), _undefined(torque))


def _undefined(torque: TorqueBudget) -> dict[str, str]:
    """Reasons for the motor's quantities that are None."""
    why = "operation.speed is not given"
    missing = {name: why for name, value in torque.motor._asdict().items() if value is None}
    if "flywheel" in missing and torque.motor.mean_power is not None:
        missing["flywheel"] = "no fluctuation is given, such as 0.02"
    return missing


def _remarks(scene: Scene, loads: "tuple[balance.Acting, ...]") -> list[str]:
    """Sentences on effects that are on and have no share, or are not included."""
    remarks = []
    for state in (load for load in loads if isinstance(load, State)):
        carried = [load.name for load in loads if load.name in state.carries]
        if carried:
            part = "and its share is the difference" if state.moved else "and its share contains them"
            remarks.append(f"{' and '.join(carried)} reach the crank through {state.name}, {part}")
    for effect in scene.active:
        if isinstance(effect, Event):
            remarks.append(f"{effect.name} is not included: the output is assumed to stay on its mechanism")
        if isinstance(effect, Speed):
            remarks.append(f"the flywheel of {effect.name} has no share: its torque is part of the motor's")
    return remarks
