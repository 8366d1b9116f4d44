"""Equations of effects, from their formulas on symbols: terms of loads, balance, figures and demands of checks."""

import math
from collections import ChainMap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from loomopt.maths import systems
from loomopt.maths.systems import Number
from loomopt.model.drive import motor
from loomopt.model.model import COMPONENTS, JobModel
from loomopt.physics import balance
from loomopt.physics.balance import Acting, Given
from loomopt.physics.effects.kinds import Applied, Check, Event, EventTerms, LinkMass, Load, Motion, State, keys, owned
from loomopt.physics.schema import Values
from loomopt.picture.equations import (
    Case,
    Equation,
    Expression,
    cases,
    effect_symbols,
    equation,
    latex,
    relation,
    sums,
    symbol,
    sympy,
    text,
)

if TYPE_CHECKING:
    from loomopt.physics.effects.kinds import Written
    from loomopt.physics.mechanisms.dyad import Vector

AnyMotion = TypeVar("AnyMotion", bound=Motion)
SIGNS, ENDS = {-1: ">=", 0: "=", 1: "<="}, {-1: "min", 0: "given", 1: "max"}
Piece = tuple[Expression, tuple[Expression, Expression]]
"""A formula, and the crank angles between which it holds."""


MOTION = frozenset({"phi", "theta", "omega", "omega_dot", "q", "beta"})
"""Symbols of the motion that terms read, in addition to those of the scene's numbers."""


def given(model: JobModel, values: Values) -> Given:
    """A scene's numbers as symbols, with the symbols and words of every effect's table that it gives."""
    taken, symbols_of_effects = {*MOTION, *values, *model.known} - set(model.labels), dict[str, Values]()
    # A model of formulas alone does not say which of its effects' numbers are given.
    has_labels = not model.known.isdisjoint(model.labels)
    for effect in model.effects:
        words = model.words_of(effect.name)
        given_keys = [key for key in keys(effect.table) if not has_labels or owned(effect, key) in model.known]
        symbols_of_effects[effect.name] = effect_symbols(effect, words, given_keys, taken)
        taken |= {str(value) for key, value in symbols_of_effects[effect.name].items() if key not in words}
    asks = any(check.joints for check in model.checks)
    asks = asks or (has_labels and any(isinstance(load, Load) and load.inside for load in model.loads))
    if not asks:
        return Given(values, symbols_of_effects)
    # A formula that tests whether a number is given sees the numbers of the scene.
    there = {
        owned(effect, key): value for effect in model.effects for key, value in symbols_of_effects[effect.name].items()
    }
    there |= {name: values[name] for name in sorted(model.known) if name not in there}
    return Given(ChainMap(there, values), symbols_of_effects)  # type: ignore[arg-type]  # it is only read


def forces(
    model: JobModel,
    pose: Motion,
    inputs: Given,
    total: str,
    letter: str,
    torque: tuple[str, str] = ("crank torque", "Md"),
) -> list[Equation]:
    """Write the terms, the balance, the crank torque and motion, then the figures and demands of checks."""
    at = turning(pose, model)
    equations = [item for load in model.loads for item in _load_equations(model, load, at, inputs, letter)]
    within = dict[str, Expression]()
    for load in model.loads:
        value = balance.inside(systems.sympy(), load, at, inputs)
        if value is not None:
            within[f"{letter}_{load.name}_drive"] = value
            equations.append(equation(load.name, symbol(f"{letter}_{load.name}_drive"), sympy().sympify(value)))
    drive = [*map(symbol, within), *(-symbol(share) * at.q1 for share in _shares(model, letter).values())]
    equations += sums(model.loads, at, symbol(total), letter, torque, drive)
    equations += crank_motion(model, at, inputs, torque[1])
    equations += [item for check in model.checks for item in check_equations(check, at, inputs)]
    return equations + joint_equations(model, at, inputs, symbol(total), letter)


def turning(pose: AnyMotion, model: JobModel) -> AnyMotion:
    """Pose of symbols, with the crank's speed as a variable if an effect determines it."""
    if motor(model.effects) is None:
        return pose
    return replace(pose, omega_dot=symbol("omega_dot"))  # type: ignore[type-var]  # poses are dataclasses


