"""The beat-up model: its figures, its poses, and what it leaves out when numbers or effects are missing."""

import dataclasses
import math

import casadi as ca
import numpy as np
import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.jobs.beatup.model import FRONT, REAR, CrankRocker, shared_linkage
from loomopt.maths import systems
from loomopt.model.model import JobModel
from loomopt.physics.cycle import Node
from loomopt.physics.effects.beatup import counterweight_inertia, rod_inertia
from loomopt.physics.mechanisms import crank_rocker
from loomopt.physics.tolerances import ASSEMBLY_MARGIN

BEATUP = lo.load("beatup")
JOB = registry.of(BEATUP)
EVERY = ("rocker_inertia", "counterweight_inertia", "rod_inertia", "gravity", "bearing_friction", "centrifugal")
FULL = BEATUP
for effect in EVERY:
    FULL = FULL.with_effect(effect)
DESIGN = {"l1": 0.0305, "l2": 0.083, "l3": 0.15, "l4": 0.166, "m4e": 3.0, "r4e": 0.07}
PSI_2 = 0.300280


GROUP = CrankRocker().groups[""]
PRESSED = {"resistance": 1.0}


def figures(scene, design=None):
    return lo.evaluate(scene, design).figures


def given_of(scene, system=systems.FLOAT):
    """Return the numbers of a scene in a number system."""
    values = {name: system.number(value) for name, value in JOB.numbers(scene).items()}
    return JOB.model(scene).given(system, values)


def test_q_is_minus_psi_so_that_the_reed_torque_pushes_toward_the_fell():
    given = given_of(BEATUP)
    pose = CrankRocker().pose(systems.FLOAT, given, Node(2.0, {}))
    assert (pose.q, pose.q1, pose.q2) == (-pose.joints.psi, -pose.joints.psi_1, -pose.joints.psi_2)
    assert pose.omega == BEATUP.operation["speed"]
    assert shared_linkage(given).centres.psi_front < shared_linkage(given).centres.psi_rear


def test_without_cloth_inertia_alone_beats_up():
    """M3 < 0 at front dead centre: the reed has to be held back, it would strike harder than the cloth resists."""
    assert figures(BEATUP.without_effect("resistance"))["M3_fdc"] == pytest.approx(
        -0.62 * PSI_2 * (20 * math.pi) ** 2, 1e-5
    )


@pytest.mark.parametrize("scene", [BEATUP, FULL], ids=["the paper's", "every effect"])
@pytest.mark.parametrize("design", [None, DESIGN], ids=["today", "another"])
def test_the_figure_at_front_dead_centre_is_the_limit_of_the_curve_from_before(scene, design):
    sampled = JOB.sampler(scene, design or {})
    piece = sampled.cycle.piece_before(sampled.given.values["beta"])
    square = sampled.at("M3_square", np.full(1, piece), np.ones(1))[0]
    if "bearing_friction" not in scene.effects:  # then front dead centre is inside a piece
        share = (sampled.given.values["beta"] - sampled.cycle.starts[piece]) / np.diff(sampled.cycle.starts)[piece]
        square = sampled.at("M3_square", np.full(1, piece), np.array([share]))[0]
    assert sampled.static["M3_fdc"] == pytest.approx(
        math.copysign(math.sqrt(square), sampled.static["M3_fdc"]), rel=1e-11
    )


def test_the_front_pose_is_the_general_pose_at_front_dead_centre():
    given = given_of(FULL)
    front = CrankRocker().still(systems.FLOAT, given, FRONT, {})
    general = CrankRocker().pose(systems.FLOAT, given, Node(given.values["beta"], {}))
    for name in ("phi", "omega", "q", "q2", "acceleration"):
        assert getattr(front, name) == pytest.approx(getattr(general, name), rel=1e-13)
    assert (front.q1, front.velocity, front.omega_dot) == (0, 0, None)
    assert general.q1 == pytest.approx(0, abs=1e-15)


ROD = ("psi", "rod_1", "rod_2", "psi_2", "cos_crank_rod", "sin_crank_rod")


@pytest.mark.parametrize("design", [{}, DESIGN, {"l1": 0.001}], ids=["today", "another", "tiny crank"])
def test_joints_at_front_dead_centre_are_the_limit_of_the_general_pose_in_two_number_systems(design):
    """Near β, 1e-20 rad away in 40 digits; the closed forms themselves to 12 digits of floats."""
    many = systems.mpmath(40)
    numbers = JOB.numbers_of(FULL, design)
    exact = JOB.model(FULL).given(many, {name: many.number(value) for name, value in numbers.items()})
    plain = JOB.model(FULL).given(systems.FLOAT, numbers)
    near = CrankRocker().pose(many, exact, Node(exact.values["beta"] + many.number(10) ** -20, {})).joints
    front = CrankRocker().still(many, exact, FRONT, {}).joints
    floats = CrankRocker().still(systems.FLOAT, plain, FRONT, {}).joints
    for name in ROD:
        limit = getattr(near, name)
        assert float(abs(getattr(front, name) - limit)) <= 1e-18 * max(1.0, abs(float(limit))), name
        assert getattr(floats, name) == pytest.approx(float(limit), rel=1e-12, abs=1e-15), name
    assert front.psi_1 == 0
    assert float(front.sin_crank_rod) == pytest.approx(0, abs=1e-30)


