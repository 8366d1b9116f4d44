import cmath
import csv
import io
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import clear

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.jobs.beatup import drawing as crank_rocker_drawing
from loomopt.picture import shapes
from loomopt.picture.drawing import sheet
from loomopt.picture.shapes import LAYERS, Arc, Circle, Line, Point, Text
from reference import crank_rocker_synthesis

few = settings(max_examples=12, deadline=None, database=None)
PAPER = {"l1": 0.031, "l2": 0.065, "l3": 0.155, "l4": 0.167}
BALANCED = PAPER | {"m4": 56.8, "r4": 0.045, "m4e": 3.0, "r4e": 0.05}


def texts(drawn):
    return [primitive for primitive in drawn.primitives if isinstance(primitive, Text)]


def links(drawn, layer):
    """Return crank, rod and rocker of a layer as pairs of points."""
    return [shape.points for shape in drawn.primitives if isinstance(shape, Line) and shape.layer == layer]


@st.composite
def designs(draw):
    """Crank-rockers from their angles, of any size."""
    swing = draw(st.floats(math.radians(1), math.radians(80)))
    theta = draw(st.floats(-0.3, 0.3)) * swing
    beta = draw(st.floats(math.radians(10), math.radians(85)))
    size = draw(st.sampled_from([1e-3, 0.167, 1.0, 1e3]))
    try:
        answer = crank_rocker_synthesis.synthesise(theta, beta, swing, size)
    except ValueError:
        return PAPER
    return {"l1": answer.l1, "l2": answer.l2, "l3": answer.l3, "l4": answer.l4}


@pytest.mark.few(1)
@pytest.mark.parametrize("layer", ["front dead centre", "rear dead centre"])
@few
@given(design=designs())
def test_links_are_drawn_at_full_scale_and_meet(layer, design):
    crank, rod, rocker = links(crank_rocker_drawing.of(design).drawing(""), layer)
    lengths = [math.dist(*link) for link in (crank, rod, rocker)]
    assert lengths == pytest.approx([design[name] for name in ("l1", "l2", "l3")], rel=0, abs=1e-11 * design["l4"])
    assert crank[0] == rod[0]
    assert rod[1] == rocker[1]
    assert crank[1] == (0, 0)
    assert rocker[0] == (design["l4"], 0)


def test_crank_and_rod_are_stretched_in_front_and_folded_at_the_rear():
    drawn = crank_rocker_drawing.of(PAPER).drawing("")
    for layer, length in (("front dead centre", 0.096), ("rear dead centre", 0.034)):
        (b, a), (_, c), _ = links(drawn, layer)
        assert math.dist(a, c) == pytest.approx(length, rel=1e-12)
        assert a.x * (c.y - b.y) - a.y * (c.x - b.x) + b.x * c.y - b.y * c.x == pytest.approx(0, abs=1e-16)


def test_the_path_of_the_rocker_is_the_swing_and_the_crank_turns_on_its_circle():
    drawn = crank_rocker_drawing.of(PAPER).drawing("")
    path = next(p for p in drawn.primitives if isinstance(p, Arc) and p.layer == "paths")
    assert path.radius == pytest.approx(0.155, rel=1e-14)
    assert math.degrees(path.end - path.begin) == pytest.approx(23.0875, abs=1e-3)
    _, (_, c), _ = links(drawn, "front dead centre")
    assert math.dist(path.centre.towards(path.begin, path.radius), c) < 1e-13
    circle = next(p for p in drawn.primitives if isinstance(p, Circle) and p.layer == "paths")
    assert circle.centre == (0, 0)
    assert circle.radius == pytest.approx(0.031, rel=1e-14)


def test_the_arrow_to_the_fell_points_toward_decreasing_psi():
    (start, tip), _ = links(crank_rocker_drawing.of(PAPER).drawing(""), "notes")
    angles = [math.atan2(point.y, point.x - 0.167) for point in (start, tip)]
    assert angles[1] < angles[0]


