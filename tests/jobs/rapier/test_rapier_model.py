"""The rapier model: derivatives of the travel, turns that move with the drive, margins, dwells and events."""

import functools
import itertools
import math

import casadi as ca
import numpy as np
import pytest

from loomopt.jobs import registry
from loomopt.jobs.rapier import model as rapier
from loomopt.jobs.rapier.model import AFTER, BEFORE, CLOSES, SLEY_MARGINS, RapierDrive
from loomopt.maths import systems
from loomopt.model.model import JobModel
from loomopt.physics.cycle import TURN, Node
from loomopt.physics.tolerances import ASSEMBLY_MARGIN

SCENE = registry.load("rapier").with_effect("head_inertia").with_effect("tape_friction")
JOB = registry.of(SCENE)
MANY = systems.mpmath(60)
OTHER = {"l4": 0.018, "phi40": SCENE.mechanism["phi40"] + 0.15, "l5": 0.48}
DESIGNS = pytest.mark.parametrize("design", [{}, OTHER], ids=["today", "another"])


def exact(design=None, **changed):
    """Return the numbers of a design in 60 digits; changed: some of them."""
    values = {name: MANY.number(value) for name, value in JOB.numbers_of(SCENE, design or {}).items()}
    return JOB.model(SCENE).given(MANY, {**values, **changed})


def pose(system, given, phi):
    return RapierDrive().pose(system, given, Node(phi, {}))


@DESIGNS
def test_derivatives_are_those_of_the_travel_in_many_digits(design):
    sampled, many, h = JOB.sampler(SCENE, design), exact(design), MANY.number(10) ** -20
    rows = []
    for phi in np.linspace(0, TURN, 17):
        at = MANY.number(float(phi))
        after, before = pose(MANY, many, at + h), pose(MANY, many, at - h)
        here, result = pose(MANY, many, at), pose(systems.FLOAT, sampled.given, float(phi))
        slopes = [(getattr(after, name) - getattr(before, name)) / (2 * h) for name in ("q", "q1", "q2")]
        rows.append([(result.q, here.q), *zip((result.q1, result.q2, result.q3), slopes, strict=True)])
    values = np.array(rows, dtype=float)
    away = np.max(np.abs(values[..., 0] - values[..., 1]), axis=0)
    assert np.max(away / np.max(np.abs(values[..., 1]), axis=0)) <= 1e-12


MOVED = ("l4", "l5", "phi40")


@pytest.mark.parametrize("k", range(4))
def test_a_turn_and_both_its_derivatives_are_those_of_implicit_differentiation(k):
    """S'(φ; p) = 0 in 60 digits; its roots at p ± h give dφ/dp and d²φ/dp². One Newton step would not bend with p."""
    sampled = JOB.sampler(SCENE, {})
    symbols = ca.SX.sym("p", len(MOVED))
    numbers = {**sampled.values, **sampled.hints, **dict(zip(MOVED, ca.vertsplit(symbols), strict=True))}
    turn = sampled.model.given(systems.casadi(), numbers).values["turns"][k]
    hessian, gradient = ca.hessian(turn, symbols)
    today = [sampled.values[name] for name in MOVED]
    slope, bend = (result.full() for result in ca.Function("t", [symbols], [gradient, hessian])(today))
    h = MANY.number(10) ** -12

    def root(*steps):
        moved = {name: MANY.number(x) + step * h for name, x, step in zip(MOVED, today, steps, strict=True)}
        given, phi = exact(**moved), MANY.number(sampled.hints[f"turn {k}"])
        for _ in range(8):
            at = pose(MANY, given, phi)
            phi = phi - at.q1 / at.q2
        return phi

    unit = np.eye(3, dtype=int)
    first = np.array([float((root(*e) - root(*-e)) / (2 * h)) for e in unit])
    second = np.array(
        [
            [float((root(*(a + b)) - root(*(a - b)) - root(*(b - a)) + root(*(-a - b))) / (4 * h * h)) for b in unit]
            for a in unit
        ]
    )
    assert np.max(np.abs(slope[:, 0] - first)) <= 1e-9 * np.max(np.abs(first), initial=1e-6)
    assert np.max(np.abs(bend - second)) <= 1e-9 * np.max(np.abs(second), initial=1e-6)


def test_turns_are_sought_only_where_an_effect_calls_them_in():
    without = JOB.model(SCENE.without_effect("tape_friction"))
    given = without.given(systems.FLOAT, JOB.numbers(SCENE))
    assert "turns" not in given.values
    assert without.hints(given) == {}
    assert list(JOB.sampler(SCENE, {}).hints) == ["turn 0", "turn 1", "turn 2", "turn 3"]


