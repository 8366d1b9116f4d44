"""Groups of links that must close: spans by the law of cosines, margins by Grashof, angles where they nearly fold."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from loomopt.maths import systems
from loomopt.maths.systems import FLOAT
from loomopt.model.kinematics import NEARLY_SINGULAR, Group, four_bar
from loomopt.physics.balance import Given
from loomopt.physics.tolerances import ASSEMBLY_MARGIN

REPEATABLE = settings(derandomize=True, deadline=None, max_examples=200)
NAMES = ("a", "b", "c", "d")
PHASE = 0.3
GROUP = four_bar(NAMES, 1, lambda values: values["turned"], ("is not stretched", "is not folded"))
lengths = st.tuples(*[st.floats(0.02, 1.0)] * 4)


def named(sides):
    return dict(zip(NAMES, sides, strict=True)) | {"turned": PHASE}


def spans(sides, phi):
    """Return the squares of the base over what rod and rocker span, by `Group`."""
    known = Given(named(sides), {})
    return [GROUP.quantities[name](systems.numpy(), known, phi, lambda: None) for name in GROUP.closes.values()]


def base(sides, phi):
    """Return the distance from the crank's end to the rocker's pivot, by coordinates; phi: from φ = 0, rad."""
    a, _, _, d = sides
    return np.abs(d - a * np.exp(1j * (phi + PHASE)))


@given(lengths, st.floats(0, 2 * math.pi))
@REPEATABLE
def test_spans_are_those_of_the_triangle(sides, phi):
    _, b, c, _ = sides
    far, near = spans(sides, np.array([phi]))
    distance = base(sides, np.array([phi]))
    assume(distance[0] > 1e-3)
    assert far == pytest.approx((distance / (b + c)) ** 2, rel=1e-9)
    assert near == pytest.approx(((b - c) / distance) ** 2, rel=1e-9)


@given(lengths)
@REPEATABLE
def test_margins_are_all_positive_exactly_where_the_triangle_closes_all_round(sides):
    """But for the share of the links that is kept as a distance from the change point."""
    a, b, c, d = sides
    phi = np.linspace(0, 2 * math.pi, 721) - PHASE
    distance = base(sides, phi)
    closes = (distance.max() < b + c) and (distance.min() > abs(b - c))
    margins = [GROUP.rows[name](FLOAT, named(sides)) for name in GROUP.margins]
    assume(min(abs(margin) for margin in margins) > 2 * (ASSEMBLY_MARGIN - 1) * sum(sides))
    assume(d > a)
    assert len(margins) == 3
    assert (min(margins) > 0) == closes
    assert all(name.startswith("assembly: ") and "<" in name for name in GROUP.margins)


@given(st.tuples(st.floats(0.02, 0.2), *[st.floats(0.6, 1.0)] * 3))
@REPEATABLE
def test_transmission_angles_are_the_extremes_over_the_turn(sides):
    a, b, c, d = sides
    assume(d - a > abs(b - c) * 1.01 and a + d < 0.99 * (b + c))
    distance = base(sides, np.linspace(0, 2 * math.pi, 721) - PHASE)
    mu = np.arccos((b * b + c * c - distance**2) / (2 * b * c))
    assert GROUP.rows["mu_near"](FLOAT, named(sides)) == pytest.approx(mu.min(), abs=1e-6)
    assert GROUP.rows["mu_far"](FLOAT, named(sides)) == pytest.approx(math.pi - mu.max(), abs=1e-6)


def test_what_a_group_is_asked_for_beside_its_spans_is_there_only_where_it_is_given():
    assert set(GROUP.quantities) == {"span_far", "span_near"}
    assert GROUP.closes == {"is not stretched": "span_far", "is not folded": "span_near"}
    more = four_bar(NAMES, -1, lambda values: 0.0, ("s", "f"), lambda m, given, phi, pose: pose())
    assert more.quantities["obliquity"](FLOAT, Given({}, {}), 0.0, lambda: 7.0) == 7.0


def closing(top, at, width=0.5):
    """Return a group's squares of one share that is `top` at an angle, and falls on both sides."""
    return lambda names, phi: [top - (np.sin((phi - at) / 2) / width) ** 2 for _ in names]


@pytest.mark.parametrize("at", [0.0, 0.1234, 3.0001, 6.2])
@pytest.mark.parametrize(
    ("top", "singular"),
    [(1.0, True), ((1 - 0.9 * NEARLY_SINGULAR) ** 2, True), ((1 - 1.1 * NEARLY_SINGULAR) ** 2, False), (0.5, False)],
)
def test_the_angle_where_links_nearly_fold_is_found_between_samples(at, top, singular):
    """The maximum lies between two samples of a degree, and the search says where, to a share of a microdegree."""
    result = Group({}, {"closes": "span"}).singular("", closing(top, at))
    assert len(result) == int(singular)
    for angle in result:
        assert math.remainder(angle - at, 2 * math.pi) == pytest.approx(0.0, abs=1e-6)


def test_where_the_angle_is_known_in_closed_form_no_other_is_looked_at():
    requests = []

    def squares(names, phi):
        requests.append((names, phi.tolist()))
        return [np.array([1.0, 0.3]) for _ in names]

    group = Group({}, {"stretched": "far", "folded": "near"}, closest=(0.7, 2.0))
    assert group.singular("left.", squares) == (0.7,), "both names are largest there, once"
    assert requests == [(("left.far", "left.near"), [0.7, 2.0])]
