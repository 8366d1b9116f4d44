"""Optima at the edge: limits said twice, starts at a maximum, flat valleys, clashes by 1e-12, no prices.

Told one by one in docs/hard-cases.md.
"""

import pytest
from support import toy

import loomopt as lo
from loomopt.jobs import registry
from loomopt.solving.certificate.certificate import certify

K1 = 102602.60942535726
"""Least stiffness of the packaged heald frame, N/m, in 30 digits; tests/reference/shedding.py."""
M3_LIGHT = 76.98110208119851
"""Nearest to zero that the light cloth's reed torque comes, N·m."""


def optimal(scene, target=None):
    answer = lo.solve(scene, target, starts=1)
    assert answer.status == "optimal", answer.message
    assert answer.certificate.passed
    assert answer.certificate.feasibility <= 1e-9
    return answer


def certificate_of(scene, design, target):
    job = registry.of(scene)
    program = job.program(scene, target)
    return certify(program, job.values(program, design), 1e-8)


def worths(answer):
    return {(price.limit, price.side): price.worth for price in answer.binding}


# Limits said twice, or for nothing -------------------------------------------------------------------------------

EQUAL_LIMITS = {
    "preload and length of the spring": ("shedding", {"limits.spring_stretch.max": "145.6 mm"}),
    "the same but for 1e-12": ("shedding", {"limits.spring_stretch.max": f"{145.6 * (1 + 1e-12)!r} mm"}),
    "contact and demand": ("shedding", {"limits.contact_min.min": "0 N"}),
    "counterweight and inertia": ("beatup-heavy", {"limits.J4.max": f"{0.62 + 12.4 * 0.08**2!r} kg*m^2"}),
    "far off": ("beatup", {"limits.beta.max": "179 deg", "limits.peak_torque.max": "1e6 N*m"}),
    "far off, of a cam": ("shedding", {"limits.contact_max.max": "1e9 N", "limits.pressure_angle_max.max": "89 deg"}),
    "far off, of a drive": ("rapier", {"limits.sley_mu_min.min": "1 deg", "limits.peak_jerk.max": "1e6 m/rad^3"}),
}


@pytest.mark.parametrize("name", EQUAL_LIMITS)
@pytest.mark.few(2)
def test_a_limit_said_twice_or_for_nothing_changes_nothing(name):
    """Design and figures to 1e-9; the price may stand with either of the two."""
    problem, changes = EQUAL_LIMITS[name]
    once, twice = optimal(lo.load(problem)), optimal(lo.load(problem).update(changes))
    for figure, value in once.figures.items():
        assert twice.figures[figure] == (value if value is None else pytest.approx(value, rel=1e-8, abs=1e-8)), figure
    assert twice.design == pytest.approx(once.design, rel=1e-6, abs=1e-9)


def test_a_limit_of_two_equal_ends_is_an_equality_with_one_price():
    answer = optimal(lo.load("beatup").set("limits.swing", {"min": "23.08 deg", "max": "23.08 deg"}))
    near = optimal(lo.load("beatup").set("limits.swing", {"min": "23.08 deg", "max": "23.080000000001 deg"}))
    assert len([price for price in answer.binding if price.limit == "swing"]) == 1
    assert near.figures["peak_torque"] == pytest.approx(answer.figures["peak_torque"], rel=1e-10)


def test_the_same_row_three_times_is_certified():
    rows = {"f": lambda v: v["x"] + v["y"] ** 2, "h": lambda v: 2 * v["x"]}
    answer = toy.solve(toy.program("xy", rows, limits=(("x", -1, 1.0), ("h", -1, 2.0), ("x", -1, 1.0))))
    assert answer.status == "optimal", answer.message
    assert answer.design == pytest.approx({"x": 1.0, "y": 0.0}, abs=1e-9)


# Starts at a maximum or a saddle ---------------------------------------------------------------------------------

BOX = (("x", 1, 1.0), ("x", -1, -1.0))
STARTS = {
    "a maximum": (toy.program("x", {"f": lambda v: 5 - v["x"] ** 2}, limits=BOX, start={"x": 0.0}), 4.0),
    "between two minima": (toy.program("x", {"f": lambda v: (v["x"] ** 2 - 0.25) ** 2}, start={"x": 0.0}), 0.0),
    "a saddle": (
        toy.program("xy", {"f": lambda v: 5 + v["x"] ** 2 - v["y"] ** 2 + v["y"] ** 4 / 2}, start={"x": 0.5, "y": 0.0}),
        4.5,
    ),
}


