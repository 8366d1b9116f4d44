"""What grows or falls with what: the least spring with its loads, peaks with the cloth, optima with their limits."""

import functools
from collections.abc import Mapping

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import loomopt as lo
from loomopt.physics.mechanisms.cam_laws import LAWS

shares = st.integers(0, 1000).map(lambda thousandths: thousandths / 1000)
resistances = st.integers(0, 20000).map(lambda tenths: tenths / 10)
"""M0, N·m."""
ALIKE = 1e-9
"""Two answers may differ by that share though neither is worse: a hundred times what a solve promises."""


def solved(scene, target):
    answer = lo.solve(scene, target, starts=1)
    assert answer.status == "optimal", answer.message
    assert answer.certificate.passed
    return answer


# The least spring -------------------------------------------------------------------------------------------------

OF_FRAME = {
    "operation.speed": (30, 1200, "rpm"),
    "operation.N_min": (0, 200, "N"),
    "mechanism.travel": (2, 150, "mm"),
    "bounds.X0.max": (10, 200, "mm"),
    "effects.inertia.M": (0.5, 90, "kg"),
    "effects.weight.G": (0, 900, "N"),
    "effects.warp_tension.T1": (0, 300, "N"),
    "effects.warp_tension.T2": (0, 300, "N"),
}
NOTHING_AT_REST = {"effects.weight.G": 0, "effects.warp_tension.T1": 0, "effects.warp_tension.T2": 0} | {
    "operation.N_min": 0
}


@st.composite
def frames(draw, name):
    """Draw a heald frame twice, alike but for one number; the one with the lesser number first."""
    numbers = {key: low + (high - low) * draw(shares) for key, (low, high, _) in OF_FRAME.items()}
    low, high, _ = OF_FRAME[name]
    pair = sorted(low + (high - low) * draw(shares) for _ in range(2))
    rise, back = draw(st.integers(40, 140)), draw(st.integers(40, 140))
    changes = {
        "mechanism.law": draw(st.sampled_from(tuple(LAWS))),
        "mechanism.rise": f"{rise} deg",
        "mechanism.return": f"{back} deg",
        "mechanism.near_dwell": f"{300 - rise - back} deg",
        "bounds.K1": {"min": "0 N/m", "max": "1e12 N/m"},
        "bounds.X0.min": "0 mm",
    }
    return changes, [numbers | {name: value} for value in pair]


def least_spring(changes, numbers, off=()):
    """Return K1 of the least spring; X0, which today's frame has too, up to its bound."""
    numbers = numbers | {"mechanism.X0": numbers["bounds.X0.max"]}
    units = {key: unit for key, (_, _, unit) in OF_FRAME.items()} | {"mechanism.X0": "mm"}
    scene = lo.load("shedding").update(changes | {key: f"{value!r} {units[key]}" for key, value in numbers.items()})
    for name in off:
        scene = scene.without_effect(name)
    return solved(scene, "stiffness").design["K1"]


GROWS = ("operation.speed", "operation.N_min", "effects.inertia.M", "effects.weight.G", "effects.warp_tension.T1")


@pytest.mark.parametrize("name", GROWS)
@settings(max_examples=8)
@given(st.data())
@pytest.mark.few(2)
def test_the_least_spring_grows_with_speed_demand_mass_weight_and_warp(name, data):
    changes, (less, more) = data.draw(frames(name))
    assert least_spring(changes, less) <= least_spring(changes, more) * (1 + ALIKE)


@pytest.mark.slow
@settings(max_examples=10)
@given(frames("bounds.X0.max"))
def test_the_least_spring_falls_where_there_is_more_room_for_its_preload(frame):
    changes, (less, more) = frame
    assert least_spring(changes, less) >= least_spring(changes, more) * (1 - ALIKE)


@pytest.mark.slow
@settings(max_examples=10)
@given(frames("mechanism.travel"))
def test_the_least_spring_grows_with_the_travel_where_inertia_alone_loads_it(frame):
    """K1 = M ω² h |s''|/(X0 + h s): h/(X0 + h s) grows with h."""
    changes, (less, more) = frame
    first, other = (least_spring(changes, numbers | NOTHING_AT_REST) for numbers in (less, more))
    assert 0 < first <= other * (1 + ALIKE)


@pytest.mark.slow
@settings(max_examples=10)
@given(frames("mechanism.travel"))
def test_the_least_spring_is_that_of_the_upper_dwell_where_nothing_has_mass(frame):
    """K1 = (N_min + G + T1)/X0: below, the spring is stretched farther and the warp pulls less, whatever the travel."""
    changes, both = frame
    first, other = (least_spring(changes, numbers, ("inertia",)) for numbers in both)
    fixed = sum(both[0][name] for name in ("operation.N_min", "effects.weight.G", "effects.warp_tension.T1"))
    expected = fixed / both[0]["bounds.X0.max"] * 1e3
    assert (first, other) == pytest.approx((expected, expected), rel=1e-9, abs=1e-6)


# The crank torque of a given machine ------------------------------------------------------------------------------


