"""Targets pulse, torque and retrofit against SciPy's SLSQP; and what each binding limit is worth, by solving again."""

import dataclasses

import numpy as np
import pytest
import scipy.integrate
from support import slow

import loomopt as lo
from loomopt.jobs import registry
from loomopt.solving.nlp import exchange
from loomopt.solving.nlp.point import Settings, sampler_at
from reference.beatup import DESIGN, Machine, dead_centres, least, least_peak, random_designs

RESISTANCES = (600, 745, 800, 900)
OPTIMAL = [(M0, target) for M0 in RESISTANCES for target in ("balance", "pulse")]
OPTIMAL += [(M0, target) for M0 in (745, 800) for target in ("torque", "retrofit")]
STARTS = 3


def scene_of(M0):
    return lo.load("beatup").set("operation.M0", f"{M0} N*m")


@pytest.fixture(scope="module")
def answer_of():
    known = {}

    def solved(M0, target):
        if (M0, target) not in known:
            known[M0, target] = lo.solve(scene_of(M0), target, starts=1)
        return known[M0, target]

    return solved


def change(machine, weights=None):
    """Return the retrofit's norm as a function of the design."""
    width = {name: high - low for name, (low, high) in machine.bounds.items()}

    def squares(design):
        return sum((weights or {}).get(n, 1.0) * ((design[n] - machine.today[n]) / width[n]) ** 2 for n in DESIGN)

    return squares


def best(values):
    """Return the least of what the starts found; SLSQP loses its way from some."""
    results = [value for value in values if value is not None]
    assert results
    return min(results)


@pytest.mark.few(2)
@pytest.mark.parametrize("M0", RESISTANCES)
def test_pulse_is_the_best_slsqp_finds(answer_of, M0):
    machine, ours = Machine(scene_of(M0)), answer_of(M0, "pulse")
    ends = [least(machine, lambda d: machine.pulse_rms(d) / 100, s) for s in random_designs(machine, STARTS, 1)]
    theirs = best([machine.pulse_rms(end) if end else None for end in ends])
    assert ours.status == "optimal"
    assert ours.figures["pulse_rms"] == pytest.approx(theirs, rel=1e-5)
    assert ours.figures["pulse_rms"] <= theirs * (1 + 1e-7)
    assert machine.excess(ours.design) <= 1e-9


@pytest.mark.few(1)
@pytest.mark.parametrize("M0", [745, 800])
def test_torque_is_the_best_slsqp_finds(answer_of, M0):
    machine, ours, room = Machine(scene_of(M0)), answer_of(M0, "torque"), 0.01 * M0
    firm = [lambda d: (room - machine.static(d)["M3_fdc"]) / 100, lambda d: (room + machine.static(d)["M3_fdc"]) / 100]
    ends = [least_peak(machine, start, firm) for start in random_designs(machine, 2, 2)]
    theirs = best([machine.peaks(end)["peak_torque"] if end else None for end in ends])
    assert ours.status == "optimal"
    assert abs(machine.static(ours.design)["M3_fdc"]) <= room * (1 + 1e-9)
    assert machine.peaks(ours.design)["peak_torque"] == pytest.approx(theirs, rel=1e-5)
    assert ours.figures["peak_torque"] <= theirs * (1 + 1e-7)
    assert machine.excess(ours.design) <= 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(("weights", "M0"), slow.grid([{}, {"l1": 50.0, "m4e": 0.1}], [745, 800]))
def test_retrofit_is_the_best_slsqp_finds(weights, M0):
    scene = scene_of(M0).update({f"targets.retrofit.weights.{name}": value for name, value in weights.items()})
    machine, ours = Machine(scene), lo.solve(scene, "retrofit", starts=1)
    squares, balanced = change(machine, weights), [lambda d: machine.static(d)["M3_fdc"] / 100]
    ends = [least(machine, squares, start, equal=balanced) for start in random_designs(machine, 8 * STARTS, 3)]
    # Where SLSQP ends beyond its limits, by as little as 1e-8, it is better than any machine by 1e-7.
    subset = [end for end in ends if end and machine.excess(end) <= 1e-9 and abs(balanced[0](end)) <= 1e-9]
    theirs = best([squares(end) for end in subset])
    assert ours.status == "optimal"
    assert abs(machine.static(ours.design)["M3_fdc"]) <= 1e-9 * M0
    assert squares(ours.design) == pytest.approx(theirs, rel=1e-5)
    assert squares(ours.design) <= theirs + 1e-7
    assert ours.figures["change"] == pytest.approx(squares(ours.design), rel=1e-11)
    assert machine.excess(ours.design) <= 1e-9


