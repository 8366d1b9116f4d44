"""Intervals rounded outward: whatever a formula is worth in a box, in 40 digits, lies inside; so do its slopes."""

import math
from fractions import Fraction

import numpy as np
import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.maths import intervals, systems
from loomopt.maths.intervals import PI, TRIG_ERROR, Enclosure, Interval, chosen, interval, variable
from loomopt.physics.balance import Given
from loomopt.physics.cycle import Node

M, MP = systems.boxes(), systems.mpmath()
FORMULAS = {
    "sum": lambda m, x, y: 3 - (x + y) - (2 - y) + 1,
    "product": lambda m, x, y: 2 * x * y * 0.5 - x * x,
    "quotient": lambda m, x, y: x / (y + 5) + 3 / (x * x + 1) + y / 4,
    "powers": lambda m, x, y: x**2 - y**3 + (3 + x) ** -1 * y**4 + x**0 + y**1,
    "sign": lambda m, x, y: -x * +y,
    "angles": lambda m, x, y: m.sin(x * y) * m.cos(x - y) + m.sin(40 * x),
    "root": lambda m, x, y: m.sqrt(x**2 + y**2 + m.number(0.1)),
    "angle": lambda m, x, y: m.atan2(y, x + 4) * x + m.atan2(x, -y - 5) + m.atan2(x * x + 1, m.number(0.3)),
    "chosen": lambda m, x, y: m.choose(1.0, (x, x * y, y)) + m.pi,
}
BOXES = 1200


def drawn(rng, count, reach=2.0):
    """Return boxes (2, count) of all widths, and a point in each."""
    middle = rng.uniform(-reach, reach, (2, count))
    half = 10.0 ** rng.uniform(-16, 0, (2, count)) * rng.integers(0, 2, (2, count))
    low, high = middle - half, middle + half
    return low, high, low + rng.random((2, count)) * (high - low)


def holds(result, k, value):
    """Say whether an interval's element k holds a number of 40 digits."""
    low, high = (float(end.ravel()[k if end.size > 1 else 0]) for end in (result.low, result.high))
    return (math.isinf(low) or MP.number(low) <= value) and (math.isinf(high) or value <= MP.number(high))


@pytest.mark.parametrize("name", FORMULAS)
def test_every_operation_holds_the_value_in_40_digits_at_10000_random_boxes_together(name):
    """9 formulas on 1200 boxes each."""
    rng = np.random.default_rng(len(name))
    low, high, at = drawn(rng, BOXES)
    formula = FORMULAS[name]
    plain = formula(M, *(Interval(low[k][None], high[k][None]) for k in range(2)))
    sloped = formula(M, *(variable(k, 2, low[k], high[k]) for k in range(2)))
    middle = (low + high) / 2
    for k in range(BOXES):
        x, y = (MP.number(float(item)) for item in at[:, k])
        value = formula(MP, x, y)
        assert holds(plain, k, value)
        assert holds(sloped.v, k, value)
        centre = [MP.number(float(item)) for item in middle[:, k]]
        # The mean value form is what the slopes are for.
        moved = value - formula(MP, *centre)
        ends = [np.clip(end, -1e300, 1e300) for end in (sloped.g.low, sloped.g.high)]
        slopes = [[np.broadcast_to(end, (2, 1, BOXES))[i, 0, k] for end in ends] for i in range(2)]
        steps = [x - centre[0], y - centre[1]]
        reach = [sorted(MP.number(float(g)) * step for g in pair) for pair, step in zip(slopes, steps, strict=True)]
        assert reach[0][0] + reach[1][0] - MP.number(1e-30) <= moved <= reach[0][1] + reach[1][1] + MP.number(1e-30)