def crank_motion(model: JobModel, pose: Motion, inputs: Given, torque: str) -> list[Equation]:
    """Write the motor's characteristic, the crank's equation of motion and its mean speed, if an effect has them."""
    drive = motor(model.effects)
    if drive is None:
        return []
    sp = sympy()
    own_names = {name: symbol(name) for name in ("speed", "no_load_speed")}
    values = ChainMap(own_names, inputs.values)  # type: ignore[arg-type]  # it is only read
    at = inputs._replace(values=values).inputs(systems.sympy(), drive)
    given_torque, omega, phi = symbol("M_motor"), symbol("omega"), pose.phi
    taken = [symbol(torque)] if model.loads else []
    once_round = sp.Integral(1 / sp.Function("omega")(phi), (phi, 0, 2 * sp.pi))
    return [
        equation(drive.name, given_torque, drive.motor(at, omega)),
        equation(drive.name, given_torque, sum(taken) + drive.flywheel(at) * pose.omega_dot),
        equation(drive.name, pose.omega_dot, omega * symbol("omega'")),
        equation("mean speed", once_round, 2 * sp.pi / values["speed"]),
    ]


def _load_equations(model: JobModel, load: Acting, pose: Motion, inputs: Given, letter: str) -> Iterator[Equation]:
    """Yield a load's term, after the equation of motion of a state."""
    if isinstance(load, State):
        carried_loads = [item for item in model.loads if isinstance(item, Load) and item.name in load.carries]
        inertia = balance.total(
            [item.moved(inputs.inputs(systems.sympy(), item)) for item in carried_loads if item.moved]
        )
        shares = _shares(model, letter)
        carried = balance.total([symbol(shares.get(item.name, f"{letter}_{item.name}")) for item in carried_loads])
        for item in carried_loads:
            if item.output_share:
                share = item.output_share(inputs.inputs(systems.sympy(), item, pose))
                yield equation(item.name, symbol(shares[item.name]), sympy().sympify(share))
        left, right = load.motion(_in_symbols(pose, inertia, carried), inputs.tables[load.name])
        yield equation(load.name, left, right)
        moved, still = map(symbol, load.difference)
        yield relation(load.name, symbol("z"), "=", moved - still, "after every turn the same")
    yield term(load, pose, inputs, letter)


def _shares(model: JobModel, letter: str) -> dict[str, str]:
    """Symbols of the parts of drive terms that a state carries, by load."""
    gone = balance.carried(model.loads)
    loads = (load for load in model.loads if isinstance(load, Load) and load.output_share and load.name in gone)
    return {load.name: f"{letter}_{load.name}_shaft" for load in loads}


def _in_symbols(pose: Motion, inertia: Expression, carried: Expression) -> "Written":
    from loomopt.physics.effects.kinds import Written

    return Written((symbol("z"), symbol("z'"), symbol("z''")), pose.omega, inertia, carried)


def term(load: Acting, pose: Motion, inputs: Given, letter: str) -> Equation:
    """Write a load's term, with the range of each formula."""
    name = symbol(f"{letter}_{load.name}")
    if isinstance(load, Load) and load.tabulated and load.tabulated.key in inputs.tables[load.name]:
        return _table_equation(load, name, inputs)
    if isinstance(load, Load) and load.cases:
        rows: list[Case] = [(force(load, pose, inputs, switch), where) for switch, where in load.cases.items()]
        alike = len({formula for formula, _ in rows}) == 1
        return equation(load.name, name, rows[0][0]) if alike else cases(load.name, name, rows)
    *inner, (last, _) = pieces(load, pose, inputs)
    if not inner:
        return equation(load.name, name, last)
    phi = symbol("phi")
    parts = [f"{text(case)} for {text(a)} <= {text(phi)} <= {text(b)}" for case, (a, b) in inner]
    lines = [rf"{latex(case)} & {latex(a)} \le {latex(phi)} \le {latex(b)}" for case, (a, b) in inner]
    choice = r" \\ ".join([*lines, rf"{latex(last)} & \text{{else}}"])
    written = rf"{latex(name)} = \begin{{cases}} {choice} \end{{cases}}"
    form = ((name, "="), *((case, (a, phi, b)) for case, (a, b) in inner), (last, "else"))
    return Equation(load.name, f"{text(name)} = {', '.join(parts)}, else {text(last)}", written, form)


