"""The order of an NLP's variables and rows, and multipliers read by what they are of: nobody else counts places.

Rows: limits that are a row each; smooth pieces below epigraph variables; whole-cycle rows at stations, family by
family; whole-cycle rows at nodes, so many slots of each family; behind all these the definitions of lifted variables.
Variables: the design's; the extra ones, which are epigraph variables, or excesses of an elastic NLP; the lifted ones.
"""

import functools
import math
from collections.abc import Collection, Hashable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from loomopt.base.records import lazy
from loomopt.maths import systems
from loomopt.maths.systems import Maths, Number
from loomopt.model.kinematics import Chain
from loomopt.model.limits import CycleLimit
from loomopt.model.model import Integral, JobModel
from loomopt.model.program import Program
from loomopt.model.reading import DATUM, fixed_nodes, quadrature
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.balance import Given
from loomopt.physics.cycle import Cycle, Floats, Node, Where, node_angle
from loomopt.physics.schema import Values
from loomopt.physics.tolerances import BINDING


class Layout:
    """Where each array stands, in the order in which room was made for them."""

    def __init__(self) -> None:
        self.places: dict[str, tuple[int, tuple[int, ...]]] = {}
        self.size = 0

    def add(self, name: str, *shape: int) -> None:
        """Reserve room for an array."""
        self.places[name] = (self.size, shape)
        self.size += math.prod(shape)

    def part(self, vector: Any, name: str) -> Any:
        """Return the entries of an array as a part of the vector, of whatever kind that is."""
        begin, shape = self.places[name]
        return vector[begin : begin + math.prod(shape)]

    def array(self, vector: Any, name: str) -> Any:
        """Return an array in a vector of NumPy's; what is put into it stands in the vector."""
        return self.part(vector, name).reshape(self.places[name][1])

    def before(self, vector: Any, name: str) -> Any:
        """Return what stands before an array."""
        return vector[: self.places[name][0]]

    def write(self, vector: Floats, name: str, values: Any) -> None:
        """Put an array in its place."""
        self.part(vector, name)[:] = np.asarray(values, dtype=float).ravel()

    def read(self, vector: Any, name: str) -> list[Any]:
        """Return the entries of an array as a flat list."""
        begin, shape = self.places[name]
        return [vector[begin + k] for k in range(math.prod(shape))]

    def columns(self, column: Any, name: str) -> list[Any]:
        """Return the rows of a two-dimensional array in a column of CasADi's, each as a column."""
        begin, (count, width) = self.places[name]
        return [column[begin + k * width : begin + (k + 1) * width] for k in range(count)]

    def rows(self, vector: Any, name: str) -> list[list[Any]]:
        """Return the entries of a two-dimensional array, row by row."""
        flat, (count, width) = self.read(vector, name), self.places[name][1]
        return [flat[k * width : (k + 1) * width] for k in range(count)]


class Epigraph(NamedTuple):
    """A variable above all rows of one group of an objective; objective: its place in the program."""

    objective: int
    rows: tuple[str, ...]


class RowFamily(NamedTuple):
    """The whole-cycle rows of one quantity: below an epigraph variable, or below a limit, each by its place.

    where: the pieces they are asked for, every one without it; known: those where the quantity is known at all.
    square: the quantity that is its square, where rows below a limit compare squares: it has a corner at 0 itself.
    """

    row: str
    epigraph: int = -1
    limit: int = -1
    where: Where | None = None
    known: tuple[Where, ...] = ()
    square: str = ""

    def counts(self, switch: Values) -> bool:
        """Say whether it has rows on the pieces of a switch."""
        asked = self.where is None or switch.get(self.where[0]) == self.where[1]
        return asked and (not self.known or any(switch.get(name) == value for name, value in self.known))


def epigraphs(program: Program, elastic: bool = False) -> tuple[Epigraph, ...]:
    """Return the epigraph variables of a program's objectives, in order; an elastic one has no objectives."""
    levels = [] if elastic else list(enumerate(program.objectives))
    return tuple(Epigraph(k, level.rows) for k, level in levels if not level.is_smooth)