def test_labels_carry_lengths_in_mm_and_angles_in_degrees():
    shown = " | ".join(text.text for text in texts(sheet(crank_rocker_drawing.of(PAPER).drawing("Reed"))))
    for part in (
        "Reed",
        "l1 = 31",
        "l2 = 65",
        "l3 = 155",
        "l4 = 167",
        "β = 65.9",
        "swing = 23.09°",
        "fell",
        "θ",
    ):
        assert part in shown
    assert {"A", "B", "C", "D", "B'", "C'"} <= {text.text for text in texts(crank_rocker_drawing.of(PAPER).drawing(""))}


@pytest.mark.slow
@few
@given(design=designs())
def test_labels_are_clear_of_links_and_of_each_other(design):
    title = "A crank-rocker of the beat-up, drawn with a rather long title over two lines"
    masses = {"m4": 50.0, "r4": 0.3 * design["l4"], "m4e": 3.0, "r4e": 0.4 * design["l4"]}
    assert clear.faults_of(crank_rocker_drawing.of({**design, **masses}).drawing(title)) == []


@few
@given(design=designs())
def test_the_extent_holds_every_joint_and_every_text(design):
    drawn = sheet(crank_rocker_drawing.of(design).drawing("title"))
    box = shapes.extent(drawn)
    points = [point for p in drawn.primitives if isinstance(p, Line) for point in p.points]
    for text in texts(drawn):
        room = shapes.text_box(text, drawn.height)
        points += [Point(room.left, room.bottom), Point(room.right, room.top)]
    assert all(box.left < x < box.right and box.bottom < y < box.top for x, y in points)


def test_a_drawing_scales_with_its_machine():
    large = {name: 1000 * value for name, value in PAPER.items()}
    small, big = (crank_rocker_drawing.of(design).drawing("t") for design in (PAPER, large))
    assert big.height == pytest.approx(1000 * small.height)
    for layer in ("frame", "front dead centre", "rear dead centre", "dimensions", "notes"):
        for item, other in zip(links(small, layer), links(big, layer), strict=True):
            assert np.array(other) == pytest.approx(1000 * np.array(item), rel=1e-12, abs=1e-12)


def test_every_layer_drawn_on_has_a_style():
    assert {primitive.layer for primitive in crank_rocker_drawing.of(PAPER).drawing("t").primitives} <= LAYERS.keys()


def test_lengths_that_are_no_crank_rocker_are_refused():
    with pytest.raises(BadInput, match=r"l1 \+ l4 < l2 \+ l3 fails"):
        crank_rocker_drawing.of({"l1": 0.1, "l2": 0.02, "l3": 0.02, "l4": 0.1})


def test_joints_are_written_in_mm_with_every_digit():
    rows = list(csv.DictReader(io.StringIO(crank_rocker_drawing.of(PAPER).skeleton.csv())))
    at = {row["joint"]: (float(row["x [mm]"]), float(row["y [mm]"])) for row in rows}
    assert list(at) == ["A", "D", "B", "C", "B'", "C'"]
    for b, c in (("B", "C"), ("B'", "C'")):
        results = [math.dist(at["A"], at[b]), math.dist(at[b], at[c]), math.dist(at["D"], at[c])]
        assert results == pytest.approx([31, 65, 155], rel=1e-13)


def test_control_characters_are_taken_out_of_text():
    assert shapes.plain("a\n\x1b[31mβ\x00") == "a  [31mβ "


def arms(design):
    """Return mass and arm from D, m, of each centre of mass, in both dead centres: along and across the rocker."""
    result = crank_rocker_drawing.of(design).skeleton
    for joints in result.joints.values():
        d, c = np.array(result.pivots["D"]), np.array(joints["C"])
        along = (c - d) / np.hypot(*(c - d))
        for name, masse in result.masses.items():
            arm = np.array(joints[name]) - d
            yield masse.mass, float(arm @ along), float(arm[1] * along[0] - arm[0] * along[1])


