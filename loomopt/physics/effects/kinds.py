"""Kinds of effects. Every job accepts every kind, or refuses it by name; no other code knows an effect's name.

An effect that is absent from a scene is absent from its equations.
"""

import functools
import importlib
import pkgutil
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Generic, Literal, NamedTuple, Protocol, TypeVar, get_args

from loomopt.base.units import ShowValue
from loomopt.maths.systems import Maths, Number
from loomopt.physics.schema import Figure, Table, Values

if TYPE_CHECKING:
    from loomopt.physics.mechanisms.chain import Chain
    from loomopt.physics.mechanisms.dyad import Vector
    from loomopt.physics.motion.flight import Cam, Course
    from loomopt.physics.motion.free import Body
    from loomopt.physics.motion.turning import CrankTurn


class Motion:
    """Values of every pose: q, q1, q2 (output and its derivatives with respect to φ) give q˙ and q¨."""

    phi: Number
    q: Number
    q1: Number
    q2: Number
    omega: Number
    omega_dot: Number

    @property
    def velocity(self) -> Number:
        """q˙ = q' ω."""
        return self.q1 * self.omega

    @property
    def acceleration(self) -> Number:
        """q¨ = q'' ω² + q' ω̇; the second term only where the speed changes."""
        steady = self.q2 * self.omega**2
        return steady if self.omega_dot is None else steady + self.q1 * self.omega_dot

    def with_carried(self, motion: "Motion") -> "Motion":
        """Same pose, where the parts on the output have a motion of their own."""
        return self


Pose = TypeVar("Pose", contravariant=True)
AnyPose = TypeVar("AnyPose", covariant=True)
Place = tuple[str, float]
"""A switch by name, and its value on the pieces that are meant."""


class Inputs(NamedTuple, Generic[AnyPose]):
    """Arguments of the formulas of an effect, in one number system.

    values: the scene's numbers, SI, with what follows from them; table: the values of the effect's own table.
    pose: the mechanism at the instant, None in a formula of the design alone.
    switch: which of a load's formulas holds, as `Load.switch` gives it.
    """

    maths: Maths
    values: Values
    table: Values
    pose: AnyPose
    switch: Number = 0


class LinkMass(NamedTuple):
    """Mass of a load on one rigid link, by its joint nearest to the drive or the frame; numbers of one system.

    link: as the mechanism calls it; mass: kg; along, across: mass times the way from that joint to its centre, kg·m,
    along the link and to its left; second: inertia about the joint, kg·m².
    """

    link: str
    mass: Number
    along: Number
    across: Number
    second: Number


class Applied(NamedTuple):
    """A load: on a link, on a joint or on the slider of a part; its force, N, at a place, m, and its couple, N·m.

    place: None for a joint's own; inertial: whether it is what a mass resists with.
    """

    on: str
    force: "Vector | None" = None
    place: "Vector | None" = None
    couple: Number | None = None
    inertial: bool = False


class Loading(Protocol):
    """Loads on a mechanism at one instant, for a check that reads its joint forces."""

    @property
    def force(self) -> Number:
        """Q, N or N·m: force or moment that the mechanism supplies at its output."""

    @property
    def carried(self) -> Number:
        """Motion of the parts that move with the output, or that of the state that carries them."""

    @property
    def masses(self) -> "Sequence[tuple[LinkMass, Any]]":
        """Masses of the loads with their motions."""

    @property
    def inertia(self) -> Number:
        """Inertia of all that the loads move, about the output's axis, kg·m², or its mass, kg."""

    @property
    def pushes(self) -> "Sequence[Vector]":
        """Forces on the output's link itself, N."""

    @property
    def applied(self) -> Sequence[Applied]:
        """Forces on links and joints by name."""


def constant_switch(angle: float, corners: tuple[float, ...]) -> float:
    """Switch of a formula without corners: it is never read."""
    return 0.0


def nothing_unknown(words: Mapping[str, str]) -> tuple[Place, ...]:
    """No unknown intervals: the load is known over the whole cycle."""
    return ()


class EffectClash(NamedTuple):
    """Incompatible effect, and the reason; key, words: only for these values of a key of its table."""

    effect: str
    why: str
    key: str = ""
    words: tuple[str, ...] = ()


