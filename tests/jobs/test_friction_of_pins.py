"""What friction in pins takes, by their loads: how each turns is read off where joints stand, in small steps."""

import math
import re
import tomllib

import numpy as np
import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.jobs.shedding import drawing
from loomopt.physics.cycle import Floats

STEPS = 20_000
PHI: Floats = np.asarray((np.arange(STEPS) + 0.5) * (2 * math.pi / STEPS), dtype=np.float64)
Pins = dict[str, tuple[tuple[str, ...], tuple[str, ...]]]
FRAME: tuple[str, ...] = ()
RAPIER: Pins = {
    "A0": (FRAME, ("A0", "A")),
    "A": (("A0", "A"), ("A", "B1")),
    "B0": (FRAME, ("B0", "B1")),
    "B1": (("A", "B1"), ("B0", "B1")),
    "B2": (("B0", "B1"), ("B2", "D")),
    "C0": (FRAME, ("C0", "C")),
    "C": (("C0", "C"), ("C", "D")),
    "D": (("C", "D"), ("B2", "D")),
}
PRESS: Pins = {
    "A": (FRAME, ("A", "B")),
    "B": (("A", "B"), ("B", "C")),
    "D": (FRAME, ("D", "C")),
    "C_knuckle": (("B", "C"), ("D", "C")),
    "C_ram": (("D", "C"), ("C", "P")),
    "P": (("C", "P"), FRAME),
}
SHAPER: Pins = {"A": (FRAME, ("A", "B")), "O": (FRAME, ("O", "C")), "B": (("O", "C"), ("A", "B"))}
SHAPER |= {"C": (("O", "C"), ("C", "R")), "R": (("C", "R"), FRAME)}
ENDS = np.isin(np.arange(STEPS), [0, STEPS - 1])
CASES: dict[str, tuple[Pins, tuple[str, ...]]] = {
    "rapier": (RAPIER, ("head_inertia", "tape_friction")),
    "knuckle-press": (PRESS, ()),
    "shaper": (SHAPER, ()),
}
"""Scene → what each pin lies between, told by two joints; effects put on."""


def with_pins(scene, names):
    pins = {f"effects.joint_forces.pins.{pin}": {"mu": "0.1", "radius": f"{10 + k} mm"} for k, pin in enumerate(names)}
    return scene.update(pins)


def rate(values):
    """Return the slope by φ of an angle at PHI, by central differences round the turn."""
    parameters = np.unwrap(values)
    turn = 2 * math.pi * round((parameters[-1] - parameters[0]) / (2 * math.pi))
    return (np.roll(parameters, -1) - np.roll(parameters, 1) + turn * ENDS) / (2 * (PHI[1] - PHI[0]))


def slope(motion, ends):
    if ends == FRAME:
        return 0.0
    first, second = (motion.joints.get(end, np.asarray(motion.pivots.get(end))) for end in ends)
    return rate(np.arctan2(*(second - first).T[::-1]))


@pytest.mark.parametrize("name", CASES)
def test_the_loss_is_the_sum_of_small_steps(name):
    pins, effects = CASES[name]
    scene = with_pins(lo.load(name).with_effect("joint_forces", *effects), pins)
    job, design = registry.of(scene), registry.of(scene).today(scene)
    result, motion = job.sampler(scene, design), job.views.motion(scene, design, PHI)
    energy = 0.0
    for k, (pin, (item, other)) in enumerate(pins.items()):
        turned = np.abs(slope(motion, item) - slope(motion, other))
        energy += 0.1 * (10 + k) / 1000 * np.sum(result.at_angles(f"force_{pin}", PHI) * turned) * 2 * math.pi / STEPS
    expected = energy * result.given.values["speed"] / (2 * math.pi)
    assert lo.evaluate(scene).figures["friction_loss"] == pytest.approx(expected, rel=5e-5)  # forces jump within a step


LEVER = {"mechanism.lever": {"arm": "150 mm", "direction": "80 deg"}}


@pytest.mark.parametrize("stiffness", ["110 N/mm", "40 N/mm"])
def test_a_roller_rolls_and_where_it_has_no_contact_nothing_is_lost(stiffness):
    names = ("shaft", "roller", "lever")
    scene = with_pins(lo.load("shedding").with_effect("joint_forces").update(LEVER), names)
    scene = scene.set("mechanism.K1", stiffness)
    job = registry.of(scene)
    sampler = job.sampler(scene, job.today(scene))
    cam = drawing.CamDrawing(sampler)
    at = cam.at(PHI)
    pitch, arm = np.roll(at.pitch, -1, axis=0) - np.roll(at.pitch, 1, axis=0), at.contact.angle
    swing = np.roll(arm, -1) - np.roll(arm, 1)
    step = 2 * (PHI[1] - PHI[0])
    # In the cam's frame a roller turns by its centre's way over its radius, and its arm goes round.
    rolled = np.hypot(*pitch.T) / step / cam.follower.roller_radius - 1 - swing / step
    turned = {"cam_shaft_force": np.ones(STEPS), "roller_force": rolled, "lever_pivot_force": swing / step}
    pushing = sampler.at_angles("cam_force", PHI) > 0.0
    assert bool(np.all(pushing)) == (stiffness == "110 N/mm")
    energy = math.fsum(
        0.1 * (10 + k) / 1000 * np.mean(pushing * sampler.at_angles(force, PHI) * np.abs(turned[force]))
        for k, force in enumerate(turned)
    )
    figures = lo.evaluate(scene).figures
    assert figures["friction_loss"] == pytest.approx(energy * sampler.given.values["speed"], rel=1e-3)
    # In a dwell two circles roll on each other.
    dwell = cam.at(np.array([6.2])).contact.rolling
    assert dwell == pytest.approx(cam.follower.base_radius / cam.follower.roller_radius - 1, rel=1e-12)


def test_what_a_cam_has_no_lever_for_is_null_and_says_so():
    scene = with_pins(lo.load("shedding").with_effect("joint_forces"), ("shaft", "roller", "lever"))
    result = lo.evaluate(scene).as_dict()
    assert result["figures"]["friction_loss"] is None
    assert result["undefined"]["friction_loss"].startswith("friction_loss needs mechanism.lever.arm")


@pytest.mark.parametrize("job", ["beatup", "rapier", "shedding", "linkage"])
def test_a_template_s_own_lines_for_forces_are_read(job):
    """Each is a comment; taken in, nothing is missing but the pins that are not named in it."""
    lines = re.sub(r"(?m)^# +(pins\.|gears\.|crank = \{ mass|lever = \{ arm)", r"\1", registry.template(job))
    assert lines.count("\npins.") == 1
    evaluation = lo.evaluate(lo.scene(tomllib.loads(lines)).with_effect("joint_forces"))
    assert set(evaluation.undefined) == {"friction_loss"}
    missing = evaluation.undefined["friction_loss"].removeprefix("friction_loss needs ").split(" and ")
    assert missing
    assert all(re.fullmatch(r"effects\.joint_forces\.pins\.\w+\.(mu|radius)", key) for key in missing)
