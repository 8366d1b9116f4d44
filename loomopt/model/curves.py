"""Curves over the cycle, written once: the motion as a job names it, each effect's term, force, torque, checks."""

import itertools
import operator
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from loomopt.base.records import Frozen
from loomopt.base.units import SI_UNIT
from loomopt.maths import systems, turning_points
from loomopt.model.drive import motor_power
from loomopt.model.model import Formula, Instant
from loomopt.model.sampling import Sampler
from loomopt.physics import balance
from loomopt.physics.balance import Acting
from loomopt.physics.cycle import TURN, Floats, Pieces
from loomopt.physics.tolerances import ROUNDED, SAME_ANGLE

SPARSE_STEPS = ((1e-3, 90), (1e-6, 180), (0.0, 360))
"""Equal steps of one turn that curves of few rows begin with, by accuracy; no stretch between corners gets fewer than
LEAST_SHARE of them. Half the samples that are enough: rows are added around what they show."""

SPARSE_ROUNDS, SPARSE_MOST_ROWS = 40, 20_000
"""Rounds in which rows are added, each of which narrows a top's neighbourhood threefold (3^40 is past rounding), and
rows beyond which a curve is as dense as any plot."""

SPARSE_NEARLY, SPARSE_LEVEL = 0.8, 2e-13
"""Share of a column's largest magnitude above which another top may turn out higher: a top between 90 rows stands less
than a fifth above them. Share by which rows on a level may differ: a thousand roundings of the terms they sum."""

SAME_ROW = 1e-9
"""rad; a regular row this close to a corner replaces it: no plot and no workshop resolves the difference."""

STEPS = 720
FORCE: Formula = operator.attrgetter("force")
ANGLE = "phi [rad]"
POWER = "motor_power [W]"
ALIKE = 1e-12
"""Share of a quantity's largest magnitude by which two equal, mirrored maxima may differ."""
COLUMN = re.compile(r"(?P<name>.+) \[(?P<unit>.+)\]")

Rows = tuple[Pieces, Floats, Floats]
"""Nodes (pieces, u), and their crank angles, rad."""


class Columns(NamedTuple):
    """Columns of the curves.

    motion: column name with unit → formula; from name_1, name_2 … with respect to φ follow name_t, name_tt … with
    respect to time, where the speed is known. force: column of the output force, and the quantity (of which sign) that
    it is; torque: likewise of the crank. unit: of the output's terms; the drive's are torques. checks: unit of each
    check's quantity. after: columns after torque and power. also: crank angles, rad, that are rows too. closed:
    whether the row at 2π is one.
    """

    motion: Mapping[str, Formula]
    unit: str
    force: tuple[str, Formula] | None = None
    torque: tuple[str, Formula] | None = None
    after: Mapping[str, Formula] = Frozen()
    checks: Mapping[str, str] = Frozen()
    also: tuple[float, ...] = ()
    closed: bool = False


def curves(sampler: Sampler, columns: Columns, steps: int = STEPS, also: Sequence[float] = ()) -> dict[str, Floats]:
    """Curves of a design over one turn, SI; only columns of effects in the scene.

    Rows are `steps` equal ones, the angles `also`, rad, and both sides of every corner where a formula changes (the
    same angle twice). Where a load's term is not known, neither it nor the force is: NaN.
    """
    return columns_at(sampler, columns, rows(sampler, columns, steps, also))


def columns_at(sampler: Sampler, columns: Columns, rows: Rows) -> dict[str, Floats]:
    """Curves at rows, SI."""
    pieces, u, phi = rows
    node = sampler.node(pieces, u)
    at = sampler.model.instant(systems.numpy(), sampler.given, node)
    unknown = np.zeros(u.shape, dtype=bool)
    if sampler.model.known_in:
        unknown = ~np.any([sampler.cycle.on(where)[pieces] for where in sampler.model.known_in], axis=0)
    curves = {ANGLE: phi} | {name: _column(formula, at, u) for name, formula in columns.motion.items()}
    curves |= _in_time(curves, at)
    if sampler.model.states:
        from loomopt.model import model

        curves |= {name: _column(formula, at, u) for name, formula in model.state_columns(sampler.model.states).items()}
    loads = sampler.model.loads
    for load, term in zip(loads, at.terms().values(), strict=True):
        whole = np.broadcast_to(np.asarray(term, dtype=float), u.shape).astype(float)
        partial = bool(getattr(load, "known_in", dict)(sampler.model.words_of(load.name)))
        unit = columns.unit if load.acts == "output" else SI_UNIT["torque"]
        curves[f"{load_name(load)} [{unit}]"] = np.where(unknown, np.nan, whole) if partial else whole
        within = balance.inside(at.maths, load, at.pose, at.given)
        if within is not None:
            name = f"{drive_name(load)} [{SI_UNIT['torque']}]"
            curves[name] = np.broadcast_to(np.asarray(within, dtype=float), u.shape).astype(float)
    if columns.force and any(load.acts == "output" for load in loads):
        curves[columns.force[0]] = np.where(unknown, np.nan, _column(columns.force[1], at, u))
    if columns.torque and loads:
        torque = np.where(unknown, np.nan, _column(columns.torque[1], at, u))
        curves |= {columns.torque[0]: torque} | ({} if at.pose.omega is None else {POWER: motor_power(at, torque)})
    for name, unit in columns.checks.items():
        column = _column(sampler.model.formula(name), at, u)
        # What only pushes is 0 where the output would have to be pulled.
        lost = name in sampler.model.pushes and _column(FORCE, at, u) < 0.0
        curves[f"{name} [{unit}]"] = np.where(lost, 0.0, column)
    return curves | {name: _column(formula, at, u) for name, formula in columns.after.items()}