class Demand(NamedTuple):
    """What an effect's row must keep: a value, SI, or that of a key of its table; sign +1 at most, −1 at least, 0 ="""

    row: str
    sign: int
    value: float | str


class FlatNumber(NamedTuple):
    """Number of an effect that may change nothing, and then stays nearest to today's; name: name of the tie-break."""

    name: str
    key: str


class ModelNeeds(NamedTuple):
    """Requirements of one value of an effect's key `model`: keys of its table, scene keys, design variables.

    may: keys of its table that it may have too.
    """

    keys: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    reads: tuple[str, ...] = ()
    may: tuple[str, ...] = ()


def model_of(effect: "Effect", table: Table) -> ModelNeeds:
    """Numbers that an effect needs with the model that its table names; none where it has one model only."""
    return effect.models.get(str(getattr(table, "model", "")), ModelNeeds())


@dataclass(frozen=True, kw_only=True, eq=False)
class Effect:
    """Declaration that effects of all kinds share.

    Attributes
    ----------
    name : table of [effects] that turns the effect on; of an instance "kind.instance".
    summary : what the effect is, in one line.
    table : model of the values of the table.
    rank : place among the effects of the job, the lowest first.
    reads : design variables that it depends on besides the lengths of the mechanism, and events of the motion.
    needs : scene keys that must be given.
    companions : effects that must be on too.
    clashes : effects that must be off.
    examples : tables as a scene writes them, for tests and templates.
    letters : symbol of each key of the table in equations; the key itself by default.
    figures : figures of the effect.
    margins : what every design must keep while the effect is on: phrase and kind of quantity.
    least : what a job minimises where its own target leaves room: a key of the table, or a row of a check.
    axes : numbers of the table that may change nothing.
    models : needs of each word of the key `model`.
    many : whether the table holds one table for each of several instances.
    kind, instance : of an instance, its effect and its own name.
    alone : effect whose values may be directly in the table of several instances; None where that is a mistake.
    of_masses : what the effect reports that depends on where masses move, in words; "" for nothing.
    """

    name: str
    summary: str
    table: type[Table]
    rank: int = 100
    reads: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    companions: tuple[str, ...] = ()
    clashes: tuple[EffectClash, ...] = ()
    examples: tuple[Mapping[str, str], ...] = ({},)
    letters: Mapping[str, str] = field(default_factory=dict)
    figures: tuple[Figure, ...] = ()
    margins: Mapping[str, str] = field(default_factory=dict)
    least: str = ""
    axes: tuple[FlatNumber, ...] = ()
    models: Mapping[str, ModelNeeds] = field(default_factory=dict)
    many: bool = False
    kind: str = ""
    instance: str = ""
    alone: "Effect | None" = None
    of_masses: str = ""

    @property
    def path(self) -> tuple[str, ...]:
        """Path of its table inside [effects]: its name; for an instance the name of its kind first."""
        return (self.kind, self.instance) if self.instance else (self.name,)


class LoadTable(NamedTuple):
    """A curve of one's own that a load may be: the key of its table that names a CSV file over the crank angle.

    column, kind: what of the file is the curve, and its kind of quantity; angle: what its angles count from, in words.
    instead: keys of the effect's table that it replaces; needless: needs of the effect that do not apply with it.
    second_column: another column of the file, of the same kind, with which the first one makes a vector.
    Its words (`own[key]` of the formulas) are the curve itself, a `PeriodicCubic`, or the vector's `PeriodicCubics`.
    """

    column: str
    kind: str
    angle: str
    instead: tuple[str, ...]
    needless: tuple[str, ...] = ()
    key: str = "table"
    second_column: str = ""

    @property
    def columns(self) -> dict[str, str]:
        """Columns of the file, with their kinds of quantity."""
        return {"angle": "angle", self.column: self.kind} | (
            {self.second_column: self.kind} if self.second_column else {}
        )


def needed(effect: "Effect", parameters: Table) -> tuple[str, ...]:
    """Scene keys that an effect needs with the values of its table."""
    table = effect.tabulated if isinstance(effect, Load) else None
    given = table is not None and getattr(parameters, table.key) is not None
    own_needs = (*effect.needs, *model_of(effect, parameters).needs)
    return tuple(key for key in own_needs if not (given and table and key in table.needless))


