"""An NLP with lifted variables, seen from outside, is the one without: its rows, slopes, curvatures and answers."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from steps import COUNT, program

from loomopt.solving.nlp import exchange
from loomopt.solving.nlp.ipopt import Calls, IterationCallback
from loomopt.solving.nlp.point import Elastic, Settings
from loomopt.solving.nlp.transcribe import Elimination, Entries

LIMITS = (("wave", 1, 1.5), ("swing", 1, 2.0), ("h3", 1, 1.2), ("h7", 0, 1.0))
BENDS = (0.0, 0.05)


def put(lifted, bend, elastic=False):
    """Return calls, NLP and arguments at a design away from the start, its two highest nodes in each family."""
    task = program(bend, lifted, LIMITS)
    calls = Calls(task, Settings(), Elastic() if elastic else None)
    x = {name: 0.09 * k - 0.4 for k, name in enumerate(task.starts[0])}
    sampler = calls.sampler(x)
    nodes = [[e for e in of if 0.0 < e.u < 1.0][:2] for of in calls.peaks(sampler)]
    nlp = calls.nlp(sampler, nodes, warm=False)
    extra = np.linspace(0.1, 0.9, nlp.rows.extras)
    return calls, nlp, calls.arguments(nlp, sampler, x, extra, nodes), nodes


def shared(nlp):
    """Return which rows there are without stations, in both NLPs alike: single rows, and two slots of each family."""
    places = np.arange(nlp.rows.size)
    return [*nlp.rows.limit_rows(places), *nlp.rows.node_rows(places)[:, :2].ravel()]


@pytest.mark.parametrize("bend", BENDS)
@pytest.mark.parametrize("elastic", [False, True])
def test_rows_and_derivatives_are_those_without_lifted_variables(bend, elastic):
    (_, nlp, ours, nodes), (_, plain, theirs, same) = (put(lifted, bend, elastic) for lifted in (True, False))
    assert nodes == same
    assert isinstance(nlp.jacobian.__self__, Elimination)
    assert ours["x0"] == pytest.approx(theirs["x0"], abs=0)
    (rows, slopes), (expected, wanted) = nlp.jacobian(ours["x0"], ours["p"]), plain.jacobian(theirs["x0"], theirs["p"])
    mine, others = shared(nlp), shared(plain)
    assert rows[mine] == pytest.approx(np.asarray(expected).ravel()[others], rel=1e-14, abs=1e-14)
    assert slopes[mine] == pytest.approx(np.asarray(wanted)[others], rel=1e-13, abs=1e-13)
    (value, slope), (least, steepest) = (item.gradient(a["x0"], a["p"]) for item, a in ((nlp, ours), (plain, theirs)))
    assert value == pytest.approx(float(least), rel=1e-14)
    assert slope == pytest.approx(np.asarray(steepest).ravel(), rel=1e-13, abs=1e-13)
    prices, other = np.zeros(nlp.rows.size), np.zeros(plain.rows.size)
    prices[mine] = other[others] = np.linspace(-1.0, 2.0, len(mine))
    bends = nlp.curvature(ours["x0"], ours["p"], 0.7, prices)
    curved = np.asarray(plain.curvature(theirs["x0"], theirs["p"], 0.7, other))
    assert np.abs(curved).max() > 1.0
    assert bends == pytest.approx(curved, rel=1e-12, abs=1e-12)
    assert not np.tril(bends, -1).any()


@pytest.mark.parametrize("bend", BENDS)
def test_stations_have_the_rows_of_nodes_at_their_corners(bend):
    calls, nlp, arguments, _ = put(True, bend)
    rows, slopes = nlp.jacobian(arguments["x0"], arguments["p"])
    sampler = calls.sampler(calls.design(arguments["x0"]))
    raised = [1.25 if 1 <= k <= 6 else 1.0 for k in range(COUNT)]
    heights = np.array([sampler.given.values[f"h{k}"] for k in range(COUNT)])
    assert nlp.rows.station_rows(rows, 0) == pytest.approx(heights * raised - 1.5, rel=1e-14)
    swings = np.abs(heights * raised + sampler.values["x0"] ** 2 / 4)
    assert heights.min() < -0.3 < 0.3 < heights.max()
    assert nlp.rows.station_rows(rows, 1) == pytest.approx(swings - 2.0, rel=1e-13)
    step = 1e-6
    for k in (0, 5):
        ends = [nlp.jacobian(arguments["x0"] + sign * step * np.eye(COUNT)[k], arguments["p"])[0] for sign in (1, -1)]
        assert slopes[:, k] == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-8)


@pytest.mark.parametrize("bend", BENDS)
@pytest.mark.parametrize("limits", [LIMITS[:3], (("wave", 1, 1.5), ("h9", -1, 1.45)), (("swing", 1, 1.3),)])
@pytest.mark.few(1)
def test_answers_are_those_without_lifted_variables(bend, limits):
    ours, theirs = (solved(program(bend, lifted, limits)) for lifted in (True, False))
    assert ours.usable
    assert theirs.usable
    assert list(ours.x.values()) == pytest.approx(list(theirs.x.values()), abs=1e-9)
    assert max(ours.violation, theirs.violation) <= 1e-10


def solved(task, **more):
    return exchange.solve(task, task.starts[0], Settings(), **more)


def test_an_answer_is_a_start_for_the_next_and_what_binds_follows():
    task = program(0.05, limits=LIMITS[:3])
    first = solved(task)
    other = replace(task, limits=tuple(replace(limit, value=limit.value * 1.02) for limit in task.limits))
    warm, cold = solved(other, warm=first), solved(other)
    assert (warm.iterations, warm.usable) == (0, True), "by pivots alone"
    assert list(warm.x.values()) == pytest.approx(list(cold.x.values()), abs=1e-9)


def test_a_warm_start_has_the_multipliers_of_what_is_lifted():
    """They follow from those of the rows; from the answer itself IPOPT has nothing to do."""
    _, nlp, arguments, _ = put(True, 0.05)
    solver = nlp.solver(False, Settings())
    message = solver(**arguments)
    assert solver.stats()["success"]
    warm = nlp.solver(True, Settings())
    again = warm(**{**arguments, "x0": message["x"], "lam_x0": message["lam_x"], "lam_g0": message["lam_g"]})
    assert warm.stats()["iter_count"] <= 2 < solver.stats()["iter_count"]
    assert again["x"] == pytest.approx(message["x"], abs=1e-9)
    full = np.concatenate([message["x"], nlp.jacobian.__self__.start(message["x"], arguments["p"])])
    of = nlp.jacobian.__self__
    prices = np.concatenate([message["lam_g"], of.prices(message["x"], arguments["p"], 1.0, message["lam_g"])])
    slopes = np.asarray(of.functions["jac_g"](full, arguments["p"])[1])
    slope = np.asarray(of.functions["grad_f"](full, arguments["p"])[1]).ravel()
    left = slope + prices @ slopes
    left[: len(message["x"])] += message["lam_x"]
    assert np.abs(left).max() < 1e-8


def test_iterations_are_reported():
    seen: list[int] = []
    task = program(0.05)
    point = exchange.solve(task, task.starts[0], Settings(callback=IterationCallback(seen.append)))
    assert (seen[0], max(seen)) == (0, point.iterations)


def test_the_least_relaxation_is_that_without_lifted_variables():
    """1.25 h3 must come below 1, h3 above 1.5: cheapest is to let h3 give way."""
    limits = (("wave", 1, 1.0), ("h3", -1, 1.5))
    ours, theirs = (solved(program(0.0, lifted, limits), elastic=Elastic()) for lifted in (True, False))
    assert ours.usable
    assert ours.relaxation == pytest.approx({1: 0.7}, abs=1e-9)
    assert theirs.relaxation == pytest.approx({1: 0.7}, abs=1e-9)


def test_entries_are_those_of_the_dense_matrix():
    generator = np.random.default_rng(0)
    dense = generator.normal(size=(7, 5)) * (generator.uniform(size=(7, 5)) < 0.4)
    dense[3] = 0.0
    sparse = ca.sparsify(ca.DM(dense))
    assert 0 < sparse.nnz() < 20
    values = np.array(sparse.nonzeros())
    part = Entries(sparse.sparsity(), range(1, 6), range(1, 5))
    assert part.dense(values) == pytest.approx(dense[1:6, 1:5], abs=0)
    right = generator.normal(size=(4, 3))
    assert part.times(values, right) == pytest.approx(dense[1:6, 1:5] @ right, abs=1e-14)
    vector = generator.normal(size=5)
    assert part.transposed_times(values, vector) == pytest.approx(dense[1:6, 1:5].T @ vector, abs=1e-14)
