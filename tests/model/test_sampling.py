"""Whole-cycle values of one design: refined extremes and means against scans so dense that they need no refining."""

import math

import numpy as np
import pytest

from loomopt.jobs import registry
from loomopt.model.sampling import CHUNK, Sampler
from loomopt.physics.cycle import TURN

POINTS = 1_000_000
ALL = ("rocker_inertia", "counterweight_inertia", "rod_inertia", "gravity", "bearing_friction", "centrifugal")
BEATUP = registry.load("beatup")
JOB = registry.of(BEATUP)


def scene(*effects, **changes):
    result = BEATUP
    for name in effects:
        result = result.with_effect(name)
    return result.update({key.replace("__", "."): value for key, value in changes.items()}) if changes else result


SCENES = {
    "the paper's": scene(),
    "every effect": scene(*ALL),
    "exact rod": scene("rod_inertia", effects__rod_inertia__model="exact"),
    "friction above all": scene("bearing_friction", effects__bearing_friction__coulomb="500 N*m"),
    "narrow pulse": scene(effects__resistance__pulse="0.05 deg", operation__M0="40 kN*m"),
    "wide pulse": scene("bearing_friction", effects__resistance__pulse="200 deg"),
    "resistance alone": scene().without_effect("inertia"),
    "slow": scene(operation__speed="30 rpm"),
    "long crank": scene(mechanism__l1="100 mm", mechanism__l2="200 mm", mechanism__l3="190 mm", mechanism__l4="220 mm"),
}


def scanned(sampled, name):
    """Return |quantity| piece by piece on 10⁶ points in all, both ends of each piece included."""
    shares = np.diff(sampled.cycle.starts) / TURN
    for piece, share in enumerate(shares):
        u = np.linspace(0, 1, max(1001, round(POINTS * share)))
        yield np.abs(sampled.at(name, np.full(u.shape, piece), u))


def vertex(values, k):
    """Return the top of the parabola through a point and its neighbours."""
    if k in (0, len(values) - 1):
        return values[k]
    low, mid, high = values[k - 1 : k + 2]
    bend = low - 2 * mid + high
    return mid - (high - low) ** 2 / (8 * bend) if bend < 0 else mid


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.few(2)
def test_the_peak_is_that_of_a_scan_of_a_million_points(name):
    sampled = JOB.sampler(SCENES[name], {})
    for quantity in sampled.model.quantities:
        pieces = list(scanned(sampled, quantity))
        highest = max(values.max() for values in pieces)
        best = max(vertex(values, int(values.argmax())) for values in pieces)
        assert sampled.peak(quantity) >= highest * (1 - 1e-13)
        assert sampled.peak(quantity) == pytest.approx(best, rel=1e-10)


@pytest.mark.slow
def test_peaks_of_other_machines_too_down_to_transmission_angles_of_a_few_degrees():
    rng, every = np.random.default_rng(5), scene("rod_inertia", "bearing_friction")
    for _ in range(12):
        l1 = rng.uniform(0.05, 0.6)
        total, difference = (1 + l1) * (1 + 10 ** rng.uniform(-2.5, 0.2)), rng.uniform(-0.97, 0.97) * (1 - l1)
        ratios = (l1, (total + difference) / 2, (total - difference) / 2, 1.0)
        sampled = JOB.sampler(every, {f"l{k + 1}": float(0.167 * ratio) for k, ratio in enumerate(ratios)})
        best = max(vertex(values, int(values.argmax())) for values in scanned(sampled, "peak_torque"))
        assert sampled.peak("peak_torque") == pytest.approx(best, rel=1e-10)


@pytest.mark.few(2)
@pytest.mark.parametrize("name", ["the paper's", "every effect", "friction above all", "long crank"])
def test_every_local_extreme_of_the_scan_is_found_with_its_sign(name):
    sampled = JOB.sampler(SCENES[name], {})
    extremes = sampled.extremes("peak_torque")
    assert [abs(e.value) for e in extremes] == sorted((abs(e.value) for e in extremes), reverse=True)
    for piece, values in enumerate(scanned(sampled, "peak_torque")):
        padded = np.concatenate([[-np.inf], values, [-np.inf]])
        tops = np.flatnonzero((padded[1:-1] > padded[:-2]) & (padded[1:-1] > padded[2:]))
        here = [e for e in extremes if e.piece == piece]
        for k in tops[values[tops] > 1e-3 * sampled.peak("peak_torque")]:
            nearest = min(here, key=lambda e: abs(e.u - k / (len(values) - 1)))
            assert abs(nearest.value) == pytest.approx(vertex(values, k), rel=1e-10)
            signed = sampled.at("peak_torque", np.array([piece]), np.array([nearest.u]))[0]
            assert nearest.value == pytest.approx(signed, rel=1e-13)


@pytest.mark.parametrize("name", SCENES)
def test_extremes_of_several_quantities_at_once_are_those_of_each_alone(name):
    model = JOB.sampler(SCENES[name], {}).model
    values = JOB.sampler(SCENES[name], {}).values
    together, names = Sampler(model, values), (*model.quantities, "obliquity")
    together.search(names)
    for quantity in names:
        assert together.extremes(quantity) == Sampler(model, values).extremes(quantity)


