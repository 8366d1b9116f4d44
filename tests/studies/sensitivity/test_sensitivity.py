"""Derivatives of optima beside those computed apart: by complex steps and by Newton on the KKT system, in 40 digits."""

import functools
import math
from pathlib import Path

import numpy as np
import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.interface.study.sensitivity import SensitivityStudy
from loomopt.jobs import registry
from loomopt.picture.table import TextTable
from loomopt.solving import engine
from loomopt.studies.sensitivity import study
from loomopt.studies.sensitivity.active import solve_linear_program

RAMS = Path(__file__).parents[2] / "solving" / "answer" / "cases" / "mirrored_rams.toml"
DIGITS = 2e-9
"""Relative error of a derivative by differences of the fourth order; references have ten digits."""
RANGE = 2e-5
"""Relative error of a range; references have five digits."""


@functools.cache
def sensitivity(problem, **changes):
    scene = registry.load(problem)
    scene = scene.update(dict(changes)) if changes else scene
    return study.run(study.plan_sensitivity(scene, engine.solve(scene)))


def derivative(problem, number, of):
    (row,) = [row for row in sensitivity(problem).rows if (row.number, row.of) == (number, of)]
    return row


@pytest.mark.parametrize(
    ("number", "of", "value"),
    [
        ("operation.M0", "peak_torque", 0.1190461926),
        ("operation.speed", "peak_torque", 0.0),
        ("effects.inertia.J4", "peak_torque", 0.0),
        ("bounds.l1.min", "peak_torque", 4155.219051),
        ("bounds.l4.max", "peak_torque", -746.4465361),
        ("limits.theta.max", "peak_torque", -22.22556929),
        ("limits.swing.max", "peak_torque", -0.07175383),
        ("operation.M0", "m4e", 0.1384711942),
        ("operation.speed", "m4e", -3.28371788),
        ("effects.inertia.J4", "m4e", -156.25),
        ("bounds.l1.min", "m4e", -3949.046864),
        ("bounds.l4.max", "m4e", 709.4096163),
        ("bounds.r4e.max", "m4e", -157.1509923),
    ],
)
def test_the_balanced_beatup(number, of, value):
    row = derivative("beatup", number, of)
    assert row.side is None
    assert row.value == pytest.approx(value, rel=DIGITS if number != "limits.swing.max" else 5e-8, abs=1e-12)


@pytest.mark.parametrize(
    ("limit", "low", "high", "ends"),
    [
        ("l1", -0.00067636e-3, 0.22428683e-3, ("swing's price is 0", "the price moves by +10 %")),
        ("l4", -1.0762886e-3, 0.0037651e-3, ("the price moves by +10 %", "swing's price is 0")),
        (
            "theta",
            math.radians(-0.0043482),
            math.radians(0.6901386),
            ("swing's price is 0", "the price moves by -10 %"),
        ),
        (
            "swing",
            math.radians(-5.8636e-5),
            math.radians(5.8636e-5),
            ("the price moves by +10 %", "the price moves by -10 %"),
        ),
    ],
)
def test_price_ranges_of_the_beatup_and_their_ends(limit, low, high, ends):
    (price,) = [price for price in sensitivity("beatup").prices if price.limit == limit]
    assert price.range == pytest.approx((low, high), rel=5e-5 if limit == "swing" else RANGE)
    assert price.ends == ends


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "value"),
    [
        ("bounds.X0.max", -739681.681482),
        ("mechanism.travel", 868647.149558),
        ("operation.speed", 3196.191836),
        ("effects.inertia.M", 2664.588686),
        ("effects.weight.G", 7.209189763),
        ("effects.warp_tension.T1", 0.0),
        ("effects.warp_tension.T2", -5.695225451),
        ("operation.N_min", 7.209189763),
    ],
)
def test_rise_and_return_that_bind_together_have_derivatives(number, value):
    row = derivative("shedding", number, "K1")
    assert row.value == pytest.approx(value, rel=DIGITS, abs=1e-9)
    assert row.side == ("up" if number == "operation.N_min" else None)