def peak_torque(M0):
    """Return today's peak torque, N·m, where the cloth resists long enough to decide it: over 120 deg."""
    changes = {"operation.M0": f"{M0!r} N*m", "effects.resistance.pulse": "120 deg"}
    return lo.evaluate(lo.load("beatup").update(changes)).figures["peak_torque"]


@settings(max_examples=30)
@given(resistances, resistances, shares)
def test_the_peak_torque_of_a_machine_is_a_convex_function_of_the_cloths_resistance(first, other, share):
    """At every crank angle Md is a straight line in M0: no chord lies below the largest |Md|."""
    chord = (1 - share) * peak_torque(first) + share * peak_torque(other)
    assert peak_torque(first + share * (other - first)) <= chord * (1 + ALIKE)


@settings(max_examples=20)
@given(resistances, resistances)
def test_the_peak_torque_grows_with_the_resistance_once_the_cloth_decides_it(first, other):
    """From 2000 N·m on it is more than without any cloth: convex, it falls no more."""
    less, more = sorted((2000 + first, 2000 + other))
    assert peak_torque(0.0) < peak_torque(less) <= peak_torque(more) * (1 + ALIKE)


# Limits -----------------------------------------------------------------------------------------------------------

LENGTHS = {"bounds.l1.min": (30, 28, "mm"), "bounds.l2.max": (85, 88, "mm"), "bounds.l3.max": (170, 175, "mm")} | {
    "bounds.l4.max": (167, 172, "mm")
}
OF_LINKAGE = {
    "limits.swing.min": (22.9, 22.5, "deg"),
    "limits.swing.max": (23.4, 23.8, "deg"),
    "limits.theta.min": (-2.2, -3, "deg"),
    "limits.theta.max": (2.2, 3, "deg"),
    "limits.mu_min.min": (56.5, 54, "deg"),
}
OF_DRIVE = {
    "operation.stroke": (850, 800, "mm"),
    "operation.s_dwell": (6, 8, "mm"),
    "operation.dwell_after": (30, 26, "deg"),
    "operation.dwell_before": (30, 26, "deg"),
    "limits.mu_min.min": (30, 25, "deg"),
    "bounds.l3p.max": (260, 270, "mm"),
    "bounds.alpha.max": (60, 63, "deg"),
    "bounds.C0x.min": (401.0345, 395, "mm"),
    "bounds.C0y.min": (174.2173, 170, "mm"),
}
OF_SPRING = {"bounds.X0.max": (80, 120, "mm"), "operation.N_min": (50, 0, "N"), "bounds.K1.max": (400, 500, "kN/m")}
Ranges = Mapping[str, tuple[float, float, str]]
TASKS: dict[tuple[str, str], tuple[Ranges, tuple[str, ...]]] = {
    ("beatup", "balance"): (LENGTHS | OF_LINKAGE, ("M3_fdc", "peak_torque")),
    ("beatup", "torque"): (LENGTHS | OF_LINKAGE | {"targets.torque.M3_tolerance": (2, 30, "N*m")}, ("peak_torque",)),
    ("beatup", "pulse"): (LENGTHS | OF_LINKAGE, ("pulse_rms",)),
    ("rapier", "stroke-dwell"): (OF_DRIVE, ("peak_acceleration",)),
    ("shedding", "stiffness"): (OF_SPRING, ("K1",)),
    ("shedding", "force"): (OF_SPRING, ("contact_max",)),
}
"""(job, target) -> limits as they are and as loose as they get here, and the figures made small, in their order."""
EXAMPLES = {"beatup": 8, "rapier": 4, "shedding": 6}


def worse(first, other, names):
    """Say whether the first answer's figures are worse: by the first of them that differs."""
    for name in names:
        mine, its = abs(first.figures[name]), abs(other.figures[name])
        if abs(mine - its) > ALIKE * max(mine, its) + 1e-7 * (name == "M3_fdc"):
            return mine > its
    return False


@pytest.mark.parametrize(("job", "target"), TASKS)
@pytest.mark.few(1)
def test_a_looser_limit_never_makes_an_optimum_worse(job, target):
    limits, figures = TASKS[job, target]

    @settings(max_examples=EXAMPLES[job])
    @given(st.fixed_dictionaries({name: st.tuples(shares, shares) for name in limits}))
    def holds(drawn):
        answers = []
        for step in (0, 1):
            changes = {}
            for name, (low, high, unit) in limits.items():
                share, more = drawn[name]
                share += step * (1 - share) * more
                changes[name] = f"{low + share * (high - low)!r} {unit}"
            answers.append(solved(lo.load(job).update(changes), target))
        tight, loose = answers
        assert not worse(loose, tight, figures)

    holds()


@functools.cache
def highest_speed(N_min):
    return solved(lo.load("shedding").set("operation.N_min", f"{N_min} N"), "speed").figures["speed"]


@pytest.mark.parametrize("pair", [(0, 20), (20, 60), (60, 100)])
def test_the_highest_speed_falls_with_the_demand(pair):
    assert highest_speed(pair[0]) > highest_speed(pair[1])
