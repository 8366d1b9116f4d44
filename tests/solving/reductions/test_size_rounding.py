"""Rounding: the best of a whole lattice of sizes beside one computed apart, and beside solves of every point.

Reference values: all 1 197 735 points read apart, each with the counterweight that balances it.
"""

import json
import re
from dataclasses import replace

import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.interface.files import answer_file
from loomopt.interface.text import answers
from loomopt.jobs import registry
from loomopt.solving import engine
from loomopt.solving.nlp.point import Settings
from loomopt.solving.optimum import Task
from loomopt.solving.reductions import size_rounding
from loomopt.solving.reductions.size_rounding import SizeRounding, read_sizes


def rounded(problem, steps, target=None, **changes):
    scene = registry.load(problem).update(changes)
    return engine.solve(scene, target, reductions=[SizeRounding(steps)])


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("step", "points", "reaching", "links", "peak"),
    [
        ("0.5 mm", 1_197_735, 5220, (30.0, 75.5, 149.0, 167.0), 88.717207368),
        ("1 mm", 87_048, 487, (30.0, 76.0, 149.0, 167.0), 88.795301023),
    ],
)
def test_the_whole_lattice_of_links(step, points, reaching, links, peak):
    result = rounded("beatup", {"l*": step})
    assert (result.status, result.rounded.points, result.rounded.reaching) == ("optimal", points, reaching)
    assert [1e3 * result.design[name] for name in ("l1", "l2", "l3", "l4")] == pytest.approx(links, abs=1e-12)
    assert result.figures["peak_torque"] == pytest.approx(peak, abs=6e-10)
    assert result.certificate.passed
    assert result.rounded.boxes == 0
    assert f"None of the {points} points of the lattice is better" in result.message
    if step == "0.5 mm":
        assert result.design["m4e"] == pytest.approx(6.34638663, abs=6e-9)
        assert result.as_dict()["rounded"]["cost"]["peak_torque"] == pytest.approx(0.0277938762, abs=2e-9)
    bound = next(limit for limit in result.limits if limit.name == "l1")
    assert (bound.min, bound.max) == (0.03, 0.035)


def test_boxes_of_sizes_find_what_solving_every_point_finds():
    scene = registry.load("beatup").update({"bounds.l2": {"min": "75 mm", "max": "77 mm"}})
    answer = engine.solve(scene, "pulse", reductions=[SizeRounding({"l2": "1 mm"})])
    items = [engine.solve(scene.set("bounds.l2", f"{size} mm"), "pulse") for size in (75, 76, 77)]
    best = min(items, key=lambda first: first.figures["pulse_rms"] if first.status == "optimal" else float("inf"))
    assert answer.rounded.boxes > 0
    assert answer.rounded.gap == 0.0
    assert answer.design["l2"] == best.design["l2"]
    assert answer.figures["pulse_rms"] == pytest.approx(best.figures["pulse_rms"], rel=1e-9)


def test_sizes_that_are_sold():
    result = rounded("shedding", None, stock={"X0": ["30 mm", "70 mm"]})
    assert result.design["X0"] == 0.07
    alone = engine.solve(registry.load("shedding").set("bounds.X0", "70 mm"))
    assert result.figures["K1"] == pytest.approx(alone.figures["K1"], rel=1e-9)
    assert result.rounded.cost(result)["K1"] > 0.0


def test_from_python_and_the_scene():
    scene = registry.load("beatup").update({"steps": dict.fromkeys(("l1", "l2", "l3", "l4"), "1 mm")})
    answer = lo.solve(scene, round_to=True)
    assert answer.figures["peak_torque"] == pytest.approx(88.795301023, abs=6e-10)
    assert answer.evaluate().admissible


