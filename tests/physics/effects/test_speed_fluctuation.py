"""The crank at a speed of its own: reference figures by two methods, limits in closed form, energy, refusals."""

import functools
import math

import casadi as ca
import numpy as np
import pytest
from support import inch

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.model.reading import DATUM
from loomopt.physics.cycle import Node
from loomopt.physics.tolerances import SAME_ANGLE
from loomopt.studies.accuracy import accuracy
from loomopt.studies.front import front
from reference import turn as plain_turn

BEATUP = lo.load("beatup")
JOB = registry.of(BEATUP)
ON = BEATUP.with_effect("speed_fluctuation")
EFFECTS = ("rocker_inertia", "counterweight_inertia", "rod_inertia", "gravity", "bearing_friction", "centrifugal")
TABLE = {
    1: (0.0160330062223, 63.1995008701, 1.38883148675, 92.11073444, 62.8364088031),
    2: (0.00805602236175, 63.0152913702, 5.71736602802, 92.94952857, 62.8350660434),
    10: (0.0016159612594, 62.8685106887, 9.15735743939, 93.66477311, 62.8346261771),
}
"""Flywheel, kg·m² → fluctuation, ω(β), M3_fdc, peak_torque, ω_n of the packaged machine; SI."""
NAMES = ("fluctuation", "speed_fdc", "M3_fdc", "peak_torque", "no_load_speed")


def turned(flywheel=2.0, scene=ON, **parameters):
    """Return the scene with a flywheel, kg·m², and other values of the effect."""
    values = {"flywheel": f"{flywheel!r} kg*m^2", **parameters}
    return scene.update({f"effects.speed_fluctuation.{key}": value for key, value in values.items()})


def figures(scene, design=None):
    return JOB.figures(scene, design or JOB.today(scene))


def sampler_of(scene, design=None):
    return JOB.sampler(scene, design or JOB.today(scene))


@pytest.mark.parametrize("flywheel", TABLE)
def test_the_reference_figures(flywheel):
    second_figures = figures(turned(float(flywheel)))
    assert [second_figures[name] for name in NAMES] == pytest.approx(TABLE[flywheel], rel=1e-9)


@pytest.mark.parametrize("flywheel", TABLE)
def test_shooting_with_another_integrator_finds_the_same(flywheel):
    shot, result = plain_turn.figures(flywheel), figures(turned(float(flywheel)))
    assert shot == pytest.approx({name: result[name] for name in shot}, rel=1e-9)


def test_a_light_flywheel_and_a_weak_motor_too():
    shot = plain_turn.figures(0.05, 5.0, 0.3)
    second_figures = figures(turned(0.05, motor_torque="5 N*m", slip="0.3"))
    assert second_figures["fluctuation"] > 0.2
    assert shot == pytest.approx({name: second_figures[name] for name in shot}, rel=1e-8)


def test_a_heavy_flywheel_leaves_the_rigid_machine_and_a_share_that_falls_with_it():
    """The share to first order: ω ω1' = −(Md − its mean) at constant speed, the mean of ω1 being 0."""
    rigid, sampler = figures(BEATUP)["M3_fdc"], sampler_of(BEATUP)
    phi = np.linspace(0, 2 * math.pi, 200_001)
    pieces, u = sampler.cycle.located(phi)
    torque = sampler.at("peak_torque", pieces, u)
    steps = (torque[1:] + torque[:-1]) / 2 * (phi[1] - phi[0])
    summed = np.concatenate([[0.0], np.cumsum(steps)])
    first = -(summed - summed[-1] * phi / phi[-1]) / plain_turn.SPEED
    at_front = np.interp(plain_turn.BETA, phi, first - np.mean(first[:-1]))
    share = -2 * plain_turn.J4 * plain_turn.rocker(plain_turn.BETA)[1] * plain_turn.SPEED * at_front
    assert share == pytest.approx(-8.5755, abs=5e-5)
    for flywheel, near in ((1e4, 1e-3), (1e6, 1e-5)):
        figure = figures(turned(flywheel))["M3_fdc"]
        assert flywheel * (figure - rigid) == pytest.approx(share, rel=near)


def test_the_fluctuation_falls_as_one_over_the_flywheel():
    light, heavy = (figures(turned(flywheel))["fluctuation"] for flywheel in (1e3, 1e4))
    assert math.log10(light / heavy) == pytest.approx(1.0, abs=1e-3)


