"""The certificate: is this design a proven local optimum of its target? Computed apart from the solver.

One KKT system per level, on gradients of the true extremes in 40 digits, with multipliers of its own (non-negative
least squares). A limit with a positive multiplier at one level is an equality of free sign at the next.
"""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from loomopt.cycle import Floats
from loomopt.nlp.point import Settings
from loomopt.program.program import Limit, Objective, Program
from loomopt.program.sampling import Sampler
from loomopt.solving.bounded import between_points, cycle_rows, judged
from loomopt.solving.exact import Exact, Row
from loomopt.solving.nnls import nnls
from loomopt.solving.prices import priced
from loomopt.solving.second_order import Lagrangian, least_on_cone
from loomopt.solving.verdict import Binding, Certificate, Level

FEASIBILITY, STATIONARITY, COMPLEMENTARITY = 1e-9, 1e-6, 1e-8
ACTIVE = 1e-7
"""Rows this close to their bound, in their natural size, take part in the KKT system."""
POSITIVE = 1e-8
"""Multipliers above this, in natural sizes, bind."""
FLAT = 1e-7
FAINT = 1e-4
"""Curvature up to which a direction is looked along, for what higher orders do there."""
MEASURE, FARTHEST = 1e6, 1e8
"""Largest multiplier that is a price, and largest variable that is a design, in natural sizes."""
CURVED, CORRECTED = 1e-5, 1e-13
"""Curvature that Newton's step may follow, and the slope it need not mind."""


def certify(program: Program, x: Mapping[str, float], accuracy: float) -> Certificate:
    """Return the certificate of variables x (SI) as an optimum of the program's target."""
    settings = Settings(accuracy)
    try:
        sampler = Sampler(program.model, {**program.parameters, **x}, settings.sampled)
        return _Trial(program, dict(x), sampler, settings).verdict()
    except (ArithmeticError, TypeError, ValueError, np.linalg.LinAlgError) as error:
        reason = f"a value or a slope is no number here ({type(error).__name__})"
        return Certificate(False, (reason,), (), math.inf, math.inf, False, False)


def _sized(sampler: Sampler, limit: Limit) -> float:
    """Return how far a limit is exceeded, in its natural size; an equality how far it is missed."""
    excess = sampler.excess(limit)
    return abs(excess) if limit.sign == 0 else excess


