"""solve --global: the answer is printed in any case, the exit status says whether it is proven best."""

import json

import pytest

import loomopt as lo
from loomopt.interface.cli.app import run


def solve(capsys, *words):
    status = run(["solve", *words])
    return status, *capsys.readouterr()


@pytest.mark.slow
def test_a_proven_answer_says_so_and_exits_with_0(capsys):
    status, out, _ = solve(capsys, "beatup-light", "--global")
    assert status == 0
    text = " ".join(out.split())
    assert "Proven best, gap 0.1 %: no admissible design in these bounds has |M3_fdc| below 76.9041 N*m" in text
    assert "above the best, none has peak_torque below 82.2548 N*m" in text


@pytest.mark.slow
def test_a_vanishing_level_is_told_as_such(capsys):
    _, out, _ = solve(capsys, "beatup", "--global", "--gap", "1e-2")
    assert "Proven best, gap 1 %: |M3_fdc| is 0, and no magnitude is less" in " ".join(out.split())


@pytest.mark.few(1)
@pytest.mark.parametrize(
    "words",
    [
        ("shedding", "--target", "speed"),
        ("rapier",),
        ("beatup-light", "--with", "gravity", "--time", "0.2", "--gap", "1e-5"),
    ],
)
def test_an_answer_that_is_not_proven_is_printed_and_exits_with_4(capsys, words):
    status, out, _ = solve(capsys, *words, "--global", "--json")
    assert status == 4
    answer = json.loads(out)
    assert answer["status"] == "optimal"
    assert answer["certificate"]["passed"]
    assert answer["global"]["proven"] is False
    assert answer["global"]["why"]


def test_no_proof_is_made_that_was_not_asked_for(capsys):
    status, out, _ = solve(capsys, "beatup", "--json")
    assert status == 0
    assert json.loads(out)["global"] is None


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("--gap", "0"), "--gap"),
        (("--gap", "1e-9"), "--gap"),
        (("--gap", "nan"), "--gap"),
        (("--gap", "much"), "--gap"),
        (("--time", "0"), "--time"),
        (("--time", "nan"), "--time"),
        (("--time", "inf"), "--time"),
        (("--time", "-3"), "--time"),
    ],
)
def test_a_gap_or_a_time_out_of_range_is_refused_by_name(capsys, words, named):
    status, out, err = solve(capsys, "beatup", "--global", *words)
    assert (status, out) == (2, "")
    assert named in err


def test_sizes_that_are_sold_are_not_told_by_boxes():
    answer = lo.solve(lo.load("shedding").with_effect("coil"), global_proof=True)
    assert answer.global_bound is not None
    assert not answer.global_bound.proven
    assert "sizes" in answer.global_bound.why


@pytest.mark.slow
def test_python_has_the_same_proof():
    texts: list[str] = []
    answer = lo.solve(lo.load("beatup-light"), global_proof=True, gap=1e-2, seconds=30.0, on_step=texts.append)
    assert answer.global_bound is not None
    assert answer.global_bound.proven
    assert [level.objective for level in answer.global_bound.levels] == ["M3_fdc", "peak_torque"]
    assert texts