def required(effect: "Effect") -> tuple[str, ...]:
    """Keys that an effect's table must have; keys that a curve may replace are included."""
    table = effect.tabulated if isinstance(effect, Load) else None
    for_curve = table.instead if table else ()
    fields = effect.table.model_fields
    usual = effect.models.get(str(fields["model"].default), ModelNeeds()) if effect.models else ModelNeeds()
    wanted = {*for_curve, *usual.keys}
    return tuple(key for key, info in fields.items() if info.is_required() or (key in wanted and info.default is None))


@dataclass(frozen=True, kw_only=True, eq=False)
class Load(Effect, Generic[Pose]):
    """Algebraic effect: a term of the force that the output needs, or of the crank torque inside the drive.

    Attributes
    ----------
    acts : "output" (times q' it reaches the crank) or "drive" (it reaches the crank only).
    force(at) : the term, N or N·m.
    inside(at) : of an output term, its further part inside the drive, N·m; None for nothing.
    output_share(at) : of a drive term, its part on the links of the output, N·m or N; None for nothing. A state that
        carries the load carries this part, and the rest stays in the drive.
    force_under_loads(at, loading) : the term where it depends on all other terms, in place of `force`.
    corners(at) : crank angles, rad, where the formula changes.
    switch(angle, corners) : formula that is valid at a crank angle inside a piece, as the number `at.switch`.
    known_in(words) : places where the term is known, by the words of its table; empty for the whole cycle.
    moved(at) : inertia, kg·m² or kg, that it adds to the output.
    response(at, oscillator) : z, rad or m, and z˙ of an oscillator that carries the load, in the periodic steady state;
        a load with corners cannot be carried without it.
    symbol : heading of its column of the curves; its name by default.
    cases : for each switch, the range where its formula is valid, in words; by default that between the corners.
    tabulated : table of a curve that may replace its values; None for none.
    mass(at) : the moving mass of one link.
    push(at, term) : force on the link of the output, N, whose moment or work is the term; None where the table does
        not determine it.
    applied(at) : forces on links and joints, where those have names. Only joint forces read the last three.
    """

    acts: Literal["output", "drive"]
    force: Callable[[Inputs[Pose]], Number]
    inside: Callable[[Inputs[Pose]], Number | None] | None = None
    output_share: Callable[[Inputs[Pose]], Number] | None = None
    force_under_loads: Callable[[Inputs[Pose], Loading], Number] | None = None
    corners: Callable[[Inputs[None]], tuple[Number, ...]] | None = None
    switch: Callable[[float, tuple[float, ...]], float] = constant_switch
    known_in: Callable[[Mapping[str, str]], tuple[Place, ...]] = nothing_unknown
    moved: Callable[[Inputs[None]], Number] | None = None
    response: "Callable[[Inputs[Pose], SteadyOscillator], tuple[Number, Number]] | None" = None
    symbol: str = ""
    cases: Mapping[float, str] = field(default_factory=dict)
    tabulated: LoadTable | None = None
    mass: Callable[[Inputs[None]], LinkMass] | None = None
    push: "Callable[[Inputs[Pose], Number], Vector | None] | None" = None
    applied: Callable[[Inputs[Pose]], Sequence[Applied]] | None = None

    def __post_init__(self) -> None:
        """Raise ValueError for a quantity that no job can minimise."""
        if self.least and self.least not in self.table.model_fields:
            raise ValueError(f"effect {self.name}: {self.least} is no key of the table")


def _inertial(moved: Callable[[Inputs[object]], Number], at: Inputs[Motion]) -> Number:
    """Inertia times acceleration of the output."""
    return moved(at) * at.pose.acceleration


def inertia_load(
    name: str,
    summary: str,
    table: type[Table],
    rank: int,
    moved: Callable[[Inputs[object]], Number],
    example: Mapping[str, str],
) -> Load[Any]:
    """Inertia of parts that move with the output: output term moved · q¨, N·m or N.

    moved(at): its inertia, kg·m² or kg; example: a table that it may have. The rest as in `Load`.
    """
    return Load(
        name=name,
        summary=summary,
        table=table,
        rank=rank,
        acts="output",
        force=functools.partial(_inertial, moved),
        moved=moved,
        needs=("operation.speed",),
        examples=(example,),
    )


