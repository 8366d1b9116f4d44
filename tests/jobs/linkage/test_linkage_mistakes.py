"""What is wrong with a linkage's output, events, windows, effects and targets: one message each, with its key."""

import math

import numpy as np
import pytest
from support.linkage_scenes import FOUR_BAR, changed, four_bar

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.interface.cli.app import run
from loomopt.jobs import registry

TURNS = {"parts": {"crank": {"ratio": 2}}}

MISTAKES = [
    ({"events": {"front": {"near": "244 deg"}}}, "events.front.near", "no max: it is highest at 65.92 deg"),
    ({"events": {"front": {"near": "5 mm"}}}, "events.front.near", "length, not of angle"),
    ({"events": {"front": {"extreme": "maximum"}}}, "events.front.extreme", "unknown extreme"),
    ({"events": {"front": {"extreme": None}}}, "events.front", "an event needs"),
    ({"events": {"front": {"nere": "60 deg"}}}, "events.front.nere", "unknown key"),
    ({"events": {"touch": {"travel": "5 deg"}}}, "events.touch", "before or after"),
    ({"events": {"touch": {"travel": "90 deg", "before": "front"}}}, "events.touch", "never reaches the travel"),
    (
        {"events": {"touch": {"travel": "5 deg", "before": "fornt"}}},
        "events.touch.before",
        'unknown event above it "fornt"',
    ),
    ({"events": {"touch": {"travel": "5 mm", "before": "front"}}}, "events.touch.travel", "length, not of angle"),
    ({"events": {"touch": {"angle": "nine"}}}, "events.touch.angle", "unknown number"),
    ({"events": {"fr ont": {"angle": "3 deg"}}}, "events.fr ont", "not a name"),
    (changed(TURNS, {"events": {"front": {"near": None}}}), "events.front", "the output is highest, within"),
    (
        changed(TURNS, {"events": {"front": {"near": "123 deg"}}}),
        "events.front.near",
        "has no max: it is highest at 32.96 deg, 213 deg",
    ),
    ({"output": {"angle": "crank"}}, "output.angle", "turns all round"),
    ({"output": {"angle": "rockr"}}, "output.angle", 'unknown link "rockr"'),
    ({"output": {"sense": "left"}}, "output.sense", 'unknown sense "left"'),
    ({"output": {"against": "rodd"}}, "output.against", 'unknown link "rodd"'),
    ({"output": {"angle": None}}, "output", "none is given"),
    ({"output": {"x": "C"}}, "output", "angle and x is given"),
    ({"output": {"speed": "3"}}, "output.speed", "unknown key"),
    ({"parts": {"D": {"x": None}, "crank": {"start": "160 deg"}}}, "mechanism.l4", "number l4 is not used"),
    ({"effects": {"resistance": {"at": "fornt"}}}, "effects.resistance.at", 'unknown event "fornt"'),
    ({"effects": {"mass": {"rodd": {"mass": "1 kg"}}}}, "effects.mass.rodd", 'unknown link or joint "rodd"'),
    ({"effects": {"load": {"rod": {"x": "1 N"}}}}, "effects.load.rod", 'unknown joint "rod"'),
    ({"effects": {"load": {"C": {}}}}, "effects.load.C", "constant components or a table"),
    ({"effects": {"load": {"C": {"x": "1 N", "begins": "front"}}}}, "effects.load.C", "begins at an event and ends"),
    ({"effects": {"load": {"C": {"x": "1 N", "at": "front"}}}}, "effects.load.C.at", "at needs a table"),
    (
        {"effects": {"spring": {"stiffness": "1 N*m/rad", "at": "nowhere"}}},
        "effects.spring.at",
        'unknown event "nowhere"',
    ),
    (
        {"effects": {"spring": {"s": {"begins": "A", "ends": "Z", "stiffness": "1 N/mm", "free": "1 mm"}}}},
        "effects.spring.s.ends",
        'unknown joint "Z"',
    ),
    (
        {"effects": {"forming": {"torque": "1 N*m", "begins": "front", "ends": "front"}}},
        "effects.forming.ends",
        "begins where it ends",
    ),
    (
        {"targets": {"balance": {"least": ["moment.frnt"]}}},
        "targets.balance.least",
        'unknown figure or bounded number "moment.frnt"',
    ),
    (
        {"targets": {"balance": {"least": None, "most": ["peak_torque"]}}},
        "targets.balance.most",
        "it can only be minimised",
    ),
    ({"targets": {"balance": {"least": []}}}, "targets.balance", "nothing to optimise"),
    ({"targets": {"balance": {"least": ["swing", "swing"]}}}, "targets.balance", "listed twice"),
    ({"targets": {"balance": {"least": None, "point": "C"}}}, "targets.balance.table", "a path needs a table"),
    ({"targets": {"balance": {"table": "x.csv"}}}, "targets.balance.point", "the table of a path needs its point"),
    (
        {"targets": {"balance": {"least": None, "point": "Z", "table": "x.csv"}}},
        "targets.balance.point",
        'unknown joint "Z"',
    ),
    ({"limits": {"x_max": {"Q": {"max": "1 mm"}}}}, "limits.x_max", "unknown figure to limit"),
    (
        {"windows": {"rest": {"after": "front", "begins": "100 deg", "ends": "20 deg", "level": "rear"}}},
        "windows.rest.ends",
        "from 100 deg to 20 deg",
    ),
    (
        {"windows": {"rest": {"after": "front", "begins": "100 deg", "ends": "120 deg", "level": "read"}}},
        "windows.rest.level",
        'unknown event "read"',
    ),
    (
        {"windows": {"rest": {"after": "front", "begins": "100 deg", "ends": "120 deg"}}},
        "windows.rest.level",
        "a window needs level or value",
    ),
    (
        {"mechanism": {"l1": None, "swing": "31 mm"}, "parts": {"crank": {"length": "swing"}}, "bounds": {"l1": None}},
        "mechanism.swing",
        "name of a figure",
    ),
    (
        {"mechanism": {"l1": None, "speed": "31 mm"}, "parts": {"crank": {"length": "speed"}}, "bounds": {"l1": None}},
        "mechanism.speed",
        "the crank's speed",
    ),
    (
        {
            "mechanism": {"l1": None, "radius": "31 mm"},
            "parts": {"crank": {"length": "radius"}},
            "bounds": {"l1": None},
        },
        "mechanism.radius",
        "a number of effect counterweight",
    ),
    ({"mechanism": {"l 1": "30 mm"}}, "mechanism.l 1", "not a name"),
    ({"mechanism": {"l1": "80 mm"}}, "mechanism", r"beat: B to D < rod \+ rocker fails at crank angle 180 deg"),
    ({"operation": {"speed": None}}, "operation.speed", "effect inertia needs it"),
]


