"""What an NLP is made of beside its numbers, and those numbers as one parameter vector.

Variables are scaled; every scene number, limit, natural size, weight and cycle node is a parameter. The cycle enters
through a few slots, each a node that the exchange fills; an unused slot weighs nothing.
"""

import functools
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from loomopt.maths.systems import Number
from loomopt.model.model import Integral
from loomopt.model.program import Program
from loomopt.model.reading import DATUM, quadrature
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.cycle import Cycle, Floats, Node, node_angle
from loomopt.solving.nlp.rows import (
    Epigraph,
    HeldStations,
    Layout,
    RowFamily,
    RowMap,
    Station,
    chained,
    epigraphs,
    families,
    held,
    row_map,
    stations,
)


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

    def write_fixed(self, angle: float, datum: float) -> list[float]:
        """Return the parameters of a node of width 1 at a crank angle, rad, that no corner moves."""
        return [1.0, angle, *[0.0] * (2 * self.corners), *(datum if name == DATUM else 0.0 for name in self.switches)]

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
        return self.program.structure, self.slots, self.elastic, self.hints, self.corners, self.points

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
            return [self.node.write_fixed(angle, datum) for angle, datum in zip(mean.angles, mean.data, strict=True)]
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
