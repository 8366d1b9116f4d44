"""Where an earlier level stays least: how it bends, third derivatives, and what is flat along it."""

import numpy as np
import pytest
from support import inch, toy

import loomopt as lo
from loomopt.jobs import registry
from loomopt.solving.certificate.certificate import SECOND_ORDER_OPEN, certify, certify_by, certify_levels
from loomopt.solving.certificate.derivatives import JetDerivatives
from loomopt.solving.certificate.derivatives_mp import MpmathDerivatives
from loomopt.solving.certificate.kkt import active_set
from loomopt.solving.certificate.second_order import PROBES, FeasibleCurve, Lagrangian, Local
from loomopt.studies.front import front
from loomopt.studies.front.solver import Subproblem

both = pytest.mark.parametrize("derivatives", [JetDerivatives, MpmathDerivatives])


def local_by(derivatives, program, x):
    sampler = toy.Sampler(program.model, {**program.parameters, **x})
    active = active_set(program, sampler)
    result = derivatives(program, x, sampler, active.rows)
    return Local(program, x, sampler, active, result, result.gradients())


# Third derivatives --------------------------------------------------------------------------------------------------


@both
def test_third_derivatives_of_polynomials(derivatives):
    """x² y along x, then x and y; scales 2 and 3 count."""
    program = toy.program("xy", {"f": lambda v: v["x"] ** 2 * v["y"] + v["y"] ** 5}, sizes={"x": 2.0, "y": 3.0})
    result = local_by(derivatives, program, {"x": 0.3, "y": 0.4}).derivatives
    thirds, errors = result.thirds(np.array([1.0, 0.0]), np.eye(2))
    expected = np.array([[0.0, 2 * 4 * 3], [2 * 4 * 3, 0.0]])
    assert thirds[-1] == pytest.approx(expected, rel=1e-11, abs=1e-10)
    assert np.abs(thirds[-1] - expected).max() <= errors[-1] + 1e-15
    along_y, _ = result.thirds(np.array([0.0, 1.0]), np.eye(2))
    assert along_y[-1] == pytest.approx(np.array([[2 * 4 * 3, 0.0], [0.0, 60 * 0.4**2 * 27]]), rel=1e-11, abs=1e-9)


def tilted(m, v, phi):
    """Its top is r = x + y² + x³ y at phi = 3 y + x², and there it curves by r."""
    return (v["x"] + v["y"] ** 2 + v["x"] ** 3 * v["y"]) * m.cos(phi - 3 * v["y"] - v["x"] ** 2)


@both
def test_third_derivatives_of_a_peak_are_those_of_its_top_wherever_it_moves(derivatives):
    program = toy.program("xy", {}, {"w": tilted}, objectives=("peak w",))
    x, y = 1.2, 0.4
    local = local_by(derivatives, program, {"x": x, "y": y})
    row = local.active.levels[0][0]
    ahead, _ = local.derivatives.thirds(np.array([1.0, 0.0]), np.eye(2))
    along, errors = local.derivatives.thirds(np.array([0.0, 1.0]), np.eye(2))
    assert ahead[row] == pytest.approx(np.array([[6 * y, 6 * x], [6 * x, 0.0]]), rel=1e-9, abs=1e-9)
    assert along[row] == pytest.approx(np.array([[6 * x, 0.0], [0.0, 0.0]]), rel=1e-9, abs=1e-9)
    assert errors[row] < 1e-8


@pytest.mark.few(1)
@pytest.mark.parametrize("effect", [None, "shaft_torsion"])
def test_third_derivatives_in_floats_are_those_of_40_digits_to_their_own_error(effect):
    scene = lo.load("beatup").with_effect(effect) if effect else lo.load("beatup")
    job = registry.of(scene)
    program = job.program(scene, "balance")
    x = {v.name: value for v in program.variables for value in [program.starts[0][v.name]]}
    quick, exact = (local_by(item, program, x).derivatives for item in (JetDerivatives, MpmathDerivatives))
    line, basis = np.eye(len(quick.names))[0], np.eye(len(quick.names))[:, 1:3]
    (first, error), (second, _) = quick.thirds(line, basis), exact.thirds(line, basis)
    assert np.abs(second).max() > 1.0
    assert np.all(np.abs(first - second).max(axis=(1, 2)) <= 10 * error + 1e-9 * np.abs(second).max(axis=(1, 2)))


# How a valley bends -------------------------------------------------------------------------------------------------


def valley(pull, values, fourth=0.0, bend=1.0, higher=0.0):
    """On a = b² + c b³, where f is least, g = own b² − p a + fourth b⁴."""
    rows = {
        "f": lambda v: bend * (v["a"] - v["b"] ** 2 - higher * v["b"] ** 3) ** 2,
        "g": lambda v: values * v["b"] ** 2 - pull * v["a"] + fourth * v["b"] ** 4,
    }
    return toy.program("ab", rows, objectives=("f", "g"))