@pytest.mark.parametrize(
    ("steps", "message"),
    [
        ({"q": "1 mm"}, "q is not a free number"),
        ({"l1": "20 mm"}, "no size of l1 lies within its bounds"),
        ({"l1": "1 kg"}, "l1"),
        ({"l1": "-1 mm"}, "out of range"),
        (True, "no sizes are given"),
    ],
)
def test_what_cannot_be_rounded_is_refused(steps, message):
    with pytest.raises(BadInput, match=message):
        lo.solve("beatup", round_to=steps)


def test_sizes_and_backoff_are_not_sought_together():
    scene = registry.load("beatup").update({"tolerances": {"l1": "0.06 mm"}})
    with pytest.raises(BadInput, match="--round and --robust cannot be combined"):
        lo.solve(scene, round_to={"l1": "1 mm"}, robust=3)


def test_a_proof_of_all_designs_is_none_of_those_in_sizes():
    with pytest.raises(BadInput, match="--global cannot be combined with --round"):
        lo.solve("beatup", round_to={"l*": "0.5 mm"}, global_proof=True)


def test_a_lattice_without_an_admissible_point():
    result = rounded("beatup", {"l1": "15 mm", "l2": "1 mm", "l3": "70 mm", "l4": "1 mm"})
    assert result.status == "infeasible"
    assert "keeps all limits" in result.message
    assert "the given design is the optimum without sizes" in result.message


@pytest.mark.slow
def test_sizes_that_leave_a_goal_out_of_reach_ask_for_a_band():
    links = {"bounds.l1": "30 mm", "bounds.l2": "75.5 mm", "bounds.l3": "149 mm", "bounds.l4": "167 mm"}
    steps = {"m4e": "2 kg", "r4e": "40 mm"}
    with pytest.raises(BadInput, match=r"no sizes give M3_fdc exactly.*deviation.*\[accept\] M3_fdc = \""):
        rounded("beatup", steps, **links)
    result = rounded("beatup", steps, **links, **{"accept.M3_fdc": "50 N*m"})
    assert result.status == "optimal"
    assert (result.design["m4e"], result.design["r4e"]) == (6.0, 0.08)


def test_sizes_are_no_limits_and_the_file_agrees_with_its_design(tmp_path):
    links = {"bounds.l1": "30 mm", "bounds.l3": "149 mm", "bounds.l4": "167 mm"}
    result = rounded("beatup", {"l2": "0.5 mm"}, **links)
    assert "l2" not in {price.limit for price in result.binding}
    assert "m4e, r4e chosen so that M3_fdc is least" in result.message
    path = tmp_path / "rounded.json"
    path.write_text(json.dumps(result.as_dict()))
    assert answer_file.read_answer(path).doubts == ()


def test_without_a_limit_beside_the_sizes():
    result = rounded("shedding", {"K1": "500 N/m", "X0": "10 mm"})
    assert result.binding == ()
    assert answers.binding(result) == "No limit binds except the sizes."


def test_a_pattern_leaves_what_is_held():
    scene = registry.load("rapier")
    assert not scene.bounds["l1"].free
    assert set(read_sizes(scene, {"l*": "1 mm"})) == {"l4", "l5", "l6", "l3p"}
    with pytest.raises(BadInput, match="l1 is not free"):
        read_sizes(scene, {"l1": "1 mm"})


def test_progress_says_boxes_best_and_gap_through_every_solve():
    """A box's own solves never take the line: what is said names the box, what is best and how much better may be."""
    texts: list[str] = []
    scene = registry.load("beatup").update({"bounds.l1": "30 mm", "bounds.l4": "167 mm"})
    lo.solve(scene, "pulse", round_to={"l2": "2 mm", "l3": "2 mm"}, on_step=texts.append)
    boxes = [line for line in texts if line.startswith("sizes: box ")]
    assert boxes
    assert all(re.match(r"sizes: box \d+ of up to 600; ", line) for line in boxes)
    assert any(re.search(r"; none found yet, at best pulse_rms [\d.]+ N\*m", line) for line in boxes)
    found = [line for line in boxes if re.search(r"; best pulse_rms [\d.]+ N\*m; gap [\d.e-]+ N\*m", line)]
    assert found
    assert max(line.index("gap ") + 12 for line in found) < 79, "a terminal of 80 columns shows the gap"
    first, last = texts.index(boxes[0]), len(texts) - texts[::-1].index(boxes[-1])
    assert texts[first:last] == boxes
    assert texts[-1].startswith("solving with the best sizes")


