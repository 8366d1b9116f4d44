import itertools
import math
from typing import Any

import numpy as np
import pytest
from support import clear

from loomopt.picture import shapes
from loomopt.picture.drawing import LEADER, Label, along, around, dimension, ground, mass, place, spring
from loomopt.picture.shapes import Circle, Drawing, Line, Point, Text

POST = Line("frame", (Point(0.0, -30.0), Point(0.0, 30.0)))


def placed(labels, *strokes):
    """Return the texts and leaders of labels among strokes, 1 high, after a check that they are clear."""
    result = place(labels, strokes, 1.0)
    assert clear.faults(Drawing("", 1.0, (*strokes, *result))) == []
    return [p for p in result if isinstance(p, Text)], [p for p in result if isinstance(p, Line)]


@pytest.mark.parametrize("side", [0.0, math.pi])
def test_a_label_stands_on_the_side_that_is_wished_for(side):
    ((text,), leaders) = placed([Label("notes", Point(0.0, 0.0), side, "l1 = 31")], POST)
    assert math.copysign(1.0, text.at.x) == math.cos(side)
    assert not leaders


def test_a_label_on_a_link_slides_along_it_where_its_middle_is_taken():
    labels = [along("notes", POST.points[0], POST.points[1], 0.0, f"l{k} = 100") for k in range(4)]
    texts, leaders = placed(labels, POST)
    assert len({round(text.at.y) for text in texts}) >= 3
    assert not leaders


def test_a_label_that_stands_far_off_has_a_leader_to_its_point():
    rings = [Circle("paths", Point(0.0, 0.0), 0.7 * k) for k in range(1, 9)]
    (text,), (leader,) = placed([Label("notes", Point(0.0, 0.0), 0.0, "hub")], *rings)
    box = shapes.text_box(text, 1.0)
    assert math.hypot(*leader.points[0]) < 1.0
    assert math.dist(box.nearest(*leader.points[1]), leader.points[1]) < 0.2
    assert math.dist(box.nearest(0.0, 0.0), (0.0, 0.0)) > LEADER


def test_any_number_of_labels_of_one_point_find_room():
    labels = [Label("notes", Point(0.0, 0.0), 0.0, f"label {k}") for k in range(24)]
    result = place(labels, [POST], 1.0)
    boxes = [shapes.text_box(p, 1.0) for p in result if isinstance(p, Text)]
    assert len(boxes) == 24
    assert not [pair for pair in itertools.combinations(boxes, 2) if clear.overlap(*pair)]


def test_strokes_are_sampled_so_closely_that_no_label_slips_between():
    for stroke in (POST, Circle("paths", Point(1.0, 2.0), 7.0), Line("paths", (*POST.points, Point(9.0, 9.0)), True)):
        points = shapes.marks(stroke, 1.0)
        assert np.hypot(*np.diff(points, axis=0).T).max() < 2 * shapes.CLEAR


def test_an_arcs_label_stands_outside_it():
    arc = Circle("dimensions", Point(0.0, 0.0), 10.0)
    (text,), _ = placed([around("notes", arc.centre, arc.radius, 0.0, math.pi / 2, "β")], arc)
    assert math.hypot(*text.at) > 10.0


def test_a_spring_hangs_between_its_ends_and_a_dimension_of_nothing_is_nothing():
    line = spring("schematic", Point(0.0, 9.0), Point(0.0, 1.0), 2.0)
    x, y = np.array(line.points).T
    assert (line.points[0], line.points[-1]) == ((0.0, 9.0), (0.0, 1.0))
    assert (x.min(), x.max()) == pytest.approx((-1.0, 1.0))
    assert np.all(np.diff(y) < 0)
    assert dimension(Point(1.0, 1.0), Point(1.0, 1.0), 1.0) == []


@pytest.mark.parametrize(("side", "below"), [(-math.pi / 2, True), (math.pi / 2, False)])
def test_ground_is_hatched_on_its_side(side, below):
    level, *hatches = ground("frame", Point(2.0, 3.0), side, 1.0)
    assert level.points[0].y == pytest.approx(3.0)
    assert all((hatch.points[1].y < 3.0) is below for hatch in hatches)


def test_a_centre_of_mass_is_a_circle_with_a_cross_through_it():
    result = mass(Point(1.0, 2.0), 1.0)
    assert [p.centre for p in result if isinstance(p, Circle)] == [(1.0, 2.0)]
    middles = [p.points[0].part(p.points[1]) for p in result if isinstance(p, Line)]
    assert middles == [pytest.approx((1.0, 2.0))] * 2


def crowded(seed, strokes=25, labels=12):
    """Return random strokes and labels, all within a square 40 text heights wide."""
    rng = np.random.default_rng(seed)
    lines = [Line("frame", tuple(Point(*at) for at in rng.uniform(-20, 20, (2, 2)))) for _ in range(strokes)]
    circles = [Circle("paths", Point(*rng.uniform(-20, 20, 2)), float(rng.uniform(0.5, 6))) for _ in range(4)]
    wanted = [
        Label("notes", Point(*rng.uniform(-20, 20, 2)), float(rng.uniform(-4, 4)), f"l{k} = {rng.integers(1000)}")
        for k in range(labels)
    ]
    return wanted, [*lines, *circles]