def families(program: Program, elastic: bool = False) -> list[RowFamily]:
    """Return the whole-cycle rows a program needs: first those of objectives, then those of limits."""
    above = enumerate(epigraphs(program, elastic))
    peaks = [(k, row) for k, epigraph in above for row in program.objectives[epigraph.objective].quantities]
    limits, known = program.cycle_limits.items(), program.model.known_of
    return [
        *(RowFamily(row, epigraph=k, known=known(row)) for k, row in peaks),
        *(RowFamily(limit.row, -1, k, limit.where, known(limit.row), squared(program, limit)) for k, limit in limits),
    ]


def squared(program: Program, limit: CycleLimit) -> str:
    """Return the quantity that is the square of what a limit reads, where both may be squared; "" else."""
    return program.model.square(limit.row) if limit.bound > 0.0 else ""


class Station(NamedTuple):
    """A corner of the cycle by its place among those declared, and the switches of the motion's arcs there, by name."""

    corner: int
    switch: Values


def chained(model: JobModel, variables: Collection[str]) -> tuple[str, ...]:
    """Return the derived values that follow one after the other where these are the variables, in order."""
    return tuple(name for chain in _chains(model, variables).values() for name in chain.names)


def chain_roots(model: JobModel, variables: Collection[str]) -> frozenset[str]:
    """Return the variables that these values follow from."""
    return frozenset(name for chain in _chains(model, variables).values() for name in chain.roots if name in variables)


def chain_values(model: JobModel, variables: Collection[str], system: Maths, values: Values) -> dict[str, Number]:
    """Return what each of these values is worth by those before it; values: with all of them."""
    chains = _chains(model, variables).values()
    return {name: value for chain in chains for name, value in chain.follow(system, values).items()}


def stations(model: JobModel, given: Given, variables: Collection[str]) -> tuple[Station, ...]:
    """Return the corners at which whole-cycle rows are likely to bind where these are the variables; given: floats."""
    first, found, chains = 0, [], _chains(model, variables)
    for arc in model.kinematics.arcs if chains else ():
        if arc.name in chains:
            found += [Station(first + k, switch) for k, switch in enumerate(chains[arc.name].stations)]
        first += len(arc.corners(systems.FLOAT, given))
    return tuple(found)


def station_switches(model: JobModel, variables: Collection[str]) -> list[Values]:
    """Return the switches of these corners alone."""
    return [switch for chain in _chains(model, variables).values() for switch in chain.stations]


def _chains(model: JobModel, variables: Collection[str]) -> dict[str, Chain]:
    """Return the chains that hang on variables by their arcs' names."""
    chains = {arc.name: arc.chain for arc in model.kinematics.arcs if arc.chain}
    return {name: chain for name, chain in chains.items() if chain.roots.intersection(variables)}


def held(switches: Sequence[Values], family: RowFamily) -> list[int]:
    """Return the places of the stations, of these switches, where a family has a row."""
    return [k for k, switch in enumerate(switches) if family.counts(switch)]


