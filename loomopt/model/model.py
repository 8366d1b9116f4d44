"""Model of all jobs: kinematics, effects, arcs, named quantities and rows, in every number system.

Only this file groups effects by name, runs loads and checks, reads their switches and eliminates states.
"""

import functools
import math
from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from loomopt.base.records import lazy
from loomopt.maths.systems import FLOAT, Maths, Number, arrays
from loomopt.model.kinematics import Arcs, Kinematics, Squares
from loomopt.physics import balance, cycle
from loomopt.physics.balance import Acting, Given
from loomopt.physics.cycle import TURN, Cycle, Node, Where
from loomopt.physics.effects.kinds import (
    Carried,
    Check,
    Demand,
    Effect,
    Event,
    Inputs,
    Load,
    Speed,
    State,
    StateInstant,
    UnsteadyError,
    keys,
    keys_in_words,
    label,
    lacking,
    owned,
)
from loomopt.physics.schema import Values


class Instant:
    """The mechanism with its effects at one node, in one number system; values are computed when they are read.

    event: name of the event of the motion at this node, if any; its pose is exact.
    """

    def __init__(self, model: "JobModel", maths: Maths, given: Given, node: Node, event: str = "") -> None:
        self.model, self.maths, self.given, self.node, self.event = model, maths, given, node, event
        self._pose: Number = None
        self._joints: dict[object, Any] = {}

    @property
    def values(self) -> Values:
        """Numbers of the scene and derived numbers, by name."""
        return self.given.values

    @property
    def pose(self) -> Number:
        """The mechanism's pose."""
        # Not functools.cached_property: its lock costs as much as a node's own arithmetic.
        if self._pose is None:
            kinematics = self.model.kinematics
            if self.event:
                self._pose = kinematics.still(self.maths, self.given, self.event, self.node.switch)
            else:
                self._pose = kinematics.pose(self.maths, self.given, self.node)
        return self._pose

    @property
    def force(self) -> Number:
        """Q, N or N·m: force or moment that the mechanism supplies at its output."""
        return balance.output_force(self.maths, self.model.loads, self.pose, self.given, self.node.switch)

    @property
    def crank_torque(self) -> Number:
        """The torque on the crank, N·m."""
        return balance.crank_torque(self.maths, self.model.loads, self.pose, self.given, self.node.switch)

    def inputs(self, effect: Effect) -> Inputs[Any]:
        """Inputs of an effect's formulas here."""
        return self.given.inputs(self.maths, effect, self.pose, self.node.switch)

    def terms(self) -> dict[str, Number]:
        """Term of every load by name, N or N·m."""
        pairs = balance.terms(self.maths, self.model.loads, self.pose, self.given, self.node.switch)
        return {load.name: term for load, term in pairs}

    def joints(self, check: "Check[Any]") -> Number:
        """Values that a check reads of the forces in the joints; checks that read the same values share them."""
        if check.joints not in self._joints:
            loaded = balance.Loaded(self.maths, self.model.loads, self.pose, self.given, self.node.switch)
            assert check.joints is not None
            self._joints[check.joints] = check.joints(self.inputs(check), loaded)
        return self._joints[check.joints]

    def switched(self, **switch: Number) -> "Instant":
        """Same node with other switches."""
        node = Node(self.node.phi, {**self.node.switch, **switch})
        return Instant(self.model, self.maths, self.given, node, self.event)

    def at_speed(self, speed: Number) -> "Instant":
        """Same node with the crank at another speed, rad/s; its pose must be a dataclass with `omega`."""
        instant = Instant(self.model, self.maths, self.given, self.node, self.event)
        instant._pose = replace(self.pose, omega=speed)
        return instant


Formula = Callable[[Instant], Number]


class CycleQuantity(NamedTuple):
    """Whole-cycle quantity; figure: whether its largest |value| is a figure.

    signed: the largest value counts, not the largest |value|; bounded: its formula runs on series of balls, so that a
    bound between points is proven with every answer; loaded: it depends on the sum of the loads, so that it is known
    only if all of them are. square: name of its square, if the quantity itself has a corner at 0.
    """

    formula: Formula
    figure: bool = True
    signed: bool = False
    bounded: bool = False
    loaded: bool = False
    square: str = ""


