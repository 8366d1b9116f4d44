"""Proofs of cams with dwells of any length, and of what does not close: it ends, and says where."""

import math
import re
import time

import pytest
from support.linkage_scenes import four_bar

import loomopt as lo
from loomopt.interface.text import answers
from loomopt.solving.certificate import taylor_bounds
from loomopt.solving.proof import whole_cycle


def cam(rise, far_dwell, back, begins):
    """Return a scene of a lever on a cam."""
    follower = {"kind": "cam", "at": "D", "pin": "V", "length": "arm", "law": "cycloidal", "lift": "20 deg"}
    stretches = {"begins": begins, "rise": rise, "far_dwell": far_dwell, "return": back}
    return lo.scene(
        {
            "problem": {"name": "dwell", "job": "linkage", "title": "a dwell"},
            "operation": {"speed": "300 rpm"},
            "mechanism": {"arm": "100 mm"},
            "parts": {"D": {"kind": "pivot"}, "follower": {**follower, **stretches}},
            "output": {"angle": "follower"},
            "effects": {"inertia": {"J": "1 kg*m^2"}, "gravity": {"down": "-90 deg"}, "mass": {"V": {"mass": "2 kg"}}},
            "targets": {"t": {"least": ["peak_torque"]}},
        }
    )


@pytest.mark.few(7)
@pytest.mark.parametrize("begins", ["0 deg", "60 deg", "-170 deg"])
@pytest.mark.parametrize(
    ("rise", "far_dwell", "back"),
    [
        ("65 deg", "0 deg", "65 deg"),
        ("28 deg", "300 deg", "30 deg"),
        ("30 deg", "0 deg", "30 deg"),
        ("30 deg", "200 deg", "40 deg"),
        ("170 deg", "0 deg", "185 deg"),
    ],
    ids=str,
)
def test_dwells_of_any_length_are_proven(rise, far_dwell, back, begins):
    proofs = lo.prove(cam(rise, far_dwell, back, begins))
    assert {proof.limit: proof.status for proof in proofs.proofs if proof.status != "proven"} == {}
    assert sum(proof.boxes for proof in proofs.proofs) < 4000


def test_what_is_left_open_says_from_where_and_after_how_many_boxes(monkeypatch):
    monkeypatch.setattr(taylor_bounds, "MOST_BOXES", 3)
    proofs = lo.prove(four_bar())
    open_ = [proof for proof in proofs.proofs if proof.status == "undecided"]
    assert open_
    assert all(proof.open is not None and 0 <= proof.open < 2 * math.pi for proof in open_)
    message = answers.proofs(proofs)[2]
    assert re.fullmatch(r".* is left open from crank angle [\d.]+ deg on, after \d+ boxes\.", str(message))


def test_no_claim_gets_more_boxes_when_time_is_up(monkeypatch):
    monkeypatch.setattr(whole_cycle, "FIRST_BOXES", 5)
    monkeypatch.setattr(whole_cycle, "SECONDS", -1.0)
    proofs = lo.prove(four_bar())
    assert {proof.status for proof in proofs.proofs} == {"proven", "undecided"}
    monkeypatch.setattr(whole_cycle, "SECONDS", 1e9)
    begun = time.process_time()
    assert lo.prove(four_bar()).passed
    assert time.process_time() >= begun