def test_without_load_and_with_hardly_a_motor_its_energy_is_kept():
    """(J_f + J ψ'²) ω² is constant; what is missing falls with the slope of the motor's line."""
    phi = np.arange(8192) * 2 * math.pi / 8192
    squares = np.array([2 + plain_turn.J4 * plain_turn.rocker(angle)[0] ** 2 for angle in phi])
    root = plain_turn.SPEED * np.mean(np.sqrt(squares))
    most, least = root / math.sqrt(2), root / math.sqrt(squares.max())
    free = ON.set("operation.M0", "0 N*m")
    second_figures = figures(turned(2.0, free, motor_torque="1e-4 N*m"))
    assert (second_figures["fluctuation"], second_figures["speed_fdc"]) == pytest.approx(
        (0.00801950197487, 63.0410272579466), rel=1e-7
    )
    assert second_figures["fluctuation"] == pytest.approx((most - least) / plain_turn.SPEED, rel=1e-6)
    assert second_figures["speed_fdc"] == pytest.approx(most, rel=1e-9)
    finer = figures(turned(2.0, free, motor_torque="1e-5 N*m"))
    closer = (second_figures["fluctuation"] - 0.00801950197487) / (finer["fluctuation"] - 0.00801950197487)
    assert closer == pytest.approx(10, rel=1e-2)


def rule(sampler):
    """Return nodes (pieces, u) and weights of an integral over the turn, right to rounding."""
    x, weights = np.polynomial.legendre.leggauss(160)
    widths = np.diff(sampler.cycle.starts)
    pieces = np.repeat(np.arange(len(widths)), len(x))
    return pieces, np.tile((x + 1) / 2, len(widths)), np.repeat(widths, len(x)) * np.tile(weights / 2, len(widths))


ALL = functools.reduce(lambda scene, name: scene.with_effect(name), EFFECTS, ON)
EXACT = ALL.set("effects.rod_inertia.model", "exact")


@pytest.mark.parametrize("scene", [ON, ALL, EXACT], ids=["two loads", "all loads", "exact rod"])
def test_what_the_motor_gives_in_a_turn_is_what_the_loads_take(scene):
    """In each turn inertia, weight, rod and flywheel give back what they take; friction and cloth do not."""
    sampler = sampler_of(turned(0.5, scene), {"m4e": 5.0, "r4e": 0.07})
    pieces, u, weights = rule(sampler)
    at = sampler.model.instant(systems.numpy(), sampler.given, sampler.node(pieces, u))
    pose, terms = at.pose, at.terms()
    lever = {load.name: pose.q1 if load.acts == "output" else 1.0 for load in sampler.model.loads}
    works = {name: float(weights @ (lever[name] * term)) for name, term in terms.items()}
    given = float(weights @ sampler.at("motor_torque", pieces, u))
    size = float(weights @ np.abs(at.crank_torque))
    lost = {name: work for name, work in works.items() if name in ("resistance", "bearing_friction")}
    subset = [abs(work) for name, work in works.items() if name not in lost]
    assert max(subset) < 1e-9 * size
    assert given == pytest.approx(sum(lost.values()), abs=1e-9 * size)
    assert given == pytest.approx(float(weights @ at.crank_torque), abs=1e-9 * size)
    assert float(weights @ (1 / pose.omega)) == pytest.approx(2 * math.pi / plain_turn.SPEED, rel=1e-12)
    if "bearing_friction" in lost:
        assert lost["bearing_friction"] > 0.05


@pytest.mark.parametrize("scene", [ON, EXACT], ids=["two loads", "exact rod"])
def test_the_motors_line_is_the_torque_on_the_crank_and_on_the_flywheel(scene):
    sampler = sampler_of(turned(0.5, scene))
    pieces, u = sampler.grid(2000)
    at = sampler.model.instant(systems.numpy(), sampler.given, sampler.node(pieces, u))
    line = 35 / (0.08 * plain_turn.SPEED) * (sampler.static["no_load_speed"] - at.pose.omega)
    assert np.max(np.abs(line - at.crank_torque - 0.5 * at.pose.omega_dot)) < 1e-9
    assert np.max(np.abs(line - sampler.at("motor_torque", pieces, u))) < 1e-9
    assert sampler.static["motor_torque_max"] == pytest.approx(line.max(), rel=1e-4)
    assert sampler.peak("peak_power") == pytest.approx(np.max(np.abs(line * at.pose.omega)), rel=1e-4)