@pytest.mark.parametrize("seed", range(6))
def test_no_label_of_a_crowded_drawing_meets_a_stroke_or_another(seed):
    """But for the leader of a point that is walled in by labels, which ends OUTSIDE."""
    wanted, strokes = crowded(seed)
    result = place(wanted, strokes, 1.0)
    texts, leaders = [p for p in result if isinstance(p, Text)], [p for p in result if isinstance(p, Line)]
    leading = [leader for leader in leaders if math.dist(*leader.points) < shapes.OUTSIDE - 1.0]
    assert len(leading) >= len(leaders) - 1
    assert clear.faults(Drawing("", 1.0, (*strokes, *texts, *leading))) == []
    assert [text.text for text in texts] == [label.text for label in wanted]
    for label, text in zip(wanted, texts, strict=True):
        box = shapes.text_box(text, 1.0)
        far = math.dist(box.nearest(*label.near), label.near) > LEADER
        assert sum(math.dist(leader.points[0], label.near) == pytest.approx(0.5) for leader in leaders) >= far


def test_the_same_labels_stand_in_the_same_places_whatever_comes_after_them():
    wanted, strokes = crowded(1)
    whole = place(wanted, strokes, 1.0)
    assert place(wanted, strokes, 1.0) == whole
    some = place(wanted[:5], strokes, 1.0)
    assert whole[: len(some)] == some


@pytest.mark.parametrize("size", [0.125, 8.0])
def test_a_drawing_of_another_size_has_its_labels_in_the_same_places(size):
    """By powers of two, in which floats err alike."""
    wanted, strokes = crowded(2)
    larger = shapes.scale_drawing(Drawing("", 1.0, tuple(strokes)), size)
    near = [label._replace(near=Point(size * label.near.x, size * label.near.y)) for label in wanted]
    result = place(near, larger.primitives, size)
    once: Any = shapes.scale_drawing(Drawing("", 1.0, tuple(place(wanted, strokes, 1.0))), size).primitives
    for item, other in zip(result, once, strict=True):
        first, second = (np.array(entry.points if isinstance(entry, Line) else [entry.at]) for entry in (item, other))
        assert first == pytest.approx(second, rel=1e-12, abs=1e-12 * size)


def test_a_label_in_the_open_stands_as_near_as_it_may_on_its_side():
    (spot,) = shapes.place([shapes.LabelWish([(0.0, 0.0)], 0.0, 4.0, 1.5)], np.empty((0, 2)), 1.0)
    assert spot.box == pytest.approx((shapes.RINGS[0], -0.75, shapes.RINGS[0] + 4.0, 0.75))
    assert (spot.x, spot.y) == (0.0, 0.0)


def test_a_label_takes_its_first_point_where_all_are_free_and_the_next_where_it_is_not():
    wish = shapes.LabelWish([(0.0, 0.0), (30.0, 0.0)], math.pi / 2, 4.0, 1.5)
    (free,) = shapes.place([wish], np.empty((0, 2)), 1.0)
    assert (free.x, free.y) == (0.0, 0.0)
    grid = np.stack(np.meshgrid(np.arange(-6, 6, 0.2), np.arange(-6, 6, 0.2)), axis=-1).reshape(-1, 2)
    (moved,) = shapes.place([wish], grid, 1.0)
    assert (moved.x, moved.y) == (30.0, 0.0)


def test_a_label_would_rather_turn_than_have_a_stroke_between_it_and_its_point():
    wall = shapes.marks(Line("frame", (Point(0.9, -4.0), Point(0.9, 4.0))), 1.0)
    (spot,) = shapes.place([shapes.LabelWish([(0.0, 0.0)], 0.0, 2.0, 1.5)], wall, 1.0)
    assert spot.box.right <= 0.9 - shapes.CLEAR


def test_a_later_label_keeps_clear_of_an_earlier_ones_leader():
    """The first is too wide to stand between two posts; the second alone would stand where that leader runs."""
    posts = np.concatenate([shapes.marks(Line("frame", (Point(x, -30.0), Point(x, 30.0))), 1.0) for x in (-4.0, 4.0)])
    wide = shapes.LabelWish([(0.0, 0.0)], 0.0, 12.0, 1.5)
    small = shapes.LabelWish([(2.0, 0.9)], -math.pi / 2, 2.0, 1.5)
    (alone,) = shapes.place([small], posts, 1.0, LEADER)
    leading, moved = shapes.place([wide, small], posts, 1.0, LEADER)
    leader = np.array([[(0.0, 0.0), leading.box.nearest(0.0, 0.0)]])
    assert clear.meets(alone.box, leader).any()
    assert not clear.meets(moved.box, leader).any()


def test_no_leader_runs_over_a_label_that_was_there_before():
    wanted, strokes = crowded(4, strokes=60, labels=25)
    result = place(wanted, strokes, 1.0)
    texts = [shapes.text_box(part, 1.0) for part in result if isinstance(part, Text)]
    leaders = [np.array([part.points]) for part in result if isinstance(part, Line)]
    assert leaders, "of so many labels some stand far off"
    assert not [leader for leader in leaders for box in texts if clear.meets(box, leader).any()]


def test_where_nothing_is_to_be_placed_or_nothing_is_drawn_there_is_nothing_to_avoid():
    assert place([], [POST], 1.0) == []
    assert place([], [], 1.0) == []
    (text,) = (p for p in place([Label("notes", Point(0.0, 0.0), 0.0, "alone")], [], 1.0) if isinstance(p, Text))
    assert shapes.text_box(text, 1.0).left == pytest.approx(shapes.RINGS[0])
