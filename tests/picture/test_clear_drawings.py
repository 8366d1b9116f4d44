"""Labels cross no link, no other label and no edge, in every drawing that a command writes; random machines too."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from support import clear, inch, references

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.interface.files import outputs
from loomopt.picture.drawing import LEADER, sheet
from loomopt.picture.shapes import Circle, Drawing, Line, Point, Text, text_box
from loomopt.scenes import packaged
from reference import crank_rocker_synthesis

NAMES = packaged.problems()
MACHINES = 5
"""Random machines of each job."""


def balanced(random):
    """Return a random crank-rocker of any size with its centres of mass."""
    swing = math.radians(random.uniform(5, 60))
    theta, beta = random.uniform(-0.2, 0.2) * swing, math.radians(random.uniform(15, 80))
    answer = crank_rocker_synthesis.synthesise(theta, beta, swing, 10 ** random.uniform(-2, 1))
    lengths = {name: getattr(answer, name) for name in ("l1", "l2", "l3", "l4")}
    radii = {name: random.uniform(0.1, 1.0) * answer.l4 for name in ("r4", "r4e")}
    return lengths | radii | {"m4": random.uniform(1, 1000), "m4e": random.choice([0.0, 12.3456789])}


def driven(random):
    """Return a random rapier drive, as far from the packaged one as its bounds go."""
    bounds = lo.load("rapier").bounds
    return {name: random.uniform(bound.min, bound.max) for name, bound in bounds.items() if bound.free}


def lifted(random):
    """Return a random follower with its spring."""
    size = 10 ** random.uniform(-2, 0.5)
    arm, centre, base = (size * random.uniform(*span) for span in ((0.8, 1.2), (0.9, 1.3), (0.35, 0.6)))
    swing, rise = math.radians(random.uniform(3, 20)), math.radians(random.uniform(60, 150))
    follower = {"arm": arm, "centre_distance": centre, "base_radius": base, "arm_swing": swing}
    spring = {
        "X0": size * random.uniform(0, 1.0),
        "travel": size * random.uniform(0.05, 0.8),
        "K1": random.uniform(0, 1e6),
    }
    return follower | spring | {"roller_radius": random.uniform(0.05, 0.4) * base, "rise": rise, "return": rise}


RANDOM = {"beatup": balanced, "rapier": driven, "shedding": lifted}


def drawings(job):
    """Yield drawings of random machines of a job: as many as were asked for that assemble."""
    random, scene, result = np.random.default_rng(7), lo.load(job), 0
    while result < MACHINES:
        try:
            yield outputs.drawing(scene, RANDOM[job](random), outputs.DrawnSubject("a machine of random numbers"))
            result += 1
        except (BadInput, ValueError):
            continue


@pytest.mark.few(3)
@pytest.mark.parametrize("name", NAMES)
def test_drawings_of_packaged_scenes_are_clear_today_and_solved(name):
    scene, solved = lo.load(name), references.design(name)
    result = outputs.describe_design(lo.evaluate(scene, solved).result, scene.schema.default_target, "optimal")
    for design, message in (({}, outputs.DrawnSubject("today's machine")), (solved, result)):
        assert clear.faults_of(outputs.drawing(scene, design, message)) == []


@pytest.mark.few(1)
@pytest.mark.parametrize("job", RANDOM)
def test_drawings_of_inch_machines_are_clear(job):
    scene = inch.scene(job, operation__speed="350 rpm")
    assert clear.faults_of(outputs.drawing(scene, {})) == []


@pytest.mark.few(1)
@pytest.mark.parametrize("job", RANDOM)
def test_drawings_of_random_machines_are_clear(job):
    for drawn in drawings(job):
        assert clear.faults_of(drawn) == []


@pytest.mark.parametrize("name", ["beatup", "rapier", "shedding"])
def test_every_label_stands_near_its_thing_or_has_a_line_to_it(name):
    drawn = outputs.drawing(lo.load(name), {})
    h, strokes = drawn.height, [p for p in drawn.primitives if not isinstance(p, Text)]
    tips = [p.points[1] for p in strokes if isinstance(p, Line) and p.layer == "leaders"]
    lines = np.concatenate([clear.segments(p) for p in strokes if p.layer != "leaders"])
    room = (LEADER + 0.1) * h
    for text in (p for p in drawn.primitives if isinstance(p, Text)):
        box = text_box(text, h)
        wide = (box.left - room, box.bottom - room, box.right + room, box.top + room)
        leader = any(math.dist(box.nearest(*tip), tip) < 0.2 * h for tip in tips)
        assert leader or clear.meets(wide, lines).any(), text.text


LINK = Line("frame", (Point(0.0, 0.0), Point(1.0, 1.0)))
SMALL = Drawing("", 0.1, (LINK, Circle("paths", Point(0.0, 0.0), 1.0)))


def shown(*texts):
    return dataclasses.replace(SMALL, primitives=(*SMALL.primitives, *texts))


@pytest.mark.parametrize(
    ("texts", "fault"),
    [
        ([Text("notes", Point(0.5, 0.5), "l1")], ["'l1' lies on a stroke of frame"]),
        ([Text("notes", Point(0.55, 0.42), "l1")], ["'l1' lies on a stroke of frame"]),
        ([Text("notes", Point(0.0, 1.0), "l1")], ["'l1' lies on a stroke of paths"]),
        ([Text("notes", Point(0.2, -0.3), "l1"), Text("notes", Point(0.3, -0.4), "l2")], ["'l1' overlaps 'l2'"]),
        ([Text("notes", Point(0.7, 0.2), "l1")], []),
    ],
)
def test_a_made_up_overlap_is_found(texts, fault):
    assert clear.faults(shown(*texts)) == fault


def test_a_text_beside_the_sheet_is_found():
    neighbour = shown(Text("notes", Point(1.5, 0.0), "l1"))
    assert clear.faults(neighbour, clear.paper(SMALL)) == ["'l1' lies beside the sheet"]
    assert clear.faults(neighbour, clear.paper(neighbour)) == []


def test_a_text_moved_onto_a_link_of_a_real_drawing_is_found():
    drawn = sheet(outputs.drawing(lo.load("beatup"), {}))
    labels = [p for p in drawn.primitives if isinstance(p, Text) and p.text.startswith("l")]
    links = [p for p in drawn.primitives if isinstance(p, Line) and p.layer == "front dead centre"]
    for label, link in itertools.product(labels[:3], links):
        moved = dataclasses.replace(label, at=link.points[0].part(link.points[1]))
        others = tuple(moved if p is label else p for p in drawn.primitives)
        assert any(
            f"{label.text!r} lies on" in fault for fault in clear.faults(dataclasses.replace(drawn, primitives=others))
        )


@pytest.mark.few(1)
@pytest.mark.parametrize("name", ["beatup", "rapier", "shedding"])
def test_a_text_is_no_wider_than_its_box_in_the_font_of_the_pictures(name):
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    from loomopt.picture.shapes import CAPITAL

    drawn = sheet(outputs.drawing(lo.load(name), {}))
    for text in (p for p in drawn.primitives if isinstance(p, Text)):
        size = 1000.0 * text.size / CAPITAL
        path = TextPath((0, 0), text.text, size=size, prop=FontProperties(family="DejaVu Sans"))
        box = text_box(Text(text.layer, text.at, text.text, 1000.0 * text.size), 1.0)
        assert path.get_extents().width < box.right - box.left
        assert path.get_extents().height < box.top - box.bottom
