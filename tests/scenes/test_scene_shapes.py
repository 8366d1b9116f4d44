"""Values of the wrong shape under every key of every table: read or refused by one line per mistake, nothing else."""

import copy
import datetime
import math
import random
import tomllib
from typing import Any

import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.interface.cli.app import run
from loomopt.interface.text import json_schema
from loomopt.jobs import registry
from loomopt.scenes import packaged

VALUES = {
    "a number": 3,
    "a broken number": 2.5,
    "no text": "",
    "a blank": " ",
    "a word": "peak_torque",
    "a length": "1 mm",
    "an opposite": "-l1",
    "a list of a number": [3],
    "a list of a word": ["peak_torque"],
    "the same twice": ["B", "B"],
    "an empty list": [],
    "a list of lists": [[1]],
    "a list of tables": [{"a": 1}],
    "an empty table": {},
    "a table": {"min": "1 mm"},
    "tables inside": {"a": {"b": {"c": 1}}},
    "a table without a name": {"": "1 mm"},
    "true": True,
    "a date": datetime.date(2024, 1, 1),
    "a time": datetime.time(1),
    "a date and time": datetime.datetime(2024, 1, 1),
    "nothing": None,
    "no number": math.nan,
    "a huge number": 10**5000,
}
FAMILY = {"members": [{"speed": "500 rpm"}, {"speed": "400 rpm"}], "combine": "worst", "own": []}
MORE: dict[str, dict[str, Any]] = {
    "beatup": {
        "tolerances": {"l1": {"plus_minus": "0.06 mm", "group": "machine", "correlation": 0.5}, "l2": "0.1 mm"},
        "accept": {"swing": "0.1 deg"},
        "steps": {"l1": "0.5 mm"},
        "stock": {"l2": ["80 mm", "84 mm"]},
    },
    "rapier": {"accept": {"stroke": "1 mm"}, "tolerances": {"l4": {"class": "IT7", "sigmas": 2, "spread": "normal"}}},
    "shedding": {"steps": {"K1": "1 N/mm"}, "accept": {"contact_min": "5 N"}},
    "linkage": {
        "tolerances": {"l1": {"plus_minus": "1 %"}},
        "accept": {"swing": "0.1 deg"},
        "steps": {"l1": "0.5 mm"},
        "stock": {"l2": ["120 mm", "125 mm"]},
        "events": {"late": {"travel": "1 deg", "after": "front"}, "at": {"angle": "10 deg"}},
        "parts": {
            "cam": {
                "kind": "cam", "at": "G", "law": "cycloidal", "lift": "20 deg", "rise": "100 deg", "return": "90 deg",
            },
            "wheel": {"kind": "gear", "at": "D", "with": "crank", "ratio": -2, "pin": "W", "length": "30 mm"},
            "S": {"kind": "point", "on": "cam", "along": "10 mm"},
            "T": {"kind": "point", "on": "wheel", "radius": "10 mm", "angle": "0 deg"},
        },
    },
}  # fmt: skip
JOBS = tuple(MORE)
LINKAGE = lo.load("sixbar-sley").document


def document(job):
    """Return raw tables in which every table of a job stands."""
    name = "sixbar-sley" if job == "linkage" else job
    data = tomllib.loads(packaged.problems()[name].read_text(encoding="utf-8"))
    for table, more in MORE[job].items():
        data[table] = {**data.get(table, {}), **more}
    data["display"] = {"length": "in"}
    data["targets"]["family"] = FAMILY
    return data


def paths(table, start=()):
    """Yield the path of everything in nested tables and lists."""
    for name, value in table.items() if isinstance(table, dict) else enumerate(table):
        yield (*start, name)
        if isinstance(value, dict | list):
            yield from paths(value, (*start, name))


def changed(table, path, value):
    """Return raw tables with the value of one path changed."""
    result = copy.deepcopy(table)
    inside = result
    for name in path[:-1]:
        inside = inside[name]
    inside[path[-1]] = value
    return result


