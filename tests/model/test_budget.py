"""The torque budget: shares that add up to the crank torque, energies, and what motor and flywheel must be."""

import csv
import io
import math
from dataclasses import replace

import numpy as np
import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.model.model import CycleQuantity, Integral
from loomopt.model.sampling import Sampler
from loomopt.physics.balance import Loaded

ALL = ("rocker_inertia", "counterweight_inertia", "rod_inertia", "gravity", "bearing_friction")
RAPIER = {"effects.head_inertia": {"mass": "0.35 kg"}, "effects.tape_friction": {"force": "15 N"}}
SHAFT = {"stiffness": "2 MN*m/rad", "damping": "45 N*m*s/rad"}
MOTOR = {"motor_torque": "35 N*m", "slip": "0.08", "flywheel": "2 kg*m^2"}


def full():
    return lo.load("beatup").with_effect(*ALL).set("effects.rod_inertia.model", "exact")


def shed():
    return lo.load("shedding").with_effect("damping", "dry_friction", "spring_inertia")


SCENES = {
    "beat-up": lambda: lo.load("beatup"),
    "beat-up, all effects": full,
    "beat-up, elastic shaft": lambda: lo.load("beatup").set("effects.shaft_torsion", SHAFT),
    "beat-up, speed that changes": lambda: full().set("effects.speed_fluctuation", MOTOR),
    "rapier": lambda: lo.load("rapier").update(RAPIER),
    "shedding": shed,
}
REFERENCE = """
scene,effect,at_peak,rms,peak,energy
beat-up,inertia,-93.84952018,45.90204611,93.84952018,0
beat-up,resistance,0,4.252890579,21.03689396,0.1205106158
beat-up,total,-93.84952018,45.3979648,93.84952018,0.1205106158
"beat-up, all effects",inertia,-93.84904239,45.90204611,93.84952018,0
"beat-up, all effects",resistance,0,4.252890579,21.03689396,0.1205106158
"beat-up, all effects",counterweight_inertia,-1.604515886,0.7847769173,1.604524055,0
"beat-up, all effects",rocker_inertia,-7.56847116,3.701777912,7.568509692,0
"beat-up, all effects",rod_inertia,-3.108288085,1.598002259,3.142988636,0
"beat-up, all effects",gravity,-0.4570589714,0.4127856665,0.787867802,0
"beat-up, all effects",bearing_friction,0.4125666798,0.3794537634,0.6208770744,2.036991379
"beat-up, all effects",total,-106.1748098,51.80264053,106.1748098,2.157501995
rapier,head_inertia,2.603071898,1.693045517,3.263007852,0
rapier,tape_friction,7.426616252,5.039114808,8.376459036,25.49321418
rapier,total,10.02968815,5.315927122,10.02968815,25.49321418
"""
"""Today's machines by formulas of their own, each integrated over the turn by another rule; N*m and J."""


def rows(result):
    return {row.effect: row for row in (*result.rows, result.total)}


@pytest.mark.parametrize(
    "line", list(csv.DictReader(io.StringIO(REFERENCE.strip()))), ids=lambda line: str(line["scene"])
)
def test_shares_are_those_of_the_reference(line):
    row = rows(lo.budget(SCENES[line["scene"]]()))[line["effect"]]
    for name in ("at_peak", "rms", "peak", "energy"):
        assert getattr(row, name) == pytest.approx(float(line[name]), rel=1e-9, abs=1e-12), name
    if row.energy == 0.0:
        assert line["energy"] == "0"


@pytest.mark.parametrize("name", SCENES)
def test_the_shares_add_up_to_the_crank_torque_everywhere(name):
    scene = SCENES[name]()
    budget = lo.budget(scene)
    total, largest = budget.total, budget.total.peak
    assert math.fsum(row.at_peak for row in budget.rows) == pytest.approx(total.at_peak, rel=1e-14)
    assert math.fsum(row.share for row in budget.rows) == pytest.approx(1.0, rel=1e-13)
    assert math.fsum(row.energy for row in budget.rows) == pytest.approx(total.energy, abs=1e-11 * largest)
    job = registry.of(scene)
    sampler = job.sampler(scene, job.today(scene))
    assert largest == pytest.approx(sampler.peak("peak_torque"), rel=1e-12)
    curves = np.sum(list(budget.torque.curves.values()), axis=0)
    table = lo.simulate(scene)
    torque = next(column for column in table if column in ("Md [N*m]", "cam_torque [N*m]", "crank_torque [N*m]"))
    neighbour = np.interp(table["phi [rad]"], budget.torque.phi, curves)
    apart = np.abs(table[torque] - neighbour)
    assert np.median(apart) <= 1e-12 * largest
    assert np.mean(apart <= 1e-9 * largest) > 0.98, "but for both sides of corners"


