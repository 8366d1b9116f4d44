"""Scenes: what is read, in which units, and how a scene is changed."""

import copy
import doctest
import itertools
import math
import pickle
import re
import subprocess
import sys
import tomllib
from fractions import Fraction
from pathlib import Path

import pytest
from together import combined

from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.jobs.beatup.scene import RetrofitTarget, TorqueTarget
from loomopt.jobs.registry import load, scene
from loomopt.scenes import packaged
from loomopt.scenes.scene import Scene, build
from loomopt.scenes.tables import Bound, LimitRange
from loomopt.studies.check import available_targets

BEATUP = load("beatup")
TEMPLATE = registry.template("beatup")


def edited(changes):
    """Return the packaged tables with dotted keys changed; None takes a key out."""
    document = copy.deepcopy(dict(BEATUP.document))
    for key, value in changes.items():
        *path, last = key.split(".")
        table = document
        for name in path:
            table = table.setdefault(name, {})
        if value is None:
            del table[last]
        else:
            table[last] = value
    return document


def test_the_packaged_scene_reads_in_SI():
    assert (BEATUP.name, BEATUP.job, BEATUP.origin) == ("beatup", "beatup", "beatup.toml")
    assert BEATUP.operation == {"speed": pytest.approx(20 * math.pi, rel=1e-15), "M0": 745.0}
    assert BEATUP.mechanism == {
        "l1": 0.031,
        "l2": 0.065,
        "l3": 0.155,
        "l4": 0.167,
        "m4e": 0.0,
        "r4e": 0.0,
        "m4": 56.8,
        "r4": 0.045,
    }
    assert [(name, effect.model_dump(exclude_none=True)) for name, effect in BEATUP.effects.items()] == [
        ("inertia", {"J4": 0.62}),
        ("resistance", {"pulse": pytest.approx(math.radians(29.8), rel=1e-15)}),
    ]
    assert BEATUP.bounds["l1"] == Bound(0.03, 0.035, True, "mm")
    least = BEATUP.limits["mu_min"]
    assert least == LimitRange(least.min, None, "deg")
    assert least.min == pytest.approx(math.radians(56.5), rel=1e-15)


@pytest.mark.parametrize("name", packaged.problems())
def test_packaged_scenes_are_complete(name):
    packaged_scene = load(name)
    assert packaged_scene.name == name
    assert packaged_scene.title
    assert packaged_scene.source
    for target in available_targets(packaged_scene):
        assert packaged_scene.targets[target].model_dump()["expected"] is not None
    offered = (
        set(packaged_scene.document.get("available", {}))
        if packaged_scene.schema.tables
        else set(packaged_scene.schema.effects)
    )
    for effect in {name for name in offered if not packaged_scene.schema.effects[name].many} - set(
        packaged_scene.effects
    ):
        if (name, effect) != ("shedding-static", "separation"):  # its warp tension is known in the dwells only
            clashing = {clash.effect for clash in packaged_scene.schema.effects[effect].clashes if not clash.key}
            bare = packaged_scene.without_effect(*(clashing & set(packaged_scene.effects)))
            assert effect in bare.with_effect(*packaged_scene.schema.effects[effect].companions, effect).effects


@pytest.mark.parametrize("name", packaged.problems())
def test_every_packaged_number_says_where_it_comes_from(name):
    for line in packaged.problems()[name].read_text(encoding="utf-8").splitlines():
        if re.search(r'= .*"[-0-9.]+ ', line) and not line.startswith("expected"):
            assert "  # " in line, line


def test_the_template_loads_with_and_without_its_optional_tables():
    assert scene(tomllib.loads(TEMPLATE)).hash == BEATUP.hash
    everything = re.sub(r"^# (\[targets|\[display|\w+ = )", r"\1", TEMPLATE, flags=re.MULTILINE)
    document = tomllib.loads(everything)
    together = [effect.name for effect in combined(BEATUP.schema.effects.values())]
    offered = {**document["effects"], **document["available"]}
    assert offered.keys() == set(BEATUP.schema.effects)
    whole = scene({**document, "effects": {name: offered[name] for name in together}})
    assert list(whole.effects) == together
    assert (whole.shown_in("length"), BEATUP.shown_in("length")) == ("in", "mm")