def assert_lines(text):
    """Check that each mistake is one plain line that names a key, and that no line comes twice."""
    lines = text.split("\n")
    assert all(line.isprintable() and len(line) < 2100 for line in lines)
    assert len(set(lines)) == len(lines), text
    assert "pydantic" not in text
    assert "Input should" not in text, text


def read_or_refused(raw):
    try:
        lo.scene(raw)
    except BadInput as error:
        assert_lines(str(error))
        return False
    return True


def every(job):
    return [(path, name) for path in paths(document(job)) for name in VALUES]


@pytest.mark.few(1)
@pytest.mark.parametrize("job", JOBS)
def test_values_of_a_wrong_shape_are_read_or_refused(job):
    raw, cases = document(job), every(job)
    read = [read_or_refused(changed(raw, p, VALUES[name])) for p, name in random.Random(job).sample(cases, 150)]
    assert 0 < sum(read) < len(read) // 2


@pytest.mark.slow
@pytest.mark.whole
@pytest.mark.parametrize("job", JOBS)
def test_every_value_of_a_wrong_shape_is_read_or_refused(job):
    raw = document(job)
    for path, name in every(job):
        read_or_refused(changed(raw, path, VALUES[name]))


SHAPES = [
    ("targets.torque.least", "peak_torque", "targets.torque.least: it is not a list", 'Write ["peak_torque"]'),
    ("targets.torque.least", [3], "targets.torque.least.1: it is not text (given: 3)", "Allowed: text in quotes"),
    ("targets.torque.least", {}, "targets.torque.least: it is not a list (given: a table)", "Allowed: a list"),
    ("targets.torque.point", 3, "targets.torque.point: it is not text (given: 3)", "Allowed: text in quotes"),
    ("targets.torque.point", "", "targets.torque.point: it is empty", "Allowed: a name"),
    ("targets.torque", 3, "targets.torque: it is not a table (given: 3)", "Allowed: a table"),
    ("output.sense", {"min": "1 mm"}, 'output.sense: unknown sense "a table"', "Allowed: forward, backward"),
    ("output.angle", 3, "output.angle: it is not a name (given: 3)", "Allowed: up to 40 letters"),
    ("output", ["sley"], "output: it is not a table (given: a list)", "Allowed: a table"),
    ("parts.drive.joins", ["", "D"], 'parts.drive.joins.1: it is not a name (given: "")', "Allowed: up to 40 letters"),
    ("parts.crank.at", "", 'parts.crank.at: it is not a name (given: "")', "Allowed: up to 40 letters"),
    ("parts.E.on", "", 'parts.E.on: it is not a name (given: "")', "Allowed: up to 40 letters"),
    ("parts.drive.links", ["rod"], "parts.drive.links: it has 2 links, each with its length", "Allowed: a table"),
    ("parts.crank.length", [3], "parts.crank.length: it is neither the name of a number nor a quantity", "Allowed"),
    ("events.front", "max", 'events.front: it is not a table (given: "max")', "Allowed: a table"),
    ("events.front.extreme", ["max"], 'events.front.extreme: unknown extreme "a list"', "Allowed: max, min"),
    ("events.front.near", 41, "events.front.near: the unit is missing (given: 41)", "Allowed: an angle"),
    ("windows.rest.after", 1, "windows.rest.after: it is not a name (given: 1)", "Allowed: up to 40 letters"),
    ("mechanism.l1", datetime.date(2024, 1, 1), "mechanism.l1: it is not a quantity (given: date)", "Allowed: a le"),
    ("problem.title", 5, "problem.title: it is not text (given: 5)", "Allowed: text in quotes"),
    ("bounds.l1.free", [True], "bounds.l1.free: it is neither true nor false (given: a list)", "Allowed: true, false"),
    ("limits.swing", "23 deg", 'limits.swing: it is not a table (given: "23 deg")', "Allowed: a table with min"),
    ("stock", {"l1": "1 mm"}, 'stock.l1: it is not a list of sizes (given: "1 mm")', "Write wire"),
    ("display", {"length": 3}, "display.length: it is not a unit (given: 3)", "Allowed: a unit of length"),
    ("effects.mass.rod", [3], "effects.mass.rod: it is not a table (given: a list)", "Allowed: a table"),
]  # fmt: skip


