"""Crank torque by effect: shares over the turn, and the motor and flywheel that their sum needs.

A share is the effect's term times q', or its term where it acts in the drive [balance.py]; the shares add up to the
crank torque. Energies are integrals over the turn by Gauss's rule on each smooth piece, so that what gives back all
that it takes comes out as 0. The flywheel is the textbook's, J = ΔE/(δ ω²) [Norton, Design of Machinery, section
11.11]: the torque is that at the speed the scene has, and the motor's is constant.
"""

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from loomopt.maths.systems import Number
from loomopt.model import drive
from loomopt.model.curves import ALIKE, STEPS, Columns, rows
from loomopt.model.model import CycleQuantity, Instant, JobModel
from loomopt.model.reading import gauss
from loomopt.model.sampling import Sampler
from loomopt.physics import balance
from loomopt.physics.balance import Acting
from loomopt.physics.cycle import TURN, Cycle, Floats, Pieces
from loomopt.physics.effects.kinds import Load, State

TOTAL = "total"
MOTOR = "torque of the motor"
WIDEST, HALVINGS = TURN / 16, 7
"""rad: of the stretches on which torques are integrated first; how often these are halved until nothing changes."""
SAME_ENERGY = 1e-13
"""Share of the torque's integrated size below which an energy is rounding: 0, and what halving changes is nothing."""
BISECTIONS = 54
"""Halvings of a sample's width: to the last bit."""


class TorqueShare(NamedTuple):
    """Share of an effect in the crank torque: at the torque's peak, at its own peak, rms (N·m), and energy per turn, J.

    share: of the crank torque at its peak; None where that is 0.
    """

    effect: str
    at_peak: float
    share: float | None
    peak: float
    rms: float
    energy: float


class MotorSize(NamedTuple):
    """Size of the motor: rms torque over time, N·m; mean power, peak power and regenerated power, W.

    energy_swing: energy that a flywheel stores and returns in a turn, J, where the motor's torque is constant;
    flywheel: inertia at the crank, kg·m², for the given fluctuation. None where the speed or fluctuation is unknown.
    """

    rms_torque: float
    mean_power: float | None
    peak_power: float | None
    regenerated: float | None
    energy_swing: float
    flywheel: float | None


@dataclass(frozen=True)
class TorqueBudget:
    """Crank torque of a design as the sum of its effects.

    angle: where it peaks, rad; fluctuation: (largest − least speed)/mean that the flywheel is for; curves: each share
    over the turn at the angles phi, rad, N·m.
    """

    rows: tuple[TorqueShare, ...]
    total: TorqueShare
    motor: MotorSize
    angle: float
    fluctuation: float | None
    phi: Floats = field(compare=False, repr=False)
    curves: Mapping[str, Floats] = field(compare=False, repr=False)


def budget(sampler: Sampler, fluctuation: float | None = None) -> TorqueBudget:
    """Torque budget of a sampled design; a load acts on its crank over the whole turn."""
    loads = loads_with_share(sampler.model.loads)
    names = tuple(f"share of {load.name}" for load in loads)
    shares = dict(zip(names, loads, strict=True))
    parted = Sampler(_with_shares(sampler.model, shares), sampler.values, sampler.samples)
    parted.search((*names, drive.TORQUE))
    largest = parted.extremes(drive.TORQUE)
    alike = (extreme for extreme in largest if extreme.height >= (1 - ALIKE) * largest[0].height)
    top = min(alike, key=lambda extreme: parted.angle(extreme) % TURN)  # of two that mirror each other, the first
    node = np.array([top.piece]), np.array([top.u])
    at_peak = {name: float(values[0]) + 0.0 for name, values in parted.together(names, *node).items()}
    edges, energies, squares = _integrated(parted, (*names, drive.TORQUE))

    def share_of(name: str, effect: str, at: float) -> TorqueShare:
        share = at / top.value if top.value else None
        return TorqueShare(effect, at, share, parted.peak(name), math.sqrt(squares[name] / TURN), energies[name])

    pieces, u, phi = rows(parted, Columns({}, ""), STEPS, [parted.angle(top) % TURN])
    drawn = parted.together(names, pieces, u)
    return TorqueBudget(
        tuple(share_of(name, load.name, at_peak[name]) for name, load in shares.items()),
        share_of(drive.TORQUE, TOTAL, top.value),
        _motor(parted, edges, fluctuation),
        parted.angle(top) % TURN,
        fluctuation,
        phi,
        {load.name: drawn[name] for name, load in shares.items()},
    )