def test_range_of_the_cloth_resistance_in_which_the_same_limits_bind():
    (interval,) = sensitivity("beatup").holds
    assert interval.number == "operation.M0"
    assert interval.range == pytest.approx((699.603990, 789.153301), abs=6e-7)
    assert interval.ends == ("m4e is reached", "m4e is reached")


@pytest.mark.slow
def test_a_spring_has_no_range_of_the_cloth_resistance():
    assert sensitivity("shedding").holds == ()


@pytest.mark.slow
def test_a_weight_that_has_its_mass_and_a_spring_that_has_one():
    """The weight has the mass M = G/g; a third of the spring's mass moves with the lever."""
    assert derivative("shedding", "effects.weight.G", "K1").value + derivative(
        "shedding", "effects.inertia.M", "K1"
    ).value / 9.80665 == pytest.approx(278.921618, abs=6e-7)
    scene = registry.load("shedding").with_effect("spring_inertia").set("effects.spring_inertia.mass", "0 kg")
    here = study.run(study.plan_sensitivity(scene, engine.solve(scene)))
    (row,) = [row for row in here.rows if (row.number, row.of) == ("effects.spring_inertia.mass", "K1")]
    assert row.side == "up"
    assert row.value == pytest.approx(888.196229, rel=1e-8)


@pytest.mark.slow
def test_effects_at_zero_have_derivatives_on_one_side():
    """Damping and friction separate rise from return: each side has a different active set, and 0 is the least."""
    here = sensitivity("shedding", **{"effects.damping.C": "0 N*s/m", "effects.dry_friction.F": "0 N"})
    rows = {row.number: row for row in here.rows if row.of == "K1"}
    for number, value in (("effects.damping.C", 15.396653420), ("effects.dry_friction.F", 7.209189763)):
        assert rows[number].side == "up"
        assert rows[number].value == pytest.approx(value, rel=1e-8)


@pytest.mark.slow
def test_price_ranges_of_the_shedding():
    ranges = {price.limit: price.range for price in sensitivity("shedding").prices}
    ends = {price.limit: price.ends for price in sensitivity("shedding").prices}
    more, less = "the price moves by +10 %", "the price moves by -10 %"
    assert {name: ends[name] for name in ("X0", "travel", "speed")} == {
        "X0": (more, less),
        "travel": (more, less),
        "speed": (less, more),
    }
    assert ranges["X0"] == pytest.approx((-6.4296e-3, 7.4779e-3), rel=1e-5)
    assert ranges["travel"] == pytest.approx((-7.2410e-3, 8.4256e-3), rel=1e-5)
    rpm = 2 * math.pi / 60
    assert ranges["speed"] == pytest.approx((-59.998 * rpm, 59.998 * rpm), rel=1e-5)


@pytest.mark.slow
def test_another_angle_of_the_same_limit_ends_a_price():
    """Beyond 18 361.28 N the roller lifts off at the start of the cycle first, where the price is 12.5 (N/m)/N."""
    (price,) = [price for price in sensitivity("shedding").prices if price.limit == "N_min"]
    assert price.range == (0.0, pytest.approx(18361.28, abs=6e-3))
    assert price.ends == ("it is out of range", "N_min is reached at 0 deg too")


@pytest.mark.slow
def test_another_angle_ends_it_at_the_printed_travel_too():
    (price,) = [price for price in sensitivity("shedding-printed-travel").prices if price.limit == "N_min"]
    assert price.range == (0.0, pytest.approx(17442.74, abs=6e-3))


@pytest.mark.slow
def test_an_end_of_0_is_printed_as_0():
    grids = [part for part in SensitivityStudy(sensitivity("shedding")).tables() if isinstance(part, TextTable)]
    (line,) = [line for grid in grids for line in grid.lines if line[0] == "N_min min"]
    assert line[2] == "0"


