"""Skeletons: what a mechanism's joints and links become in pictures and tables, whatever the mechanism."""

import math

from loomopt.interface.files import svg
from loomopt.picture.drawing import JOINT, Skeleton
from loomopt.picture.shapes import Circle, Drawing, Line, Point

OUT, IN = "front dead centre", "rear dead centre"
PRESS = Skeleton(
    {"O": Point(0.0, 0.0), "G": Point(9.0, 0.0)},
    {OUT: {"A": Point(2.0, 0.0), "B": Point(7.0, 0.0)}, IN: {"A": Point(-2.0, 0.0), "B": Point(3.0, 0.0)}},
    (("O", "G"), ("O", "A"), ("A", "B")),
    guides=(("O", 2.0), ("B", 0.5)),
    traces=(Line("paths", (Point(3.0, 0.0), Point(7.0, 0.0))),),
    sizes={"B": 0.0},
)
"""A crank and slider."""


def test_links_are_drawn_at_every_event_on_its_layer_and_the_frame_once():
    lines = [p for p in PRESS.strokes(0.1) if isinstance(p, Line) and p.layer in (OUT, IN)]
    assert [line.points for line in lines if line.layer == IN] == [((0, 0), (-2, 0)), ((-2, 0), (3, 0))]
    assert [line.points for line in lines if line.layer == OUT] == [((0, 0), (2, 0)), ((2, 0), (7, 0))]
    paths = [p.points for p in PRESS.strokes(0.1) if isinstance(p, Line) and p.layer == "paths"]
    assert paths == [((0, 0), (9, 0)), ((3, 0), (7, 0))]


def test_a_guide_stands_about_a_pivot_and_moves_with_a_joint():
    circles = [p for p in PRESS.strokes(0.1) if isinstance(p, Circle) and p.layer != "frame"]
    assert Circle("paths", Point(0.0, 0.0), 2.0) in circles
    assert [c.centre for c in circles if c.radius == 0.5] == [(7, 0), (3, 0)]
    assert [c.layer for c in circles if c.radius == 0.5] == [OUT, IN]


def test_a_joint_has_its_circle_unless_it_has_none():
    joints = [p for p in PRESS.strokes(0.1) if isinstance(p, Circle) and p.layer == "joints"]
    assert {circle.centre for circle in joints} == {(2, 0), (-2, 0)}
    assert all(math.isclose(circle.radius, 0.1 * JOINT) for circle in joints)


def test_the_table_names_pivots_once_and_moving_joints_with_a_prime_at_each_further_event():
    rows = [line.split(",") for line in PRESS.csv().splitlines()]
    assert rows[0] == ["joint", "position", "x [mm]", "y [mm]"]
    assert [row[0] for row in rows[1:]] == ["O", "G", "A", "B", "A'", "B'"]
    assert rows[-1] == ["B'", IN, "3000.0", "0.0"]
    assert PRESS.at(IN)["B"] == (3, 0)


def test_a_skeleton_is_a_drawing():
    text = svg.render(Drawing("press", 0.3, tuple(PRESS.strokes(0.3))))
    assert all(f'data-layer="{layer}"' in text for layer in (OUT, IN, "frame", "joints", "paths"))