@pytest.mark.parametrize(("changes", "key", "problem"), MISTAKES, ids=[key for _, key, _ in MISTAKES])
def test_a_mistake_is_one_message_with_its_key_and_file(changes, key, problem):
    with pytest.raises(BadInput, match=problem.replace("(", r"\(")) as error:
        four_bar(**changes)
    assert [fault.key for fault in error.value.faults] == [key]
    assert error.value.file == "<dict>"
    assert error.value.remedy


SLIDING = changed(
    FOUR_BAR,
    {
        "output": {"angle": None, "sense": None, "x": "C"},
        "effects": {"inertia": {"J": None, "mass": "20 kg"}, "resistance": None, "counterweight": None},
        "bounds": {"mass": None},
        "limits": {"swing": None},
        "targets": {"balance": None},
    },
)


def test_what_slides_has_masses_and_forces():
    scene = registry.scene(SLIDING)
    assert scene.full("mass") == "inertia.mass"
    assert registry.find("linkage").figures(scene, {})["force.front"] is not None
    with pytest.raises(BadInput, match='unknown effect "counterweight"'):
        registry.scene(changed(SLIDING, {"effects": {"counterweight": {"mass": "1 kg", "radius": "1 mm"}}}))
    with pytest.raises(BadInput, match="force"):
        registry.scene(
            changed(SLIDING, {"effects": {"forming": {"torque": "1 N*m", "begins": "rear", "ends": "front"}}})
        )


def test_an_output_that_jumps_at_half_a_turn_is_refused_with_the_direction_that_helps():
    turned = {"parts": {"A": {"x": "1 mm"}, "D": {"x": "151 mm", "y": "70 mm"}, "crank": {"start": "25 deg"}}}
    document = changed(
        FOUR_BAR, changed(turned, {"mechanism": {"l4": None}, "bounds": {"l4": None}, "limits": {"mu": None}})
    )
    with pytest.raises(BadInput, match=r"jumps at \+-180 deg") as error:
        registry.scene(document)
    assert error.value.key == "output.angle"
    zero = error.value.remedy.split('"')[1]
    scene = registry.scene(changed(document, {"output": {"zero": zero}}))
    curves = lo.simulate(scene)
    assert np.abs(np.diff(curves["q [rad]"])).max() < 0.1


def test_a_cam_that_rests_is_farthest_where_its_rise_ends():
    parts = {
        "A": {"kind": "pivot"},
        "follower": {
            "kind": "cam", "at": "A", "pin": "B", "length": "l1", "law": "cycloidal", "lift": "20 deg",
            "rise": "100 deg", "far_dwell": "60 deg", "return": "100 deg",
        },
    }  # fmt: skip
    document = {
        "problem": {"name": "cam", "job": "linkage", "title": "a cam"},
        "operation": {"speed": "100 rpm"},
        "mechanism": {"l1": "80 mm"},
        "parts": parts,
        "output": {"angle": "follower"},
        "effects": {"inertia": {"J": "0.1 kg*m^2"}},
        "targets": {"torque": {"least": ["peak_torque"]}},
    }
    assert registry.find("linkage").figures(registry.scene(document), {})["peak_torque"] > 0
    figures = lo.evaluate(registry.scene({**document, "events": {"top": {"extreme": "max"}}})).figures
    assert figures["angle.top"] == pytest.approx(math.radians(100), abs=1e-14)


@pytest.mark.parametrize("near", [66, 20, 110])
def test_events_of_an_answer_are_those_of_a_scan_of_the_whole_turn(near):
    scene = four_bar(events={"front": {"near": f"{near} deg"}})
    answer = lo.solve(scene, "torque", starts=1)
    curves = registry.find("linkage").curves(scene, dict(answer.design), 7200)
    top = curves["phi [rad]"][int(np.argmax(curves["q [rad]"]))]
    assert answer.figures["angle.front"] == pytest.approx(top, abs=2e-3)


def test_the_command_ends_with_one_line(capsys, tmp_path):
    text = "problem = { name = 'x', job = 'linkage', title = 'x' }\nparts.A = { kind = 'pivott' }\noutput.angle = 'A'\n"
    (tmp_path / "x.toml").write_text(text)
    assert run(["solve", str(tmp_path / "x.toml")]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "parts.A.kind" in err
    assert "Traceback" not in err
