"""The certificate: whether a design is a local optimum of its target, computed independently of the solver.

One KKT system per level, on gradients of the true extremes, with multipliers from non-negative least squares. A limit
with a positive multiplier at one level is an equality of free sign at the next. Gradients are computed by jets; where a
quantity is too near its threshold for floats, the certificate is computed again in 40 digits.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from loomopt.base.errors import BadInput, blamed
from loomopt.base.records import lazy
from loomopt.model.program import Program
from loomopt.model.sampling import Sampler, sampled
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import DOUBT, FEASIBLE, FLAT, JET_ERROR, POSITIVE, STATIONARY
from loomopt.solving.certificate import kkt, second_order
from loomopt.solving.certificate.derivatives import Derivatives, JetDerivatives
from loomopt.solving.certificate.kkt import ActiveRow, ActiveSet, LevelMultipliers, System, active_set, price_limit
from loomopt.solving.certificate.multiplier_set import KnownMultipliers, MultiplierSet
from loomopt.solving.certificate.records import Binding, Certificate, FrameRow, JointBinding, Level
from loomopt.solving.certificate.second_order import Curvature, Local
from loomopt.solving.certificate.taylor_bounds import cycle_rows, peaks_verdict, scan_excess
from loomopt.solving.nlp.point import Settings

COMPLEMENTARY = 1e-8
"""Multiplier times distance of a limit: the gain that its bound would still allow. The usual accuracy."""

LARGEST_PRICE = 1e6
"""Multiplier above which there is no KKT point: STATIONARY times it is a slope of 1. Hock-Schittkowski's degenerate
problems end at 2e16, every packaged scene below 1e2."""

LARGEST_VARIABLE = 1e8
"""Scaled variable above which slopes cannot be trusted: floats then resolve no better than 1e-8 of a scale."""

SECOND_ORDER_OPEN = "second order open"
"""Reason of a certificate where neither curvature nor higher orders decide."""


class CertifiedLevel(NamedTuple):
    """Certificate of a level: residuals, multipliers, and curvature (None if it was not computed)."""

    level: Level
    multipliers: LevelMultipliers
    curvature: Curvature | None = None


class WholeCycle(NamedTuple):
    """Check of the whole cycle: excess over the refined values, and the status of the bound by boxes."""

    violation: float
    bound: str


def certify(program: Program, x: Mapping[str, float], accuracy: float, shown: int = 0) -> Certificate:
    """Certificate of variables x (SI) as an optimum of the program's target.

    By jets; by 40 digits where floats leave a verdict in doubt. shown: number of first levels that are known not to
    fall here to higher order, from the certificate of a program with these levels and no more constraints.
    """
    return draft_certificate(program, x, accuracy, shown).whole


def draft_certificate(program: Program, x: Mapping[str, float], accuracy: float, shown: int = 0) -> "Draft":
    """Certificate at the extremes only; the rest of the cycle is checked when `whole` is read.

    Parameters as for `certify`.
    """
    draft = _draft(JetDerivatives, program, x, accuracy, shown)
    if draft.partial.clear:
        return draft
    from loomopt.solving.certificate.derivatives_mp import MpmathDerivatives

    return _draft(MpmathDerivatives, program, x, accuracy, shown)


def certify_by(
    derivatives: type[Derivatives], program: Program, x: Mapping[str, float], accuracy: float, shown: int = 0
) -> Certificate:
    """Certificate of variables x (SI) by one kind of derivatives; shown: as in `certify`."""
    return _draft(derivatives, program, x, accuracy, shown).whole


@dataclass(frozen=True)
class Draft:
    """A certificate without and with the check of the whole cycle.

    put(cycle): the certificate with the result of the check; scan(): the check, None where nothing can be checked.
    """

    put: Callable[[WholeCycle], Certificate]
    scan: Callable[[], WholeCycle] | None = None

    def with_rules(self, rules: tuple[str, ...]) -> "Draft":
        """The draft with the rules that chose among equally good designs."""
        put = self.put
        return Draft(lambda cycle: replace(put(cycle), tie_breaks=rules), self.scan) if rules else self

    @lazy
    def partial(self) -> Certificate:
        """The certificate without the check of the whole cycle."""
        return self.put(WholeCycle(0.0, "proven"))

    @lazy
    def whole(self) -> Certificate:
        """The certificate with the check of the whole cycle."""
        if self.scan is None:
            return self.partial
        try:
            return self.put(self.scan())
        except NO_NUMBER as error:
            return _no_number(error, self.partial.by, self.partial.clear)


def _draft(
    derivatives: type[Derivatives], program: Program, x: Mapping[str, float], accuracy: float, shown: int
) -> Draft:
    """Draft of the certificate of variables x (SI) by one kind of derivatives."""
    try:
        sampler, active = prepare(program, x, accuracy)
        slopes = derivatives(program, x, sampler, active.rows)
        return draft_from(program, x, sampler, active, slopes, accuracy, shown)
    except NO_NUMBER as error:
        no_number = _no_number(error, derivatives.by, derivatives.last)
        return Draft(lambda cycle: no_number)


def _no_number(error: Exception, by: str, clear: bool) -> Certificate:
    """Certificate of a design at which a quantity has no value."""
    bad_input = blamed(error)
    why = f": {bad_input.problem}" if isinstance(bad_input, BadInput) else f" ({type(error).__name__})"
    reason = f"a value or a slope is not a number here{why}"
    return Certificate(False, (reason,), (), math.inf, math.inf, False, False, by=by, clear=clear)


NO_NUMBER = ArithmeticError, TypeError, ValueError, np.linalg.LinAlgError
"""Errors that formulas raise where a design has no value."""


def prepare(program: Program, x: Mapping[str, float], accuracy: float) -> tuple[Sampler, ActiveSet]:
    """Sampler and active set of variables x (SI). Raises any of `NUMBERLESS`."""
    sampler = sampled(program.model, {**program.parameters, **x}, Settings(accuracy).sample_count)
    sampler.search(name for name, _, _ in cycle_rows(program))
    return sampler, active_set(program, sampler)


def draft_from(
    program: Program,
    x: Mapping[str, float],
    sampler: Sampler,
    active: ActiveSet,
    slopes: Derivatives,
    accuracy: float,
    shown: int = 0,
) -> Draft:
    """Draft of the certificate of variables x (SI) from their derivatives. Raises any of `NUMBERLESS`."""
    rows = cycle_rows(program)
    local = Local(program, x, sampler, active, slopes, slopes.gradients(), shown=shown)
    levels, model_reason = certify_levels(local), _model_reason(sampler)
    prices = _price_limits(local, levels)

    def put(cycle: WholeCycle) -> Certificate:
        return _certificate(local, cycle, levels, prices, accuracy, model_reason)

    def scan() -> WholeCycle:
        return WholeCycle(
            scan_excess(sampler, rows, Settings(accuracy).check_count), peaks_verdict(sampler, rows, accuracy)
        )

    return Draft(put, scan)


def certify_levels(local: Local) -> list[CertifiedLevel]:
    """All levels in order; levels after one that determines the design have nothing to choose."""
    levels: list[CertifiedLevel] = []
    for place, objective in enumerate(local.program.objectives):
        if any(level.curvature and level.curvature.determined for level in levels):
            no_multipliers = LevelMultipliers(np.zeros(len(local.active.rows)), 0.0)
            levels.append(CertifiedLevel(Level(objective.figure, 0.0, 0.0, 0.0), no_multipliers))
        else:
            levels.append(_certify_level(local, place, levels))
    return levels


def _certify_level(local_design: Local, place: int, earlier: Sequence[CertifiedLevel]) -> CertifiedLevel:
    """Solve one level's KKT system in the directions that earlier levels leave free, and compute its curvature."""
    local = local_design._replace(
        closed=tuple(c for level in earlier if level.curvature and (c := level.curvature.closed))
    )
    system = kkt.system(local.active, place, [level.multipliers for level in earlier], local.program.fixed)
    if local.active.zero[place]:
        first = kkt.vanishing_multipliers(system, len(local.active.rows))
        return CertifiedLevel(_residuals(local, place, system, first, first.residual), first)
    first = _exact_multipliers(local, system)
    first_order = CertifiedLevel(_residuals(local, place, system, first, first.residual), first)
    try:
        multipliers, curvature = _best_multipliers(local, place, system, first)
    except (ArithmeticError, TypeError, ValueError, np.linalg.LinAlgError):
        # Where a row's slope is infinite there is no second derivative; it is not needed where the first-order
        # residual already rejects the design.
        if first.residual <= STATIONARY:
            raise
        return first_order
    return CertifiedLevel(_residuals(local, place, system, multipliers, first.residual), multipliers, curvature)