class DesignRow(NamedTuple):
    """Value of the design alone, or of the position at an event; needs: scene numbers that it requires."""

    formula: Formula
    needs: tuple[str, ...] = ()
    event: str = ""
    loaded: bool = True
    """Whether a row at an event reads the sum of the loads on the output; without a load it does not exist."""
    structure: Hashable = None
    """Key that distinguishes formulas of one name."""


class Integral(NamedTuple):
    """Mean of `quantity` over the crank angle; root: name of its square root.

    The mean is over the pieces `where`, or with `angles` (rad) over these only, each with one number of `data` as the
    switch "datum". parts: number of parts of each piece, more than 1 if oscillations need them.
    """

    name: str
    root: str
    quantity: str
    where: Where | None = None
    angles: tuple[float, ...] = ()
    data: tuple[float, ...] = ()
    parts: int = 1


def group_value(formula: Callable[..., Number], at: Instant) -> Number:
    """Quantity of links that must close."""
    return formula(at.maths, at.given, at.node.phi, lambda: at.pose)


def check_value(check: Check[Any], name: str, at: Instant) -> Number:
    """Quantity of a check, SI."""
    return check.quantities[name](at.inputs(check))


def squared(name: str) -> str:
    """Name of the square of a quantity that is the size of a vector."""
    return f"{name}^2"


COMPONENTS = ("x", "y")
"""Components of a vector in the mechanism's axes."""


def component(check: Check[Any], name: str, axis: str, at: Instant) -> Number:
    """Component of a vector that a check reads, SI."""
    return getattr(getattr(at.joints(check), name), axis)


def square_of(check: Check[Any], name: str, at: Instant) -> Number:
    """Square of a vector's size, SI."""
    vector = getattr(at.joints(check), name)
    return vector.x**2 + vector.y**2


def size_of(check: Check[Any], name: str, at: Instant) -> Number:
    """Size of a vector that a check reads, SI."""
    return at.maths.sqrt(square_of(check, name, at))


def scalar_of(check: Check[Any], name: str, at: Instant) -> Number:
    """Scalar that a check reads of the forces in the joints, SI."""
    return getattr(at.joints(check), name)


def work_of(check: Check[Any], name: str, at: Instant) -> Number:
    """Work that a check reads of the forces in the joints, J per rad of the crank."""
    shares = getattr(at.joints(check), name)
    return sum((share * _magnitude(check, force, at) for force, share in shares.items()), 0 * at.node.phi)


def _magnitude(check: Check[Any], name: str, at: Instant) -> Number:
    return size_of(check, name, at) if name in check.vectors else at.maths.sqrt(scalar_of(check, name, at) ** 2)


SLOWNESS = "slowness"
"""Name of the time that the crank takes per angle."""


def slowness(at: Instant) -> Number:
    """Time that the crank takes per angle, s/rad."""
    return 1 / at.pose.omega + 0 * at.node.phi


def heading_name(part: str, axis: str) -> str:
    """Name of a component of a part's unit direction."""
    return f"direction of {part}_{axis}"


def heading_of(check: Check[Any], part: str, axis: str, at: Instant) -> Number:
    """Component of a part's unit direction, as a check reads it."""
    return getattr(at.joints(check).heading(part), axis) + 0 * at.node.phi


FRAME = "frame"
"""Name of the frame among the parts between which a force acts."""