@pytest.mark.parametrize("name", SCENES)
def test_what_dissipates_is_the_motor_s_work(name):
    """By the power of the curves, half a degree apart: what gives back has no part in it."""
    scene = SCENES[name]()
    budget = lo.budget(scene)
    dissipating = math.fsum(row.energy for row in budget.rows)
    speed = scene.operation["speed"]
    assert budget.motor.mean_power == pytest.approx(dissipating * speed / (2 * math.pi), rel=1e-9, abs=1e-9)
    table = lo.simulate(scene)
    phi, power = table["phi [rad]"].to_numpy(), table["motor_power [W]"].to_numpy()
    time = 1 / table["omega [rad/s]"].to_numpy() if "omega [rad/s]" in table else np.full(len(phi), 1 / speed)
    phi = np.append(phi, phi[0] + 2 * math.pi)
    power, time = np.append(power, power[0]), np.append(time, time[0])

    def integral(values):
        return np.sum(np.diff(phi) * (values[1:] + values[:-1]) / 2)

    mean, back = (integral(given * time) / integral(time) for given in (power, np.maximum(-power, 0.0)))
    assert mean == pytest.approx(budget.motor.mean_power, abs=2e-4 * budget.motor.peak_power)
    assert back == pytest.approx(budget.motor.regenerated, abs=2e-4 * budget.motor.peak_power)
    assert budget.motor.peak_power == pytest.approx(np.max(np.abs(power)), rel=1e-3)
    assert budget.motor.peak_power == pytest.approx(lo.evaluate(scene).figures["peak_power"], rel=1e-12)


def test_an_inertia_alone_asks_for_a_flywheel_of_its_own_closed_form():
    """Of J alone the crank stores J ω² ψ'²/2: what it takes and gives back is that at its largest."""
    scene = lo.load("beatup").without_effect("resistance")
    budget = lo.budget(scene, fluctuation=0.01)
    speed, (inertia,) = scene.operation["speed"], budget.rows
    rate = np.max(np.abs(lo.simulate(scene)["psi_1 [1]"]))
    stored = 0.62 * speed**2 * rate**2 / 2
    assert budget.motor.energy_swing == pytest.approx(stored, rel=1e-4), "half-degree samples of ψ'"
    assert budget.motor.flywheel == pytest.approx(budget.motor.energy_swing / (0.01 * speed**2), rel=1e-14)
    assert (inertia.energy, budget.motor.mean_power, inertia.share) == (0.0, 0.0, 1.0)


def test_a_flywheel_keeps_the_fluctuation_it_is_sized_for():
    """Beside a motor of nearly constant torque the speed changes by what was asked, to the order of that."""
    scene = full()
    flywheel = lo.budget(scene, fluctuation=0.005).motor.flywheel
    motor = {"motor_torque": "35 N*m", "slip": "0.9", "flywheel": f"{flywheel!r} kg*m^2"}
    changed = lo.evaluate(scene.set("effects.speed_fluctuation", motor)).figures["fluctuation"]
    assert changed == pytest.approx(0.005, rel=0.02)


def test_a_design_has_a_budget_of_its_own():
    answer = lo.solve("beatup")
    values, given = answer.budget(), lo.budget("beatup", answer)
    assert values.torque == given.torque
    assert values.total.at_peak == pytest.approx(-88.68941349, rel=1e-9)
    assert rows(values)["resistance"].energy == pytest.approx(0.09003420291, rel=1e-9)


def test_of_two_peaks_that_mirror_each_other_the_first_counts():
    budget = lo.budget(shed())
    assert budget.total.at_peak > 0.0
    assert budget.torque.angle < math.pi


@pytest.mark.parametrize(
    ("scene", "message"),
    [
        (lambda: lo.load("rapier"), "no effect acts on the crank"),
        (lambda: lo.load("shedding-static"), "effect warp_tension is defined in a part of the turn only"),
    ],
)
def test_where_there_is_nothing_to_share_out_that_is_said(scene, message):
    with pytest.raises(BadInput, match=message):
        lo.budget(scene())


@pytest.mark.parametrize("value", [0.0, -0.1, 1.5, math.nan, "0.02", True])
def test_a_fluctuation_that_is_none_is_refused(value):
    with pytest.raises(BadInput, match="fluctuation"):
        lo.budget("beatup", fluctuation=value)


def test_what_carries_others_says_so():
    budget = lo.budget(SCENES["beat-up, elastic shaft"]())
    inertia, resistance, shaft = budget.rows
    assert (inertia.effect, resistance.effect, shaft.effect) == ("inertia", "resistance", "shaft_torsion")
    message = "inertia and resistance reach the crank through shaft_torsion, and its share is the difference"
    assert budget.remarks == (message,)
    # What swings gives back all that it takes; the shaft keeps what its damping takes, c z'^2 of each turn.
    assert inertia.energy == 0.0
    assert shaft.energy == pytest.approx(_damped(SCENES["beat-up, elastic shaft"]()), rel=1e-9)


def _damped(scene):
    job = registry.of(scene)
    sampler = job.sampler(scene, job.today(scene))
    (state,) = sampler.model.states
    damping, omega = sampler.given.tables[state.name]["damping"], sampler.given.values["speed"]
    loss = CycleQuantity(lambda at: damping * (_carried(at) - at.pose.q1 * omega) ** 2 / omega, figure=False)
    model = replace(sampler.model, own_quantities={**sampler.model.own_quantities, "loss": loss})
    return 2 * math.pi * Sampler(model, sampler.values).mean(Integral("", "", "loss", parts=400))


def _carried(at):
    return Loaded(at.maths, at.model.loads, at.pose, at.given, at.node.switch).carried.velocity