def test_an_effect_may_read_joints_at_front_dead_centre():
    """The exact rod model, put on the reed's torque: its term is in M3_fdc."""
    rod = FULL.set("effects.rod_inertia.model", "exact")
    of_reed = dataclasses.replace(rod_inertia.EFFECT, acts="output")
    effects = [of_reed if effect is rod_inertia.EFFECT else effect for effect in rod.active]
    assert of_reed in effects
    model = dataclasses.replace(JOB.model(rod), effects=tuple(effects))
    given = model.given(systems.FLOAT, JOB.numbers(rod))
    without = JOB.model(rod).given(systems.FLOAT, JOB.numbers(rod))
    stills = JOB.sampler(rod, {}).stills
    result = model.static(systems.FLOAT, given, stills, ("M3_fdc",))["M3_fdc"]
    reed = JOB.model(rod).static(systems.FLOAT, without, stills, ("M3_fdc",))["M3_fdc"]
    joints = crank_rocker.front_pose(systems.FLOAT, shared_linkage(given).lengths, shared_linkage(given).centres)
    values, l1 = given.tables["rod_inertia"], BEATUP.mechanism["l1"]
    turn = (values["m2"] * values["s2"] ** 2 + values["JS2"]) * joints.rod_1 * joints.rod_2
    swing = values["m2"] * l1 * values["s2"] * joints.rod_2 * joints.cos_crank_rod
    assert result - reed == pytest.approx((turn + swing) * (20 * math.pi) ** 2, rel=1e-9)


def test_events_of_the_motion_are_both_dead_centres():
    sampled = JOB.sampler(BEATUP, DESIGN)
    front, rear = (sampled.model.event(systems.FLOAT, sampled.given, name) for name in (FRONT, REAR))
    assert (front, rear) == (sampled.given.values["beta"], math.pi + sampled.given.values["beta_r"])
    for angle in (front, rear):
        assert CrankRocker().pose(systems.FLOAT, sampled.given, Node(angle, {})).q1 == pytest.approx(0, abs=1e-14)


def test_static_figures_are_their_formulas():
    second_figures = figures(FULL, DESIGN)
    s = 3.0 * 0.07**2
    JS = FULL.effect_table(counterweight_inertia.Parameters).JS
    assert second_figures["J4"] == pytest.approx(0.62 + s + JS, rel=1e-15)
    assert second_figures["r4"] == pytest.approx((56.8 * 0.045 - 3.0 * 0.07) / 59.8, rel=1e-15)
    centres = shared_linkage(JOB.sampler(FULL, DESIGN).given).centres
    assert second_figures["alpha_fdc"] == pytest.approx(centres.psi_2_front * (20 * math.pi) ** 2, rel=1e-14)
    assert [second_figures[name] for name in ("swing", "theta", "beta")] == [centres.swing, centres.theta, centres.beta]
    widths = {"l1": 5, "l2": 25, "l3": 30, "l4": 17, "m4e": 12.4, "r4e": 80}
    moved = {"l1": -0.5, "l2": 18, "l3": -5, "l4": -1, "m4e": 3.0, "r4e": 70}
    assert second_figures["change"] == pytest.approx(sum((moved[x] / widths[x]) ** 2 for x in widths), rel=1e-12)


def test_the_counterweights_own_inertia_counts_only_with_its_effect():
    without = figures(FULL.without_effect("counterweight_inertia"), DESIGN)
    assert figures(FULL, DESIGN)["J4"] - without["J4"] == pytest.approx(0.0106, rel=1e-12)
    assert figures(FULL, DESIGN)["M3_fdc"] != pytest.approx(without["M3_fdc"], rel=1e-6)


def test_the_transmission_angle_is_the_lesser_of_both_ends():
    values = JOB.sampler(BEATUP, DESIGN).static
    assert figures(BEATUP, DESIGN)["mu_min"] == min(values["mu_near"], values["mu_far"])
    phi = np.linspace(0, 2 * math.pi, 100_001)
    l1, l2, l3, l4 = (DESIGN[f"l{k}"] for k in (1, 2, 3, 4))
    mu = np.arccos((l2**2 + l3**2 - l1**2 - l4**2 + 2 * l1 * l4 * np.cos(phi)) / (2 * l2 * l3))
    assert figures(BEATUP, DESIGN)["mu_min"] == pytest.approx(np.min(np.minimum(mu, math.pi - mu)), rel=1e-12)


