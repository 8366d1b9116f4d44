"""What Python gives the public functions: of the wrong kind it is one message, and NumPy's numbers do as well."""

import inspect
import math
from concurrent.futures import ThreadPoolExecutor
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

import loomopt as lo
from loomopt.base import arguments

OVER = {"operation.M0": ["600 N*m"]}
AXES = ("peak_torque", "m4e")
WRONG: dict[str, list[tuple[dict[str, Any], str]]] = {
    "sweep": [
        ({"over": {"operation.M0": 600}}, r"operation\.M0: it is not a list \(given: 600\).*600:900:25 N\*m"),
        ({"over": {"operation.M0": {"600 N*m"}}}, "it is not a list .given: set"),
        ({"over": {"operation.M0": None}}, "it is not a list .given: none"),
        ({"over": "operation.M0=600:700:10 N*m"}, "over: it is not a mapping"),
        ({"over": {3: ["600 N*m"]}}, "over: it is not text .given: 3"),
        ({"over": OVER, "workers": "2"}, r'workers: it is not a whole number \(given: "2"\). Allowed: 1 to 1024'),
        ({"over": OVER, "workers": True}, "workers: it is not a whole number"),
        ({"over": OVER, "executor": "dask"}, "executor: it cannot be called"),
        ({"over": OVER, "executor": lambda: 3}, "executor: the function does not make an executor .given: 3"),
        ({"over": OVER, "on_row": 3}, "on_row: it cannot be called"),
        ({"over": OVER, "store": 3}, "store: it is not a path"),
        ({"over": OVER, "seed": 1.5}, "seed: it is not a whole number"),
        ({"over": OVER, "seed": -1}, "seed: it is less than 0"),
        ({"over": OVER, "accuracy": "1e-8"}, "accuracy: it is not a number"),
        ({"over": OVER, "target": ["balance"]}, "target: it is not text .given: a list.*balance, pulse"),
    ],
    "pareto": [
        ({"axes": "peak_torque"}, r'axes: it is not a list of names \(given: "peak_torque"\).*Write \("A", "B"\)'),
        ({"axes": None}, "axes: it is not a list of names"),
        ({"axes": {"peak_torque", "m4e"}}, "axes: it is not a list of names .given: set"),
        ({"axes": (1, 2)}, "axes: it is not text .given: 1"),
        ({"axes": AXES, "points": "ten"}, r'points: it is not a whole number \(given: "ten"\).*from 3 to 20000'),
        ({"axes": AXES, "points": 10.0}, "points: it is not a whole number"),
        ({"axes": AXES, "ranges": ["m4e=0:5 kg"]}, "ranges: it is not a mapping .given: a list"),
        ({"axes": AXES, "ranges": {"m4e": 5}}, "m4e: it is not a list .given: 5"),
        ({"axes": AXES, "ranges": {"m4e": ("0 kg", "5 kg")}}, 'm4e: it is not a number .given: "0 kg"'),
        ({"axes": AXES, "ranges": {"m4e": (None, 5)}}, "m4e: it is not a number .given: none"),
        ({"axes": AXES, "ranges": {"m4e": (1, 2, 3)}}, "m4e: a range has two ends"),
        ({"axes": AXES, "ranges": {"m4e": (5, 0)}}, r"m4e: .*\(given: 5:0 in SI\). Allowed: .*smaller end first"),
        ({"axes": AXES, "maximise": 3}, "maximise: it is not a list of names"),
        ({"axes": AXES, "accuracy": None}, "accuracy: it is not a number"),
    ],
    "effects": [
        ({"tolerance": "1 %"}, r'tolerance: it is not a number \(given: "1 %"\).*0.01 for 1 %'),
        ({"seed": []}, "seed: it is not a whole number"),
        ({"accuracy": 1.0}, "accuracy"),
        ({"workers": [2]}, "workers: it is not a whole number"),
    ],
    "solve": [
        ({"starts": "2"}, "starts: it is not a whole number"),
        ({"seed": "2"}, "seed: it is not a whole number"),
        ({"warm_start": "before"}, "warm_start: it is not an answer"),
        ({"global_proof": True, "gap": "2"}, "gap: it is not a number"),
        ({"global_proof": True, "seconds": None}, "seconds: it is not a number"),
    ],
    "prove": [({"slack": "2"}, "slack: it is not a number")],
    "simulate": [({"accuracy": "2"}, "accuracy: it is not a number")],
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "given", "message"), [(name, given, message) for name in WRONG for given, message in WRONG[name]]
)  # fmt: skip
def test_an_argument_of_the_wrong_kind_is_one_message(name, given, message):
    with pytest.raises(lo.BadInput, match=message) as caught:
        getattr(lo, name)("beatup-light", **given)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("scene", [3, None, b"beatup"])