def _exact_multipliers(local: Local, system: System) -> LevelMultipliers:
    """Multipliers of rows that hold exactly, where the rows nearby are not needed to balance the slopes.

    Where two corners of limits almost coincide, the limits of either can balance the slopes.
    """
    first = kkt.solve_system(local.slopes, system)
    multipliers, reduced = first, system
    while multipliers.residual <= STATIONARY:
        products = {k: abs(multipliers.values[k] * local.active.rows[k].excess) for k in reduced.inequalities}
        inexact = [k for k, product in products.items() if product > COMPLEMENTARY]
        if not inexact:
            return multipliers
        reduced = reduced.without(*inexact)
        multipliers = kkt.solve_system(local.slopes, reduced)
    return first


def _best_multipliers(
    local: Local, place: int, system: System, first: LevelMultipliers
) -> tuple[LevelMultipliers, Curvature]:
    """Multipliers with the best curvature, where several sets balance the slopes."""
    curvature = second_order.second_order_of(local, place, system, first)
    if curvature.minimum and curvature.unique:
        return first, curvature
    for k in kkt.replaceable_rows(local.slopes, system, first, STATIONARY):
        candidate = kkt.solve_system(local.slopes, system.without(k))
        if candidate.residual <= STATIONARY:
            candidate_curvature = second_order.second_order_of(local, place, system, candidate)
            if (candidate_curvature.minimum, candidate_curvature.unique) > (curvature.minimum, curvature.unique):
                return candidate, candidate_curvature
    if curvature.higher == "open" and len(system.higher_levels):
        # The slopes of earlier levels sum to zero, so they may share a multiplier that the limits alone can carry.
        candidate = kkt.solve_system(local.slopes, system.without_higher_levels())
        if candidate.residual <= STATIONARY:
            candidate_curvature = second_order.second_order_of(local, place, system, candidate)
            if candidate_curvature.minimum and candidate_curvature.higher == "holds":
                return candidate, candidate_curvature
    return first, curvature