@functools.cache
def rams(target):
    answer = lo.solve(lo.load(RAMS), target=target)
    return study.run(study.plan_sensitivity(lo.load(RAMS), answer.result))


@pytest.mark.slow
def test_bounds_that_bind_only_together_have_different_derivatives_on_both_sides():
    """One bound loosened alone changes nothing; tightened it costs the price of both together."""
    rows = {(row.number, row.side): row.value for row in rams("torque").rows if row.of == "peak_torque"}
    for name in ("left", "right"):
        assert rows[f"bounds.{name}.max", "up"] == 0.0
        assert rows[f"bounds.{name}.max", "down"] == pytest.approx(-0.19781344543, rel=1e-8)
    for name in ("left", "right"):
        tighter, looser = (price for price in rams("torque").prices if price.limit == name)
        assert looser.worth == 0.0
        assert looser.range == (0.0, math.inf)
        assert looser.ends[0] == "the price is 0.000198 N*m per mm there"
        assert tighter.worth == pytest.approx(0.19781344543, rel=1e-8)
        assert tighter.range[0] < 0.0 == tighter.range[1]
        assert tighter.ends[1] == "the price is 0 N*m per mm there"


@pytest.mark.slow
def test_a_price_follows_the_objective_that_it_belongs_to():
    """Two angles are maximised, one after the other: cos mu = r / rod."""
    rows = {(row.number, row.of): row.value for row in rams("angles").rows}
    slope = 0.05 / 0.3**2 / math.sqrt(1 - (0.05 / 0.3) ** 2)
    for name, of in (("right", "mu.ram1"), ("left", "mu.ram2")):
        assert rows[f"bounds.{name}.max", of] == pytest.approx(slope, rel=1e-8)
        (price,) = [price for price in rams("angles").prices if price.limit == name]
        for end, moved in zip(price.range, (1.1, 0.9), strict=True):
            rod = 0.3 + end
            there = 0.05 / rod**2 / math.sqrt(1 - (0.05 / rod) ** 2)
            assert there / slope == pytest.approx(moved, rel=1e-7)


@pytest.mark.slow
def test_resolving_confirms_a_derivative():
    scene = registry.load("beatup-light")
    row = {row.number: row for row in sensitivity("beatup-light").rows if row.of == "M3_fdc"}["bounds.l1.min"]
    ends = [engine.solve(scene.set("bounds.l1.min", f"{30 + d} mm")).figures["M3_fdc"] for d in (1e-3, -1e-3)]
    assert row.value == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-4)


@pytest.mark.slow
def test_a_free_cam_law_with_more_active_rows_than_knots():
    """Repeated solves on both sides confirm it; N_min can only increase, and acts like the weight."""
    scene = registry.load("shedding")
    answer = engine.solve(scene, "law")
    result = study.run(study.plan_sensitivity(scene, answer))
    assert result.refused is None
    rows = {row.number: row for row in result.rows if row.of == "K1"}
    for key, unit, here, step, si in (
        ("bounds.X0.max", "mm", 80.0, 0.01, 1e-3),
        ("operation.speed", "rpm", 600.0, 0.1, math.pi / 30),
    ):
        up, down = (
            engine.solve(scene.set(key, f"{here + sign * step} {unit}"), "law").design["K1"] for sign in (1, -1)
        )
        assert rows[key].side is None
        assert rows[key].value == pytest.approx((up - down) / (2 * step * si), rel=1e-6)
    assert rows["operation.N_min"].side == "up"
    assert rows["operation.N_min"].value == pytest.approx(rows["effects.weight.G"].value, rel=1e-8)


