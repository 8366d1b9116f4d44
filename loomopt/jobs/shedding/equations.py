"""The equations a shedding scene really uses: cam law, motion, each term's own formula on symbols, balance, contact."""

from dataclasses import dataclass
from typing import Any

from loomopt import balance, maths
from loomopt.jobs.shedding import program as shedding_program
from loomopt.jobs.shedding.cam_equations import SEGMENTS
from loomopt.jobs.shedding.model import Shedding, cam_equations
from loomopt.jobs.shedding.pose import DWELLS, LEAST, MOST
from loomopt.maths import Number
from loomopt.picture.equations import (
    Case,
    Equation,
    Expression,
    cases,
    equation,
    own_values,
    relation,
    sums,
    symbol,
    sympy,
    text,
)
from loomopt.scenes import Scene
from loomopt.schema import Check, Load

SPEED = "omega"


@dataclass(frozen=True)
class FrameSymbols(balance.Motion):
    """The frame at one instant, as loads read it: X, X', X'' are symbols; segment, below, worst: data."""

    segment: int
    below: int
    worst: int
    q: Number
    q1: Number
    q2: Number
    lowered: Number
    u: Number
    omega: Number
    omega_dot: Number = None


def equations(scene: Scene) -> tuple[Equation, ...]:
    """Return the equations of a shedding scene: law, segments, motion, terms, balance, contact, follower, coils.

    An effect that is not in the scene leaves no symbol and no term. phi0: the arm's angle at the beginning of the
    rise; omega: speed of the cam shaft; w: |d(x, y)/d theta|.
    """
    model = shedding_program.model(scene)
    given = _given(scene, model)
    found = [*cam_equations.law(model.law), *cam_equations.motion(model, given), *_forces(model, given)]
    if model.has_follower:
        found += cam_equations.follower()
    for check in model.checks:
        found += _rows(check, given)
    return tuple(found)


def _given(scene: Scene, model: Shedding) -> balance.Given:
    """Return the scene's numbers as symbols, with the words that choose formulas."""
    names = {"speed": SPEED}
    known = [name for name in shedding_program.numbers(scene) if "." not in name and not name.startswith("law_")]
    values = {name: symbol(names.get(name, name)) for name in known}
    far = values["rise"]
    turning = far + values["far_dwell"]
    values |= {"begin.far": far, "begin.return": turning, "begin.near": turning + values["return"]}
    words: dict[str, dict[str, str]] = {}
    for effect, key, word in model.words:
        words.setdefault(effect, {})[key] = word
    own = {effect.name: own_values(effect, words.get(effect.name, {})) for effect in model.effects}
    return balance.Given(values, own)


def _pose(segment: int, below: int, worst: int) -> FrameSymbols:
    X, X1, X2 = (symbol(name) for name in ("X", "X'", "X''"))
    return FrameSymbols(segment, below, worst, X, X1, X2, X / symbol("travel"), symbol("u"), symbol(SPEED))


def _forces(model: Shedding, given: balance.Given) -> list[Equation]:
    """Write each term, their balance, the torque on the cam, and contact."""
    found = [_term(model, load, given) for load in model.loads]
    pose = _pose(model.segments[0], 0, LEAST)
    found += sums(model.loads, pose, symbol("N"), "N", torque=("cam torque", "cam_torque"))
    where = " and ".join(SEGMENTS[s] for s in model.segments if s in DWELLS) if model.is_level else "for every theta"
    return [*found, relation("contact", symbol("N"), ">=", symbol("N_min"), where)]


def _term(model: Shedding, load: Load, given: balance.Given) -> Equation:
    """Write a load's term by its own formula: one, by halves of the shed, or by segments."""
    name = symbol(f"N_{load.name}")

    def force(segment: int, below: int = 0, worst: int = LEAST) -> Expression:
        pose = _pose(segment, below, worst)
        return load.force(maths.sympy(), pose, given.values, given.own[load.name], 0)

    by_segment = {segment: force(segment) for segment in model.segments}
    first = by_segment[model.segments[0]]
    if any(value != first for value in by_segment.values()):
        return cases(load.name, name, [_in_segment(model, load, segment, force) for segment in model.segments])
    lower = force(model.segments[0], below=1)
    if lower == first:
        return equation(load.name, name, first)
    X, half = symbol("X"), symbol("travel") / 2
    return cases(load.name, name, [(first, (sympy().Integer(0), X, half)), (lower, (half, X, 2 * half))])


def _in_segment(model: Shedding, load: Load, segment: int, force: Any) -> Case:
    """Return a term in one segment, with the segment; what a dwell leaves open, and what nobody knows, in words."""
    if model.is_level and load.name == "warp_tension" and segment not in DWELLS:
        return "not known", SEGMENTS[segment]
    least, most = force(segment), force(segment, worst=MOST)
    if least != most:
        return f"any value of {text(least)} ... {text(most)} ({text(least)} for contact)", SEGMENTS[segment]
    return least, SEGMENTS[segment]


def _rows(check: Check, given: balance.Given) -> list[Equation]:
    """Write each row of an effect that takes no part in the balance, and what it must keep."""
    signs, ends = {-1: ">=", 0: "=", 1: "<="}, {-1: "min", 0: "given", 1: "max"}
    sp, own, found = sympy(), given.own[check.name], []
    for name, row in check.rows.items():
        value = row(maths.sympy(), given.values, own).replace(sp.Abs, lambda positive: positive)
        demands = [demand for demand in check.demands if demand.row == name]
        whole = " " in name
        if not whole:
            found.append(equation(check.name, symbol(name), value))
        for each in demands:
            limit = (
                symbol(f"{each.value}_{ends[each.sign]}") if isinstance(each.value, str) else sp.nsimplify(each.value)
            )
            kind = f"{check.name}: {name}" if whole else check.name
            found.append(relation(kind, value if whole else symbol(name), signs[each.sign], limit))
    return found