def nothing_sold(parameters: Any) -> Mapping[str, Sequence[float]]:
    """Empty: no number of the effect comes in sizes."""
    return {}


def no_fault(numbers: Mapping[str, Any]) -> str:
    """Empty: numbers of the effect that are each in their range work together."""
    return ""


def nothing_remarked(at: Inputs[None], shown: ShowValue) -> str:
    """Empty: the figures need no explanation."""
    return ""


def nothing_explained(
    known: Mapping[str, float],
    bounds: Mapping[str, tuple[float, float]],
    parameters: Any,
    clash: Collection[str],
    shown: ShowValue,
) -> str:
    """Empty: the effect has no general explanation."""
    return ""


@dataclass(frozen=True, kw_only=True, eq=False)
class Check(Effect, Generic[Pose]):
    """An effect outside the balance: figures and rows that are read from the solved motion, and their demands.

    The same name in two checks is the same quantity.

    Attributes
    ----------
    quantities : value(at) by name, over the cycle; the figure is the largest |value|.
    rows : value(at) by name, of the design alone.
    demands : what rows or quantities must keep while the effect is on.
    sold(table) : stock sizes of numbers of its table, SI, ascending.
    fault(numbers) : reason why numbers of its table, by key, SI, cannot work together; "" when they can.
    joints(at, loading) : object with the attributes `vectors` and `scalars`; unit directions are its `heading(part)`.
    vectors : attributes whose size is the quantity, with their components.
    scalars : attributes that are quantities themselves.
    sides : for each force, the parts that it acts between, of the first on the second; "frame" for what does not move.
    directed : for each scalar that is the size of a vector, the attribute of the vector: its components are quantities.
    signed : scalars of which the largest value counts.
    pushes : quantities that are 0 where Q is negative, for contact is lost there.
    worked : for each figure that is a mean power over a turn, the attribute that gives the work of each vector's size,
        per rad of the crank.
    wanted : scene keys without which a vector, scalar or quantity has no value.
    fitted(chain) : the check of a user's own linkage.
    link_inertias : inertia loads on links, each with an equation of its own.
    sentence : its equations in words, where a pose has no symbols of its links.
    remark(at, shown) : sentence printed with its figures, in the reader's units; "" for nothing.
    explain(known, bounds, table, clash, shown) : physical reason why limits (names) clash, in the reader's units.
    """

    quantities: Mapping[str, Callable[[Inputs[Pose]], Number]] = field(default_factory=dict)
    rows: Mapping[str, Callable[[Inputs[None]], Number]] = field(default_factory=dict)
    demands: tuple[Demand, ...] = ()
    sold: Callable[[Any], Mapping[str, Sequence[float]]] = nothing_sold
    fault: Callable[[Mapping[str, Any]], str] = no_fault
    joints: Callable[[Inputs[Pose], Loading], Any] | None = None
    vectors: tuple[str, ...] = ()
    scalars: tuple[str, ...] = ()
    sides: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    directed: Mapping[str, str] = field(default_factory=dict)
    signed: tuple[str, ...] = ()
    pushes: tuple[str, ...] = ()
    worked: Mapping[str, str] = field(default_factory=dict)
    wanted: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    fitted: "Callable[[Chain], Check[Any]] | None" = None
    link_inertias: tuple[str, ...] = ()
    sentence: str = ""
    remark: Callable[[Inputs[None], ShowValue], str] = nothing_remarked
    explain: Callable[
        [Mapping[str, float], Mapping[str, tuple[float, float]], Any, Collection[str], ShowValue], str
    ] = nothing_explained

    @property
    def over_cycle(self) -> tuple[str, ...]:
        """Figures that are the largest |value| of something over the cycle."""
        return (*self.quantities, *self.vectors, *self.scalars)

    def __post_init__(self) -> None:
        """Raise ValueError for a demand that no job can satisfy."""
        sides = {figure.name: figure.sides for figure in self.figures}
        faults = [f"quantity {name} is no figure" for name in self.over_cycle if name not in sides]
        faults += [f"mean power {name} is no figure" for name in self.worked if name not in sides]
        faults += [f"quantity {name} has no least" for name in self.over_cycle if "min" in sides.get(name, ())]
        for demand in self.demands:
            if demand.row in self.over_cycle and demand.sign <= 0:
                faults.append(f"quantity {demand.row} has no least")
            if demand.row not in {*self.over_cycle, *self.rows}:
                faults.append(f"{demand.row} is neither a quantity nor a row")
            if isinstance(demand.value, str) and demand.value not in self.table.model_fields:
                faults.append(f"{demand.value} is no key of the table")
        if self.least and self.least not in {*self.rows, *self.table.model_fields}:
            faults.append(f"{self.least} is neither a row nor a key of the table")
        if faults:
            raise ValueError(f"effect {self.name}: {faults[0]}")


