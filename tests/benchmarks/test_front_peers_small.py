"""A front beside the peer that gets ten times its time, in small: who judges, what counts, what is said without it."""

import importlib
from types import SimpleNamespace

import numpy as np
import pytest

from loomopt.scenes import packaged
from loomopt.studies import check


@pytest.fixture(scope="module")
def peers():
    return importlib.import_module("benchmarks.peers.front_peers")


@pytest.fixture(scope="module")
def rival(peers):
    return peers.shedding()


def curve(stiffness, preload):
    """Return a design as a peer has it."""
    return np.array([stiffness / 1e6, preload / 0.080])


def test_the_area_below_a_corner_is_that_of_the_stairs(peers):
    assert peers.area([(1.0, 2.0), (2.0, 1.0)], (3.0, 3.0)) == 3.0
    assert peers.area([(2.0, 2.0), (1.0, 1.0), (4.0, 0.0)], (3.0, 3.0)) == 4.0


def test_the_referee_reads_published_designs_and_refuses_softer_ones(rival):
    assert rival.judge(curve(102602.60943, 0.080)) == pytest.approx((102602.60943, 0.080))
    assert rival.judge(curve(102602.60, 0.080)) is None


def test_the_referee_of_the_beat_up_reads_the_published_optimum(peers):
    beatup = peers.beatup()
    report = check.read_reference(packaged.results_path() / "beatup.balance.csv").iloc[0]
    design = {str(name).split(" [")[0]: cell for name, cell in report.items()}
    best = beatup.variables(
        SimpleNamespace(design={n: float(design[n]) for n in ("l1", "l2", "l3", "l4", "m4e", "r4e")})
    )
    assert beatup.judge(best) == pytest.approx((88.689413492, 0.0), abs=1e-6)
    assert beatup.judge(best * [1.1, 1, 1, 1, 1]) is None
    seen, rows = beatup.evaluate(best[None])
    assert seen[0] == pytest.approx((88.689, 0.0), abs=0.05)
    assert rows.max() < 1e-8


def test_the_referee_of_the_rapier_reads_the_published_optimum(peers):
    rapier = peers.rapier()
    report = check.read_reference(packaged.results_path() / "rapier.stroke-dwell.csv").iloc[0]
    design = {str(name).split(" [")[0]: float(cell) for name, cell in report.items() if str(name)[0] in "laCp"}
    best = rapier.variables(SimpleNamespace(design=design))
    peak, dwell = rapier.judge(best)
    assert peak == pytest.approx(0.694984753570, rel=1e-6)
    assert -np.degrees(dwell) == pytest.approx(30.0, rel=1e-6)
    seen, rows = rapier.evaluate(best[None])
    assert seen[0] == pytest.approx((peak, dwell), rel=1e-3)
    assert rows.max() < 1e-6, "the transmission angle is at its limit"
    assert rapier.judge(np.zeros(7)) is None, "no l4 has the stroke"


def test_without_the_peer_the_front_is_judged_alone(peers, rival, monkeypatch):
    monkeypatch.setattr(peers.harness, "installed", lambda name: False)
    mine, absent = peers.compared(rival, 3)
    assert mine["admissible"] == mine["designs"] == 3
    assert mine["missed"] == 0.0
    assert "pymoo is not installed" in absent["method"]
    assert absent["missed"] is None


def test_a_peer_that_knows_the_front_adds_nothing_where_the_front_is_asked_at_its_places(peers, rival, monkeypatch):
    known = [curve(144270.37243, 0.040), curve(119901.39519, 0.060), curve(90e3, 0.060)]
    monkeypatch.setattr(peers.harness, "installed", lambda name: True)
    monkeypatch.setattr(peers, "evolved", lambda rival, designs, seconds: (np.array(known), 3))
    mine, request, theirs = peers.compared(rival, 3)
    assert theirs["admissible"] == 2, "one is too soft"
    assert mine["missed"] > 0.01, "three designs are a coarse front"
    assert request["missed"] == pytest.approx(0.0, abs=1e-9)
    assert theirs["missed"] > 0.05
