"""Shapes: how large texts are, what scaling keeps, which points stand for a stroke, how lengths are told."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from loomopt.base import units
from loomopt.picture.shapes import (
    LAYERS,
    METRIC,
    POSITIONS,
    STEP,
    Arc,
    Circle,
    Drawing,
    Line,
    Point,
    Text,
    Units,
    extent,
    marks,
    plain,
    scale_drawing,
    text_box,
)

STROKES = (
    Line("frame", (Point(0.0, 0.0), Point(3.0, 4.0), Point(3.0, -2.0))),
    Line("profile", (Point(0.0, 0.0), Point(2.0, 0.0), Point(2.0, 1.0)), closed=True),
    Circle("joints", Point(-1.0, 2.0), 0.5),
    Arc("dimensions", Point(1.0, 1.0), 2.0, 0.5, 4.0),
)
TEXT = Text("notes", Point(1.0, 5.0), "l1 = 31", anchor="left")
SHEET = Drawing("", 0.2, (*STROKES, TEXT))


@given(st.integers(-8, 12))
def test_scaling_by_a_power_of_two_scales_whatever_is_measured_to_the_last_bit(power):
    size = 2.0**power
    larger = scale_drawing(SHEET, size)
    assert list(extent(larger)) == [size * side for side in extent(SHEET)]
    for item, other in zip(SHEET.primitives, larger.primitives, strict=True):
        assert np.array_equal(marks(other, larger.height), size * marks(item, SHEET.height))
    assert scale_drawing(larger, 1 / size) == SHEET


@pytest.mark.parametrize("stroke", STROKES, ids=lambda stroke: type(stroke).__name__)
def test_marks_lie_on_the_stroke_from_end_to_end_and_close_together(stroke):
    height = 0.2
    points = marks(stroke, height)
    assert np.hypot(*np.diff(points, axis=0).T).max() <= STEP * height * (1 + 1e-12)
    if isinstance(stroke, Line):
        ends = [*stroke.points, *(stroke.points[:1] if stroke.closed else [])]
        assert [tuple(points[0]), tuple(points[-1])] == [ends[0], ends[-1]]
        length = sum(math.dist(item, other) for item, other in itertools.pairwise(ends))
        assert np.hypot(*np.diff(points, axis=0).T).sum() == pytest.approx(length, rel=0.02)
    else:
        assert np.hypot(*(points - np.array(stroke.centre)).T) == pytest.approx(stroke.radius, rel=1e-12)
        begin, end = (stroke.begin, stroke.end) if isinstance(stroke, Arc) else (0.0, 2 * math.pi)
        assert [tuple(points[0]), tuple(points[-1])] == [
            pytest.approx(stroke.centre.towards(angle, stroke.radius)) for angle in (begin, end)
        ]


@pytest.mark.parametrize("anchor", ["centre", "left"])
def test_a_texts_box_hangs_on_its_anchor_and_grows_with_height_and_size(anchor):
    box = text_box(Text("notes", Point(2.0, 3.0), "l1 = 31", 1.0, anchor), 0.5)
    assert (box.bottom + box.top) / 2 == pytest.approx(3.0)
    assert (box.left if anchor == "left" else (box.left + box.right) / 2) == pytest.approx(2.0)
    twice = text_box(Text("notes", Point(2.0, 3.0), "l1 = 31", 2.0, anchor), 0.5)
    assert twice == text_box(Text("notes", Point(2.0, 3.0), "l1 = 31", 1.0, anchor), 1.0)
    assert (twice.right - twice.left, twice.top - twice.bottom) == pytest.approx(
        (2 * (box.right - box.left), 2 * (box.top - box.bottom))
    )


@given(st.text(max_size=12), st.text(max_size=12))
def test_what_stands_side_by_side_is_as_wide_as_both_together(first, other):
    def width(text):
        box = text_box(Text("notes", Point(0.0, 0.0), text), 1.0)
        return box.right - box.left

    assert width(first + other) == pytest.approx(width(first) + width(other))


@pytest.mark.parametrize(("narrow", "wide"), [("i", "W"), ("l", "ψ织"), ("a", "A"), ("1", "="), ("e", "…")])
def test_wide_letters_get_more_room(narrow, wide):
    boxes = [text_box(Text("notes", Point(0.0, 0.0), text), 1.0) for text in (narrow, wide)]
    assert boxes[0].right < boxes[1].right


def test_a_box_is_no_narrower_than_the_letters_that_matplotlib_draws():
    """DejaVu Sans; capitals, which a drawing's height is the height of, are 0.729 of its size."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    for text in ("l1 = 31", "MMMM", "iiii", "wide words", "β = 63.4°", "Q = 12 <= 13 ~ W"):
        drawn = TextPath((0, 0), text, size=1 / 0.729, prop=FontProperties(family="DejaVu Sans")).get_extents()
        box = text_box(Text("notes", Point(0.0, 0.0), text, anchor="left"), 1.0)
        assert box.right >= drawn.x1, text


@pytest.mark.few(1)
@given(st.floats(1e-9, 1.0))
@pytest.mark.parametrize("unit", ["mm", "in"])
def test_a_tolerance_is_told_in_one_digit_that_is_kept(unit, metres):
    report, message = Units(length=unit).within(metres).split()
    assert message == unit
    assert len(report.replace(".", "").strip("0")) == 1
    ratio = float(report) * float(units.factor(unit)) / metres
    assert 1 - 1e-6 <= ratio <= 2 + 1e-6, "rounded up, and by less than a digit"


def test_no_tolerance_is_told_as_none_and_a_length_without_a_minus_before_zero():
    assert METRIC.within(0.0) == "0 mm"
    assert METRIC.size(-0.0) == "0"
    assert METRIC.size(0.0310004) == "31.0004"
    assert Units(length="in").size(0.0254) == "1"


def test_positions_have_looks_of_their_own_behind_the_joints():
    names = ["30 deg", "60 deg", "90 deg", "120 deg", "150 deg"]
    drawn = [*("joints", "notes", "paths"), *names]
    sheet = Drawing("", 1.0, tuple(Circle(name, Point(0.0, 0.0), 1.0) for name in drawn))
    layers = list(sheet.layers)
    assert layers == ["paths", *names, "joints", "notes"]
    assert [sheet.layers[name] for name in names] == [*POSITIONS, POSITIONS[0]]
    assert all(sheet.layers[name] is LAYERS[name] for name in ("joints", "notes", "paths"))


@given(st.text())
def test_plain_text_keeps_its_length_and_can_be_printed(text):
    assert len(plain(text)) == len(text)
    assert plain(text).isprintable()
    assert plain(plain(text)) == plain(text)