def joint_quantities(check: Check[Any], known: Collection[str]) -> dict[str, CycleQuantity]:
    """Quantities of a check that reads the forces in the joints; known: names of given scene numbers."""
    quantities: dict[str, CycleQuantity] = {}
    lacked = lacking(check, known)
    for name in (name for name in check.vectors if name not in lacked):
        square = squared(name)
        quantities[name] = CycleQuantity(functools.partial(size_of, check, name), loaded=True, square=square)
        quantities[square] = CycleQuantity(functools.partial(square_of, check, name), figure=False, loaded=True)
        for axis in COMPONENTS:
            part = functools.partial(component, check, name, axis)
            quantities[f"{name}_{axis}"] = CycleQuantity(part, figure=False, loaded=True)
    for body in {body for name, bodies in check.sides.items() if name not in lacked for body in bodies} - {FRAME}:
        for axis in COMPONENTS:
            heading = functools.partial(heading_of, check, body, axis)
            quantities[heading_name(body, axis)] = CycleQuantity(heading, figure=False, loaded=True)
    for name, work in check.worked.items():
        if name not in lacked:
            quantities[work] = CycleQuantity(functools.partial(work_of, check, work), figure=False, loaded=True)
            quantities[SLOWNESS] = CycleQuantity(slowness, figure=False)
    for name in (name for name in check.scalars if name not in lacked):
        quantities[name] = CycleQuantity(
            functools.partial(scalar_of, check, name), signed=name in check.signed, loaded=True
        )
        for axis in COMPONENTS if name in check.directed else ():
            part = functools.partial(component, check, check.directed[name], axis)
            quantities[f"{name}_{axis}"] = CycleQuantity(part, figure=False, loaded=True)
    return quantities


def design_value(formula: Callable[[Maths, Values], Number], at: Instant) -> Number:
    """Row of the design alone, SI."""
    return formula(at.maths, at.values)


def check_row(check: Check[Any], name: str, at: Instant) -> Number:
    """Row of a check, SI."""
    return check.rows[name](at.given.inputs(at.maths, check))


class Cornered(NamedTuple):
    """Switch: the angles, rad, of its corners, its value between them, and the corners that divide the cycle."""

    angles: tuple[Number, ...]
    switch: Callable[[float, tuple[float, ...]], float]
    placed: tuple[Number, ...]


def cornered(model: "JobModel", maths: Maths, given: Given) -> list[Cornered]:
    """Switches of a model."""
    corners: list[Cornered] = []
    for arc in (*model.kinematics.arcs, *model.arcs):
        angles = arc.corners(maths, given)
        corners.append(Cornered(angles, arc.switch, arc.parting(maths, given) if arc.parting else angles))
    for load in model.loads:
        if isinstance(load, Load) and load.corners:
            angles = load.corners(given.inputs(maths, load))
            # An event on a corner of the motion's own arcs would be that corner twice.
            events = model.kinematics.breaks.intersection(load.reads)
            there = {id(angle) for event in events for angle in given.values[event]}
            corners.append(Cornered(angles, load.switch, tuple(a for a in angles if id(a) not in there)))
    return corners


def with_states_eliminated(maths: Maths, kinematics: Kinematics, loads: Sequence[Acting], given: Given) -> Given:
    """Numbers of a scene with the derived values of each state."""
    for state in (load for load in loads if isinstance(load, State)):
        moving = carried_by(maths, kinematics, loads, given, state)
        derived = state.derived(given.inputs(maths, state), moving)
        given = given._replace(values={**given.values, **derived})
    return given


def carried_by(maths: Maths, kinematics: Kinematics, loads: Sequence[Acting], given: Given, state: State) -> Carried:
    """Bodies that move with a state's coordinate."""
    loads_carried = [load for load in loads if isinstance(load, Load) and load.name in state.carries]
    inertias = [load.moved(given.inputs(maths, load)) for load in loads_carried if load.moved]
    smooth = [load for load in loads_carried if not load.corners]

    def weigh(angles: Sequence[Number], weights: Sequence[Sequence[Number]]) -> list[Number]:
        system = arrays(maths)
        phi = system.spread(angles, [value for name, value in given.values.items() if name in given.known])
        force = 0 * phi
        if smooth:
            pose = kinematics.pose(system, given, Node(phi, {}))
            pairs = balance.terms(system, smooth, pose, given, {})
            force = force + balance.total([balance.on_output(system, load, term, pose, given) for load, term in pairs])
        return system.weighted(weights, force)

    return Carried(balance.total(inertias), weigh)


