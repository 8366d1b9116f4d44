"""What friction in the pins takes, by their loads: mu r |F| times how each pin turns, summed over the turn.

The losses, J a turn, are printed for today's machine with every effect and an exact rod, mu 0.1.
"""

import math

import numpy as np
import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from reference import beatup as plain

RADII = {"A": 25.0, "B": 20.0, "C": 15.0, "D": 25.0}
EFFECTS = ("rod_inertia", "gravity", "bearing_friction", "counterweight_inertia", "rocker_inertia")
PINS = {f"effects.joint_forces.pins.{pin}": {"mu": "0.1", "radius": f"{r} mm"} for pin, r in RADII.items()}


def scene_of(*effects, **mu):
    """Return today's machine with its pins; mu: of a pin, 0 for every other."""
    scene = lo.load("beatup").with_effect("joint_forces", *effects).update(PINS)
    return scene.update({f"effects.joint_forces.pins.{pin}.mu": mu.get(pin, "0") for pin in RADII} if mu else {})


@pytest.mark.parametrize(("pin", "energy"), [("A", 39.7), ("B", 32.7), ("C", 7.9), ("D", 2.58)])
def test_what_each_pin_takes_a_turn(pin, energy):
    scene = scene_of(*EFFECTS, **{pin: "0.1"}).set("effects.rod_inertia.model", "exact")
    assert lo.evaluate(scene).figures["friction_loss"] / 10 == pytest.approx(energy, abs=0.05)


def test_the_sum_of_all_pins():
    scene = scene_of(*EFFECTS).set("effects.rod_inertia.model", "exact")
    assert lo.evaluate(scene).figures["friction_loss"] == pytest.approx(829, abs=0.5)


@pytest.mark.parametrize("effects", [(), ("speed_fluctuation",)])
def test_it_is_the_sum_of_small_steps(effects):
    scene = scene_of(*effects)
    sampler = registry.of(scene).sampler(scene, registry.of(scene).today(scene))
    # Midpoints on each piece: forces may jump between them.
    steps, pieces = 40_000, len(sampler.cycle.starts) - 1
    where, u = np.repeat(np.arange(pieces), steps), np.tile((np.arange(steps) + 0.5) / steps, pieces)
    weights = np.repeat(np.diff(sampler.cycle.starts) / steps, steps) / (2 * math.pi)
    values, phi = sampler.given.values, sampler.cycle.angles(where, u)
    _, rocker, _, _, rod, _ = plain.motion({name: values[name] for name in plain.DESIGN}, phi)
    turned = {"A": 1.0, "B": rod - 1, "C": rocker - rod, "D": rocker}
    read = {
        pin: 0.1 * r / 1000 * sampler.at(f"force_{pin}", where, u) * np.abs(turned[pin]) for pin, r in RADII.items()
    }
    rate = 1 / np.dot(weights, sampler.at("slowness", where, u))
    assert rate == pytest.approx(values["speed"], rel=0.01 if effects else 1e-12)
    power = [np.dot(weights, item) for item in read.values()]
    assert lo.evaluate(scene).figures["friction_loss"] == pytest.approx(sum(power) * rate, rel=3e-6)


def test_where_a_number_is_missing_it_is_null_and_says_which():
    scene = scene_of()
    missing = {name: keys for name, keys in PINS.items() if not name.endswith("C")}
    some = lo.load("beatup").with_effect("joint_forces").update(missing)
    evaluation = lo.evaluate(some)
    assert evaluation.figures["friction_loss"] is None
    message = "friction_loss needs effects.joint_forces.pins.C.mu and effects.joint_forces.pins.C.radius"
    assert evaluation.as_dict()["undefined"] == {"friction_loss": message}
    bare = lo.load("beatup").with_effect("joint_forces")
    assert lo.evaluate(bare).undefined == {"friction_loss": "friction_loss needs effects.joint_forces.pins"}
    assert "undefined" not in lo.evaluate(scene).as_dict()
    assert "friction_loss" not in lo.evaluate(lo.load("beatup")).as_dict().get("undefined", {})
    with pytest.raises(BadInput, match=r"pins.A.mu: it is out of range"):
        scene.set("effects.joint_forces.pins.A.mu", "-0.1")
    with pytest.raises(BadInput, match=r"effects.joint_forces.pins.E"):
        scene.set("effects.joint_forces.pins.E.mu", "0.1")


def test_it_is_a_figure_only():
    """Nothing of the solve knows of it: the same answer to the last bit, and its equation beside the others."""
    plain_answer, report = (
        lo.solve(item, starts=1) for item in (lo.load("beatup").with_effect("joint_forces"), scene_of())
    )
    assert plain_answer.figures["peak_torque"] == report.figures["peak_torque"]
    assert report.figures["friction_loss"] > 0.0
    with pytest.raises(BadInput, match="this figure cannot be limited"):
        scene_of().set("limits.friction_loss.max", "800 W")
    texts = [item.text for item in scene_of().equations() if "friction_loss" in item.text]
    assert len(texts) == 1
    assert all(f"force_{pin}" in texts[0] for pin in RADII)