class StatePeak(NamedTuple):
    """Figure of a state: the largest |value| of a reading over the cycle, or its least or largest value.

    least: whether the least value counts; signed: whether the largest one does, not the largest |value|.
    """

    read: "Callable[[StateInstant], Number]"
    least: bool = False
    signed: bool = False


def no_oscillator(at: Inputs[None]) -> "SteadyOscillator":
    """Raise LookupError: no load with corners is carried."""
    raise LookupError("the state cannot carry a load with corners")


@dataclass(frozen=True, kw_only=True, eq=False)
class State(Effect):
    """One linear coordinate between the output and the loads that move with it, eliminated before a formula reads it.

    Attributes
    ----------
    carries : names of the loads that move with the coordinate: `force` replaces them in the output force.
    derived(at, carried) : values that follow from the scene's numbers, in the steady state.
    force(at, reply) : term of Q, N or N·m, of derived values; reply is the response z and z˙ to loads with corners.
    coordinate(at, reply) : the coordinate z.
    oscillator(at) : oscillator that responds to loads with corners, of derived values too.
    fixed(at, carried) : words that choose formulas at a design, in floats; `at.table` has those of a neighbour, and a
        valid one is kept. Raises UnsteadyError.
    samples(at) : number of samples of one turn, from which extremes are refined.
    moved(at, coordinate, force, acceleration) : motion of the carried loads, whose q¨ is known already.
    peaks : what each of its figures is the peak of.
    columns : columns of the curves, with unit.
    motion(written, table) : both sides of its equation of motion.
    term(written, table) : `force` in the same symbols.
    difference : the two symbols whose difference is z, the moving one first.
    rests(table) : what neither proofs nor studies of accuracy cover, a sentence without its full stop.
    """

    carries: tuple[str, ...]
    derived: "Callable[[Inputs[None], Carried], Mapping[str, Number]]"
    force: Callable[[Inputs[Any], tuple[Number, Number]], Number]
    coordinate: Callable[[Inputs[Any], tuple[Number, Number]], Number]
    motion: "Callable[[Written, Values], tuple[Number, Number]]"
    term: "Callable[[Written, Values], Number]"
    difference: tuple[str, str]
    rests: Callable[[Values], str]
    oscillator: "Callable[[Inputs[None]], SteadyOscillator]" = no_oscillator
    fixed: "Callable[[Inputs[None], Carried], Mapping[str, str]]" = lambda at, carried: {}
    samples: Callable[[Inputs[None]], float] = lambda at: 0.0
    moved: Callable[[Inputs[Motion], Number, Number, Number], Any] | None = None
    peaks: Mapping[str, StatePeak] = field(default_factory=dict)
    columns: "Mapping[str, Callable[[StateInstant], Number]]" = field(default_factory=dict)
    acts: Literal["output"] = "output"


@dataclass(frozen=True, kw_only=True, eq=False)
class Speed(Effect):
    """Motion of the crank, with a speed that depends on motor and load.

    Attributes
    ----------
    motor(at, omega) : torque of the motor, N·m, at a speed, rad/s; at.values["no_load_speed"] follows from the
        mean speed over time.
    flywheel(at) : inertia, kg·m², of all that turns with the crank.
    rows : value(at, turning) by name, SI, of the solved motion.
    most : row that is the largest torque of the motor.
    """

    motor: Callable[[Inputs[None], Number], Number]
    flywheel: Callable[[Inputs[None]], Number]
    rows: Mapping[str, Callable[[Inputs[None], "CrankTurn"], float]] = field(default_factory=dict)
    most: str = ""