def read_at(state: State, at: Instant) -> StateInstant:
    """Values of a state at an instant."""

    def coordinate() -> Number:
        reply = balance.reply_to_corners(at.maths, state, at.model.loads, at.pose, at.given, at.node.switch)
        return state.coordinate(at.inputs(state), reply)

    return StateInstant(at.pose, coordinate, lambda: at.force)


def state_value(state: State, formula: Callable[[StateInstant], Number], sign: int, at: Instant) -> Number:
    """Values of a state that a formula reads, SI."""
    return formula(read_at(state, at)) if sign > 0 else -formula(read_at(state, at))


def state_quantities(states: Sequence[State]) -> dict[str, CycleQuantity]:
    """Whole-cycle quantities of states; a least value is stored with the opposite sign and is not a figure."""
    return {
        name: CycleQuantity(
            functools.partial(state_value, state, peak.read, -1 if peak.least else 1),
            not peak.least,
            signed=peak.least or peak.signed,
        )
        for state in states
        for name, peak in state.peaks.items()
    }


def state_columns(states: Sequence[State]) -> Mapping[str, Callable[[Instant], Number]]:
    """Columns that states add to the curves, with their units."""
    return {
        name: functools.partial(state_value, state, formula, 1)
        for state in states
        for name, formula in state.columns.items()
    }


def uncovered(effects: Sequence[Effect], values: Mapping[str, Values]) -> tuple[str, ...]:
    """Parts of states and events that neither proofs nor studies of accuracy cover; values: by effect."""
    return tuple(effect.rests(values[effect.name]) for effect in effects if isinstance(effect, State | Event))


__all__ = ["CycleQuantity", "DesignRow", "Formula", "Instant", "Integral", "JobModel", "Stills"]

Stills = Mapping[str, Values]
"""Event → the switches just before it, by name."""


