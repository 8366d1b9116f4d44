"""Other ways to solve `balance`: least T + ρ t with |M3(FDC)| ≤ t and |Md(φ)| ≤ T, over l1 … l4 and s = m4e r4e².

Each is written as its users would write it, on the plain NumPy physics, and returns a design (SI). Grids are uniform
in φ; only `reference` looks between the points.
"""

import casadi as ca
import numpy as np
from scipy.optimize import Bounds, NonlinearConstraint, differential_evolution, minimize

from reference import balance as plain

GRID = 360
SIZE = np.array([0.167, 0.167, 0.167, 0.167, plain.UPPER[4]])
TORQUE = 100.0
"""N·m; with SIZE the scales of the variables."""
RHO = 2.0
"""Weight of |M3|: exact from 0.5 on, and the larger it is the more iterations SLSQP needs."""
STEP = 1e-7
LOW, HIGH = plain.LOWER / SIZE, plain.UPPER / SIZE
START = np.append(np.clip(plain.TODAY / SIZE, LOW, HIGH), [1.0, 1.0])
START[4] = 0.4
OBJECTIVE = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0, RHO])


def angles(count=GRID):
    """Uniform grid over the turn, rad."""
    return np.linspace(0.0, 2 * np.pi, count, endpoint=False)


class Rows:
    """The rows ≥ 0 of the epigraph form on given crank angles; slopes by differences, all designs in one call.

    Variables: l1 … l4, s, T, t, scaled.
    """

    SHIFTS = np.vstack([np.zeros(5), STEP * np.eye(5)])

    def __init__(self, M0, phi):
        self.M0, self.phi, self.at, self.evaluations = M0, phi, b"", 0

    def values(self, z):
        """Rows."""
        self._evaluate(z)
        return self._values

    def slopes(self, z):
        """Their derivatives."""
        self._evaluate(z)
        return self._slopes

    def _evaluate(self, z):
        if z.tobytes() == self.at:
            return
        self.at, self.evaluations = z.tobytes(), self.evaluations + 1
        *lengths, s = ((z[:5] + self.SHIFTS) * SIZE).T[:, :, None]
        torque = plain.crank_torque(*lengths, s, self.M0, self.phi) / TORQUE
        front = plain.front_torque(*lengths, s, self.M0) / TORQUE
        rows = np.hstack([-torque, torque, -front, front, plain.limits(*lengths)[:, :, 0].T])
        most = 2 * len(self.phi)
        self._values = rows[0].copy()
        self._values[:most] += z[5]
        self._values[most : most + 2] += z[6]
        self._slopes = np.zeros((rows.shape[1], 7))
        self._slopes[:, :5] = (rows[1:] - rows[0]).T / STEP
        self._slopes[:most, 5] = self._slopes[most : most + 2, 6] = 1.0


def design(z):
    """Design, SI, of scaled variables."""
    return np.clip(z[:5] * SIZE, plain.LOWER, plain.UPPER)


def slsqp(M0, start=START, phi=None, ftol=1e-6):
    """SLSQP's answer z on a grid and how often the cycle was evaluated.

    At ftol = 1e-6 it finds the grid's own optimum to 3e-7; a tighter one costs time and gains nothing on a grid.
    """
    rows = Rows(M0, angles() if phi is None else phi)
    optimum = minimize(
        lambda z: OBJECTIVE @ z,
        start,
        jac=lambda z: OBJECTIVE,
        bounds=Bounds(np.append(LOW, [0, 0]), np.append(HIGH, [np.inf, np.inf])),
        constraints={"type": "ineq", "fun": rows.values, "jac": rows.slopes},
        method="SLSQP",
        options={"ftol": ftol, "maxiter": 200},
    )
    return optimum.x, rows.evaluations


def reference(M0, start=START):
    """Best-known optimum: SLSQP on a few crank angles, to which every peak it misses is added."""
    beta = plain.front_angle(*design(start)[:4])
    phi = beta + np.linspace(-plain.PULSE / 2, plain.PULSE / 2, 25)
    phi = np.append(phi, angles(72))
    z = start
    for _ in range(20):
        z, _ = slsqp(M0, z, phi, ftol=1e-15)
        peaks = plain.peaks(design(z), M0)
        missed = [at for at, size in peaks if size > z[5] * TORQUE * (1 + 1e-11)]
        if not missed:
            break
        phi = np.append(phi, missed)
    return design(z)


