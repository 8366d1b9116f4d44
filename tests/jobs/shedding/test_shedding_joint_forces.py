"""Forces of the roller, in its lever and the cam shaft: against values worked out apart, by work, without contact."""

import csv
import functools
import math
from pathlib import Path

import numpy as np
import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.jobs.shedding.model import follower
from loomopt.maths import systems
from loomopt.physics.cycle import Node
from loomopt.scenes.document import removed

REFERENCE = list(csv.DictReader((Path(__file__).parents[2] / "reference" / "joint_forces.csv").open()))
CASES = {
    "shedding": ("shedding", (), 102602.60942535743),
    "shedding, printed travel": ("shedding-printed-travel", (), 36418.1506155927),
    "shedding, all effects": ("shedding", ("damping", "dry_friction", "spring_inertia"), 110000.0),
}
"""Case → packaged scene, effects put on, stiffness in N/m."""
LEVER = {"mechanism.lever": {"arm": "150 mm", "direction": "80 deg"}}
PUSHED = ("roller_force", "roller_side", "cam_shaft_force", "lever_couple")


def scene_of(case):
    return lo.load(CASES[case][0]).with_effect("joint_forces", *CASES[case][1])


@functools.cache
def sampler(case):
    scene, job = scene_of(case).update(LEVER), registry.find("shedding")
    return job.sampler(scene, {**job.today(scene), "K1": CASES[case][2]})


def at(result, name, theta, piece):
    node = Node(theta, result.cycle.switch(piece))
    return float(result.model.quantity(systems.FLOAT, result.given, name, node))


NAMES = {
    "roller normal force": "roller_force",
    "roller side load": "roller_side",
    "roller side load magnitude": "roller_side",
    "lever couple": "lever_couple",
    "shaking_force": "shaking_force",
    "F_P_x": "roller_force_x",
    "F_P_y": "roller_force_y",
    "cam torque": "peak_torque",
    "pressure angle": "pressure_angle",
}
TAKEN = ("F_P_x", "F_P_y")
"""Without a rod the pivot takes the opposite of the roller's force."""


@pytest.mark.parametrize("case", CASES)
def test_forces_are_those_of_the_reference(case):
    result, checked = sampler(case), set()
    for row in (row for row in REFERENCE if row["case"] == case):
        subject, value = row["quantity"], float(row["value"])
        place = next((item for item in sorted(NAMES, key=len)[::-1] if subject.startswith(item)), "")
        name, kind = NAMES.get(place, ""), subject.removeprefix(place).strip()
        if kind == "peak":
            size = math.radians(value) if row["unit"] == "deg" else value
            assert result.peak(name) == pytest.approx(size, rel=1e-12), subject
        elif kind == "peak angle" and name != "shaking_force":
            # The reference's own search ends within 2e-8 of a top; of tops that mirror each other it took one.
            tops = result.extremes(name)
            alike = (top for top in tops if top.height > (1 - 1e-9) * tops[0].height)
            angles = [math.degrees(result.angle(top)) % 360 for top in alike]
            assert any(angle == pytest.approx(value, rel=1e-7) for angle in angles), subject
        elif kind.startswith("at ") and name:
            theta = math.radians(float(kind.split()[1]))
            # The frame begins to rise at 0: the reference has no dry friction there, the mean of both sides.
            pieces = {result.cycle.piece_before(theta), *([result.cycle.place(theta)[0]] if theta == 0.0 else [])}
            values = [at(result, name, theta, piece) * (-1 if place in TAKEN else 1) for piece in pieces]
            assert sum(values) / len(values) == pytest.approx(value, rel=1e-11, abs=1e-9), subject
        else:
            continue
        checked.add(name)
    assert checked == set(NAMES.values())