def test_a_linear_program_has_one_vertex_or_no_solution():
    square = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [1.0, 1.0]])
    sides, none, nothing = np.array([1.0, 1.0, 0.0, 0.0, 2.0]), np.zeros((0, 2)), np.zeros(0)
    assert solve_linear_program(np.array([-1.0, -2.0]), square, sides, none, nothing) == pytest.approx([1.0, 1.0])
    assert solve_linear_program(np.array([1.0, -2.0]), square, sides, none, nothing) == pytest.approx([0.0, 1.0])
    equal = np.array([[1.0, -1.0]])
    assert solve_linear_program(np.array([1.0, 1.0]), square, sides, equal, np.array([0.25])) == pytest.approx(
        [0.25, 0.0]
    )
    assert solve_linear_program(np.array([1.0, 0.0]), square[:1], sides[:1], none, nothing) is None


def test_an_answer_that_is_not_certified_is_refused():
    scene = registry.load("beatup").update({"limits.swing.max": "23 deg", "limits.swing.min": "22.99 deg"})
    answer = engine.solve(scene.update({"bounds.l1.min": "34.9 mm"}))
    if answer.status == "optimal":
        pytest.skip("the scene has an answer")
    with pytest.raises(BadInput, match="only a certified optimum has derivatives"):
        study.plan_sensitivity(scene, answer)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "value"),
    [
        ("mechanism.l1", 0.244453501),
        ("mechanism.l2", 0.038980951),
        ("mechanism.l3", -0.113138535),
        ("mechanism.l71", 0.062052955),
        ("mechanism.phi30", -0.014286049),
        ("mechanism.i1", 0.004153223),
        ("mechanism.i2", 0.069220389),
        ("mechanism.wheel", 0.288418286),
        ("operation.stroke", 0.776179298),
        ("operation.s_dwell", -5.664673020),
        ("operation.dwell_after", 0.108213340),
        ("operation.dwell_before", 0.122005456),
        ("limits.mu_min.min", 0.253158269),
        ("bounds.l3p.max", -0.023617436),
        ("bounds.alpha.max", -0.014286049),
        ("bounds.C0y.min", 0.035246404),
        ("operation.speed", 0.0),
    ],
)
def test_the_rapier_with_its_free_direction(number, value):
    row = derivative("rapier", number, "peak_acceleration")
    assert row.value == pytest.approx(value, rel=1e-9, abs=2e-9)
    assert row.side is None


@pytest.mark.slow
def test_price_ranges_of_the_rapier():
    prices = {price.limit: price for price in sensitivity("rapier").prices}
    assert prices["stroke"].range[0] == pytest.approx(-6.730e-3, abs=6e-7)
    reached, more, less = "C0x is reached", "the price moves by +10 %", "the price moves by -10 %"
    assert {name: prices[name].ends for name in ("stroke", "s_dwell", "dwell_after", "dwell_before")} == {
        "stroke": (reached, reached),
        "s_dwell": (reached, reached),
        "dwell_after": (reached, more),
        "dwell_before": (more, reached),
    }
    assert {name: prices[name].ends for name in ("l3p", "alpha", "C0y")} == {
        "l3p": (reached, less),
        "alpha": (more, reached),
        "C0y": (reached, less),
    }
    assert prices["s_dwell"].range[0] == pytest.approx(-0.5437e-3, abs=6e-8)
    assert [math.degrees(x) for x in prices["dwell_after"].range] == pytest.approx([-2.056, 5.553], abs=6e-4)
    assert [math.degrees(x) for x in prices["dwell_before"].range] == pytest.approx([-8.02, 3.028], abs=6e-3)
    assert [math.degrees(x) for x in prices["mu_min"].range] == pytest.approx([-3.107, 3.535], abs=6e-4)
    assert [1e3 * x for x in prices["l3p"].range] == pytest.approx([-4.329, 18.92], abs=6e-3)
    assert [math.degrees(x) for x in prices["alpha"].range] == pytest.approx([-12.33, 1.051], abs=6e-3)
    assert [1e3 * x for x in prices["C0y"].range] == pytest.approx([-4.982, 41.9], abs=6e-2)
