"""Bad input: one plain line for each mistake, with file, key, value and remedy; nothing else comes out."""

import copy
import datetime
import math
import os
import pickle
import re
from typing import Any

import pytest

from loomopt.base.errors import BadInput
from loomopt.base.quantities import Quantity
from loomopt.base.units import QuantityError
from loomopt.jobs.registry import find, load, scene
from loomopt.scenes import designs, packaged

BEATUP = load("beatup")
TEXT = packaged.problems()["beatup"].read_text(encoding="utf-8")
REMOVED = object()


def changed(*path_and_value):
    """Return a copy of the packaged tables with one value at a path replaced, made or REMOVED."""
    *path, last, value = path_and_value
    document = copy.deepcopy(dict(BEATUP.document))
    table = document
    for name in path:
        if not isinstance(table.get(name), dict):
            table[name] = {}
        table = table[name]
    if value is REMOVED:
        del table[last]
    else:
        table[last] = value
    return document


def nested(depth):
    """Return tables in tables."""
    table: dict[str, object] = {}
    for _ in range(depth):
        table = {"a": table}
    return table


# path and value in the tables -> key named, part of the problem, part of what is allowed or of the remedy
VALUES = [
    (("mechanism", "l1", 31), "mechanism.l1", "unit is missing", "quotes"),
    (("mechanism", "l1", 31.5), "mechanism.l1", "unit is missing", "quotes"),
    (("mechanism", "l1", True), "mechanism.l1", "not a quantity", "a length"),
    (("mechanism", "l1", ["31 mm"]), "mechanism.l1", "not a quantity", "a length"),
    (("mechanism", "l1", {"min": "31 mm"}), "mechanism.l1", "not a quantity", "a length"),
    (("mechanism", "l1", datetime.date(2024, 1, 1)), "mechanism.l1", "not a quantity", "a length"),
    (("mechanism", "l1", None), "mechanism.l1", "not a quantity", "a length"),
    (("mechanism", "l1", "31"), "mechanism.l1", "unit is missing", '"31 mm"'),
    (("mechanism", "l1", "31,5 mm"), "mechanism.l1", "comma", "decimal point"),
    (("mechanism", "l1", "1 3/16 in"), "mechanism.l1", "fraction", '"1.1875 in"'),
    (("mechanism", "l1", "31 mm + 3 in"), "mechanism.l1", "arithmetic", "one number"),
    (("mechanism", "l1", "31 kg"), "mechanism.l1", "unit of mass, not of length", "mm"),
    (("mechanism", "l1", "31 mmm"), "mechanism.l1", '"mmm" is not a unit', '"mm"'),
    (("mechanism", "l1", "nan mm"), "mechanism.l1", "finite", "a length"),
    (("mechanism", "l1", "1e999 mm"), "mechanism.l1", "too large", "a length"),
    (("mechanism", "l1", ""), "mechanism.l1", "empty", "a length"),
    (("mechanism", "l1", "mm"), "mechanism.l1", "number is missing", "a number"),
    (("mechanism", "l1", "1_000 mm"), "mechanism.l1", "grouped", "separators"),
    (("mechanism", "l1", "0 mm"), "mechanism.l1", "out of range", "more than 0 mm"),
    (("mechanism", "l1", "-31 mm"), "mechanism.l1", "out of range", "more than 0 mm"),
    (("mechanism", "l1", "9" * 5000 + " mm"), "mechanism.l1", "5003 characters long", "a length"),
    (("mechanism", "l1", "31 \x1b[31mmm"), "mechanism.l1", "is not a unit", "a length"),
    (("mechanism", "m4e", "-1 kg"), "mechanism.m4e", "out of range", "at least 0 kg"),
    (("mechanism", "l1", "170 mm"), "mechanism.l1, l2, l3, l4", "not a crank-rocker", "shortest"),
    (("operation", "speed", "10 Hz"), "operation.speed", "turns or radians", '"600 rpm"'),
    (("operation", "speed", "600 1/min"), "operation.speed", "turns or radians", '"600 rpm"'),
    (("operation", "speed", "0 rpm"), "operation.speed", "out of range", "more than 0 rpm"),
    (("operation", "speed", "62.8"), "operation.speed", "unit is missing", "rpm"),
    (("operation", "M0", "745 Nm"), "operation.M0", '"Nm" is not a unit', '"N*m"'),
    (("operation", "M0", "745 N m"), "operation.M0", '"N m" is not a unit', '"N*m"'),
    (("effects", "resistance", "pulse", "29.8"), "effects.resistance.pulse", "unit is missing", "deg"),
    (("effects", "resistance", "pulse", "1e-40 deg"), "effects.resistance.pulse",
     "out of range", "at least 5.72958e-09 deg"),
    (("effects", "resistance", "pulse", "360 deg"), "effects.resistance.pulse",
     "out of range", "less than 360 deg"),
    (("effects", "inertia", "J4", "0.62 kg*m"), "effects.inertia.J4", "not a unit of inertia", "kg*m^2"),
    (("effects", "inertia", "heavy"), "effects.inertia", "not a table", "[effects.inertia]"),
    (("available", "gravity", "tilt", "steep"), "available.gravity.tilt", "number is missing", "an angle"),
    (("effects", "rod_inertia", {"m2": "1 kg", "s2": "3 cm", "model": "rigid"}), "effects.rod_inertia.model",
     "unknown choice", '"lumped" or "exact"'),
    (("effects", "rod_inertia", {"m2": "1 kg", "s2": "3 cm", "model": "exact"}), "effects.rod_inertia.model",
     "JS2 is missing", "Add JS2"),
    (("bounds", "l1", "min", "36 mm"), "bounds.l1",
     'min is more than max (min "36 mm", max "35 mm")', "min <= max"),
    (("bounds", "l1", "min", "0 mm"), "bounds.l1.min", "out of range", "more than 0 mm"),
    (("bounds", "l1", "min", "30 deg"), "bounds.l1.min", "unit of angle", "mm"),
    (("bounds", "l1", 31), "bounds.l1", "unit is missing", "quotes"),
    (("bounds", "l1", "free", "maybe"), "bounds.l1.free", "neither true nor false", "true, false"),
    (("limits", "swing", "23 deg"), "limits.swing", "not a table", "min and max"),
    (("limits", "swing", "min", "24 deg"), "limits.swing", "min is more than max", "min <= max"),
    (("limits", "swing", "min", "22.9"), "limits.swing.min", "unit is missing", '"22.9 deg"'),
    (("limits", "mu_min", "max", "60 deg"), "limits.mu_min.max", "mu_min has no limit max", "min"),
    (("limits", "peak_torque", {"min": "5 N*m"}), "limits.peak_torque.min", "no limit min", "max"),
    (("targets", "torque", "M3_tolerance", "-1 N*m"), "targets.torque.M3_tolerance",
     "out of range", "at least 0 N*m"),
    (("targets", "retrofit", "weights", "l1", "heavy"), "targets.retrofit.weights.l1",
     "number is missing", "number"),
    (("targets", "retrofit", "weights", "l1", math.inf), "targets.retrofit.weights.l1", "finite", "number"),
    (("targets", "retrofit", "weights", "l1", "300/0"), "targets.retrofit.weights.l1",
     "divides by zero", "number"),
    (("targets", "retrofit", "weights", "l1", "5 mm"), "targets.retrofit.weights.l1", "has no unit", "off"),
    (("targets", "retrofit", "weights", "all"), "targets.retrofit.weights", "not a table", "Correct"),
    (("problem", "title", 5), "problem.title", "not text", "Correct"),
    (("problem", "name", "../etc/passwd"), "problem.name", "not a name", "letters"),
    (("problem", "name", ""), "problem.name", "not a name", "letters"),
    (("problem", "name", "-rf"), "problem.name", "not a name", "digit first"),
    (("problem", "name", "--help"), "problem.name", "not a name", "digit first"),
    (("problem", "name", "_"), "problem.name", "not a name", "digit first"),
    (("problem", "name", "CON"), "problem.name", "not a name", "CON"),
    (("problem", "name", "lpt1"), "problem.name", "not a name", "CON"),
    (("problem", "name", "com\u00b3"), "problem.name", "not a name", "CON"),
    (("problem", "name", "beatup\n"), "problem.name", "not a name", "letters"),
    (("problem", "name", "a" * 65), "problem.name", "not a name", "64"),
    (("mechanism", "five"), "mechanism", "not a table", "[mechanism]"),
    (("bounds", ["l1"]), "bounds", "not a table", "[bounds]"),
]  # fmt: skip