@pytest.mark.parametrize("case", CASES)
def test_the_cam_s_torque_is_that_of_the_roller_s_force(case):
    second_sampler = sampler(case)
    pieces, u = second_sampler.grid(1440)
    instant = second_sampler.model.instant(systems.numpy(), second_sampler.given, second_sampler.node(pieces, u))
    contact = instant.pose.contact(follower(second_sampler.given.values))
    place, normal, force = contact.centre(0), contact.normal(0), second_sampler.at("roller_force", pieces, u)
    # The normal points to the cam: the roller pushes it there.
    torque = -force * (place.x * normal.y - place.y * normal.x)
    expected = instant.force * instant.pose.q1
    assert np.max(np.abs(torque - expected)) <= 1e-12 * np.max(np.abs(expected))
    # Of the frame on the lever: with the roller's and the rod's force nothing is left.
    rod = instant.force * second_sampler.given.values["travel"] / second_sampler.given.values["arm_swing"] / 0.15
    pivot = [second_sampler.at(f"lever_pivot_force_{axis}", pieces, u) for axis in "xy"]
    angle = math.radians(80)
    assert np.max(np.abs(pivot[0] - force * normal.x + rod * math.cos(angle))) <= 1e-12 * np.max(force)
    assert np.max(np.abs(pivot[1] - force * normal.y + rod * math.sin(angle))) <= 1e-12 * np.max(force)
    side, couple = second_sampler.at("roller_side", pieces, u), second_sampler.at("lever_couple", pieces, u)
    assert np.hypot(side, couple / second_sampler.given.values["arm"]) == pytest.approx(np.abs(force), rel=1e-12)


def test_where_contact_is_lost_there_is_no_force():
    scene = scene_of("shedding")
    evaluation = lo.evaluate(scene)
    assert evaluation.figures["contact_min"] < -1e4
    frame = lo.simulate(scene)
    lost = frame["N [N]"] < 0
    assert lost.any()
    for name, unit in ((name, "N*m" if name == "lever_couple" else "N") for name in PUSHED):
        column = frame[f"{name} [{unit}]"]
        assert (column[lost] == 0.0).all()
        # The figure is refined between the rows of the curve.
        assert evaluation.figures[name] == pytest.approx(column.abs().max(), rel=1e-4)
        assert evaluation.figures[name] >= column.abs().max() * (1 - 1e-12)
    assert frame["shaking_force [N]"][lost].abs().max() > 0.0


def test_a_figure_without_its_numbers_is_undefined_and_says_why():
    scene = scene_of("shedding")
    evaluation = lo.evaluate(scene)
    assert evaluation.figures["lever_pivot_force"] is None
    keys = "mechanism.lever.arm and mechanism.lever.direction"
    assert set(evaluation.undefined) == {"lever_pivot_force", "friction_loss"}
    assert evaluation.undefined["lever_pivot_force"] == f"lever_pivot_force needs {keys}"
    with pytest.raises(BadInput, match=f"limits.lever_pivot_force: lever_pivot_force needs {keys}") as refused:
        lo.solve(scene.set("limits.lever_pivot_force.max", "50 kN"))
    assert "follower" not in str(refused.value)
    limited = lo.load("shedding").set("limits.pressure_angle_max.max", "45 deg")
    with pytest.raises(BadInput, match="Give the follower"):
        lo.solve(lo.scene(removed(limited.document, ["mechanism", "arm"])))
    bare = lo.load("shedding-static").with_effect("joint_forces")
    report = lo.evaluate(bare).undefined
    assert {"shaking_force", "lever_pivot_force"} <= set(report)
    assert report["shaking_force"] == "shaking_force needs effects.inertia.M"
    assert lo.evaluate(scene.update(LEVER)).figures["lever_pivot_force"] > 0.0


def test_as_figures_alone_they_change_nothing_of_a_solve():
    plain, values = (lo.solve(scene) for scene in (lo.load("shedding"), scene_of("shedding")))
    assert values.figures["K1"] == plain.figures["K1"]
    assert values.solver["designs"] == plain.solver["designs"], "still one optimum, which needs no search"
    assert values.figures["roller_force"] == pytest.approx(54464.968609901, rel=1e-11)
    assert values.figures["lever_couple"] == pytest.approx(6782.235694604, rel=1e-11)


@pytest.mark.slow
def test_a_limit_on_the_roller_s_force_binds_is_priced_and_proven():
    def answered(most):
        limited = scene_of("shedding").update({"limits.roller_force.max": f"{most!r} N", "bounds.X0.min": "40 mm"})
        return limited, lo.solve(limited, "stiffness")

    free = lo.solve(scene_of("shedding").set("bounds.X0.min", "40 mm"), "stiffness")
    most = 0.99 * free.figures["roller_force"]
    scene, answer = answered(most)
    assert (answer.status, answer.certificate.passed) == ("optimal", True)
    assert answer.figures["roller_force"] == pytest.approx(most, rel=1e-9)
    (price,) = [price for price in answer.binding if price.limit == "roller_force"]
    looser, tighter = (answered(most + step)[1].figures["K1"] for step in (1.0, -1.0))
    assert price.worth["K1"] == pytest.approx((tighter - looser) / 2, rel=1e-4)
    assert lo.prove(scene, answer, target="stiffness").passed