@pytest.mark.parametrize("row", GROUP.margins)
def test_an_assembly_row_is_zero_where_the_triangle_closes_with_the_margin_only(row):
    """|r1 − r2|·1.001 ≤ L ≤ (r1 + r2)/1.001 for the distance L of the dyad's ends."""
    assert ASSEMBLY_MARGIN == 1.001
    base = {"l1": 0.031, "l2": 0.065, "l3": 0.155, "l4": 0.167}
    ends = {
        "assembly: l1 + l4 < l2 + l3": ("l2", 1.001 * (0.031 + 0.167) - 0.155),
        "assembly: l1 + l2 < l3 + l4": ("l2", (0.167 - 0.031) / 1.001 + 0.155),
        "assembly: l1 + l3 < l2 + l4": ("l3", (0.167 - 0.031) / 1.001 + 0.065),
    }
    name, edge = ends[row]
    assert GROUP.rows[row](systems.FLOAT, base) > 0
    assert GROUP.rows[row](systems.FLOAT, base | {name: edge}) == pytest.approx(0, abs=1e-15)
    worse = -1e-3 if row.startswith("assembly: l1 + l4") else 1e-3
    assert GROUP.rows[row](systems.FLOAT, base | {name: edge + worse}) < 0


def test_s_may_stand_for_the_counterweight():
    """Solved in s = m4e r4e², the model gives the same torque as from m4e and r4e."""
    values = JOB.numbers(BEATUP) | DESIGN
    result, node = JOB.model(BEATUP), Node(2.0, {"resistance": 0})
    by_mass = result.given(systems.FLOAT, values)
    by_s = result.given(systems.FLOAT, {k: v for k, v in values.items() if k != "m4e"} | {"s": 3.0 * 0.07**2})
    for name in ("peak_torque", "M3_square"):
        assert result.quantity(systems.FLOAT, by_s, name, node) == pytest.approx(
            result.quantity(systems.FLOAT, by_mass, name, node), rel=1e-15
        )
    symbols = {name: ca.SX.sym(name) for name in values if name != "m4e"} | {"s": ca.SX.sym("s")}
    given = result.given(systems.casadi(), symbols)
    pressed = Node(ca.SX.sym("phi"), PRESSED)
    read = {x.name() for x in ca.symvar(result.quantity(systems.casadi(), given, "peak_torque", pressed))}
    assert "s" in read
    assert not read & {"m4e", "r4e", "m4", "r4"}


def test_figures_without_their_numbers_are_undefined_not_invented():
    bare = BEATUP.without_effect("inertia").set("mechanism", {f"l{k}": f"{x} mm" for k, x in DIMENSIONS.items()})
    second_figures = figures(bare.set("operation", {"M0": "745 N*m"}))
    assert {name for name, value in second_figures.items() if value is None} == {
        *("alpha_fdc", "J4", "r4", "peak_power", "reed_centrifugal", "shaking_force"),
        *("fluctuation", "speed_fdc", "no_load_speed", "motor_torque_max"),
        *("shaft_peak", "twist_peak", "reed_front"),
        *("force_A", "force_B", "force_C", "force_D", "shaking_moment", "friction_loss"),
    }
    assert second_figures["M3_fdc"] == 745.0
    assert all(math.isfinite(value) for value in second_figures.values() if value is not None)


DIMENSIONS = {1: 31, 2: 65, 3: 155, 4: 167}


def test_the_mean_over_the_pulse_exists_with_the_pulse_only():
    assert [integral.name for integral in JOB.model(BEATUP).integrals] == ["pulse_mean_square"]
    assert JOB.model(BEATUP.without_effect("resistance")).integrals == ()
    assert figures(BEATUP.without_effect("resistance"))["pulse_rms"] is None


def test_the_key_tells_structures_apart_and_numbers_not():
    keys = [JOB.model(FULL.without_effect(name)).key for name in FULL.effects]
    exact = FULL.set("effects.rod_inertia.model", "exact")
    assert len({JOB.model(FULL).key, JOB.model(exact).key, *keys}) == len(keys) + 2
    other = FULL.set("operation.M0", "800 N*m").set("effects.inertia.J4", "0.5 kg*m^2")
    assert JOB.model(other).key == JOB.model(FULL).key


def test_a_model_is_plain_unchangeable_data():
    model = JOB.model(FULL)
    assert type(model) is JobModel
    with pytest.raises(dataclasses.FrozenInstanceError):
        model.effects = ()  # type: ignore[misc]
    assert [load.name for load in model.loads] == [name for name in FULL.effects if name != "centrifugal"]
    assert model.quantities == ("peak_torque", "peak_power", "reed_centrifugal", "shaking_force")
