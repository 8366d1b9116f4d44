"""Mechanism for a job: poses, events by name, and groups of links that must close."""

import functools
import math
from collections.abc import Callable, Collection, Hashable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from loomopt.base.records import Frozen
from loomopt.maths import turning_points
from loomopt.maths.systems import Maths, Number
from loomopt.physics.balance import Given
from loomopt.physics.cycle import Floats, Node
from loomopt.physics.effects.kinds import Motion
from loomopt.physics.mechanisms import crank_rocker
from loomopt.physics.schema import Values
from loomopt.physics.tolerances import ASSEMBLY_MARGIN

NEARLY_SINGULAR = 5e-4
"""Share by which a dyad's triangle closes, below which peaks are so narrow that equidistant samples miss them."""

SINGULAR_SAMPLES, WORTH_A_LOOK = 361, 10
"""Samples of one turn between which the closest position of a triangle is located, and how many times NEARLY_SINGULAR
its share may be there: between samples a degree apart a top stands at most 4e-5 of its curvature higher."""

OfPhi = Callable[[Maths, Given, Number, Callable[[], Any]], Number]
"""formula(maths, given, phi, pose): pose is called where it is read."""
Squares = Callable[[tuple[str, ...], Floats], Sequence[Floats]]
"""squares(names, phi): whole-cycle quantities at crank angles, rad."""


class Group(NamedTuple):
    """Links that close a triangle at every crank angle, with margins and extremes that follow.

    quantities: over the cycle: the squares of the base over what the links span (1 where they are stretched or folded:
    `closes` names them by phrase) and the obliquity of the transmission angle. rows: of the design alone, angles and
    margins; margins: those of them that are never negative. closest: crank angles, rad, where the spans are largest,
    in closed form; located between samples if there is none.
    """

    quantities: Mapping[str, OfPhi]
    closes: Mapping[str, str]
    rows: Mapping[str, Callable[[Maths, Values], Number]] = Frozen()
    margins: tuple[str, ...] = ()
    closest: tuple[float, ...] = ()

    def singular(self, prefix: str, squares: Squares) -> tuple[float, ...]:
        """Crank angles, rad, where the links nearly fold or stretch; prefix: of the names of their quantities."""
        squares_at = functools.partial(squares, tuple(prefix + name for name in self.closes.values()))
        if self.closest:
            tops = [
                pair for values in squares_at(np.array(self.closest)) for pair in zip(self.closest, values, strict=True)
            ]
        else:
            tops = list(_tops(squares_at))
        return tuple(dict.fromkeys(top for top, square in tops if square > (1 - NEARLY_SINGULAR) ** 2))


def _tops(squares: Callable[[Floats], Sequence[Floats]]) -> Iterator[tuple[float, float]]:
    """Yield the crank angle, rad, of each quantity's highest value where that is worth a closer look, and the value."""
    angles = np.linspace(0.0, 2 * math.pi, SINGULAR_SAMPLES)
    step = 2 * math.pi / (SINGULAR_SAMPLES - 1)
    for k, sampled in enumerate(squares(angles)):

        def height(at: Floats, k: int = k) -> Floats:
            return squares(at)[k]

        top = int(np.argmax(sampled))
        if sampled[top] > 1 - WORTH_A_LOOK * NEARLY_SINGULAR:
            place = turning_points.golden_section(height, float(angles[top]) - step, float(angles[top]) + step)
            yield place, float(height(np.array([place]))[0])


class DerivedChain(NamedTuple):
    """Derived values of which each follows from a few before it: an NLP may have them for variables, and sparse rows.

    roots: numbers they follow from in the end; follow(maths, values): each from roots and values before it, by name in
    order; a kinematics' `derived` that is given them reads them. stations: for each of the arcs' corners in order the
    switches of the motion's arcs there, where whole-cycle rows are likely to bind. Nothing but loads may jump there.
    """

    roots: frozenset[str]
    names: tuple[str, ...]
    follow: Callable[[Maths, Values], Mapping[str, Number]]
    stations: tuple[Values, ...]


class Arcs(NamedTuple):
    """Stretches of the cycle with limits; switch: as a load's, from the angles of its own corners, rad."""

    name: str
    corners: Callable[[Maths, Given], tuple[Number, ...]]
    switch: Callable[[float, tuple[float, ...]], float]
    structure: Hashable = None
    """Key that distinguishes stretches of one name."""
    chain: DerivedChain | None = None
    """What their formulas are made of, where that is a chain."""
    parting: Callable[[Maths, Given], tuple[Number, ...]] | None = None
    """Those of the corners that part the cycle, where others of its corners do so already."""


class Followed(NamedTuple):
    """Crank angle without a formula: its event, the name of its value, and its value in one design, rad.

    rates(maths, given, phi): what vanishes there, and its slope.
    """

    name: str
    value: str
    angle: float
    rates: Callable[[Maths, Given, Number], Sequence[Number]]


