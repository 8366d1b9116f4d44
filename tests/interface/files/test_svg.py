import math
import re
from xml.etree import ElementTree

import pytest

from loomopt.interface.files import svg
from loomopt.jobs.beatup import drawing as crank_rocker_drawing
from loomopt.picture.shapes import LAYERS, Arc, Circle, Drawing, Line, Point, Text

PAPER = {"l1": 0.031, "l2": 0.065, "l3": 0.155, "l4": 0.167}
SPACE = "{http://www.w3.org/2000/svg}"


def numbers(text):
    return [float(number) for number in re.findall(r"-?[0-9.]+(?:e-?[0-9]+)?", text)]


@pytest.fixture(scope="module")
def root():
    return ElementTree.fromstring(svg.render(crank_rocker_drawing.of(PAPER).drawing("Reed <& 'co'>")))


def layer(root, name):
    return root.find(f"{SPACE}g[@data-layer='{name}']")


def test_one_user_unit_is_one_millimetre(root):
    width, height = numbers(root.get("viewBox"))[2:]
    assert root.get("width").endswith("mm")
    assert numbers(root.get("width")) == [width]
    assert numbers(root.get("height")) == [height]


def test_links_have_their_lengths_and_y_points_up(root):
    paths = layer(root, "front dead centre").findall(f"{SPACE}path")
    ends = [numbers(path.get("d")) for path in paths]
    lengths = [math.dist(end[:2], end[2:]) for end in ends]
    assert lengths == pytest.approx([31, 65, 155], rel=0, abs=1e-9)
    assert ends[1][3] < 0


def test_arcs_turn_the_right_way():
    quarter = Arc("paths", Point(0, 0), 0.002, 0.0, math.pi / 2)
    most = Arc("paths", Point(0, 0), 0.002, 0.0, 1.5 * math.pi)
    root = ElementTree.fromstring(svg.render(Drawing("", 0.001, (quarter, most))))
    short, long = (numbers(path.get("d")) for path in layer(root, "paths"))
    assert short == pytest.approx([2, 0, 2, 2, 0, 0, 0, 0, -2], abs=1e-11)
    assert long == pytest.approx([2, 0, 2, 2, 0, 1, 0, 0, 2], abs=1e-11)


def test_every_primitive_is_written_once_on_its_layer():
    shapes = (
        Line("notes", (Point(0, 0), Point(1, 0), Point(1, 1)), closed=True),
        Circle("frame", Point(0.001, 0.002), 0.003),
        Text("notes", Point(4, 5), "β", anchor="left"),
    )
    root = ElementTree.fromstring(svg.render(Drawing("", 1.0, shapes)))
    path, text = layer(root, "notes")
    assert path.get("d").endswith("Z")
    assert text.text == "β"
    assert text.get("text-anchor") == "start"
    (circle,) = layer(root, "frame")
    assert [circle.get(name) for name in ("cx", "cy", "r")] == ["1", "-2", "3"]


def test_titles_are_escaped_and_control_characters_do_not_break_the_file(root):
    assert root.find(f"{SPACE}title").text == "Reed <& 'co'>"
    ElementTree.fromstring(svg.render(crank_rocker_drawing.of(PAPER).drawing("a\x00\x1b]</svg>")))


def test_a_sheet_lies_under_the_drawing_and_every_colour_is_legible_on_it(root):
    assert root.find(f"{SPACE}rect").get("fill") == "#ffffff"
    for style in LAYERS.values():
        channels = [int(style.colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
        linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
        luminance = sum(weight * value for weight, value in zip((0.2126, 0.7152, 0.0722), linear, strict=True))
        assert 1.05 / (luminance + 0.05) >= 4.5


def test_the_same_drawing_gives_the_same_text():
    assert svg.render(crank_rocker_drawing.of(PAPER).drawing("t")) == svg.render(
        crank_rocker_drawing.of(PAPER).drawing("t")
    )
