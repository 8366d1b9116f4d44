"""Ranges of prices beside solving again: inside a price holds to 10 %, beyond its end it does not, or others bind.

A price is the slope of the re-solved figure, by differences: it shares nothing with the multipliers.
"""

import math
from pathlib import Path

import pytest

import loomopt as lo
from loomopt.base.units import SI_UNIT
from loomopt.jobs import registry
from loomopt.scenes.packaged import problems
from loomopt.solving import engine
from loomopt.studies.sensitivity import study

INSIDE, BEYOND, STEP = 0.97, 1.03, 0.01
"""Shares of a range at which prices are looked at, and by which figures are differenced."""
MARGIN = 2e-3
"""What differences of figures leave of a price's share."""
LEAST_RMS = Path(__file__).parent / "least_rms_torque.toml"


def checked(scene, target=None, only=None):
    """Check both ends of every price's range; only: of some limits."""
    answer = engine.solve(scene, target)
    plan = study.planned(scene, answer)
    found = study.run(plan)
    prices = {(each.limit, each.side): each for each in answer.binding}
    count = 0
    for price in found.prices:
        if only and price.limit not in only:
            continue
        for end, why in zip(price.range, price.ends, strict=True):
            if price.worth and end and math.isfinite(end):
                count += 1
                _check(plan, prices[price.limit, price.side], end, why)
    return count


def _check(plan, price, end, why):
    key = study._key_of(plan, price)
    unit = SI_UNIT[plan.keys[key].quantity.kind]
    (figure, worth), *_ = price.worth.items()

    def solved(value):
        scene = plan.scene.set(key, value if unit == "1" else f"{value!r} {unit}")
        return engine.solve(scene, plan.target, near=(plan.answer.point,), accuracy=1e-10)

    def slope(share):
        at, step = plan.value(key) + share * end, STEP * abs(end)
        high, low = solved(at + step), solved(at - step)
        if "optimal" not in (high.status, low.status):
            return None, None
        sign = 1.0 if price.side == "max" else -1.0
        fall = -sign * (high.figures[figure] - low.figures[figure]) / (2 * step)
        return abs(fall) / worth - 1.0, {(each.limit, each.side) for each in high.binding}

    inside, bound = slope(INSIDE)
    assert abs(inside) <= study.PRICE_MOVED + MARGIN, (price.limit, end, why)
    beyond, others = slope(BEYOND)
    if why.startswith("the price moves"):
        assert abs(beyond) > study.PRICE_MOVED - MARGIN, (price.limit, end, why)
        assert (beyond > 0) == ("+10" in why)
    else:
        # The price jumps, or others bind; or no design keeps the limits.
        assert beyond is None or others != bound or abs(beyond - inside) > 0.01, (price.limit, end, why)


@pytest.mark.slow
def test_the_shedding():
    assert checked(registry.load("shedding"), only={"X0", "N_min"}) == 3


@pytest.mark.slow
def test_prices_of_a_root_are_those_of_the_figure():
    """Of the rms torque, of which the square is what the solver sees."""
    assert checked(lo.load(LEAST_RMS)) == 8


@pytest.mark.few(0, slow=3)
@pytest.mark.parametrize("problem", sorted(problems()))
def test_every_packaged_scene(problem):
    checked(registry.load(problem))
