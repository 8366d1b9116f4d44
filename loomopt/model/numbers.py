"""A scene's numbers by one name each, whatever table they stand in; what its effects say of them."""

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from loomopt.base.errors import BadInput
from loomopt.model import drive
from loomopt.model.limits import BoundLimit, CycleLimit, DesignLimit, Limit
from loomopt.model.model import JobModel, with_words_fixed
from loomopt.model.moves import AxisMove, Move, ScaleMove, Wish
from loomopt.model.objectives import Objective, Value
from loomopt.model.program import Program, Variable
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import Where
from loomopt.physics.effects.kinds import Check, Load, label, owned
from loomopt.physics.tolerances import START_ROOM
from loomopt.scenes.scene import Scene

Bounds = Mapping[str, tuple[float, float]]
"""Lower and upper bound of numbers by full name, SI."""
Asked = Mapping[str, Sequence[tuple[str, float]]]
"""Variable → which limits ask how much of it at least, SI."""
LEAST_CHANGE = "least change from today"


def numbers(scene: Scene) -> dict[str, float]:
    """Return every number of the scene by full name, SI."""
    found = {**scene.mechanism, **scene.operation}
    for effect, own in zip(scene.active, scene.effects.values(), strict=True):
        for key, value in own.model_dump().items():
            if isinstance(value, float | int):
                found[owned(effect, key)] = float(value)
    return found


def words(scene: Scene) -> tuple[tuple[str, str, str], ...]:
    """Return (effect, key, word) for every value that chooses an effect's formula."""
    return tuple(
        (name, key, value)
        for name, own in scene.effects.items()
        for key, value in own.model_dump().items()
        if isinstance(value, str)
    )


