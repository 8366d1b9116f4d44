"""The certificate: is this design a proven local optimum of its target? Computed apart from the solver.

One KKT system per level, on gradients of the true extremes, with multipliers of its own (non-negative least squares). A
limit with a positive multiplier at one level is an equality of free sign at the next. Gradients come by jets; where a
figure that decides is too near its threshold for floats, all is judged again in 40 digits.
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
from loomopt.solving.certificate.kkt import ActiveRow, ActiveSet, LevelMultipliers, System, active_set, priced
from loomopt.solving.certificate.multiplier_set import KnownMultipliers, MultiplierSet
from loomopt.solving.certificate.records import Binding, Certificate, FrameRow, JointBinding, Level
from loomopt.solving.certificate.second_order import Curvature, Local
from loomopt.solving.certificate.taylor_bounds import between_points, cycle_rows, judged
from loomopt.solving.nlp.point import Settings

COMPLEMENTARY = 1e-8
"""Multiplier times distance of a limit: what the objective might still gain by meeting it. The usual accuracy."""

LARGEST_PRICE = 1e6
"""Multiplier above which there is no KKT point: STATIONARY times it is a slope of 1. Hock-Schittkowski's degenerate
problems end at 2e16, every packaged scene below 1e2."""

LARGEST_VARIABLE = 1e8
"""Variable above which slopes cannot be trusted: floats then resolve no better than 1e-8 of a natural size."""

SECOND_ORDER_OPEN = "second order open"
"""The reason of a certificate that neither curvature nor higher orders decide."""


class JudgedLevel(NamedTuple):
    """One level: its residuals, the multipliers they are of, and its curvature (None where there was none to judge)."""

    level: Level
    multipliers: LevelMultipliers
    curvature: Curvature | None = None


class WholeCycle(NamedTuple):
    """What holds over the whole cycle: by how much a refined value is exceeded, and what boxes say."""

    violation: float
    bound: str


def certify(program: Program, x: Mapping[str, float], accuracy: float, shown: int = 0) -> Certificate:
    """Return the certificate of variables x (SI) as an optimum of the program's target.

    By jets; by 40 digits where floats leave a verdict in doubt. shown: of how many first levels it is known that none
    falls here to higher order, from the certificate of a program with those levels that holds nothing more than this.
    """
    return begun(program, x, accuracy, shown).whole


def begun(program: Program, x: Mapping[str, float], accuracy: float, shown: int = 0) -> "Draft":
    """Return the certificate as far as the extremes tell; what lies between them is looked at when that is asked for.

    Parameters as for `certify`.
    """
    quick = _begun(JetDerivatives, program, x, accuracy, shown)
    if quick.judged.clear:
        return quick
    from loomopt.solving.certificate.derivatives_mp import MpmathDerivatives

    return _begun(MpmathDerivatives, program, x, accuracy, shown)


def certified(
    derivatives: type[Derivatives], program: Program, x: Mapping[str, float], accuracy: float, shown: int = 0
) -> Certificate:
    """Return the certificate of variables x (SI) by one way to derivatives; shown: as in `certify`."""
    return _begun(derivatives, program, x, accuracy, shown).whole


@dataclass(frozen=True)
class Draft:
    """A certificate before and after the whole cycle is looked at; scan(): what that shows.

    judged: as if nothing lay between the refined points; put(cycle): the certificate with what does.
    """

    judged: Certificate
    put: Callable[[WholeCycle], Certificate]
    scan: Callable[[], WholeCycle] | None = None

    def settled(self, rules: tuple[str, ...]) -> "Draft":
        """Return it with what chose among equally good designs."""
        if not rules:
            return self
        put = self.put
        return Draft(replace(self.judged, settled=rules), lambda cycle: replace(put(cycle), settled=rules), self.scan)

    @lazy
    def whole(self) -> Certificate:
        """The certificate."""
        if self.scan is None:
            return self.judged
        try:
            return self.put(self.scan())
        except NUMBERLESS as error:
            return _no_number(error, self.judged.by, self.judged.clear)


def _begun(
    derivatives: type[Derivatives], program: Program, x: Mapping[str, float], accuracy: float, shown: int
) -> Draft:
    """Return the certificate of variables x (SI) by one way to derivatives, its whole cycle still to be looked at."""
    try:
        sampler, active = prepared(program, x, accuracy)
        found = derivatives(program, x, sampler, active.rows)
        return drafted(program, x, sampler, active, found, accuracy, shown)
    except NUMBERLESS as error:
        none = _no_number(error, derivatives.by, derivatives.last)
        return Draft(none, lambda cycle: none)


def _no_number(error: Exception, by: str, clear: bool) -> Certificate:
    """Return the certificate of a design at which something has no value."""
    told = blamed(error)
    why = f": {told.problem}" if isinstance(told, BadInput) else f" ({type(error).__name__})"
    reason = f"a value or a slope is no number here{why}"
    return Certificate(False, (reason,), (), math.inf, math.inf, False, False, by=by, clear=clear)


NUMBERLESS = ArithmeticError, TypeError, ValueError, np.linalg.LinAlgError
"""What formulas raise where a design has no value."""


def prepared(program: Program, x: Mapping[str, float], accuracy: float) -> tuple[Sampler, ActiveSet]:
    """Return the sampler of variables x (SI), and their active set. Raises any of `NUMBERLESS`."""
    sampler = sampled(program.model, {**program.parameters, **x}, Settings(accuracy).sample_count)
    sampler.search(name for name, _, _ in cycle_rows(program))
    return sampler, active_set(program, sampler)


def drafted(
    program: Program,
    x: Mapping[str, float],
    sampler: Sampler,
    active: ActiveSet,
    found: Derivatives,
    accuracy: float,
    shown: int = 0,
) -> Draft:
    """Return the certificate of variables x (SI) by derivatives that are found. Raises any of `NUMBERLESS`."""
    rows = cycle_rows(program)
    local = Local(program, x, sampler, active, found, found.gradients(), shown=shown)
    levels, unserved = judged_levels(local), _unserved(sampler)
    prices = _priced(local, levels)

    def put(cycle: WholeCycle) -> Certificate:
        return _certificate(local, cycle, levels, prices, accuracy, unserved)

    def scan() -> WholeCycle:
        return WholeCycle(
            between_points(sampler, rows, Settings(accuracy).check_count), judged(sampler, rows, accuracy)
        )

    return Draft(put(WholeCycle(0.0, "proven")), put, scan)


def judged_levels(local: Local) -> list[JudgedLevel]:
    """Return all levels in order; those after one that settles the design have nothing to choose."""
    found: list[JudgedLevel] = []
    for place, objective in enumerate(local.program.objectives):
        if any(each.curvature and each.curvature.settled for each in found):
            none = LevelMultipliers(np.zeros(len(local.active.rows)), 0.0)
            found.append(JudgedLevel(Level(objective.figure, 0.0, 0.0, 0.0), none))
        else:
            found.append(_judged_level(local, place, found))
    return found


def _judged_level(whole: Local, place: int, earlier: Sequence[JudgedLevel]) -> JudgedLevel:
    """Solve one level's KKT system, along what earlier levels leave open, and judge its curvature."""
    local = whole._replace(closed=tuple(c for each in earlier if each.curvature and (c := each.curvature.closed)))
    system = kkt.system(local.active, place, [each.multipliers for each in earlier], local.program.fixed)
    if local.active.zero[place]:
        first = kkt.vanishing(system, len(local.active.rows))
        return JudgedLevel(_residuals(local, place, system, first, first.residual), first)
    first = _met(local, system)
    alone = JudgedLevel(_residuals(local, place, system, first, first.residual), first)
    try:
        multipliers, curvature = _best(local, place, system, first)
    except (ArithmeticError, TypeError, ValueError, np.linalg.LinAlgError):
        # Beside a point where a row's slope has no end there is no second derivative: where the slope that is left
        # refuses the design already, nothing hangs on it.
        if first.residual <= STATIONARY:
            raise
        return alone
    return JudgedLevel(_residuals(local, place, system, multipliers, first.residual), multipliers, curvature)


