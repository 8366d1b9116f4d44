"""What a scene of a job may hold, and its tables checked against that.

Whoever reads a table gives the `Faults` that it keeps what is wrong in; what is right is returned all the same.
"""

import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol, TypeVar, cast

from pydantic import ValidationError

from loomopt.base.errors import (
    GAP,
    NAME,
    SAME,
    WHOLE,
    BadInput,
    Faults,
    invalid,
    misread,
    missing,
    nearest,
    refusal,
    shown,
    unknown,
)
from loomopt.base.quantities import Quantity, quantities_of, unit_of
from loomopt.base.records import lazy
from loomopt.base.units import QuantityError, ShowValue
from loomopt.physics.effects.kinds import Check, Effect, Event, Load, Speed, instance, label, model_of, needed, required
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
    tables: further tables, which the job reads and checks itself, in its `schema` of the raw scene, each with what
    returns its JSON Schema.
    instead: keys of [mechanism] → those that each stands for: a scene gives it, or them.
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
    tables: Mapping[str, Callable[[], dict[str, Any]]] = field(default_factory=dict)
    instead: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
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


FAMILY = "family"
"""What the target of several machines at once is called in every job."""

_Model = TypeVar("_Model", bound=Table)
_NAME = re.compile(r"[^\W_][\w-]{0,63}")
_ENDS = {"min", "max", "free"}
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
        raise refusal("it is not a table", origin, path, raw, "a table", f"Write a table [{path}]", WHOLE)
    return raw


def checked(model: type[_Model], raw: object, origin: str, path: str, faults: Faults) -> _Model:
    """Return a raw table as its model, with NaN for what cannot be read.

    A name that nobody knows stands for the one near it that is missing: that is one mistake, not two.
    """
    fields = model.model_fields
    try:
        given = table(raw, origin, path)
    except BadInput as error:
        faults.add(error)
        return _right({}, model).model_copy(update=dict.fromkeys(fields, math.nan))
    known = {name: value for name, value in given.items() if name in fields}
    meant = {nearest(name, fields, given) for name in given if name not in fields} - {"", *known}
    wrong = dict.fromkeys(meant, math.nan)
    _all_known(given, fields, "key", origin, path, faults)
    try:
        found = model.model_validate(known)
    except ValidationError as error:
        for each in error.errors(include_url=False):
            name = str(each["loc"][0])
            if each["type"] != "missing" or len(each["loc"]) > 1 or name not in meant:
                faults.add(invalid(each, model, origin, path))
            wrong[name] = math.nan
        found = _right({name: value for name, value in known.items() if name not in wrong}, model)
    return found.model_copy(update=wrong) if wrong else found


def _right(values: Mapping[str, Any], model: type[_Model]) -> _Model:
    """Return values that can be read as their table, whatever else it requires."""
    try:
        return model.model_validate(values)
    except ValidationError:
        return cast(_Model, model.model_construct(**values))


def problem(raw: object, jobs: JobNames, origin: str, faults: Faults) -> Problem:
    """Return [problem], its name fit for a file name and its job one of `jobs`.

    Where its job is none, the near one tells what else is wrong. Raises BadInput where none is near.
    """
    found = checked(Problem, raw, origin, "problem", faults)
    if not isinstance(found.job, str):
        raise faults.told()
    if isinstance(found.name, str) and (not _NAME.fullmatch(found.name) or found.name.lower() in _TAKEN):
        remedy = "Name it as a file could be named anywhere, such as beatup-wide"
        allowed = "up to 64 letters, digits, - and _, a letter or digit first, but for CON, NUL and the like"
        faults.add(refusal("it is not a name", origin, "problem.name", found.name, allowed, remedy))
    if found.job in jobs:
        return found
    faults.add(unknown("job", found.job, jobs.names(), origin, "problem.job"))
    near = nearest(found.job, jobs.names(), least=SAME)
    if not near:
        raise faults.told()
    return found.model_copy(update={"job": near})


def inner(raw: object, known: Collection[str], what: str, origin: str, path: str, faults: Faults) -> Mapping[str, Any]:
    """Return a table of tables; one whose name nobody knows stands for the near one where that is not there.

    what: what their names stand for.
    """
    with faults:
        given = table(raw, origin, path)
        _all_known(given, known, what, origin, path, faults)
        meant = {nearest(name, known, given, SAME): values for name, values in given.items() if name not in known}
        return meant | dict(given)
    return {}


def _all_known(
    given: Collection[str], known: Collection[str], what: str, origin: str, path: str, faults: Faults
) -> None:
    for name in given:
        if name not in known:
            faults.add(unknown(what, name, known, origin, f"{path}.{name}", given=given))


