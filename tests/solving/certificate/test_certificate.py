"""The certificate, tried by points that only look optimal: each is refused, with a reason."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from support import toy

import loomopt as lo
from loomopt.jobs import registry
from loomopt.solving.certificate import certificate as certificates
from loomopt.solving.certificate.certificate import certify
from loomopt.solving.certificate.taylor_bounds import scan_excess
from reference.beatup import DESIGN, Machine, least, random_designs

JOB = registry.find("beatup")
ACCURACY = 1e-8


def scene_of(M0):
    return lo.load("beatup").set("operation.M0", f"{M0} N*m")


def certificate_of(scene, target, design):
    """Return the certificate of a design (SI) as the optimum of a scene's target."""
    program = JOB.program(scene, target)
    return certify(program, JOB.values(program, design), ACCURACY)


def refused(certificate, reason):
    """Assert that a certificate did not pass, for a reason that names what is wrong."""
    assert not certificate.passed
    assert any(reason in message for message in certificate.reasons), certificate.reasons


@pytest.fixture(scope="module")
def best():
    return {M0: lo.solve(scene_of(M0)).design for M0 in (600, 745, 800, 900)}


# The loom's own optima, spoilt -----------------------------------------------------------------------------------


@pytest.mark.few(2)
@pytest.mark.parametrize("M0", [600, 745, 800, 900])
def test_the_optimum_itself_passes(best, M0):
    certificate = certificate_of(scene_of(M0), "balance", best[M0])
    assert certificate.passed, certificate.reasons
    assert certificate.feasibility <= 1e-9
    assert max(level.stationarity for level in certificate.levels) <= 1e-6
    assert certificate.minimum


@pytest.mark.parametrize(("name", "step"), [("l1", -1.67e-7), ("l4", 1.67e-7), ("m4e", -1e-6 * 12.4)])
def test_a_limit_exceeded_by_a_millionth_is_seen(best, name, step):
    design = best[600] | {name: best[600][name] + step, "r4e": 0.08}
    certificate = certificate_of(scene_of(600), "balance", design)
    refused(certificate, " is exceeded by ")
    assert certificate.feasibility >= 1e-7, "a hundred times what is allowed, whatever a row's scale"


def test_a_figure_exceeded_by_a_millionth_is_seen(best):
    scene = scene_of(745).set("limits.swing.max", f"{math.radians(23.4) - 1e-6!r} rad")
    refused(certificate_of(scene, "balance", best[745]), "limit swing is exceeded by 1e-06")


@pytest.mark.parametrize("M0", [600, 745, 800, 900])
@pytest.mark.parametrize("size", [1e-6, 1e-4, 1e-2])
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.few(18)
def test_a_perturbed_optimum_never_passes(best, M0, size, seed):
    """All lengths and the counterweight moved at random, by no common factor: outside, or off the limits that bind."""
    steps = np.random.default_rng(seed).uniform(0.3, 1.0, 5) * [1, -1, 1, -1, 1] * (-1) ** seed
    design = {name: best[M0][name] + size * 0.167 * step for name, step in zip(DESIGN, steps, strict=False)}
    design |= {"m4e": max(0.0, best[M0]["m4e"] + size * 12.4 * steps[4]), "r4e": best[M0]["r4e"]}
    certificate = certificate_of(scene_of(M0), "balance", design)
    assert not certificate.passed
    assert certificate.reasons


@pytest.mark.parametrize("M0", [800, 900])
def test_a_common_factor_of_the_lengths_within_its_bounds_is_no_perturbation(best, M0):
    """No angle changes and no limit is crossed: as good a design, though not the one the silent levels choose."""
    scaled = {name: best[M0][name] * (1 - 1e-3) for name in ("l1", "l2", "l3", "l4")}
    certificate = certificate_of(scene_of(M0), "balance", best[M0] | scaled)
    assert certificate.passed, certificate.reasons
    assert not certificate.unique


@pytest.mark.parametrize(
    ("M0", "key", "value"),
    [
        (745, "limits.swing", "23.3 deg"),
        (745, "limits.theta", "2 deg"),
        (745, "bounds.l1", "30.2 mm"),
        (745, "bounds.l4", "166 mm"),
        (800, "limits.theta", "2.19 deg"),
        (800, "bounds.m4e", "12 kg"),
        (900, "limits.mu_min.min", "56.6 deg"),
        (600, "bounds.l1", "30.001 mm"),
    ],
)
@pytest.mark.few(2)
def test_the_best_of_a_tighter_limit_is_not_the_best(M0, key, value):
    """The optimum moved along all other active limits, each of them still held exactly."""
    fixed = {"min": value, "max": value} if key.startswith("limits") and key.count(".") == 1 else value
    tighter = lo.solve(scene_of(M0).set(key, fixed))
    assert tighter.status == "optimal"
    figure = "M3_fdc" if M0 in (600, 900) else "peak_torque"
    refused(certificate_of(scene_of(M0), "balance", tighter.design), f"{figure} can still fall")