def test_the_gap_is_that_of_the_first_level_that_has_one_and_rounding_is_0():
    scene = registry.load("beatup")
    lattice = size_rounding.Lattice(Task(scene, "balance", Settings()), read_sizes(scene, {"l2": "2 mm"}))
    bound = engine.solve(scene, "balance", starts=1)
    first = replace(bound, figures={**bound.figures, "M3_fdc": 0.25, "peak_torque": 91.0})
    second = replace(bound, figures={**bound.figures, "M3_fdc": 1e-13, "peak_torque": 91.0})
    bound = replace(bound, figures={**bound.figures, "M3_fdc": -1e-12, "peak_torque": 90.0})
    assert size_rounding._progress(lattice, None, bound) == "none found yet, at best M3_fdc 0 N*m, peak_torque 90 N*m"
    best = "best M3_fdc 0.25 N*m, peak_torque 91 N*m"
    assert size_rounding._progress(lattice, first, bound) == f"{best}; gap M3_fdc 0.25 N*m"
    best = "best M3_fdc 0 N*m, peak_torque 91 N*m"
    assert size_rounding._progress(lattice, second, bound) == f"{best}; gap peak_torque 1 N*m"
    assert size_rounding._progress(lattice, bound, bound).endswith("; gap 0")


def test_a_box_that_cannot_be_solved_is_told():
    """It is tried from all starts too; what lies in it is not said to be no better."""
    scene = registry.load("beatup").update({"bounds.l1": "30 mm", "bounds.l4": "167 mm"})
    nominal = engine.solve(scene, "pulse")
    task = Task(scene, "pulse", Settings())
    lattice = size_rounding.Lattice(task, read_sizes(scene, {"l2": "2 mm", "l3": "2 mm"}))
    tried = []

    def solve(task):
        tried.append(task)
        answer = engine.solve(task.scene, "pulse", near=task.near)
        return answer if len(tried) == 1 else replace(answer, status="failed")

    best = size_rounding._branch(lattice, nominal, solve)
    assert (best.point, best.unsolved, best.boxes) == (None, 2, 3)
    assert [len(task.near) for task in tried[1:]] == [1, 0, 1, 0]
    assert size_rounding._without_sizes(lattice, nominal, best).status == "failed"
    found = best._replace(point={"l2": 0.08, "l3": 0.16})
    message = size_rounding._explain(lattice, nominal, nominal, found).message
    assert "2 of 3 boxes of sizes could not be solved" in message
    assert "is better" not in message


def test_a_step_of_the_call_that_meets_a_stock_of_the_file_is_told_by_the_files_key():
    scene = registry.load("shedding").set("stock.X0", ["30 mm", "70 mm"])
    with pytest.raises(BadInput, match=r"stock\.X0.*Leave X0 out of --round") as caught:
        lo.solve(scene, round_to={"X0": "5 mm"})
    assert "steps." not in str(caught.value)


@pytest.mark.parametrize(
    ("change", "report"), [({"bounds.l1": "31 mm"}, r"bounds\.l1"), ({"bounds.l4.free": False}, r"bounds\.l4")]
)
def test_a_step_of_the_call_is_told_by_keys_of_the_file(change, report):
    with pytest.raises(BadInput, match=report) as caught:
        lo.solve(registry.load("beatup").update(change), round_to={"l1": "0.5 mm", "l4": "50 mm"})
    assert "steps." not in str(caught.value)