def second(program, derivatives=JetDerivatives, **x):
    """Return what second order says of the second level."""
    return certify_levels(local_by(derivatives, program, x))[1].curvature


@both
@pytest.mark.parametrize("bend", [1.0, 1e-2, 1e-4])
def test_a_curvature_that_following_a_valley_cancels_is_none(derivatives, bend):
    """3 b² − 3 a is 0 all along a = b²: by differences of 3e-3 its sign was chance."""
    result = second(valley(3.0, 3.0, bend=bend), derivatives, a=0.0, b=0.0)
    assert (result.minimum, result.unique, result.higher) == (True, False, "holds")
    assert result.error < 4e-9 / bend


@pytest.mark.parametrize("turn", [0.0, 0.4, 1.3])
@pytest.mark.parametrize("size", [1.0, 25.4, 1e-3])
def test_the_verdict_is_the_same_turned_and_in_other_units(turn, size):
    """exp(a) in place of a: every derivative counts; the valley is a = log(1 + b²) and g = b² + 1 − exp(a) is 0."""
    c, s = np.cos(turn), np.sin(turn)

    def a(v):
        return (c * v["x"] + s * v["y"]) / size

    def b(v):
        return (c * v["y"] - s * v["x"]) / size

    formulas = {
        "f": lambda m, v: (m.exp(a(v)) - 1 - b(v) ** 2) ** 2,
        "g": lambda m, v: b(v) ** 2 + 1 - m.exp(a(v)),
    }
    program = toy.program("xy", formulas=formulas, objectives=("f", "g"), sizes={"x": size, "y": size})
    certificate = certify(program, {"x": 0.0, "y": 0.0}, 1e-8)
    assert (certificate.reasons, certificate.minimum, certificate.unique) == ((), True, False)


@pytest.mark.parametrize("less", [3e-7, 1e-5, 1e-3, 1.0])
def test_a_true_saddle_along_a_valley_is_still_found(less):
    """g = −less b² along it: smaller than the differences erred by that decided before."""
    certificate = certify(valley(3.0, 3.0 - less), {"a": 0.0, "b": 0.0}, 1e-8)
    assert not certificate.minimum
    assert any("saddle" in reason for reason in certificate.reasons)


@pytest.mark.parametrize("more", [3e-7, 1e-5, 1e-3, 1.0])
def test_a_level_that_rises_along_a_valley_has_a_single_design(more):
    certificate = certify(valley(3.0, 3.0 + more), {"a": 0.0, "b": 0.0}, 1e-8)
    assert (certificate.reasons, certificate.unique) == ((), True)


@pytest.mark.parametrize(("fourth", "reasons"), [(1.0, ()), (0.0, ()), (-1.0, (SECOND_ORDER_OPEN,))])
def test_higher_orders_are_read_along_the_valley(fourth, reasons):
    """g = fourth b⁴ there, while along the straight line b it is 3 b²."""
    certificate = certify(valley(3.0, 3.0, fourth), {"a": 0.0, "b": 0.0}, 1e-8)
    assert certificate.reasons == reasons
    assert certificate.minimum


def test_a_fall_of_third_order_along_the_valley_is_no_optimum():
    """g = −3 c b³ on a = b² + c b³."""
    assert certify(valley(3.0, 3.0, higher=0.5), {"a": 0.0, "b": 0.0}, 1e-8).reasons == (SECOND_ORDER_OPEN,)


@both
@pytest.mark.parametrize(("pull", "minimum"), [(0.9, True), (1.1, False)])
def test_a_valley_bends_with_the_rows_that_bind(derivatives, pull, minimum):
    """Where r = 1 and q = 0, f is least at c = a², and g = (1 − p) a² there; q makes b follow both."""
    rows = {
        "f": lambda v: (v["c"] - v["a"] ** 2) ** 2 * (1 + v["b"]) - v["r"],
        "g": lambda v: v["c"] - pull * v["a"] ** 2,
        "q": lambda v: v["a"] ** 2 + v["b"] ** 2 + v["a"] * v["c"] - v["r"],
    }
    program = toy.program("abcr", rows, limits=(("q", 0, 0.0), ("r", 1, 1.0)), objectives=("f", "g"))
    result = second(program, derivatives, a=0.0, b=1.0, c=0.0, r=1.0)
    assert result.minimum == minimum


