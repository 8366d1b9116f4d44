"""What Python gives the public functions: of the wrong kind it is one message, and NumPy's numbers do as well."""

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

import loomopt as lo
from loomopt.base import arguments

OVER = {"operation.M0": ["600 N*m"]}
AXES = ("peak_torque", "m4e")
WRONG: dict[str, list[tuple[dict[str, Any], str]]] = {
    "sweep": [
        ({"over": {"operation.M0": 600}}, r"operation\.M0: it is no list \(given: 600\).*600:900:25 N\*m"),
        ({"over": {"operation.M0": {"600 N*m"}}}, "it is no list .given: set"),
        ({"over": {"operation.M0": None}}, "it is no list .given: none"),
        ({"over": "operation.M0=600:700:10 N*m"}, "over: it is not a mapping"),
        ({"over": {3: ["600 N*m"]}}, "over: it is not text .given: 3"),
        ({"over": OVER, "workers": "2"}, r'workers: it is not a whole number \(given: "2"\). Allowed: 1 to 1024'),
        ({"over": OVER, "workers": True}, "workers: it is not a whole number"),
        ({"over": OVER, "executor": "dask"}, "executor: it cannot be called"),
        ({"over": OVER, "executor": lambda: 3}, "executor: what it makes is no executor .given: 3"),
        ({"over": OVER, "on_row": 3}, "on_row: it cannot be called"),
        ({"over": OVER, "store": 3}, "store: it is no path"),
        ({"over": OVER, "seed": 1.5}, "seed: it is not a whole number"),
        ({"over": OVER, "seed": -1}, "seed: it is less than 0"),
        ({"over": OVER, "accuracy": "1e-8"}, "accuracy: it is not a number"),
        ({"over": OVER, "target": ["balance"]}, "target: it is not text .given: a list.*balance, pulse"),
    ],
    "pareto": [
        ({"axes": "peak_torque"}, r'axes: it is no list of names \(given: "peak_torque"\).*Write \("A", "B"\)'),
        ({"axes": None}, "axes: it is no list of names"),
        ({"axes": {"peak_torque", "m4e"}}, "axes: it is no list of names .given: set"),
        ({"axes": (1, 2)}, "axes: it is not text .given: 1"),
        ({"axes": AXES, "points": "ten"}, r'points: it is not a whole number \(given: "ten"\).*from 3 to 20000'),
        ({"axes": AXES, "points": 10.0}, "points: it is not a whole number"),
        ({"axes": AXES, "ranges": ["m4e=0:5 kg"]}, "ranges: it is not a mapping .given: a list"),
        ({"axes": AXES, "ranges": {"m4e": 5}}, "m4e: it is no list .given: 5"),
        ({"axes": AXES, "ranges": {"m4e": ("0 kg", "5 kg")}}, 'm4e: it is not a number .given: "0 kg"'),
        ({"axes": AXES, "ranges": {"m4e": (None, 5)}}, "m4e: it is not a number .given: none"),
        ({"axes": AXES, "ranges": {"m4e": (1, 2, 3)}}, "m4e: a range has two ends"),
        ({"axes": AXES, "ranges": {"m4e": (5, 0)}}, r"m4e: .*\(given: 5:0 in SI\). Allowed: .*smaller end first"),
        ({"axes": AXES, "maximise": 3}, "maximise: it is no list of names"),
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
        ({"near": "before"}, "near: it is no answer"),
        ({"everywhere": True, "gap": "2"}, "gap: it is not a number"),
        ({"everywhere": True, "seconds": None}, "seconds: it is not a number"),
    ],
    "prove": [({"slack": "2"}, "slack: it is not a number")],
    "simulate": [({"accuracy": "2"}, "accuracy: it is not a number")],
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "given", "said"), [(name, given, said) for name in WRONG for given, said in WRONG[name]]
)  # fmt: skip
def test_an_argument_of_the_wrong_kind_is_one_message(name, given, said):
    with pytest.raises(lo.BadInput, match=said) as caught:
        getattr(lo, name)("beatup-light", **given)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("scene", [3, None, b"beatup"])
def test_what_is_no_scene_is_one_message(scene):
    with pytest.raises(lo.BadInput, match="loomopt list"):
        lo.solve(scene)


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