# path and value in the tables -> key named, part of the problem, part of what is allowed or of the remedy
NAMES = [
    (("mechanisms", {}), "mechanisms", 'unknown table "mechanisms"', '"mechanism"'),
    (("mechanism", "l5", "31 mm"), "mechanism.l5", 'unknown key "l5"', "l1, l2, l3, l4"),
    (("operation", "sped", "600 rpm"), "operation.sped", 'unknown key "sped"', '"speed"'),
    (("mechanism", "l1", REMOVED), "mechanism.l1", "l1 is missing", "Add l1 to [mechanism]"),
    (("mechanism", REMOVED), "mechanism.l1", "l1 is missing", "Add l1 to [mechanism]"),
    (("operation", "M0", REMOVED), "operation.M0", "effect resistance needs it", "Add M0 to [operation]"),
    (("operation", "speed", REMOVED), "operation.speed", "effect inertia needs it", '"600 rpm"'),
    (("effects", "grvity", {}), "effects.grvity", 'unknown effect "grvity"', '"gravity"'),
    (("effects", "warp_tension", {}), "effects.warp_tension",
     'unknown effect "warp_tension"', "inertia, resistance"),
    (("available", "grvity", {}), "available.grvity", 'unknown effect "grvity"', '"gravity"'),
    (("effects", "gravity", {"tilt": "0 deg"}), "effects.gravity.offset", "offset is missing", "Add offset"),
    (("effects", "inertia", "J5", "1 kg*m^2"), "effects.inertia.J5", 'unknown key "J5"', '"J4"'),
    (("bounds", "l1", {}), "bounds.l1.min", "min is missing", "min and max"),
    (("bounds", "l1", "max", REMOVED), "bounds.l1.max", "max is missing", "min and max"),
    (("bounds", "l1", "low", "30 mm"), "bounds.l1.low", 'unknown key "low"', "min, max, free"),
    (("bounds", "l9", {}), "bounds.l9", 'unknown number to bound "l9"', "l1, l2, l3, l4"),
    (("bounds", "J3", {}), "bounds.J3.min", "min is missing", "min and max"),
    (("limits", "swing", {}), "limits.swing", "empty", "min and max"),
    (("limits", "swing", "low", "20 deg"), "limits.swing.low", 'unknown key "low"', "min, max"),
    (("limits", "swng", {}), "limits.swng", 'unknown figure to limit "swng"', '"swing"'),
    (("limits", "reed_centrifugal", {"max": "1 kN"}), "limits.reed_centrifugal",
     "centrifugal is off", "Put centrifugal on"),
    (("targets", "balanced", {}), "targets.balanced", 'unknown target "balanced"', '"balance"'),
    (("targets", "balance", "tolerance", "1"), "targets.balance.tolerance",
     'unknown key "tolerance"', "expected"),
    (("problem", "job", "beetup"), "problem.job", 'unknown job "beetup"', '"beatup"'),
    (("problem", "job", REMOVED), "problem.job", "job is missing", "Add job"),
    (("problem", "name", REMOVED), "problem.name", "name is missing", "Add name"),
    (("problem", "titel", "x"), "problem.titel", 'unknown key "titel"', '"title"'),
    (("mechanism", "x\x1b[2J\n", "1 mm"), "mechanism.x", "unknown key", "l1, l2"),
    (("mechanism", "x" * 5000, "1 mm"), "mechanism.xxx", "(5000 characters)", "l1, l2"),
    (("targets", "balance", "expected", nested(20)), "targets.balance.expected...",
     "nested too deep", "loomopt new"),
    (("mechanism", 5, "31 mm"), "mechanism", "a name is not text: 5", "as text"),
]  # fmt: skip

