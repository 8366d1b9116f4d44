"""References of the accuracy study: known optima, 60 digits, the limit law, and scenes without one."""

import math

import pytest

import loomopt as lo
from loomopt.jobs.shedding.job import JOB
from loomopt.studies.accuracy import reference_digits
from loomopt.studies.accuracy.subject import StudiedTarget

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("name", "target", "known"),
    [
        ("beatup", "balance", 88.6894134918),  # four solvers and 40-digit arithmetic
        ("beatup-light", "balance", 82.3371385326),
        ("rapier", "stroke-dwell", 0.694984753569),  # tests/reference/rapier_layouts.py: SLSQP exchange, Newton
        ("shedding", "stiffness", 102602.609425357),  # tests/reference/shedding.py: 30 digits
        ("shedding", "law", 59955.4638624003),  # tests/reference/shedding.py: HiGHS
        ("shedding", "force", 15679.7298884577),
    ],
)
def test_reference_optima_are_the_known_ones(name, target, known):
    reference = StudiedTarget(lo.load(name), target)
    assert float(reference.optimum.objectives[-1]) == pytest.approx(known, rel=2e-12)
    assert reference.optimum.uncertainty < 1e-20


def test_a_reference_optimum_is_the_same_in_60_digits_and_from_a_rough_start():
    target = StudiedTarget(lo.load("beatup-light"), "balance")
    x, point = target.variables(target.answer), target.answer.point
    rough = {name: value * (1 + 1e-7 * (-1) ** k) for k, (name, value) in enumerate(x.items())}
    optima = [reference_digits.optimum(target.program, point, start, count) for start, count in ((x, 60), (rough, 40))]
    for optimum in optima:
        assert abs(optimum.objectives[-1] / target.optimum.objectives[-1] - 1) < 1e-25


def test_the_limit_law_ends_at_rest_when_its_equation_of_motion_is_integrated():
    """Bang until N = 0, then N = 0, from the printed numbers of the scene: the frame is at s = 1 for u = 1."""
    integrate = pytest.importorskip("scipy.integrate")
    optimize = pytest.importorskip("scipy.optimize")
    scene = lo.load("shedding")
    stiffness = float(JOB.law_limit(scene, {"K1": 6e4}))
    travel, preload, rate = 65.6e-3, 80e-3, 20 * math.pi / math.radians(120)

    def arc(u, state):
        s = state[0]
        warp = 124.545 * (1 - 2 * s) if s < 0.5 else -83.03 * (2 * s - 1)
        return state[1], (369.55 + warp - stiffness * (travel * s + preload)) / (369.55 / 9.80665 * travel * rate**2)

    def end_state(bang):
        begin = math.pi * bang**2, 2 * math.pi * bang
        return integrate.solve_ivp(arc, (bang, 1.0), begin, rtol=1e-11, atol=1e-13, max_step=1e-3).y[:, -1]

    bang = optimize.brentq(lambda u: end_state(u)[1], 0.2, 0.6, xtol=1e-13)
    assert end_state(bang)[0] == pytest.approx(1.0, abs=1e-8)


def test_the_limit_law_falls_to_that_of_an_impulse_as_the_bound_goes():
    """Without a bound: an impulse, then flight to rest at the bottom in one rise, 35567.2269027 N/m in closed form."""
    scene = lo.load("shedding")
    bounds = [2 * math.pi * size for size in (1, 10, 1000, 1e6)]
    stiffnesses = [JOB.law_limit(scene.set("limits.law_acceleration.max", repr(most)), {"K1": 6e4}) for most in bounds]
    assert stiffnesses == sorted(stiffnesses, reverse=True)
    assert float(stiffnesses[-1]) == pytest.approx(35567.226902713526, rel=1e-6)  # tests/reference/shedding.py


@pytest.mark.parametrize(
    "changed",
    [
        lambda scene: scene.with_effect("damping"),
        lambda scene: scene.with_effect("dry_friction"),
        lambda scene: scene.with_effect("coil"),
        lambda scene: scene.without_effect("inertia"),
        lambda scene: scene.set("targets.law.symmetric", True),
        lambda scene: scene.set("effects.warp_tension.shape", "step"),
        lambda scene: scene.update({"mechanism.return": "100 deg", "mechanism.near_dwell": "80 deg"}),
        lambda scene: scene.free(["rise"]),
    ],
    ids=["damping", "friction", "coil", "no inertia", "symmetric", "step", "unlike", "free angles"],
)
def test_scenes_outside_its_assumptions_have_no_limit_law(changed):
    assert JOB.law_limit(changed(lo.load("shedding")), {"K1": 1e5}) is None


def test_a_spring_softer_than_every_law_needs_is_no_start():
    assert JOB.law_limit(lo.load("shedding"), {"K1": 4.9e4}) is None