@pytest.mark.parametrize("name", STARTS)
def test_a_start_at_a_maximum_or_saddle_is_left(name):
    """The certificate refuses where the solver would stay; other starts find the minimum."""
    program, least = STARTS[name]
    at = dict.fromkeys(program.starts[0], 0.0)
    refused = certify(program, at, 1e-8)
    assert not refused.passed
    assert any("second order fails" in reason for reason in refused.reasons)
    answer = toy.solve(program)
    assert answer.status == "optimal", answer.message
    assert answer.figures["f"] == pytest.approx(least, abs=1e-9)


FLAT_TO_SECOND_ORDER = {
    "x³": ("x", {"f": lambda v: v["x"] ** 3}, BOX),
    "−x⁴": ("x", {"f": lambda v: -(v["x"] ** 4)}, BOX),
    "mass and radius": ("xy", {"f": lambda v: (v["x"] * v["y"] ** 2 - 1) ** 2}, (("x", -1, 0.0), ("y", -1, 0.0))),
}


@pytest.mark.parametrize("name", FLAT_TO_SECOND_ORDER)
def test_a_point_where_slope_and_curvature_vanish_is_no_minimum(name):
    names, rows, limits = FLAT_TO_SECOND_ORDER[name]
    assert not certify(toy.program(names, rows, limits=limits), dict.fromkeys(names, 0.0), 1e-8).passed


# The flat optimum of mass and radius -----------------------------------------------------------------------------


def test_todays_machine_without_counterweight_is_no_stationary_point():
    """In (m4e, r4e) the slope at (0, 0) is 0: a gradient method that starts there stays, 9 % off."""
    scene = lo.load("beatup-heavy")
    best = optimal(scene)
    assert best.figures["peak_torque"] == pytest.approx(96.8757999181, rel=1e-10)
    without = certificate_of(scene, {**best.design, "m4e": 0.0, "r4e": 0.0}, "balance")
    assert not without.passed
    assert any("can still fall" in reason for reason in without.reasons)


@pytest.mark.parametrize("today", [("0 kg", "0 mm"), ("3 kg", "50 mm"), ("12.4 kg", "80 mm"), ("1e-9 kg", "80 mm")])
def test_mass_and_radius_are_settled_by_a_rule_not_by_the_start(today):
    """Only m4e r4e² counts: of the valley the least mass is chosen, so the largest radius."""
    scene = lo.load("beatup").update(
        {"mechanism.m4e": today[0], "mechanism.r4e": today[1], "operation.M0": "790 N*m"}
        | {"bounds.l1": "31 mm", "bounds.l2": "65 mm", "bounds.l3": "155 mm", "bounds.l4": "167 mm"}
    )
    answer = optimal(scene)
    assert answer.figures["M3_fdc"] == pytest.approx(0, abs=1e-9)
    inertia = 790 / (0.3002802211511 * (20 * 3.141592653589793) ** 2)
    assert answer.figures["J4"] == pytest.approx(inertia, rel=1e-6)
    assert answer.design["r4e"] == pytest.approx(0.08, rel=1e-12)
    assert answer.design["m4e"] == pytest.approx((answer.figures["J4"] - 0.62) / 0.08**2, rel=1e-9)


# Clashes by a hair -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("share", [0.0, 1e-12, 1e-10])
def test_a_clash_below_what_is_promised_is_none(share):
    """Limits are promised to 1e-9 of their size: 1e-12 too soft is held, and the certificate says how well."""
    answer = optimal(lo.load("shedding").set("bounds.K1.max", f"{K1 * (1 - share)!r} N/m"))
    assert answer.figures["K1"] == pytest.approx(K1, rel=2e-10)
    assert answer.figures["contact_min"] >= -1e-9 * answer.figures["spring_force_max"]


@pytest.mark.parametrize("share", [1e-8, 1e-7, 1e-6, 1e-3])
def test_a_clash_above_it_is_never_called_optimal(share):
    answer = lo.solve(lo.load("shedding").set("bounds.K1.max", f"{K1 * (1 - share)!r} N/m"), starts=1)
    assert answer.status in ("infeasible", "failed", "uncertified")
    assert answer.certificate is None or not answer.certificate.passed


