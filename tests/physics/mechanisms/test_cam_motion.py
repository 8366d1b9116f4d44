"""Cam laws as one thing with pieces; segments and pieces of the law by cam angle; why a spline is no cam law."""

import math
from fractions import Fraction

import pytest

from loomopt.maths.systems import FLOAT
from loomopt.physics.mechanisms import cam_spline
from loomopt.physics.mechanisms.cam_laws import LAWS
from loomopt.physics.mechanisms.cam_motion import (
    LawColumn,
    NamedLaw,
    Spline,
    Tabulated,
    accelerations,
    knots,
    middle,
    mirrored,
    named_knots,
    piece_at,
    segment_at,
)
from loomopt.physics.mechanisms.cam_spline import FALLS, FEWEST, MOST, cycloid_like

POINTS = ([0, 0.2, 0.5, 0.8, 1], [0, 0.1, 0.5, 0.9, 1])


def test_knots_are_read_by_name_and_in_order_up_to_the_first_that_is_missing():
    values = named_knots([0.0, 6.0, -6.0, 0.0])
    assert values == {"law_0": 0.0, "law_1": 6.0, "law_2": -6.0, "law_3": 0.0}
    assert knots(values | {"K1": 1.0}) == (0.0, 6.0, -6.0, 0.0)
    assert knots({"law_0": 1.0, "law_2": 2.0}) == (1.0,)
    assert knots({"law_1": 1.0}) == knots({}) == ()
    assert len(knots(named_knots(range(12)))) == 12, "law_10 comes after law_9"


@pytest.mark.parametrize("mirror", [False, True])
def test_a_spline_law_chooses_its_inner_knots_and_is_the_spline_of_all(mirror):
    law, values = Spline(8, mirror), named_knots(cycloid_like(8))
    assert law.names == tuple(f"law_{k}" for k in range(1, 4 if mirror else 8))
    assert law.symmetric == mirror
    assert law.breaks == tuple(Fraction(k, 8) for k in range(1, 8))
    prepared = law.prepared(FLOAT, values)
    expected = cam_spline.spline(FLOAT, cycloid_like(8))
    for k in range(9):
        assert prepared[law.knot("s", k)] == pytest.approx(expected.s[k], abs=1e-15)
        assert prepared[law.knot("a", k)] == pytest.approx(expected.a[k], abs=1e-14)
    assert law.at(FLOAT, prepared, 0.3, 2) == pytest.approx(expected.at(FLOAT, 0.3, 2), abs=1e-13)
    assert law.key != Spline(8, not mirror).key != Spline(16, mirror).key


def test_named_and_tabulated_laws_are_those_of_their_formulas():
    for name, law in LAWS.items():
        named = NamedLaw(name)
        assert (named.key, named.breaks, named.symmetric) == (name, law.breaks, law.symmetric)
        assert named.at(FLOAT, named.prepared(FLOAT, {}), 0.02, 0) == law.formula(FLOAT, 0.02, 0)
    table = cam_spline.tabulated(*POINTS)
    tabulated = Tabulated(table)
    assert (tabulated.key, tabulated.breaks, tabulated.symmetric) == (table, table.breaks, False)
    assert tabulated.at(FLOAT, tabulated.prepared(FLOAT, {}), 0.6, 2) == table.at(FLOAT, 0.6, 2)


@pytest.mark.parametrize("name", ["cycloidal", "modified_sine", "modified_trapezoid"])
def test_a_law_is_sampled_at_knots_wherever_its_own_breaks_are(name):
    law, n = NamedLaw(name), 16
    ends = [float(end) for end in law.breaks]
    sampled = accelerations(law, {}, n)
    assert len(sampled) == n + 1
    for k, value in enumerate(sampled):
        piece = sum(k / n >= end for end in ends)
        assert value == pytest.approx(float(LAWS[name].formula(FLOAT, k / n, piece).s2), abs=1e-14)


def test_a_spline_law_sampled_at_its_own_knots_is_itself():
    values = cycloid_like(8)
    assert accelerations(Spline(8), named_knots(values), 8) == pytest.approx(values, abs=1e-14)


def test_segments_and_pieces_are_read_by_cam_angle():
    corners = (0.0, 2.0, 3.0, 5.0)
    assert [segment_at((0, 1, 2, 3), angle, corners) for angle in (0.0, 1.9, 2.5, 4.0, 6.0)] == [0, 0, 1, 2, 3]
    assert [segment_at((0, 2), angle, (0.0, 2.0)) for angle in (1.0, 2.0)] == [0, 2]
    values = {"rise": 2.0, "return": 2.0, "begin.near": 5.0}
    breaks = mirrored(values, [Fraction(1, 4), Fraction(3, 4)])
    assert breaks == (0.5, 1.5, 4.5, 3.5)
    assert [piece_at(angle, breaks) for angle in (0.1, 1.0, 2.5, 3.2, 4.0, 4.9)] == [0, 1, 2, 2, 1, 0]
    assert piece_at(1.0, ()) == 0


def test_a_share_that_is_a_fraction_is_not_rounded_first():
    third = 2 * math.pi / 3
    assert mirrored({"rise": third, "return": third, "begin.near": 2 * third}, [Fraction(1, 3)])[0] == third / 3


def test_a_rise_from_rest_to_rest_has_no_fault():
    assert [cam_spline.fault(cycloid_like(n)) for n in (FEWEST, 8, MOST)] == ["", "", ""]


