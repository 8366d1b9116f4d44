"""What a scene of a job may hold, and its tables checked against that; the first fault is one BadInput."""

import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol, TypeVar

from pydantic import ValidationError

from loomopt.base.errors import invalid, misread, missing, refusal, shown, unknown
from loomopt.base.quantities import Quantity, quantity_of, unit_of
from loomopt.base.records import lazy
from loomopt.base.units import QuantityError, ShowValue
from loomopt.physics.effects.kinds import Check, Effect, Event, Load, Speed, instance, label, needed, required
from loomopt.physics.schema import Axis, Conflict, Figure, Sense, Table, Target


@dataclass(frozen=True)
class SceneSchema:
    """What a scene of a job may hold; it may follow from the raw scene.

    operation, mechanism: models of those tables; keys that are required only by what reads them are optional there.
    effects: by name, in the order of the job. variables: design variables → kind of quantity, in the order shown.
    figures: the job's own; those of its effects come with them (`all_figures`).
    fault(design, shown): why a design, SI, cannot work as this mechanism, its numbers as `shown` tells them; "" when
    it can.
    margins: limits that every design keeps → kind of quantity; their names are whole phrases.
    groups: name → bounds that --free frees together.
    partly_known: whether the job honours loads that are known on some pieces of the cycle only.
    parts: whether the job honours effects by which the output may part from the mechanism.
    lists: parts of a design that are lists of numbers → their kind of quantity; inside, NAME_0, NAME_1 ...
    own_axes: axes that are read otherwise than under their own name.
    conflict: the two axes whose front stands among the reference results, for the scene that is named after its job.
    """

    name: str
    title: str
    operation: type[Table]
    mechanism: type[Table]
    effects: Mapping[str, Effect]
    variables: Mapping[str, str]
    own_figures: Mapping[str, Figure]
    targets: Mapping[str, Target]
    default_target: str
    fault: Callable[[Mapping[str, float], ShowValue], str]
    needs: tuple[str, ...] = ()
    own_margins: Mapping[str, str] = field(default_factory=dict)
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    lists: Mapping[str, str] = field(default_factory=dict)
    partly_known: bool = False
    parts: bool = False
    own_axes: Mapping[str, Axis] = field(default_factory=dict)
    conflict: Conflict | None = None

    @lazy
    def figures(self) -> dict[str, Figure]:
        """Figures of the job, then those of its effects."""
        return {**self.own_figures, **{f.name: f for effect in self.effects.values() for f in effect.figures}}

    @property
    def axes(self) -> dict[str, Axis]:
        """What can be traded: variables, and every figure that can be limited; a job's own axes say it their way."""
        ends: dict[str, tuple[Sense, ...]] = {"min": ("most",), "max": ("least",)}
        found = {name: Axis(name, kind) for name, kind in self.variables.items()}
        for figure in self.figures.values():
            senses = tuple(sense for side in figure.sides for sense in ends[side])
            if senses and figure.name not in found:
                found[figure.name] = Axis(figure.name, figure.kind, senses=senses[::-1])
        return {**found, **self.own_axes}

    @property
    def margins(self) -> dict[str, str]:
        """Margins of the job, then those of its effects."""
        found = dict(self.own_margins)
        for effect in self.effects.values():
            found |= effect.margins
        return found


_Model = TypeVar("_Model", bound=Table)
_NAME = re.compile(r"[^\W_][\w-]{0,63}")
_TAKEN = {"con", "prn", "aux", "nul", *(f"{port}{digit}" for port in ("com", "lpt") for digit in "0123456789¹²³")}
"""Names that Windows keeps for its devices."""


class JobNames(Protocol):
    """The jobs that there are, by name."""

    def __contains__(self, name: object, /) -> bool:
        """Say whether there is a job of a name."""

    def names(self) -> Collection[str]:
        """Return the names of all jobs."""


class Problem(Table):
    """What a scene says of itself; source: citation of where its numbers come from."""

    name: str
    job: str
    title: str
    source: str = ""


class Bound(NamedTuple):
    """Range of a number that may vary, SI; equal ends fix it; not free: held at today's; unit: as written."""

    min: float
    max: float
    free: bool
    unit: str