# method and its arguments on the packaged scene -> key named, part of the problem, part of the remedy
CHANGES = [
    ("set", ("operation.M0", "800"), "operation.M0", "unit is missing", "N*m"),
    ("set", ("operation.M1", "800 N*m"), "operation.M1", 'unknown key "M1"', '"M0"'),
    ("set", ("operations.M0", "800 N*m"), "operations", "unknown table", '"operation"'),
    ("set", ("M0", "800 N*m"), "M0", "unknown table", "operation.M0"),
    ("set", ("mechanism.l1.length", "31 mm"), "mechanism.l1.length",
     "l1 is a value, not a table", "Set l1 itself"),
    ("set", ("mechanism", "31 mm"), "mechanism", "not a table", "[mechanism]"),
    ("set", ("operation..M0", "31 mm"), "operation..M0", "name in the key is empty", "operation.M0"),
    ("set", ("", "31 mm"), "", "unknown table", "operation.M0"),
    ("set", ("bounds.m4.max", "60 kg"), "bounds.m4.min", "min is missing", "min and max"),
    ("set", ("bounds.l2.max", "90 kg"), "bounds.l2.max", "unit of mass", "mm"),
    ("set", ("bounds.l2.max", "50 mm"), "bounds.l2", "min is more than max", "min <= max"),
    ("set", ("effects.gravity.angle", "5 deg"), "effects.gravity.angle", 'unknown key "angle"', "tilt"),
    ("set", ("effects.wind.speed", "5 m/s"), "effects.wind", 'unknown effect "wind"', "inertia"),
    ("set", ("targets.torque", "5"), "targets.torque", "not a table", "[targets.torque]"),
    ("set", ("problem.job", "rapir"), "problem.job", 'unknown job "rapir"', '"rapier"'),
    ("set", ("problem.job", "rapier"), "effects.inertia", 'unknown effect "inertia"', "head_inertia"),
    ("set", ("mechanism.l4", "600 mm"), "mechanism.l1, l2, l3, l4", "not a crank-rocker", "shortest"),
    ("with_effect", ("gravty",), "effects", 'unknown effect "gravty"', '"gravity"'),
    ("without_effect", ("resist",), "effects", 'unknown effect "resist"', '"resistance"'),
    ("free", ("l9",), "bounds.l9", "l9 cannot be freed", "nothing"),
    ("free", (["J4"],), "bounds.J4", "J4 cannot be freed", "min and max"),
]  # fmt: skip