def test_the_optimum_of_another_resistance_is_refused(best):
    for M0, other in ((745, 800), (800, 745), (900, 600), (600, 900)):
        refused(certificate_of(scene_of(M0), "balance", best[other]), "can still fall")


def test_an_optimum_of_36_points_is_refused():
    """Between the points the peak stands higher, and another design has a lower one; two limits are far here, so that
    the peak itself decides the lengths."""
    scene = scene_of(745).update({"limits.theta.min": "-20 deg", "limits.theta.max": "20 deg"})
    scene, coarse = scene.set("limits.mu_min.min", "30 deg"), np.linspace(0, 2 * np.pi, 36, endpoint=False)
    machine = Machine(scene)
    room = [lambda d: 0.0745 - machine.static(d)["M3_fdc"] / 100, lambda d: 0.0745 + machine.static(d)["M3_fdc"] / 100]
    results = [least(machine, "peak_torque", start, room, offsets=coarse) for start in random_designs(machine, 3, 0)]
    design = next(design for design in results if design)
    refused(certificate_of(scene, "torque", design), "peak_torque can still fall")


def test_a_peak_held_at_36_points_only_is_seen(best):
    """A limit set to the largest of 36 samples is exceeded between them."""
    machine = Machine(scene_of(745))
    beta = machine.static(best[745])["beta"]
    sampled = np.abs(machine.torques(best[745], beta + np.linspace(0, 2 * np.pi, 36, endpoint=False))[1])
    sampled = float(sampled.max())
    assert sampled < machine.peaks(best[745])["peak_torque"] * (1 - 1e-5)
    scene = scene_of(745).set("limits.peak_torque.max", f"{sampled!r} N*m")
    refused(certificate_of(scene, "balance", best[745]), "limit peak_torque is exceeded")
    assert not next(k for k in lo.evaluate(scene, best[745]).limits if k.name == "peak_torque").ok


@pytest.mark.parametrize("target", ["balance", "pulse", "torque", "retrofit"])
def test_admissible_designs_drawn_at_random_are_refused(target):
    scene = lo.load("beatup-light").update({"limits.theta.max": "8 deg", "limits.mu_min.min": "45 deg"})
    machine = Machine(scene)
    for design in random_designs(machine, 5, 4):
        assert not certificate_of(scene, target, design).passed


@pytest.mark.parametrize("design", [{"l1": 31, "l2": 65, "l3": 155}, {"l1": 30, "l2": 84, "l3": 151}])
def test_designs_of_the_source_are_not_optimal(design):
    lengths = {name: 1e-3 * value for name, value in design.items()} | {"l4": 0.167, "m4e": 0.0, "r4e": 0.0}
    refused(certificate_of(scene_of(600), "balance", lengths), "M3_fdc can still fall")


# Toys: minimum, maximum, saddle ----------------------------------------------------------------------------------


def square(x, y=0.0):
    return {"f": lambda v: (v["x"] - x) ** 2 + (v["y"] - y) ** 2}