@dataclass(frozen=True, eq=False)
class JobModel:
    """A mechanism with the effects of a scene.

    effects: loads, states and checks, in the order of the job. words: (effect, key, word) for values that choose a
    formula. quantities, rows: those of the job; those of checks are added. assembly: conditions of assembly
    in addition to the groups of the kinematics: phrase → (quantity, largest permitted |value|).
    known: names of scene numbers that are given.
    """

    kinematics: Kinematics
    effects: tuple[Effect, ...] = ()
    words: tuple[tuple[str, str, str], ...] = ()
    own_quantities: Mapping[str, CycleQuantity] = field(default_factory=dict)
    own_rows: Mapping[str, DesignRow] = field(default_factory=dict)
    arcs: tuple[Arcs, ...] = ()
    integrals: tuple[Integral, ...] = ()
    assembled: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    known: frozenset[str] = frozenset()

    @lazy
    def key(self) -> Hashable:
        """Key of the model's formulas: equal for models with the same formulas."""
        means = tuple((mean.name, len(mean.angles), mean.parts) for mean in self.integrals)
        arcs = tuple((arc.name, arc.structure) for arc in self.arcs)
        rows = tuple((name, row.structure) for name, row in self.own_rows.items())
        structure = self.kinematics.structure, arcs, means, tuple(self.own_quantities), rows
        return structure, self.effects, self.words, self.known

    @lazy
    def loads(self) -> tuple[Acting, ...]:
        """Loads and states of the balance, in order."""
        return tuple(effect for effect in self.effects if isinstance(effect, Load | State))

    @lazy
    def states(self) -> tuple[State, ...]:
        """Loads with a coordinate of their own."""
        return tuple(load for load in self.loads if isinstance(load, State))

    @lazy
    def checks(self) -> tuple[Check[Any], ...]:
        """Effects that do not act in the balance."""
        return tuple(effect for effect in self.effects if isinstance(effect, Check))

    @lazy
    def called(self) -> frozenset[str]:
        """Numbers and events of the motion that effects read in addition to the mechanism's lengths."""
        return frozenset(name for effect in self.effects for name in effect.reads)

    @lazy
    def labels(self) -> dict[str, str]:
        """Full name of every number of the effects' tables → name for the designer."""
        return {owned(effect, key): label(effect, key) for effect in self.effects for key in keys(effect.table)}

    @lazy
    def _full(self) -> dict[str, dict[str, str]]:
        """Keys of each effect's table with the full names of their numbers."""
        return {effect.name: {key: owned(effect, key) for key in keys(effect.table)} for effect in self.effects}

    def words_of(self, effect: str) -> dict[str, str]:
        """Words of an effect's table by key."""
        return {key: word for name, key, word in self.words if name == effect}

    @lazy
    def known_in(self) -> tuple[Where, ...]:
        """The pieces where all loads are known; empty for all of the cycle."""
        loads = [load for load in self.loads if isinstance(load, Load)]
        return next((places for load in loads if (places := load.known_in(self.words_of(load.name)))), ())

    def known_of(self, name: str) -> tuple[Where, ...]:
        """Pieces where a whole-cycle quantity is known; empty for all of the cycle."""
        return self.known_in if self._quantities[name].loaded else ()

    def counted(self, cycle: Cycle, name: str, where: Where | None = None) -> NDArray[np.bool_]:
        """Whether a quantity is known and counts, by piece of a cycle; where: the pieces that count."""
        known, requested = [cycle.on(place) for place in self.known_of(name)], cycle.on(where)
        return requested & np.any(known, axis=0) if known else requested

    # Quantities and rows.

    @lazy
    def _quantities(self) -> dict[str, CycleQuantity]:
        quantities = dict(self.own_quantities)
        for prefix, group in self.kinematics.groups.items():
            for name, formula in group.quantities.items():
                quantities[prefix + name] = CycleQuantity(functools.partial(group_value, formula), figure=False)
        for check in self.checks:
            for name in (name for name in check.quantities if name not in lacking(check, self.known)):
                quantities[name] = CycleQuantity(functools.partial(check_value, check, name))
            quantities |= joint_quantities(check, self.known) if check.joints else {}
        if not self.states:
            return quantities

        return quantities | state_quantities(self.states)

    @lazy
    def _rows(self) -> dict[str, DesignRow]:
        rows = dict(self.own_rows)
        for prefix, group in self.kinematics.groups.items():
            for name, formula in group.rows.items():
                rows[name if name in group.margins else prefix + name] = DesignRow(
                    functools.partial(design_value, formula)
                )
        for check in self.checks:
            rows |= {name: DesignRow(functools.partial(check_row, check, name)) for name in check.rows}
        return {name: row for name, row in rows.items() if self._sufficed(row)}

    def _sufficed(self, row: DesignRow) -> bool:
        known = not self.known or self.known.issuperset(row.needs)
        return known and (not row.event or not row.loaded or any(load.acts == "output" for load in self.loads))

    @lazy
    def events_read(self) -> tuple[str, ...]:
        """Events of the rows."""
        return tuple(dict.fromkeys(row.event for row in self._rows.values() if row.event))

    @property
    def quantities(self) -> tuple[str, ...]:
        """Whole-cycle quantities whose largest |value| is a figure."""
        return tuple(name for name, quantity in self._quantities.items() if quantity.figure)

    @lazy
    def least(self) -> tuple[str, ...]:
        """Figures that are minima over the cycle; their quantities have the opposite sign."""
        return tuple(name for state in self.states for name, peak in state.peaks.items() if peak.least)

    @lazy
    def signed(self) -> frozenset[str]:
        """Whole-cycle quantities whose largest value counts, not the largest |value|."""
        return frozenset(name for name, quantity in self._quantities.items() if quantity.signed)

    @lazy
    def bounded(self) -> frozenset[str]:
        """Whole-cycle quantities that run on series of balls, so that bounds between points are proven."""
        return frozenset(name for name, quantity in self._quantities.items() if quantity.bounded)

    def square(self, name: str) -> str:
        """Name of the square of a quantity with a corner at 0; "" for any other quantity."""
        return self._quantities[name].square

    def has_quantity(self, name: str) -> bool:
        """Whether a name is that of a whole-cycle quantity.

        Parameters
        ----------
        name : any name.

        Returns
        -------
        True or False.
        """
        return name in self._quantities

    def has_row(self, name: str) -> bool:
        """Whether a name is that of a row for which this model has the numbers."""
        means = {figure for mean in self.integrals for figure in (mean.name, mean.root)}
        turned = {row for effect in self.effects if isinstance(effect, Speed) for row in effect.rows}
        return name in {*self._rows, *means, *turned}

    def event_of(self, name: str) -> str:
        """Event of a row; "" for a row of the design alone."""
        return self._rows[name].event

    @lazy
    def assembly(self) -> dict[str, tuple[str, float]]:
        """Conditions of assembly at an angle: phrase → (quantity, largest |value| that is allowed)."""
        groups = self.kinematics.groups.items()
        closes = {phrase: (prefix + name, 1.0) for prefix, group in groups for phrase, name in group.closes.items()}
        return closes | dict(self.assembled)

    @lazy
    def check_figures(self) -> dict[str, str]:
        """Whole-cycle quantities of checks → the figure that has the same kind; components of vectors are included."""
        figures: dict[str, str] = {}
        for check in self.checks:
            lacked = lacking(check, self.known)
            figures |= {name: name for name in check.quantities if name not in lacked}
            for name in (name for name in check.vectors if name not in lacked):
                figures |= {f"{name}_{axis}": name for axis in COMPONENTS} | {name: name}
            for name in (name for name in check.scalars if name not in lacked):
                figures |= {f"{name}_{axis}": name for axis in COMPONENTS if name in check.directed} | {name: name}
        return figures

    @lazy
    def sides(self) -> dict[str, tuple[str, str]]:
        """Forces of checks → the two parts between which the force acts."""
        return {
            name: parts for check in self.checks for name, parts in check.sides.items() if name in self.check_figures
        }

    @lazy
    def worked(self) -> dict[str, str]:
        """Figures of checks that are mean powers → the quantity, J/rad, whose mean they are."""
        checks = [(check, lacking(check, self.known)) for check in self.checks]
        return {name: work for check, lacked in checks for name, work in check.worked.items() if name not in lacked}

    @lazy
    def pushes(self) -> frozenset[str]:
        """Whole-cycle quantities of checks that are 0 where Q is negative; components of vectors are included."""
        pushed = {name for check in self.checks for name in check.pushes}
        return frozenset(name for name, figure in (self.check_figures | self._works).items() if figure in pushed)

    @property
    def _works(self) -> dict[str, str]:
        return {work: figure for figure, work in self.worked.items()}

    @lazy
    def undefined(self) -> dict[str, str]:
        """Figures of checks that have no value → the reason, a sentence without full stop."""
        reasons: dict[str, str] = {}
        for check in self.checks:
            for name, missing in lacking(check, self.known).items():
                reasons[name] = f"{name} needs {keys_in_words(missing, self.known)}"
        return reasons

    @property
    def demands(self) -> tuple[tuple[Check[Any], Demand], ...]:
        """Demands of active checks."""
        return tuple((check, demand) for check in self.checks for demand in check.demands)

    # Numbers and corners.

    def given(self, maths: Maths, values: Values) -> Given:
        """Scene's numbers with all that follows from them.

        Parameters
        ----------
        maths : number system.
        values : scene's numbers by name, SI.

        Returns
        -------
        Numbers, SI, with the values of the states.
        """
        return with_states_eliminated(maths, self.kinematics, self.loads, self.plain(maths, values))

    def samples(self, given: Given) -> int:
        """Number of samples per turn that the states of a design need.

        Parameters
        ----------
        given : scene's numbers with all that follows from them, SI.

        Returns
        -------
        Number of samples; 0 without states.
        """
        return max((math.ceil(state.samples(given.inputs(FLOAT, state))) for state in self.states), default=0)

    def plain(self, maths: Maths, values: Values) -> Given:
        """Numbers of the scene and those derived from the mechanism alone.

        Parameters
        ----------
        maths : number system.
        values : scene's numbers by name, SI.

        Returns
        -------
        Numbers, SI, without the values of the states.
        """
        by_effect: dict[str, dict[str, Any]] = {}
        for effect, full in self._full.items():
            by_effect[effect] = {key: values[name] for key, name in full.items() if name in values}
            by_effect[effect] |= self.words_of(effect)
        for active in self.effects:
            if active.instance:
                by_effect[active.name]["instance"] = active.instance
        given = Given(values, by_effect, frozenset(values), self.kinematics.linkage(maths, values))
        return given._replace(values={**values, **self.kinematics.derived(maths, given, self.called)})

    @lazy
    def switches(self) -> tuple[str, ...]:
        """Names of the switches, which have corners in the cycle: arcs of the motion, arcs of the job, loads."""
        arcs = (*self.kinematics.arcs, *self.arcs)
        cornered = [load.name for load in self.loads if isinstance(load, Load) and load.corners]
        return (*(arc.name for arc in arcs), *cornered)

    @lazy
    def formula_switches(self) -> frozenset[str]:
        """Switches that select a formula; the others only select the limits that apply."""
        arcs = {arc.name for arc in self.arcs}
        return frozenset(name for name in self.switches if name not in arcs)

    def corners(self, maths: Maths, given: Given) -> tuple[Number, ...]:
        """Corners of the cycle.

        Parameters
        ----------
        maths : number system.
        given : scene's numbers with all that follows from them, SI.

        Returns
        -------
        Crank angles, rad, in the order of declaration.
        """
        return tuple(angle for arc in cornered(self, maths, given) for angle in arc.placed)

    def split(self, maths: Maths, given: Given) -> Cycle:
        """Pieces of the cycle.

        Parameters
        ----------
        maths : number system of floats.
        given : scene's numbers with all that follows from them, SI.

        Returns
        -------
        Cycle, with the switches of each piece.
        """
        arcs = cornered(self, maths, given)
        corners = [angle for arc in arcs for angle in arc.placed]
        return cycle.split(corners, self.switches, lambda angle: [arc.switch(angle, arc.angles) for arc in arcs])

    def hints(self, given: Given) -> dict[str, float]:
        """Angles of corners and events that no formula gives.

        Parameters
        ----------
        given : scene's numbers with all that follows from them, SI.

        Returns
        -------
        Starting angles, rad, by name of the value.
        """
        return dict(self.kinematics.hints(given, self.called))

    def singular(self, squares: Squares) -> tuple[float, ...]:
        """Crank angles where the mechanism nearly reaches a singular position.

        Parameters
        ----------
        squares : reader of squares of quantities by names and crank angles, rad.

        Returns
        -------
        Angles, rad.
        """
        groups = self.kinematics.groups.items()
        return tuple(angle for prefix, group in groups for angle in group.singular(prefix, squares))

    # Values.

    def instant(self, maths: Maths, given: Given, node: Node) -> Instant:
        """Mechanism with its effects at a node.

        Parameters
        ----------
        maths : number system.
        given : scene's numbers with all that follows from them, SI.
        node : node of the cycle.

        Returns
        -------
        Instant, which computes its pose once.
        """
        return Instant(self, maths, given, node)

    def formula(self, name: str) -> Formula:
        """Formula of a whole-cycle quantity.

        Parameters
        ----------
        name : name of a whole-cycle quantity.

        Returns
        -------
        Function of an instant.
        """
        return self._quantities[name].formula

    def quantity(self, maths: Maths, given: Given, name: str, node: Node) -> Number:
        """Whole-cycle quantity at a node.

        Parameters
        ----------
        maths : number system.
        given : scene's numbers with all that follows from them, SI.
        name : name of a whole-cycle quantity.
        node : node of the cycle.

        Returns
        -------
        Value, SI.
        """
        return self.together(maths, given, node)(name)

    def together(self, maths: Maths, given: Given, node: Node) -> Callable[[str], Number]:
        """Reader of whole-cycle quantities at a node, which computes the pose once.

        Parameters
        ----------
        maths : number system.
        given : scene's numbers with all that follows from them, SI.
        node : node of the cycle.

        Returns
        -------
        Function from the name of a quantity to its value, SI.
        """
        instant = Instant(self, maths, given, node)
        return lambda name: self._quantities[name].formula(instant)

    def static(
        self, maths: Maths, given: Given, stills: Stills, names: Collection[str] | None = None
    ) -> dict[str, Number]:
        """Figures and rows that need one position only.

        Parameters
        ----------
        maths : number system.
        given : scene's numbers with all that follows from them, SI.
        stills : switches just before each event.
        names : names of figures and rows; None for all whose numbers are known.

        Returns
        -------
        Values by name, SI.
        """
        if names is None:
            known = given.values
            names = [name for name, row in self._rows.items() if all(need in known for need in row.needs)]
        instants: dict[str, Instant] = {}
        figures = {}
        for name in names:
            if name in self._rows:
                event = self._rows[name].event
                if event not in instants:
                    instants[event] = Instant(self, maths, given, Node(None, stills.get(event, {})), event)
                figures[name] = self._rows[name].formula(instants[event])
        return figures

    def event(self, maths: Maths, given: Given, name: str) -> Number:
        """Crank angle of an event.

        Parameters
        ----------
        maths : number system.
        given : scene's numbers with all that follows from them, SI.
        name : name of the event.

        Returns
        -------
        Angle, rad.
        """
        return self.kinematics.events(maths, given)[name]


