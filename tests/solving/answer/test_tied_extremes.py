"""Prices where extremes tie, beside the gain of solving again with limits loosened alone and together."""

import functools
import json
import subprocess
import sys
from pathlib import Path

import pytest

import loomopt as lo

CASES = Path(__file__).parent / "cases"
STEP = 0.01
"""mm by which bounds are loosened."""


@functools.cache
def solved(case, target, loosened=()):
    scene = lo.load(CASES / case)
    scene = scene.update({f"bounds.{name}.max": f"{300 + STEP} mm" for name in loosened})
    return lo.solve(scene, target=target, accuracy=1e-10)


def gain(case, *names):
    """Return the fall of the peak torque per m where bounds are loosened, by solving again."""
    before, after = solved(case, "torque"), solved(case, "torque", names)
    assert after.status == "optimal"
    return (before.figures["peak_torque"] - after.figures["peak_torque"]) / (STEP * 1e-3)


@pytest.mark.slow
def test_mirror_images_bind_together_and_neither_gains_alone():
    answer = solved("mirrored_rams.toml", "torque")
    assert {price.limit: price.worth["peak_torque"] for price in answer.binding} == {"left": 0.0, "right": 0.0}
    (joint,) = answer.bind_together
    assert (joint.limits, joint.sides, joint.unit) == (("left", "right"), ("max", "max"), {"peak_torque": "N*m/m"})
    assert joint.text == "left and right together: 0.000198 N*m per mm; each alone: 0"
    assert joint.text in answer.message
    assert joint.worth["peak_torque"] == pytest.approx(gain("mirrored_rams.toml", "left", "right"), rel=1e-4)
    for name in ("left", "right"):
        assert gain("mirrored_rams.toml", name) == pytest.approx(0.0, abs=1e-4 * joint.worth["peak_torque"])


def test_unique_is_not_said_of_prices_that_are_not():
    answer = solved("mirrored_rams.toml", "torque")
    assert (answer.certificate.unique, answer.certificate.prices_unique) == (True, False)
    assert answer.as_dict()["certificate"]["unique"] is False
    assert solved("mirrored_rams.toml", "angles").as_dict()["certificate"]["unique"] is True


@pytest.mark.slow
def test_three_rams_of_which_each_gains_alone():
    """Of three a third one's peak is left: alone each gains less than its share of all."""
    answer = solved("three_rams.toml", "torque")
    worth = {price.limit: price.worth["peak_torque"] for price in answer.binding}
    assert set(worth) == {"a", "b", "c"}
    for name, value in worth.items():
        assert value == pytest.approx(gain("three_rams.toml", name), rel=1e-3)
    assert answer.bind_together == ()
    assert not answer.certificate.prices_unique


@pytest.mark.slow
def test_the_command_says_it():
    command = [sys.executable, "-m", "loomopt", "solve", str(CASES / "mirrored_rams.toml"), "--target", "torque"]
    text, data = (
        subprocess.run([*command, *more], capture_output=True, text=True, check=True).stdout
        for more in ([], ["--json"])
    )
    assert "left and right together  peak_torque  0.000198 N*m per mm; each alone: 0" in text
    assert "; unique" not in text
    (joint,) = json.loads(data)["bind_together"]
    assert joint["limits"] == ["left", "right"]
    assert joint["worth"]["peak_torque"] == pytest.approx(0.197813445, rel=1e-7)
    assert joint["unit"] == {"peak_torque": "N*m/m"}
