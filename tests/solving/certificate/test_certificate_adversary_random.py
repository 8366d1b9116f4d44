"""The certificate on random strictly convex quadratic programmes whose optimum is known by construction."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog
from support import toy

from loomopt.solving.certificate.certificate import certify

ACCURACY = 1e-8
LEAST_CURVATURE = 0.5
fixed = settings(derandomize=True, deadline=None, max_examples=60, database=None)
"""The same examples on every machine."""


@dataclass(frozen=True)
class Quadratic:
    """Least x'Hx/2 + g'x with rows x <= b, and a box; strictly convex, so that x with prices >= 0 is the optimum."""

    best: np.ndarray
    hessian: np.ndarray
    gradient: np.ndarray
    rows: np.ndarray
    bound: np.ndarray
    prices: np.ndarray
    box: tuple[tuple[float, float], ...]

    @property
    def names(self):
        return tuple(f"x{k}" for k in range(len(self.best)))

    def point(self, x):
        return dict(zip(self.names, map(float, x), strict=True))

    def value(self, x):
        return float(x @ self.hessian @ x / 2 + self.gradient @ x)

    def program(self, start=None):
        names, hessian, gradient = self.names, self.hessian.tolist(), self.gradient.tolist()

        def quadratic(v):
            x = [v[name] for name in names]
            bent = [sum(h * b for h, b in zip(row, x, strict=True)) for row in hessian]
            return sum((b / 2 + g) * a for a, b, g in zip(x, bent, gradient, strict=True))

        def linear(row):
            return lambda v: sum(a * v[name] for a, name in zip(row, names, strict=True))

        rows = {"f": quadratic} | {f"g{k}": linear(row) for k, row in enumerate(self.rows.tolist())}
        limits = tuple((f"g{k}", 1, float(b)) for k, b in enumerate(self.bound))
        ends = dict(zip(names, self.box, strict=True))
        return toy.program(names, rows, limits=limits, bounds=ends, start=start)


def eighths(low, high):
    """Binary fractions: what is computed from them is exact, and parallel rows and crowded corners are common."""
    return st.integers(8 * low, 8 * high).map(lambda k: k / 8)


@st.composite
def quadratics(draw):
    """Draw an optimum first, then limits through it with prices, others beyond it, and the objective that fits."""
    size = draw(st.integers(2, 4))
    active, slack = draw(st.integers(0, size + 1)), draw(st.integers(0, 2))
    several = st.lists(eighths(-2, 2), min_size=size, max_size=size)
    best = np.array(draw(several))
    root = np.array([draw(several) for _ in range(size)])
    hessian = root.T @ root + LEAST_CURVATURE * np.eye(size)
    rows = np.array([draw(several.filter(any)) for _ in range(active + slack)]).reshape(active + slack, size)
    prices = np.array([draw(eighths(0, 2)) for _ in range(active)] + [0.0] * slack)
    bound = rows @ best + np.array([0.0] * active + [0.25] * slack)
    box, constraint = [], np.zeros(size)
    for k, x in enumerate(best):
        side = draw(st.sampled_from((-1, 0, 1)))
        box.append((float(x) - (0.0 if side < 0 else 1.0), float(x) + (0.0 if side > 0 else 1.0)))
        constraint[k] = side * draw(eighths(0, 2)) if side else 0.0
    gradient = -(hessian @ best + rows.T @ prices + constraint)
    return Quadratic(best, hessian, gradient, rows, bound, prices, tuple(box))


@pytest.mark.slow
@fixed
@given(quadratics())
def test_the_optimum_of_a_convex_programme_passes(problem):
    certificate = certify(problem.program(), problem.point(problem.best), ACCURACY)
    assert certificate.passed, certificate.reasons
    assert certificate.minimum
    assert certificate.unique
    assert certificate.feasibility == 0.0


@pytest.mark.slow
@fixed
@given(quadratics(), st.integers(0, 2**32 - 1), st.floats(-4, -2))
def test_a_perturbed_optimum_of_a_convex_programme_never_passes(problem, seed, exponent):
    """Outside its limits, or above the optimum by the least curvature: in any direction, of any size to 1e-2."""
    direction = np.random.default_rng(seed).uniform(-1, 1, len(problem.best))
    step = direction * 10**exponent / np.abs(direction).max()
    certificate = certify(problem.program(), problem.point(problem.best + step), ACCURACY)
    assert not certificate.passed
    assert certificate.reasons


@pytest.mark.slow
@fixed
@given(quadratics(), st.integers(0, 3), st.sampled_from((-1e-2, -1e-3, -1e-4, 1e-4, 1e-3, 1e-2)))
def test_an_optimum_off_along_one_axis_never_passes(problem, axis, step):
    """Along an axis a bound or a row often stays exactly held."""
    moved = problem.best.copy()
    moved[axis % len(moved)] += step
    certificate = certify(problem.program(), problem.point(moved), ACCURACY)
    assert not certificate.passed
    assert certificate.reasons


@pytest.mark.slow
@fixed
@given(quadratics())
def test_prices_said_hold_the_slope(problem):
    """Worths balance the gradient where they are unique; else each is the least of a linear program's multipliers."""
    program = problem.program()
    certificate = certify(program, problem.point(problem.best), ACCURACY)
    pull = problem.hessian @ problem.best + problem.gradient
    if not certificate.prices_unique:
        _check_least(problem, certificate, pull)
        return
    for binding in certificate.binding:
        name = binding.limit.row
        slope = problem.rows[int(name[1:])] if name[0] == "g" else np.eye(len(pull))[int(name[1:])]
        pull = pull + binding.side * binding.worth * slope
    assert np.abs(pull).max() == pytest.approx(0.0, abs=1e-6)


def _check_least(problem, certificate, pull):
    """Check what each limit is worth alone beside the least multiplier that SciPy finds."""
    touched = {
        (f"g{k}", 1): row for k, row in enumerate(problem.rows) if row @ problem.best >= problem.bound[k] - 1e-12
    }
    for k, ends in enumerate(problem.box):
        unit = np.eye(len(pull))[k]
        touched |= {(f"x{k}", s): s * unit for s, end in zip((-1, 1), ends, strict=True) if end == problem.best[k]}
    for binding in certificate.binding:
        cost = [float(key == (binding.limit.row, binding.side)) for key in touched]
        optimum = linprog(cost, A_eq=np.array(list(touched.values())).T, b_eq=-pull)
        assert binding.worth == pytest.approx(optimum.fun, abs=1e-7)


@settings(fixed, max_examples=25)
@given(quadratics())
def test_the_engine_finds_and_certifies_the_optimum(problem):
    answer = toy.solve(problem.program(start=problem.point(problem.best + 0.25)))
    assert answer.status == "optimal", answer.message
    least = problem.value(problem.best)
    assert answer.figures["f"] == pytest.approx(least, rel=ACCURACY, abs=ACCURACY)