# bytes of a file -> part of the problem, part of the remedy
FILES = [
    (b"", "name is missing", "Add name"),
    (b"l1 = ", "not TOML", "Correct the line"),
    (b"[mechanism\nl1 = '31 mm'", "not TOML", "Correct the line"),
    (b"a = 1\na = 2\n", "not TOML", "Correct the line"),
    (b"a = \x00", "not TOML", "Correct the line"),
    (b"\xff\xfe[\x00p\x00", "not UTF-8", "Save the file as UTF-8"),
    ("title = 'Webmaschine für Gewebe'".encode("cp1252"), "not UTF-8", "Save the file as UTF-8"),
    (b"a = " + b"9" * 5000, "too many digits", "Correct the number"),
    (b"a = " + b"[" * 2000 + b"]" * 2000, "nested too deep", "loomopt new"),
    (b".".join([b"a"] * 40_000) + b" = 1", "nested too deep", "loomopt new"),
    (b'[problem]\n[ "a b" . ' + b" . ".join([b"'a'"] * 20_000) + b"]", "nested too deep", "loomopt new"),
    (b"a = {b = 1, " + b".".join([b"c"] * 40_000) + b" = 1}", "nested too deep", "loomopt new"),
    (b"# " + b"x" * 1_000_000, "too large", "the file you mean"),
    (b"%PDF-1.7 \x93\x8c", "not UTF-8", "Save the file as UTF-8"),
    (b'{"l1": "31 mm"}', "not TOML", "Correct the line"),
    (TEXT.replace('"31 mm"', "31").encode(), "unit is missing", "quotes"),
    (TEXT.replace('"31 mm"', "nan").encode(), "unit is missing", "quotes"),
    (TEXT.replace('"31 mm"', "1e999").encode(), "unit is missing", "quotes"),
]


