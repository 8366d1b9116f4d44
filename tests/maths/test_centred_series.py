"""Series over balls narrowed by those at their middles enclose what 60 digits say, and stay narrow in deep formulas."""

import pytest
from maths.test_maths_balls import DIGITS, POINTS, WHOLE, holds

from loomopt.maths import systems
from loomopt.maths.centred_series import CentredSeries

FORMULAS = WHOLE | {
    "angle": lambda m, x: m.atan2(m.sin(x) + 2, m.cos(x) + 3),
    "angle of a number": lambda m, x: m.atan2(m.number(2.0), m.cos(x) + 3) - m.atan2(m.sin(x), m.number(3.0)),
    "exponential": lambda m, x: m.exp(m.sin(x)) - m.exp(m.number(0.3)) * x,
    "signs": lambda m, x: -(+x) + (2 - x) - (m.cos(x) - 1),
    "inverse": lambda m, x: m.number(3.0) / (m.sin(x) + 2) / m.number(7.0),
    "spread": lambda m, x: m.weighted(
        [[0.5, -2.0]], m.sin(m.spread((1.0, 3.0), (x,)) * x + m.spread((0.1, 0.2), (x,)))
    )[0],
}


@pytest.mark.parametrize("half", [1e-9, 1e-3, 0.2])
@pytest.mark.parametrize("name", FORMULAS)
def test_a_narrowed_series_contains_what_it_is_at_every_point_of_its_box(name, half):
    """Values, and Taylor's formula with the remainder of the whole box, at points exactly in it."""
    system, balls = systems.centred_balls(), systems.balls()
    digits = systems.arrays(DIGITS) if name == "spread" else DIGITS
    formula = FORMULAS[name]
    run = systems.arrays(system) if name == "spread" else system
    for x in POINTS:
        number = formula(run, systems.centred_ball_series(x, half))
        whole, middle = number.narrowed(), number.middle
        for share in (-1.0, -0.4, 0.0, 0.7, 1.0):
            h = share * half
            value = formula(digits, DIGITS.number(x) + DIGITS.number(h))
            step = balls.number(h)
            assert holds(whole[0], value)
            assert holds(middle[0] + middle[1] * step + whole[2] * step * step, value)


def rotated(maths, x, times):
    """x + iy of a unit vector at x, scaled to its own size again and again: the true size stays 1."""
    right, up = maths.cos(x), maths.sin(x)
    for _ in range(times):
        size = maths.sqrt(right * right + up * up)
        right, up = right / size, up / size
    return right


def test_a_deep_formula_stays_as_wide_as_its_values():
    """Rescaled 4 times cos keeps its range over the box; plain balls of the size soon contain 0."""
    half = 0.01
    with pytest.raises(ValueError, match="denominator"):
        rotated(systems.balls(), systems.ball_series(0.8, half), 4)
    narrow = rotated(systems.centred_balls(), systems.centred_ball_series(0.8, half), 4).narrowed()
    range_half = float(systems.ball_series(0.8, half).cos()[0].rad())
    assert float(narrow[0].rad()) < 1.1 * range_half


def test_whole_numbers_of_a_box_are_one_or_refused():
    system = systems.centred_balls()
    assert float(system.floor(systems.centred_ball_series(1.5, 0.4))) == 1.0
    assert float(system.floor(2.5)) == 2.0
    with pytest.raises(ValueError, match="branch cut"):
        system.floor(systems.centred_ball_series(1.0, 0.1))


def test_enclosures_that_exclude_each_other_are_refused():
    number = systems.centred_ball_series(0.3, 0.1)
    wrong = CentredSeries(number.middle + 1, number.box, number.offsets)
    with pytest.raises(ValueError, match="intersection"):
        wrong.narrowed()