def _residuals(local: Local, place: int, system: System, multipliers: LevelMultipliers, residual: float) -> Level:
    """Residuals of one level, and the limit with the largest multiplier."""
    rows, values = local.active.rows, multipliers.values
    slack = max((abs(values[k] * rows[k].excess) for k in system.limits), default=0.0)
    earlier_multiplier = float(sum(abs(values[k]) for level in range(place) for k in local.active.levels[level]))
    largest = max(system.limits, key=lambda k: abs(values[k]), default=None)
    price, name = (0.0, "") if largest is None else (float(abs(values[largest])), rows[largest].name)
    figure = local.program.objectives[place].figure
    return Level(figure, residual, float(slack), earlier_multiplier, price, name)


def _model_reason(sampler: Sampler) -> str:
    """Reason why the design's states need another model than the solve's; "" if they do not."""
    if not sampler.model.states:
        return ""
    from loomopt.model.model import unserved

    return unserved(sampler.model, sampler.values)


def _certificate(
    local: Local,
    cycle: WholeCycle,
    levels: Sequence[CertifiedLevel],
    prices: "Prices",
    accuracy: float,
    model: str = "",
) -> Certificate:
    """Certificate with every reason against it; model: reason against the model, if any."""
    feasibility = float(max(0.0, *local.active.excess))
    reasons = [*_design_reasons(local, feasibility), *_cycle_reasons(cycle, accuracy), *_optimality_reasons(levels)]
    reasons += [model] if model else []
    curvatures = [level.curvature for level in levels if level.curvature]
    step = next((curvature.step for curvature in curvatures if len(curvature.step)), np.zeros(0))
    names = local.derivatives.names
    correction = dict(zip(names, map(float, step * local.scales), strict=True)) if len(step) else {}
    flat_directions = curvatures[-1].level if curvatures else ()
    return Certificate(
        not reasons,
        tuple(reasons),
        tuple(level.level for level in levels),
        feasibility,
        cycle.violation,
        all(curvature.minimum for curvature in curvatures),
        curvatures[-1].unique if curvatures else not any(local.active.zero),
        prices.binding,
        by=local.derivatives.by,
        clear=local.derivatives.last or not _is_doubtful(local, levels),
        whole_cycle="bounded" if cycle.bound == "proven" else "refined",
        correction=correction,
        step=float(np.abs(step).max(initial=0.0)),
        level=tuple(dict(zip(names, map(float, direction), strict=True)) for direction in flat_directions),
        frame=tuple(map(_frame_row, _stopping_rows(local, levels))),
        bind_together=prices.together,
        prices_unique=prices.unique,
    )


