"""Ranges of prices compared with repeated solves: inside, the price changes by less than 10 %; beyond, by more, or
other limits bind.

The price is a difference of re-solved figures, which is independent of the multipliers.
"""

import math
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.base.units import SI_UNIT
from loomopt.jobs import registry
from loomopt.scenes.packaged import problems
from loomopt.solving import engine
from loomopt.studies.sensitivity import study

INSIDE, BEYOND, STEP = 0.97, 1.03, 0.01
"""Shares of a range at which the price is computed, and step of its difference."""
MARGIN = 2e-3
"""Error of a difference of figures, as a share of the price."""
WAY = (0.5, 0.9)
"""Shares of a range at which the optimum is found on the way to its end."""
LEAST_RMS = Path(__file__).parent / "least_rms_torque.toml"


def check_ranges(scene, target=None, only=None):
    """Check both ends of every price's range, or of the limits `only`; the number of ends checked."""
    answer = engine.solve(scene, target)
    plan = study.plan_sensitivity(scene, answer)
    result = study.run(plan)
    binding = {(price.limit, price.side): price for price in answer.binding}
    count = 0
    for price in result.prices:
        if only and price.limit not in only:
            continue
        for end, why in zip(price.range, price.ends, strict=True):
            if price.worth and end and math.isfinite(end):
                count += 1
                _check_end(plan, binding[price.limit, price.side], price, end, why)
    return count


def _check_end(plan, price, priced, end, why):
    key = study.number_key(plan, price)
    unit = SI_UNIT[plan.numbers[key].quantity.kind]
    figure, worth = priced.figure, priced.worth

    points = [plan.answer.point]

    def changed(value):
        return plan.scene.set(key, value if unit == "1" else f"{value!r} {unit}")

    def solve(value):
        return engine.solve(changed(value), plan.target, near=tuple(points), accuracy=1e-10)

    # One start near today's optimum may end in another basin.
    for share in WAY:
        value = plan.value(key) + share * end
        answers = solve(value), engine.solve(changed(value), plan.target)
        points += [answer.point for answer in answers if answer.status == "optimal"]

    def slope(share):
        at, step = plan.value(key) + share * end, STEP * abs(end)
        try:
            high, low = solve(at + step), solve(at - step)
        except BadInput:
            return None, None
        if "optimal" not in (high.status, low.status):
            return None, None
        sign = 1.0 if price.side == "max" else -1.0
        fall = -sign * (high.figures[figure] - low.figures[figure]) / (2 * step)
        return abs(fall) / worth - 1.0, {(price.limit, price.side) for price in high.binding}

    inside, bound = slope(INSIDE)
    assert abs(inside) <= study.PRICE_CHANGE + MARGIN, (price.limit, end, why)
    beyond, others = slope(BEYOND)
    if why.startswith("the price moves"):
        assert abs(beyond) > study.PRICE_CHANGE - MARGIN, (price.limit, end, why)
        assert (beyond > 0) == ("+10" in why)
    else:
        # The price jumps, other limits bind, or no design is admissible.
        assert beyond is None or others != bound or abs(beyond - inside) > 0.01, (price.limit, end, why)


@pytest.mark.slow
def test_the_shedding():
    assert check_ranges(registry.load("shedding"), only={"X0", "N_min"}) == 3


@pytest.mark.slow
def test_prices_of_a_root_are_those_of_the_figure():
    """The solver minimises the square of the rms torque."""
    assert check_ranges(lo.load(LEAST_RMS)) == 8


@pytest.mark.few(0, slow=3)
@pytest.mark.parametrize("problem", sorted(problems()))
def test_every_packaged_scene(problem):
    check_ranges(registry.load(problem))


@pytest.fixture(scope="module")
def press():
    scene = registry.load("knuckle-press")
    return study.plan_sensitivity(scene, engine.solve(scene))


@pytest.mark.slow
def test_a_number_of_numpy_is_read_as_any_other(press):
    """Its text has its type in NumPy 2, which no unit follows."""
    for key in press.numbers:
        changed, program = press.change(key, press.value(key))
        same, other = press.change(key, np.float64(press.value(key)))
        assert (changed.document, program.parameters) == (same.document, other.parameters)


