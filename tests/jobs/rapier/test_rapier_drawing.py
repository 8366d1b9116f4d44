import csv
import dataclasses
import importlib
import io
import math
from typing import Any

import numpy as np
import pytest
from support import clear

from loomopt.base.errors import BadInput
from loomopt.interface.figures import figure
from loomopt.interface.files import dxf, svg
from loomopt.jobs.rapier import drawing as rapier_drawing
from loomopt.jobs.rapier.drawing import FRONT, LINKS, OVER, REAR
from loomopt.maths import systems
from loomopt.physics.mechanisms import rapier_drive
from loomopt.physics.mechanisms.rapier_drive import Dimensions, RapierPose, Sley
from loomopt.picture.drawing import sheet
from loomopt.picture.shapes import LAYERS, Circle, Line, Text

ezdxf: Any = importlib.import_module("ezdxf")


def paper():
    """Return the drive that [Hong17] prints, by the kernel's closed-form construction."""
    printed = {"l1": 0.076385, "l2": 0.275705, "l3": 0.684, "l71": 0.773, "l3p": 0.180, "l4": 0.012, "l6": 0.185}
    printed |= {"phi30": math.radians(80.48), "alpha": math.radians(30), "i1": 300 / 18, "i2": 1.0, "wheel": 0.240}
    given = Dimensions(**printed, l5=math.nan, C0x=math.nan, C0y=math.nan, phi40=math.nan)
    swing = Sley(systems.FLOAT, given).centres.swing
    layout = rapier_drive.construct(systems.FLOAT, given, given.phi30 - swing, math.radians(24.35))
    results = {"C0x": layout.C0x, "C0y": layout.C0y, "l5": layout.reach - given.l4, "phi40": layout.phi40}
    return dataclasses.asdict(given) | results


PAPER = paper()
PRIMES = {FRONT: "", REAR: "'", OVER: "''"}
SIZES = ("l1", "l2", "l3", "l3p", "l4", "l5", "l6")
WIDER = PAPER | {"l4": 0.03, "l6": 0.2, "alpha": math.radians(40), "phi40": PAPER["phi40"] + 0.2}
"""Another drive that assembles all round."""


def texts(drawn):
    return [primitive for primitive in drawn.primitives if isinstance(primitive, Text)]


def links(drawn, layer):
    """Return the links of a position as pairs of points."""
    return [p.points for p in drawn.primitives if isinstance(p, Line) and p.layer == layer]


def travel(design, phi1):
    """Return the rapier's travel, m, and its derivative at crank angles."""
    d = Dimensions(*(design[field.name] for field in dataclasses.fields(Dimensions)))
    stand = Sley(systems.numpy(), d).stand
    front = RapierPose(systems.numpy(), d, stand, np.array(0.0)).relative
    pose = RapierPose(systems.numpy(), d, stand, phi1)
    return d.travel * pose.phi63(front), d.travel * pose.phi63_1


@pytest.mark.few(3)
@pytest.mark.parametrize("layer", [FRONT, REAR, OVER])
@pytest.mark.parametrize("design", [PAPER, WIDER])
def test_links_are_drawn_at_full_scale_and_meet(design, layer):
    drawn = links(rapier_drawing.of(design).drawing(""), layer)
    assert [math.dist(*link) for link in drawn] == pytest.approx([design[name] for name in SIZES], rel=1e-11)
    at = {name: point for ends, link in zip(LINKS, drawn, strict=True) for name, point in zip(ends, link, strict=True)}
    for ends, link in zip(LINKS, drawn, strict=True):
        assert [at[name] for name in ends] == list(link)
    assert at["B0"] == (0, 0)
    assert math.dist(at["A0"], at["B0"]) == pytest.approx(design["l71"], rel=1e-12)
    assert at["C0"] == pytest.approx((design["C0x"], design["C0y"]), rel=1e-12)


def test_crank_and_rod_are_in_line_in_both_dead_centres():
    for layer, length in ((FRONT, 0.076385 + 0.275705), (REAR, 0.275705 - 0.076385)):
        (a0, _), (_, b1), *_ = links(rapier_drawing.of(PAPER).drawing(""), layer)
        assert math.dist(a0, b1) == pytest.approx(length, rel=1e-10)


@pytest.mark.parametrize("design", [PAPER, WIDER])
def test_the_hand_over_is_where_the_travel_is_greatest(design):
    result = rapier_drawing.of(design)
    S, _ = travel(design, np.linspace(0, 2 * np.pi, 100_001))
    at, rate = travel(design, np.array(result.events[OVER]))
    assert abs(rate) < 1e-12
    assert 0 <= at - S.max() < 1e-8
    assert result.phi63 * result.dimensions.travel == pytest.approx(float(at), rel=1e-12)