def _stopping_rows(local: Local, levels: Sequence[CertifiedLevel]) -> list[ActiveRow]:
    """Rows that stop a design; none where levels before the deciding one do not vanish."""
    active, last = local.active, len(levels) - 1
    deciding = next((k for k, level in enumerate(levels) if level.curvature and level.curvature.determined), last)
    if active.zero[deciding] or not all(active.zero[:deciding]):
        return []
    weights = levels[deciding].multipliers.values
    vanishing = [active.levels[k][0] for k in range(deciding)]
    pieces = [k for k in active.levels[deciding] if weights[k] > POSITIVE]
    return [active.rows[k] for k in (*range(active.limits), *vanishing, *pieces)]


def _frame_row(row: ActiveRow) -> FrameRow:
    side = row.limit.sign if row.limit else 0
    node = (row.node.piece, row.node.u, row.node.signed) if row.node else ()
    return FrameRow(row.limit is None, row.place, row.reads, row.sign, side, *node)


def _is_doubtful(local: Local, levels: Sequence[CertifiedLevel]) -> bool:
    """Whether floats leave a verdict in doubt: a quantity near its threshold, or an error as large as one."""
    for level_check in levels:
        level, multipliers = level_check.level, np.abs(level_check.multipliers.values)
        residuals = [level.stationarity / STATIONARY, level.complementarity / COMPLEMENTARY]
        ratios = [*residuals, level.price / LARGEST_PRICE, *(multipliers / POSITIVE)]
        error = JET_ERROR * float(multipliers @ np.abs(local.gradients).max(axis=1, initial=1.0))
        errors = [error / STATIONARY]
        if level_check.curvature:
            ratios += list(level_check.curvature.ratios)
            errors.append(level_check.curvature.error / FLAT)
        if max(errors) >= 1.0 or any(1 / DOUBT < ratio < DOUBT for ratio in ratios):
            return True
    return False


def _design_reasons(local: Local, feasibility: float) -> Iterator[str]:
    """Yield the reasons against the design itself."""
    sizes = {v.name: v.scale for v in local.program.variables}
    if max((abs(x) / sizes[name] for name, x in local.x.items() if name in sizes), default=0.0) > LARGEST_VARIABLE:
        yield "the numbers of the design differ too much in size for reliable slopes"
    if not feasibility <= FEASIBLE:
        worst = max(range(len(local.active.excess)), key=lambda k: local.active.excess[k])
        yield f"limit {local.program.limits[worst].name} is exceeded by {feasibility:.2g} of its size"


