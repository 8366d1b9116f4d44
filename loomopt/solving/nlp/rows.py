"""The order of an NLP's variables and rows, and multipliers read by what they are of: nobody else counts places.

Rows: limits that are a row each; smooth pieces below epigraph variables; whole-cycle rows at stations, family by
family; whole-cycle rows at nodes, so many slots of each family; behind all these the definitions of lifted variables.
Variables: the design's; the extra ones, which are epigraph variables, or excesses of an elastic NLP; the lifted ones.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from loomopt.base.records import lazy
from loomopt.model.program import Program
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import BINDING
from loomopt.solving.nlp.layout import Layout
from loomopt.solving.nlp.stations import epigraphs, families, held, station_switches

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
    ways = {way for ways in program.ways.values() for way in ways}
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


def binding(lam_x: Floats, lam_g: Floats) -> BindingRows:
    """Return what binds at multipliers: of variables positive at an upper bound, negative at a lower one."""
    return BindingRows(np.abs(lam_g) > BINDING, lam_x < -BINDING, lam_x > BINDING)


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

    def binding(self, rows: RowMap, counts: Sequence[int]) -> BindingRows:
        """Return what binds with nodes of the same NLP in other slots: so many of each family, from the first on."""
        found = binding(self.lam_x, self.on(rows).lam_g)
        rows.at_nodes(found.rows)[:] = rows.used(counts)
        return found
