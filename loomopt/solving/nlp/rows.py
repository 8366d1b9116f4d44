"""Order of an NLP's variables and rows; multipliers are read by variable, limit and row family, never by index.

Rows: limits that are a row each; smooth pieces below epigraph variables; whole-cycle rows at stations, family by
family; whole-cycle rows at nodes, in the slots of each family; then the definitions of lifted variables.
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
from loomopt.model.kinematics import DerivedChain
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
    """Place of each array in one flat vector, in the order in which the arrays were added."""

    def __init__(self) -> None:
        self.places: dict[str, tuple[int, tuple[int, ...]]] = {}
        self.size = 0

    def add(self, name: str, *shape: int) -> None:
        """Reserve room for an array of a shape."""
        self.places[name] = (self.size, shape)
        self.size += math.prod(shape)

    def part(self, vector: Any, name: str) -> Any:
        """Entries of an array, as a part of a vector of any kind."""
        begin, shape = self.places[name]
        return vector[begin : begin + math.prod(shape)]

    def array(self, vector: Any, name: str) -> Any:
        """An array as a view into a NumPy vector: writing to it writes to the vector."""
        return self.part(vector, name).reshape(self.places[name][1])

    def prefix(self, vector: Any, name: str) -> Any:
        """Entries of a vector in front of an array."""
        return vector[: self.places[name][0]]

    def write(self, vector: Floats, name: str, values: Any) -> None:
        """Write an array to its place in a vector."""
        self.part(vector, name)[:] = np.asarray(values, dtype=float).ravel()

    def read(self, vector: Any, name: str) -> list[Any]:
        """Entries of an array as a flat list."""
        begin, shape = self.places[name]
        return [vector[begin + k] for k in range(math.prod(shape))]

    def columns(self, column: Any, name: str) -> list[Any]:
        """Rows of a two-dimensional array in a CasADi column, each as a column."""
        begin, (count, width) = self.places[name]
        return [column[begin + k * width : begin + (k + 1) * width] for k in range(count)]

    def rows(self, vector: Any, name: str) -> list[list[Any]]:
        """Entries of a two-dimensional array, row by row."""
        flat, (count, width) = self.read(vector, name), self.places[name][1]
        return [flat[k * width : (k + 1) * width] for k in range(count)]


class Epigraph(NamedTuple):
    """Variable above all rows of one group of an objective; objective: its place in the program."""

    objective: int
    rows: tuple[str, ...]


class RowFamily(NamedTuple):
    """Whole-cycle rows of one quantity, below an epigraph variable or below a limit; both are given by place.

    where: the pieces on which the rows are required, None for all; known: the pieces on which the quantity exists.
    square: name of the quantity's square, where rows compare squares because the quantity has a corner at 0.
    """

    row: str
    epigraph: int = -1
    limit: int = -1
    where: Where | None = None
    known: tuple[Where, ...] = ()
    square: str = ""

    def has_rows(self, switch: Values) -> bool:
        """Whether the family has rows on the pieces of a switch."""
        required = self.where is None or switch.get(self.where[0]) == self.where[1]
        return required and (not self.known or any(switch.get(name) == value for name, value in self.known))


def epigraphs(program: Program, elastic: bool = False) -> tuple[Epigraph, ...]:
    """Epigraph variables of a program's objectives, in order; an elastic program has no objectives."""
    levels = [] if elastic else list(enumerate(program.objectives))
    return tuple(Epigraph(k, level.rows) for k, level in levels if not level.is_smooth)


def families(program: Program, elastic: bool = False) -> list[RowFamily]:
    """Whole-cycle rows of a program: first those of objectives, then those of limits."""
    epigraph_places = enumerate(epigraphs(program, elastic))
    peaks = [(k, row) for k, epigraph in epigraph_places for row in program.objectives[epigraph.objective].quantities]
    limits, known = program.cycle_limits.items(), program.model.known_of
    return [
        *(RowFamily(row, epigraph=k, known=known(row)) for k, row in peaks),
        *(
            RowFamily(limit.row, -1, k, limit.where, known(limit.row), square_quantity(program, limit))
            for k, limit in limits
        ),
    ]


def square_quantity(program: Program, limit: CycleLimit) -> str:
    """Name of the square of the quantity that a limit reads, where both sides may be squared; "" otherwise."""
    return program.model.square(limit.row) if limit.bound > 0.0 else ""


class Station(NamedTuple):
    """Corner of the cycle, by its place among the declared corners, and the switches of the motion's arcs there."""

    corner: int
    switch: Values


