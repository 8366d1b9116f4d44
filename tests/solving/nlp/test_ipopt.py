"""One run of IPOPT: what goes in, what comes out, and what stops it."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest
from waves import objective, program

from loomopt.model.session import current
from loomopt.solving.nlp import ipopt
from loomopt.solving.nlp.ipopt import Calls
from loomopt.solving.nlp.point import Settings
from loomopt.solving.nlp.rows import Multipliers

X = {"x": 0.5, "y": 0.4}


def begun(task, nodes=1):
    """Return what a run starts from."""
    calls = Calls(task, Settings())
    sampler = calls.sampler(X)
    peaks = calls.peaks(sampler)
    chosen = [of[:nodes] for of in peaks]
    nlp = calls.nlp(sampler, chosen, warm=False)
    return calls, nlp, sampler, calls.first_extra(nlp, sampler), chosen


def run(task):
    calls, nlp, sampler, extra, nodes = begun(task)
    return ipopt.run(calls, nlp, sampler, X, extra, nodes, Multipliers())


def test_the_least_of_a_bowl_below_a_line():
    answer = run(program([("sum", 1, 4.0)]))
    assert answer.status == "Solve_Succeeded"
    assert answer.x == pytest.approx({"x": 2.5, "y": 1.5}, abs=1e-8)
    assert answer.multipliers.lam_g == pytest.approx([1.0], abs=1e-7), "what the bowl gains per shift of the line"
    assert answer.multipliers.lam_x == pytest.approx([0.0, 0.0], abs=1e-7)
    assert len(answer.extra) == 0
    assert answer.iterations > 0
    assert answer.value == pytest.approx(0.5, abs=1e-8)


def test_epigraph_variables_are_told_apart_from_the_design():
    answer = run(program([("y", -1, 2.0)], (objective("sum", "magnitude"),)))
    assert answer.extra == pytest.approx([0.0], abs=1e-8)
    assert answer.x["x"] + answer.x["y"] == pytest.approx(0.0, abs=1e-8)


def test_an_answer_is_a_start_for_the_next():
    task = program([("sum", 1, 4.0)])
    cold = run(task)
    calls, nlp, sampler, extra, nodes = begun(task)
    warm = ipopt.run(calls, nlp, sampler, cold.x, extra, nodes, cold.multipliers)
    assert warm.x == pytest.approx(cold.x, abs=1e-8)
    assert warm.iterations <= 5 < cold.iterations + 5


def test_more_equalities_than_variables_are_not_solved():
    answer = run(program([("x", 0, 1.0), ("y", 0, 1.0), ("sum", 0, 2.0)]))
    assert answer.status == "Not_Enough_Degrees_Of_Freedom"
    assert (answer.x, answer.iterations) == (X, 0)
    assert not answer.multipliers.lam_x.any()
    assert answer.multipliers.limits == {0: 0.0, 1: 0.0, 2: 0.0}


@pytest.mark.parametrize("status", ["User_Requested_Stop", "NonIpopt_Exception_Thrown"])
def test_a_stop_from_outside_is_passed_on(status, monkeypatch):
    calls, nlp, sampler, extra, nodes = begun(program())
    empty = {name: np.zeros(nlp.rows.size + 2) for name in ("x", "lam_x", "lam_g")}

    class Stopped(SimpleNamespace):
        def __call__(self, **arguments):
            return empty

    stopped = Stopped(stats=lambda: {"return_status": status})
    monkeypatch.setattr(nlp, "solver", lambda warm, settings: stopped)
    with pytest.raises(KeyboardInterrupt):
        ipopt.run(calls, nlp, sampler, X, extra, nodes, Multipliers())


def test_evaluations_are_counted_with_the_nodes_they_look_at(monkeypatch):
    task = program([("wave", 1, 3.0), ("circle", 1, 2.0)])
    calls, nlp, sampler, extra, nodes = begun(task)
    calls_made = {"n_call_nlp_f": 5, "n_call_nlp_g": 7, "n_call_total": 99, "iter_count": 4}
    answer = {"x": np.zeros(2), "lam_x": np.zeros(2), "lam_g": np.zeros(nlp.rows.size), "f": np.array([[0.25]])}

    class Counted(SimpleNamespace):
        def __call__(self, **arguments):
            return answer

    counted = Counted(stats=lambda: {"return_status": "Solve_Succeeded", **calls_made})
    monkeypatch.setattr(nlp, "solver", lambda warm, settings: counted)
    before = current().positions
    assert ipopt.run(calls, nlp, sampler, X, extra, nodes, Multipliers()).iterations == 4
    assert current().positions - before == 12 * 2
    before = current().positions
    del calls_made["iter_count"]
    assert ipopt.run(calls, nlp, sampler, X, extra, [[], []], Multipliers()).iterations == 0, (
        "it did not come to iterate"
    )
    assert current().positions - before == 12, "a program without nodes is one position"


def test_casadis_own_warning_on_ctrl_c_is_left_out_and_nothing_else(capsys):
    pieces = ["CasADi - ", "2026-01-01", ' WARNING("', "KeyboardInterruptException", '") [', "ipopt_nlp.cpp:132", "]\n"]
    other = ["CasADi - ", "2026-01-01", ' WARNING("', "nlp_f failed", '")', "\n", "start 2 of 9", "\n"]
    stream = sys.stderr
    with ipopt._no_warning_on_ctrl_c():
        for text in (*pieces, *other):
            sys.stderr.write(text)
        assert not sys.stderr.isatty()
    assert sys.stderr is stream
    assert capsys.readouterr().err == "".join(other)


def test_a_closed_stream_stays_closed(monkeypatch):
    monkeypatch.setattr(sys, "stderr", None)
    with ipopt._no_warning_on_ctrl_c():
        assert sys.stderr is None
