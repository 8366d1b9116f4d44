"""The worst case within all tolerances: proven, and no machine of samples or of a local search is worse."""

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
from loomopt.studies.tolerance.plan import plan_tolerance

LINKS = dict.fromkeys(("l1", "l2", "l3", "l4"), "0.06 mm")
CLOTH = LINKS | {"M0": "5 %", "speed": "1 %", "J4": "2 %"}
SPRING = {"K1": "5 %", "X0": {"plus_minus": "1 mm", "spread": "uniform"}, "travel": "0.2 mm", "speed": "1 %"}
DRIVE = dict.fromkeys(("l4", "l5", "l6", "l3p", "C0x", "C0y"), "0.06 mm") | dict.fromkeys(
    ("alpha", "phi40"), "0.03 deg"
)
CLOSE = 1e-5
"""Largest gap between a proven end and the farthest machine, as a share of the figure's range."""


@functools.cache
def optimum(problem):
    return dict(engine.solve(registry.load(problem)).design)


def make_plan(problem, made):
    return plan_tolerance(registry.load(problem).update({"tolerances": made}), optimum(problem), None, 160)


@functools.cache
def cases(problem, *names):
    """Plan of a problem, and the worst cases of some figures, of all without names."""
    made = {"beatup": CLOTH, "shedding": SPRING, "rapier": DRIVE}[problem]
    plan = make_plan(problem, made)
    machines = worst.find_farthest(plan)
    assert worst.obstacle_to_proof(plan) == ""
    return plan, {
        name: worst.find_worst_case(plan, name, machines[name]) for name in names or worst.worst_case_names(plan)
    }


def draw_machines(plan, count, seed=0):
    """Machines of the box, half of them on its faces."""
    ends = np.array(list(worst.box_ends(plan).values()))
    shares = sobol.points(count, len(ends), 77 + seed).T
    half = count // 2
    shares[:, :half] = np.where(
        shares[:, :half] < 1 / 3, 0.0, np.where(shares[:, :half] > 2 / 3, 1.0, shares[:, :half])
    )
    return dict(zip(plan.tolerances, ends[:, :1] * (1 - shares) + ends[:, 1:] * shares, strict=True))


def assert_no_machine_is_worse(plan, cases_by_name, values):
    figures = plan.read(values, cases_by_name)
    for name, case in cases_by_name.items():
        assert np.isfinite(figures[name]).all(), name
        assert case.min <= figures[name].min(), name
        assert figures[name].max() <= case.max, name


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("problem", "names"),
    [("beatup", ()), ("shedding", ()), ("rapier", ("dwell_after",))],
)
def test_every_worst_case_is_proven_and_no_machine_is_worse(problem, names):
    plan, cases_by_name = cases(problem, *names)
    for name, case in cases_by_name.items():
        assert case.proven, (name, case.why)
        width = case.farthest[1] - case.farthest[0] + 1e-9 * abs(case.farthest[1])
        assert 0 < case.max - case.farthest[1] < CLOSE * width, name
        assert 0 < case.farthest[0] - case.min < CLOSE * width, name
    assert_no_machine_is_worse(plan, cases_by_name, draw_machines(plan, 2048))


def test_without_tolerances_the_worst_case_is_the_nominal_figure():
    plan = make_plan("beatup", {"l1": "0 mm"})
    case = worst.find_worst_case(plan, "peak_torque", worst.find_farthest(plan)["peak_torque"])
    assert case.proven
    assert case.max == pytest.approx(plan.figures["peak_torque"], rel=3e-11)


@pytest.mark.slow
def test_the_range_of_a_number_is_its_tolerance():
    _, cases_by_name = cases("shedding")
    nominal = optimum("shedding")["K1"]
    assert (cases_by_name["K1"].min, cases_by_name["K1"].max) == pytest.approx(
        (0.95 * nominal, 1.05 * nominal), rel=1e-6
    )


@pytest.mark.slow
def test_a_model_without_boxes_is_undecided_and_names_the_reason():
    scene = registry.load("beatup").with_effect("speed_fluctuation")
    fluctuation = dict(worst.find_worst_cases(plan_tolerance(scene.update({"tolerances": LINKS}), samples=160)))
    assert {case.why for case in fluctuation.values()} == {
        "an effect integrates the motion turn by turn, which boxes do not enclose"
    }
    twisted = registry.load("beatup").with_effect("shaft_torsion")
    cases_by_name = dict(worst.find_worst_cases(plan_tolerance(twisted.update({"tolerances": LINKS}), samples=160)))
    assert "shaft_torsion" in cases_by_name["peak_torque"].why
    loose = dict(worst.find_worst_cases(make_plan("rapier", {"l4": "25 mm", "l5": "25 mm"})))
    assert "all machines assemble" in loose["stroke"].why
    data = loose["stroke"].as_dict()
    assert (data["min"], data["max"], data["proven"], data["found"]) == (None, None, False, [None, None])


@pytest.mark.slow
def test_the_same_bits_with_and_without_an_executor():
    plan = make_plan("shedding", {"K1": "5 %"})
    serial = study.run(plan, worst=True).as_dict()
    with ThreadPoolExecutor(2) as executor:
        assert study.run(plan, executor, worst=True).as_dict() == serial
    assert json.loads(json.dumps(serial["worst"])) == serial["worst"]
    assert study.run(plan).as_dict() == {**serial, "worst": {}}


@pytest.mark.slow
@pytest.mark.parametrize(("problem", "count"), [("beatup", 1_000_000), ("shedding", 1_000_000), ("rapier", 20_000)])
def test_no_machine_of_very_many_is_worse(problem, count):
    plan, cases_by_name = cases(problem)
    for seed, first in enumerate(range(0, count, 50_000)):
        assert_no_machine_is_worse(plan, cases_by_name, draw_machines(plan, min(50_000, count - first), seed))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("problem", "name"),
    [("beatup", "peak_torque"), ("shedding", "N_min"), ("rapier", "dwell_before")],
)
def test_no_local_search_from_fifty_corners_is_worse(problem, name):
    plan, cases_by_name = cases(problem, name)
    case = cases_by_name[name]
    ends = np.array(list(worst.box_ends(plan).values()))
    width = ends[:, 1] - ends[:, 0]
    size = case.farthest[1] - case.farthest[0]

    def read(shares):
        machines = np.clip(ends[:, 0] + np.atleast_2d(shares) * width, ends[:, 0], ends[:, 1])
        return plan.read(dict(zip(plan.tolerances, machines.T, strict=True)), {name})[name]

    def slopes(shares, sign):
        steps = np.where(shares < 0.5, 1e-4, -1e-4)
        neighbour = read(np.vstack([shares, shares + np.diag(steps)]))
        return sign * (neighbour[1:] - neighbour[0]) / steps / size

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