class Rule(NamedTuple):
    """Equation of an effect: its name; left side, sign "=", "<=" or ">=", right side; words that follow."""

    name: str
    left: Number
    sign: str
    right: Number
    where: str = ""


class EventTerms(NamedTuple):
    """Symbols of an event's equations: symbol(name); sum of the output's terms, friction among them, mass."""

    symbol: Callable[[str], Number]
    total: Number
    friction: Number
    mass: Number


@dataclass(frozen=True, kw_only=True, eq=False)
class Event(Effect):
    """Loss and return of the output's contact, simulated for a given design and never inside a program.

    Attributes
    ----------
    force : quantity that is the contact force.
    least : quantity that is largest where the contact force is least.
    free(given, q, velocity, acceleration, direction) : pose of the output in flight, as its loads read it; direction of
        its motion, between −1 and 1 at rest.
    places(given) : position of the output, m or rad, at each event of the motion that loads read.
    follow(body, cam, table) : course of the motion from contact at crank angle 0 on.
    read(course) : figures of a course where contact is lost.
    rules(terms) : equation of motion, and the conditions of landing.
    """

    force: str
    least: str
    free: Callable[[Values, float, float, float, float], Motion]
    places: Callable[[Values], Mapping[str, float]]
    follow: "Callable[[Body, Cam, Values], Course]"
    read: "Callable[[Course], Mapping[str, float | None]]"
    rules: Callable[[EventTerms], Sequence[Rule]]

    def rests(self, table: Values) -> str:
        """Parts of the effect that no proof and no study of accuracy covers."""
        return f"{self.name}, which is simulated ({', '.join(figure.name for figure in self.figures)})"


EVALUATED = (Speed,)
"""Kinds with which a design is evaluated and simulated, but neither optimised nor proven."""


@functools.cache
def instance(effect: Effect, name: str) -> Effect:
    """Instance of an effect that a scene may have several times: the same object for the same name."""
    return replace(effect, name=f"{effect.name}.{name}", kind=effect.name, instance=name)


def ranked(effects: Iterable[Effect]) -> dict[str, Effect]:
    """Effects by name, in the order of their ranks."""
    return {effect.name: effect for effect in sorted(effects, key=lambda effect: (effect.rank, effect.name))}


class SteadyOscillator(Protocol):
    """Linear state as in `motion/harmonic.py`, with its response to loads with corners."""

    @property
    def turn(self) -> Number:
        """Time of one turn, s."""

    def steady(self, frequency: Number, /) -> tuple[Number, Number]:
        """A and B of its answer A cos Ωt + B sin Ωt to the force cos Ωt; frequency: Ω, rad/s."""

    def steady_cubic(self, force: Sequence[Number], /) -> tuple[Number, Number, Number, Number]:
        """Coefficients of the cubic in time that responds to a cubic force; force: its coefficients, N or N·m."""

    def repeated(self, position: Number, rate: Number, /) -> tuple[Number, Number]:
        """z and z˙ just after a kick of both, once a turn for ever."""

    def ringing(self, after: tuple[Number, Number], elapsed: Number, /) -> tuple[Number, Number]:
        """z and z˙ of the free vibration that begins with `after`; elapsed: time since then, s."""


class Carried(NamedTuple):
    """Bodies that move with a state's coordinate.

    inertia: of it all, kg·m² or kg; weigh(angles, weights): sums Σ weights[k][i] F(angles[i]) at crank angles, rad, of
    the terms F without corners.
    """

    inertia: Number
    weigh: Callable[[Sequence[Number], Sequence[Sequence[Number]]], list[Number]]


class UnsteadyError(ArithmeticError):
    """Error for a state without a reliable steady state: problem and remedy in words."""

    def __init__(self, problem: str, remedy: str) -> None:
        super().__init__(problem)
        self.problem, self.remedy = problem, remedy


class StateInstant(NamedTuple):
    """Readings of a state at one instant; force(): Q, N or N·m; coordinate(): z, with the response to corners."""

    pose: Number
    coordinate: Callable[[], Number]
    force: Callable[[], Number]