def _met(local: Local, system: System) -> LevelMultipliers:
    """Return multipliers that rest on what is met exactly, where those of limits nearby are not needed.

    Where two corners of limits all but coincide, slopes can be balanced by the limits of either.
    """
    first = kkt.solved(local.slopes, system)
    found, rest = first, system
    while found.residual <= STATIONARY:
        lost = {k: abs(found.of[k] * local.active.rows[k].excess) for k in rest.inequalities}
        apart = [k for k, each in lost.items() if each > COMPLEMENTARY]
        if not apart:
            return found
        rest = rest.without(*apart)
        found = kkt.solved(local.slopes, rest)
    return first


def _best(local: Local, place: int, system: System, first: LevelMultipliers) -> tuple[LevelMultipliers, Curvature]:
    """Return the multipliers under which the curvature is best, where several share the slopes."""
    curvature = second_order.judged(local, place, system, first)
    if curvature.minimum and curvature.unique:
        return first, curvature
    for k in kkt.replaceable(local.slopes, system, first, STATIONARY):
        other = kkt.solved(local.slopes, system.without(k))
        if other.residual <= STATIONARY:
            found = second_order.judged(local, place, system, other)
            if (found.minimum, found.unique) > (curvature.minimum, curvature.unique):
                return other, found
    if curvature.higher == "open" and len(system.held):
        # Earlier levels' slopes vanish together, so what they hold may share a price that limits carry alone.
        other = kkt.solved(local.slopes, system.without_held())
        if other.residual <= STATIONARY:
            found = second_order.judged(local, place, system, other)
            if found.minimum and found.higher == "holds":
                return other, found
    return first, curvature