Rows = dict[str, Callable[[dict[str, float]], float]]
Limits = tuple[tuple[str, int, float], ...]
PASS: dict[str, tuple[Rows, Limits, dict[str, float], bool]] = {
    "a bowl's bottom": (square(1.0, 2.0), (), {"x": 1.0, "y": 2.0}, True),
    "a valley's floor": ({"f": lambda v: v["x"] ** 2}, (), {"x": 0.0, "y": 3.0}, False),
    "a corner of two limits": (
        {"f": lambda v: v["x"] + v["y"]},
        (("x", -1, 1.0), ("y", -1, 2.0)),
        {"x": 1, "y": 2},
        True,
    ),
    "the top of a hill, held by a limit": (
        {"f": lambda v: -(v["x"] ** 2) + v["y"] ** 2},
        (("x", 1, 1.0),),
        {"x": 1, "y": 0},
        True,
    ),
    "a limit that curves more than the objective": (
        {"f": lambda v: v["x"] - 0.1 * v["y"] ** 2, "g": lambda v: v["y"] ** 2 - v["x"]},
        (("g", 1, 0.0),),
        {"x": 0.0, "y": 0.0},
        True,
    ),
    "an equality, price of either sign": (
        {"f": lambda v: (v["x"] + 3) ** 2 + v["y"] ** 2},
        (("x", 0, 1.0),),
        {"x": 1, "y": 0},
        True,
    ),
    "the same limit twice": (
        {"f": lambda v: v["x"] + v["y"] ** 2, "h": lambda v: 2 * v["x"]},
        (("x", -1, 0.0), ("h", -1, 0.0)),
        {"x": 0, "y": 0},
        True,
    ),
}
CURVES = "second order fails"
SLOPE, DROP = {"f": lambda v: v["x"] + v["y"] ** 2}, {"f": lambda v: v["x"] - v["y"] ** 2}
REFUSED: dict[str, tuple[Rows, Limits, dict[str, float], str]] = {
    "a maximum": ({"f": lambda v: -(v["x"] ** 2) - v["y"] ** 2}, (), {"x": 0, "y": 0}, CURVES),
    "a saddle": ({"f": lambda v: v["x"] ** 2 - v["y"] ** 2}, (), {"x": 0, "y": 0}, CURVES),
    "a saddle along an active limit": (DROP, (("x", -1, 0.0),), {"x": 0, "y": 0}, CURVES),
    "a limit that curves less than the objective": (
        {"f": lambda v: v["x"] - 2 * v["y"] ** 2, "g": lambda v: v["y"] ** 2 - v["x"]},
        (("g", 1, 0.0),),
        {"x": 0, "y": 0},
        CURVES,
    ),
    "a slope": (SLOPE, (), {"x": 0, "y": 0}, "f can still fall"),
    "the wrong side of a limit": (SLOPE, (("x", 1, 0.0),), {"x": 0, "y": 0}, "f can still fall"),
    "off a bowl's bottom by 1e-5": (square(0.0), (), {"x": 1e-5, "y": 0}, "f can still fall"),
    "a limit exceeded by 1e-6": (square(2.0), (("x", 1, 1.0),), {"x": 1 + 1e-6, "y": 0}, "limit x is exceeded"),
    "an equality missed by 1e-6": (square(2.0), (("x", 0, 1.0),), {"x": 1 - 1e-6, "y": 0}, "limit x is exceeded"),
    "short of its limit": (SLOPE, (("x", -1, 0.0),), {"x": 5e-8, "y": 0}, "carries a price"),
    "far from its limit": (SLOPE, (("x", -1, 0.0),), {"x": 1e-3, "y": 0}, "f can still fall"),
}  # fmt: skip


def toy_of(rows, limits):
    return toy.program("xy", rows, limits=limits)


@pytest.mark.parametrize("name", PASS)
def test_a_minimum_passes(name):
    rows, limits, x, unique = PASS[name]
    certificate = certify(toy_of(rows, limits), {k: float(v) for k, v in x.items()}, ACCURACY)
    assert certificate.passed, certificate.reasons
    assert certificate.unique == unique


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_minimum_is_refused(name):
    rows, limits, x, reason = REFUSED[name]
    refused(certify(toy_of(rows, limits), {k: float(v) for k, v in x.items()}, ACCURACY), reason)


WAVE = {"w": lambda m, v, phi: v["x"] + m.cos(phi)}
"""Its peak is 1 + |x|: least at x = 0, where both ends touch."""


@pytest.mark.parametrize(("x", "passes"), [(0.0, True), (1e-4, False), (-0.3, False)])
def test_a_peak_is_least_where_its_pieces_balance(x, passes):
    certificate = certify(toy.program("x", waves=WAVE, objectives=("peak w",)), {"x": x}, ACCURACY)
    assert certificate.passed == passes


def test_an_extreme_that_moves_with_the_design_curves_the_objective():
    """The peak of |x cos + y sin| is the hypotenuse: at (1, 0) it falls toward the origin, not along y."""
    waves = {"w": lambda m, v, phi: v["x"] * m.cos(phi) + v["y"] * m.sin(phi)}
    program = toy.program("xy", {"x": lambda v: v["x"]}, waves, (("x", -1, 1.0),), ("peak w",))
    assert certify(program, {"x": 1.0, "y": 0.0}, ACCURACY).passed
    assert certify(program, {"x": 1.0, "y": 0.0}, ACCURACY).unique
    refused(certify(program, {"x": 1.0, "y": 1e-3}, ACCURACY), "w can still fall")


LEVELS = {"a": lambda v: v["x"] - 1, "b": lambda v: (v["x"] - 3) ** 2 + (v["y"] - 2) ** 2}