def tops(sampler: Sampler, quantities: Iterable[str]) -> list[float]:
    """Crank angles, rad, at which quantities are largest; equal maxima are included."""
    angles = []
    for extremes in map(sampler.extremes, quantities):
        alike = ALIKE * max((abs(extreme.value) for extreme in extremes), default=0.0)
        angles += [sampler.angle(top) for top in extremes if top.height >= extremes[0].height - alike]
    return angles


def _in_time(columns: Mapping[str, Floats], at: Instant) -> dict[str, Floats]:
    """Derivatives with respect to time, SI, of quantities with columns of derivatives with respect to φ.

    x˙ = x' ω, x¨ = x'' ω² + x' ω̇; the third, x''' ω³, at constant speed only. None where the speed is not known.
    """
    omega, change = at.pose.omega, at.pose.omega_dot
    if omega is None:
        return {}
    known, rates = {split(column)[0]: values for column, values in columns.items()}, dict[str, Floats]()
    for name, unit in map(split, columns):
        by_angle = [known.get(f"{name}_{order}") for order in ((1, 2, 3) if change is None else (1, 2))]
        for order, values in enumerate(itertools.takewhile(lambda array: array is not None, by_angle), 1):
            rate = values * omega**order
            rate = rate if change is None or order == 1 else rate + by_angle[0] * change
            rates[f"{name}_{'t' * order} [{unit}/s{f'^{order}' if order > 1 else ''}]"] = rate
    return rates


def drive_name(load: Acting) -> str:
    """Name of the column of the additional term of an output load inside the drive."""
    return f"{load_name(load)}_drive"


def load_name(load: Acting) -> str:
    """Name of a load's column."""
    return getattr(load, "symbol", "") or load.name


def split(column: str) -> tuple[str, str]:
    """Name and unit of a column."""
    match = COLUMN.fullmatch(column)
    return (match["name"], match["unit"]) if match else (column, "1")


def _column(formula: Formula, at: Instant, u: Floats) -> Floats:
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.broadcast_to(np.asarray(formula(at), dtype=float), u.shape).astype(float)


def rows(sampler: Sampler, columns: Columns, steps: int, also: Sequence[float]) -> Rows:
    """Nodes (pieces, u) and their crank angles, rad, in order; a corner at 0 ends the turn at 2π too."""
    cycle = sampler.cycle
    even = np.linspace(0.0, TURN, steps, endpoint=False)
    phi = np.unique(np.concatenate([even, np.mod([*columns.also, *also], TURN)]))
    phi = phi[np.diff(phi, prepend=-1.0) > SAME_ANGLE]
    names = [k for k, name in enumerate(cycle.names) if name in sampler.model.formula_switches]
    switches = cycle.switches[:, names]
    ends = np.flatnonzero(np.any(switches != np.roll(switches, -1, axis=0), axis=1))
    corners = np.mod(cycle.starts[ends + 1], TURN)
    if len(corners):
        apart = np.abs(phi[:, None] - corners[None, :])
        phi = phi[np.min(np.minimum(apart, TURN - apart), axis=1) > SAME_ROW]
    if columns.closed and not np.any(corners == 0.0):
        phi = np.append(phi, TURN)
    pieces, u = cycle.located(phi)
    pieces = np.concatenate([pieces, ends, (ends + 1) % cycle.pieces])
    u = np.concatenate([u, np.ones(len(ends)), np.zeros(len(ends))])
    phi = np.concatenate([phi, np.where(corners == 0.0, TURN, corners), corners])
    order = np.lexsort((1 - u, np.round(phi / SAME_ANGLE)))
    return pieces[order], u[order], phi[order]


CurveRows = Callable[[int, Sequence[float]], dict[str, Floats]]
"""rows(steps, also): the curves at equal steps of one turn and at other crank angles, rad."""


def sparse_curves(sampler: Sampler, rows: CurveRows, accuracy: float) -> tuple[dict[str, Floats], float]:
    """Curves (SI), and an estimate of the relative error of each column's largest magnitude.

    Around every top rows are added between it and its neighbours, in thirds and at the vertex of their parabola, until
    what the top may still rise (no more than it stands above them) is small enough.
    """
    steps = next(count for least, count in SPARSE_STEPS if accuracy >= least)
    also = [sampler.cycle.angles(*sampler.grid(steps)) % TURN]
    also += [turning_points.graded_nodes(centre) for centre in sampler.singular]
    for _ in range(SPARSE_ROUNDS):
        curves = rows(steps, np.concatenate(also).tolist())
        added, left = _around_tops(curves, accuracy / 10)
        if not added or len(curves[ANGLE]) > SPARSE_MOST_ROWS:
            break
        also.append(np.array(added))
    return curves, max(left, ROUNDED)