class LimitRange(NamedTuple):
    """Range in which a figure is kept, SI; None: that side is open; unit: as written."""

    min: float | None
    max: float | None
    unit: str


class Place(NamedTuple):
    """Where a number stands: table and key; what a designer calls it; what it may be.

    given: whether the scene has a value for it; waits: whether the values of its effect, which is off, are at hand.
    """

    table: str
    key: str
    label: str
    quantity: Quantity
    given: bool
    waits: bool = False


def table(raw: object, origin: str, path: str) -> Mapping[str, Any]:
    """Return raw if it is a table."""
    if not isinstance(raw, Mapping):
        raise refusal("it is not a table", origin, path, raw, remedy=f"Write a table [{path}]")
    return raw


def checked(model: type[_Model], raw: object, origin: str, path: str) -> _Model:
    """Return a raw table as its model."""
    values = dict(table(raw, origin, path))
    for name in values:
        if name not in model.model_fields:
            raise unknown("key", name, model.model_fields, origin, f"{path}.{name}")
    try:
        return model.model_validate(values)
    except ValidationError as error:
        raise invalid(error, model, origin, path) from None


def problem(raw: object, jobs: JobNames, origin: str) -> Problem:
    """Return [problem], its name fit for a file name and its job one of `jobs`."""
    found = checked(Problem, raw, origin, "problem")
    if not _NAME.fullmatch(found.name) or found.name.lower() in _TAKEN:
        remedy = "Name it as a file could be named anywhere, such as beatup-wide"
        allowed = "up to 64 letters, digits, - and _, a letter or digit first, but for CON, NUL and the like"
        raise refusal("it is not a name", origin, "problem.name", found.name, allowed, remedy)
    if found.job not in jobs:
        raise unknown("job", found.job, jobs.names(), origin, "problem.job")
    return found


def named(raw: object, models: Mapping[str, type[Table]], what: str, origin: str, path: str) -> dict[str, Table]:
    """Return the tables inside a table, in the order of `models`; what: what their names stand for."""
    inner = table(raw, origin, path)
    for name in inner:
        if name not in models:
            raise unknown(what, name, models, origin, f"{path}.{name}")
    return {
        name: checked(model, inner[name], origin, f"{path}.{name}") for name, model in models.items() if name in inner
    }


def effects(raw: object, schema: SceneSchema, origin: str, path: str) -> dict[Effect, Table]:
    """Return the effects whose tables stand in a table, in the order of the job, with their values."""
    inner, found = table(raw, origin, path), {}
    for name in inner:
        if name not in schema.effects:
            raise unknown("effect", name, schema.effects, origin, f"{path}.{name}")
    for name, effect in schema.effects.items():
        if name not in inner:
            continue
        if isinstance(effect, Event) and not schema.parts:
            problem = f"effect {name} parts the output from the mechanism, which job {schema.name} cannot follow"
            raise refusal(problem, origin, f"{path}.{name}", remedy="Take the table out")
        if not effect.many:
            found[effect] = _checked_effect(effect, inner[name], origin, f"{path}.{name}")
            continue
        for each, values in table(inner[name], origin, f"{path}.{name}").items():
            found[instance(effect, each)] = _checked_effect(effect, values, origin, f"{path}.{name}.{each}")
    return found


def _checked_effect(effect: Effect, raw: object, origin: str, path: str) -> Table:
    """Return an effect's table: of one that may be a curve of one's own either that, or what it stands for."""
    found = checked(effect.own, raw, origin, path)
    curve = effect.tabulated if isinstance(effect, Load) else None
    if curve is None:
        return found
    if getattr(found, curve.key) is None:
        for key in required(effect):
            if getattr(found, key) is None:
                raise missing(effect.own, origin, path, key)
        return found
    others = [key for key in curve.instead if key in found.model_fields_set]
    if others:
        problem = f"{curve.key} and {', '.join(others)} say the same twice"
        raise refusal(problem, origin, f"{path}.{curve.key}", remedy=f"Take {curve.key} out, or {', '.join(others)}")
    return found