@pytest.mark.parametrize(
    ("x", "y", "reason"), [(1.0, 2.0, None), (1.0, 1.0, "b can still fall"), (1.1, 2.0, "a can still fall")]
)
def test_a_later_level_may_not_pay_with_an_earlier_one(x, y, reason):
    program = toy.program("xy", LEVELS, objectives=("|a|", "b"))
    certificate = certify(program, {"x": x, "y": y}, ACCURACY)
    assert certificate.passed == (reason is None), certificate.reasons
    if reason:
        refused(certificate, reason)
    else:
        assert certificate.levels[1].higher_levels == pytest.approx(4.0, rel=1e-6), "slope of b along x: 2 (3 - 1)"


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_point_that_is_no_number_never_passes(bad):
    with np.errstate(invalid="ignore"):
        try:
            passed = certify(toy_of(square(0.0), ()), {"x": bad, "y": 0.0}, ACCURACY).passed
        except (ValueError, OverflowError, np.linalg.LinAlgError):
            passed = False
    assert not passed


# Thresholds -------------------------------------------------------------------------------------------------------


def leaning(price):
    """Return: least price · x − y² held by x ≥ 0 (in units of its scale), at 0."""
    return toy.program("xy", {"f": lambda v: price * v["x"] + v["y"] ** 2}, limits=(("x", -1, 0.0),))


@pytest.mark.parametrize(("price", "passes"), [(0.99e6, True), (1.01e6, False)])
def test_a_price_beyond_measure_is_no_kkt_point(price, passes):
    certificate = certify(leaning(price), {"x": 0.0, "y": 0.0}, ACCURACY)
    assert certificate.passed == passes
    if not passes:
        refused(certificate, "the price of limit x is too large: 1")


@pytest.mark.parametrize(("far", "passes"), [(0.99e8, True), (1.01e8, False)])
def test_a_design_out_of_all_proportion_is_not_trusted(far, passes):
    program = toy.program("xy", {"f": lambda v: (v["x"] - far) ** 2 + v["y"] ** 2}, bounds={"x": (0.0, 1e9)})
    assert certify(program, {"x": far, "y": 0.0}, ACCURACY).passed == passes


@pytest.mark.parametrize(("short", "passes"), [(0.9e-8, True), (1.1e-8, False)])
def test_a_limit_that_is_not_met_may_carry_no_price(short, passes):
    certificate = certify(leaning(1.0), {"x": short, "y": 0.0}, ACCURACY)
    assert certificate.passed == passes
    assert certificate.levels[0].complementarity == pytest.approx(short, rel=1e-6)


@pytest.mark.parametrize(("beyond", "passes"), [(0.9e-9, True), (1.1e-9, False)])
def test_a_limit_holds_to_a_billionth(beyond, passes):
    assert certify(leaning(1.0), {"x": -beyond, "y": 0.0}, ACCURACY).passed == passes


@pytest.mark.parametrize(("slope", "passes"), [(0.9e-6, True), (1.1e-6, False)])
def test_a_slope_of_a_millionth_is_none(slope, passes):
    program = toy.program("x", {"f": lambda v: v["x"] ** 2 / 2 + slope * v["x"]})
    certificate = certify(program, {"x": 0.0}, ACCURACY)
    assert certificate.passed == passes
    assert certificate.levels[0].stationarity == pytest.approx(slope, rel=1e-6)


@pytest.mark.parametrize(("price", "binds"), [(0.9e-8, False), (1.1e-8, True)])
def test_a_limit_with_next_to_no_price_does_not_bind(price, binds):
    assert bool(certify(leaning(price), {"x": 0.0, "y": 0.0}, ACCURACY).binding) == binds


def test_a_draft_is_the_certificate_but_for_what_lies_between_the_points(best, monkeypatch):
    """The dense scan is made when the whole certificate is asked for, once."""
    program, scans, scan = JOB.program(scene_of(745), "balance"), [], scan_excess
    x = JOB.values(program, best[745])

    def counted(*arguments):
        scans.append(1)
        return scan(*arguments)

    monkeypatch.setattr(certificates, scan_excess.__name__, counted)
    draft = certificates.draft_certificate(program, x, ACCURACY)
    assert (scans, draft.partial.passed, draft.partial.violation) == ([], True, 0.0)
    assert draft.with_rules(()) is draft
    message = draft.with_rules(("a rule",))
    assert (message.partial.tie_breaks, message.whole.tie_breaks) == (("a rule",), ("a rule",))
    assert draft.whole is draft.whole
    assert len(scans) == 2
    assert replace(message.whole, tie_breaks=()) == draft.whole == certify(program, x, ACCURACY)