def test_labels_carry_lengths_angles_the_stroke_and_the_three_positions():
    drawn = sheet(rapier_drawing.of(PAPER).drawing("Rapier"))
    shown = [text.text for text in texts(drawn)]
    for part in ("Rapier", "l1 = 76.385", "l2 = 275.705", "l3 = 684", "l71 = 773", "l3p = 180", "l4 = 12", "l6 = 185"):
        assert part in shown
    assert {"l5 = 495.065", "α = 30.00°", "swing = 13.01°", "φ63 max = 24.33°", "A0", "B0", "C0", "fell"} <= set(shown)
    legend = " | ".join(shown)
    assert "stroke = i1 i2 wheel/2 φ63 max = 849.23" in legend
    assert "front dead centre, crank at 0.00°" in legend
    assert "rear dead centre, crank at 185.58°" in legend  # K = 174.42/185.58 as [Hong17] prints, 0.94
    assert "hand-over, crank at 182.53°" in legend
    names = {name for text in shown for name in text.split(", ")}
    assert {f"{joint}{prime}" for joint in ("A", "B1", "B2", "C", "D") for prime in PRIMES.values()} <= names


def test_both_cranks_have_their_circles_and_d_its_path_through_every_position():
    drawn = rapier_drawing.of(WIDER).drawing("")
    circles = [p.radius for p in drawn.primitives if isinstance(p, Circle) and p.layer == "paths"]
    assert circles == pytest.approx([0.076385, 0.030], rel=1e-12)
    (path,) = [p for p in drawn.primitives if isinstance(p, Line) and p.closed]
    for layer in PRIMES:
        *_, (_, d) = links(drawn, layer)
        assert min(math.dist(d, point) for point in path.points) < 1.5e-3


def test_labels_are_clear_of_links_and_of_each_other_with_a_long_title():
    title = "The rapier drive, drawn with a rather long title that runs over two lines " * 2
    drawn = rapier_drawing.of(WIDER).drawing(title)
    assert clear.faults_of(drawn) == []
    assert {primitive.layer for primitive in drawn.primitives} <= LAYERS.keys()


def test_joints_are_written_in_mm_with_every_digit():
    rows = list(csv.DictReader(io.StringIO(rapier_drawing.of(PAPER).skeleton.csv())))
    at = {row["joint"]: (float(row["x [mm]"]), float(row["y [mm]"])) for row in rows}
    assert len(at) == len(rows) == 3 + 3 * 5
    for position, prime in PRIMES.items():
        assert {row["joint"] for row in rows if row["position"] == position} >= {f"A{prime}", f"D{prime}"}
        for (item, other), name in zip(LINKS, SIZES, strict=True):
            ends = [at[joint if joint in at and joint.endswith("0") else joint + prime] for joint in (item, other)]
            assert math.dist(*ends) == pytest.approx(1e3 * PAPER[name], rel=1e-11)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"l1": 0.5}, "fails"),
        ({"l5": 0.3}, r"farther apart than l5 \+ l6"),
        ({"l5": 0.9}, "closer than l5 and l6 differ"),
    ],
)
def test_a_drive_that_does_not_assemble_is_refused(change, reason):
    with pytest.raises(BadInput, match=reason):
        rapier_drawing.of(PAPER | change)


def test_a_refused_sley_is_named_by_its_own_lengths():
    with pytest.raises(BadInput, match=r"l1 \+ l71 < l2 \+ l3"):
        rapier_drawing.of(PAPER | {"l1": 0.2}).drawing("")


def test_svg_dxf_and_png_hold_the_drive(tmp_path):
    drawn = rapier_drawing.of(PAPER).drawing("Rapier")
    assert 'data-layer="hand-over"' in svg.render(drawn)
    dxf.write(drawn, tmp_path / "a.dxf")
    document = ezdxf.readfile(tmp_path / "a.dxf")
    assert not document.audit().errors
    for layer in PRIMES:
        lines = document.modelspace().query(f'LINE[layer=="{layer}"]')
        lengths = [line.dxf.start.distance(line.dxf.end) for line in lines]
        assert lengths == pytest.approx([1e3 * PAPER[name] for name in SIZES], rel=0, abs=1e-8)
    figure.draw(drawn, tmp_path / "a.png")
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