def demand(schema: SceneSchema, tables: Mapping[str, Table], active: Mapping[Effect, Table], origin: str) -> None:
    """Raise BadInput where an active effect, or the job, needs a number that is not given."""
    needs = [(key, f"job {schema.name}") for key in schema.needs]
    needs += [(key, f"effect {effect.name}") for effect, own in active.items() for key in needed(effect, own)]
    for key, who in needs:
        path, name = key.split(".")
        if getattr(tables[path], name) is None:
            raise missing(type(tables[path]), origin, path, name, f"{who} needs it")
    if any(effect.beside or effect.clashes for effect in active):
        _combined(active, origin)
    for effect, own in active.items():
        words = {key: value for key, value in own if isinstance(value, str)}
        if isinstance(effect, Load) and effect.known_in(words) and not schema.partly_known:
            problem = f"effect {effect.name} is known in part of the cycle only, which job {schema.name} cannot judge"
            raise refusal(problem, origin, f"effects.{effect.name}", remedy="Take it off, or choose other values")


def _combined(active: Mapping[Effect, Table], origin: str) -> None:
    """Raise BadInput where effects cannot be on together."""
    from loomopt.physics.effects.kinds import faults

    for fault in faults(active):
        remedy = f"Add [effects.{fault.other}], or take {fault.effect.name} off"
        remedy = remedy if fault.missing else f"Take one of them off (--without {fault.other})"
        raise refusal(fault.problem, origin, f"effects.{fault.effect.name}", remedy=remedy)


def places(
    schema: SceneSchema, tables: Mapping[str, Table], active: Mapping[Effect, Table], available: Mapping[Effect, Table]
) -> Iterator[Place]:
    """Yield every place of a number in the job's tables, those of effects that are off included."""
    for path, model in (("operation", schema.operation), ("mechanism", schema.mechanism)):
        yield from _places(path, model, tables[path])
    known = [*active, *available, *(effect for effect in schema.effects.values() if not effect.many)]
    for effect in dict.fromkeys(known):
        path, waits = f"effects.{effect.name}", effect in available
        for place in _places(path, effect.own, active.get(effect)):
            yield place._replace(label=label(effect, place.key), waits=waits)


def _places(path: str, model: type[Table], own: Table | None) -> Iterator[Place]:
    for key in model.model_fields:
        quantity = quantity_of(model, key)
        if quantity:
            yield Place(path, key, key, quantity, own is not None and getattr(own, key) is not None)


def flat(raw: object, known: Iterable[str], origin: str, path: str) -> dict[str, Any]:
    """Return a table whose keys are labels, which TOML parts at their dots: [bounds.rod] m is "rod.m"."""
    found: dict[str, Any] = {}
    for name, value in table(raw, origin, path).items():
        inner = {f"{name}.{key}": each for key, each in value.items()} if isinstance(value, Mapping) else {}
        found |= inner if name not in known and inner.keys() & set(known) else {name: value}
    return found


def bounds(raw: object, schema: SceneSchema, known: list[Place], origin: str) -> dict[str, Bound]:
    """Return [bounds]; known: places of the scene's numbers, any of which may be bounded.

    A bound on a number of an effect that is off waits for it: it is checked and left out.
    """
    found = {}
    for name, each in flat(raw, [*schema.variables, *(place.label for place in known)], origin, "bounds").items():
        waiting = [p for p in known if p.label == name and p.waits]
        given = any(place.label == name and place.given for place in known)
        quantity = waiting[0].quantity if waiting and not given else _bounded(name, schema, known, origin)
        bound = _bound(each, quantity, origin, f"bounds.{name}")
        if given or not waiting:
            found[name] = bound
    return found


def _bounded(name: str, schema: SceneSchema, known: list[Place], origin: str) -> Quantity:
    """Return what a number to bound may be: a design variable, or the one number of that name."""
    key = f"bounds.{name}"
    found = [place for place in known if place.label == name]
    given = [place for place in found if place.given]
    if name in schema.variables:
        kind = Quantity(schema.variables[name])
        return next((place.quantity for place in found if place.table == "mechanism"), kind)
    if not found:
        names = [*schema.variables, *sorted({place.label for place in known if place.given} - set(schema.variables))]
        raise unknown("number to bound", name, names, origin, key)
    if not given:
        where = " or ".join(f"{place.table}.{place.key}" for place in found)
        raise refusal(f"{name} has no value in this scene", origin, key, remedy=f"Give {where}, or take the bound out")
    if len(given) > 1:
        where = ", ".join(f"{place.table}.{place.key}" for place in given)
        raise refusal(f"{name} may mean {where}", origin, key, remedy="Take the bound out")
    return given[0].quantity


