"""Equations of effects by their own formulas on symbols: each load's term, the balance, what checks read and demand."""

import math
from collections import ChainMap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

from loomopt.maths import systems
from loomopt.model.drive import motor
from loomopt.model.model import JobModel
from loomopt.physics import balance
from loomopt.physics.balance import Acting, Given
from loomopt.physics.effects.kinds import Check, Event, EventTerms, Load, Motion, State
from loomopt.physics.schema import Values
from loomopt.picture.equations import (
    Case,
    Equation,
    Expression,
    cases,
    equation,
    latex,
    own_values,
    relation,
    sums,
    symbol,
    sympy,
    text,
)

if TYPE_CHECKING:
    from loomopt.physics.effects.kinds import Written

AnyMotion = TypeVar("AnyMotion", bound=Motion)
SIGNS, ENDS = {-1: ">=", 0: "=", 1: "<="}, {-1: "min", 0: "given", 1: "max"}
Piece = tuple[Expression, tuple[Expression, Expression]]
"""A formula, and the crank angles between which it holds."""


def given(model: JobModel, values: Values) -> Given:
    """Return a scene's numbers as symbols, with the symbols and words of every effect's table."""
    return Given(values, {effect.name: own_values(effect, model.words_of(effect.name)) for effect in model.effects})


def forces(
    model: JobModel,
    pose: Motion,
    known: Given,
    total: str,
    letter: str,
    torque: tuple[str, str] = ("crank torque", "Md"),
) -> list[Equation]:
    """Write each term, their balance and the crank torque, the crank's motion, then what checks read and demand."""
    at = turning(pose, model)
    found = [each for load in model.loads for each in _written(model, load, at, known, letter)]
    found += sums(model.loads, at, symbol(total), letter, torque)
    found += crank_motion(model, at, known, torque[1])
    return found + [each for check in model.checks for each in check_equations(check, at, known)]


def turning(pose: AnyMotion, model: JobModel) -> AnyMotion:
    """Return a pose of symbols with the change of its speed where an effect gives the crank a speed of its own."""
    if motor(model.effects) is None:
        return pose
    return replace(pose, omega_dot=symbol("omega_dot"))  # type: ignore[type-var]  # poses are dataclasses


def crank_motion(model: JobModel, pose: Motion, known: Given, torque: str) -> list[Equation]:
    """Write the motor's line, the crank's own equation of motion, and what its mean speed demands; none without."""
    own = motor(model.effects)
    if own is None:
        return []
    system, sp, table = systems.sympy(), sympy(), known.own[own.name]
    own_names = {name: symbol(name) for name in ("speed", "no_load_speed")}
    values = ChainMap(own_names, known.values)  # type: ignore[arg-type]  # it is only read
    given_torque, omega, phi = symbol("M_motor"), symbol("omega"), pose.phi
    taken = [symbol(torque)] if model.loads else []
    once_round = sp.Integral(1 / sp.Function("omega")(phi), (phi, 0, 2 * sp.pi))
    return [
        equation(own.name, given_torque, own.motor(system, omega, values, table)),
        equation(own.name, given_torque, sum(taken) + own.flywheel(values, table) * pose.omega_dot),
        equation(own.name, pose.omega_dot, omega * symbol("omega'")),
        equation("mean speed", once_round, 2 * sp.pi / values["speed"]),
    ]


def _written(model: JobModel, load: Acting, pose: Motion, known: Given, letter: str) -> Iterator[Equation]:
    """Yield a load's term, after the equation of motion of a state."""
    if isinstance(load, State):
        own = [each for each in model.loads if isinstance(each, Load) and each.name in load.carries]
        inertia = balance.total([each.moved(known.values, known.own[each.name]) for each in own if each.moved])
        carried = balance.total([symbol(f"{letter}_{each.name}") for each in own])
        left, right = load.motion(_in_symbols(pose, inertia, carried), known.own[load.name])
        yield equation(load.name, left, right)
        moved, still = map(symbol, load.between)
        yield relation(load.name, symbol("z"), "=", moved - still, "after every turn the same")
    yield term(load, pose, known, letter)


def _in_symbols(pose: Motion, inertia: Expression, carried: Expression) -> "Written":
    from loomopt.physics.effects.kinds import Written

    return Written((symbol("z"), symbol("z'"), symbol("z''")), pose.omega, inertia, carried)


def term(load: Acting, pose: Motion, known: Given, letter: str) -> Equation:
    """Write a load's term, with where each of its formulas holds."""
    name = symbol(f"{letter}_{load.name}")
    if isinstance(load, Load) and load.tabulated and load.tabulated.key in known.own[load.name]:
        return _tabulated(load, name, known)
    if isinstance(load, Load) and load.told:
        rows: list[Case] = [(force(load, pose, known, switch), where) for switch, where in load.told.items()]
        alike = len({formula for formula, _ in rows}) == 1
        return equation(load.name, name, rows[0][0]) if alike else cases(load.name, name, rows)
    *inner, (last, _) = pieces(load, pose, known)
    if not inner:
        return equation(load.name, name, last)
    phi = symbol("phi")
    told = [f"{text(one)} for {text(a)} <= {text(phi)} <= {text(b)}" for one, (a, b) in inner]
    lines = [rf"{latex(one)} & {latex(a)} \le {latex(phi)} \le {latex(b)}" for one, (a, b) in inner]
    choice = r" \\ ".join([*lines, rf"{latex(last)} & \text{{else}}"])
    written = rf"{latex(name)} = \begin{{cases}} {choice} \end{{cases}}"
    return Equation(load.name, f"{text(name)} = {', '.join(told)}, else {text(last)}", written)