def chain_names(model: JobModel, variables: Collection[str]) -> tuple[str, ...]:
    """Names of the derived values that follow from each other when `variables` are free, in order."""
    return tuple(name for chain in _chains(model, variables).values() for name in chain.names)


def chain_roots(model: JobModel, variables: Collection[str]) -> frozenset[str]:
    """Variables from which the chained values follow."""
    return frozenset(name for chain in _chains(model, variables).values() for name in chain.roots if name in variables)


def chain_values(model: JobModel, variables: Collection[str], system: Maths, values: Values) -> dict[str, Number]:
    """Formulas of the chained values, each from the values before it; values: a mapping that has all of them."""
    chains = _chains(model, variables).values()
    return {name: value for chain in chains for name, value in chain.follow(system, values).items()}


def stations(model: JobModel, given: Given, variables: Collection[str]) -> tuple[Station, ...]:
    """Corners at which whole-cycle rows are likely to bind when `variables` are free; given: values as floats."""
    first, corners, chains = 0, [], _chains(model, variables)
    for arc in model.kinematics.arcs if chains else ():
        if arc.name in chains:
            corners += [Station(first + k, switch) for k, switch in enumerate(chains[arc.name].stations)]
        first += len(arc.corners(systems.FLOAT, given))
    return tuple(corners)


def station_switches(model: JobModel, variables: Collection[str]) -> list[Values]:
    """Switches of the stations, without their corners."""
    return [switch for chain in _chains(model, variables).values() for switch in chain.stations]


def _chains(model: JobModel, variables: Collection[str]) -> dict[str, DerivedChain]:
    """Chains that depend on `variables`, by the name of their arc."""
    chains = {arc.name: arc.chain for arc in model.kinematics.arcs if arc.chain}
    return {name: chain for name, chain in chains.items() if chain.roots.intersection(variables)}


def station_places(switches: Sequence[Values], family: RowFamily) -> list[int]:
    """Places of the stations, by their switches, at which a family has a row."""
    return [k for k, switch in enumerate(switches) if family.has_rows(switch)]