def test_everything_that_reads_the_speed_reads_that_of_its_angle():
    scene = turned(0.2, EXACT)
    sampler, steady = sampler_of(scene), sampler_of(EXACT.without_effect("speed_fluctuation"))
    faster = sampler.static["speed_fdc"] / plain_turn.SPEED
    assert faster > 1.01
    known, at_rest = sampler.static, steady.static
    assert known["alpha_fdc"] == pytest.approx(at_rest["alpha_fdc"] * faster**2, rel=1e-14)
    phi = 2.0
    pieces, u = (np.array([part]) for part in sampler.cycle.place(phi))
    result, before = (
        {name: item.at(name, pieces, u)[0] for name in ("reed_centrifugal",)} for item in (sampler, steady)
    )
    ratio = sampler.at("omega", pieces, u)[0] / plain_turn.SPEED
    assert result["reed_centrifugal"] == pytest.approx(before["reed_centrifugal"] * ratio**2, rel=1e-12)
    curves = lo.simulate(scene)
    assert curves["psi_t [rad/s]"].to_numpy() == pytest.approx(
        (curves["psi_1 [1]"] * curves["omega [rad/s]"]).to_numpy()
    )
    friction = 0.05 * -curves["psi_t [rad/s]"]
    assert np.max(np.abs(np.abs(curves["bearing_friction [N*m]"] - friction) - 2.0)) < 1e-9


def test_extremes_are_true_between_samples_and_at_corners():
    result = sampler_of(turned(0.1))
    dense = result.grid(200_000)
    for name in ("peak_torque", "peak_power"):
        values = np.abs(result.at(name, *dense))
        assert result.peak(name) == pytest.approx(values.max(), rel=1e-8)
        assert result.peak(name) >= values.max() * (1 - 1e-12)


def test_both_sides_of_a_corner_have_their_own_change_of_speed():
    """Coulomb friction jumps at both dead centres, where ψ' = 0: the speed's change has a kink there and no jump."""
    sampler = sampler_of(turned(0.5, ON.with_effect("bearing_friction")))
    count = sampler.cycle.pieces
    at = [
        sampler.model.instant(systems.numpy(), sampler.given, sampler.node(np.arange(count), np.full(count, side))).pose
        for side in (0.0, 1.0)
    ]
    assert count == 4
    for name, near in (("omega", 1e-13), ("omega_dot", 1e-9)):
        begins, ends = (getattr(pose, name) for pose in at)
        assert ends == pytest.approx(np.roll(begins, -1), rel=near, abs=near)


def test_an_inch_machine_at_350_rpm_is_the_same_machine():
    values = {"operation.speed": "350 rpm", "effects.speed_fluctuation.flywheel": "6000 lb*in^2"}
    values |= {"effects.speed_fluctuation.motor_torque": "300 lbf*in", "effects.speed_fluctuation.slip": "0.05"}
    imperial = inch.scene("beatup").with_effect("speed_fluctuation").update(values)
    metric = ON.update(values)
    result, expected = lo.evaluate(imperial), lo.evaluate(metric)
    known = {name: value for name, value in expected.figures.items() if value is not None}
    assert {name: result.figures[name] for name in known} == pytest.approx(known, rel=1e-12)
    table = result.table()
    assert table.loc["speed_fdc", "unit"] == "rpm"
    assert table.loc["motor_torque_max", "unit"] == "lbf*in"
    assert float(str(table.loc["speed_fdc", "design"])) == pytest.approx(351, abs=1)
    assert result.figures["fluctuation"] == pytest.approx(0.0091, abs=2e-3)


@pytest.mark.parametrize(
    "call",
    [
        lo.solve,
        lo.prove,
        lambda scene: lo.sweep(scene, {"operation.M0": ["600 N*m", "700 N*m"]}),
        lambda scene: front.trade(scene, ("peak_torque", "m4e"), "balance"),
        lambda scene: next(iter(accuracy.climbs(scene))),
    ],
    ids=["solve", "prove", "sweep", "front", "accuracy"],
)
def test_what_seeks_or_proves_refuses_it_by_name(call):
    with pytest.raises(BadInput, match="does not cover effect speed_fluctuation") as error:
        call(ON)
    assert error.value.key == "effects.speed_fluctuation"
    assert "without it, evaluate with it" in str(error.value)
    assert "--without speed_fluctuation" in str(error.value)


def test_the_answer_without_it_is_evaluated_with_it():
    design = {"l1": 0.03, "l2": 0.084, "l3": 0.1513, "l4": 0.167}
    steady, result = lo.evaluate(BEATUP, design), lo.evaluate(ON, design)
    assert result.design == steady.design
    assert result.figures["M3_fdc"] != steady.figures["M3_fdc"]
    assert "fluctuation" in result.table().index


def test_a_flywheel_that_is_too_light_is_refused_in_one_message():
    with pytest.raises(BadInput, match="no periodic motion without a stop") as error:
        lo.evaluate(turned(0.01).set("operation.M0", "20 kN*m"))
    assert error.value.key == "effects.speed_fluctuation"
    assert "larger flywheel" in error.value.remedy