@pytest.mark.slow
def test_newton_on_a_path_does_not_depend_on_the_basis_of_the_hessian(press):
    """A null space has many bases, and each decomposition may give another."""
    optimum = press.optimum
    working_set = next(iter(optimum.working_sets()))
    _, program = press.change("bounds.rod.max", press.value("bounds.rod.max") * 1.002)
    fresh = study._newton(optimum, working_set, program, study.PathPlace(optimum.x))
    basis, product = fresh.bends
    turned, _ = np.linalg.qr(np.random.default_rng(0).standard_normal((basis.shape[1],) * 2))
    start = study.PathPlace(optimum.x, bends=(basis @ turned, product @ turned))
    for name, value in study._newton(optimum, working_set, program, start).x.items():
        assert value == pytest.approx(fresh.x[name], rel=1e-9, abs=1e-12)


@pytest.mark.slow
def test_a_path_takes_few_optima_and_fewer_hessians(press, monkeypatch):
    """Places of a path are predicted from their neighbours, whose Hessian serves them too."""
    counts = Counter[str]()

    def counted(owner, name):
        method = getattr(owner, name)

        def call(*arguments):
            counts[name] += 1
            return method(*arguments)

        monkeypatch.setattr(owner, name, call)

    counted(study.Path, "excess")
    counted(type(press.optimum), "hessian_product")
    working_sets = list(press.optimum.working_sets())
    (price,) = (price for price in press.answer.binding if price.limit == "upper")
    (found,) = study._price_ranges(press, working_sets, {}, price)
    assert all(why.startswith("the price moves") for why in found.ends)
    assert counts["excess"] <= 2 * 20
    assert counts["hessian_product"] < counts["excess"]


class Line(study.Path):
    """Path of known excesses; shifts: those read."""

    def __init__(self, rows, change):
        self.rows, self.change, self.shifts = rows, change, []

    def excess(self, shift):
        self.shifts.append(shift)
        return study.Excess(shift, self.rows(shift), self.change(shift), "")


@pytest.mark.parametrize(
    ("rows", "change", "end", "most"),
    [
        (lambda t: -1e-3, lambda t: t - 0.1, 0.1, 6),
        (lambda t: -1e-3 - t, lambda t: 3 * t * (1 + t) - 0.1, 0.032284, 12),
        (lambda t: 1e3 * (t - 0.07), lambda t: t - 0.1, 0.07, 6),
        (lambda t: -1e-9, lambda t: math.expm1(2 * t) - 0.1, 0.047655, 12),
        (lambda t: -1.0 if t < 1 / 3 else math.inf, lambda t: t - 1, 1 / 3, 45),
    ],
    ids=["line", "parabola", "rows", "exponential", "no design"],
)
def test_the_end_of_a_range_is_found_in_few_points(rows, change, end, most):
    """Excesses of rows far below 0 do not slow the line through those of the price down."""
    line = Line(rows, change)
    inside, outside = study._bracket_end(line, line.excess(1e-7), line.excess(0.5), 1.0)
    assert inside.worst <= 0.0 < outside.worst
    assert outside.shift - inside.shift <= 1e-9 * outside.shift
    assert inside.shift == pytest.approx(end, rel=1e-3)
    assert len(line.shifts) - 2 <= most


@pytest.mark.slow
def test_a_price_of_one_side_has_a_range_of_its_own():
    """A mass below 0 does not exist; a heavier counterweight at radius 0 costs nothing, as far as the bound allows."""
    scene = registry.load("beatup-light")
    result = study.run(study.plan_sensitivity(scene, engine.solve(scene)))
    looser, tighter = (price for price in result.prices if (price.limit, price.side) == ("m4e", "min"))
    inertia = scene.bounds["r4e"].max ** 2
    by_inertia = next(-row.value for row in result.rows if (row.number, row.of) == ("effects.inertia.J4", "M3_fdc"))
    assert looser.worth == pytest.approx(inertia * abs(by_inertia), rel=1e-6)
    assert (looser.range, looser.ends[0]) == ((0.0, 0.0), "it is out of range")
    assert looser.ends[1] == "the price is 0 N*m per kg there"
    assert (tighter.worth, tighter.range[0]) == (0.0, 0.0)
    assert tighter.range[1] == pytest.approx(scene.bounds["m4e"].max, rel=1e-8)
    assert tighter.ends == ("the price is 6.99 N*m per kg there", "min is more than max")
    today = engine.solve(scene).figures["M3_fdc"]
    for mass in ("0.01 kg", "6 kg", "12.3 kg"):
        heavier = engine.solve(scene.set("bounds.m4e.min", mass))
        assert heavier.figures["M3_fdc"] == pytest.approx(today, rel=1e-9)
