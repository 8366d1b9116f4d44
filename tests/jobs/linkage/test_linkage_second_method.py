"""Optima of the packaged linkages found again: plain NumPy formulas and SLSQP, from today's machine.

With the rest held, SLSQP gets nowhere from there: it starts beside the optimum that loomopt tells.
"""

import math

import numpy as np
import pytest

import loomopt as lo
from reference.planar_linkages import Press, SixBar, least, tops

SIX, PRESS = lo.load("sixbar-sley"), lo.load("knuckle-press")
FLATTEST, QUARTER, REST = math.cos(math.radians(48)), math.radians(0.25), math.radians(246)
STARTS = {"at rest": "balance", "pulse": "pulse"}
"""Cases in which SLSQP gets nowhere from today's machine: the target whose optimum it starts beside."""
PART = 0.05
"""Of the width of the bounds, how far a start is drawn from where it is drawn about, either way."""


def peak(six):
    return tops(abs(six.torque))


def bending(six):
    return tops(abs(six.q.over(2)))


def early(six):
    return -six.v["end"]


def pulse(six):
    return six.pulse_rms


def change(six):
    """Return the change from today over the bounds' widths, of what may change."""
    bounds, today = box(SIX, ())
    return sum(((six.v[name] - today[name]) / (high - low)) ** 2 for name, (low, high) in bounds.items())


def six_bar(objectives, *, balanced=False, resting=False):
    """Return what `least` asks of the sley: what is sought, the scene's limits, the balance at front dead centre."""

    def formulas(v):
        six = SixBar(v)
        if not six.closes:
            return None
        swing = [six.swing - math.radians(24), math.radians(23) - six.swing]
        limits = [swing, tops(six.drive) - FLATTEST, tops(six.beat) - FLATTEST, peak(six) / 400 - 1]
        if resting:
            travel = six.travel(v.get("end", REST))
            limits += [tops(sign * travel, closed=False) - QUARTER for sign in (1, -1)]
        return objectives(six), np.concatenate(limits), [six.balance / six.CLOTH] if balanced else []

    return formulas


def press(v):
    """Return what `least` asks of the press: its torque with and without the sheet, the scene's limits."""
    machine = Press(v)
    if not machine.closes:
        return None
    torque = np.concatenate([tops(abs(machine.idle)), tops(abs(machine.forming), closed=False)])
    return torque, [0.02 - machine.swing, *(tops(machine.knuckle) - math.cos(math.radians(40)))], []


CASES = {
    "balanced": (SIX, six_bar(peak, balanced=True), (), 150.0, 156.9927548),
    "least torque": (SIX, six_bar(peak), (), 150.0, 85.95624778),
    "smooth": (SIX, six_bar(bending), (), 0.5, 0.3712768937),
    "at rest": (SIX, six_bar(peak, balanced=True, resting=True), (), 150.0, 168.0868528),
    "longest rest": (SIX, six_bar(early, resting=True), ("end",), 1.0, -math.radians(256.8786297)),
    "pulse": (SIX, six_bar(pulse, resting=True), (), 100.0, 236.1080792),
    "retrofit": (SIX, six_bar(change, balanced=True, resting=True), (), 0.1, 0.05111270929),
    "press": (PRESS, press, (), 8000.0, 6721.970155),
}
"""Scene, formulas, held numbers that are freed, scale and what loomopt comes to."""


def box(scene, freed):
    """Return the free numbers with both their ends, and today's values."""
    bounds = {name: (b.min, b.max) for name, b in scene.bounds.items() if b.free or name in freed}
    today = dict(scene.mechanism) | {"mass": 0.0}
    return bounds, {name: today[name] for name in bounds}


@pytest.mark.slow
def test_plain_formulas_have_the_figures_of_the_packaged_optima():
    result = lo.solve(SIX)
    six = SixBar(dict(result.design))
    assert max(peak(six)) == pytest.approx(result.figures["peak_torque"], rel=1e-7)
    assert max(bending(six)) == pytest.approx(result.figures["peak_acceleration"], rel=1e-7)
    assert six.swing == pytest.approx(result.figures["swing"], abs=1e-12)
    assert six.balance == pytest.approx(0.0, abs=1e-7)
    assert math.acos(max(tops(six.beat))) == pytest.approx(result.figures["mu.beat"], abs=1e-7)
    assert max(tops(six.travel(REST), closed=False)) == pytest.approx(result.figures["travel.rest"], rel=1e-6)
    machine, result = Press(dict((answer := lo.solve(PRESS)).design)), answer
    assert max(abs(machine.forming)) == pytest.approx(result.figures["peak_torque"], rel=1e-9)
    assert machine.swing == pytest.approx(result.figures["swing"], rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_another_solver_on_other_formulas_comes_to_the_same_optimum(name):
    scene, formulas, freed, size, value = CASES[name]
    bounds, today = box(scene, freed)
    if name in STARTS:
        best = lo.solve(scene, STARTS[name]).design
        drawn = np.random.default_rng(1).uniform(-PART, PART, len(bounds))
        pairs = zip(bounds.items(), drawn, strict=True)
        today = {key: best[key] + share * (high - low) for (key, (low, high)), share in pairs}
    reached, _, excess = least(formulas, bounds, today, size)
    assert excess <= 1e-8
    assert reached == pytest.approx(value, rel=1e-6)