def test_what_is_no_scene_is_one_message(scene):
    with pytest.raises(lo.BadInput, match="loomopt list"):
        lo.solve(scene)


@pytest.mark.slow
def test_numbers_of_numpy_and_other_sequences_do_as_well():
    given: dict[str, Any] = {"axes": np.array(AXES), "points": np.int64(3), "ranges": {"m4e": np.array([0.0, 2.0])}}
    plain = lo.pareto("beatup-light", AXES, points=3, ranges={"m4e": (0.0, 2.0)})
    numpy = lo.pareto("beatup-light", **given)
    assert numpy.digest == plain.digest
    assert numpy.study.key == plain.study.key
    over: dict[str, Any] = {"operation.M0": np.array(["600 N*m"])}
    numbers: dict[str, Any] = {"seed": np.int64(0), "accuracy": np.float64(1e-8)}
    sweep = lo.sweep("beatup-light", over, **numbers)
    assert sweep.digest == lo.sweep("beatup-light", OVER, executor=lambda: ThreadPoolExecutor(1)).digest


def test_a_truth_value_is_no_number():
    for read in (arguments.number, arguments.whole):
        assert read(2, "x", "", "") == 2
        with pytest.raises(lo.BadInput, match="given: true"):
            read(True, "x", "", "")


SCENE = lo.load("beatup-light")


class TakenError(Exception):
    """Raised in place of what takes long: the arguments are taken."""


def computing(*_: object, **__: object) -> None:
    raise TakenError


class Odd:
    """What has neither a length nor a value, and shows itself as nothing."""

    def __repr__(self) -> str:
        raise RuntimeError


ODD: list[Any] = [
    *(None, True, 3, -1, 0, 2.5, 1e300, -1e300, math.nan, math.inf, 10**400, -(10**5000), 1j, Decimal(3)),
    *(Fraction(10**400), "", "x", "a.b", "\0", "\ud800", "x" * 10_000, "\x1b[2J", b"x", Odd(), Odd, len, [], [3]),
    *([None], ["l1", 2], {}, {"x": "y"}, {3: 4}, {"l1": None}, {"l1": 10**5000}, {"l1": Odd()}, set(), {3}, (), (1, 2)),
    *({"operation.M0": Odd()}, {"operation.M0": [Odd()]}, range(3), iter([]), np.array(3), np.array(1e-8), np.nan),
    *(np.array("l1"), np.array([1.0, 2.0]), np.array([]), np.array([["a"]]), np.bool_(True), np.float64("inf")),
    *(np.str_("x"), Path("x"), Path("/"), Path("a\0b"), SCENE, iter([3]), {"m4e": (10**400, 1)}, {"m4e": Odd()}),
]  # fmt: skip
GIVEN: dict[str, dict[str, Any]] = {
    "sweep": {"over": OVER},
    "pareto": {"axes": AXES},
    "set": {"key": "operation.M0", "value": "600 N*m"},
    "update": {"values": {}},
    "change": {"values": {}},
    "free": {"names": []},
    "given": {"key": "operation.M0"},
    "full": {"name": "l1"},
    "show": {"value": 1.0, "kind": "length"},
    "shown_in": {"kind": "length"},
    "unit_for": {"si": "m"},
    "export": {"path": "x.csv"},
    "answer": {"point": 0},
}
FUNCTIONS = ["load", "scene", "solve", "evaluate", "simulate", "prove", "sweep", "effects", "pareto"]
OF_SCENE = ["set", "update", "change", "with_effect", "without_effect", "free", "given", "full", "show"]
OF_SCENE += ["shown_in", "unit_for"]
OF_ANSWER = ["plot", "export", "to_frame", "simulate", "prove"]
OF_STUDY = ["table", "answer", "plot"]
ENGINES = ["loomopt.solving.engine.solve", "loomopt.studies.run.run.run", "loomopt.solving.proof.whole_cycle._readings"]
ENGINES += ["loomopt.interface.tables.curves", "loomopt.interface.figures.charts.draw"]


@pytest.fixture(scope="module")
def owners() -> dict[str, Any]:
    answer, study = lo.evaluate(SCENE), lo.sweep(SCENE, OVER)
    return {"": lo, "scene": SCENE, "answer": answer, "study": study}


METHODS = {"": FUNCTIONS, "scene": OF_SCENE, "answer": OF_ANSWER, "study": OF_STUDY}