@pytest.mark.parametrize("remaining", ["l1", "l2", "l3", "l4"])
def test_a_heavy_weight_keeps_a_length_as_it_is_today(remaining):
    scene = scene_of(745)
    today, plain = scene.mechanism[remaining], lo.solve(scene, "retrofit", starts=1).design[remaining]
    heavy = lo.solve(scene.set(f"targets.retrofit.weights.{remaining}", 1e6), "retrofit", starts=1)
    assert heavy.status == "optimal"
    assert abs(heavy.design[remaining] - today) <= 1e-4 * abs(plain - today)
    assert abs(heavy.figures["M3_fdc"]) <= 1e-9 * 745
    assert heavy.solver["error_estimate"] <= 1e-10, "Newton's method ends where slopes are steep too"


@pytest.mark.parametrize("tolerance", ["0 N*m", "1 N*m", "20 N*m"])
def test_torque_keeps_the_tolerance_it_is_given(tolerance):
    answer = lo.solve(scene_of(745).set("targets.torque.M3_tolerance", tolerance), "torque", starts=1)
    room = float(tolerance.split()[0])
    assert answer.status == "optimal"
    assert answer.figures["M3_fdc"] == pytest.approx(room, abs=1e-9 * 745), "more reed torque always buys peak torque"


def test_torque_without_tolerance_is_the_balance_of_two_levels(answer_of):
    firm = lo.solve(scene_of(745).set("targets.torque.M3_tolerance", "0 N*m"), "torque", starts=1)
    assert firm.figures["peak_torque"] == pytest.approx(answer_of(745, "balance").figures["peak_torque"], rel=1e-9)


@pytest.mark.parametrize("M0", RESISTANCES)
def test_pulse_rms_is_the_integral_scipy_computes(answer_of, M0):
    machine, design = Machine(scene_of(M0)), answer_of(M0, "pulse").design
    delta = machine.effect_values["resistance"]["pulse"]
    beta = dead_centres(*(design[name] for name in ("l1", "l2", "l3", "l4")))[0]
    begin, end = beta - delta / 2, beta + delta / 2
    area, _ = scipy.integrate.quad(
        lambda phi: float(machine.torques(design, np.array([phi]))[0][0]) ** 2, begin, end, epsabs=0, epsrel=1e-12
    )
    assert answer_of(M0, "pulse").figures["pulse_rms"] == pytest.approx((area / delta) ** 0.5, rel=1e-11)


STEP = {"l1": 1e-7, "l4": 1e-7, "r4e": 1e-7, "m4e": 1e-5, "swing": 1e-6, "theta": 1e-6, "mu_min": 1e-6, "M3_fdc": 1e-3}
"""SI, a millionth of what each limit may reasonably move: the set of binding limits stays, and the second-order central
difference errs by some 1e-10 of the worth. Objectives are exact to about 1e-13: divided by the step, that is NOISE."""
NOISE = 1e-12


def solved_with(scene, target, limit, side, value):
    """Return a scene's answer with one side of a limit put at a value, SI."""
    unit = {"m4e": "kg", "M3_fdc": "N*m", "swing": "rad", "theta": "rad", "mu_min": "rad"}.get(limit, "m")
    key = f"{'bounds' if limit in DESIGN else 'limits'}.{limit}.{side}"
    key = "targets.torque.M3_tolerance" if limit == "M3_fdc" else key
    answer = lo.solve(scene.set(key, f"{value!r} {unit}"), target, starts=1)
    assert answer.status == "optimal"
    return answer