class CycleStations:
    """Stations in a cycle, each on the piece that has the station's switches of the motion's arcs."""

    def __init__(self, stations: Sequence[Station], cycle: Cycle) -> None:
        self.cycle = cycle
        self.place = {station.corner: k for k, station in enumerate(stations)}
        closed = {name for station in stations for name in station.switch}
        self.open_switches = [k for k, name in enumerate(cycle.names) if name not in closed]
        starts = {corner: piece for piece, (corner, _) in enumerate(cycle.order)}
        self.pieces = np.zeros(len(stations), dtype=np.intp)
        self.u = np.zeros(len(stations))
        for k, station in enumerate(stations):
            piece = starts[station.corner]
            piece_switch = cycle.switch(piece)
            if any(piece_switch[name] != value for name, value in station.switch.items()):
                piece, self.u[k] = (piece - 1) % cycle.pieces, 1.0
            self.pieces[k] = piece

    def switches(self, names: Sequence[str]) -> Floats:
        """Switches that stations leave open, (stations, names); 0 for a switch that the cycle does not have."""
        values = np.zeros((len(self.pieces), len(names)))
        for k, name in enumerate(names):
            if name in self.cycle.names:
                values[:, k] = self.cycle.switches[self.pieces, self.cycle.names.index(name)]
        return values

    def signs(self, sampler: Sampler, row: str) -> Floats:
        """Factor of a quantity at each station, (stations,): its magnitude is compared with a bound."""
        if row in sampler.model.signed or not self.place:
            return np.ones(len(self.pieces))
        return np.where(sampler.at(row, self.pieces, self.u) < 0.0, -1.0, 1.0)

    def station(self, extreme: Extreme) -> int | None:
        """Place of the station at which an extreme lies, on the same side of load steps; None without one."""
        if not self.place or extreme.u not in (0.0, 1.0):
            return None
        corner = self.cycle.order[(extreme.piece + int(extreme.u)) % self.cycle.pieces][0]
        place = self.place.get(corner)
        if place is None:
            return None
        extreme_switches, station_switches = (
            self.cycle.switches[piece] for piece in (extreme.piece, self.pieces[place])
        )
        return (
            place
            if np.array_equal(extreme_switches[self.open_switches], station_switches[self.open_switches])
            else None
        )


Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class RowMap:
    """Places of the variables and rows of one NLP.

    limits: places in the program of the limits with one row each; pieces: number of rows below each epigraph
    variable; stations: number of rows of each family at stations; slots: rows of each family at nodes; variables,
    extras, lifted: number of design, extra and lifted variables.
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
        """Number of rows."""
        return self._g.size

    def with_size(self, size: int) -> "RowMap":
        """The map with as many slots as make `size` rows."""
        rest = size - replace(self, slots=0).size
        return replace(self, slots=rest // len(self.stations) if self.stations else self.slots)

    def stack(self, limits: Any, pieces: Sequence[Any], stations: Sequence[Any], nodes: Sequence[Any]) -> list[Any]:
        """Columns of rows in their order: limits, epigraph variables, families at stations, nodes."""
        return [limits, *pieces, *stations, *nodes]

    def limit_rows(self, g: Any) -> Any:
        """Rows of limits, in the order of `limits`."""
        return self._g.part(g, "limits")

    def piece_rows(self, g: Any, epigraph: int) -> Any:
        """Rows below an epigraph variable, in the order of its objective's sides."""
        return self._g.part(g, f"pieces {epigraph}")

    def station_rows(self, g: Any, family: int) -> Any:
        """Rows of a family at stations."""
        return self._g.part(g, f"stations {family}")

    def fixed_rows(self, g: Any) -> Any:
        """Rows that need no slots: of limits, below epigraph variables and at stations."""
        return self._g.prefix(g, "nodes")

    def node_rows(self, g: Any) -> Any:
        """Rows at nodes, (families, slots)."""
        return self._g.array(g, "nodes")

    def used_slots(self, counts: Sequence[int]) -> Flags:
        """Mask of the used slots, (families, slots), for the number of nodes of each family."""
        mask: Flags = np.arange(self.slots) < np.array(counts, dtype=np.intp)[:, None]
        return mask

    def join(self, design: Floats, extra: Floats) -> Floats:
        """Vector of all variables, from those of the design and the extra ones."""
        return np.concatenate([design, extra])

    def split(self, x: Any) -> tuple[Any, Any]:
        """Variables of the design and extra variables, from the vector of all."""
        return self._x.part(x, "design"), self._x.part(x, "extra")

    def original_rows(self, g: Any) -> Any:
        """All rows but the definitions of lifted variables."""
        return self._g.prefix(g, "definitions")

    def definitions(self, g: Any) -> Any:
        """Rows that define lifted variables."""
        return self._g.part(g, "definitions")

    def original_variables(self, x: Any) -> Any:
        """All variables but the lifted ones."""
        return self._x.prefix(x, "lifted")

    def lifted_variables(self, x: Any) -> Any:
        """Lifted variables."""
        return self._x.part(x, "lifted")


def row_map(program: Program, slots: int, elastic: bool = False) -> RowMap:
    """Map of the variables and rows of a program's NLP; slots: nodes of each family.

    Bounds of variables are passed to the solver as bounds; they are rows only where they may be relaxed.
    """
    epigraph_variables = epigraphs(program, elastic)
    names = [variable.name for variable in program.variables]
    switches = station_switches(program.model, names)
    ways = {way for ways in program.excess_places.values() for way in ways}
    return RowMap(
        tuple(program.single_limits if elastic else program.design_limits),
        tuple(len(program.objectives[epigraph.objective].sides) for epigraph in epigraph_variables),
        tuple(len(station_places(switches, family)) for family in families(program, elastic)),
        slots,
        len(names),
        len(ways) if elastic else len(epigraph_variables),
    )


class BindingRows(NamedTuple):
    """Masks of the rows and bounds that bind."""

    rows: Flags
    at_lower: Flags
    at_upper: Flags


def binding(lam_x: Floats, lam_g: Floats, least: float = BINDING) -> BindingRows:
    """Rows and bounds whose multiplier exceeds `least`; a variable's is positive at its upper bound, else negative."""
    return BindingRows(np.abs(lam_g) > least, lam_x < -least, lam_x > least)