def _bound(raw: object, quantity: Quantity, origin: str, key: str) -> Bound:
    if not isinstance(raw, Mapping):
        value = _value(quantity, raw, origin, key)
        return Bound(value, value, True, _unit(raw))
    _known_keys(raw, ("min", "max", "free"), origin, key)
    for end in ("min", "max"):
        if end not in raw:
            remedy = f"Give min and max of {key}, or one value to fix it"
            raise refusal(f"{end} is missing: a bound has two ends", origin, f"{key}.{end}", remedy=remedy)
    given = raw.get("free", True)
    free = {"true": True, "false": False}.get(given.lower()) if isinstance(given, str) else given
    if not isinstance(free, bool):
        free_key = f"{key}.free"
        raise refusal("it is neither true nor false", origin, free_key, raw["free"], "true, false", "Correct the value")
    low, high = (_value(quantity, raw[end], origin, f"{key}.{end}") for end in ("min", "max"))
    _ordered(raw, low, high, origin, key)
    return Bound(low, high, free, _unit(raw["min"]))


def limits(raw: object, schema: SceneSchema, active: Sequence[Effect], origin: str) -> dict[str, LimitRange]:
    """Return [limits]: figures of the job, and of the effects that are on."""
    inner = flat(raw, schema.figures, origin, "limits")
    limitable = [name for name, figure in schema.figures.items() if figure.sides]
    on = {effect.name for effect in active}
    for name in inner:
        if name not in limitable:
            raise unknown("figure to limit", name, limitable, origin, f"limits.{name}")
        for other, effect in schema.effects.items():
            given = isinstance(effect, Check | Speed) and name in {*getattr(effect, "quantities", ()), *effect.rows}
            if given and other not in on:
                remedy = f"Put {other} on, or take the limit out"
                raise refusal(f"effect {other} is off: it gives {name}", origin, f"limits.{name}", remedy=remedy)
    return {name: _limit(inner[name], schema.figures[name], name, origin) for name in inner}


def _limit(raw: object, figure: Figure, name: str, origin: str) -> LimitRange:
    key = f"limits.{name}"
    sides = " and ".join(figure.sides)
    if not isinstance(raw, Mapping):
        remedy = f"Write a table with {sides}"
        raise refusal("it is not a table", origin, key, raw, f"a table with {sides}", remedy)
    _known_keys(raw, ("min", "max"), origin, key)
    for side in raw:
        if side not in figure.sides:
            remedy = f"Limit its {sides}"
            raise refusal(f"{name} has no limit {side}", origin, f"{key}.{side}", raw[side], sides, remedy)
    if not raw:
        raise refusal("the limit is empty", origin, key, allowed=sides, remedy="Give a side, or take the limit out")
    quantity = Quantity(figure.kind)
    found = {side: _value(quantity, value, origin, f"{key}.{side}") for side, value in raw.items()}
    if len(found) == 2:
        _ordered(raw, found["min"], found["max"], origin, key)
    return LimitRange(found.get("min"), found.get("max"), _unit(next(iter(raw.values()))))


def _known_keys(raw: Mapping[str, Any], known: tuple[str, ...], origin: str, key: str) -> None:
    for name in raw:
        if name not in known:
            raise unknown("key", name, known, origin, f"{key}.{name}")


def _ordered(raw: Mapping[str, Any], low: float, high: float, origin: str, key: str) -> None:
    if low > high:
        ends = f"min {shown(raw['min'])}, max {shown(raw['max'])}"
        raise refusal(
            f"min is more than max ({ends})",
            origin,
            key,
            allowed="min <= max",
            remedy="Exchange or correct them",
        )


def _value(quantity: Quantity, raw: object, origin: str, key: str) -> float:
    try:
        return quantity.validate(raw)
    except QuantityError as error:
        raise misread(error, origin, key, raw) from None


def _unit(raw: object) -> str:
    """Return the unit of a value that has been read."""
    return unit_of(raw) if isinstance(raw, str) else "1"
