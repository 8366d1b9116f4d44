"""What a program's semi-infinite rows and its non-smooth objectives become in an NLP: families and epigraphs.

min max |g| over the cycle is min t subject to |g| ≤ t at every angle: one epigraph variable t for each group of rows
whose worst counts, and one family of rows for each whole-cycle quantity [Boyd and Vandenberghe, Convex Optimization,
section 4.1.3; Hettich and Kortanek, Semi-infinite programming, SIAM Review 35 (1993)].
"""

from typing import NamedTuple

from loomopt.model.program import Program
from loomopt.physics.cycle import Where
from loomopt.physics.schema import Values


class Epigraph(NamedTuple):
    """A variable above all rows of one group of an objective; objective: its place in the program."""

    objective: int
    rows: tuple[str, ...]


class Family(NamedTuple):
    """The whole-cycle rows of one quantity: below an epigraph variable, or below a limit, each by its place.

    where: the pieces they are asked for, every one without it; known: those where the quantity is known at all.
    """

    row: str
    epigraph: int = -1
    limit: int = -1
    where: Where | None = None
    known: tuple[Where, ...] = ()

    def counts(self, switch: Values) -> bool:
        """Say whether it has rows on the pieces of a switch."""
        asked = self.where is None or switch.get(self.where[0]) == self.where[1]
        return asked and (not self.known or any(switch.get(name) == value for name, value in self.known))


def epigraphs(program: Program, elastic: bool = False) -> tuple[Epigraph, ...]:
    """Return the epigraph variables of a program's objectives, in order; an elastic one has no objectives."""
    levels = [] if elastic else list(enumerate(program.objectives))
    return tuple(Epigraph(k, group) for k, level in levels if not level.is_smooth for group in level.groups)


def families(program: Program, elastic: bool = False) -> list[Family]:
    """Return the whole-cycle rows a program needs: first those of objectives, then those of limits."""
    above = enumerate(epigraphs(program, elastic))
    peaks = [(k, epigraph) for k, epigraph in above if program.objectives[epigraph.objective].form == "peak"]
    limits = [(k, limit) for k, limit in enumerate(program.limits) if limit.family == "cycle"]
    known = program.model.known_of
    return [
        *(Family(row, epigraph=k, known=known(row)) for k, epigraph in peaks for row in epigraph.rows),
        *(Family(limit.row, limit=k, where=limit.where, known=known(limit.row)) for k, limit in limits),
    ]