@pytest.mark.parametrize(
    "share",
    [
        1e-8,
        1e-6,
        1e-3,
    ],
)
def test_a_clash_above_it_is_refused_with_what_would_do(share):
    answer = lo.solve(lo.load("shedding").set("bounds.K1.max", f"{K1 * (1 - share)!r} N/m"), starts=1)
    assert answer.status == "infeasible"
    assert any("K1" in text for text in answer.clash)
    alone = {relaxation.limit: relaxation.needed for relaxation in answer.relaxation if relaxation.alone}
    assert alone["K1"] == pytest.approx(K1, rel=1e-9)


@pytest.mark.parametrize("share", [1e-6, 1e-9, 0.0, -1e-12])
def test_a_tolerance_at_the_edge_of_what_can_be_had_is_met(share):
    """There the admissible set shrinks to a point; the answer is the two-level one, its prices finite."""
    scene = lo.load("beatup-light").set("targets.torque.M3_tolerance", f"{M3_LIGHT * (1 + share)!r} N*m")
    answer = optimal(scene, "torque")
    assert answer.figures["peak_torque"] == pytest.approx(82.3371385326, rel=1e-8)
    assert all(abs(value) < 1e6 for worth in worths(answer).values() for value in worth.values())


# Bounds that touch and do not press ------------------------------------------------------------------------------


@pytest.mark.parametrize("off", [1e-9, 1e-12, 0.0, -1e-12])
@pytest.mark.parametrize("limit", ["beta", "mu_min", "l2"])
def test_a_limit_set_where_the_optimum_is_anyway_leaves_it_there(off, limit):
    scene, free = lo.load("beatup"), lo.load("beatup")
    best = optimal(free)
    value = best.design["l2"] if limit == "l2" else best.figures[limit]
    key = {"beta": "limits.beta.max", "mu_min": "limits.mu_min.min", "l2": "bounds.l2.max"}[limit]
    outward = 1 - off if limit == "mu_min" else 1 + off
    answer = optimal(scene.set(key, f"{value * outward!r} {'m' if limit == 'l2' else 'rad'}"))
    assert answer.figures["peak_torque"] == pytest.approx(best.figures["peak_torque"], rel=1e-9)
    assert answer.figures["M3_fdc"] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("off", [0.0, 1e-9, -1e-9])
def test_a_bound_that_touches_a_bowls_bottom_has_no_price(off):
    program = toy.program("xy", {"f": lambda v: (v["x"] - 1) ** 2 + (v["y"] - 2) ** 2}, limits=(("x", 1, 1.0 + off),))
    answer = toy.solve(program)
    assert answer.status == "optimal", answer.message
    assert answer.design == pytest.approx({"x": 1.0, "y": 2.0}, abs=2e-9)
    assert all(abs(value) <= 1e-8 for worth in worths(answer).values() for value in worth.values())


def test_a_bound_that_touches_a_corner_is_not_told_a_price_that_loosening_does_not_pay():
    free = optimal(lo.load("shedding"), "force")
    answer = optimal(lo.load("shedding").set("bounds.K1.max", f"{free.figures['K1']!r} N/m"), "force")
    assert answer.figures["contact_max"] == pytest.approx(free.figures["contact_max"], rel=1e-10)
    assert worths(answer).get(("K1", "max"), {"contact_max": 0.0})["contact_max"] == pytest.approx(0, abs=1e-6)


# Cubic contact: an optimum without prices ------------------------------------------------------------------------


def cubic():
    """Return least x with x³ ≥ y ≥ 0: 0, where both limits' slopes are opposite and neither has one along x."""
    rows = {"f": lambda v: v["x"], "g": lambda v: v["x"] ** 3 - v["y"]}
    return toy.program("xy", rows, limits=(("g", -1, 0.0), ("y", -1, 0.0)), start={"x": 0.5, "y": 0.1})


def test_an_optimum_without_prices_is_not_certified():
    certificate = certify(cubic(), {"x": 0.0, "y": 0.0}, 1e-8)
    assert not certificate.passed
    assert any("can still fall" in reason for reason in certificate.reasons)


@pytest.mark.parametrize("x", [-1e-3, -1e-4, -1e-5])
def test_a_point_beside_an_optimum_without_prices_is_not_certified(x):
    certificate = certify(cubic(), {"x": x, "y": 0.0}, 1e-8)
    assert not certificate.passed
    assert any("is too large" in reason or "carries a price" in reason for reason in certificate.reasons)


def test_an_optimum_without_prices_is_called_uncertified():
    answer = toy.solve(cubic())
    assert answer.status == "uncertified" or answer.figures["f"] == pytest.approx(0, abs=1e-8)
