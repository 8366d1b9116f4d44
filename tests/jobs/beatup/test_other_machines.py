"""Machines other than the source's: every answer judged by physics written out a second time."""

import math
from typing import Any

import numpy as np
import pytest
from support import slow

import loomopt as lo
from reference.beatup import DESIGN, LENGTHS, Machine, dead_centres, least, least_peak, motion, random_designs

TARGETS = ("balance", "pulse", "torque", "retrofit")
draws = pytest.mark.parametrize("seed", slow.after(3, range(10)))
INCHES = {
    "l1": ("1.5 in", "1.3 in", "1.7 in"),
    "l2": ("3.25 in", "2.9 in", "3.6 in"),
    "l3": ("7.75 in", "7 in", "8.5 in"),
    "l4": ("8.375 in", "7.6 in", "8.375 in"),
}


def inch_scene():
    """A loom in inches and pounds, 420 rpm, no counterweight."""
    return lo.scene(
        {
            "problem": {"name": "inches", "job": "beatup", "title": "a loom in inches", "source": "made up"},
            "operation": {"speed": "420 rpm", "M0": "700 N*m"},
            "mechanism": {name: today for name, (today, _, _) in INCHES.items()},
            "effects": {"inertia": {"J4": "1.1 kg*m^2"}, "resistance": {"pulse": "35 deg"}},
            "bounds": {name: {"min": low, "max": high} for name, (_, low, high) in INCHES.items()},
            "limits": {"swing": {"min": "21 deg", "max": "25 deg"}, "mu_min": {"min": "50 deg"}},
        }
    )


def assert_right(scene, answer):
    """Assert that an answer is certified, and holds every limit and its own figures on a dense grid."""
    assert answer.status == "optimal", answer.message
    assert answer.certificate.passed
    machine = Machine(scene, answer.design)
    design = {name: answer.design[name] for name in DESIGN}
    assert machine.excess(design) <= 1e-9
    figures = machine.figures(design)
    for name in (
        "M3_fdc",
        "peak_torque",
        "swing",
        "mu_min",
        "alpha_fdc",
        "pulse_rms",
        "reed_centrifugal",
        "shaking_force",
    ):
        if answer.figures.get(name) is not None:
            assert answer.figures[name] == pytest.approx(figures[name], rel=1e-6, abs=1e-6), name
    return machine


@pytest.mark.few(2)
@pytest.mark.parametrize("target", TARGETS)
def test_a_loom_in_inches_without_counterweight(target):
    answer = lo.solve(inch_scene(), target, starts=1)
    assert_right(inch_scene(), answer)
    assert answer.design["m4e"] == 0.0
    assert "in" in answer.table()["unit"].to_list()


@pytest.mark.few(2)
@pytest.mark.parametrize(("how", "target"), slow.grid(["one value", "equal ends", "left out", "not freed"], TARGETS))
def test_a_frame_that_is_fixed_stays(how, target):
    scene, today = lo.load("beatup"), "165 mm"
    scene = scene.set("mechanism.l4", today)
    if how == "one value":
        scene = scene.set("bounds.l4", today)
    elif how == "equal ends":
        scene = scene.set("bounds.l4", {"min": today, "max": today})
    elif how == "not freed":
        scene = scene.set("bounds.l4.free", False)
    else:
        bounds = {name: table for name, table in scene.document["bounds"].items() if name != "l4"}
        scene = lo.scene({**scene.document, "bounds": bounds})
    answer = lo.solve(scene, target, starts=1)
    assert_right(scene, answer)
    assert answer.design["l4"] == 0.165


@pytest.mark.few(3)
@pytest.mark.parametrize("changes", [{"m4e": "3 kg", "r4e": "50 mm"}, {"m4e": "0 kg", "r4e": "0 mm"}], ids=str)
@pytest.mark.parametrize("target", TARGETS)
def test_a_counterweight_that_is_not_bounded_stays(changes, target):
    scene = lo.load("beatup").update({f"mechanism.{name}": value for name, value in changes.items()})
    bounds = {name: table for name, table in scene.document["bounds"].items() if name not in changes}
    scene = lo.scene({**scene.document, "bounds": bounds})
    answer = lo.solve(scene, target, starts=1)
    assert_right(scene, answer)
    assert answer.design["m4e"] == scene.mechanism["m4e"]
    assert answer.design["r4e"] == scene.mechanism["r4e"]


FREED = {
    "J4": ("0.5 kg*m^2", "0.9 kg*m^2"),
    "M0": ("700 N*m", "900 N*m"),
    "speed": ("500 rpm", "700 rpm"),
    "pulse": ("25 deg", "35 deg"),
    "tilt": ("-90 deg", "90 deg"),
    "s2": ("10 mm", "60 mm"),
    "coulomb": ("0 N*m", "5 N*m"),
    "m4": ("50 kg", "60 kg"),
    "r4": ("40 mm", "50 mm"),
}


