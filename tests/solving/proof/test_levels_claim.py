"""From a search to what may be said of all designs: a better box ends in a new solve, an unproven claim says why."""

import itertools
from dataclasses import replace
from types import SimpleNamespace

import pytest
from machines_in_boxes import solved

import loomopt as lo
from loomopt.jobs import registry
from loomopt.solving.nlp.point import Settings
from loomopt.solving.options import GlobalProof
from loomopt.solving.proof.levels import LevelOutcome, Levels, claimed
from loomopt.solving.search.multistart import run_search
from loomopt.solving.search.search import Search, objectives


@pytest.mark.slow
def test_a_search_that_stands_elsewhere_is_led_to_the_optimum():
    """The best of narrower bounds, taken for the best of all: its certificate there passes by itself."""
    wide = solved("beatup", "torque")
    scene = lo.load("beatup").set("bounds.l3.min", "152 mm")
    narrow = run_search(Search(wide.job, registry.of(scene).program(scene, "torque"), Settings()))
    assert narrow.best is not None
    here = narrow.best
    worse = replace(narrow, program=wide.program, candidates=(here,))
    assert worse.passed
    result, bound = claimed(worse, GlobalProof(1e-3, 60.0))
    assert bound.proven
    assert result.best is not None
    assert result.best.objectives == pytest.approx(objectives(wide.program, wide.x), rel=1e-9)
    assert result.best.objectives[0] < here.objectives[0] * (1 - 1e-3)


def test_a_promising_box_is_tried_though_no_middle_of_one_is_admissible(monkeypatch):
    """Where a level is open after half the time, a solve starts from its most promising box."""
    wide = solved("beatup", "balance")
    worse = solved("beatup", "balance", "bounds.l3.min=152 mm")
    assert worse.search.best is not None
    here = replace(worse.search, program=wide.program, candidates=(worse.search.best,))
    monkeypatch.setattr(Levels, "run", lambda self, until, say: LevelOutcome(why="open", lowest=wide.x))
    result, _ = claimed(here, GlobalProof(1e-3, 0.2))
    assert result.best is not None
    assert result.best.objectives[1] < here.best.objectives[1] - 1e-3


def test_a_better_design_that_leads_to_no_certified_optimum_is_told():
    solution = solved("beatup", "balance")
    better = LevelOutcome(better=solution.x, why="a better design was found")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Levels, "run", lambda self, until, say: better)
        search, bound = claimed(solution.search, GlobalProof())
    assert search is solution.search
    assert not bound.proven
    assert "no certified optimum was reached" in bound.why


@pytest.mark.slow
def test_time_that_is_up_leaves_the_gap_and_the_answer(monkeypatch):
    ticks = itertools.count(0.0, 0.01)
    clock = SimpleNamespace(perf_counter=lambda: next(ticks))  # a machine that is busy elsewhere changes nothing
    monkeypatch.setattr("loomopt.solving.proof.levels.time", clock)
    monkeypatch.setattr("loomopt.solving.proof.reading.time", clock)
    solution = solved("beatup-light", "balance", "gravity")
    texts: list[str] = []
    search, bound = claimed(solution.search, GlobalProof(1e-5, 0.3, texts.append))
    assert search.best is not None
    assert not bound.proven
    assert bound.gap > 1e-5
    assert bound.boxes > 0
    assert bound.seconds < 5.0
    assert "M3_fdc is open, gap" in bound.why
    assert " s" in bound.why
    assert any(text.startswith("proving M3_fdc") for text in texts)
    assert bound.as_dict()["proven"] is False


def test_nothing_is_claimed_without_a_certified_answer_or_where_it_is_refused():
    solution = solved("beatup", "balance")
    empty = Search(solution.job, solution.program, Settings())
    for search, refused, why in ((empty, "", "no certified answer"), (solution.search, "sizes", "sizes")):
        same, bound = claimed(search, GlobalProof(), refused)
        assert same is search
        assert why in bound.why
        message = bound.as_dict()
        assert (message["gap"], message["bound"], message["boxes"], message["band"]) == (None, {}, 0, {})


@pytest.mark.slow
def test_a_proof_says_all_that_scripts_read():
    solution = solved("beatup-light", "balance")
    _, bound = claimed(solution.search, GlobalProof(1e-3))
    message = bound.as_dict()
    assert set(message) == {"proven", "gap", "bound", "band", "boxes", "seconds", "why"}
    assert message["proven"] is True
    assert message["gap"] == 1e-3
    assert message["bound"]["M3_fdc"] == pytest.approx(76.9041211, rel=1e-8)
    assert message["bound"]["peak_torque"] == pytest.approx(82.33713853 * 0.999, rel=1e-8)
    assert list(message["band"]) == ["M3_fdc"]
    assert message["why"] is None
