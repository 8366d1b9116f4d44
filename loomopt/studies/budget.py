"""The torque budget of a design in its scene: what is computed, what to know beside it, and where there is none."""

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
"""SI units of what a row says of an effect, and of the motor."""


@dataclass(frozen=True, repr=False)
class BudgetResult:
    """Where the crank torque of a design comes from, and what it asks of motor and flywheel; SI and rad.

    remarks: what to know beside it; undefined: what of the motor is not known, and why.
    """

    scene: Scene
    found: TorqueBudget
    remarks: tuple[str, ...]
    undefined: Mapping[str, str]

    @property
    def rows(self) -> tuple[TorqueShare, ...]:
        """Each effect's share of the crank torque, in the order of the job."""
        return self.found.rows

    @property
    def total(self) -> TorqueShare:
        """The crank torque itself."""
        return self.found.total

    @property
    def motor(self) -> MotorSize:
        """What the crank asks of a motor."""
        return self.found.motor

    def as_dict(self) -> dict[str, Any]:
        """Return the object that `--json` prints."""
        found = self.found
        return {
            "problem": self.scene.name,
            "rows": [row._asdict() for row in found.rows],
            "total": {name: value for name, value in found.total._asdict().items() if name != "effect"},
            "motor": found.motor._asdict(),
            "angle": found.angle,
            "fluctuation": found.fluctuation,
            "undefined": dict(self.undefined),
            "remarks": list(self.remarks),
            "units": {**UNITS, **MOTOR_UNITS, "angle": "rad", "fluctuation": "1"},
        }


@working()
def compute(scene: Scene, design: designs.Design, fluctuation: float | None = None) -> BudgetResult:
    """Return the torque budget of a design, checked (SI; what it does not name is today's). Raises BadInput."""
    allowed = "more than 0, at most 1"
    if fluctuation is not None:
        remedy = "Give 0.02, or leave it out"
        if not 0.0 < arguments.number(fluctuation, "fluctuation", allowed, remedy) <= 1.0:
            raise refusal("it is out of range", "", "fluctuation", fluctuation, allowed, remedy)
        fluctuation = float(fluctuation)
    job = registry.of(scene)
    sampler = job.sampler(scene, {**job.today(scene), **designs.flat(design)})
    if not sampler.model.loads:
        remedy = f"Put one on: {', '.join(name for name, each in scene.schema.effects.items() if _acts(each))}"
        problem = "no effect acts on the crank: there is no torque to share out"
        raise refusal(problem, scene.origin, "effects", remedy=remedy)
    for load in sampler.model.loads:
        if isinstance(load, Load) and load.known_in(sampler.model.words_of(load.name)):
            problem = f"effect {load.name} is known in part of the turn only: a budget is of the whole turn"
            remedy = f"Take it off (--without {load.name}), or choose other values"
            raise refusal(problem, scene.origin, f"effects.{load.name}", remedy=remedy)
    found = budget.budget(sampler, fluctuation)
    return BudgetResult(scene, found, tuple(_remarks(scene, sampler.model.loads)), _undefined(found))


def _acts(effect: object) -> bool:
    return isinstance(effect, Load | State)


def _undefined(found: TorqueBudget) -> dict[str, str]:
    """Return why what of the motor is None is not known."""
    why = "operation.speed is not given"
    missing = {name: why for name, value in found.motor._asdict().items() if value is None}
    if "flywheel" in missing and found.motor.mean_power is not None:
        missing["flywheel"] = "no fluctuation is asked for, such as 0.02"
    return missing


def _remarks(scene: Scene, loads: "tuple[balance.Acting, ...]") -> list[str]:
    """Return what to know of effects that are on and have no line of their own, or are not followed."""
    found = []
    for state in (load for load in loads if isinstance(load, State)):
        carried = [load.name for load in loads if load.name in state.carries]
        if carried:
            own = "whose share is what it takes in between" if state.moved else "whose share they are"
            found.append(f"{' and '.join(carried)} reach the crank through {state.name}, {own}")
    for effect in scene.active:
        if isinstance(effect, Event):
            found.append(f"{effect.name} is not followed: the output is taken to stay on its mechanism")
        if isinstance(effect, Speed):
            found.append(f"what {effect.name}'s flywheel takes in and gives back is no share: it is the motor's too")
    return found