def bounds(scene: Scene, known: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    """Return lower and upper bound of the design variables and of every bounded number, by full name, SI.

    What is held stands at today's value.
    """
    found = {name: (known[name], known[name]) for name in scene.schema.variables}
    for name, bound in scene.bounds.items():
        full = scene.full(name)
        found[full] = (bound.min, bound.max) if bound.free else (known[full], known[full])
    return found


def labels(scene: Scene) -> dict[str, str]:
    """Return what a designer calls each number of the effects that are on, by its full name."""
    return {owned(effect, key): label(effect, key) for effect in scene.active for key in effect.own.model_fields}


def bound_limits(variable: Variable, relaxable_from: bool = True) -> list[Limit]:
    """Return the bounds of a variable as limits; a least value of 0 may not give way unless `relaxable_from`."""
    name, v = variable.called, variable
    if v.lower == v.upper:
        return [BoundLimit(name, 0, v.name, v.lower, v.scale)]
    ends = [(sign, value) for sign, value in ((-1, v.lower), (1, v.upper)) if math.isfinite(value)]
    return [
        BoundLimit(name, sign, v.name, value, v.scale, relaxable=relaxable_from or sign > 0 or value > 0.0)
        for sign, value in ends
    ]


def ends(low: float | None, high: float | None) -> list[tuple[int, float]]:
    """Return the sides of a limit that are given: (0, value) where both are one."""
    if low is not None and low == high:
        return [(0, low)]
    return [(sign, value) for sign, value in ((-1, low), (1, high)) if value is not None]


def floored(variables: Iterable[Variable], asked: Asked) -> tuple[list[Variable], list[Limit]]:
    """Return variables that are no less than limits on their figures ask for, and these limits.

    A variable without room, or one that is not there yet, stands at the most that is asked. Raises BadInput.
    """
    own, limits = {v.name: v for v in variables}, list[Limit]()
    for name, each in asked.items():
        least = max(value for _, value in each)
        held = own.get(name) or Variable(name, least, least, least, (least, least))
        room = held.lower < held.upper
        if room and least > held.upper:
            remedy = f"Correct the limit, or the bounds of {held.called}."
            raise BadInput(f"{held.called} cannot be as large", key=f"limits.{each[0][0]}.min", remedy=remedy)
        upper, around = (held.upper, held.range) if room else (least, (least, least))
        own[name] = replace(held, lower=max(least, held.lower) if room else least, upper=upper, range=around)
        limits += _asking(held, [(by, value) for by, value in each if not room or value > held.lower])
    return list(own.values()), limits


def _asking(variable: Variable, asked: Sequence[tuple[str, float]]) -> Iterator[Limit]:
    """Yield what limits ask of a variable, the most first; a row that stood twice would have no price."""
    known = set[str | float]()
    for name, value in sorted(asked, key=lambda each: -each[1]):
        if not known & {name, value}:
            yield BoundLimit(name, -1, variable.name, value, variable.scale)
        known |= {name, value}


def implied(limit: Limit, variables: Iterable[Variable]) -> bool:
    """Say whether the bounds of the variable that a limit is named after say as much."""
    own = next((v for v in variables if v.name == limit.name), None)
    if own is None:
        return False
    return (limit.sign > 0 or own.lower >= limit.value) and (limit.sign < 0 or own.upper <= limit.value)


def size(program: Program, today: Sampler, name: str) -> float:
    """Return the natural size, SI, of a variable, or of a figure by today's machine."""
    own = next((v.scale for v in program.variables if name in (v.name, v.called)), 0.0)
    if own:
        return own
    return figure_size(today, name)


def figure_size(today: Sampler, name: str) -> float:
    """Return the natural size, SI, of a figure by today's machine; 1 for one that only its own speed tells."""
    motor = drive.motor(today.model.effects)
    if motor and name in motor.rows:
        return 1.0
    return abs(today.peak(name) if today.model.has_quantity(name) else today.single(name)) or 1.0


def settled(scene: Scene, model: JobModel, known: Mapping[str, float], design: Mapping[str, float] | None) -> JobModel:
    """Return the model as its states need it; known: the scene's numbers, design: what differs, SI. Raises BadInput."""
    if not model.states:
        return model
    from loomopt.physics.effects.kinds import UnsteadyError

    try:
        return with_words_fixed(model, {**known, **{scene.full(name): value for name, value in (design or {}).items()}})
    except UnsteadyError as error:
        names = ", ".join(f"effects.{state.name}" for state in model.states)
        raise BadInput(error.problem, file=scene.origin, key=names, remedy=f"{error.remedy}.") from None


def figure_limits(scene: Scene, sampler: Sampler) -> list[Limit]:
    """Return the scene's limits on figures that are rows or quantities of the same name; sampler: today's machine."""
    found: list[Limit] = []
    for name, limit in scene.limits.items():
        kind = CycleLimit if sampler.model.has_quantity(name) else DesignLimit
        size = figure_size(sampler, name)
        found += [kind(name, sign, name, value, size) for sign, value in ends(limit.min, limit.max)]
    return found


def demanded(
    scene: Scene, checks: Iterable[Check[Any]], known: Mapping[str, float], sizes: Mapping[str, float]
) -> list[Limit]:
    """Return what checks demand of their rows and quantities while they are on.

    sizes: natural size by row; the value asked, or 1, without one. What a table asks for may give way; what the nature
    of the thing demands may not.
    """
    found: list[Limit] = []
    for check in checks:
        for each in check.demands:
            value = each.value if isinstance(each.value, float) else known[owned(check, each.value)]
            firm = each.row in scene.schema.margins or not isinstance(each.value, str)
            kind = CycleLimit if each.row in check.quantities else DesignLimit
            size = sizes.get(each.row) or abs(value) or 1.0
            found.append(kind(each.row, each.sign, each.row, value, size, relaxable=not firm))
    return found


def demand_figures(scene: Scene, model: JobModel, rows: Mapping[str, Sequence[str]], remedy: str) -> None:
    """Raise BadInput for a limit on a figure that nothing in the scene gives.

    rows: figure → the rows and quantities that it is read from, itself without any; remedy: with the figure's "{name}".
    """
    for name in scene.limits:
        if not all(model.has_row(row) or model.has_quantity(row) for row in rows.get(name, (name,))):
            raise BadInput(
                f"nothing in the scene gives the figure {name}",
                file=scene.origin,
                key=f"limits.{name}",
                allowed="figures whose numbers and effects the scene has",
                remedy=remedy.format(name=name),
            )


def check_known(scene: Scene, there: Collection[Where], called: str) -> None:
    """Raise BadInput where a load is known on pieces of the cycle only, and none of them is there; called: these."""
    for effect in (effect for effect in scene.active if isinstance(effect, Load)):
        own = {key: word for name, key, word in words(scene) if name == effect.name}
        places = effect.known_in(own)
        if places and not set(places) & set(there):
            raise BadInput(
                f"{effect.name} is known in the {called} only, and there are none",
                file=scene.origin,
                key=", ".join(f"effects.{effect.name}.{key}" for key in own),
                allowed=f"another word, or {called} in which it is known",
                remedy="Correct it.",
            )


def least(sampler: Sampler) -> tuple[Objective, ...]:
    """Return the levels after a target's own: rows that the checks would have least; sampler: today's machine."""
    rows = [check.least for check in sampler.model.checks if check.least]
    return tuple(Value(row, row, abs(sampler.static[row]) or 1.0) for row in rows)


def inside(variables: Iterable[Variable], values: Mapping[str, float]) -> dict[str, float]:
    """Return a start: values, or lower bounds, moved just inside the bounds of the variables."""
    start = {}
    for v in variables:
        room = START_ROOM * (v.upper - v.lower) if math.isfinite(v.upper - v.lower) else 0.0
        start[v.name] = min(max(values.get(v.name, v.lower), v.lower + room), v.upper - room)
    return start


def distinct(starts: Sequence[dict[str, float]]) -> tuple[dict[str, float], ...]:
    """Return starts without repeats."""
    return tuple(start for place, start in enumerate(starts) if start not in starts[:place])


def scale_move(name: str, along: tuple[str, ...], known: Mapping[str, float], limited: Bounds) -> Move:
    """Return the move that scales lengths in common, and would stay nearest to today's."""
    today = {n: known[n] for n in along if n in known}
    ranges = {n: limited[n] for n in along if n in limited}
    return ScaleMove(name, along, (Wish("today", LEAST_CHANGE),), today, ranges)


def axis_moves(scene: Scene, known: Mapping[str, float], limited: Bounds) -> list[Move]:
    """Return the moves along numbers of checks that may change nothing, and would stay nearest to today's."""
    found: list[Move] = []
    for check in (effect for effect in scene.active if isinstance(effect, Check)):
        for axis in check.axes:
            name = owned(check, axis.key)
            if name in limited and limited[name][0] < limited[name][1]:
                wish = (Wish("today", LEAST_CHANGE),)
                found.append(AxisMove(axis.name, (name,), wish, {name: known[name]}, {name: limited[name]}))
    return found


def sizes(scene: Scene) -> dict[str, Sequence[float]]:
    """Return the freed numbers of effects, by label, that come in sizes only, with those sold, ascending."""
    found: dict[str, Sequence[float]] = {}
    for effect, own in zip(scene.active, scene.effects.values(), strict=True):
        for key, sold in (effect.sold(own) if isinstance(effect, Check) else {}).items():
            bound = scene.bounds.get(label(effect, key))
            if bound is not None and bound.free and bound.min < bound.max:
                found[label(effect, key)] = sold
    return found


def explained(scene: Scene, known: Mapping[str, float], clash: Sequence[str]) -> str:
    """Return what the effects that are on say of why limits (phrases) clash; "" where they say nothing."""
    limited = bounds(scene, known)
    on = zip(scene.active, scene.effects.values(), strict=True)
    told = [effect.explain(known, limited, own, clash, scene.show) for effect, own in on if isinstance(effect, Check)]
    return " ".join(text for text in told if text)