class _Trial:
    """One design before the court: rows, gradients, and what the levels have settled so far."""

    def __init__(self, program: Program, x: dict[str, float], sampler: Sampler, settings: Settings) -> None:
        self.program, self.x, self.sampler, self.accuracy = program, x, sampler, settings.accuracy
        self.checked = settings.checked
        self.excess = {k: _sized(sampler, limit) for k, limit in enumerate(program.limits)}
        self.limits = [row for k, limit in enumerate(program.limits) for row in self._limit_rows(k, limit)]
        self.pieces = [self._pieces(objective) for objective in program.objectives]
        self.rows = self.limits + [row for pieces in self.pieces for row in pieces]
        self.exact = Exact(program, x, sampler, self.rows)
        self.gradients = self.exact.gradients()
        self.multipliers: list[Floats] = []
        self.minimum, self.unique = True, True
        self.falling = ""
        """The objective that falls where second order does not decide."""
        self.correction: dict[str, float] = {}
        self.step = 0.0
        self.settled_alone = False
        """Whether the levels so far leave a single design: then later ones have nothing to choose, and no KKT point."""

    def _limit_rows(self, k: int, limit: Limit) -> list[Row]:
        """Return the rows of a limit that is touched; each touching extreme of a whole-cycle limit is one."""
        if limit.sign != 0 and self.excess[k] < -ACTIVE:
            return []
        if limit.weight and self.sampler.single(limit.weight) == 0.0:
            # Where the weight vanishes it can still grow, to second order: the limit keeps the row from below only.
            limit = replace(limit, sign=-1)
            return [Row(limit.name, limit.scale, 1.0, limit=limit, place=k)] if self.program.limits[k].sign <= 0 else []
        if limit.family != "cycle":
            return [Row(limit.name, limit.scale, 1.0, limit=limit, place=k)]
        found = self.sampler.extremes(limit.row, limit.where)
        touching = [e for e in found if e.height >= limit.bound - ACTIVE * limit.scale]
        return [Row(limit.name, limit.scale, e.sign, limit=limit, node=e, place=k) for e in touching]

    def _pieces(self, objective: Objective) -> list[Row]:
        """Return the smooth pieces whose largest is the objective's value."""
        if objective.form == "value":
            return [Row(objective.figure, objective.scale, 1.0, objective=objective)]
        if objective.form == "magnitude":
            value = self.sampler.single(objective.row)
            signs = (1.0, -1.0) if abs(value) <= FEASIBILITY * objective.scale else (float(np.sign(value)),)
            return [Row(objective.figure, objective.scale, sign, objective=objective) for sign in signs]
        found = self.sampler.extremes(objective.row)
        top = found[0].height
        touching = [e for e in found if e.height >= top - ACTIVE * objective.scale]
        return [Row(objective.figure, objective.scale, e.sign, objective=objective, node=e) for e in touching]

    def verdict(self) -> Certificate:
        """Judge the levels in order."""
        reasons = []
        sizes = {v.name: v.scale for v in self.program.variables}
        if max((abs(self.x[name]) / size for name, size in sizes.items() if name in self.x), default=0.0) > FARTHEST:
            reasons.append("the design is out of all proportion: slopes cannot be trusted here")
        feasibility = float(max(0.0, *self.excess.values()))
        if not feasibility <= FEASIBILITY:
            worst = max(self.excess, key=lambda k: self.excess[k])
            reasons.append(f"limit {self.program.limits[worst].name} is exceeded by {feasibility:.2g} of its size")
        rows = cycle_rows(self.program)
        violation = between_points(self.sampler, rows, self.checked)
        if not violation <= self.accuracy:
            reasons.append(f"a whole-cycle value is exceeded by {violation:.2g} between refined points")
        bound = judged(self.sampler, rows, self.accuracy)
        if bound == "violated":
            reasons.append("a whole-cycle value is exceeded somewhere between refined points")
        levels = []
        for place, objective in enumerate(self.program.objectives):
            if self.settled_alone:
                self.multipliers.append(np.zeros(len(self.rows)))
                levels.append(Level(objective.figure, 0.0, 0.0, 0.0))
                continue
            level = self._level(place, objective)
            levels.append(level)
            if not level.stationarity <= STATIONARITY:
                reasons.append(f"{objective.figure} can still fall: stationarity {level.stationarity:.2g}")
            if not level.complementarity <= COMPLEMENTARITY:
                reasons.append(f"a limit that is not met exactly carries a price: {level.complementarity:.2g}")
            if level.price > MEASURE:
                reasons.append(
                    f"the price of limit {level.dearest} is without measure: {level.price:.2g}, no KKT point"
                )
        if self.falling:
            reasons.append(f"second order does not decide: {self.falling} falls along a direction without curvature")
        if not self.minimum:
            reasons.append("second order fails: along some direction the objective falls (a saddle or a maximum)")
        return Certificate(
            not reasons,
            tuple(reasons),
            tuple(levels),
            feasibility,
            violation,
            self.minimum,
            self.unique,
            self._binding(),
            by="bounded" if bound == "proven" else "refined",
            correction=self.correction,
            step=self.step,
        )

    def _columns(self, place: int) -> tuple[list[int], list[int], list[int]]:
        """Return the rows of this level: its pieces, the inequalities, and those held as equalities."""
        begin = len(self.limits) + sum(map(len, self.pieces[:place]))
        pieces = list(range(begin, begin + len(self.pieces[place])))
        bound = np.max([np.zeros(len(self.rows)), *map(np.abs, self.multipliers)], axis=0) > POSITIVE
        equal = [k for k, row in enumerate(self.limits) if row.limit and (row.limit.sign == 0 or bound[k])]
        held = [k for k in range(len(self.limits), begin) if bound[k]]
        return pieces, [k for k in range(len(self.limits)) if k not in equal], equal + held

    def _level(self, place: int, objective: Objective) -> Level:
        """Solve one level's KKT system and judge its curvature."""
        pieces, inequalities, equal = self._columns(place)
        found, residual = self._multipliers(pieces, inequalities, equal)
        self.multipliers.append(found)
        held = sum(abs(found[k]) for k in equal if k >= len(self.limits))
        if not (objective.form == "magnitude" and len(pieces) == 2):
            found = self._bent(place, pieces, inequalities, equal, found, float(residual))
        limits = [k for k in inequalities + equal if k < len(self.limits)]
        slack = [abs(found[k] * self._slack(k)) for k in limits]
        dearest = max(limits, key=lambda k: abs(found[k]), default=None)
        price, name = (0.0, "") if dearest is None else (float(abs(found[dearest])), self.rows[dearest].name)
        return Level(objective.figure, float(residual), float(max(slack, default=0.0)), float(held), price, name)

    def _multipliers(self, pieces: list[int], inequalities: list[int], equal: list[int]) -> tuple[Floats, float]:
        """Return one level's multipliers of all rows, and the slope they leave."""
        signed = [(k, 1.0) for k in pieces + inequalities + equal] + [(k, -1.0) for k in equal]
        size = self.gradients.shape[1]
        matrix = np.zeros((size + 1, len(signed)))
        for column, (k, sign) in enumerate(signed):
            matrix[:size, column] = sign * self.gradients[k]
            matrix[size, column] = 1.0 if k in pieces else 0.0
        target = np.zeros(size + 1)
        target[size] = 1.0
        solution = nnls(matrix, target)
        found = np.zeros(len(self.rows))
        for (k, sign), value in zip(signed, solution, strict=True):
            found[k] += sign * value
        return found, float(np.abs(matrix @ solution - target).max())

    def _bent(
        self,
        place: int,
        pieces: list[int],
        inequalities: list[int],
        equal: list[int],
        found: Floats,
        residual: float,
    ) -> Floats:
        """Judge one level's curvature; returns the multipliers that it holds for, where several share the slopes."""
        before = self.minimum
        self._curve(place, pieces, equal, found, residual)
        judged = self.minimum, self.unique
        if not before or all(judged):
            return found
        for k in (k for k in inequalities if found[k] > POSITIVE):
            other, left = self._multipliers(pieces, [j for j in inequalities if j != k], equal)
            if left <= STATIONARITY:
                self.minimum = True
                self._curve(place, pieces, equal, other, left)
                if (self.minimum, self.unique) > judged:
                    self.multipliers[-1] = other
                    return other
        self.minimum, self.unique = judged
        return found

    def _slack(self, k: int) -> float:
        """Return a limit row's residual in its natural size."""
        row = self.rows[k]
        assert row.limit is not None
        if row.node:
            return (row.node.height - row.limit.bound) / row.limit.scale
        return self.excess[row.place]

    def _curve(self, place: int, pieces: list[int], equal: list[int], multipliers: Floats, residual: float) -> None:
        """Judge the Lagrangian's curvature along the directions that no binding row forbids.

        Binding are limits with a multiplier, equalities, and the differences between pieces that share the objective.
        """
        self.unique = True
        bound = np.abs(multipliers) > POSITIVE
        fixed = {k for k, row in enumerate(self.limits) if row.limit and row.limit.row in self.program.fixed}
        rows = sorted({*equal, *fixed, *(k for k in range(len(self.limits)) if bound[k])})
        shared = [k for k in pieces if bound[k]]
        jacobian = np.vstack([self.gradients[rows], self.gradients[shared[1:]] - self.gradients[shared[:1]]])
        _, sizes, basis = np.linalg.svd(jacobian)
        free = basis[int(np.sum(sizes > FLAT * max(1.0, sizes.max(initial=0.0)))) :].T
        missed = np.array(
            [self._missed(k) for k in rows] + [self._missed(k) - self._missed(shared[0]) for k in shared[1:]]
        )
        back = -np.linalg.lstsq(jacobian, missed, rcond=FLAT)[0]
        if free.shape[1] == 0:
            self.settled_alone = True
            self._correct(back, free, np.zeros(0), multipliers)
            return
        curved = self.exact.curvatures(free)
        hessian = np.tensordot(multipliers, curved, axes=1)
        values, vectors = np.linalg.eigh(hessian)
        self.settled_alone = bool(values.min() > FLAT)
        self._correct(back, free @ vectors[:, values > CURVED], values[values > CURVED], multipliers)
        weak = [k for k in range(len(self.limits)) if k not in rows]
        slopes = self.gradients[weak] @ free
        slopes = slopes[np.abs(slopes).max(axis=1, initial=0.0) > FLAT]
        if values.min() < -FLAT and least_on_cone(hessian, slopes) < -FLAT:
            self.minimum = self.unique = False
            return
        ways = []
        for value, vector in zip(values, vectors.T, strict=True):
            open_ways = [way for way in (vector, -vector) if np.max(slopes @ way, initial=-np.inf) <= FLAT]
            self.unique = self.unique and (bool(value > FLAT) or not open_ways)
            ways += open_ways if value <= FAINT else []
        self._probe(place, multipliers, [free @ way for way in ways], residual)

    def _probe(self, place: int, multipliers: Floats, ways: list[Floats], residual: float) -> None:
        """Look where second order does not decide: whether the Lagrangian falls along directions without curvature."""
        prices: dict[int, float] = {}
        for k, row in enumerate(self.limits):
            if abs(multipliers[k]) > POSITIVE:
                prices[row.place] = prices.get(row.place, 0.0) + float(multipliers[k])
        held: dict[int, float] = {}
        for k in range(len(self.limits), len(self.rows)):
            earlier = next(i for i, o in enumerate(self.program.objectives) if o is self.rows[k].objective)
            if earlier < place and multipliers[k]:
                held[earlier] = held.get(earlier, 0.0) + float(multipliers[k])
        lagrangian = Lagrangian(self.program, self.x, place, prices, held)
        sizes = {v.name: v.scale for v in self.program.variables}
        for way in ways:
            direction = {name: float(part) * sizes[name] for name, part in zip(self.exact.names, way, strict=True)}
            if lagrangian.falls(direction, residual):
                self.falling = self.program.objectives[place].figure
                return

    def _missed(self, k: int) -> float:
        """Return by how much a binding row is missed, with its sign; 0 for an objective held where it stands."""
        row = self.rows[k]
        if row.node:
            return (row.node.height - (row.limit.bound if row.limit else 0.0)) / row.scale
        if row.limit is None:
            return 0.0
        return self.sampler.excess(row.limit)

    def _correct(self, back: Floats, directions: Floats, bends: Floats, multipliers: Floats) -> None:
        """Keep Newton's step: back onto the binding rows, and along curved directions (variables, k) down the slope.

        Unless an earlier level already asks for one, or there is nothing left to correct.
        """
        pull = directions.T @ (multipliers @ self.gradients)
        if self.correction or max(np.abs(pull).max(initial=0.0), np.abs(back).max(initial=0.0)) <= CORRECTED:
            return
        step = back - directions @ (pull / bends)
        sizes = {v.name: v.scale for v in self.program.variables}
        self.step = float(np.abs(step).max(initial=0.0))
        self.correction = {name: float(part * sizes[name]) for name, part in zip(self.exact.names, step, strict=True)}

    def _binding(self) -> tuple[Binding, ...]:
        """Return the limits that bind, each with its worth for the first objective it moves."""
        found = []
        for k, row in enumerate(self.limits):
            for objective, multipliers in zip(self.program.objectives, self.multipliers, strict=True):
                if abs(multipliers[k]) > POSITIVE and row.limit and not row.limit.hidden:
                    found.append(priced(self.sampler, row.limit, objective, float(multipliers[k])))
                    break
        return tuple(found)
