"""The worst case within all tolerances: proven, and exceeded by no machine that samples or a local search find."""

import functools
import itertools
import json
import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from scipy.optimize import minimize

from loomopt.jobs import registry
from loomopt.maths import sobol
from loomopt.solving import engine
from loomopt.studies.tolerance import study, worst
from loomopt.studies.tolerance.plan import planned

LINKS = dict.fromkeys(("l1", "l2", "l3", "l4"), "0.06 mm")
CLOTH = LINKS | {"M0": "5 %", "speed": "1 %", "J4": "2 %"}
SPRING = {"K1": "5 %", "X0": {"plus_minus": "1 mm", "spread": "uniform"}, "travel": "0.2 mm", "speed": "1 %"}
DRIVE = dict.fromkeys(("l4", "l5", "l6", "l3p", "C0x", "C0y"), "0.06 mm") | dict.fromkeys(
    ("alpha", "phi40"), "0.03 deg"
)
CLOSE = 1e-5
"""Of a figure's range: what a proven end may be beyond the farthest machine."""


@functools.cache
def optimum(problem):
    return dict(engine.solve(registry.load(problem)).design)


def plan(problem, made):
    return planned(registry.load(problem).update({"tolerances": made}), optimum(problem), None, 160)


@functools.cache
def cases(problem, *names):
    made = {"beatup": CLOTH, "shedding": SPRING, "rapier": DRIVE}[problem]
    own = plan(problem, made)
    found = worst.farthest(own)
    assert worst.unproven(own) == ""
    return own, {name: worst.worst(own, name, found[name]) for name in names or worst.asked(own)}


def drawn(own, count, seed=0):
    """Return machines all over the box, half of them on its faces."""
    ends = np.array(list(worst.ends(own).values()))
    shares = sobol.points(count, len(ends), 77 + seed).T
    half = count // 2
    shares[:, :half] = np.where(
        shares[:, :half] < 1 / 3, 0.0, np.where(shares[:, :half] > 2 / 3, 1.0, shares[:, :half])
    )
    return dict(zip(own.made, ends[:, :1] * (1 - shares) + ends[:, 1:] * shares, strict=True))


def unexceeded(own, found, values):
    read = own.read(values, found)
    for name, case in found.items():
        assert np.isfinite(read[name]).all(), name
        assert case.min <= read[name].min(), name
        assert read[name].max() <= case.max, name


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("problem", "names"),
    [("beatup", ()), ("shedding", ()), ("rapier", ("dwell_after",))],
)
def test_every_worst_case_is_proven_and_no_machine_is_worse(problem, names):
    own, found = cases(problem, *names)
    for name, case in found.items():
        assert case.proven, (name, case.why)
        width = case.found[1] - case.found[0] + 1e-9 * abs(case.found[1])
        assert 0 < case.max - case.found[1] < CLOSE * width, name
        assert 0 < case.found[0] - case.min < CLOSE * width, name
    unexceeded(own, found, drawn(own, 2048))


def test_the_worst_of_one_machine_is_itself():
    own = plan("beatup", {"l1": "0 mm"})
    case = worst.worst(own, "peak_torque", worst.farthest(own)["peak_torque"])
    assert case.proven
    assert case.max == pytest.approx(own.figures["peak_torque"], rel=3e-11)


def test_the_range_of_a_number_is_its_tolerance():
    _, found = cases("shedding")
    nominal = optimum("shedding")["K1"]
    assert (found["K1"].min, found["K1"].max) == pytest.approx((0.95 * nominal, 1.05 * nominal), rel=1e-6)


def test_what_cannot_be_boxed_is_undecided_and_says_why():
    scene = registry.load("beatup").with_effect("speed_fluctuation")
    moving = dict(worst.told(planned(scene.update({"tolerances": LINKS}), samples=160)))
    assert {case.why for case in moving.values()} == {
        "a motion of its own is followed turn by turn, which boxes do not enclose"
    }
    twisted = registry.load("beatup").with_effect("shaft_torsion")
    found = dict(worst.told(planned(twisted.update({"tolerances": LINKS}), samples=160)))
    assert "shaft_torsion" in found["peak_torque"].why
    loose = dict(worst.told(plan("rapier", {"l4": "25 mm", "l5": "25 mm"})))
    assert "all machines assemble" in loose["stroke"].why
    told = loose["stroke"].as_dict()
    assert (told["min"], told["max"], told["proven"], told["found"]) == (None, None, False, [None, None])


@pytest.mark.slow
def test_the_same_bits_whoever_proves():
    own = plan("shedding", {"K1": "5 %"})
    alone = study.run(own, worst=True).as_dict()
    with ThreadPoolExecutor(2) as executor:
        assert study.run(own, executor, worst=True).as_dict() == alone
    assert json.loads(json.dumps(alone["worst"])) == alone["worst"]
    assert study.run(own).as_dict() == {**alone, "worst": {}}


@pytest.mark.slow
@pytest.mark.parametrize(("problem", "count"), [("beatup", 1_000_000), ("shedding", 1_000_000), ("rapier", 20_000)])
def test_no_machine_of_very_many_is_worse(problem, count):
    own, found = cases(problem)
    for seed, first in enumerate(range(0, count, 50_000)):
        unexceeded(own, found, drawn(own, min(50_000, count - first), seed))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("problem", "name"),
    [("beatup", "peak_torque"), ("shedding", "N_min"), ("rapier", "dwell_before")],
)
def test_no_local_search_from_fifty_corners_is_worse(problem, name):
    own, found = cases(problem, name)
    case = found[name]
    ends = np.array(list(worst.ends(own).values()))
    width = ends[:, 1] - ends[:, 0]
    size = case.found[1] - case.found[0]

    def read(shares):
        machines = np.clip(ends[:, 0] + np.atleast_2d(shares) * width, ends[:, 0], ends[:, 1])
        return own.read(dict(zip(own.made, machines.T, strict=True)), {name})[name]

    def slopes(shares, sign):
        steps = np.where(shares < 0.5, 1e-4, -1e-4)
        beside = read(np.vstack([shares, shares + np.diag(steps)]))
        return sign * (beside[1:] - beside[0]) / steps / size

    corners = np.array(list(itertools.islice(itertools.product((0.02, 0.98), repeat=len(ends)), 1024)))
    chosen = corners[np.linspace(0, len(corners) - 1, min(50, len(corners))).astype(int)]
    for sign, corner in itertools.product((1.0, -1.0), chosen):
        best = minimize(
            lambda shares, sign=sign: float(sign * read(shares)[0]) / size,
            corner,
            jac=lambda shares, sign=sign: slopes(shares, sign),
            bounds=[(0.0, 1.0)] * len(ends),
            method="SLSQP",
            options={"maxiter": 30 if problem != "rapier" else 4},
        )
        value = float(read(best.x)[0])
        assert math.isfinite(value)
        assert case.min <= value <= case.max