class Written(NamedTuple):
    """Symbols of a state's equation of motion: z, z', z'' with respect to φ, and the excitation."""

    coordinate: tuple[Number, Number, Number]
    omega: Number
    inertia: Number
    force: Number


@functools.lru_cache(maxsize=256)
def keys(table: type[Table]) -> tuple[str, ...]:
    """Keys of a table's values, those of the tables inside it dotted."""
    names: list[str] = []
    for key, info in table.model_fields.items():
        kinds = (info.annotation, *get_args(info.annotation))
        inner = next((kind for kind in kinds if isinstance(kind, type) and issubclass(kind, Table)), None)
        names += [f"{key}.{inner_key}" for inner_key in keys(inner)] if inner else [key]
    return tuple(names)


def value_at(table: Table, key: str) -> object:
    """Value of a table by a dotted key; None if the key or its table is not given."""
    value: object = table
    for part in key.split("."):
        value = None if value is None else getattr(value, part)
    return value


def owned(effect: Effect, key: str) -> str:
    """Full name of a number of an effect's table, unique in a scene."""
    return f"{effect.name}.{key}"


def lacking(check: Check[Any], known: Collection[str]) -> dict[str, tuple[str, ...]]:
    """Figures of a check that have no value, each with the scene keys that it needs and that are missing.

    known: names of scene numbers that are given; empty for all of them.
    """
    figures: dict[str, tuple[str, ...]] = {}
    for name, keys in check.wanted.items():
        missing = tuple(key for key in keys if known and key.split(".", 1)[1] not in known)
        figures |= {name: missing} if missing else {}
    return figures


def keys_in_words(missing: Collection[str], known: Collection[str]) -> str:
    """Scene keys in words; of an empty table inside an effect's table the name of the table alone."""
    given = {tuple(name.split(".")[:2]) for name in known}
    cut = {key: key.split(".") for key in missing}
    named = (".".join(parts[: len(parts) if tuple(parts[1:3]) in given else 3]) for parts in cut.values())
    return " and ".join(dict.fromkeys(named))


def label(effect: Effect, key: str) -> str:
    """Label of a number of an effect's table; of an instance it contains the instance's name."""
    return f"{effect.instance}.{key}" if effect.instance else key


@functools.cache
def of(package: str, variant: str = "EFFECT") -> Mapping[str, Effect]:
    """Effects that the modules of a package declare as EFFECT, by name, the lowest rank first.

    variant: another name under which a module may declare it, or None where it then has no effect.
    """
    folder = importlib.import_module(package)
    names = [entry.name for entry in pkgutil.iter_modules(folder.__path__)]
    modules = [importlib.import_module(f"{package}.{name}") for name in names]
    effects = (getattr(module, variant, module.EFFECT) for module in modules if hasattr(module, "EFFECT"))
    return ranked(effect for effect in effects if effect is not None)


class Fault(NamedTuple):
    """An effect that cannot be on: the other effect that is missing or in its way, and the problem in words."""

    effect: Effect
    other: str
    missing: bool
    problem: str


def faults(active: Mapping[Effect, Table]) -> Iterator[Fault]:
    """Yield the conflicts of effects; active: effects with their tables, in the order of the job."""
    tables = {effect.name: table for effect, table in active.items()}
    for effect in active:
        for name in effect.companions:
            if name not in tables:
                yield Fault(effect, name, True, f"effect {effect.name} needs the effect {name}")
        carried = effect.carries if isinstance(effect, State) else ()
        for load in active:
            if isinstance(load, Load) and load.name in carried and load.corners and not load.response:
                problem = (
                    f"effect {effect.name} carries {load.name}, which has corners: its response has no closed form"
                )
                yield Fault(effect, load.name, False, problem)
        for clash in effect.clashes:
            if clash.effect in tables:
                word = str(getattr(tables[clash.effect], clash.key)) if clash.key else ""
                if not clash.words or word in clash.words:
                    kind = f" with {clash.key} {word}" if word else ""
                    problem = f"effects {effect.name} and {clash.effect}{kind} cannot be on together: {clash.why}"
                    yield Fault(effect, clash.effect, False, problem)