def test_extremes_of_several_quantities_are_refined_in_two_passes_for_all(monkeypatch):
    scene = registry.load("rapier")
    sampled = registry.of(scene).sampler(scene, {})
    names, read = ("span_near", "span_far", "obliquity", "peak_acceleration"), []
    whole = Sampler.together

    def counted(self, request, pieces, u):
        read.append(request)
        return whole(self, request, pieces, u)

    monkeypatch.setattr(Sampler, "together", counted)
    sampled.search(names)
    sampled.search(names)
    assert read == [names, names]
    assert all(sampled.extremes(name) for name in names)
    assert len(read) == 2


def test_an_extreme_may_stand_on_one_side_of_a_corner():
    """A Coulomb torque that outweighs all else: |M3| jumps at the dead centres, where one side has the peak."""
    sampled = JOB.sampler(SCENES["friction above all"], {})
    extreme = sampled.extremes("M3_square")[0]
    assert extreme.u in (0.0, 1.0)
    M3 = math.sqrt(max(values.max() for values in scanned(sampled, "M3_square")))
    assert math.sqrt(extreme.value) == pytest.approx(M3, rel=1e-12)


@pytest.mark.parametrize("pulse", ["29.8 deg", "0.05 deg", "200 deg"])
def test_the_mean_over_the_pulse_is_that_of_a_dense_rule(pulse):
    sampled = JOB.sampler(scene("bearing_friction", effects__resistance__pulse=pulse), {})
    integral = sampled.model.integrals[0]
    assert (integral.name, integral.root) == ("pulse_mean_square", "pulse_rms")
    on = np.flatnonzero(sampled.cycle.on(("resistance", 1.0)))
    total = width = 0.0
    for piece in on:
        u = np.linspace(0, 1, 20_001)
        values = sampled.at("M3_square", np.full(u.shape, piece), u)
        span = np.diff(sampled.cycle.starts)[piece]
        simpson = (values[0] + values[-1] + 4 * values[1:-1:2].sum() + 2 * values[2:-2:2].sum()) / 3 / 20_000
        total, width = total + span * simpson, width + span
    assert width == pytest.approx(scene(effects__resistance__pulse=pulse).effects["resistance"].pulse, rel=1e-12)
    assert sampled.figures["pulse_rms"] == pytest.approx(math.sqrt(total / width), rel=1e-11)
    assert sampled.figures["pulse_mean_square"] == pytest.approx(total / width, rel=1e-11)


def test_values_do_not_depend_on_how_many_are_asked_for_at_once():
    sampled = JOB.sampler(SCENES["every effect"], {})
    rng = np.random.default_rng(0)
    u = rng.random(2 * CHUNK + 7)
    pieces = rng.integers(0, sampled.cycle.pieces, u.shape)
    together = sampled.at("peak_torque", pieces, u)
    for k in (0, CHUNK - 1, CHUNK, 2 * CHUNK, len(u) - 1):
        alone = sampled.at("peak_torque", pieces[k : k + 1], u[k : k + 1])[0]
        assert together[k] == pytest.approx(alone, rel=1e-14)


def test_the_grid_holds_both_ends_of_every_piece_and_enough_points_of_the_narrowest():
    sampled = JOB.sampler(SCENES["narrow pulse"], {})
    pieces, u = sampled.grid(720)
    for piece in range(sampled.cycle.pieces):
        values = u[pieces == piece]
        assert (values[0], values[-1]) == (0.0, 1.0)
        assert len(values) >= 91
        assert np.max(np.diff(values)) * np.diff(sampled.cycle.starts)[piece] <= TURN / 720 * (1 + 1e-12)


@pytest.mark.parametrize(("intervals", "least"), [(4, 91), (16, 41), (64, 11), (256, 9)])
def test_many_pieces_share_their_samples(intervals, least):
    """A free law of 256 intervals has 516 pieces: no more than eight nodes of one of them beside its ends."""
    freed = registry.load("shedding").set("targets.law.intervals", intervals)
    task = registry.of(freed).program(freed, "law")
    sampled = Sampler(task.model, {**task.parameters, **task.starts[0]})
    pieces, u = sampled.grid(720)
    counts = np.bincount(pieces)
    assert len(counts) == sampled.cycle.pieces == 2 * intervals + 2 + 2
    assert counts.min() == least
    assert np.all(counts >= np.ceil(720 * np.diff(sampled.cycle.starts) / TURN) + 1)
    assert set(u[np.cumsum(counts) - 1]) == {1.0}
    assert len(u) <= 2 * 720 + 720 + 9 * len(counts)


def test_a_quantity_that_is_zero_everywhere_has_a_peak_of_zero():
    balanced = scene("centrifugal", mechanism__r4="0 mm")
    assert JOB.sampler(balanced, {}).peak("reed_centrifugal") == 0.0
    assert JOB.figures(balanced, JOB.today(balanced))["shaking_force"] == 0.0