@pytest.mark.few(5)
@pytest.mark.parametrize(("owner", "name"), [(owner, name) for owner in METHODS for name in METHODS[owner]])
def test_whatever_is_given_is_taken_or_told_in_one_line(monkeypatch, tmp_path, owners, owner, name):
    monkeypatch.chdir(tmp_path)
    for place in ENGINES:
        monkeypatch.setattr(place, computing)
    call = getattr(owners[owner], name)
    first = {"scene": "beatup-light"} if not owner and name not in ("load", "scene") else {}
    several = name in ("with_effect", "without_effect")
    others = {**first, **GIVEN.get(name, {})}
    wrong = []
    for parameter in inspect.signature(call).parameters:
        for odd in ODD:
            try:
                call(odd) if several else call(**{**others, parameter: odd})
            except TakenError:
                pass
            except lo.BadInput as message:
                if not all(line.isprintable() for line in str(message).split("\n")):
                    wrong.append((parameter, type(odd), repr(str(message))))
            except BaseException as error:
                wrong.append((parameter, type(odd), f"{error!r}"[:150]))
    assert not wrong, "\n".join(map(str, wrong))


KEYS = ["problem", "problem.title", "problem.name", "display", "display.length", "effects", "effects.inertia", "bounds"]
KEYS += ["bounds.l1", "bounds.l1.free", "limits.swing", "targets.balance.expected", "targets.retrofit.weights.l1"]
KEYS += ["targets", "available.gravity", "mechanism.l1", "effects.resistance.table", "operation"]


@pytest.mark.parametrize("key", KEYS)
def test_whatever_a_key_is_set_to_is_taken_or_told(key):
    texts = []
    for odd in ODD:
        try:
            repr(SCENE.set(key, odd))
        except lo.BadInput as error:
            texts.append(str(error))
    assert texts
    assert all(line.isprintable() for text in texts for line in text.split("\n"))


def test_a_hook_or_a_flag_of_the_wrong_kind_is_told():
    for key in ("on_iteration", "on_start", "on_step"):
        with pytest.raises(lo.BadInput, match=rf"{key}: it cannot be called \(given: 3\)"):
            lo.solve(SCENE, **{key: 3})  # type: ignore[arg-type]
    with pytest.raises(lo.BadInput, match="on_row: it cannot be called"):
        lo.effects(SCENE, on_row=3)  # type: ignore[arg-type]
    for key in ("prove", "global_proof"):
        with pytest.raises(lo.BadInput, match=f'{key}: it is neither true nor false .given: "no"'):
            lo.solve(SCENE, **{key: "no"})  # type: ignore[arg-type]
    with pytest.raises(lo.BadInput, match="resume: it is neither true nor false"):
        lo.sweep(SCENE, OVER, store="s.db", resume="no")  # type: ignore[arg-type]
    assert arguments.flag(np.bool_(True), "x")


def test_a_name_in_place_of_names_is_told():
    for call in (lambda: SCENE.change({}, "gravity"), lambda: SCENE.change({}, (), "gravity")):
        with pytest.raises(lo.BadInput, match=r'it is not a list of names \(given: "gravity"\)'):
            call()
    assert SCENE.free("") is not None
    assert SCENE.change({}, {"gravity"}).effects.keys() == SCENE.with_effect("gravity").effects.keys()


@pytest.mark.parametrize("error", [RuntimeError("no more"), KeyError("x"), SystemExit(3), AssertionError()])
@pytest.mark.parametrize("hook", ["on_iteration", "on_start", "on_step"])
@pytest.mark.few(4)
def test_an_error_in_a_hook_is_that_error(error, hook):
    def raising(*_):
        raise error

    with pytest.raises(type(error)) as caught:
        lo.solve(SCENE, **{hook: raising})  # type: ignore[arg-type]
    assert caught.value is error
    assert lo.solve(SCENE).status == "optimal"


def test_a_renamed_argument_keeps_its_former_name_for_one_version():
    light, solve = lo.load("beatup-light"), cast("Any", lo.solve)
    with pytest.warns(DeprecationWarning, match="argument steps of solve is now round_to"):
        former = solve(light, steps={"l1": "1 mm"})
    assert former.design == solve(light, round_to={"l1": "1 mm"}).design
    with pytest.raises(lo.BadInput, match="both are given"):
        solve(light, near=former, warm_start=former)


@pytest.mark.parametrize(("former", "name"), [("DesignStudy", "StudyTable"), ("AccuracyFound", "AccuracyStudy")])
def test_a_renamed_class_keeps_its_former_name_for_one_version(former, name):
    with pytest.warns(DeprecationWarning, match=name):
        assert getattr(lo, former) is getattr(lo, name)