def _cycle_reasons(cycle: WholeCycle, accuracy: float) -> Iterator[str]:
    """Yield the reasons from the check of the whole cycle."""
    if not cycle.violation <= accuracy:
        yield f"a whole-cycle limit is exceeded by {cycle.violation:.2g} between refined points"
    if cycle.bound == "violated":
        yield "a whole-cycle limit is exceeded somewhere between refined points"


def _optimality_reasons(levels: Sequence[CertifiedLevel]) -> Iterator[str]:
    """Yield the reasons against optimality: first order of each level, then second order."""
    for level in (level_check.level for level_check in levels):
        if not level.stationarity <= STATIONARY:
            yield f"{level.objective} can still fall: stationarity {level.stationarity:.2g}"
        if not level.complementarity <= COMPLEMENTARY:
            yield f"a limit that is not met exactly carries a price: {level.complementarity:.2g}"
        if level.price > LARGEST_PRICE:
            yield f"the price of limit {level.dearest} is too large: {level.price:.2g}, no KKT point"
    falling = [
        level_check.level.objective
        for level_check in levels
        if level_check.curvature and level_check.curvature.higher == "falls"
    ]
    if falling:
        yield f"second order does not decide: {falling[-1]} falls along a direction without curvature"
    elif any(level_check.curvature.higher == "open" for level_check in levels if level_check.curvature):
        yield SECOND_ORDER_OPEN
    if not all(level_check.curvature.minimum for level_check in levels if level_check.curvature):
        yield "second order fails: along some direction the objective falls (a saddle or a maximum)"


class Prices(NamedTuple):
    """Binding limits, limits that are worth more together than alone, and whether every limit has one price."""

    binding: tuple[Binding, ...]
    together: tuple[JointBinding, ...]
    unique: bool


ONE_PRICE = 1e-7
"""Difference of two multipliers, relative to the larger where that exceeds 1, up to which they are one price: the error
of the slopes of dependent rows (RANK)."""

MOST_JOINT = 8
"""Number of limits without a single price of which all combinations are tested; of more, pairs and the whole set."""


def _price_limits(local: Local, levels: Sequence[CertifiedLevel]) -> Prices:
    """Worth of the limits, of each for the first objective that it moves."""
    rows = local.active.rows[: local.active.limits]
    places: dict[tuple[str, int], list[int]] = {}
    for k, row in enumerate(rows):
        side = _side(local, k)
        if side and row.name in local.program.named_limits:
            places.setdefault(side, []).append(k)
    bindings: dict[int, Binding] = {}
    together: list[JointBinding] = []
    many_priced: set[int] = set()
    for level, level_check in enumerate(levels):
        known = KnownMultipliers(level_multipliers(local, levels, level))
        tied: list[list[int]] = []
        for name, row_places in list(places.items()):
            low, high = known.range(row_places, ONE_PRICE)
            if max(abs(low), abs(high)) <= POSITIVE:
                continue
            del places[name]
            if math.isfinite(high - low) and high - low <= ONE_PRICE * max(1.0, abs(high)):
                shares = {k: float(level_check.multipliers.values[k]) for k in row_places}
                bindings |= {
                    k: _binding(local, level, k, share) for k, share in shares.items() if abs(share) > POSITIVE
                }
                continue
            single_price = low if low > POSITIVE else high if high < -POSITIVE and not name[1] else 0.0
            bindings[row_places[0]] = _binding(local, level, row_places[0], single_price)
            tied.append(row_places)
        joint = _joint_bindings(local, level, known, tied, bindings)
        together += joint
        partners = {
            (binding.limit.name, binding.limit.sign) for joint_binding in joint for binding in joint_binding.bindings
        }
        # A limit that is worth nothing, alone or with others, does not bind.
        gaining = [row_places[0] for row_places in tied if bindings[row_places[0]].worth]
        gaining += [row_places[0] for row_places in tied if _side(local, row_places[0]) in partners]
        idle = {row_places[0] for row_places in tied}.difference(gaining)
        many_priced |= {row_places[0] for row_places in tied}.difference(idle)
        bindings = {k: binding for k, binding in bindings.items() if k not in idle}
    return Prices(tuple(bindings[k] for k in sorted(bindings)), tuple(together), not many_priced)