def _table_equation(load: Load[Any], name: Expression, inputs: Given) -> Equation:
    """Equation of a tabulated load: a cubic, with other coefficients in each interval."""
    assert load.tabulated is not None
    curve = inputs.tables[load.name][load.tabulated.key]
    bent = f"{curve.corners} corners" if curve.corners != 1 else "one corner"
    description = f"a cubic between each of the table's {curve.samples} samples and the next, C2 but for {bent}"
    description += f", angles {load.tabulated.angle}"
    written = rf"{latex(name)}:\ \text{{{description}}}"
    return Equation(load.name, f"{text(name)}: {description}", written, ((name, f": {description}"),))


def force(load: Acting, pose: Motion, inputs: Given, switch: float) -> Expression:
    """Formula of a load at a switch, on the turn of its corners: whole turns are not subtracted."""
    if isinstance(load, State):
        return load.term(_in_symbols(pose, 0, 0), inputs.tables[load.name])
    sp = sympy()
    value = load.force(inputs.inputs(systems.sympy(), load, pose, {load.name: sp.Rational(switch)}))
    return sp.sympify(value).replace(sp.floor, lambda turns: sp.Integer(0))


def pieces(load: Acting, pose: Motion, inputs: Given) -> list[Piece]:
    """A load's formula between each corner and the next, the last ending a turn after the first."""
    whole_turn = 2 * systems.sympy().pi
    if not isinstance(load, Load) or load.corners is None:
        return [(force(load, pose, inputs, 0), (0, whole_turn))]
    corners = tuple(map(sympy().sympify, load.corners(inputs.inputs(systems.sympy(), load))))
    if not corners:
        return [(force(load, pose, inputs, 0), (0, whole_turn))]
    numbers = tuple(float(corner.subs(dict.fromkeys(corner.free_symbols, 1))) for corner in corners)
    ends, number_ends = (*corners[1:], corners[0] + whole_turn), (*numbers[1:], numbers[0] + 2 * math.pi)
    middles = [(begin + end) / 2 for begin, end in zip(numbers, number_ends, strict=True)]
    return [
        (force(load, pose, inputs, load.switch(middle, numbers)), span)
        for middle, span in zip(middles, zip(corners, ends, strict=True), strict=True)
    ]


def check_equations(check: Check[Any], pose: Motion, inputs: Given) -> list[Equation]:
    """Write the figures, rows and demands of an effect that is not part of the balance."""
    at = inputs.inputs(systems.sympy(), check, pose)
    values = {name: read(at) for name, read in (*check.quantities.items(), *check.rows.items())}
    return [item for name, value in values.items() for item in _demand_equations(check, name, value)]


class WrittenLoading(NamedTuple):
    """Inputs of a mechanism, in symbols."""

    force: Expression
    carried: Number
    masses: Sequence[tuple[LinkMass, Any]]
    pushes: "Sequence[Vector]"
    applied: Sequence[Applied] = ()

    @property
    def inertia(self) -> Expression:
        """Inertia of all that the loads move, kg·m² or kg."""
        return balance.total([mass.second for mass, _ in self.masses])