def _residuals(local: Local, place: int, system: System, multipliers: LevelMultipliers, residual: float) -> Level:
    """Return one level's residuals, and the limit with the largest multiplier."""
    rows, of = local.active.rows, multipliers.of
    slack = max((abs(of[k] * rows[k].excess) for k in system.limits), default=0.0)
    held = float(sum(abs(of[k]) for level in range(place) for k in local.active.levels[level]))
    dearest = max(system.limits, key=lambda k: abs(of[k]), default=None)
    price, name = (0.0, "") if dearest is None else (float(abs(of[dearest])), rows[dearest].name)
    figure = local.program.objectives[place].figure
    return Level(figure, residual, float(slack), held, price, name)


def _unserved(sampler: Sampler) -> str:
    """Return why the states of a design need another model than the one it was solved with, "" where they do not."""
    if not sampler.model.states:
        return ""
    from loomopt.model.model import unserved

    return unserved(sampler.model, sampler.values)


def _certificate(
    local: Local,
    cycle: WholeCycle,
    levels: Sequence[JudgedLevel],
    prices: "Prices",
    accuracy: float,
    model: str = "",
) -> Certificate:
    """Return what was verified, and every reason why it is not enough; model: why it is none for here, if so."""
    feasibility = float(max(0.0, *local.active.excess))
    reasons = [*_amiss(local, feasibility), *_open(cycle, accuracy), *_not_least(levels)]
    reasons += [model] if model else []
    curvatures = [each.curvature for each in levels if each.curvature]
    step = next((curvature.step for curvature in curvatures if len(curvature.step)), np.zeros(0))
    names = local.derivatives.names
    moved = dict(zip(names, map(float, step * local.scales), strict=True)) if len(step) else {}
    level = curvatures[-1].level if curvatures else ()
    return Certificate(
        not reasons,
        tuple(reasons),
        tuple(each.level for each in levels),
        feasibility,
        cycle.violation,
        all(curvature.minimum for curvature in curvatures),
        curvatures[-1].unique if curvatures else not any(local.active.zero),
        prices.binding,
        by=local.derivatives.by,
        clear=local.derivatives.last or not _doubtful(local, levels),
        whole_cycle="bounded" if cycle.bound == "proven" else "refined",
        correction=moved,
        step=float(np.abs(step).max(initial=0.0)),
        level=tuple(dict(zip(names, map(float, way), strict=True)) for way in level),
        frame=tuple(map(_frame_row, _stopping(local, levels))),
        bind_together=prices.together,
        prices_unique=prices.unique,
    )


def _stopping(local: Local, levels: Sequence[JudgedLevel]) -> list[ActiveRow]:
    """Return the rows that stop a design; none where levels before the one that chooses do not vanish."""
    active, last = local.active, len(levels) - 1
    chooser = next((k for k, each in enumerate(levels) if each.curvature and each.curvature.settled), last)
    if active.zero[chooser] or not all(active.zero[:chooser]):
        return []
    weights = levels[chooser].multipliers.of
    vanishing = [active.levels[k][0] for k in range(chooser)]
    pieces = [k for k in active.levels[chooser] if weights[k] > POSITIVE]
    return [active.rows[k] for k in (*range(active.limits), *vanishing, *pieces)]