class Following(NamedTuple):
    """The events of one design that hints lead to.

    hints: names of their hints; events: in an order in which each reads those before it; turns: every crank angle of
    one turn at which the output turns; sure(maths, given, turns): conditions, expressions that must be positive so that
    a scan of another design locates the same events, each with a message; turns: their crank angles there. paths: by
    the name of an event's value, the start of the travel to it, and the event; its `rates` are positive between them.
    """

    hints: frozenset[str]
    events: tuple[Followed, ...]
    turns: tuple[Followed, ...]
    sure: Callable[[Maths, Given, Sequence[Number]], Sequence[tuple[str, Number]]]
    paths: tuple[tuple[str, Followed], ...] = ()


@runtime_checkable
class Follows(Protocol):
    """Mechanism with the data of its events that boxes of designs need to enclose them."""

    def following(self, given: Given) -> Following | None:
        """Events of a design in floats that hints lead to; None where they are not followed so."""


class Kinematics(Protocol):
    """Mechanism in every number system; angles rad, lengths m. The defaults suit most mechanisms."""

    @property
    def structure(self) -> Hashable:
        """Key of its formulas: equal for mechanisms with the same formulas."""

    @property
    def groups(self) -> Mapping[str, Group]:
        """Links that must close, by the prefix that their quantities and rows have."""
        return {}

    @property
    def arcs(self) -> tuple[Arcs, ...]:
        """Stretches of the cycle with formulas of their own."""
        return ()

    @property
    def breaks(self) -> frozenset[str]:
        """Events that lie on corners of its own arcs; the value of such a name is their crank angles, rad."""
        return frozenset()

    def linkage(self, maths: Maths, values: Values) -> object:
        """Record of the scene's numbers for poses; None where there are none."""
        return None

    def derived(self, maths: Maths, given: Given, called: Collection[str]) -> Mapping[str, Number]:
        """Numbers that follow from the scene's numbers; called: events that effects declare."""
        return {}

    def hints(self, given: Given, called: Collection[str]) -> Mapping[str, float]:
        """Angles of events that no formula gives, by name of value: Newton's method starts there."""
        return {}

    def pose(self, maths: Maths, given: Given, node: Node) -> Motion:
        """Pose at a node."""

    def still(self, maths: Maths, given: Given, event: str, switch: Values) -> Motion:
        """Exact pose at an event."""
        return self.pose(maths, given, Node(self.events(maths, given)[event], switch))

    def events(self, maths: Maths, given: Given) -> Mapping[str, Number]:
        """Crank angles of events by name."""
        return {}


def four_bar(
    names: tuple[str, str, str, str],
    side: int,
    phase: Callable[[Values], Number],
    phrases: tuple[str, str],
    obliquity: OfPhi | None = None,
) -> Group:
    """Group of a crank-rocker.

    names: what the scene calls its links; side: on which its rocker lies; phase(values): the linkage's own crank angle
    at φ = 0, rad; phrases: that rod and rocker are not stretched, and not folded.
    """
    l1, l2, l3, l4 = names

    def lengths(values: Values) -> crank_rocker.Lengths:
        return crank_rocker.Lengths(values[l1], values[l2], values[l3], values[l4], side)

    def far(m: Maths, given: Given, phi: Number, pose: Callable[[], Any]) -> Number:
        return crank_rocker.span_far(m, lengths(given.values), phi + phase(given.values))

    def near(m: Maths, given: Given, phi: Number, pose: Callable[[], Any]) -> Number:
        return crank_rocker.span_near(m, lengths(given.values), phi + phase(given.values))

    margins: dict[str, Callable[[Maths, Values], Number]] = {
        f"assembly: {l1} + {l4} < {l2} + {l3}": lambda m, v: (v[l2] + v[l3]) - ASSEMBLY_MARGIN * (v[l1] + v[l4]),
        f"assembly: {l1} + {l2} < {l3} + {l4}": lambda m, v: (v[l4] - v[l1]) - ASSEMBLY_MARGIN * (v[l2] - v[l3]),
        f"assembly: {l1} + {l3} < {l2} + {l4}": lambda m, v: (v[l4] - v[l1]) - ASSEMBLY_MARGIN * (v[l3] - v[l2]),
    }
    rows: dict[str, Callable[[Maths, Values], Number]] = {
        "mu_near": lambda m, values: crank_rocker.transmission_angle_near(m, lengths(values)),
        "mu_far": lambda m, values: crank_rocker.transmission_angle_far(m, lengths(values)),
    }
    quantities: dict[str, OfPhi] = {"span_far": far, "span_near": near}
    return Group(
        quantities | ({"obliquity": obliquity} if obliquity else {}),
        dict(zip(phrases, ("span_far", "span_near"), strict=True)),
        rows | margins,
        tuple(margins),
    )