@pytest.mark.parametrize("job", ["beatup", "rapier", "shedding"])
def test_a_template_names_every_figure_that_can_be_limited(job):
    words = set(re.findall(r"\w+", registry.template(job).split("# Limits:")[1]))
    limited = {name for name, figure in load(job).schema.figures.items() if figure.sides}
    assert limited - words == set()


@pytest.mark.parametrize(("unit", "millimetres"), [("m", "1000"), ("km", "1e6"), ("in", "25.4"), ("ft", "304.8")])
def test_any_unit_of_length_reads_the_same(unit, millimetres):
    def converted(value):
        if isinstance(value, dict):
            return {name: converted(inner) for name, inner in value.items()}
        match = re.fullmatch(r"([0-9.]+) mm", value) if isinstance(value, str) else None
        if not match:
            return value
        digits = round(Fraction(match[1]) / Fraction(millimetres) * 10**30)
        return f"{digits}e-30 {unit}"

    other = scene(converted(dict(BEATUP.document)))
    for name, value in BEATUP.mechanism.items():
        assert other.mechanism[name] == pytest.approx(value, rel=1e-15)
    for name, bound in BEATUP.bounds.items():
        assert (other.bounds[name].min, other.bounds[name].max) == pytest.approx((bound.min, bound.max), rel=1e-15)
    assert other.bounds["l1"].unit == other.shown_in("length") == unit


def test_a_number_nobody_needs_may_be_missing():
    document = edited({"operation": {}, "effects": {}, "mechanism.m4": None, "mechanism.m4e": None})
    second_scene = scene(document)
    assert second_scene.operation == {}
    assert second_scene.mechanism["m4e"] == 0.0
    assert "m4" not in second_scene.mechanism


def test_what_was_written_stays_as_it_was():
    assert BEATUP.given("mechanism.l1") == "31 mm"
    assert BEATUP.given("mechanism") is None
    assert BEATUP.given("mechanism.l9") is None


def test_a_change_leaves_the_original_alone():
    before = copy.deepcopy(BEATUP.document)
    changed = BEATUP.set("operation.M0", "800 N*m").set("bounds.l2.max", "90 mm").with_effect("gravity")
    assert changed.operation["M0"] == 800.0
    assert changed.bounds["l2"] == Bound(0.06, 0.09, True, "mm")
    assert BEATUP.document == before
    assert BEATUP.operation["M0"] == 745.0
    document = edited({})
    built = scene(document)
    document["mechanism"]["l1"] = "1 km"
    assert built.given("mechanism.l1") == "31 mm"


STEPS = (
    {"operation.M0": "800 N*m"},
    {"bounds.M0": {"min": "700 N*m", "max": "900 N*m"}},
    {"operation.M0": "810 N*m", "mechanism.l1": "30 mm"},
    {"bounds.J3": {"min": "0.01 kg*m^2", "max": "0.02 kg*m^2"}},
    {"effects.rocker_inertia.J3": "0.015 kg*m^2"},
    {"limits.swing.max": "27 deg"},
    {"effects.gravity.tilt": "30 deg"},
    {"targets.torque.M3_tolerance": "5 N*m"},
    {"available.counterweight_inertia.JS": "0.01 kg*m^2"},
    {"problem.title": "Another"},
    {"bounds.l2.max": "90 mm"},
    {"display.length": "in"},
    {"operation.speed": "620 rpm"},
)


@pytest.mark.parametrize("first", range(len(STEPS)))
def test_a_changed_scene_is_the_one_that_its_own_tables_describe(first):
    """Tables that did not change are not read again: whatever was changed before, nothing of it is missed."""
    changed = BEATUP
    for step in (*STEPS[first:], *STEPS[:first]):
        changed = changed.update(step)
        assert changed == build(changed.document, changed.jobs, changed.origin), step
    assert changed.effects.keys() >= {"rocker_inertia", "gravity"}
    assert changed.without_effect("gravity").bounds.keys() >= {"M0", "J3"}