@dataclass(frozen=True, eq=False)
class Multipliers:
    """Multipliers of an NLP's variables and rows, with the map of their places; false if empty."""

    rows: RowMap = RowMap()
    lam_x: Floats = field(default_factory=lambda: np.zeros(0))
    lam_g: Floats = field(default_factory=lambda: np.zeros(0))

    def __bool__(self) -> bool:
        """Whether there are any."""
        return self.lam_x.size > 0

    @property
    def variables(self) -> Floats:
        """Multipliers of the design's variables."""
        part: Floats = self.rows.split(self.lam_x)[0]
        return part

    @property
    def limits(self) -> dict[int, float]:
        """Multipliers of limits with one row each, by the limit's place."""
        return dict(zip(self.rows.limits, self.rows.limit_rows(self.lam_g).tolist(), strict=True))

    def pieces(self, epigraph: int) -> Floats:
        """Multipliers of the rows below an epigraph variable."""
        part: Floats = self.rows.piece_rows(self.lam_g, epigraph)
        return part

    @property
    def stations(self) -> list[Floats]:
        """Multipliers of whole-cycle rows at stations, for each family."""
        return [self.rows.station_rows(self.lam_g, k) for k in range(len(self.rows.stations))]

    @property
    def nodes(self) -> Floats:
        """Multipliers of whole-cycle rows at nodes, (families, slots)."""
        part: Floats = self.rows.node_rows(self.lam_g)
        return part

    def for_slots(self, rows: RowMap) -> "Multipliers":
        """The same multipliers for an NLP with more or fewer slots: new slots have 0, removed slots are dropped."""
        before = self.nodes
        common = min(self.rows.slots, rows.slots)
        lam_g = np.zeros(rows.size)
        rows.fixed_rows(lam_g)[:] = self.rows.fixed_rows(self.lam_g)
        rows.node_rows(lam_g)[:, :common] = before[:, :common]
        return Multipliers(rows, self.lam_x, lam_g)

    def extend(self, rows: RowMap) -> Floats:
        """Row multipliers for an NLP that has more rows, 0 for the new ones: IPOPT's warm start.

        With several families a node's multiplier may then stand at another node's place. Moving them family by family
        (`on`) makes IPOPT take other paths, and the end of a rapier's front fall in another basin
        (results/rapier.peak_acceleration-against-dwell.csv). A start may be inexact: its end is certified separately.
        """
        lam_g = np.zeros(rows.size)
        common = min(rows.size, self.rows.size)
        lam_g[:common] = self.lam_g[:common]
        return lam_g

    def binding(self, rows: RowMap, counts: Sequence[int]) -> BindingRows:
        """Binding rows if the first `counts` nodes of the families bind."""
        masks = binding(self.lam_x, self.for_slots(rows).lam_g)
        rows.node_rows(masks.rows)[:] = rows.used_slots(counts)
        return masks


class NodeParameters(NamedTuple):
    """A node as parameters: offsets of width and angle, each corner's coefficients in both, then the switches."""

    corners: int
    switches: tuple[str, ...]

    @property
    def size(self) -> int:
        """Number of parameters of a node."""
        return 2 + 2 * self.corners + len(self.switches)

    @property
    def angle(self) -> slice:
        """Slice of the offset and coefficients of a node's angle."""
        return slice(1, 2 + self.corners)

    @property
    def width(self) -> slice:
        """Slice of the corners' coefficients in a node's width."""
        return slice(2 + self.corners, 2 + 2 * self.corners)

    @property
    def places(self) -> slice:
        """Slice of a node's switches."""
        return slice(2 + 2 * self.corners, self.size)

    def write(self, cycle: Cycle, piece: int, u: float, weight: float = 0.0) -> list[float]:
        """Parameters of a node (piece, u); weight: its share of the piece's width."""
        offset, coefficients = cycle.coefficients(piece, u, self.corners)
        width = [0.0] * (1 + self.corners)
        if weight:
            start, at_start = cycle.coefficients(piece, 0.0, self.corners)
            end, at_end = cycle.coefficients(piece, 1.0, self.corners)
            width = [weight * (end - start), *(weight * (at_end - at_start))]
        switches = [*cycle.switches[piece], *[0.0] * (len(self.switches) - len(cycle.names))]
        return [width[0], offset, *coefficients, *width[1:], *switches]

    def write_fixed(self, cycle: Cycle, mean: Integral) -> list[list[float]]:
        """Parameters of a mean's nodes at fixed angles, of width 1, which no corner moves."""
        phi, switch = fixed_nodes(cycle, mean)
        columns = [np.broadcast_to(switch[name], phi.shape) for name in self.switches]
        still = [0.0] * (2 * self.corners)
        return [
            [1.0, float(angle), *still, *map(float, node_switches)]
            for angle, *node_switches in zip(phi, *columns, strict=True)
        ]

    def read(self, row: Sequence[Number], corners: Sequence[Number]) -> Node:
        """The node that parameters describe; corners: their crank angles, rad."""
        phi = node_angle(row[1], row[2 : 2 + self.corners], corners)
        return Node(phi, dict(zip(self.switches, row[2 + 2 * self.corners :], strict=True)))