def assert_message(error, file, key, problem, remedy, given=None):
    """Check one message, the worst of them: one printable line with all its parts."""
    message = str(error).split("\n")[0]
    assert message.isprintable(), message
    assert len(message) < 1500
    assert message.startswith(file)
    assert key in error.key
    assert error.key in message
    assert problem in error.problem
    assert error.problem in message
    assert remedy in f"{error.allowed} {error.remedy}"
    assert error.remedy
    if given is not None:
        assert f"(given: {given})" in message
    return error.problem


def shown(value):
    """Return how a short plain value is repeated in a message; None for one that is not."""
    if isinstance(value, str) and value.isprintable() and len(value) < 80:
        return f'"{value}"'
    return {True: "true"}.get(value, str(value)) if type(value) in (bool, int, float) else None


def caught(call, *arguments):
    with pytest.raises(BadInput) as second_caught:
        call(*arguments)
    return second_caught.value


def named(rows):
    """Give each row a short test name."""
    return [pytest.param(*row, id=f"{number}-{row[1] or row[2]}"[:60]) for number, row in enumerate(rows)]


@pytest.mark.parametrize(("change", "key", "problem", "remedy"), named(VALUES))
def test_a_bad_value(change, key, problem, remedy):
    whole = "not a crank" in problem or "more than max" in problem
    assert_message(
        caught(scene, changed(*change)),
        "<dict>: ",
        key,
        problem,
        remedy,
        None if whole else shown(change[-1]),
    )


@pytest.mark.parametrize(("change", "key", "problem", "remedy"), named(NAMES))
def test_a_bad_name_or_gap(change, key, problem, remedy):
    assert_message(caught(scene, changed(*change)), "<dict>: ", key, problem, remedy)


@pytest.mark.parametrize(("method", "arguments", "key", "problem", "remedy"), CHANGES)
def test_a_bad_change(method, arguments, key, problem, remedy):
    assert_message(caught(getattr(BEATUP, method), *arguments), "beatup.toml: ", key, problem, remedy)


@pytest.mark.parametrize(("content", "problem", "remedy"), FILES, ids=[row[1] + str(n) for n, row in enumerate(FILES)])
def test_a_bad_file(tmp_path, content, problem, remedy):
    path = tmp_path / "scene.toml"
    path.write_bytes(content)
    assert_message(caught(load, path), f"{path}: ", "", problem, remedy)


def test_files_that_are_none(tmp_path):
    assert_message(caught(load, tmp_path), str(tmp_path), "", "folder", "file in it")
    assert_message(caught(load, tmp_path / "none.toml"), str(tmp_path), "", "does not exist", "loomopt list")
    assert_message(caught(load, "a\x00b.toml"), "a\\x00b.toml", "", "", "path")
    assert_message(caught(load, "x" * 5000 + ".toml"), "xxx", "", "cannot be read", "path")
    assert_message(caught(load, "/dev/zero"), "/dev/zero", "", "not an ordinary file", "Name a file")
    os.mkfifo(tmp_path / "pipe.toml")
    assert_message(caught(load, tmp_path / "pipe.toml"), str(tmp_path), "", "not an ordinary file", "Name a file")
    big = tmp_path / "big.toml"
    with big.open("wb") as file:
        file.truncate(100_000_000)
    assert_message(caught(load, big), str(big), "", "too large", "the file you mean")


def test_an_unknown_packaged_name_tells_the_nearest():
    assert_message(
        caught(load, "beatup-lite"), "beatup-lite", "", "no packaged scene", '"beatup-light"', '"beatup-lite"'
    )
    assert_message(caught(load, ""), "", "", "no packaged scene", "beatup, beatup-heavy")
    assert_message(caught(load, "x\x1b[2J"), "x\\x1b[2J", "", "no packaged scene", ".toml")
    assert_message(caught(scene, nested(50)), "<dict>", "a.a.a...", "nested too deep", "loomopt new")
    itself: dict[str, object] = {}
    itself["again"] = itself
    assert_message(caught(scene, itself), "<dict>", "again", "nested too deep", "loomopt new")


DOTTED = '# see a, 1.2.3.4.5.6.7.8.9.10.11.12.13.14.15\nsource = "1.2.3.4.5.6.7.8.9.10.11.12.13.14.15.16.17.18.19"'


def test_dots_that_part_no_key_are_read(tmp_path):
    path = tmp_path / "dots.toml"
    path.write_text(TEXT.replace("source =", f"{DOTTED} #", 1), encoding="utf-8")
    assert load(path).source.endswith("18.19")