@pytest.mark.parametrize(("key", "value", "problem", "allowed"), SHAPES, ids=[f"{s[0]}-{s[1]}" for s in SHAPES])
def test_a_wrong_shape_is_one_line_with_key_given_and_allowed(key, value, problem, allowed):
    for call in (
        lambda: lo.scene(changed(LINKAGE, key.split("."), value)),
        lambda: lo.load("sixbar-sley").set(key, value),
    ):
        with pytest.raises(BadInput) as caught:
            call()
        assert problem in str(caught.value)
        assert allowed in str(caught.value)
        assert "\n" not in str(caught.value)


USER_SHAPES = [
    shape for shape in SHAPES if shape[0].split(".")[0] in ("targets", "output", "parts", "events", "windows")
]


@pytest.mark.parametrize(("key", "value"), [s[:2] for s in USER_SHAPES], ids=[f"{s[0]}-{s[1]}" for s in USER_SHAPES])
def test_the_json_schema_refuses_the_same_shapes(key, value):
    jsonschema = pytest.importorskip("jsonschema")
    checker = jsonschema.Draft202012Validator(json_schema.scene(registry.declared("linkage")))
    assert checker.is_valid(LINKAGE)
    assert not checker.is_valid(changed(LINKAGE, key.split("."), value))


def test_two_mistakes_are_two_lines():
    with pytest.raises(BadInput) as caught:
        lo.load("beatup").update({"limits.swing": {"min": "1 mm", "max": "2 mm"}, "targets.balance.expected": 3})
    assert [line.split(": ")[1] for line in str(caught.value).split("\n")] == [
        "limits.swing.min",
        "limits.swing.max",
        "targets.balance.expected",
    ]


@pytest.mark.parametrize(
    "given", ['targets.torque.least=["peak_torque"]', "targets.torque = { least = ['peak_torque'] }"]
)
def test_a_list_or_a_table_can_be_set_in_the_call(given, capsys):
    assert run(["evaluate", "sixbar-sley", "--target", "torque", "--set", given]) in (0, 1)
    assert "peak_torque" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("given", "problem"),
    [
        ("targets.torque.least=peak_torque", "it is not a list"),
        ("targets.torque.least=[3]", "least.1: it is not text"),
        ("targets.torque.least=[peak_torque]", "it is not a list"),
        ("output.sense={ min = 1 }", "unknown sense"),
        ("parts.drive.joins=['', 'D']", "joins.1: it is not a name"),
    ],
)
def test_a_wrong_shape_set_in_the_call_is_exit_2_and_one_line(given, problem, capsys):
    assert run(["evaluate", "sixbar-sley", "--set", given]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert problem in err
    assert err.count("\n") == 1


@pytest.mark.parametrize("scale", [2, 2.0, "2"])
def test_the_scale_of_an_angle_multiplies_the_output(scale):
    raw = tomllib.loads(registry.template("linkage"))
    plain = lo.evaluate(lo.scene(raw)).figures
    doubled = lo.evaluate(lo.scene(raw).set("output.scale", scale)).figures
    for figure, factor in {
        "swing": 2,
        "peak_velocity": 2,
        "peak_acceleration": 2,
        "sweep": 1,
        "angle.front": 1,
    }.items():
        assert doubled[figure] == pytest.approx(factor * plain[figure], rel=1e-10)


def test_a_scaled_angle_that_jumps_is_still_refused():
    raw = tomllib.loads(registry.template("linkage"))
    with pytest.raises(BadInput, match="jumps at"):
        lo.scene(changed(changed(raw, ["output", "scale"], 2), ["output", "zero"], "340 deg"))