def program_value(program, name, sign, value):
    """Return the first objective, in units of its scale, of a program with one limit put where no scene can put it."""
    limits = [dataclasses.replace(k, value=value) if (k.name, k.sign) == (name, sign) else k for k in program.limits]
    moved = dataclasses.replace(program, limits=tuple(limits))
    point = exchange.solve(moved, moved.starts[0], Settings())
    assert point.usable
    return abs(sampler_at(moved, point.x).figures[program.objectives[0].row])


@pytest.mark.parametrize(("M0", "target"), OPTIMAL)
@pytest.mark.few(2)
def test_every_worth_is_confirmed_by_solving_again(answer_of, M0, target):
    scene, answer = scene_of(M0), answer_of(M0, target)
    prices = [price for price in answer.binding if price.value != 0.0]
    assert prices
    for price in prices:
        (figure, worth), step = next(iter(price.worth.items())), STEP[price.limit]
        outward = step if price.side == "max" else -step
        ends = [solved_with(scene, target, price.limit, price.side, price.value + k * outward) for k in (-1, 1)]
        tight, loose = (abs(end.figures[figure]) for end in ends)
        noise = NOISE * max(1.0, abs(answer.figures[figure])) / step
        assert worth == pytest.approx((tight - loose) / (2 * step), rel=1e-6, abs=noise), price.text


@pytest.mark.parametrize(("M0", "target"), [(600, "balance"), (600, "pulse"), (745, "pulse"), (900, "pulse")])
def test_worth_of_having_no_counterweight_is_what_a_negative_one_would_gain(answer_of, M0, target):
    """No scene allows m4e < 0, its program does; one-sided, as a heavier least mass would only move to radius zero.

    A step of 10 g: the radius then binds by a multiplier well above the solver's rounding.
    """
    program, step = registry.find("beatup").program(scene_of(M0), target), 1e-2
    (price,) = [price for price in answer_of(M0, target).binding if price.limit == "m4e"]
    here, once, twice = (program_value(program, "m4e", -1, -k * step) for k in (0, 1, 2))
    objective = program.objectives[0]
    slope = (3 * here - 4 * once + twice) / (2 * step)
    slope /= 1 if objective.power == 1 else 2 * answer_of(M0, target).figures[objective.figure]
    assert price.worth[objective.figure] == pytest.approx(slope, rel=1e-6)


@pytest.mark.parametrize("M0", [745, 800])
def test_worth_of_the_retrofits_balance_is_confirmed_in_its_program(answer_of, M0):
    program, step = registry.find("beatup").program(scene_of(M0), "retrofit"), 1e-2
    (price,) = [price for price in answer_of(M0, "retrofit").binding if price.limit == "M3_fdc"]
    outward = 1 if price.side == "max" else -1
    tight, loose = (program_value(program, "M3_fdc", 0, k * outward * step) for k in (-1, 1))
    assert price.worth["change"] == pytest.approx((tight - loose) / (2 * step), rel=1e-6)


def test_light_cloth_prices_are_the_known_ones(answer_of):
    worth = {price.limit: price.worth["M3_fdc"] / 1000 for price in answer_of(600, "balance").binding}
    assert worth["l1"] == pytest.approx(27.5, abs=0.05), "N·m per mm"
    assert worth["l4"] == pytest.approx(4.94, abs=0.005), "N·m per mm"


@pytest.mark.parametrize(("key", "value"), [("bounds.l4", 0.167), ("limits.swing", 0.4)])
def test_worth_of_a_fixed_value_has_the_sign_of_its_side(key, value):
    name, unit = key.split(".")[1], "m" if key.startswith("bounds") else "rad"
    scene, step = scene_of(745), STEP[key.split(".")[1]]

    def fixed(at):
        constraint = f"{at!r} {unit}"
        return lo.solve(scene.set(key, constraint if unit == "m" else {"min": constraint, "max": constraint}), starts=1)

    (price,) = [price for price in fixed(value).binding if price.limit == name]
    outward = step if price.side == "max" else -step
    tight, loose = (fixed(value + k * outward).figures["peak_torque"] for k in (-1, 1))
    assert price.worth["peak_torque"] > 0
    assert price.worth["peak_torque"] == pytest.approx((tight - loose) / (2 * step), rel=1e-5)