@pytest.mark.parametrize("key", ["a." * 50_000 + "a", "effects." + "a." * 50_000 + "a", "bounds.l1." + "a." * 9 + "a"])
def test_a_key_of_many_parts_is_told(key):
    assert_message(
        caught(BEATUP.set, key, "1 mm"), "beatup.toml", "", f"the key has {key.count('.') + 1} parts", "operation.M0"
    )
    for change in (BEATUP.with_effect, BEATUP.without_effect):
        assert "unknown effect" in caught(change, key).problem


def test_an_effect_of_many_parts_is_told():
    caught(BEATUP.with_effect, "gravity" + ".a" * 50_000)
    caught(BEATUP.change, {}, ["inertia" + ".a" * 50_000])


def test_there_are_enough_distinct_mistakes():
    problems = {caught(scene, changed(*row[0])).problem for row in (*VALUES, *NAMES)}
    problems |= {caught(getattr(BEATUP, row[0]), *row[1]).problem for row in CHANGES}
    assert len(VALUES) + len(NAMES) + len(CHANGES) + len(FILES) >= 110
    assert len(problems) >= 60


EIGHT = [
    ("bounds", {"l2": {"min": "30 mm", "max": "20 mm"}, "l3": "1,5 mm"}, ["bounds.l2", "bounds.l3"]),
    ("mechanism", {"L4": "166 mm", "l1": "28 mn"}, ["mechanism.L4", "mechanism.l1"]),
    ("operation", {"M0": 745}, ["operation.M0"]),
    ("effects", {"inertia": {"J4": "1.15 kgm2"}, "resistence": {"pulse": "30 deg"}},
     ["effects.inertia.J4", "effects.resistence"]),
    ("limits", {"swing": {"low": "2 deg"}}, ["limits.swing.low"]),
]  # fmt: skip


def test_a_scene_with_eight_mistakes_names_eight_the_worst_first():
    document, keys = copy.deepcopy(dict(BEATUP.document)), []
    del document["mechanism"]["l4"]
    del document["effects"]["resistance"]
    values: Any
    for table, values, wrong in EIGHT:
        document[table] = {**document[table], **values}
        keys += wrong
    error = caught(scene, document)
    lines = str(error).split("\n")
    assert len(lines) == len(error.faults) == len(keys) == 8
    assert sorted(fault.key for fault in error.faults) == sorted(keys)
    assert [str(fault.text) for fault in error.faults][1:] == lines[1:]
    assert error.key == "effects.resistence"  # it hides what the effect's values are
    assert "Perhaps" in lines[0]
    hints = {fault.key: fault.remedy for fault in error.faults}
    assert '"l4"' in hints["mechanism.L4"]
    assert '"mm"' in hints["mechanism.l1"]
    assert '"kg*m^2"' in hints["effects.inertia.J4"]
    assert '"745 N*m"' in hints["operation.M0"]


def test_what_is_wrong_elsewhere_does_not_hide_that_the_machine_cannot_work():
    document = changed("mechanism", "l1", "170 mm")
    document["mechanism"]["m4"] = "50"
    document["limits"]["swing"] = {"min": "22 mm"}
    error = caught(scene, document)
    assert [fault.key for fault in error.faults] == ["mechanism.l1, l2, l3, l4", "mechanism.m4", "limits.swing.min"]


def test_one_mistake_is_told_once():
    document = changed("effects", "inertia", "J4", "heavy")
    document["bounds"]["J4"] = {"min": "0.5 kg*m^2", "max": "1 kg*m^2"}
    document["operation"]["M0"] = "745"
    document["bounds"]["M0"] = {"min": "0.5 kN*m", "max": "1 kN*m"}
    keys = [fault.key for fault in caught(scene, document).faults]
    assert sorted(keys) == ["effects.inertia.J4", "operation.M0"]
    document = changed("mechanism", "l", "31 mm")
    del document["mechanism"]["l4"]
    assert len(caught(scene, document).faults) == 1
    shedding = copy.deepcopy(dict(load("shedding").document))
    shedding["effects"]["warp_tension"]["shape"] = "steps"
    assert [fault.key for fault in caught(scene, shedding).faults] == ["effects.warp_tension.shape"]
    tables = {name: copy.deepcopy(table) for name, table in BEATUP.document.items()}
    tables["mechnism"] = tables.pop("mechanism")
    assert [fault.key for fault in caught(scene, tables).faults] == ["mechnism"]