def _frame_row(row: ActiveRow) -> FrameRow:
    side = row.limit.sign if row.limit else 0
    node = (row.node.piece, row.node.u, row.node.signed) if row.node else ()
    return FrameRow(row.limit is None, row.place, row.reads, row.sign, side, *node)


def _doubtful(local: Local, levels: Sequence[JudgedLevel]) -> bool:
    """Say whether floats leave a verdict in doubt: a figure near its threshold, or an error that reaches one."""
    for each in levels:
        level, of = each.level, np.abs(each.multipliers.of)
        residuals = [level.stationarity / STATIONARY, level.complementarity / COMPLEMENTARY]
        figures = [*residuals, level.price / LARGEST_PRICE, *(of / POSITIVE)]
        error = JET_ERROR * float(of @ np.abs(local.gradients).max(axis=1, initial=1.0))
        errors = [error / STATIONARY]
        if each.curvature:
            figures += list(each.curvature.figures)
            errors.append(each.curvature.error / FLAT)
        if max(errors) >= 1.0 or any(1 / DOUBT < figure < DOUBT for figure in figures):
            return True
    return False


def _amiss(local: Local, feasibility: float) -> Iterator[str]:
    """Yield why the design itself cannot be trusted."""
    sizes = {v.name: v.scale for v in local.program.variables}
    if max((abs(x) / sizes[name] for name, x in local.x.items() if name in sizes), default=0.0) > LARGEST_VARIABLE:
        yield "the design is out of all proportion: slopes cannot be trusted here"
    if not feasibility <= FEASIBLE:
        worst = max(range(len(local.active.excess)), key=lambda k: local.active.excess[k])
        yield f"limit {local.program.limits[worst].name} is exceeded by {feasibility:.2g} of its size"


def _open(cycle: WholeCycle, accuracy: float) -> Iterator[str]:
    """Yield why the whole cycle is not covered."""
    if not cycle.violation <= accuracy:
        yield f"a whole-cycle value is exceeded by {cycle.violation:.2g} between refined points"
    if cycle.bound == "violated":
        yield "a whole-cycle value is exceeded somewhere between refined points"


def _not_least(levels: Sequence[JudgedLevel]) -> Iterator[str]:
    """Yield why the design is no proven optimum: first order of each level, then second."""
    for level in (each.level for each in levels):
        if not level.stationarity <= STATIONARY:
            yield f"{level.objective} can still fall: stationarity {level.stationarity:.2g}"
        if not level.complementarity <= COMPLEMENTARY:
            yield f"a limit that is not met exactly carries a price: {level.complementarity:.2g}"
        if level.price > LARGEST_PRICE:
            yield f"the price of limit {level.dearest} is without measure: {level.price:.2g}, no KKT point"
    falling = [each.level.objective for each in levels if each.curvature and each.curvature.higher == "falls"]
    if falling:
        yield f"second order does not decide: {falling[-1]} falls along a direction without curvature"
    elif any(each.curvature.higher == "open" for each in levels if each.curvature):
        yield SECOND_ORDER_OPEN
    if not all(each.curvature.minimum for each in levels if each.curvature):
        yield "second order fails: along some direction the objective falls (a saddle or a maximum)"


class Prices(NamedTuple):
    """Limits that bind, those that are worth more together than alone, and whether every limit has one price."""

    binding: tuple[Binding, ...]
    together: tuple[JointBinding, ...]
    unique: bool


ONE_PRICE = 1e-7
"""Difference of two multipliers, relative to the larger where that exceeds 1, up to which they are one price: what
slopes of rows that depend on each other may differ by (RANK)."""

MOST_TOGETHER = 8
"""Limits without a price of their own of which every combination is looked at; of more, pairs and all of them."""