@pytest.mark.parametrize(("target", "name"), slow.grid(["balance", "torque"], FREED))
@pytest.mark.few(2)
def test_any_number_of_the_scene_may_be_bounded(name, target):
    scene = lo.load("beatup").with_effect("gravity").with_effect("rod_inertia").with_effect("bearing_friction")
    low, high = FREED[name]
    scene = scene.set(f"targets.{target}.indifference", "0")
    fixed = lo.solve(scene, target, starts=1)
    scene = scene.set(f"bounds.{name}", {"min": low, "max": high})
    answer = lo.solve(scene, target, starts=1)
    assert_right(scene, answer)
    bound = scene.bounds[name]
    assert bound.min * (1 - 1e-12) - 1e-12 <= answer.design[name] <= bound.max * (1 + 1e-12) + 1e-12
    assert answer.figures["peak_torque"] <= fixed.figures["peak_torque"] * (1 + 1e-9), "more freedom cannot be worse"


@pytest.mark.slow
def test_a_number_that_changes_nothing_may_be_freed_too():
    """The peak lies outside the pulse, so its length is a flat direction: the best known peak stays the best."""
    scene = lo.load("beatup").set("bounds.pulse", {"min": "25 deg", "max": "35 deg"})
    answer = lo.solve(scene, starts=1)
    assert_right(scene, answer)
    assert answer.figures["peak_torque"] == pytest.approx(88.6894134918, rel=1e-8)


def limited(scene, name, share):
    """Return a scene with a whole-cycle figure held to a share of today's."""
    unit = "N*m" if name == "peak_torque" else "N"
    return scene.set(f"limits.{name}.max", f"{lo.evaluate(scene).figures[name] * share!r} {unit}")


@pytest.mark.few(2)
@pytest.mark.parametrize(
    ("limit", "target"),
    slow.grid(
        [("reed_centrifugal", 0.9), ("shaking_force", 0.95), ("shaking_force", 0.7), ("peak_torque", 0.97)], TARGETS
    ),
)
def test_whole_cycle_limits_hold_at_every_angle(limit, target):
    name, share = limit
    scene = limited(lo.load("beatup").with_effect("centrifugal"), name, share)
    answer = lo.solve(scene, target, starts=1)
    machine = assert_right(scene, answer)
    assert machine.peaks(answer.design)[name] <= scene.limits[name].max * (1 + 1e-9)


@pytest.mark.parametrize(
    ("ends", "target"), slow.grid([(40, 46), (30, 36), (38, 39)], ["balance", "torque", "retrofit"])
)
def test_a_limit_on_the_reeds_eccentricity_parts_mass_and_radius(ends, target):
    low, high = ends
    scene = lo.load("beatup").set("limits.r4", {"min": f"{low} mm", "max": f"{high} mm"})
    assert_right(scene, lo.solve(scene, target, starts=1))


EFFECTS = ("counterweight_inertia", "rocker_inertia", "rod_inertia", "gravity", "bearing_friction", "centrifugal")


@pytest.mark.few(3)
@pytest.mark.parametrize(
    ("target", "effects"), slow.grid(["balance", "torque"], [*((name,) for name in EFFECTS), EFFECTS])
)
def test_effects_of_the_balance(target, effects):
    scene = lo.load("beatup")
    for name in effects:
        scene = scene.with_effect(name)
    assert_right(scene, lo.solve(scene, target, starts=1))


@pytest.mark.few(2)
@pytest.mark.parametrize("target", TARGETS)
def test_the_rod_as_a_rigid_body(target):
    scene = lo.load("beatup").with_effect("rod_inertia").set("effects.rod_inertia.model", "exact")
    assert_right(scene, lo.solve(scene, target, starts=1))


@pytest.mark.few(1)
@pytest.mark.parametrize(
    "changes",
    slow.after(
        4,
        [
            {"operation.M0": "0 N*m"},
            {"operation.speed": "6000 rpm"},
            {"effects.resistance.pulse": "1 deg"},
            {"bounds.l1": {"min": "10 mm", "max": "60 mm"}},
            {"operation.M0": "1000000 N*m"},
            {"operation.speed": "1 rpm"},
            {"operation.speed": "100 rpm"},
            {"effects.resistance.pulse": "120 deg"},
            {"limits.theta": {"min": "-20 deg", "max": "20 deg"}, "limits.mu_min.min": "30 deg"},
        ],
    ),
    ids=str,
)
def test_the_first_level_is_never_traded_for_the_second(changes):
    """However steeply the peak torque would fall: |M3| is the least that SLSQP finds."""
    scene = lo.load("beatup").update(changes).set("targets.balance.indifference", "0")
    answer = lo.solve(scene)
    machine = assert_right(scene, answer)
    size = max(machine.M0, abs(answer.figures["M3_fdc"]))
    ends = [
        least(machine, lambda d: (machine.static(d)["M3_fdc"] / size) ** 2, s) for s in random_designs(machine, 12, 5)
    ]
    theirs = min(abs(machine.static(end)["M3_fdc"]) for end in ends if end)
    assert abs(answer.figures["M3_fdc"]) <= theirs + 1e-7 * size