@pytest.mark.parametrize("far", [1.0, 20.0, 1e6])
def test_sines_are_right_to_the_error_that_is_stated(far):
    x = np.random.default_rng(3).uniform(-far, far, 3000)
    results = intervals.sin(interval(x)), intervals.cos(interval(x))
    for k, angle in enumerate(x):
        for item, true in zip(results, (MP.sin(MP.number(float(angle))), MP.cos(MP.number(float(angle)))), strict=True):
            assert item.low[k] <= true <= item.high[k]
    for item in results:
        assert np.all(item.high - item.low <= 2.01 * TRIG_ERROR)


def test_sines_hold_their_tops_and_what_is_too_far_to_reduce():
    whole = intervals.sin(Interval([1.5, 4.6, -0.1, 0.1, 2e6], [1.7, 4.8, 0.1, 7.0, 2e6]))
    assert whole.high[0] == 1.0
    assert whole.low[1] == -1.0
    assert whole.low[2] < -0.0998 < 0.0998 < whole.high[2] < 0.0999
    assert (whole.low[3], whole.high[3]) == (whole.low[4], whole.high[4]) == (-1.0, 1.0)
    assert intervals.cos(Interval(-0.1, 0.2)).high == 1.0
    assert intervals.cos(Interval(3.0, 3.2)).low == -1.0


def test_angles_are_right_whatever_numpy_says(monkeypatch):
    rng = np.random.default_rng(5)
    y, x = rng.normal(size=(2, 2000))
    exact, arctan2 = intervals.atan2(interval(y), interval(x)), np.arctan2
    assert np.all(exact.high - exact.low < 2e-14)
    monkeypatch.setattr(np, "arctan2", lambda y, x: arctan2(y, x) + 1e-6)
    wrong = intervals.atan2(interval(y), interval(x))
    for k in range(2000):
        true = MP.atan2(MP.number(float(y[k])), MP.number(float(x[k])))
        assert exact.low[k] <= true <= exact.high[k]
        assert wrong.low[k] <= true <= wrong.high[k]


def test_slopes_at_a_branch_cut_are_without_bound():
    y, x = (
        variable(0, 2, np.array([-0.1, 0.1, -0.1]), np.array([0.1, 0.2, 0.1])),
        variable(1, 2, *np.array([[-2.0] * 3, [-1.0, -1.0, 0.0]])),
    )
    result = intervals.atan2(y, x)
    assert np.all(np.isinf(result.g.low[:, 0, [0, 2]]))
    assert np.all(np.isinf(result.g.high[:, 0, [0, 2]]))
    assert np.all(np.isfinite(result.g.high[:, 0, 1]))
    assert result.v.low[0, 0] <= -math.pi
    assert result.v.high[0, 0] >= math.pi


def test_what_holds_zero_has_no_bounded_inverse_and_nothing_times_anything_is_nothing():
    assert np.isinf((1 / Interval(-1.0, 2.0)).high)
    assert np.isinf((1 / Interval(0.0, 2.0)).low)
    flat = interval(0.0) * Interval(-np.inf, np.inf)
    assert abs(flat.low) < 1e-300
    assert abs(flat.high) < 1e-300
    half_open = Interval(0.0, 1.0) * Interval(-np.inf, 2.0)
    assert half_open.low == -np.inf
    assert 2.0 <= half_open.high < 2.0000001


def test_roots_are_of_what_is_not_negative():
    result = intervals.sqrt(Interval([-1.0, -2.0, 4.0], [4.0, -1.0, 4.0]))
    assert result.low[0] == 0.0
    assert result.high[0] >= 2.0
    assert np.isinf(result.high[1])
    assert result.low[2] <= 2.0 <= result.high[2]
    slope = intervals.sqrt(variable(0, 1, np.array([-1.0]), np.array([4.0]))).g
    assert np.isinf(slope.high).all()


def test_pi_is_between_its_ends():
    low, high = Fraction(float(PI.low)), Fraction(float(PI.high))
    assert MP.number(low.numerator) / low.denominator < MP.pi < MP.number(high.numerator) / high.denominator
    assert high - low < Fraction(5, 10**16)