def trust_constr(M0):
    """SciPy's interior-point answer on the grid, and how often the cycle was evaluated.

    The rows' curvature is left out: with SciPy's own estimate of it (BFGS) it stops at an inadmissible design.
    """
    rows = Rows(M0, angles())
    optimum = minimize(
        lambda z: OBJECTIVE @ z,
        np.append(0.99 * START[:5] + 0.01 * (LOW + HIGH) / 2, START[5:]),
        jac=lambda z: OBJECTIVE,
        hess=lambda z: np.zeros((7, 7)),
        bounds=Bounds(np.append(LOW, [0, 0]), np.append(HIGH, [np.inf, np.inf]), keep_feasible=True),
        constraints=NonlinearConstraint(rows.values, 0.0, np.inf, jac=rows.slopes, hess=lambda z, v: np.zeros((7, 7))),
        method="trust-constr",
        options={"maxiter": 1000},
    )
    return optimum.x, rows.evaluations


def _population(x, M0, phi):
    """Objective and limits of many designs, scaled, one to a row."""
    *lengths, s = (x * SIZE).T[:, :, None]
    peak = np.abs(plain.crank_torque(*lengths, s, M0, phi)).max(axis=1) / TORQUE
    front = np.abs(plain.front_torque(*lengths, s, M0)[:, 0]) / TORQUE
    return peak + RHO * front, plain.limits(*lengths)[:, :, 0]


def evolution(M0, generations=400):
    """Answer of SciPy's differential evolution on the grid."""
    phi = angles()
    result = differential_evolution(
        lambda x: _population(np.atleast_2d(x.T), M0, phi)[0],
        Bounds(LOW, HIGH),
        constraints=NonlinearConstraint(lambda x: _population(np.atleast_2d(x.T), M0, phi)[1].squeeze(), 0.0, np.inf),
        maxiter=generations,
        tol=1e-8,
        seed=1,
        polish=False,
        vectorized=True,
        updating="deferred",
    )
    return result.x, result.nfev


def genetic(M0, generations=200):
    """Answer of pymoo's genetic algorithm on the grid."""
    from pymoo.algorithms.soo.nonconvex.ga import GA
    from pymoo.core.problem import Problem
    from pymoo.optimize import minimize as evolve

    phi = angles()

    class Balance(Problem):
        def __init__(self):
            super().__init__(n_var=5, n_obj=1, n_ieq_constr=6, xl=LOW, xu=HIGH)

        def _evaluate(self, x, out, *_, **__):
            objective, limits = _population(x, M0, phi)
            out["F"], out["G"] = objective[:, None], -limits.T

    result = evolve(Balance(), GA(pop_size=100), ("n_gen", generations), seed=1, verbose=False)
    return result.X, 100 * generations


def unrolled(points=GRID):
    """IPOPT on the grid as first written in CasADi: ψ by atan2 and acos, ψ', ψ'' by AD, one row per angle."""
    z, M0, phi = ca.SX.sym("z", 7), ca.SX.sym("M0"), ca.SX.sym("phi")
    l1, l2, l3, l4, s = ca.vertsplit(z[:5] * SIZE)
    x, y = l1 * ca.cos(phi) - l4, l1 * ca.sin(phi)
    square = x * x + y * y
    psi = ca.atan2(y, x) - ca.acos((square + l3**2 - l2**2) / (2 * l3 * ca.sqrt(square)))
    psi_1 = ca.jacobian(psi, phi)
    psi_2 = ca.jacobian(psi_1, phi)
    off = phi - ca.acos(((l2 + l1) ** 2 + l4**2 - l3**2) / (2 * (l2 + l1) * l4))
    pulse = ca.if_else(ca.fabs(off) < plain.PULSE / 2, M0 * ca.cos(np.pi / plain.PULSE * off), 0)
    torque = ((plain.J4 + s) * plain.SPEED**2 * psi_2 - pulse) * psi_1 / TORQUE
    at = ca.Function("torque", [z, M0, phi], [torque])
    curve = [at(z, M0, angle) for angle in angles(points)]
    front = plain.front_torque(l1, l2, l3, l4, s, M0) / TORQUE
    rows = [z[5] - value for value in curve] + [z[5] + value for value in curve] + [z[6] - front, z[6] + front]
    rows += list(plain.limits(l1, l2, l3, l4))
    nlp: dict = {"x": z, "p": M0, "f": ca.dot(OBJECTIVE, z), "g": ca.vertcat(*rows)}
    return ca.nlpsol("unrolled", "ipopt", nlp, {"ipopt": {"print_level": 0, "sb": "yes"}, "print_time": False})


def solve_unrolled(solver, M0):
    """Answer of the unrolled NLP and its iterations."""
    low, high = np.append(LOW, [0, 0]), np.append(HIGH, [np.inf, np.inf])
    result = solver(x0=START, p=M0, lbx=low, ubx=high, lbg=0.0)
    return np.asarray(result["x"]).ravel(), solver.stats()["iter_count"]