def test_setting_a_key_of_an_effect_that_is_off_puts_it_on():
    on = BEATUP.set("effects.gravity.tilt", "30 deg")
    assert on.effects["gravity"].model_dump() == {"tilt": pytest.approx(math.pi / 6), "offset": 0.0}
    bare = scene(edited({"available": {}}))
    both = bare.update({"effects.gravity.tilt": "30 deg", "effects.gravity.offset": "0 deg"})
    assert both.effects == on.effects
    assert bare.set("effects.gravity", {"tilt": "30 deg", "offset": "0 deg"}).effects == on.effects


def test_effects_go_on_and_off_in_the_order_of_the_job():
    on = BEATUP.with_effect("gravity").with_effect("rocker_inertia")
    assert list(on.effects) == ["inertia", "resistance", "rocker_inertia", "gravity"]
    off = on.without_effect("inertia")
    assert list(off.effects) == ["resistance", "rocker_inertia", "gravity"]
    assert off.with_effect("inertia").effects == on.effects
    assert BEATUP.with_effect("inertia") is BEATUP
    assert BEATUP.without_effect("gravity") is BEATUP
    assert scene(edited({"available": {}})).with_effect("centrifugal").effects["centrifugal"].model_dump() == {}


def test_a_bound_on_a_number_of_an_effect_that_is_off_waits_for_it():
    bound = {"min": "0.01 kg*m^2", "max": "0.02 kg*m^2"}
    waiting = BEATUP.set("bounds.J3", bound)
    assert "J3" not in waiting.bounds
    assert waiting.with_effect("rocker_inertia").bounds["J3"] == Bound(0.01, 0.02, True, "kg*m^2")
    with pytest.raises(BadInput, match="J3 has no value in this scene"):
        scene(edited({"available": {}, "bounds.J3": bound}))
    with pytest.raises(BadInput, match="min is more than max"):
        BEATUP.set("bounds.J3", {"min": "0.03 kg*m^2", "max": "0.02 kg*m^2"})


def test_bounds_that_hold_free_and_fix():
    second_scene = BEATUP.set("bounds.J4", {"min": "0.5 kg*m^2", "max": "0.7 kg*m^2", "free": False})
    assert second_scene.bounds["J4"] == Bound(0.5, 0.7, False, "kg*m^2")
    assert second_scene.free("J4").bounds["J4"].free
    assert second_scene.free(["J4", "l1"]).bounds == second_scene.free("J4, l1").bounds
    assert second_scene.set("bounds.J4.free", "true").bounds == second_scene.free("J4").bounds
    assert BEATUP.set("bounds.l4", "167 mm").bounds["l4"] == Bound(0.167, 0.167, True, "mm")
    widened = BEATUP.set("bounds.l4", "167 mm").update({"bounds.l4.min": "160 mm", "bounds.l4.max": "170 mm"})
    assert widened.bounds["l4"] == Bound(0.16, 0.17, True, "mm")
    assert BEATUP.set("bounds.speed", {"min": "500 rpm", "max": "700 rpm"}).bounds["speed"].unit == "rpm"


def test_targets_have_their_own_values():
    second_scene = BEATUP.set("targets.torque.M3_tolerance", "5 N*m").set("targets.retrofit.weights.l1", 3)
    assert second_scene.table(TorqueTarget).M3_tolerance == 5.0
    assert second_scene.table(RetrofitTarget).weights == {"l1": 3.0}
    assert list(scene(edited({"targets": {}})).targets) == list(BEATUP.schema.targets)


