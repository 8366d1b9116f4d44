"""Crank whose speed varies: the speed is solved once, then every pose contains it."""

import functools
from collections.abc import Collection, Hashable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from loomopt.base.errors import refusal
from loomopt.maths import systems
from loomopt.maths.systems import Maths, Number
from loomopt.model import drive
from loomopt.model.kinematics import Arcs, Group, Kinematics
from loomopt.model.model import DesignRow, Instant
from loomopt.model.sampling import CACHE_SIZE, Sampler
from loomopt.physics import balance
from loomopt.physics.balance import Given
from loomopt.physics.cycle import TURN, Cycle, Floats, Node, Pieces
from loomopt.physics.effects.kinds import Motion, Speed
from loomopt.physics.motion.turning import CrankTurn, NoTurn, solved
from loomopt.physics.schema import Values
from loomopt.scenes.scene import Scene

FLOATS = ("float", "numpy")
"""Number systems of float64."""
PIECE, NO_LOAD = "piece of the turn", "no_load_speed"
"""Name of the switch for the two sides of a corner, and of the motor's speed without load, rad/s."""


def turned(steady: Sampler, scene: Scene) -> Sampler:
    """Design at the speed that the scene's motor gives its crank; steady: at constant speed. Raises BadInput.

    Kept as the steady sampler is: the same object for the same one.
    """
    motor, *others = (effect for effect in scene.active if isinstance(effect, Speed))
    if others:
        problem = f"effects {motor.name} and {others[0].name} cannot be on together: the crank has one speed"
        raise refusal(problem, scene.origin, f"effects.{others[0].name}", remedy="Take one of them off")
    try:
        return steady.session.cached("turned", CACHE_SIZE, (steady, motor), lambda: _turned(steady, motor))
    except NoTurn:
        problem = f"effect {motor.name}: the crank has no periodic motion without a stop"
        remedy = "Give a larger flywheel, a higher speed, or less load on the crank"
        raise refusal(problem, scene.origin, f"effects.{motor.name}", remedy=remedy) from None


def _turned(steady: Sampler, motor: Speed) -> Sampler:
    model, given = steady.model, steady.given
    loads, system = model.loads, systems.numpy()

    def surplus(pieces: Pieces, u: Floats, no_load: float, omega: Floats, omega_dot: Floats) -> Floats:
        node = steady.node(pieces, u)
        at = given._replace(values={**given.values, NO_LOAD: no_load}).inputs(system, motor)
        pose = _posed(model.kinematics, system, given, node, (omega, omega_dot))
        taken = balance.crank_torque(system, loads, pose, given, node.switch) + motor.flywheel(at) * omega_dot
        return np.asarray(motor.motor(at, omega) - taken)

    turning = solved(steady.cycle.starts, float(given.values["speed"]), surplus)
    rows = {name: DesignRow(functools.partial(_row, motor, name)) for name in motor.rows}
    moved = replace(
        model,
        kinematics=TurnedCrank(model.kinematics, steady.cycle, turning),
        own_quantities={**model.own_quantities, **drive.motion()},
        own_rows={**model.own_rows, **rows},
    )
    return Sampler(moved, steady.values, steady.samples)


def _posed(
    kinematics: Kinematics, maths: Maths, given: Given, node: Node, speeds: tuple[Number, Number], event: str = ""
) -> Motion:
    """Pose, or the exact one at an event, at a speed of its own; speeds: ω, rad/s, and ω̇, rad/s²."""
    known = given._replace(values={**given.values, "speed": speeds[0], "omega_dot": speeds[1]})
    return kinematics.still(maths, known, event, node.switch) if event else kinematics.pose(maths, known, node)


def _row(motor: Speed, name: str, at: Instant) -> float:
    kinematics = at.model.kinematics
    assert isinstance(kinematics, TurnedCrank)
    return motor.rows[name](at.given.inputs(at.maths, motor), kinematics.turning)


@dataclass(frozen=True)
class TurnedCrank(Kinematics):
    """A mechanism whose crank turns at a speed of its own, in float64 only."""

    steady: Kinematics
    cycle: Cycle
    turning: CrankTurn

    @property
    def structure(self) -> Hashable:
        """Key of its formulas: equal for mechanisms with the same formulas."""
        return self.steady.structure, PIECE

    @property
    def groups(self) -> Mapping[str, Group]:
        """Links that must close."""
        return self.steady.groups

    @property
    def arcs(self) -> tuple[Arcs, ...]:
        """The mechanism's own stretches, and which piece of the turn a node is on."""
        return (*self.steady.arcs, Arcs(PIECE, lambda *_: (), lambda angle, _: float(self.cycle.place(angle)[0])))

    @property
    def breaks(self) -> frozenset[str]:
        """Events that lie on corners of its own arcs."""
        return self.steady.breaks

    def linkage(self, maths: Maths, values: Values) -> object:
        """Record of the scene's numbers for poses."""
        return self.steady.linkage(maths, values)

    def derived(self, maths: Maths, given: Given, called: Collection[str]) -> Mapping[str, Number]:
        """Values that follow from the scene's numbers, and the motor's speed without load, rad/s."""
        return {**self.steady.derived(maths, given, called), NO_LOAD: self.turning.no_load}

    def hints(self, given: Given, called: Collection[str]) -> Mapping[str, float]:
        """Angles of events that no formula gives."""
        return self.steady.hints(given, called)

    def pose(self, maths: Maths, given: Given, node: Node) -> Motion:
        """Pose at a node with the crank's speed there. Raises TypeError outside float64."""
        return _posed(self.steady, maths, given, node, self._speeds(maths, node))

    def still(self, maths: Maths, given: Given, event: str, switch: Values) -> Motion:
        """Exact pose at an event with the crank's speed there. Raises TypeError outside float64."""
        node = Node(self.events(maths, given)[event], switch)
        return _posed(self.steady, maths, given, node, self._speeds(maths, node), event)

    def events(self, maths: Maths, given: Given) -> Mapping[str, Number]:
        """Crank angles of events by name."""
        return self.steady.events(maths, given)

    def _speeds(self, maths: Maths, node: Node) -> tuple[Number, Number]:
        """ω, rad/s, and ω̇, rad/s², on the side of a corner that the node's switch selects."""
        if maths.name not in FLOATS:
            raise TypeError(f"the crank's own speed is known in float64 only, not in {maths.name}")
        phi = np.asarray(node.phi, dtype=np.float64)
        pieces = np.asarray(node.switch[PIECE] if PIECE in node.switch else self.cycle.located(phi)[0]).astype(np.intp)
        begins, ends = self.cycle.starts[pieces], self.cycle.starts[pieces + 1]
        apart = phi - (begins + ends) / 2
        apart = apart - TURN * np.round(apart / TURN)
        # Two loads may have one corner: the piece between is one angle.
        speeds = self.turning.at(pieces, apart / np.where(ends > begins, ends - begins, TURN) + 0.5)
        omega, omega_dot = ((float(value) if value.ndim == 0 else value) for value in speeds)
        return omega, omega_dot