def _with_shares(model: JobModel, shares: Mapping[str, Acting]) -> JobModel:
    """Model with the shares of its loads among its quantities, and with the motor's torque."""
    quantities = {name: CycleQuantity(functools.partial(_share, load), figure=False) for name, load in shares.items()}
    quantities[MOTOR] = CycleQuantity(lambda at: drive.motor_torque(at, at.crank_torque), figure=False)
    quantities[drive.SPEED] = CycleQuantity(lambda at: at.pose.omega, figure=False)
    return replace(model, own_quantities={**model.own_quantities, **quantities})


def loads_with_share(loads: Sequence[Acting]) -> tuple[Acting, ...]:
    """Loads with a share of their own: all but those of a state that does not declare its inertia."""
    silent = [load for load in loads if isinstance(load, State) and not load.moved]
    gone = balance.carried(silent)
    return tuple(load for load in loads if load.name not in gone)


def _share(load: Acting, at: Instant) -> Number:
    """Load's share of the crank torque at an instant, N·m.

    What a state carries moves on its own: its share is its power over the crank's speed, and the state's is what its
    member takes in between, F (q' − q'_carried).
    """
    model = at.model
    state = next((acting for acting in model.loads if isinstance(acting, State) and acting.moved), None)
    if state and load.name in (state.name, *state.carries):
        loading = balance.Loaded(at.maths, model.loads, at.pose, at.given, at.node.switch)
        moving = loading.carried.velocity / at.pose.omega
        if load is state:
            (force,) = (term for acting, term in loading.terms if acting is state)
            return force * (at.pose.q1 - moving)
        if isinstance(load, Load) and load.moved:
            inertia = load.moved(at.given.inputs(at.maths, load))
            return inertia * loading.carried.acceleration * moving
        (term,) = (term for acting, term in loading.terms if acting is load)
        force = balance.on_output(at.maths, load, term, at.pose, at.given)
        rest = balance.rest_in_drive(at.maths, model.loads, load, at.pose, at.given)
        return force * moving if rest is None else force * moving + rest
    others = {acting.name for acting in at.model.loads} - {load.name}
    terms = balance.terms(at.maths, at.model.loads, at.pose, at.given, at.node.switch, others)
    ((_, term),) = terms
    if load.acts != "output":
        return term
    inner_term = balance.inside(at.maths, load, at.pose, at.given)
    return term * at.pose.q1 if inner_term is None else term * at.pose.q1 + inner_term


class _Quadrature(NamedTuple):
    """Nodes (pieces, u) of stretches one after another, GAUSS_NODES each, and their weights in the crank angle, rad."""

    pieces: Pieces
    u: Floats
    weights: Floats

    def by_stretch(self, values: Floats) -> Floats:
        """Integral over each stretch."""
        integrals: Floats = (self.weights * values).reshape(-1, len(gauss()[0])).sum(axis=1)
        return integrals


Edges = Sequence[Floats]
"""Division of each piece of the cycle: u from 0 to 1."""


def _rule(cycle: Cycle, edges: Edges) -> _Quadrature:
    nodes, weights = gauss()
    widths = np.diff(cycle.starts)
    pieces = np.concatenate([np.full((len(u) - 1) * len(nodes), piece) for piece, u in enumerate(edges)])
    begins, ends = (np.concatenate([u[part] for u in edges]) for part in (slice(None, -1), slice(1, None)))
    u = (begins[:, None] + (ends - begins)[:, None] * nodes).ravel()
    return _Quadrature(pieces, u, widths[pieces] * ((ends - begins)[:, None] * weights).ravel())


