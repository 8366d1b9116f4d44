"""Ways to attack an answer: SciPy's SLSQP from many starts and differential evolution, on any task in plain NumPy.

A task is a scene's question by hand: a design is a point z of the unit box, and one call views many at once.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from scipy.optimize import differential_evolution, minimize
from scipy.stats import qmc

STEP = 1e-6
"""Half of the central differences' step, in the unit box."""
ROUNDS = 5
"""Solves of one start: extremes that the one before missed are added to the next."""
ADMISSIBLE = 1e-9
INSIDE = 2e-10
"""What rows are held to at the end, so that the referee's finer look finds them within `ADMISSIBLE`."""
SAME = 1e-4
"""Rms distance in the unit box of points that are one end."""
HOPELESS, HOPEFUL = 1e-4, 1e-5
"""A violation, and a level above the claimed one, at which a start is given up."""
STEEP = 10.0
"""Weight of the largest violation beside the objectives; a later level weighs 1 % of the one before."""
WORST = 1e3
"""What stands for a figure of a design that does not close."""


class View(NamedTuple):
    """What designs are worth, in units of the scale, a row for each.

    levels: each objective is the largest of its columns; firm: no less than 0; equal: 0.
    """

    levels: tuple[np.ndarray, ...]
    firm: np.ndarray
    equal: np.ndarray


class Task(Protocol):
    """A scene's question by hand; `angles` are the task's own record of where it looks over the turn."""

    @property
    def size(self) -> int: ...
    @property
    def coarse(self) -> tuple[np.ndarray, ...]: ...
    def view(self, z: np.ndarray, angles: tuple[np.ndarray, ...]) -> View: ...
    def sharper(self, z: np.ndarray, angles: tuple[np.ndarray, ...]) -> tuple[np.ndarray, ...]: ...


def viewed(task: Task, z: np.ndarray, angles: tuple[np.ndarray, ...]) -> View:
    """View with a number wherever a design does not close."""
    with np.errstate(all="ignore"):
        levels, firm, equal = task.view(z, angles)
    levels = tuple(np.nan_to_num(level, nan=WORST, posinf=WORST, neginf=WORST) for level in levels)
    return View(levels, np.nan_to_num(firm, nan=-1.0, neginf=-WORST, posinf=WORST), np.nan_to_num(equal, nan=1.0))


def broken(view: View) -> np.ndarray:
    """Largest violation of each design."""
    most = np.zeros(len(view.firm))
    for rows in (-view.firm, np.abs(view.equal)):
        most = np.maximum(most, rows.max(axis=1, initial=0.0))
    return most


def merit(task: Task, z: np.ndarray) -> np.ndarray:
    """Return what a search without slopes makes small."""
    view = viewed(task, z, task.coarse)
    worth = sum(100.0**-k * level.max(axis=1) for k, level in enumerate(view.levels))
    return np.asarray(worth + STEEP * broken(view))