BUMP = list(cycloid_like(8))
DOWN = [0.0, *(-value for value in cycloid_like(8)[1:-1]), 0.0]
STEEP = [0.0, -1.0, 13.0, *([0.0] * 3), -13.0, 1.0, 0.0]


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        (cycloid_like(3), f"it has 3 intervals; {FEWEST} to {MOST} are allowed"),
        ([0.0] * (MOST + 2), f"it has {MOST + 1} intervals"),
        ((), "it has -1 intervals"),
        ([0.0, math.nan, *BUMP[2:]], "not a finite number"),
        ([0.0, math.inf, *BUMP[2:]], "not a finite number"),
        ([1.01 * value for value in BUMP], "it ends at s = 1.01 with slope"),
        ([*BUMP[:-1], 1.0], "not at 1 with slope 0"),
        (DOWN, "it ends at s = -1 "),
    ],
    ids=["few", "many", "none", "nan", "inf", "high", "sloping", "down"],
)
def test_what_is_no_cam_law_is_told_why(values, reason):
    assert reason in cam_spline.fault(tuple(values))


def falling(depth):
    """Return a law of 8 intervals that first falls: s'' is −depth at knot 1, what it takes is spread over the rest."""
    values = [*BUMP]
    values[1] -= depth
    made = cam_spline.spline(FLOAT, values)
    # Two knots far from the beginning restore s(1) = 1 and s'(1) = 0: a 2×2 system in closed form.
    high, slope = 1 - made.end[0], -made.end[1]
    (a, b), (c, d) = ((8 - k) / 64 for k in (3, 5)), (1 / 8, 1 / 8)
    values[3] += (high * d - b * slope) / (a * d - b * c)
    values[5] += (a * slope - high * c) / (a * d - b * c)
    return tuple(values)


def test_a_law_that_falls_is_refused_with_where_and_how_steeply():
    first = BUMP[1]
    assert cam_spline.fault(falling(0.9 * first)) == ""
    reason = cam_spline.fault(falling(first + 1.0))
    assert reason.startswith("it falls between u = 0 and 0.125 (slope -0.0625")
    assert cam_spline.fault(falling(first + 8 * FALLS)) == ""


def test_the_least_slope_inside_an_interval_counts():
    """s'' from −1 to 7 over an interval: the slope dips inside, where both its ends are above."""
    made = cam_spline.spline(FLOAT, (0.0, 1.0, -1.0, 7.0, 0.0))
    dip = cam_spline._least_slope(made, 2)
    assert dip == pytest.approx(made.at(FLOAT, 0.5 + 1 / 32, 2).s1, rel=1e-14)
    assert dip < min(made.v[2:4])


@pytest.mark.parametrize("mirror", [False, True])
def test_each_knot_follows_from_the_one_before_it(mirror):
    """With s and s' of all knots given, each is what one interval makes of the knot before."""
    law, values = Spline(8, mirror), named_knots(cycloid_like(8))
    parameters = law.prepared(FLOAT, values)
    assert law.recurrent == tuple(name for k in range(1, 9) for name in (f"law_s_{k}", f"law_v_{k}"))
    again = law.followed(FLOAT, {**values, **{name: parameters[name] for name in law.recurrent}})
    assert tuple(again) == law.recurrent
    assert again == pytest.approx({name: parameters[name] for name in law.recurrent}, abs=1e-15)
    given = {name: 0.1 * k for k, name in enumerate(law.recurrent)}
    read = law.prepared(FLOAT, {**values, **given})
    assert {name: read[name] for name in law.recurrent} == given, "as they are"
    assert (read["law_s_0"], read["law_v_0"]) == (0.0, 0.0)
    for k in range(8):
        made = [read[law.knot(of, place)] for of, place in (("s", k), ("v", k), ("a", k), ("a", k + 1))]
        ends = cam_spline.cubic(1.0, 8, *made)
        followed = law.followed(FLOAT, {**values, **given})
        assert (followed[law.knot("s", k + 1)], followed[law.knot("v", k + 1)]) == pytest.approx(ends[:2], abs=1e-14)


def test_a_choice_among_knots_reads_one():
    class Counted(dict[str, float]):
        reads = 0

        def __getitem__(self, name):
            self.reads += 1
            return super().__getitem__(name)

    law = Spline(256)
    counted = Counted(law.prepared(FLOAT, named_knots(cycloid_like(256))))
    law.at(FLOAT, counted, 0.3, 76)
    assert counted.reads == 4
    column = LawColumn(counted, law.knots["s"])
    assert (len(column), list(column)) == (257, [counted[name] for name in law.knots["s"]])


@pytest.mark.parametrize(
    "law",
    [Spline(5), Spline(16), Spline(256), Tabulated(cam_spline.tabulated(*POINTS)), NamedLaw("modified_trapezoid")],
)
def test_the_middle_is_where_the_law_passes_a_half_on_its_piece(law):
    n = getattr(law, "intervals", 0)
    bends = [value * (1.4 if k < n / 2 else 0.7) for k, value in enumerate(cycloid_like(n))] if n else []
    height = cam_spline.spline(FLOAT, bends).end[0] if n else 1.0
    values = law.prepared(FLOAT, named_knots([bend / height for bend in bends]))
    u, piece = middle(law, values)
    ends = [0.0, *map(float, law.breaks), 1.0]
    assert ends[int(piece)] <= u <= ends[int(piece) + 1]
    assert law.at(FLOAT, values, u, piece).s == pytest.approx(0.5, abs=1e-15)


def test_pieces_of_many_knots_are_counted_on_either_side():
    values = {"rise": 2.0, "return": 1.5, "begin.near": 6.0}
    breaks = mirrored(values, [Fraction(k, 64) for k in range(1, 64)])
    for angle in [k / 50 for k in range(314)]:
        rise, back = (angle >= place for place in breaks[:63]), (angle >= place for place in breaks[63:])
        assert piece_at(angle, breaks) == sum(rise) - sum(back)