def named(
    raw: object, models: Mapping[str, type[Table]], what: str, origin: str, path: str, faults: Faults
) -> dict[str, Table]:
    """Return the tables inside a table, in the order of `models`; what: what their names stand for."""
    given = inner(raw, models, what, origin, path, faults)
    return {
        name: checked(model, given[name], origin, f"{path}.{name}", faults)
        for name, model in models.items()
        if name in given
    }


def effects(raw: object, schema: SceneSchema, origin: str, path: str, faults: Faults) -> dict[Effect, Table]:
    """Return the effects whose tables stand in a table, in the order of the job, with their values."""
    given = inner(raw, schema.effects, "effect", origin, path, faults)
    found: dict[Effect, Table] = {}
    for name, effect in schema.effects.items():
        if name not in given:
            continue
        with faults:
            if isinstance(effect, Event) and not schema.parts:
                problem = f"effect {name} parts the output from the mechanism, which job {schema.name} cannot follow"
                raise refusal(problem, origin, f"{path}.{name}", remedy="Take the table out")
            if not effect.many:
                found[effect] = _checked_effect(effect, given[name], origin, f"{path}.{name}", faults)
                continue
            instances = dict(table(given[name], origin, f"{path}.{name}"))
            if effect.alone and not all(isinstance(values, Mapping) for values in instances.values()):
                own = {key: instances.pop(key) for key in list(instances) if not isinstance(instances[key], Mapping)}
                found[effect.alone] = _checked_effect(effect.alone, own, origin, f"{path}.{name}", faults)
            for each, values in instances.items():
                key = f"{path}.{name}.{each}"
                found[instance(effect, each)] = _checked_effect(effect, values, origin, key, faults)
    return found


def _checked_effect(effect: Effect, raw: object, origin: str, path: str, faults: Faults) -> Table:
    """Return an effect's table: of one that may be a curve of one's own either that, or what it stands for."""
    found = checked(effect.own, raw, origin, path, faults)
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


def demand(
    schema: SceneSchema, tables: Mapping[str, Table], active: Mapping[Effect, Table], origin: str, faults: Faults
) -> None:
    """Find where an active effect, or the job, needs a number that is not given, and effects that cannot be on."""
    needs = [(key, f"job {schema.name}") for key in schema.needs]
    needs += [(key, f"effect {effect.name}") for effect, own in active.items() for key in needed(effect, own)]
    first = dict(reversed(needs))
    for key in dict.fromkeys(key for key, _ in needs):
        path, name = key.split(".")
        if getattr(tables[path], name) is None:
            faults.add(missing(type(tables[path]), origin, path, name, f"{first[key]} needs it"))
    own = tables["mechanism"]
    for key, others in schema.instead.items():
        given = [name for name in others if getattr(own, name) is not None]
        if getattr(own, key) is None:
            for name in others:
                if name not in given:
                    faults.add(missing(type(own), origin, "mechanism", name))
        elif given:
            problem = f"{key} and {', '.join(given)} say the same twice"
            remedy = f"Take {key} out, or {', '.join(given)}"
            faults.add(refusal(problem, origin, f"mechanism.{key}", remedy=remedy))
    for effect, own_values in active.items():
        _modelled(effect, own_values, origin, faults)
    if any(effect.beside or effect.clashes for effect in active):
        _combined(active, origin, faults)
    for effect, own in active.items():
        if any(value != value for _, value in own):  # what it is known in is not known
            continue
        words = {key: value for key, value in own if isinstance(value, str)}
        if isinstance(effect, Load) and effect.known_in(words) and not schema.partly_known:
            problem = f"effect {effect.name} is known in part of the cycle only, which job {schema.name} cannot judge"
            remedy = "Take it off, or choose other values"
            faults.add(refusal(problem, origin, f"effects.{effect.name}", remedy=remedy))


def _modelled(effect: Effect, own: Table, origin: str, faults: Faults) -> None:
    """Find where an effect lacks a number of its model, or has one of another."""
    path, found = f"effects.{effect.name}", model_of(effect, own)
    for key in found.keys:
        if getattr(own, key) is None:
            faults.add(missing(effect.own, origin, path, key))
    for word, other in effect.models.items():
        for key in set(other.keys) - {*found.keys, *found.may}:
            if getattr(own, key) is not None:
                problem, remedy = f"{key} is of model {word}", f'Write model = "{word}", or take {key} out'
                faults.add(refusal(problem, origin, f"{path}.{key}", remedy=remedy))


def _combined(active: Mapping[Effect, Table], origin: str, faults: Faults) -> None:
    """Find effects that cannot be on together."""
    from loomopt.physics.effects.kinds import faults as combined

    for fault in combined(active):
        remedy = f"Add [effects.{fault.other}], or take {fault.effect.name} off"
        remedy = remedy if fault.missing else f"Take one of them off (--without {fault.other})"
        faults.add(refusal(fault.problem, origin, f"effects.{fault.effect.name}", remedy=remedy))


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
    for key, quantity in quantities_of(model).items():
        yield Place(path, key, key, quantity, own is not None and value_of(own, key) is not None)