def _priced(local: Local, levels: Sequence[JudgedLevel]) -> Prices:
    """Return what limits are worth, each for the first objective that it moves."""
    rows = local.active.rows[: local.active.limits]
    places: dict[tuple[str, int], list[int]] = {}
    for k, row in enumerate(rows):
        side = _side(local, k)
        if side and row.name in local.program.named_limits:
            places.setdefault(side, []).append(k)
    found: dict[int, Binding] = {}
    together: list[JointBinding] = []
    several: set[int] = set()
    for level, judged_level in enumerate(levels):
        known = KnownMultipliers(level_multipliers(local, levels, level))
        tied: list[list[int]] = []
        for name, own in list(places.items()):
            low, high = known.range(own, ONE_PRICE)
            if max(abs(low), abs(high)) <= POSITIVE:
                continue
            del places[name]
            if math.isfinite(high - low) and high - low <= ONE_PRICE * max(1.0, abs(high)):
                shares = {k: float(judged_level.multipliers.of[k]) for k in own}
                found |= {k: _binding(local, level, k, share) for k, share in shares.items() if abs(share) > POSITIVE}
                continue
            alone = low if low > POSITIVE else high if high < -POSITIVE and not name[1] else 0.0
            found[own[0]] = _binding(local, level, own[0], alone)
            tied.append(own)
        joint = _together(local, level, known, tied, found)
        together += joint
        partners = {(each.limit.name, each.limit.sign) for of in joint for each in of.bindings}
        # What is worth nothing, alone or with others, does not bind.
        gaining = [own[0] for own in tied if found[own[0]].worth]
        gaining += [own[0] for own in tied if _side(local, own[0]) in partners]
        idle = {own[0] for own in tied}.difference(gaining)
        several |= {own[0] for own in tied}.difference(idle)
        found = {k: each for k, each in found.items() if k not in idle}
    return Prices(tuple(found[k] for k in sorted(found)), tuple(together), not several)


def _side(local: Local, place: int) -> tuple[str, int] | None:
    """Return the name and the side of the limit that a row is of."""
    limit = local.active.rows[place].limit
    return (limit.name, limit.sign) if limit else None


def level_multipliers(local: Local, levels: Sequence[JudgedLevel], place: int) -> MultiplierSet:
    """Return all multipliers that balance the slopes of one level."""
    found = levels[place].multipliers
    if local.active.zero[place] or not np.any(found.of):
        # Of what vanishes nothing can fall; a level with nothing to choose has no prices.
        count = len(local.active.rows)
        return MultiplierSet(np.zeros(count), np.zeros((count, 0)), np.zeros(count, dtype=bool))
    earlier = levels[:place]
    own = local._replace(closed=tuple(c for each in earlier if each.curvature and (c := each.curvature.closed)))
    system = kkt.system(local.active, place, [each.multipliers for each in earlier], local.program.fixed)
    return kkt.multiplier_set(local.active, own.slopes, system, found)


def _binding(local: Local, level: int, place: int, multiplier: float) -> Binding:
    """Return the limit of a row with what it is worth by a multiplier."""
    limit = local.active.rows[place].limit
    assert limit is not None
    return priced(local.sampler, limit, local.program.objectives[level], multiplier)


def _together(
    local: Local,
    level: int,
    multipliers: KnownMultipliers,
    tied: Sequence[Sequence[int]],
    found: Mapping[int, Binding],
) -> list[JointBinding]:
    """Return the smallest sets of limits that are worth more together than the sum of what each is worth alone.

    Of each at least one limit is worth nothing alone.

    tied: the rows of each limit that has more than one price; found: what it is worth alone, by its first row.
    """
    every, ends = multipliers.every, list[tuple[int, Binding, Floats]]()
    for own in tied:
        unit, each = _binding(local, level, own[0], 1.0), found[own[0]]
        cost = np.where(np.isin(np.arange(len(every.start)), own), unit.worth, 0.0)
        # An equality that gains nothing alone may gain on either side.
        sides = (each.side,) if unit.limit.sign or each.worth else (1, -1)
        ends += [(own[0], each._replace(side=side), cost if unit.limit.sign else side * cost) for side in sides]
    together, least = list[JointBinding](), list[set[int]]()
    sizes = range(2, len(ends) + 1) if len(ends) <= MOST_TOGETHER else (2, len(ends))
    for chosen in itertools.chain.from_iterable(itertools.combinations(range(len(ends)), size) for size in sizes):
        rows, bindings, costs = zip(*(ends[k] for k in chosen), strict=True)
        known = any(of <= {*chosen} for of in least) or len({*rows}) < len(rows)
        if known or all(each.worth for each in bindings):
            continue
        steps = [1.0 / max(float(np.abs(cost).max()), TINY) for cost in costs]
        alone = sum(step * each.worth for step, each in zip(steps, bindings, strict=True))
        more, joint = alone + ONE_PRICE * max(1.0, alone), np.array(steps) @ np.array(costs)
        if multipliers.bound(joint) > more and multipliers.least(joint) > more:
            together.append(JointBinding(bindings, np.array(costs), every))
            least.append({*chosen})
    return together


TINY = 1e-300
"""Keeps the step of a limit that costs nothing a number."""