class HeldStations:
    """Stations in a cycle, each on the piece whose switches of the motion's arcs are its own."""

    def __init__(self, stations: Sequence[Station], cycle: Cycle) -> None:
        self.cycle = cycle
        self.place = {station.corner: k for k, station in enumerate(stations)}
        closed = {name for station in stations for name in station.switch}
        self.opened = [k for k, name in enumerate(cycle.names) if name not in closed]
        starts = {corner: piece for piece, (corner, _) in enumerate(cycle.order)}
        self.pieces = np.zeros(len(stations), dtype=np.intp)
        self.u = np.zeros(len(stations))
        for k, station in enumerate(stations):
            piece = starts[station.corner]
            own = cycle.switch(piece)
            if any(own[name] != value for name, value in station.switch.items()):
                piece, self.u[k] = (piece - 1) % cycle.pieces, 1.0
            self.pieces[k] = piece

    def switches(self, names: Sequence[str]) -> Floats:
        """Return the switches that stations leave open, (stations, names); 0 for one the cycle does not have."""
        found = np.zeros((len(self.pieces), len(names)))
        for k, name in enumerate(names):
            if name in self.cycle.names:
                found[:, k] = self.cycle.switches[self.pieces, self.cycle.names.index(name)]
        return found

    def signs(self, sampler: Sampler, row: str) -> Floats:
        """Return what a quantity is multiplied by at each station to give what is compared with a bound."""
        if row in sampler.model.signed or not self.place:
            return np.ones(len(self.pieces))
        return np.where(sampler.at(row, self.pieces, self.u) < 0.0, -1.0, 1.0)

    def station(self, extreme: Extreme) -> int | None:
        """Return the place of the station that an extreme stands at, on its side of what loads do there; else None."""
        if not self.place or extreme.u not in (0.0, 1.0):
            return None
        corner = self.cycle.order[(extreme.piece + int(extreme.u)) % self.cycle.pieces][0]
        found = self.place.get(corner)
        if found is None:
            return None
        here, there = (self.cycle.switches[piece] for piece in (extreme.piece, self.pieces[found]))
        return found if np.array_equal(here[self.opened], there[self.opened]) else None


Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class RowMap:
    """Where the variables and rows of one NLP stand.

    limits: places in the program of those that are a row each; pieces: how many rows there are below each epigraph
    variable; stations: rows of each family there; slots: its rows at nodes; variables, extras, lifted: how many there
    are of each.
    """

    limits: tuple[int, ...] = ()
    pieces: tuple[int, ...] = ()
    stations: tuple[int, ...] = ()
    slots: int = 0
    variables: int = 0
    extras: int = 0
    lifted: int = 0

    @lazy
    def _g(self) -> Layout:
        layout = Layout()
        layout.add("limits", len(self.limits))
        for k, count in enumerate(self.pieces):
            layout.add(f"pieces {k}", count)
        for k, count in enumerate(self.stations):
            layout.add(f"stations {k}", count)
        layout.add("nodes", len(self.stations), self.slots)
        layout.add("definitions", self.lifted)
        return layout

    @lazy
    def _x(self) -> Layout:
        layout = Layout()
        layout.add("design", self.variables)
        layout.add("extra", self.extras)
        layout.add("lifted", self.lifted)
        return layout

    @property
    def size(self) -> int:
        """How many rows there are."""
        return self._g.size

    def sized(self, size: int) -> "RowMap":
        """Return where all stands with so many slots that there are `size` rows."""
        rest = size - replace(self, slots=0).size
        return replace(self, slots=rest // len(self.stations) if self.stations else self.slots)

    def stacked(self, limits: Any, pieces: Sequence[Any], stations: Sequence[Any], nodes: Sequence[Any]) -> list[Any]:
        """Return columns of rows in their order: of limits, of each epigraph variable, of each family, of each node."""
        return [limits, *pieces, *stations, *nodes]

    def of_limits(self, g: Any) -> Any:
        """Return the rows of limits, in order of `limits`."""
        return self._g.part(g, "limits")

    def of_pieces(self, g: Any, epigraph: int) -> Any:
        """Return the rows below an epigraph variable, in order of its objective's sides."""
        return self._g.part(g, f"pieces {epigraph}")

    def at_stations(self, g: Any, family: int) -> Any:
        """Return the rows of a family at stations."""
        return self._g.part(g, f"stations {family}")

    def before_nodes(self, g: Any) -> Any:
        """Return the rows that no slots are made for: of limits, below epigraph variables and at stations."""
        return self._g.before(g, "nodes")

    def at_nodes(self, g: Any) -> Any:
        """Return the rows at nodes: an array (families, slots)."""
        return self._g.array(g, "nodes")

    def used(self, counts: Sequence[int]) -> Flags:
        """Say which slots (families, slots) are used where families have so many nodes."""
        found: Flags = np.arange(self.slots) < np.array(counts, dtype=np.intp)[:, None]
        return found

    def joined(self, design: Floats, extra: Floats) -> Floats:
        """Return the variables in their order."""
        return np.concatenate([design, extra])

    def parted(self, x: Any) -> tuple[Any, Any]:
        """Return the design's variables and the extra ones."""
        return self._x.part(x, "design"), self._x.part(x, "extra")

    def own_rows(self, g: Any) -> Any:
        """Return all rows but the definitions of lifted variables."""
        return self._g.before(g, "definitions")

    def definitions(self, g: Any) -> Any:
        """Return the rows that define lifted variables."""
        return self._g.part(g, "definitions")

    def own_variables(self, x: Any) -> Any:
        """Return all variables but those that are lifted."""
        return self._x.before(x, "lifted")

    def lifted_variables(self, x: Any) -> Any:
        """Return the lifted variables."""
        return self._x.part(x, "lifted")


def row_map(program: Program, slots: int, elastic: bool = False) -> RowMap:
    """Return where the variables and rows of a program's NLP stand; slots: nodes of each family.

    Bounds of variables are the solver's own, and no rows, unless they may give way.
    """
    above = epigraphs(program, elastic)
    names = [variable.name for variable in program.variables]
    switches = station_switches(program.model, names)
    ways = {way for ways in program.excess_places.values() for way in ways}
    return RowMap(
        tuple(program.single_limits if elastic else program.design_limits),
        tuple(len(program.objectives[epigraph.objective].sides) for epigraph in above),
        tuple(len(held(switches, family)) for family in families(program, elastic)),
        slots,
        len(names),
        len(ways) if elastic else len(above),
    )


class BindingRows(NamedTuple):
    """Which rows and bounds bind."""

    rows: Flags
    at_lower: Flags
    at_upper: Flags


def binding(lam_x: Floats, lam_g: Floats, least: float = BINDING) -> BindingRows:
    """Return what binds at multipliers of more than `least`: of variables positive at an upper bound, else negative."""
    return BindingRows(np.abs(lam_g) > least, lam_x < -least, lam_x > least)


@dataclass(frozen=True, eq=False)
class Multipliers:
    """Multipliers of an NLP's variables and rows, and where these stand; false where there are none."""

    rows: RowMap = RowMap()
    lam_x: Floats = field(default_factory=lambda: np.zeros(0))
    lam_g: Floats = field(default_factory=lambda: np.zeros(0))

    def __bool__(self) -> bool:
        """Say whether there are any."""
        return self.lam_x.size > 0

    @property
    def of_variables(self) -> Floats:
        """Those of the design's variables."""
        found: Floats = self.rows.parted(self.lam_x)[0]
        return found

    @property
    def of_limits(self) -> dict[int, float]:
        """Those of limits that are a row each, by the limit's place."""
        return dict(zip(self.rows.limits, self.rows.of_limits(self.lam_g).tolist(), strict=True))

    def of_pieces(self, epigraph: int) -> Floats:
        """Return those of the rows below an epigraph variable."""
        found: Floats = self.rows.of_pieces(self.lam_g, epigraph)
        return found

    @property
    def at_stations(self) -> list[Floats]:
        """Those of whole-cycle rows at stations, of each family."""
        return [self.rows.at_stations(self.lam_g, k) for k in range(len(self.rows.stations))]

    @property
    def at_nodes(self) -> Floats:
        """Those of whole-cycle rows at nodes, (families, slots)."""
        found: Floats = self.rows.at_nodes(self.lam_g)
        return found

    def on(self, rows: RowMap) -> "Multipliers":
        """Return them for the same NLP with other slots: 0 in those that come, without those that go."""
        before = self.at_nodes
        common = min(self.rows.slots, rows.slots)
        lam_g = np.zeros(rows.size)
        rows.before_nodes(lam_g)[:] = self.rows.before_nodes(self.lam_g)
        rows.at_nodes(lam_g)[:, :common] = before[:, :common]
        return Multipliers(rows, self.lam_x, lam_g)

    def grown(self, rows: RowMap) -> Floats:
        """Return those of rows in their places for an NLP that has grown, 0 behind them: what IPOPT starts warm from.

        Of several families a node's multiplier may then stand with another's. Carried family by family (`on`) IPOPT
        takes other ways, and the end of a rapier's front in another basin (results/rapier.peak_acceleration-against-
        dwell.csv): a start is no more than that, and where it ends is judged apart.
        """
        lam_g = np.zeros(rows.size)
        common = min(rows.size, self.rows.size)
        lam_g[:common] = self.lam_g[:common]
        return lam_g

    def binding(self, rows: RowMap, counts: Sequence[int]) -> BindingRows:
        """Return what binds with nodes of the same NLP in other slots: so many of each family, from the first on."""
        found = binding(self.lam_x, self.on(rows).lam_g)
        rows.at_nodes(found.rows)[:] = rows.used(counts)
        return found


class NodeParameters(NamedTuple):
    """A node as parameters: offsets of width and angle, a coefficient of each corner in either, then the switches."""

    corners: int
    switches: tuple[str, ...]

    @property
    def size(self) -> int:
        """How many parameters a node has."""
        return 2 + 2 * self.corners + len(self.switches)

    @property
    def angle(self) -> slice:
        """Where offset and coefficients of a node's angle stand."""
        return slice(1, 2 + self.corners)

    @property
    def width(self) -> slice:
        """Where the corners' coefficients in its width stand."""
        return slice(2 + self.corners, 2 + 2 * self.corners)

    @property
    def places(self) -> slice:
        """Where its switches stand."""
        return slice(2 + 2 * self.corners, self.size)

    def write(self, cycle: Cycle, piece: int, u: float, weight: float = 0.0) -> list[float]:
        """Return the parameters of a node (piece, u); weight: its share of the piece's width."""
        offset, coefficients = cycle.coefficients(piece, u, self.corners)
        width = [0.0] * (1 + self.corners)
        if weight:
            start, at_start = cycle.coefficients(piece, 0.0, self.corners)
            end, at_end = cycle.coefficients(piece, 1.0, self.corners)
            width = [weight * (end - start), *(weight * (at_end - at_start))]
        switches = [*cycle.switches[piece], *[0.0] * (len(self.switches) - len(cycle.names))]
        return [width[0], offset, *coefficients, *width[1:], *switches]

    def write_fixed(self, cycle: Cycle, mean: Integral) -> list[list[float]]:
        """Return the parameters of a mean's nodes at its own angles, of width 1, which no corner moves."""
        phi, switch = fixed_nodes(cycle, mean)
        columns = [np.broadcast_to(switch[name], phi.shape) for name in self.switches]
        still = [0.0] * (2 * self.corners)
        return [[1.0, float(angle), *still, *map(float, own)] for angle, *own in zip(phi, *columns, strict=True)]

    def read(self, row: Sequence[Number], corners: Sequence[Number]) -> Node:
        """Return the node that parameters say; corners: their crank angles, rad."""
        phi = node_angle(row[1], row[2 : 2 + self.corners], corners)
        return Node(phi, dict(zip(self.switches, row[2 + 2 * self.corners :], strict=True)))


@dataclass(frozen=True, eq=False)
class Structure:
    """What one built NLP is made of; it serves every program of the same structure.

    elastic: instead of the objectives, the least weighted excess of the relaxable limits is sought. slots: nodes of
    each family. hints: names of values that corners without a formula start from. corners: how many the cycle has.
    points: nodes of each mean over the cycle, by its name. stations: corners at which families have rows of their own.
    """

    program: Program
    slots: int
    elastic: bool
    hints: tuple[str, ...]
    corners: int
    points: tuple[tuple[str, int], ...]
    stations: tuple[Station, ...] = ()

    @property
    def key(self) -> Hashable:
        """Equal for structures that one built NLP serves."""
        squares = tuple(family.square for family in self.families)
        return self.program.structure, self.slots, self.elastic, self.hints, self.corners, self.points, squares

    @functools.cached_property
    def families(self) -> list[RowFamily]:
        """Whole-cycle rows, in order."""
        return families(self.program, self.elastic)

    @functools.cached_property
    def epigraphs(self) -> tuple[Epigraph, ...]:
        """Epigraph variables, in order."""
        return epigraphs(self.program, self.elastic)

    @functools.cached_property
    def rows(self) -> RowMap:
        """Where its variables and rows stand."""
        return row_map(self.program, self.slots, self.elastic)

    @functools.cached_property
    def excess_places(self) -> dict[int, tuple[int, ...]]:
        """Limits that may give way by place → the places of their excess variables."""
        return self.program.excess_places if self.elastic else {}

    @functools.cached_property
    def means(self) -> list[Integral]:
        """Means over the cycle that its rows read."""
        return means(self.program, self.elastic)

    @functools.cached_property
    def node(self) -> NodeParameters:
        """How a node is written as parameters."""
        model = self.program.model
        datum = (DATUM,) if any(mean.angles for mean in model.integrals) else ()
        return NodeParameters(self.corners, (*model.switches, *datum))

    @functools.cached_property
    def recurrent(self) -> tuple[str, ...]:
        """Derived values that follow one after the other, in order."""
        return chained(self.program.model, self.names)

    @property
    def names(self) -> list[str]:
        """The design's variables."""
        return [variable.name for variable in self.program.variables]

    @functools.cached_property
    def open_switches(self) -> tuple[str, ...]:
        """Switches that stations leave open."""
        known = {name for station in self.stations for name in station.switch}
        return tuple(name for name in self.node.switches if name not in known)

    @functools.cached_property
    def held(self) -> list[list[int]]:
        """Of each family the places of the stations where it has a row."""
        return [held([station.switch for station in self.stations], family) for family in self.families]

    @functools.cached_property
    def layout(self) -> Layout:
        """Where each parameter stands: numbers, then nodes."""
        program, layout = self.program, Layout()
        layout.add("values", len(program.parameters))
        layout.add("hints", len(self.hints))
        layout.add("variable scale", len(program.variables))
        layout.add("limit", len(program.limits))
        layout.add("limit scale", len(program.limits))
        layout.add("objective weight", len(program.objectives))
        layout.add("objective scale", len(program.objectives))
        layout.add("way weight", self.rows.extras if self.elastic else 0)
        for event in program.model.events_read:
            layout.add(f"still {event}", len(program.model.switches))
        layout.add("station", len(self.stations), len(self.open_switches))
        for k, places in enumerate(self.held):
            layout.add(f"sign {k}", len(places))
        layout.add("nodes", 0)
        for name, count in self.points:
            layout.add(f"mean {name}", count, self.node.size)
        for k in range(len(self.families)):
            layout.add(f"family {k}", self.slots, 2 + self.node.size)
        return layout

    def vector(
        self,
        program: Program,
        sampler: Sampler,
        weights: Sequence[float],
        nodes: Sequence[Sequence[Extreme]],
        costs: Sequence[float] | Floats = (),
    ) -> Floats:
        """Return the parameter vector for a program's numbers and the nodes of each family."""
        p, write, node, cycle = np.zeros(self.layout.size), self.layout.write, self.node, sampler.cycle
        write(p, "values", list(program.parameters.values()))
        write(p, "hints", list(sampler.hints.values()))
        write(p, "variable scale", [variable.scale for variable in program.variables])
        write(p, "limit", [limit.bound for limit in program.limits])
        write(p, "limit scale", [limit.scale for limit in program.limits])
        write(p, "objective weight", weights)
        write(p, "way weight", costs)
        write(p, "objective scale", [objective.scale for objective in program.objectives])
        for event, switch in sampler.stills.items():
            write(p, f"still {event}", [switch[name] for name in program.model.switches])
        for mean in means(program, self.elastic):
            write(p, f"mean {mean.name}", self._rule(cycle, mean))
        stood = HeldStations(self.stations, cycle)
        write(p, "station", stood.switches(self.open_switches))
        for k, family in enumerate(self.families):
            write(p, f"sign {k}", stood.signs(sampler, family.row)[self.held[k]])
        for k, chosen in enumerate(nodes):
            used = [[1.0, e.sign, *node.write(cycle, e.piece, e.u)] for e in chosen]
            idle = [[0.0, 1.0, *node.write(cycle, 0, 0.5)]] * (self.slots - len(used))
            write(p, f"family {k}", used + idle)
        return p

    def _rule(self, cycle: Cycle, mean: Integral) -> list[list[float]]:
        """Return the parameters of a mean's nodes."""
        if mean.angles:
            return self.node.write_fixed(cycle, mean)
        rule = zip(*quadrature(cycle, mean), strict=True)
        return [self.node.write(cycle, int(piece), float(u), float(weight)) for piece, u, weight in rule]


def means(program: Program, elastic: bool) -> list[Integral]:
    """Return the means that a limit reads, or an objective; an elastic program has no objectives."""
    read = {row for limit in program.limits for row in limit.reads}
    read |= set() if elastic else {row for objective in program.objectives for row in objective.rows}
    return [mean for mean in program.model.integrals if {mean.name, mean.root} & read]


def structure(program: Program, sampler: Sampler, slots: int, elastic: bool = False) -> Structure:
    """Return the structure of the NLP that a program needs at a design."""
    points = tuple(
        (mean.name, len(mean.angles) or len(quadrature(sampler.cycle, mean)[0])) for mean in means(program, elastic)
    )
    corners = stations(program.model, sampler.given, [variable.name for variable in program.variables])
    return Structure(program, slots, elastic, tuple(sampler.hints), sampler.corner_count, points, corners)