@pytest.mark.slow
def test_many_mistakes_are_told_in_part_and_soon():
    many = {f"x{n}": "1 mm" for n in range(20_000)}
    error = caught(scene, changed("mechanism", {**BEATUP.document["mechanism"], **many}))
    lines = str(error).split("\n")
    assert len(lines) == 21
    assert lines[-1].startswith("and 80 more")


def test_an_error_of_several_mistakes_pickles():
    error = caught(scene, changed("mechanism", REMOVED))
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error)
    assert len(again.faults) == 4


@pytest.mark.parametrize(
    ("text", "kind", "meant"),
    [
        ("28 mn", "length", "mm"), ("28 MM", "length", "mm"), ("1.15 kgm2", "inertia", "kg*m^2"),
        ("1.15 Kg m²", "inertia", "kg*m^2"), ("745 nm", "torque", "N*m"), ("30 Deg", "angle", "deg"),
        ("30 dge", "angle", "deg"), ("600 RPM", "angular speed", "rpm"), ("3 n/mm", "stiffness", "N/mm"),
        ("62 rad", "angular speed", "rad/s"), ("2 Mpa", "pressure", "MPa"), ("31 kg", "length", ""),
        ("31 s", "length", ""), ("80 mN", "torque", ""),
    ],
)  # fmt: skip
def test_a_unit_s_hint_knows_dimension_and_case(text, kind, meant):
    with pytest.raises(QuantityError) as second_caught:
        Quantity(kind).validate(text)
    hint = re.search('Perhaps "(.*?)" is meant', second_caught.value.remedy)
    assert (hint[1] if hint else "") == meant


def test_a_long_message_is_shortened():
    error = caught(scene, changed("mechanism", "l1", "x" * 100_000))
    assert len(str(error)) < 500
    assert "(100000 characters)" in str(error)


@pytest.mark.parametrize(
    ("turns", "message"), [(0, "it is out of range"), (20_000, "it is out of range"), (1.5, "whole")]
)
def test_a_number_beyond_a_tables_own_bounds_says_what_is_allowed(turns, message):
    with pytest.raises(BadInput, match=rf"turns: .*{message}.*Allowed: a whole number, at least 1, at most 10000\."):
        load("shedding").change({"effects.separation.turns": turns}, ["separation"], [])


def test_a_key_without_its_table_is_told_where_it_may_stand():
    error = caught(BEATUP.update, {"l1": "30 mm", "j4": "1 kg*m^2", "swing": "23 deg"})
    assert [fault.key for fault in error.faults] == ["l1", "j4", "swing"]
    remedies = [fault.remedy.partition(": ")[2] for fault in error.faults]
    assert remedies == ["mechanism.l1 or bounds.l1", "effects.inertia.J4", "limits.swing.min or limits.swing.max"]
    assert '"l1"' in caught(BEATUP.free, ["L1"]).remedy


def test_a_file_that_is_not_there_is_told_the_near_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my-bu.toml").write_text(TEXT)
    (tmp_path / "first-answer.json").write_text("{}")
    assert_message(caught(load, "my_bu.toml"), "my_bu.toml", "", "does not exist", '"my-bu.toml"')
    assert_message(caught(load, "My-bu"), "My-bu", "", "no packaged scene", '"my-bu.toml"')
    assert "first-answer.json" in caught(designs.loaded, tmp_path / "first_answer.json").remedy
    assert "my-bu" not in caught(load, "press.toml").remedy
    wish = (packaged.problems()["rapier"].parent / "rapier-wish.csv").read_text()
    (tmp_path / "rapier-wish.csv").write_text(wish)
    (tmp_path / "r.toml").write_text(packaged.problems()["rapier"].read_text("utf-8"))
    rapier = load("r.toml").set("targets.match.table", "rapier_wish.csv")
    assert '"rapier-wish.csv"' in caught(find("rapier").demand, rapier, "match").remedy
