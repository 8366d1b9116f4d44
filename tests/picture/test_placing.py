import itertools
import math

import numpy as np
import pytest
from support import clear

from loomopt.picture import shapes
from loomopt.picture.drawing import LEADER, Label, along, around, dimension, ground, mass, place, spring
from loomopt.picture.shapes import Circle, Drawing, Line, Point, Text

POST = Line("frame", (Point(0.0, -30.0), Point(0.0, 30.0)))


def placed(labels, *strokes):
    """Return the texts and leaders of labels among strokes, 1 high, after a check that they are clear."""
    found = place(labels, strokes, 1.0)
    assert clear.faults(Drawing("", 1.0, (*strokes, *found))) == []
    return [p for p in found if isinstance(p, Text)], [p for p in found if isinstance(p, Line)]


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
    found = place(labels, [POST], 1.0)
    boxes = [shapes.text_box(p, 1.0) for p in found if isinstance(p, Text)]
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
    found = mass(Point(1.0, 2.0), 1.0)
    assert [p.centre for p in found if isinstance(p, Circle)] == [(1.0, 2.0)]
    middles = [p.points[0].part(p.points[1]) for p in found if isinstance(p, Line)]
    assert middles == [pytest.approx((1.0, 2.0))] * 2
