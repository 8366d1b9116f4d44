"""What the rows of a front come to: its points in order, where other limits bind, where nothing lies on it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from loomopt.physics.tolerances import SAME_OBJECTIVE
from loomopt.studies import front_plan
from loomopt.studies.front_plan import ENDS
from loomopt.studies.rows import Row

if TYPE_CHECKING:
    from loomopt.studies.front_trade import Trade

UNSEEN = 1e-6
"""Share of an axis' natural size that shown digits do not tell: six of them."""


@dataclass(frozen=True)
class Front:
    """A front: its rows in the order of the second axis, then those without a design; SI.

    message: what it comes to in a sentence; changes, gaps: of contract.
    """

    trade: "Trade"
    rows: tuple[Row, ...]
    message: str
    changes: tuple[Mapping[str, Any], ...] = ()
    gaps: tuple[tuple[float, float], ...] = ()

    def values(self, axis: str) -> list[float]:
        """Return an axis of the certified rows, SI."""
        return [front_plan.value(row, axis) for row in self.rows if row.certified]


def read(study: "Trade", rows: Sequence[Row]) -> Front:
    """Return the front that finished rows make."""
    by_point = {row.point: row for row in rows}
    failed = tuple(row for row in rows if not row.certified)
    if not all(end in by_point for end in ENDS):
        return Front(study, tuple(rows), "No front yet: an end is not solved.")
    if not all(by_point[end].certified for end in ENDS):
        found = [row for row in rows if row.certified]
        return Front(study, (*found, *failed), "No front: an end has no certified design.")
    scale = study.scale(rows)
    first, second = study.labels
    if not all(scale.width):
        said = f"{first} and {second} do not conflict: one design is best in both."
        return Front(study, (by_point[ENDS[0]],), said + _apart(study, rows))
    spots, _ = front_plan.spots(rows, scale)
    changes, gaps = front_plan.told(spots, scale)
    best = tuple(by_point[spot.point] for spot in spots)
    message = f"{len(best)} designs between the {study.senses[1]} {second} and the {study.senses[0]} {first}."
    message += _apart(study, rows)
    # In the order of the figure itself, whichever way is sought.
    order = sorted(best, key=lambda row: front_plan.value(row, study.axes[1]))
    changes.sort(key=lambda change: change["at"])
    return Front(study, (*order, *failed), message, tuple(changes), tuple(sorted(gaps)))


def _apart(study: "Trade", rows: Sequence[Row]) -> str:
    """Say how far apart both ends are where that is not seen in shown digits; "" for more, and for nothing."""
    ends = [row for row in rows if row.point in ENDS]
    pairs = ((front_plan.value(row, axis) for row in ends) for axis in study.axes)
    apart = max(abs(one - other) / size for (one, other), size in zip(pairs, study.sizes, strict=True))
    if not SAME_OBJECTIVE < apart < UNSEEN:
        return ""
    return f" Its ends are {apart:.1g} of their size apart; {study.accuracy:g} was asked."