def _integrated(sampler: Sampler, names: Sequence[str]) -> tuple[Edges, dict[str, float], dict[str, float]]:
    """Fine stretches, and the integrals of quantities over the turn, J, and of their squares, (N·m)²."""
    widths, integrals = np.diff(sampler.cycle.starts), tuple[dict[str, float], ...]()
    for halved in range(HALVINGS):
        counts = np.maximum(np.ceil(widths * 2**halved / WIDEST), 1).astype(int)
        edges = [np.linspace(0.0, 1.0, count + 1) for count in counts]
        rule = _rule(sampler.cycle, edges)
        values = sampler.together(names, rule.pieces, rule.u)
        sizes = {name: float(np.dot(rule.weights, np.abs(of))) for name, of in values.items()}
        energies = {name: float(np.dot(rule.weights, of)) for name, of in values.items()}
        squares = {name: float(np.dot(rule.weights, of**2)) for name, of in values.items()}
        before, integrals = integrals, (energies, squares)
        if before and all(
            abs(energies[name] - before[0][name]) <= SAME_ENERGY * sizes[name]
            and abs(squares[name] - before[1][name]) <= SAME_ENERGY * squares[name]
            for name in names
        ):
            break
    nothing = (name for name, energy in energies.items() if abs(energy) <= SAME_ENERGY * sizes[name])
    return edges, energies | dict.fromkeys(nothing, 0.0), squares


def _motor(sampler: Sampler, edges: Edges, fluctuation: float | None) -> MotorSize:
    known = "speed" in sampler.given.values
    rule = _rule(sampler.cycle, edges)
    names = (MOTOR, drive.SPEED) if known else (MOTOR,)
    values = sampler.together(names, rule.pieces, rule.u)
    # A crank whose speed is not known is taken to turn evenly.
    times = rule.weights / values[drive.SPEED] if known else rule.weights
    period = float(times.sum())
    rms = math.sqrt(float(np.dot(times, values[MOTOR] ** 2)) / period)
    work = rule.by_stretch(sampler.at(drive.TORQUE, rule.pieces, rule.u))
    swing = _swing(sampler, edges, float(work.sum()) / TURN)
    if not known:
        return MotorSize(rms, None, None, None, swing, None)
    parted = _rule(sampler.cycle, _with_crossings(sampler, MOTOR, edges, 0.0))
    given = parted.by_stretch(sampler.at(MOTOR, parted.pieces, parted.u))
    omega = TURN / period
    rounding = SAME_ENERGY * float(np.abs(given).sum())
    whole, back = (float(energy.sum()) for energy in (given, np.maximum(-given, 0.0)))
    return MotorSize(
        rms,
        whole / period if abs(whole) > rounding else 0.0,
        sampler.peak(drive.POWER),
        back / period if back > rounding else 0.0,
        swing,
        None if fluctuation is None else swing / (fluctuation * omega**2),
    )


def _swing(sampler: Sampler, edges: Edges, mean: float) -> float:
    """Largest minus least energy, J, that the crank has taken above its mean torque."""
    parted = _rule(sampler.cycle, _with_crossings(sampler, drive.TORQUE, edges, mean))
    beyond = parted.by_stretch(sampler.at(drive.TORQUE, parted.pieces, parted.u) - mean)
    taken = np.concatenate([[0.0], np.cumsum(beyond)])
    return float(taken.max() - taken.min())


def _with_crossings(sampler: Sampler, name: str, edges: Edges, level: float) -> Edges:
    """Stretches parted also where a quantity passes a level, so that on each it lies on one side."""
    pieces, u = sampler.grid()
    above = sampler.at(name, pieces, u) > level
    begins = np.flatnonzero((above[:-1] != above[1:]) & (pieces[:-1] == pieces[1:]))
    piece, low, high, rises = pieces[begins], u[begins], u[begins + 1], above[begins + 1]
    for _ in range(BISECTIONS if len(begins) else 0):
        middle = (low + high) / 2
        beyond = (sampler.at(name, piece, middle) > level) == rises
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    return [np.unique(np.concatenate([edge, low[piece == place]])) for place, edge in enumerate(edges)]