def test_events_are_the_sleys_dead_centres():
    sampled = JOB.sampler(SCENE, OTHER)
    events = RapierDrive().events(systems.FLOAT, sampled.given)
    assert list(events) == ["front dead centre", "rear dead centre"]
    for angle in events.values():
        assert abs(pose(systems.FLOAT, sampled.given, float(angle)).joints.phi3_1) < 1e-14
    still = RapierDrive().still(systems.FLOAT, sampled.given, "front dead centre", {})
    assert (float(still.phi), still.q) == (0.0, pytest.approx(0, abs=1e-17))


def test_a_span_is_one_where_the_five_bar_closes_with_the_margin_only():
    """C to B2 is (l5 + l6)/1.001 where the far span is 1, and |l5 − l6| 1.001 where the near one is."""
    sampled = JOB.sampler(SCENE, {})
    group = RapierDrive().groups[""]
    assert list(CLOSES.values()) == ["span_far", "span_near"]
    for name, sign in (("span_far", 1), ("span_near", -1)):
        at = pose(systems.FLOAT, sampled.given, 1.0)
        base = math.hypot(at.joints.base.x, at.joints.base.y)
        l5 = base * ASSEMBLY_MARGIN - 0.185 if sign > 0 else base / ASSEMBLY_MARGIN + 0.185
        given = sampled.given._replace(values={**sampled.given.values, "l5": l5})
        stands = functools.partial(pose, systems.FLOAT, sampled.given, 1.0)
        assert group.quantities[name](systems.FLOAT, given, 1.0, stands) == pytest.approx(1, rel=1e-13)


def test_the_sleys_margins_are_those_of_a_crank_rocker():
    rows = JOB.sampler(SCENE, {}).static
    l1, l2, l3, l71 = (SCENE.mechanism[name] for name in ("l1", "l2", "l3", "l71"))
    assert [rows[name] for name in SLEY_MARGINS] == pytest.approx(
        [(l2 + l3) - 1.001 * (l1 + l71), (l71 - l1) - 1.001 * (l2 - l3), (l71 - l1) - 1.001 * (l3 - l2)], rel=1e-14
    )


def test_dwells_are_pieces_on_their_own_side_of_front_dead_centre():
    sampled = JOB.sampler(SCENE.update({"operation.dwell_after": "25 deg", "operation.dwell_before": "31 deg"}), {})
    for side, width in ((AFTER, 25), (BEFORE, 31)):
        on = sampled.cycle.on((rapier.DWELL, side))
        assert math.degrees(np.diff(sampled.cycle.starts)[on].sum()) == pytest.approx(width, rel=1e-13)
        for piece in np.flatnonzero(on):
            middle = float(sampled.cycle.angles(np.array([piece]), np.array([0.5]))[0])
            assert math.copysign(1, math.remainder(middle, TURN)) == side
    first = rapier.dwells(((AFTER, "dwell_after"),))
    assert first.corners(systems.FLOAT, sampled.given) == (sampled.given.values["dwell_after"], 0)
    assert rapier.dwells(()).corners(systems.FLOAT, sampled.given) == ()


def test_forces_are_quantities_only_with_loads():
    bare = JOB.model(SCENE.without_effect("head_inertia").without_effect("tape_friction"))
    assert set(JOB.model(SCENE).quantities) - set(bare.quantities) == {"peak_torque", "peak_power", "tape_force"}
    assert type(bare) is JobModel
    keys = [
        JOB.model(scene).key
        for scene in (SCENE, SCENE.without_effect("tape_friction"), SCENE.set("mechanism.l4", "13 mm"))
    ]
    assert [a == b for a, b in itertools.combinations(keys, 2)] == [False, True, False]


def test_the_hand_over_is_read_only_where_a_target_speaks_of_it():
    sampled, model = JOB.sampler(SCENE, {}), JOB.program(SCENE, "stroke-dwell").model
    given = sampled.given._replace(values={**sampled.given.values, "phi_stroke": 3.0})
    rows, at = model.static(systems.FLOAT, given, {}), pose(systems.FLOAT, sampled.given, 3.0)
    assert (rows["phi_stroke"], rows["rest"], rows["stroke_short"]) == (3.0, at.q1, at.q - 0.85)
    assert rows["turning"] == at.q2
    assert not {"phi_stroke", "rest", "stroke_short", "turning"} & set(sampled.static)