@pytest.mark.parametrize(
    ("key", "value"), [("slip", "0"), ("slip", "1"), ("flywheel", "0 kg*m^2"), ("motor_torque", "0 N*m")]
)
def test_a_motor_that_makes_no_sense_is_refused(key, value):
    with pytest.raises(BadInput, match="out of range") as error:
        ON.set(f"effects.speed_fluctuation.{key}", value)
    assert error.value.key == f"effects.speed_fluctuation.{key}"


def test_its_figures_may_be_limited():
    remaining, broken = (lo.evaluate(ON.set("limits.fluctuation.max", most)) for most in ("0.01", "0.005"))
    assert remaining.admissible
    assert [limit.name for limit in broken.limits if not limit.ok] == ["fluctuation"]
    with pytest.raises(BadInput, match="effect speed_fluctuation is off: it gives fluctuation"):
        lo.evaluate(BEATUP.set("limits.fluctuation.max", "0.01"))


def test_the_same_design_is_turned_once():
    assert sampler_of(ON) is sampler_of(ON)
    assert sampler_of(ON, {"l1": 0.0305}) is not sampler_of(ON)


def test_a_node_a_turn_away_is_the_same_node():
    sampler = sampler_of(ON)
    kinematics, pieces = sampler.model.kinematics, np.arange(sampler.cycle.pieces)
    for turns in (-1, 1):
        node = sampler.node(pieces, np.full(len(pieces), 0.3))
        away = node._replace(phi=node.phi + turns * 2 * math.pi)
        here, there = (kinematics.pose(systems.numpy(), sampler.given, at) for at in (node, away))
        assert there.omega == pytest.approx(here.omega, rel=10 * SAME_ANGLE)
        alone = kinematics.pose(systems.numpy(), sampler.given, away._replace(switch={}))
        assert alone.omega == pytest.approx(here.omega, rel=10 * SAME_ANGLE)


def test_a_scene_without_it_is_read_as_if_there_were_none():
    """The model itself, at constant speed: no ω̇, no motor, no row more."""
    off = ON.without_effect("speed_fluctuation")
    sampler = sampler_of(off)
    assert sampler.model is JOB.model(BEATUP)
    pose = sampler.model.instant(systems.numpy(), sampler.given, sampler.node(*sampler.grid())).pose
    assert pose.omega_dot is None
    assert pose.omega is sampler.given.values["speed"]
    before, after = figures(BEATUP), figures(off)
    assert {name: value.hex() for name, value in before.items() if value is not None} == {
        name: value.hex() for name, value in after.items() if value is not None
    }
    assert not {"fluctuation", "omega", "motor_torque"} & {*sampler.static, *sampler.model.quantities}
    assert "omega [rad/s]" not in JOB.curves(off, JOB.today(off))


NODES = {
    ("beatup", ()): 3718,
    ("beatup", ("rod_inertia",)): 2922,
    ("beatup", ("gravity",)): 3335,
    ("rapier", ()): 12657,
    ("shedding", ()): 2137,
}
"""Of all formulas together, by job and by what of its algebraic effects is off, as they were before a shaft could have
a speed of its own, but for the shaking force, which has components and the rod, an angle of the resistance that is
brought onto its turn, and the rod's weight inside the drive: 121 nodes where both gravity and a rod are on, none else.
"""
ALGEBRAIC = {
    "beatup": EFFECTS,
    "rapier": ("head_inertia", "tape_friction"),
    "shedding": ("damping", "dry_friction", "coil"),
}


@pytest.mark.few(2)
@pytest.mark.parametrize(("job", "off"), NODES, ids=lambda value: value if isinstance(value, str) else "-".join(value))
def test_a_scene_of_algebraic_effects_has_not_a_node_more(job, off):
    on = [name for name in ALGEBRAIC[job] if name not in off]
    scene = functools.reduce(lambda scene, name: scene.with_effect(name), on, lo.load(job))
    values, system = registry.of(scene), systems.casadi()
    sampler = values.sampler(scene, values.today(scene))
    model, phi = sampler.model, ca.SX.sym("phi")
    numbers = {name: ca.SX.sym(name) for name in values.numbers(scene)}
    given = model.given(system, {**sampler.hints, **numbers})
    graphs = [*model.corners(system, given), *model.static(system, given, sampler.stills).values()]
    for piece in range(sampler.cycle.pieces):
        node = Node(phi, {DATUM: 0.0, **sampler.cycle.switch(piece)})
        graphs += [model.quantity(system, given, name, node) for name in model._quantities]
    whole = ca.Function("whole", [phi, *numbers.values()], [ca.vertcat(*map(ca.SX, graphs))])
    assert whole.n_nodes() == NODES[job, off]


def test_other_number_systems_refuse_a_speed_of_its_own():
    sampler = sampler_of(ON)
    with pytest.raises(TypeError):
        sampler.read(systems.mpmath(40)).quantity("peak_torque", systems.mpmath(40).number(1.0), {})