@dataclass(frozen=True, eq=False)
class Structure:
    """Structure of one built NLP; the NLP serves every program with an equal structure.

    elastic: whether the weighted sum of the relaxable limits' excesses is minimised instead of the objectives. slots:
    nodes of each family. hints: names of values from which corners without a formula are computed. corners: number of
    the cycle's corners. points: nodes of each mean over the cycle, by its name. stations: corners with fixed rows.
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
        """Key of the built NLP: equal for structures that one NLP serves."""
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
        """Places of the NLP's variables and rows."""
        return row_map(self.program, self.slots, self.elastic)

    @functools.cached_property
    def excess_places(self) -> dict[int, tuple[int, ...]]:
        """Places of the excess variables of each relaxable limit, by the limit's place."""
        return self.program.excess_places if self.elastic else {}

    @functools.cached_property
    def means(self) -> list[Integral]:
        """Means over the cycle that the rows read."""
        return means(self.program, self.elastic)

    @functools.cached_property
    def node(self) -> NodeParameters:
        """Layout of a node's parameters."""
        model = self.program.model
        datum = (DATUM,) if any(mean.angles for mean in model.integrals) else ()
        return NodeParameters(self.corners, (*model.switches, *datum))

    @functools.cached_property
    def chained_values(self) -> tuple[str, ...]:
        """Chained values, in order."""
        return chain_names(self.program.model, self.names)

    @property
    def names(self) -> list[str]:
        """Names of the design's variables."""
        return [variable.name for variable in self.program.variables]

    @functools.cached_property
    def open_switches(self) -> tuple[str, ...]:
        """Switches that stations leave open."""
        known = {name for station in self.stations for name in station.switch}
        return tuple(name for name in self.node.switches if name not in known)

    @functools.cached_property
    def station_rows(self) -> list[list[int]]:
        """Places of the stations at which each family has a row."""
        return [station_places([station.switch for station in self.stations], family) for family in self.families]

    @functools.cached_property
    def layout(self) -> Layout:
        """Places of the parameters: numbers first, then nodes."""
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
        for k, places in enumerate(self.station_rows):
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
        """Parameter vector of a program's numbers and the nodes of each family."""
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
        cycle_stations = CycleStations(self.stations, cycle)
        write(p, "station", cycle_stations.switches(self.open_switches))
        for k, family in enumerate(self.families):
            write(p, f"sign {k}", cycle_stations.signs(sampler, family.row)[self.station_rows[k]])
        for k, chosen in enumerate(nodes):
            used = [[1.0, e.sign, *node.write(cycle, e.piece, e.u)] for e in chosen]
            idle = [[0.0, 1.0, *node.write(cycle, 0, 0.5)]] * (self.slots - len(used))
            write(p, f"family {k}", used + idle)
        return p

    def _rule(self, cycle: Cycle, mean: Integral) -> list[list[float]]:
        """Parameters of a mean's nodes."""
        if mean.angles:
            return self.node.write_fixed(cycle, mean)
        rule = zip(*quadrature(cycle, mean), strict=True)
        return [self.node.write(cycle, int(piece), float(u), float(weight)) for piece, u, weight in rule]


def means(program: Program, elastic: bool) -> list[Integral]:
    """Means that a limit or an objective reads; an elastic program has no objectives."""
    read = {row for limit in program.limits for row in limit.reads}
    read |= set() if elastic else {row for objective in program.objectives for row in objective.rows}
    return [mean for mean in program.model.integrals if {mean.name, mean.root} & read]


def mean_nodes(program: Program, sampler: Sampler, elastic: bool) -> tuple[tuple[str, int], ...]:
    """Means that are read, each with the number of its nodes at a design."""
    return tuple(
        (mean.name, len(mean.angles) or len(quadrature(sampler.cycle, mean)[0])) for mean in means(program, elastic)
    )


def structure(program: Program, sampler: Sampler, slots: int, elastic: bool = False) -> Structure:
    """Structure of the NLP of a program at a design."""
    points = mean_nodes(program, sampler, elastic)
    corners = stations(program.model, sampler.given, [variable.name for variable in program.variables])
    return Structure(program, slots, elastic, tuple(sampler.hints), sampler.corner_count, points, corners)
