"""Sentence on an optimum of a linkage: balanced, out of reach, or the levels in order."""

import pytest

import loomopt as lo
from loomopt.jobs.linkage.job import JOB

SLEY = lo.load("sixbar-sley")
FIGURES = {"moment.front": 0.0, "peak_torque": 168.0, "change": 0.05, "end": 4.0}


@pytest.mark.parametrize(
    ("target", "front", "sentence"),
    [
        (
            "balance",
            0.0,
            "Balanced: the moment of sley at front is zero, and then the least peak_torque is 168 N*m.",
        ),
        (
            "balance",
            -12.5,
            "Balance is out of reach: the moment of sley nearest to zero at front is -12.5 N*m, and then the least "
            "peak_torque is 168 N*m.",
        ),
        ("retrofit", 0.0, "Balanced: the moment of sley at front is zero, and then the least change is 0.05."),
        ("torque", 3.0, "The least peak_torque is 168 N*m."),
        ("dwell", 3.0, "The most end is sought."),
    ],
)
def test_the_sentence_says_whether_the_output_is_balanced(target, front, sentence):
    assert JOB.say(SLEY, target, FIGURES | {"moment.front": front}) == sentence


def test_a_target_that_seeks_a_load_alone_has_a_sentence_of_its_own():
    scene = SLEY.update({"targets.balance": {"least": ["moment.front"]}})
    assert JOB.say(scene, "balance", FIGURES) == "Balanced: the moment of sley at front is zero."