def value_of(own: Table, key: str) -> object:
    """Return a value of a table; of one inside it by "table.key"; None where it is not given."""
    found: object = own
    for name in key.split("."):
        found = getattr(found, name, None)
    return found


def flat(raw: Mapping[str, Any], known: Iterable[str]) -> dict[str, Any]:
    """Return a table whose keys are labels, which TOML parts at their dots: [bounds.rod] m is "rod.m".

    Beside what is of a label itself may stand what is of longer ones: mass.max, and mass.rod.mass.max. A key beside
    known ones that begin alike is one too: of rod.m a slip is rod.n, not rod.
    """
    names, found = set(known), dict[str, Any]()
    begun = {name[:place] for name in names if "." in name for place, sign in enumerate(name) if sign == "."}
    for name, value in raw.items():
        for called, each in _parted(name, value, names, begun):
            found[called] = _together(found.get(called), each)
    return found


def _together(one: object, other: object) -> object:
    """Return what two entries of one label say: both where they are tables, else the later one."""
    return {**one, **other} if isinstance(one, Mapping) and isinstance(other, Mapping) else other


def _parted(name: str, value: object, known: Collection[str], begun: Collection[str]) -> Iterator[tuple[str, Any]]:
    """Yield what of a table's entry is of which label; the entry itself where no part of it is of a longer one.

    begun: what stands before a dot of a known label.
    """
    if not isinstance(value, Mapping):
        yield name, value
        return
    slips = value.keys() - _ENDS if name not in known and name in begun else ()
    inner = [key for key in value if key in slips or f"{name}.{key}" in known or f"{name}.{key}" in begun]
    own = {key: each for key, each in value.items() if key not in inner}
    if own or not inner:
        yield name, own
    for key in inner:
        yield from _parted(f"{name}.{key}", value[key], known, begun)


def bounds(raw: object, schema: SceneSchema, known: list[Place], origin: str, faults: Faults) -> dict[str, Bound]:
    """Return [bounds]; known: places of the scene's numbers, any of which may be bounded.

    A bound on a number of an effect that is off waits for it: it is checked and left out.
    """
    found = {}
    given_bounds: dict[str, Any] = {}
    with faults:
        labels = {f"{place.table}.{place.key}".removeprefix("effects."): place.label for place in known}
        whole = flat(table(raw, origin, "bounds"), [*schema.variables, *labels, *labels.values()])
        for name, value in whole.items():
            called = name if name in schema.variables else labels.get(name, name)
            given_bounds[called] = _together(given_bounds.get(called), value)
    missed = {fault.key for fault in faults.found}
    for name, each in given_bounds.items():
        if f"mechanism.{name}" in missed:
            continue
        with faults:
            waiting = [p for p in known if p.label == name and p.waits]
            given = any(place.label == name and place.given for place in known)
            key = f"bounds.{name}"
            quantity = waiting[0].quantity if waiting and not given else bounded(name, schema, known, origin, key)
            bound = _bound(each, quantity, origin, key)
            if given or not waiting:
                found[name] = bound
    return found


def bounded(
    name: str, schema: SceneSchema, known: list[Place], origin: str, key: str, what: str = "number to bound"
) -> Quantity:
    """Return what a number to bound may be: a design variable, or the one number of that name; what: it is for.

    Raises BadInput.
    """
    found = [place for place in known if place.label == name]
    given = [place for place in found if place.given]
    if name in schema.variables:
        kind = Quantity(schema.variables[name])
        return next((place.quantity for place in found if place.table == "mechanism"), kind)
    if not found:
        names = [*schema.variables, *sorted({place.label for place in known if place.given} - set(schema.variables))]
        raise unknown(what, name, names, origin, key)
    if not given:
        where = " or ".join(f"{place.table}.{place.key}" for place in found)
        raise refusal(f"{name} has no value in this scene", origin, key, remedy=f"Give {where}, or take {key} out")
    if len(given) > 1:
        where = ", ".join(f"{place.table}.{place.key}" for place in given)
        raise refusal(f"{name} may mean {where}", origin, key, remedy=f"Take {key} out")
    return given[0].quantity