def _tabulated(load: Load[Any], name: Expression, known: Given) -> Equation:
    """Say what a load's curve is: of each interval only its own numbers differ."""
    assert load.tabulated is not None
    curve = known.own[load.name][load.tabulated.key]
    bent = f"{curve.corners} corners" if curve.corners != 1 else "one corner"
    said = f"a cubic between each of the table's {curve.samples} samples and the next, C2 but for {bent}"
    said += f", angles {load.tabulated.angle}"
    return Equation(load.name, f"{text(name)}: {said}", rf"{latex(name)}:\ \text{{{said}}}")


def force(load: Acting, pose: Motion, known: Given, switch: float) -> Expression:
    """Return a load's formula at a switch."""
    if isinstance(load, State):
        return load.term(_in_symbols(pose, 0, 0), known.own[load.name])
    number = sympy().Rational(switch)
    return load.force(systems.sympy(), pose, known.values, known.own[load.name], number)


def pieces(load: Acting, pose: Motion, known: Given) -> list[Piece]:
    """Return a load's formula between each corner and the next, the last ending a turn after the first."""
    whole_turn = 2 * systems.sympy().pi
    if not isinstance(load, Load) or load.corners is None:
        return [(force(load, pose, known, 0), (0, whole_turn))]
    corners = tuple(map(sympy().sympify, load.corners(systems.sympy(), known.values, known.own[load.name])))
    numbers = tuple(float(corner.subs(dict.fromkeys(corner.free_symbols, 1))) for corner in corners)
    ends, number_ends = (*corners[1:], corners[0] + whole_turn), (*numbers[1:], numbers[0] + 2 * math.pi)
    middles = [(begin + end) / 2 for begin, end in zip(numbers, number_ends, strict=True)]
    return [
        (force(load, pose, known, load.switch(middle, numbers)), span)
        for middle, span in zip(middles, zip(corners, ends, strict=True), strict=True)
    ]


def check_equations(check: Check[Any], pose: Motion, known: Given) -> list[Equation]:
    """Write each figure and row of an effect that takes no part in the balance, and what it must keep."""
    system, own = systems.sympy(), known.own[check.name]
    found = {name: read(system, pose, known.values, own) for name, read in check.quantities.items()}
    found |= {name: row(system, known.values, own) for name, row in check.rows.items()}
    return [each for name, value in found.items() for each in _kept(check, name, value)]


def _kept(check: Check[Any], name: str, value: Expression) -> list[Equation]:
    """Write one figure of a check and what it must keep; a margin, whose name is a phrase, by its demand alone."""
    sp = sympy()
    value = sp.sympify(value).replace(sp.Abs, lambda positive: positive)
    whole = " " in name
    written = [] if whole else [equation(check.name, symbol(name), value)]
    for each in (demand for demand in check.demands if demand.row == name):
        own = isinstance(each.value, str)
        limit = symbol(f"{each.value}_{ENDS[each.sign]}") if own else sp.nsimplify(each.value)
        kind = f"{check.name}: {name}" if whole else check.name
        written.append(relation(kind, value if whole else symbol(name), SIGNS[each.sign], limit))
    return written


def event_equations(model: JobModel, poses: tuple[Motion, Motion], known: Given, letter: str) -> list[Equation]:
    """Write how the output parts from its mechanism, moves on its own and meets it again, as an event says it.

    poses: of symbols, on the output's way forward and back; none without an event.
    """
    sp, omega = sympy(), symbol("omega")
    output = [load for load in model.loads if load.acts == "output"]
    forward, back = ([sp.expand(force(load, pose, known, 0)) for load in output] for pose in poses)
    total = sum(symbol(f"{letter}_{load.name}") for load in output)
    mass = sum(form.coeff(poses[0].q2) for form in forward) / omega**2
    friction = sum((one - other) / 2 for one, other in zip(forward, back, strict=True))
    terms = EventTerms(symbol, total, sp.simplify(friction), sp.simplify(mass))
    rules = [rule for event in model.effects if isinstance(event, Event) for rule in event.rules(terms)]
    return [relation(each.name, sp.sympify(each.left), each.sign, sp.sympify(each.right), each.where) for each in rules]


def terms(loads: Sequence[Acting], pose: Motion, known: Given) -> Mapping[str, Expression]:
    """Return each load's term by its effect's name, one expression over the whole turn."""
    sp, phi, found = sympy(), symbol("phi"), {}
    for load in loads:
        own = pieces(load, pose, known)
        parts = [(formula, (begin <= phi) & (phi <= end)) for formula, (begin, end) in own[:-1]]
        found[load.name] = sp.Piecewise(*parts, (own[-1][0], True)) if parts else own[0][0]
    return found
