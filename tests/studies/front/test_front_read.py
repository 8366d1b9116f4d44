"""What a front whose ends are all but one design says of itself."""

import pytest

import loomopt as lo
from loomopt.studies.front import front
from loomopt.studies.front.trade import read_front
from loomopt.studies.run import run

AXES = "pulse_rms", "peak_torque"


@pytest.fixture(scope="module")
def heavy():
    """The beat-up with its weight, of which both axes' ends are 3e-7 of their size apart."""
    return lo.load("beatup").with_effect("gravity")


@pytest.mark.slow
def test_ends_that_agree_to_the_accuracy_that_was_asked_do_not_conflict(heavy):
    trade = front.trade(heavy, AXES, accuracy=1e-6)
    second_front = read_front(trade, run.run(trade))
    assert len(second_front.rows) == 1
    assert "do not conflict: one design is best in both. Its ends are 3e-07 of their size apart" in second_front.message


@pytest.mark.slow
def test_a_front_that_shown_digits_do_not_tell_from_one_design_says_so(heavy):
    trade = front.trade(heavy, AXES, points=4)
    second_front = read_front(trade, run.run(trade))
    assert len(second_front.rows) >= 4
    assert second_front.message.endswith("Its ends are 3e-07 of their size apart; 1e-08 was asked.")