def _bound(raw: object, quantity: Quantity, origin: str, key: str) -> Bound:
    if not isinstance(raw, Mapping):
        value = _value(quantity, raw, origin, key)
        return Bound(value, value, True, _unit(raw))
    faults = Faults()
    _all_known(raw, ("min", "max", "free"), "key", origin, key, faults)
    given = raw.get("free", True)
    free = {"true": True, "false": False}.get(given.lower()) if isinstance(given, str) else given
    if not isinstance(free, bool):
        problem, allowed = "it is neither true nor false", "true, false"
        faults.add(refusal(problem, origin, f"{key}.free", raw["free"], allowed, "Correct the value"))
    found = _ends(raw, [end for end in ("min", "max") if end in raw], quantity, origin, key, faults)
    for end in ("min", "max"):
        if end not in raw and not any(nearest(name, (end,), least=SAME) for name in raw):
            remedy = f"Give min and max of {key}, or one value to fix it"
            problem = f"{end} is missing: a bound has two ends"
            faults.add(refusal(problem, origin, f"{key}.{end}", remedy=remedy, grade=GAP))
    faults.tell()
    return Bound(found["min"], found["max"], free is True, _unit(raw["min"]))


def limits(
    raw: object, schema: SceneSchema, active: Sequence[Effect], origin: str, faults: Faults
) -> dict[str, LimitRange]:
    """Return [limits]: figures of the job, and of the effects that are on."""
    given_limits: Mapping[str, Any] = {}
    with faults:
        given_limits = flat(table(raw, origin, "limits"), schema.figures)
    limitable = [name for name, figure in schema.figures.items() if figure.sides]
    for name in (name for name in given_limits if name in schema.figures and name not in limitable):
        problem, remedy = "this figure is told of a design, and no limit holds it", "Limit another, or take it out"
        faults.add(refusal(problem, origin, f"limits.{name}", allowed=", ".join(limitable), remedy=remedy, grade=NAME))
    strange = [name for name in given_limits if name not in schema.figures]
    _all_known(strange, limitable, "figure to limit", origin, "limits", faults)
    on = {effect.name for effect in active}
    found = {}
    for name in (name for name in given_limits if name in limitable):
        with faults:
            givers = [other for other, effect in schema.effects.items() if name in _told_by(effect)]
            if givers and not on.intersection(givers):
                off = (
                    f"effect {givers[0]} is off: it" if len(givers) == 1 else f"effects {' and '.join(givers)} are off:"
                )
                problem = f"{off} gives {name}" if len(givers) == 1 else f"{off} each of them gives {name}"
                remedy = f"Put {' or '.join(givers)} on, or take the limit out"
                raise refusal(problem, origin, f"limits.{name}", remedy=remedy)
            found[name] = _limit(given_limits[name], schema.figures[name], name, origin)
    return found


def _told_by(effect: Effect) -> Collection[str]:
    """Return the figures that an effect gives by rows or over the cycle."""
    if isinstance(effect, Check):
        return {*effect.over_cycle, *effect.rows}
    return effect.rows if isinstance(effect, Speed) else ()


def _limit(raw: object, figure: Figure, name: str, origin: str) -> LimitRange:
    key = f"limits.{name}"
    sides = " and ".join(figure.sides)
    if not isinstance(raw, Mapping):
        remedy = f"Write a table with {sides}"
        raise refusal("it is not a table", origin, key, raw, f"a table with {sides}", remedy)
    if not raw:
        raise refusal("the limit is empty", origin, key, allowed=sides, remedy="Give a side, or take the limit out")
    faults = Faults()
    _all_known(raw, ("min", "max"), "key", origin, key, faults)
    given = [side for side in raw if side in ("min", "max")]
    for side in given:
        if side not in figure.sides:
            problem, remedy = f"{name} has no limit {side}", f"Limit its {sides}"
            faults.add(refusal(problem, origin, f"{key}.{side}", raw[side], sides, remedy))
    given = [side for side in given if side in figure.sides]
    found = _ends(raw, given, Quantity(figure.kind), origin, key, faults)
    faults.tell()
    return LimitRange(found.get("min"), found.get("max"), _unit(next(iter(raw.values()))))


def _ends(
    raw: Mapping[str, Any], given: Iterable[str], quantity: Quantity, origin: str, key: str, faults: Faults
) -> dict[str, float]:
    """Return the ends of a range that are given, in order."""
    found = {}
    for end in given:
        with faults:
            found[end] = _value(quantity, raw[end], origin, f"{key}.{end}")
    if len(found) == 2 and found["min"] > found["max"]:
        ends = f"min {shown(raw['min'])}, max {shown(raw['max'])}"
        problem, remedy = f"min is more than max ({ends})", "Exchange or correct them"
        faults.add(refusal(problem, origin, key, allowed="min <= max", remedy=remedy))
    return found


def _value(quantity: Quantity, raw: object, origin: str, key: str) -> float:
    try:
        return quantity.validate(raw)
    except QuantityError as error:
        raise misread(error, origin, key, raw) from None


def _unit(raw: object) -> str:
    """Return the unit of a value that has been read."""
    return unit_of(raw) if isinstance(raw, str) else "1"