RESOLVED = 95
"""Share of a state's samples that suffices for a mean to rounding (4 oscillations of the state)."""
Word = tuple[str, str, str]


def with_words_fixed(model: JobModel, values: Mapping[str, float]) -> JobModel:
    """Model that is valid for the states of a design (SI); the same object if it is valid already.

    Raises UnsteadyError if there is no reliable steady state.
    """
    if not model.states:
        return model
    values = {**values, **model.hints(model.plain(FLOAT, values))}
    given = model.plain(FLOAT, values)
    words = {(effect, key): word for effect, key, word in model.words}
    for state in model.states:
        carried = carried_by(FLOAT, model.kinematics, model.loads, given, state)
        fixed = state.fixed(given.inputs(FLOAT, state), carried)
        words |= {(state.name, key): word for key, word in fixed.items()}
    first = _with(model, tuple((*key, word) for key, word in words.items()), ())
    return _with(first, first.words, _parts(first, values))


def unserved(model: JobModel, values: Mapping[str, float]) -> str:
    """Reason why the model is not valid for a design (SI); "" where it is valid."""
    try:
        return (
            "" if with_words_fixed(model, values) is model else "a steady state needs more here than it was solved with"
        )
    except UnsteadyError as error:
        return error.problem


def _parts(model: JobModel, values: Mapping[str, float]) -> tuple[int, ...]:
    """Number of parts into which the pieces of a mean are cut, so that the rule resolves their oscillation."""
    given = model.given(FLOAT, values)
    samples, cycle = model.samples(given), model.split(FLOAT, given)
    stretches = [cycle.stretch(mean.where) for mean in model.integrals]
    shares = [(end - begin) / TURN for begin, end in stretches]
    return tuple(
        max(mean.parts, math.ceil(share * samples / RESOLVED))
        for mean, share in zip(model.integrals, shares, strict=True)
    )


@functools.lru_cache(maxsize=64)
def _made(model: JobModel, words: tuple[Word, ...], integrals: tuple[Integral, ...]) -> JobModel:
    return replace(model, words=words, integrals=integrals)


def _with(model: JobModel, words: tuple[Word, ...], parts: tuple[int, ...]) -> JobModel:
    """Model with these words and parts of means; the same object if it has them already."""
    cut = tuple(mean._replace(parts=n) for mean, n in zip(model.integrals, parts, strict=False)) or model.integrals
    return model if (words, cut) == (model.words, model.integrals) else _made(model, words, cut)