def synthesised(theta, beta, swing, l4):
    """Return the lengths with these angles, rad [Yuan24, eq 13-15 as corrected]."""
    sweep = math.pi - theta
    l1 = -math.sin(swing / 2) * math.cos(sweep / 2 + beta) / math.sin((sweep - swing) / 2) * l4
    l2 = math.sin(swing / 2) * math.sin(sweep / 2 + beta) / math.cos((sweep - swing) / 2) * l4
    return l1, l2, math.sqrt((l1 + l2) ** 2 - 2 * (l1 + l2) * l4 * math.cos(beta) + l4**2), l4


def random_scene(seed):
    """A random crank-rocker at a random speed, bounds ±10 %, with gravity, friction and the rod on odd seeds."""
    draw = np.random.default_rng(seed).uniform
    while True:
        swing, beta, theta = (math.radians(draw(*ends)) for ends in ((10, 60), (20, 75), (-5, 5)))
        lengths = dict(zip(LENGTHS, synthesised(theta, beta, swing, draw(0.05, 1.5)), strict=True))
        l1, l2, l3, l4 = lengths.values()
        if min(l1, l2) <= 0 or l1 + l4 >= 0.98 * (l2 + l3) or abs(l2 - l3) >= 0.98 * (l4 - l1):
            continue
        cosines = [(l2**2 + l3**2 - (l4 + s * l1) ** 2) / (2 * l2 * l3) for s in (-1, 1)]
        mu = math.degrees(min(math.acos(cosines[0]), math.pi - math.acos(cosines[1])))
        if mu > 25:
            break
    rpm, J4 = draw(60, 900), 10 ** draw(-3, 1) * 30 * l4**2
    front = np.array([dead_centres(l1, l2, l3, l4)[0]])
    M0 = float(J4 * motion(lengths, front)[2][0] * (rpm * math.pi / 30) ** 2 * draw(0.6, 1.5))
    mass, swing = 2 * J4 / l3**2, math.degrees(swing)
    document: dict[str, dict[str, Any]] = {
        "problem": {"name": f"random-{seed}", "job": "beatup", "title": "random", "source": "drawn"},
        "operation": {"speed": f"{rpm!r} rpm", "M0": f"{M0!r} N*m"},
        "mechanism": {name: f"{value!r} m" for name, value in lengths.items()}
        | {"m4": f"{mass!r} kg", "r4": f"{0.4 * l3!r} m"},
        "effects": {"inertia": {"J4": f"{J4!r} kg*m^2"}, "resistance": {"pulse": f"{draw(10, 60)!r} deg"}},
        "bounds": {name: {"min": f"{0.9 * value!r} m", "max": f"{1.1 * value!r} m"} for name, value in lengths.items()}
        | {"m4e": {"min": "0 kg", "max": f"{0.3 * mass!r} kg"}, "r4e": {"min": "0 m", "max": f"{0.5 * l3!r} m"}},
        "limits": {"swing": {"min": f"{0.98 * swing!r} deg", "max": f"{1.02 * swing!r} deg"}}
        | {"mu_min": {"min": f"{mu - 2!r} deg"}},
    }
    if seed % 2:
        document["effects"] |= {
            "gravity": {"tilt": f"{draw(-90, 90)!r} deg", "offset": "5 deg"},
            "bearing_friction": {"coulomb": f"{0.003 * M0!r} N*m", "viscous": "0.01 N*m*s/rad"},
            "rod_inertia": {"m2": f"{0.05 * mass!r} kg", "s2": f"{0.5 * l2!r} m"},
        }
    return lo.scene(document)


@pytest.mark.few(1)
@draws
def test_random_machines_are_optimal_and_slsqp_finds_nothing_better(seed):
    scene = random_scene(seed)
    answer = lo.solve(scene)
    machine = assert_right(scene, answer)
    size, M3 = machine.M0, abs(answer.figures["M3_fdc"])

    def ratio(design):
        return machine.static(design)["M3_fdc"] / size

    starts = random_designs(machine, 6, seed)
    ends = [end for end in (least(machine, lambda d: ratio(d) ** 2, start) for start in starts) if end]
    assert ends
    assert M3 / size <= min(abs(ratio(end)) for end in ends) + 1e-6
    room = [lambda d: M3 / size + 1e-7 - ratio(d), lambda d: M3 / size + 1e-7 + ratio(d)]
    theirs = [least_peak(machine, end, room) for end in ends[:1]]
    for end in filter(None, theirs):
        assert answer.figures["peak_torque"] <= machine.peaks(end)["peak_torque"] * (1 + 1e-5)


@pytest.mark.few(4)
@draws
@pytest.mark.parametrize("target", ["torque", "retrofit", "pulse"])
def test_random_machines_are_optimal_or_honestly_infeasible(seed, target):
    scene = random_scene(seed)
    answer, least_M3 = lo.solve(scene, target, starts=1), abs(lo.solve(scene, starts=1).figures["M3_fdc"])
    room = {"torque": 0.01 * scene.operation["M0"], "retrofit": 0.0, "pulse": math.inf}[target]
    if least_M3 <= room + 1e-9 * scene.operation["M0"]:
        assert_right(scene, answer)
    else:
        assert answer.status == "infeasible"
        assert answer.relaxation
