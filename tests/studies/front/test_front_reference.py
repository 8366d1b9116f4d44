"""The fronts among the reference results: the numbers that are known of them, and that a change of any is named."""

import math
import shutil

import pytest

from loomopt.jobs.registry import load
from loomopt.scenes import packaged
from loomopt.studies import check
from loomopt.studies import check as study

NAME = "shedding.K1-against-X0.csv"
KNOWN = {
    "beatup.peak_torque-against-m4e.csv": [
        ("m4e [kg]", "peak_torque [N*m]", {0.0: 96.540355060, 6.286039692: 88.689413492})
    ],
    "rapier.peak_acceleration-against-dwell.csv": [
        ("dwell [rad]", "peak_acceleration [m/rad^2]", {0.0818906: 0.463702332, math.radians(50.880292): 1.083566205})
    ],
    NAME: [("X0 [m]", "K1 [N/m]", {0.08: 102602.609425, 494.095e-6: 1e6})],
}
"""File → its axes, and published ends."""


def front(name):
    return check.read_reference(packaged.results_path() / name)


@pytest.fixture
def copy(tmp_path):
    """Return a folder with a copy of one front."""
    shutil.copy(packaged.results_path() / NAME, tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def shedding():
    """Return the front of the scene, built once."""
    return check.reference_trade(load("shedding"))


def differences(folder, trade):
    return [text for _, result in check.check_front(trade, check.read_reference(folder / NAME)) for text in result]


def edited(folder, line, column, new):
    """Rewrite a cell of a front: its line, from the end where negative, its column's name, and text of the old one."""
    path = folder / NAME
    lines = path.read_text(encoding="utf-8").splitlines()
    head = sum(item.startswith("#") for item in lines)
    place = next(k for k, name in enumerate(lines[head].split(",")) if name.split(" [")[0] == column)
    chosen = head + 1 + line if line >= 0 else line
    cells = lines[chosen].split(",")
    cells[place] = new(cells[place])
    lines[chosen] = ",".join(cells)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


@pytest.mark.parametrize("name", KNOWN)
def test_ends_of_the_fronts_are_the_published_ones(name):
    ((second, first, ends),) = KNOWN[name]
    result = front(name)
    paid, optimised = ([float(value) for value in result[axis]] for axis in (second, first))
    assert paid == sorted(paid)
    assert [paid[0], paid[-1]] == pytest.approx(sorted(ends), rel=1e-6, abs=1e-9)
    assert [optimised[0], optimised[-1]] == pytest.approx([ends[key] for key in sorted(ends)], rel=2e-9)
    assert set(result["status"]) == {"optimal"}
    assert len(result) > check.POINTS


def test_a_front_stands_for_the_scene_that_is_named_after_its_job():
    stands = {name for name in packaged.problems() if check.reference_trade(load(name))}
    assert stands == {"beatup", "rapier", "shedding"}


def test_five_designs_are_solved_again_and_nothing_differs(shedding, copy):
    result = list(check.check_front(shedding, check.read_reference(copy / NAME)))
    assert result == [("optimal", [])] * 5


def larger(by):
    return lambda value: repr(float(value) * (1 + by))


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("line", "column", "new", "named"),
    [
        (-1, "K1", larger(2e-8), "X0 80 mm: K1 [N/m]: 102602.6"),
        (0, "contact_max", larger(1e-5), "contact_max [N]"),
        (0, "K1 per X0", larger(1e-5), "K1 per X0 ["),
        (-1, "touched", lambda _: "X0 min", "touched: "),
        (-1, "status", lambda _: "infeasible", "status: optimal, reference infeasible"),
    ],
)
def test_a_number_that_is_changed_is_named_with_its_point(shedding, copy, line, column, new, named):
    edited(copy, line, column, new)
    (result,) = differences(copy, shedding)
    assert named in result
    assert result.startswith("X0 ")


def test_a_number_between_the_ends_counts_too(shedding, copy):
    values = [float(value) for value in check.read_reference(copy / NAME)["X0 [m]"]]
    middle = min(range(len(values)), key=lambda k: abs(values[k] - (values[0] + values[-1]) / 2))
    edited(copy, middle, "K1", larger(2e-8))
    (result,) = differences(copy, shedding)
    assert result.startswith("X0 40")
    assert "K1 [N/m]" in result


def test_a_missing_front_or_column_is_named(shedding, copy, monkeypatch):
    path = copy / NAME
    path.write_text(path.read_text(encoding="utf-8").replace("K1 per X0", "K1 by X0"), encoding="utf-8")
    assert len(differences(copy, shedding)) == 10
    path.unlink()
    monkeypatch.setattr(study, "available_targets", lambda scene: [])
    (outcome,) = study.check(["shedding"], copy)
    assert (outcome.target, outcome.differences) == ("K1 against X0", (f"no reference table {NAME}",))


def test_the_check_names_front_point_and_column(copy, monkeypatch):
    edited(copy, -1, "K1", larger(-1e-6))
    monkeypatch.setattr(study, "available_targets", lambda scene: [])
    texts: list[str] = []
    (outcome,) = study.check(["shedding"], copy, texts.append)
    assert texts == ["solving shedding, K1 against X0"]
    assert (outcome.problem, outcome.target, outcome.status) == ("shedding", "K1 against X0", "optimal")
    assert outcome.differences[0].startswith("X0 80 mm: K1 [N/m]: ")


@pytest.mark.slow
def test_a_front_is_written_beside_the_other_references(tmp_path, monkeypatch):
    monkeypatch.setattr(study, "available_targets", lambda scene: [])
    assert study.write(tmp_path, ["shedding", "shedding-printed-travel"]) == [tmp_path / NAME]
    head = [line for line in (tmp_path / NAME).read_text(encoding="utf-8").splitlines() if line.startswith("# ")]
    report = dict(line[2:].split(": ", 1) for line in head)
    assert report["scene_hash"] == load("shedding").hash
    assert (report["target"], report["points"]) == ("none", "12")
    (again,) = study.check(["shedding"], tmp_path)
    assert again.differences == ()
