"""Curves over the cycle, written once: the motion as a job names it, each effect's term, force, torque, checks."""

import itertools
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from loomopt.base.records import Frozen
from loomopt.base.units import SI_UNIT
from loomopt.maths import systems
from loomopt.physics.balance import Acting
from loomopt.physics.cycle import TURN, Floats, Pieces
from loomopt.physics.tolerances import SAME_ANGLE, SAME_ROW
from loomopt.program.drive import motor_power
from loomopt.program.instant import Formula, Instant
from loomopt.program.sampling import Sampler

STEPS = 720
ANGLE = "phi [rad]"
POWER = "motor_power [W]"
ALIKE = 1e-12
"""Share of a quantity's largest magnitude by which two of its largest values are one: they mirror each other."""
COLUMN = re.compile(r"(?P<name>.+) \[(?P<unit>.+)\]")


Rows = tuple[Pieces, Floats, Floats]
"""Nodes (pieces, u), and their crank angles, rad."""


class Columns(NamedTuple):
    """What curves show.

    motion: column name with unit → formula; from name_1, name_2 … with respect to φ follow name_t, name_tt … with
    respect to time, where the speed is known. force: column of the output force, and the quantity (of which sign) that
    it is; torque: likewise of the crank. unit: of the output's terms; the drive's are torques. checks: unit of each
    check's quantity. after: what stands after torque and power. also: crank angles, rad, that are rows too. closed:
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
    """Return the curves of a design over one turn, SI; columns of what the scene does not call for are absent.

    Rows are `steps` equal ones, the angles `also`, rad, and both sides of every corner where a formula changes (the
    same angle twice). Where a load's term is not known, neither it nor the force is: NaN.
    """
    return columns_at(sampler, columns, rows(sampler, columns, steps, also))


def columns_at(sampler: Sampler, columns: Columns, rows: Rows) -> dict[str, Floats]:
    """Return the curves at rows, SI."""
    pieces, u, phi = rows
    node = sampler.node(pieces, u)
    at = sampler.model.instant(systems.numpy(), sampler.given, node)
    unknown = np.zeros(u.shape, dtype=bool)
    if sampler.model.known_in:
        unknown = ~np.any([sampler.cycle.on(where)[pieces] for where in sampler.model.known_in], axis=0)
    found = {ANGLE: phi} | {name: _column(formula, at, u) for name, formula in columns.motion.items()}
    found |= _in_time(found, at)
    if sampler.model.states:
        from loomopt.program import states

        found |= {name: _column(formula, at, u) for name, formula in states.columns(sampler.model.states).items()}
    loads = sampler.model.loads
    for load, term in zip(loads, at.terms().values(), strict=True):
        whole = np.broadcast_to(np.asarray(term, dtype=float), u.shape).astype(float)
        partial = bool(getattr(load, "known_in", dict)(sampler.model.words_of(load.name)))
        unit = columns.unit if load.acts == "output" else SI_UNIT["torque"]
        found[f"{load_name(load)} [{unit}]"] = np.where(unknown, np.nan, whole) if partial else whole
    if columns.force and any(load.acts == "output" for load in loads):
        found[columns.force[0]] = np.where(unknown, np.nan, _column(columns.force[1], at, u))
    if columns.torque and loads:
        torque = np.where(unknown, np.nan, _column(columns.torque[1], at, u))
        found |= {columns.torque[0]: torque} | ({} if at.pose.omega is None else {POWER: motor_power(at, torque)})
    for name, unit in columns.checks.items():
        found[f"{name} [{unit}]"] = _column(sampler.model.formula(name), at, u)
    return found | {name: _column(formula, at, u) for name, formula in columns.after.items()}


def tops(sampler: Sampler, quantities: Iterable[str]) -> list[float]:
    """Return the crank angles, rad, at which quantities are largest, wherever they are alike."""
    found = []
    for extremes in map(sampler.extremes, quantities):
        alike = ALIKE * max((abs(extreme.value) for extreme in extremes), default=0.0)
        found += [sampler.angle(each) for each in extremes if each.height >= extremes[0].height - alike]
    return found


def _in_time(columns: Mapping[str, Floats], at: Instant) -> dict[str, Floats]:
    """Return the derivatives with respect to time of what has columns of those with respect to φ, SI.

    x˙ = x' ω, x¨ = x'' ω² + x' ω̇; the third, x''' ω³, at constant speed only. None where the speed is not known.
    """
    omega, change = at.pose.omega, at.pose.omega_dot
    if omega is None:
        return {}
    known, found = {split(column)[0]: values for column, values in columns.items()}, dict[str, Floats]()
    for name, unit in map(split, columns):
        by_angle = [known.get(f"{name}_{order}") for order in ((1, 2, 3) if change is None else (1, 2))]
        for order, values in enumerate(itertools.takewhile(lambda each: each is not None, by_angle), 1):
            rate = values * omega**order
            rate = rate if change is None or order == 1 else rate + by_angle[0] * change
            found[f"{name}_{'t' * order} [{unit}/s{f'^{order}' if order > 1 else ''}]"] = rate
    return found


def load_name(load: Acting) -> str:
    """Return what a load's column is called."""
    return getattr(load, "symbol", "") or load.name


def split(column: str) -> tuple[str, str]:
    """Return a column's name and unit."""
    match = COLUMN.fullmatch(column)
    return (match["name"], match["unit"]) if match else (column, "1")


def _column(formula: Formula, at: Instant, u: Floats) -> Floats:
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.broadcast_to(np.asarray(formula(at), dtype=float), u.shape).astype(float)


def rows(sampler: Sampler, columns: Columns, steps: int, also: Sequence[float]) -> Rows:
    """Return nodes (pieces, u) and their crank angles, rad, in order; a corner at 0 ends the turn at 2π too."""
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