@pytest.mark.parametrize(
    ("falls", "verdict"),
    [
        ((7e-12, 3e-11), "holds"),
        ((9e-10, 2e-11), "open"),
        ((3e-8, 3e-11), "open"),
        ((3e-8, 3e-9), "falls"),
        ((7e-12, 0.0), "holds"),
    ],
    ids=["by chance", "of third order", "known once", "known", "at one step alone"],
)
def test_a_fall_within_a_valleys_error_is_doubted_only_if_it_grows_as_a_fall_does(monkeypatch, falls, verdict):
    """Falls at steps of 1e-2 and 3e-3, of designs along a valley that is known to 1e-9."""
    fall = dict(zip(PROBES, falls, strict=True))
    curve = object.__new__(FeasibleCurve)
    monkeypatch.setattr(FeasibleCurve, "_lowest", lambda self, lagrangian, step, way: [{"x": step}])
    monkeypatch.setattr(FeasibleCurve, "_value_error", 1e-9)
    monkeypatch.setattr(FeasibleCurve, "_keeps_limits", lambda self, x: True)
    lagrangian = Lagrangian(valley(1.0, 0.0), {"x": 0.0}, 0, {}, {})
    monkeypatch.setattr(Lagrangian, "value", lambda self, there: -fall.get(there["x"], 0.0))
    assert curve.verdict(lagrangian, np.zeros(1), 0.0) == verdict


def test_an_error_that_reaches_the_threshold_is_no_saddle():
    """Where f curves by 2e-6 only and the design is 1e-4 beside its least, nothing is known of g to 1e-7."""
    program = valley(3.0, 3.0 - 1e-5, bend=1e-6)
    result = second(program, MpmathDerivatives, a=1e-4, b=0.0)
    assert result.error > 1e-5
    assert result.minimum
    assert second(program, MpmathDerivatives, a=0.0, b=0.0).minimum is False
    assert not certify_by(JetDerivatives, program, {"a": 1e-4, "b": 0.0}, 1e-8).clear


# Machines -----------------------------------------------------------------------------------------------------------

LIGHT = {
    "bounds.l1": {"min": "15 mm", "max": "70 mm"},
    "bounds.l2": {"min": "30 mm", "max": "170 mm"},
    "bounds.l3": {"min": "70 mm", "max": "340 mm"},
    "bounds.l4": {"min": "75 mm", "max": "334 mm"},
    "operation.M0": "900 N*m",
    "limits.theta": {"min": "1 deg", "max": "5 deg"},
}
LEAST = {
    "l1": 0.01972459579110323,
    "l2": 0.09965313607981449,
    "l3": 0.10165368388513861,
    "l4": 0.15474073511444789,
    "m4e": 6.154486196934076,
    "r4e": 0.08,
}
"""Where pulse_rms is least: m4e is what its curvature leaves, at any common scale of the four links."""


@pytest.mark.parametrize("make", [lo.load, inch.scene])
def test_a_common_scale_that_neither_level_sees_is_left_open(make):
    """Both levels are level along it; differences said that m4e rises, by 8e-6, and called the design unique."""
    scene = make("beatup-light").update(LIGHT).with_effect("shaft_torsion")
    study = front.trade(scene, ("pulse_rms", "m4e"), None, points=3)
    program = study.solver.program(Subproblem(0, (None, None), 2))
    certificate = certify(program, LEAST, 1e-8)
    assert (certificate.reasons, certificate.minimum, certificate.unique) == ((), True, False)
    assert certificate.by == "jets"


WIDE = {
    "bounds.l1": {"min": "7.5 mm", "max": "140 mm"},
    "bounds.l2": {"min": "15 mm", "max": "340 mm"},
    "bounds.l3": {"min": "35 mm", "max": "680 mm"},
    "bounds.l4": {"min": "37.5 mm", "max": "668 mm"},
    "operation.M0": "800 N*m",
    "limits.swing": {"min": "22.9 deg", "max": "30 deg"},
    "limits.r4.max": "1 m",
}
"""The limit on r4, far off, makes mass and radius variables apart."""
TURNED = {
    "l1": 0.0075,
    "l2": 0.10112106326180603,
    "l3": 0.03901928207970865,
    "l4": 0.11666870048343565,
    "m4e": 9.124690795104058,
    "r4e": 0.06562554412133477,
}
"""Where pulse_rms is least, then peak_torque: m4e r4e² is held by the curvature of the first."""


@pytest.mark.slow
@pytest.mark.parametrize("make", [lo.load, inch.scene])
def test_a_counterweight_of_which_only_its_inertia_counts_is_no_saddle(make):
    """Along m4e r4e² both levels are level, while either's straight line bends by 0.15: differences left −4e-5."""
    scene = make("beatup").update(WIDE).with_effect("shaft_torsion", "rod_inertia")
    study = front.trade(scene, ("pulse_rms", "peak_torque"), "pulse", points=3)
    certificate = certify(study.solver.program(Subproblem(0, (None, None), 2)), TURNED, 1e-8)
    assert (certificate.reasons, certificate.minimum, certificate.unique) == ((), True, False)