def _around_tops(columns: Mapping[str, Floats], least: float) -> tuple[list[float], float]:
    """Angles, rad, where rows are missing, and the largest share by which a column's top may still rise."""
    angles, more, worst = columns[ANGLE], set(), 0.0
    # The turn closes: a top may stand between the last row and the first.
    phi = np.concatenate([angles[-1:] - TURN, angles, angles[:1] + TURN])
    # Neighbours at another angle: both rows of a corner look past each other.
    order = np.maximum.accumulate(phi)
    left = np.maximum(np.searchsorted(order, order - SAME_ANGLE, side="left") - 1, 0)
    right = np.minimum(np.searchsorted(order, order + SAME_ANGLE, side="right"), len(phi) - 1)
    for name, values in columns.items():
        sizes = np.abs(np.concatenate([values[-1:], values, values[:1]]))
        if name == ANGLE or not np.isfinite(sizes).any():
            continue
        top = float(np.nanmax(sizes))
        with np.errstate(invalid="ignore"):
            inner = (sizes >= sizes[left]) & (sizes >= sizes[right]) & (sizes >= SPARSE_NEARLY * top)
        inner[[0, -1]] = False
        tops = np.flatnonzero(inner)
        for k in tops[~_on_levels(phi, sizes, tops)]:
            rise = _rise(phi, sizes, int(k)) / top if top > 0.0 else 0.0
            worst = max(worst, rise)
            if rise > max(least, ROUNDED):
                more |= set(_angles_around(phi, sizes, int(k)))
    return sorted(more), worst


def _on_levels(phi: Floats, sizes: Floats, tops: Pieces) -> NDArray[np.bool_]:
    """Whether a top cannot rise: two rows on one side, of a corner too, are as large as the top."""
    level = np.zeros(len(tops), dtype=bool)
    for side in (-1, 1):
        near, beyond = tops + side, tops + 2 * side
        there = (beyond >= 0) & (beyond < len(sizes)) & (phi[near] != phi[tops]) & np.isfinite(sizes[near])
        far = sizes[np.clip(beyond, 0, len(sizes) - 1)]
        drop = np.fmax(np.abs(sizes[tops] - sizes[near]), np.abs(sizes[tops] - far))
        level |= there & (drop <= SPARSE_LEVEL * sizes[tops])
    return level


def _rise(phi: Floats, sizes: Floats, k: int) -> float:
    """Amount by which a top at row k, on no level, may still rise between it and its neighbours on its own side.

    At a corner that the curve rises to, only what its bend leaves; else no more than the top stands above its
    neighbours.
    """
    sides = [side for side in (-1, 1) if phi[k + side] != phi[k] and np.isfinite(sizes[k + side])]
    if len(sides) == 1:
        bent = _bent(phi, sizes, k, sides[0])
        if bent is not None:
            return bent
    return float(sizes[k] - min((sizes[k + side] for side in sides), default=sizes[k]))


def _bent(phi: Floats, sizes: Floats, k: int, side: int) -> float | None:
    """Error from the curvature beside a corner to which the curve rises; None where it does not rise."""
    near, far = k + side, k + 2 * side
    if not 0 <= far < len(sizes) or phi[far] == phi[near] or not np.isfinite(sizes[far]):
        return None
    width, next_width = abs(phi[near] - phi[k]), abs(phi[far] - phi[near])
    slope, next_slope = (sizes[k] - sizes[near]) / width, (sizes[near] - sizes[far]) / next_width
    bend = 2 * (slope - next_slope) / (width + next_width)
    rises = slope + bend * width / 2 > 0.0 and slope > 0.0
    return float(abs(bend) * width**2 / 8) if rises else None


def _angles_around(phi: Floats, sizes: Floats, k: int) -> list[float]:
    """Angles, rad, between row k and its neighbours: thirds, and the vertex of their parabola."""
    before, after = phi[k] - phi[k - 1], phi[k + 1] - phi[k]
    angles = [phi[k] - share * before for share in (1 / 3, 2 / 3)] if before > 0.0 else []
    angles += [phi[k] + share * after for share in (1 / 3, 2 / 3)] if after > 0.0 else []
    rise, fall = sizes[k] - sizes[k - 1], sizes[k] - sizes[k + 1]
    bend = rise * after + fall * before
    if before > 0.0 and after > 0.0 and bend > 0.0:
        vertex = phi[k] + (rise * after**2 - fall * before**2) / (2 * bend)
        width = min(before, after) / 64
        angles += [vertex - width, vertex, vertex + width]
    return [float(angle % TURN) for angle in angles]