def test_values_are_chosen_box_by_box():
    x = variable(0, 1, np.zeros(3), np.ones(3))
    result = chosen(np.array([[0.0, 1.0, 2.0]]), (x, x * 2.0, interval(7.0)))
    assert isinstance(result, Enclosure)
    assert result.v.high[0, :2] == pytest.approx([1.0, 2.0])
    assert result.v.low[0, 2] == 7.0
    assert result.g.high[0, 0] == pytest.approx([1.0, 2.0, 0.0])
    plain = chosen(np.array([[1.0, 0.0]]), (interval(1.0), Interval(2.0, 3.0)))
    assert plain.low.tolist() == [[2.0, 1.0]]


def boxed_machines(scene, share, count, seed):
    """Return a scene's numbers over random boxes in its bounds, and a point in each; share: of the bounds' widths."""
    program = registry.of(scene).program(scene, "balance")
    rng = np.random.default_rng(seed)
    low, high = (np.array([v.range[k] for v in program.variables])[:, None] for k in range(2))
    half = 0.5 * share * (high - low) * 10.0 ** rng.uniform(-12, 0, (len(low), count))
    middle = low + half + rng.random((len(low), count)) * (high - low - 2 * half)
    names = [v.name for v in program.variables]
    at = middle + (2 * rng.random(middle.shape) - 1) * half * (1 - 1e-15)
    fixed = {name: M.number(value) for name, value in program.parameters.items()}
    ends = zip(middle - half, middle + half, strict=True)
    whole = {name: variable(k, len(names), *pair) for k, (name, pair) in enumerate(zip(names, ends, strict=True))}
    return program, {**fixed, **whole}, [dict(zip(names, map(float, at[:, k]), strict=True)) for k in range(count)]


@pytest.mark.parametrize("effect", ["", "gravity", "bearing_friction", "rod_inertia"])
@pytest.mark.slow
def test_a_loom_machine_in_a_box_has_its_torques_in_40_digits_inside(effect):
    scene = lo.load("beatup").with_effect(effect) if effect else lo.load("beatup")
    count = 2500
    program, numbers, points = boxed_machines(scene, 0.2, count, 7)
    model, rows = program.model, ("M3_fdc", "swing", "theta", "mu_near", "mu_far")
    stills = {event: dict.fromkeys(model.switches, 1.0) for event in model.events_read}
    switch, phi = dict.fromkeys(model.switches, 1.0), 1.3
    given: Given = model.given(M, numbers)
    result = model.static(M, given, stills, rows)
    result["torque"] = model.quantity(M, given, "peak_torque", Node(M.number(phi) + given.values["beta"], switch))
    for k, point in enumerate(points):
        values = {name: MP.number(value) for name, value in {**program.parameters, **point}.items()}
        parameters = model.given(MP, values)
        true = model.static(MP, parameters, stills, rows)
        true["torque"] = model.quantity(
            MP, parameters, "peak_torque", Node(MP.number(phi) + parameters.values["beta"], switch)
        )
        for name, value in true.items():
            assert holds(result[name].v, k, value), name


def test_the_next_floats_of_many_are_those_of_one():
    draw = np.random.default_rng(5)
    sizes = np.concatenate([np.exp(draw.uniform(-690.0, 700.0, 4000)), 2.0 ** draw.integers(-900, 900, 1000)])
    most, least = np.finfo(float).max, np.finfo(float).tiny
    plain = np.concatenate([sizes, -sizes, [0.0, -0.0, most, -most, np.inf, -np.inf]])
    for outward, end in ((intervals._down, -np.inf), (intervals._up, np.inf)):
        with np.errstate(over="ignore"):
            assert np.array_equal(outward(plain), np.nextafter(plain, end))
        near = np.concatenate([np.linspace(0.2, 4.0, 500) * least, np.arange(300) * 5e-324])
        result, first = outward(near), np.nextafter(near, end)
        beyond = result if end > 0 else -result
        assert np.all(beyond >= (first if end > 0 else -first))
        assert np.all(np.abs(result - first) <= np.spacing(np.abs(first)))