def test_the_counterweight_lies_opposite_the_reed_so_that_their_moment_is_that_of_the_figures():
    scene = lo.load("beatup")
    eccentricity = lo.evaluate(scene, {"m4e": 3.0, "r4e": 0.05}).figures["r4"]
    result = list(arms(BALANCED))
    assert [mass for mass, *_ in result] == [56.8, 3.0] * 2
    assert [along for _, along, _ in result] == pytest.approx([0.045, -0.05] * 2, rel=1e-12)
    for centre in (result[:2], result[2:]):
        moment = sum(mass * along for mass, along, _ in centre)
        assert moment == pytest.approx((56.8 + 3.0) * eccentricity, rel=1e-12)
    assert all(abs(across) < 1e-15 for *_, across in result)


def test_the_centres_of_mass_stand_off_the_rocker_by_the_offset_of_the_effect_that_has_one():
    scene = lo.load("beatup").with_effect("gravity").set("effects.gravity.offset", "30 deg")
    rows = registry.of(scene).views.joints_csv(scene, {"m4e": 3.0, "r4e": 0.05})
    at = {
        row["joint"]: complex(float(row["x [mm]"]), float(row["y [mm]"])) for row in csv.DictReader(io.StringIO(rows))
    }
    for prime in ("", "'"):
        rocker, reed, weight = (at[f"{name}{prime}"] - at["D"] for name in "CGE")
        assert math.degrees(cmath.phase(reed / rocker)) == pytest.approx(30, abs=1e-9)
        assert math.degrees(cmath.phase(weight / rocker)) == pytest.approx(-150, abs=1e-9)
    assert next(arms({**BALANCED, "offset": 0.1}))[2] == pytest.approx(0.045 * math.sin(0.1), rel=1e-12)


def test_mass_and_radius_stand_in_drawing_and_table():
    shown = [text.text for text in texts(crank_rocker_drawing.of(BALANCED).drawing(""))]
    assert {"G  m4 = 56.8 kg, r4 = 45", "E  m4e = 3 kg, r4e = 50", "G'", "E'"} <= set(shown)
    rows = {row["joint"]: row for row in csv.DictReader(io.StringIO(crank_rocker_drawing.of(BALANCED).skeleton.csv()))}
    assert list(rows) == ["A", "D", "B", "C", "G", "E", "B'", "C'", "G'", "E'"]
    for name, mass, radius in (("E", 3.0, 50.0), ("E'", 3.0, 50.0), ("G", 56.8, 45.0)):
        assert float(rows[name]["mass [kg]"]) == mass
        assert float(rows[name]["radius [mm]"]) == radius
        place = [float(rows[name][axis]) - float(rows["D"][axis]) for axis in ("x [mm]", "y [mm]")]
        assert math.hypot(*place) == pytest.approx(radius, rel=1e-12)
    assert rows["C"]["mass [kg]"] == ""


@pytest.mark.parametrize(("m4e", "r4e"), [(0.0, 0.05), (3.0, 0.0)])
def test_a_counterweight_that_is_not_there_is_not_drawn(m4e, r4e):
    drawn = crank_rocker_drawing.of(PAPER | {"m4e": m4e, "r4e": r4e}).drawing("")
    assert not [p for p in drawn.primitives if p.layer == "masses"]
    assert "mass" not in crank_rocker_drawing.of(PAPER | {"m4e": m4e, "r4e": r4e}).skeleton.csv()


def test_a_reed_beyond_its_rocker_is_joined_to_the_shaft():
    for radius, count in ((0.1, 3), (0.2, 4)):
        drawn = crank_rocker_drawing.of(PAPER | {"m4": 1.0, "r4": radius}).drawing("")
        assert len(links(drawn, "front dead centre")) == count