def joint_equations(model: JobModel, pose: Motion, inputs: Given, total: Expression, letter: str) -> list[Equation]:
    """Write the joint forces' components and the moments that checks read, once for all checks."""
    checks = [check for check in model.checks if check.joints]
    if not checks:
        return []
    system, moved = systems.sympy(), pose
    if balance.carried(model.loads):
        psi = [-symbol(f"psi_r{dots}") for dots in ("", "_dot", "_ddot")]
        moved = SimpleNamespace(q=psi[0], velocity=psi[1], acceleration=psi[2])  # type: ignore[assignment]
    terms = [(load, symbol(f"{letter}_{load.name}")) for load in model.loads]
    masses = balance.masses(system, model.loads, inputs, (pose, moved))
    loading = WrittenLoading(total, moved, masses, balance.pushes(system, terms, inputs, (pose, moved)))
    equations: dict[str, Equation] = {}
    for check in checks:
        assert check.joints is not None
        if check.sentence:
            equations[check.name] = Equation(check.name, check.sentence, rf"\text{{{check.sentence}}}")
            continue
        joints = check.joints(inputs.inputs(system, check, pose), loading)
        for name in check.link_inertias:
            equations |= {
                component: equation(check.name, symbol(component), value)
                for component, value in _link_inertia(joints, name)
            }
        for name in (name for name in (*check.vectors, *check.scalars) if name in model.check_figures):
            parts = [""] if name in check.scalars else [f"_{axis}" for axis in COMPONENTS]
            for part in parts:
                value = getattr(joints, name)
                value = getattr(value, part[1:]) if part else value
                equations.setdefault(name + part, equation(check.name, symbol(name + part), sympy().sympify(value)))
        for name, work in (
            (work_name, check.worked[work_name]) for work_name in model.worked if work_name in check.worked
        ):
            value = sum(share * symbol(vector) for vector, share in getattr(joints, work).items())
            equations[name] = equation(check.name, symbol(f"dW_{name}/dphi"), value)
    return list(equations.values())


def _link_inertia(joints: Number, name: str) -> Iterator[tuple[str, Expression]]:
    """Yield the inertia force and moment of a link, and replace them by symbols; nothing for a link without mass."""
    joint = getattr(joints, name)
    if joint is not None:
        parts = [f"F_{name}_x", f"F_{name}_y", f"N_{name}"]
        yield from zip(parts, map(sympy().sympify, (*joint.force, joint.moment)), strict=True)
        x, y, moment = map(symbol, parts)
        joints.__dict__[name] = type(joint)(type(joint.force)(x, y), moment)


def _demand_equations(check: Check[Any], name: str, value: Expression) -> list[Equation]:
    """Write a figure of a check and its demand; of a margin, whose name is a phrase, only the demand."""
    sp = sympy()
    value = sp.sympify(value).replace(sp.Abs, lambda positive: positive)
    whole = " " in name
    written = [] if whole else [equation(check.name, symbol(name), value)]
    for requirement in (demand for demand in check.demands if demand.row == name):
        is_name = isinstance(requirement.value, str)
        limit = symbol(f"{requirement.value}_{ENDS[requirement.sign]}") if is_name else sp.nsimplify(requirement.value)
        kind = f"{check.name}: {name}" if whole else check.name
        written.append(relation(kind, value if whole else symbol(name), SIGNS[requirement.sign], limit))
    return written


def event_equations(model: JobModel, poses: tuple[Motion, Motion], inputs: Given, letter: str) -> list[Equation]:
    """Write an event's equations: separation of the output, free motion and landing.

    poses: of symbols, on the output's way forward and back; none without an event.
    """
    sp, omega = sympy(), symbol("omega")
    output = [load for load in model.loads if load.acts == "output"]
    forward, back = ([sp.expand(force(load, pose, inputs, 0)) for load in output] for pose in poses)
    total = sum(symbol(f"{letter}_{load.name}") for load in output)
    mass = sum(form.coeff(poses[0].q2) for form in forward) / omega**2
    friction = sum((first - second) / 2 for first, second in zip(forward, back, strict=True))
    terms = EventTerms(symbol, total, sp.simplify(friction), sp.simplify(mass))
    rules = [rule for event in model.effects if isinstance(event, Event) for rule in event.rules(terms)]
    return [relation(rule.name, sp.sympify(rule.left), rule.sign, sp.sympify(rule.right), rule.where) for rule in rules]


def terms(loads: Sequence[Acting], pose: Motion, inputs: Given) -> Mapping[str, Expression]:
    """Terms of the loads by effect, one expression over the whole turn."""
    sp, phi, expressions = sympy(), symbol("phi"), {}
    for load in loads:
        intervals = pieces(load, pose, inputs)
        parts = [(formula, (begin <= phi) & (phi <= end)) for formula, (begin, end) in intervals[:-1]]
        expressions[load.name] = sp.Piecewise(*parts, (intervals[-1][0], True)) if parts else intervals[0][0]
    return expressions
