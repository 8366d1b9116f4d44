"""Proofs of dyads in a row, each driven by the rocker before it: enclosures do not widen along the chain."""

import math

import pytest

import loomopt as lo
from loomopt.interface.text import answers
from loomopt.solving.proof import whole_cycle

CHAINS = [
    (
        37.7,
        (171.1, 136.7, 138.4),
        (382.1, 217.6, 141.0),
        (512.2, 140.8, 121.1),
        (672.1, 195.5, 126.8),
        (792.2, 149.1, 146.8),
    ),
    (
        39.3,
        (203.5, 183.0, 127.0),
        (354.3, 164.8, 120.7),
        (513.7, 181.2, 159.5),
        (647.4, 151.4, 159.9),
        (847.1, 182.8, 150.7),
    ),
    (
        34.3,
        (194.2, 191.3, 154.2),
        (360.8, 212.1, 124.9),
        (505.5, 156.1, 117.4),
        (638.2, 80.2, 147.1),
        (779.1, 110.2, 158.2),
    ),
]
"""Crank, then pivot, rod and rocker of each dyad, mm: every transmission angle stays between 25 and 155 deg."""


def chain(crank, *dyads):
    """Scene of rockers in a row on one line; dyads: pivot's place, rod and rocker, mm."""
    numbers, previous = {"l1": f"{crank} mm"}, "B0"
    parts: dict[str, dict[str, object]]
    parts = {"A": {"kind": "pivot"}, "crank": {"kind": "crank", "at": "A", "pin": "B0", "length": "l1"}}
    for k, (pivot, rod, rocker) in enumerate(dyads, 1):
        numbers |= {f"x{k}": f"{pivot} mm", f"r{k}": f"{rod} mm", f"s{k}": f"{rocker} mm"}
        links = {f"rod{k}": f"r{k}", f"rocker{k}": f"s{k}"}
        dyad: dict[str, object] = {
            "kind": "dyad",
            "joins": [previous, f"D{k}"],
            "pin": f"B{k}",
            "side": "left",
            "links": links,
        }
        parts |= {f"D{k}": {"kind": "pivot", "x": f"x{k}"}, f"dyad{k}": dyad}
        previous = f"B{k}"
    angles = {f"mu.dyad{k}": {"min": "20 deg"} for k in range(1, len(dyads) + 1)}
    return lo.scene(
        {
            "problem": {"name": "chain", "job": "linkage", "title": "dyads in a row"},
            "operation": {"speed": "300 rpm"},
            "mechanism": numbers,
            "parts": parts,
            "output": {"angle": f"rocker{len(dyads)}"},
            "effects": {"inertia": {"J": "0.1 kg*m^2"}},
            "bounds": {"l1": {"min": f"{0.9 * crank} mm", "max": f"{1.1 * crank} mm"}},
            "limits": {"peak_torque": {"max": "1000 kN*m"}, **angles},
            "targets": {"t": {"least": ["peak_torque"]}},
        }
    )


@pytest.mark.slow
@pytest.mark.parametrize("sizes", CHAINS, ids=["a", "b", "c"])
def test_five_dyads_in_a_row_are_proven(monkeypatch, sizes):
    monkeypatch.setattr(whole_cycle, "SECONDS", 1e9)
    proof_of = lo.prove(chain(*sizes))
    assert {proof.limit: proof.status for proof in proof_of.proofs if proof.status != "proven"} == {}
    assert sum(proof.boxes for proof in proof_of.proofs) < 10_000


LEG = {
    "m": 150,
    "j": 500,
    "b": 415,
    "k": 619,
    "c": 393,
    "d": 401,
    "e": 558,
    "f": 394,
    "g": 367,
    "h": 657,
    "i": 490,
    "x": -380,
    "y": -78,
}
"""Lengths of Jansen's leg, mm [Jansen, The Great Pretender, 2007]."""


def leg():
    """Scene of a leg of five dyads, of which two close triangles on a link of another: their angles are constant."""

    def dyad(joins, pin, side, *links):
        return {"kind": "dyad", "joins": joins, "pin": pin, "side": side, "links": {f"link_{n}": n for n in links}}

    return lo.scene(
        {
            "problem": {"name": "leg", "job": "linkage", "title": "a leg"},
            "operation": {"speed": "60 rpm"},
            "mechanism": {name: f"{length} mm" for name, length in LEG.items()},
            "parts": {
                "O": {"kind": "pivot"},
                "P": {"kind": "pivot", "x": "x", "y": "y"},
                "crank": {"kind": "crank", "at": "O", "pin": "W", "length": "m"},
                "up": dyad(["W", "P"], "X", "right", "j", "b"),
                "low": dyad(["W", "P"], "Y", "left", "k", "c"),
                "knee": dyad(["X", "P"], "V", "right", "e", "d"),
                "foot": dyad(["V", "Y"], "U", "right", "f", "g"),
                "toe": dyad(["U", "Y"], "T", "right", "h", "i"),
            },
            "output": {"y": "T"},
            "targets": {"lift": {"least": ["peak_acceleration"]}},
        }
    )


def test_constant_angles_of_triangles_on_a_link_are_proven_in_few_boxes():
    """Their joints keep their distance, which the formula knows: no box of crank angles is halved for them."""
    proof_of = lo.prove(leg())
    assert {proof.limit: proof.status for proof in proof_of.proofs if proof.status != "proven"} == {}
    boxes = {proof.name: proof.boxes for proof in proof_of.proofs}
    assert boxes["mu.knee"] == boxes["mu.toe"] == 2
    assert sum(boxes.values()) < 4000
    b, d, e = (LEG[name] for name in "bde")
    cosine = (d**2 + e**2 - b**2) / (2 * d * e)
    assert lo.evaluate(leg()).figures["mu.knee"] == pytest.approx(math.acos(abs(cosine)), rel=1e-14)


@pytest.mark.slow
def test_a_long_chain_with_little_time_says_what_is_open(monkeypatch):
    """Time is up at once: every claim has its first boxes, those that are open have no more."""
    monkeypatch.setattr(whole_cycle, "SECONDS", -1.0)
    proofs = lo.prove(chain(*CHAINS[0])).proofs
    assert {proof.status for proof in proofs} == {"proven", "undecided"}
    assert all(proof.open is not None for proof in proofs if proof.status == "undecided")
    assert max(proof.boxes for proof in proofs) <= 4 * (whole_cycle.LEAST_BOXES + 1)


def test_a_chain_beyond_its_boxes_is_undecided_and_says_where(monkeypatch):
    monkeypatch.setattr(whole_cycle, "SECONDS", -1.0)
    monkeypatch.setattr(whole_cycle, "FIRST_BOXES", 20)
    proof_of = lo.prove(chain(*CHAINS[0][:4]))
    open_ = [proof for proof in proof_of.proofs if proof.status == "undecided"]
    assert open_
    assert all(proof.open is not None and proof.boxes < 150 for proof in open_)
    assert "is left open from crank angle" in "\n".join(map(str, answers.proofs(proof_of)))