def test_the_hash_tells_what_decides_an_answer():
    assert re.fullmatch("[0-9a-f]{12}", BEATUP.hash)
    assert scene(dict(BEATUP.document)).hash == BEATUP.hash
    assert BEATUP.set("problem.title", "another").hash == BEATUP.hash
    assert BEATUP.set("mechanism.l1", "0.031 m").hash == BEATUP.hash
    assert BEATUP.set("targets.pulse.expected", {"J4": "1 kg*m^2"}).hash == BEATUP.hash
    others = [
        BEATUP.set("mechanism.l1", "31.0000001 mm"),
        BEATUP.set("bounds.l1.free", False),
        BEATUP.set("limits.mu_min.min", "57 deg"),
        BEATUP.with_effect("gravity"),
        BEATUP.set("targets.torque.M3_tolerance", "5 N*m"),
    ]
    assert len({BEATUP.hash, *(other.hash for other in others)}) == len(others) + 1


def test_a_scene_travels_to_another_process():
    assert pickle.loads(pickle.dumps(BEATUP)) == BEATUP


def test_a_path_wins_over_a_packaged_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "beatup.toml").write_text(TEMPLATE, encoding="utf-8")
    assert load("beatup.toml").name == load("./beatup.toml").name == load(tmp_path / "beatup.toml").name == "my-loom"
    assert load("beatup").name == "beatup"
    assert load("./beatup.toml").origin == "./beatup.toml"


def test_a_file_with_a_byte_order_mark_and_windows_lines_reads(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_bytes(b"\xef\xbb\xbf" + TEMPLATE.replace("\n", "\r\n").encode())
    assert load(path).hash == BEATUP.hash


def test_packaged_folders():
    assert {"beatup", "beatup-light", "beatup-heavy"} <= set(packaged.problems())
    assert packaged.results_path().name == "results"
    assert set(registry.builtin_names()) == {load(name).job for name in packaged.problems()}


def calls(action):
    """Return how many functions an action calls, Python's own included."""
    count = itertools.count()

    def profile(frame, event, argument):
        if event in ("call", "c_call"):
            next(count)

    sys.setprofile(profile)
    try:
        action()
    finally:
        sys.setprofile(None)
    return next(count)


def test_reading_and_changing_a_scene_is_little_work():
    """Measured 6395 and 4296 calls: a scene is read before every command and changed by every --set."""
    load("beatup")
    assert calls(lambda: load("beatup")) < 9000
    assert calls(lambda: BEATUP.set("operation.M0", "800 N*m")) < 6000


def test_reading_imports_little():
    code = (
        "import sys, types, pydantic\n"
        "class Warm(pydantic.BaseModel): x: float = 0.0\n"
        "alone = sys.modules['loomopt'] = types.ModuleType('loomopt'); alone.__path__ = [sys.argv[1]]\n"
        "before = set(sys.modules); import loomopt.scenes.scene\n"
        "new = set(sys.modules) - before; print(len(new), [name for name in sys.argv[2:] if name in new])"
    )
    heavy = ["numpy", "pint", "scipy", "pandas", "sympy", "matplotlib", "casadi", "importlib.metadata"]
    command = [sys.executable, "-c", code, str(Path(packaged.__file__).parents[1]), *heavy]
    count, imported = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split(maxsplit=1)
    assert int(count) <= 50
    assert imported.strip() == "[]"


def test_the_scene_type_is_frozen():
    with pytest.raises(AttributeError):
        BEATUP.name = "other"  # type: ignore[misc]
    assert isinstance(BEATUP, Scene)


def test_an_effect_without_values_names_the_keys_to_set():
    with pytest.raises(BadInput, match=r"effects\.gravity\.tilt, effects\.gravity\.offset"):
        scene(edited({"available": {}})).with_effect("gravity")


@pytest.mark.parametrize("name", ["a", "7", "beatup-wide_2", "织机-1", "Webstuhl-Öl", "console", "nul-1", "a" * 64])
def test_a_scene_may_be_named_as_a_file_anywhere(name):
    assert BEATUP.set("problem.name", name).name == name


EXAMPLES = ["full", "given", "show", "set", "update", "with_effect", "without_effect"]
"""Methods of a scene whose docstrings have an example."""


@pytest.mark.parametrize("name", EXAMPLES)
def test_methods_of_a_scene_have_examples_that_run(name):
    (example,) = doctest.DocTestFinder(recurse=False).find(getattr(Scene, name), name)
    assert example.examples
    assert doctest.DocTestRunner().run(example).failed == 0