def _side(local: Local, place: int) -> tuple[str, int] | None:
    """Name and side of the limit of a row."""
    limit = local.active.rows[place].limit
    return (limit.name, limit.sign) if limit else None


def level_multipliers(local: Local, levels: Sequence[CertifiedLevel], place: int) -> MultiplierSet:
    """All multipliers that balance the slopes of one level."""
    multipliers = levels[place].multipliers
    if local.active.zero[place] or not np.any(multipliers.values):
        # A vanishing level cannot fall; a level with nothing to choose has no prices.
        count = len(local.active.rows)
        return MultiplierSet(np.zeros(count), np.zeros((count, 0)), np.zeros(count, dtype=bool))
    earlier = levels[:place]
    open_local = local._replace(
        closed=tuple(c for level in earlier if level.curvature and (c := level.curvature.closed))
    )
    system = kkt.system(local.active, place, [level.multipliers for level in earlier], local.program.fixed)
    return kkt.multiplier_set(local.active, open_local.slopes, system, multipliers)


def _binding(local: Local, level: int, place: int, multiplier: float) -> Binding:
    """Binding of a row's limit, with its worth by a multiplier."""
    limit = local.active.rows[place].limit
    assert limit is not None
    return price_limit(local.sampler, limit, local.program.objectives[level], multiplier)


def _joint_bindings(
    local: Local,
    level: int,
    multipliers: KnownMultipliers,
    tied: Sequence[Sequence[int]],
    singles: Mapping[int, Binding],
) -> list[JointBinding]:
    """Smallest sets of limits that are worth more together than the sum of their single worths.

    In each set at least one limit is worth nothing alone.

    tied: the rows of each limit that has more than one price; singles: its worth alone, by its first row.
    """
    all_multipliers, ends = multipliers.all_multipliers, list[tuple[int, Binding, Floats]]()
    for row_places in tied:
        unit, single = _binding(local, level, row_places[0], 1.0), singles[row_places[0]]
        cost = np.where(np.isin(np.arange(len(all_multipliers.start)), row_places), unit.worth, 0.0)
        # An equality that gains nothing alone may gain on either side.
        sides = (single.side,) if unit.limit.sign or single.worth else (1, -1)
        ends += [
            (row_places[0], single._replace(side=side), cost if unit.limit.sign else side * cost) for side in sides
        ]
    joint_bindings, accepted = list[JointBinding](), list[set[int]]()
    sizes = range(2, len(ends) + 1) if len(ends) <= MOST_JOINT else (2, len(ends))
    for chosen in itertools.chain.from_iterable(itertools.combinations(range(len(ends)), size) for size in sizes):
        rows, bindings, costs = zip(*(ends[k] for k in chosen), strict=True)
        known = any(smaller <= {*chosen} for smaller in accepted) or len({*rows}) < len(rows)
        if known or all(single.worth for single in bindings):
            continue
        steps = [1.0 / max(float(np.abs(cost).max()), TINY) for cost in costs]
        single_sum = sum(step * single.worth for step, single in zip(steps, bindings, strict=True))
        threshold, joint = single_sum + ONE_PRICE * max(1.0, single_sum), np.array(steps) @ np.array(costs)
        if multipliers.bound(joint) > threshold and multipliers.least(joint) > threshold:
            joint_bindings.append(JointBinding(bindings, np.array(costs), all_multipliers))
            accepted.append({*chosen})
    return joint_bindings


TINY = 1e-300
"""Least cost of a limit, so that its step stays finite."""