@dataclass
class Rows:
    """SLSQP's variables (z, T), values and slopes: the least T above a level, earlier levels held."""

    task: Task
    angles: tuple[np.ndarray, ...]
    level: int
    bounds: tuple[float, ...]
    at: bytes = b""

    def values(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows no less than 0 and rows that are 0 at points (z, T)."""
        view = viewed(self.task, y[:, :-1], self.angles)
        above = y[:, -1:] - view.levels[self.level]
        before = [most - level for most, level in zip(self.bounds, view.levels, strict=False)]
        return np.hstack([above, view.firm, *before]), view.equal

    def part(self, kind: int) -> dict[str, object]:
        """Constraint for SciPy: 0 the rows no less than 0, 1 those that are 0."""

        def fun(y):
            self.evaluate(y)
            return self.rows[kind]

        def jac(y):
            self.evaluate(y)
            return self.slopes[kind]

        return {"type": ("ineq", "eq")[kind], "fun": fun, "jac": jac}

    def evaluate(self, y: np.ndarray) -> None:
        if y.tobytes() == self.at:
            return
        self.at, steps = y.tobytes(), STEP * np.eye(len(y))
        values = self.values(np.vstack([y, y + steps, y - steps]))
        self.rows = [rows[0] for rows in values]
        half = len(y) + 1
        self.slopes = [(rows[1:half] - rows[half:]).T / (2 * STEP) for rows in values]


def solved(
    task: Task,
    start: np.ndarray,
    claimed: float,
    level: int = 0,
    fixed: tuple[float, ...] = (),
    ends: Sequence[np.ndarray] = (),
) -> np.ndarray | None:
    """Return where SLSQP ends from a start, extremes it misses added round after round, put onto its limits.

    Rows only make a level worse: a start is given up where a few of them already leave it no better than claimed, and
    where it comes to one of the ends of others.
    """
    coarse = task.coarse
    angles, y = coarse, np.append(start, 0.0)
    y[-1] = viewed(task, y[None, :-1], coarse).levels[level].max()
    slope = np.eye(len(y))[-1]
    for _ in range(ROUNDS):
        rows, before = Rows(task, angles, level, fixed), y
        kinds = (0, 1) if rows.values(y[None])[1].size else (0,)
        optimum = minimize(
            lambda y: y[-1],
            y,
            jac=lambda y, slope=slope: slope,
            method="SLSQP",
            bounds=[(0.0, 1.0)] * task.size + [(None, None)],
            constraints=[rows.part(kind) for kind in kinds],
            options={"ftol": 1e-9 if angles is coarse else 1e-12, "maxiter": 60},
        )
        y = np.clip(optimum.x, [0.0] * task.size + [-np.inf], [1.0] * task.size + [np.inf])
        if broken(viewed(task, y[None, :-1], angles))[0] > HOPELESS or y[-1] > claimed + HOPEFUL:
            break
        if angles is coarse and any(np.sqrt(np.mean((y[:-1] - end) ** 2)) < SAME for end in ends):
            return None
        angles = task.sharper(y[:-1], angles)
        if np.abs(y - before).max() < 1e-9:
            break
    return inside(Rows(task, angles, level, fixed), y)


def inside(rows: Rows, y: np.ndarray) -> np.ndarray:
    """Point z after a few least moves onto the limits it breaks, within the box."""
    for _ in range(6):
        rows.at = b""
        rows.evaluate(y)
        firm, equal = rows.rows
        low = firm < INSIDE
        miss = np.concatenate([INSIDE - firm[low], -equal])
        if not miss.size or (np.abs(equal).max(initial=0.0) < INSIDE and firm.min() > 0.5 * INSIDE):
            break
        free = np.append((y[:-1] > 0.0) & (y[:-1] < 1.0), True)
        slopes = np.vstack([rows.slopes[0][low], rows.slopes[1]])[:, free]
        if not np.isfinite(slopes).all():
            break
        y = y.copy()
        y[free] += np.linalg.lstsq(slopes, miss, rcond=1e-10)[0]
        y[:-1] = np.clip(y[:-1], 0.0, 1.0)
    return y[:-1]


def screened(task: Task, seed: int, count: int = 2048, best: int = 5) -> list[np.ndarray]:
    """Best of many Sobol points that lie apart."""
    z = qmc.Sobol(task.size, seed=seed).random(count)
    order, result = np.argsort(merit(task, z)), list[np.ndarray]()
    for k in order:
        if all(np.sqrt(np.mean((z[k] - other) ** 2)) > 0.2 for other in result):
            result.append(z[k])
        if len(result) == best:
            break
    return result


def evolved(task: Task, seed: int, generations: int = 80) -> np.ndarray:
    """Return where differential evolution ends."""
    result = differential_evolution(
        lambda z: merit(task, np.clip(z.T, 0.0, 1.0)) if z.ndim > 1 else merit(task, np.clip(z, 0.0, 1.0)[None])[0],
        [(0.0, 1.0)] * task.size,
        maxiter=generations,
        popsize=8,
        recombination=0.9,
        tol=1e-9,
        seed=seed,
        polish=False,
        vectorized=True,
        updating="deferred",
    )
    return np.asarray(result.x)


def attacked(
    task: Task, seed: int, claimed: tuple[float, ...] | None, near: np.ndarray | None = None
) -> Iterator[np.ndarray]:
    """Yield designs that may be better than claimed, each a point of the unit box.

    claimed: the objectives to beat, in units of the scale, or nothing where any admissible design refutes. near: the
    one start there is, in place of the best of many, an evolved one and random ones. A later level is sought with the
    claimed earlier ones held.
    """
    claims, ends = claimed or (np.inf,), list[np.ndarray]()
    for start in _starts(task, seed) if near is None else [near]:
        solution = solved(task, start, claims[0], ends=ends)
        if solution is None:
            continue
        ends.append(solution)
        yield solution
        for level in range(1, len(claims)):
            later = solved(task, solution, claims[level], level, claims[:level])
            yield solution if later is None else later


def _starts(task: Task, seed: int) -> Iterator[np.ndarray]:
    yield from screened(task, seed)
    yield evolved(task, seed)
    yield from np.random.default_rng(seed).random((2, task.size))
