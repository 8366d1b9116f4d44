"""Schema of the scenes of a job, and the check of a scene's tables against it.

A reader adds mistakes to the list of its cursor and returns the values that can be read.
"""

import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

from loomopt.base.errors import GAP, NAME, SAME, nearest, shown
from loomopt.base.quantities import Quantity, quantities_of, unit_of
from loomopt.base.records import lazy
from loomopt.base.units import ShowValue
from loomopt.physics.effects.kinds import Check, Effect, Event, Load, Speed, instance, label, model_of, needed, required
from loomopt.physics.schema import Axis, Conflict, Figure, Sense, Table, Target
from loomopt.scenes.cursor import Cursor
from loomopt.scenes.synonyms import Synonym


@dataclass(frozen=True)
class SceneSchema:
    """Schema of the scenes of a job; it may depend on the raw scene.

    operation, mechanism: models of those tables; keys that are required only by what reads them are optional there.
    effects: by name, in the order of the job. variables: design variables → kind of quantity, in the order shown.
    figures: the job's own; those of its effects come with them (`all_figures`).
    fault(design, shown): reason why a design, SI, cannot work as this mechanism, with numbers as text by `shown`; "" if
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
    former_names: today's names of figures by their former ones. synonyms: keys of one number.
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
    former_names: Mapping[str, str] = field(default_factory=dict)
    synonyms: tuple[Synonym, ...] = ()

    @lazy
    def figures(self) -> dict[str, Figure]:
        """Figures of the job, then those of its effects."""
        return {**self.own_figures, **{f.name: f for effect in self.effects.values() for f in effect.figures}}

    @property
    def axes(self) -> dict[str, Axis]:
        """Axes of a front: variables, and figures that can be limited; the job's axes replace those of their name."""
        ends: dict[str, tuple[Sense, ...]] = {"min": ("most",), "max": ("least",)}
        axes = {name: Axis(name, kind) for name, kind in self.variables.items()}
        for figure in self.figures.values():
            senses = tuple(sense for side in figure.sides for sense in ends[side])
            if senses and figure.name not in axes:
                axes[figure.name] = Axis(figure.name, figure.kind, senses=senses[::-1])
        return {**axes, **self.own_axes}

    @property
    def margins(self) -> dict[str, str]:
        """Margins of the job, then those of its effects."""
        margins = dict(self.own_margins)
        for effect in self.effects.values():
            margins |= effect.margins
        return margins


FAMILY = "family"
"""Name of the target for several machines at once, in every job."""

_NAME = re.compile(r"[^\W_][\w-]{0,63}")
_ENDS = {"min", "max", "free"}
_TAKEN = {"con", "prn", "aux", "nul", *(f"{port}{digit}" for port in ("com", "lpt") for digit in "0123456789¹²³")}
"""Names that Windows keeps for its devices."""


class JobNames(Protocol):
    """Known jobs, by name."""

    def __contains__(self, name: object, /) -> bool:
        """Whether a job of this name exists."""

    def names(self) -> Collection[str]:
        """Names of all jobs."""


class Problem(Table):
    """Head of a scene; source: citation for its numbers."""

    name: str
    job: str
    title: str
    source: str = ""


class Bound(NamedTuple):
    """Range of a number, SI; equal ends fix it; free: false fixes it at today's value; unit: as written."""

    min: float
    max: float
    free: bool
    unit: str


class LimitRange(NamedTuple):
    """Limits of a figure, SI; None: no limit on this side; unit: as written."""

    min: float | None
    max: float | None
    unit: str


class Place(NamedTuple):
    """Place of a number: table and key; name for the designer; quantity.

    given: whether the scene has a value; waits: whether the effect is off and has values in [available].
    """

    table: str
    key: str
    label: str
    quantity: Quantity
    given: bool
    waits: bool = False


def problem(cursor: Cursor, jobs: JobNames) -> Problem:
    """Table [problem], its name fit for a file name and its job one of `jobs`.

    An unknown job is read as the job of a similar name, so that the other tables are checked too. Raises BadInput if no
    name is similar.
    """
    faults, read = cursor.faults, cursor.record(Problem)
    if not isinstance(read.job, str):
        raise faults.error()
    if isinstance(read.name, str) and (not _NAME.fullmatch(read.name) or read.name.lower() in _TAKEN):
        remedy = "Choose a name that is valid as a file name on every system, such as beatup-wide"
        allowed = "up to 64 letters, digits, - and _, a letter or digit first, but for CON, NUL and the like"
        faults.add(cursor.at("name").fault("it is not a name", read.name, allowed, remedy))
    if read.job in jobs:
        return read
    faults.add(cursor.at("job").unknown("job", read.job, jobs.names()))
    near = nearest(read.job, jobs.names(), least=SAME)
    if not near:
        raise faults.error()
    return read.model_copy(update={"job": near})


def records(cursor: Cursor, models: Mapping[str, type[Table]], sort: str) -> dict[str, Table]:
    """Tables inside a table, in the order of `models`; sort: kind of thing that they name."""
    inner = cursor.subtables(models, sort)
    return {name: inner[name].record(model) for name, model in models.items() if name in inner}


def effects(cursor: Cursor, schema: SceneSchema) -> dict[Effect, Table]:
    """Effects with a table in [effects] or [available], in the order of the job, with their values."""
    inner = cursor.subtables(schema.effects, "effect")
    read: dict[Effect, Table] = {}
    for name, effect in schema.effects.items():
        if name not in inner:
            continue
        place = inner[name]
        with cursor.faults:
            if isinstance(effect, Event) and not schema.parts:
                problem = (
                    f"effect {name} separates the output from the mechanism, which job {schema.name} cannot simulate"
                )
                raise place.fault(problem, remedy="Take the table out")
            if not effect.many:
                read[effect] = _effect(effect, place)
                continue
            tables = dict(place.table())
            if effect.alone and not all(isinstance(values, Mapping) for values in tables.values()):
                single = {key: tables.pop(key) for key in list(tables) if not isinstance(tables[key], Mapping)}
                read[effect.alone] = _effect(effect.alone, place._replace(raw=single))
            for key in tables:
                read[instance(effect, key)] = _effect(effect, place.at(key))
    return read


def _effect(effect: Effect, cursor: Cursor) -> Table:
    """Table of an effect; an effect that may be a curve has either the curve or the numbers that it replaces."""
    read = cursor.record(effect.table)
    curve = effect.tabulated if isinstance(effect, Load) else None
    if curve is None:
        return read
    if getattr(read, curve.key) is None:
        for key in required(effect):
            if getattr(read, key) is None:
                raise cursor.missing(effect.table, key)
        return read
    others = [key for key in curve.instead if key in read.model_fields_set]
    if others:
        problem = f"{curve.key} and {', '.join(others)} define the same quantity twice"
        raise cursor.at(curve.key).fault(problem, remedy=f"Take {curve.key} out, or {', '.join(others)}")
    return read


def check_needs(
    scene: Cursor, schema: SceneSchema, tables: Mapping[str, Table], active: Mapping[Effect, Table]
) -> None:
    """Add a mistake for every number that an active effect or the job lacks, and for effects that cannot be on."""
    faults = scene.faults
    needs = [(key, f"job {schema.name}") for key in schema.needs]
    needs += [(key, f"effect {effect.name}") for effect, table in active.items() for key in needed(effect, table)]
    first = dict(reversed(needs))
    for key in dict.fromkeys(key for key, _ in needs):
        path, name = key.split(".")
        if getattr(tables[path], name) is None:
            faults.add(scene.at(path).missing(type(tables[path]), name, f"{first[key]} needs it"))
    mechanism, place = tables["mechanism"], scene.at("mechanism")
    for key, others in schema.instead.items():
        given = [name for name in others if getattr(mechanism, name) is not None]
        if getattr(mechanism, key) is None:
            for name in others:
                if name not in given:
                    faults.add(place.missing(type(mechanism), name))
        elif given:
            problem = f"{key} and {', '.join(given)} define the same quantity twice"
            faults.add(place.at(key).fault(problem, remedy=f"Take {key} out, or {', '.join(given)}"))
    for effect, table in active.items():
        _check_model(scene.at("effects").at(effect.name), effect, table)
    if any(effect.companions or effect.clashes for effect in active):
        _check_together(scene.at("effects"), active)
    for effect, table in active.items():
        if any(value != value for _, value in table):  # where it is known depends on a value that cannot be read
            continue
        problem = effect.fault(dict(table)) if isinstance(effect, Check) else ""
        if problem:
            remedy = "Correct one of its numbers"
            faults.add(
                scene.at("effects").at(effect.name).fault(f"the {effect.name} cannot be made: {problem}", remedy=remedy)
            )
        words = {key: value for key, value in table if isinstance(value, str)}
        if isinstance(effect, Load) and effect.known_in(words) and not schema.partly_known:
            problem = (
                f"effect {effect.name} is known in part of the cycle only, which job {schema.name} does not support"
            )
            remedy = "Take it off, or choose other values"
            faults.add(scene.at("effects").at(effect.name).fault(problem, remedy=remedy))


def _check_model(cursor: Cursor, effect: Effect, table: Table) -> None:
    """Add a mistake if an effect lacks a number of its model, or has a number of another model."""
    model = model_of(effect, table)
    for key in model.keys:
        if getattr(table, key) is None:
            cursor.faults.add(cursor.missing(effect.table, key))
    for word, other_model in effect.models.items():
        for key in set(other_model.keys) - {*model.keys, *model.may}:
            if getattr(table, key) is not None:
                remedy = f'Write model = "{word}", or take {key} out'
                cursor.faults.add(cursor.at(key).fault(f"{key} belongs to model {word}", remedy=remedy))


def _check_together(cursor: Cursor, active: Mapping[Effect, Table]) -> None:
    """Add a mistake for every pair of effects that cannot be on together."""
    from loomopt.physics.effects import kinds

    for fault in kinds.faults(active):
        remedy = f"Add [effects.{fault.other}], or take {fault.effect.name} off"
        remedy = remedy if fault.missing else f"Take one of them off (--without {fault.other})"
        cursor.faults.add(cursor.at(fault.effect.name).fault(fault.problem, remedy=remedy))


def places(
    schema: SceneSchema, tables: Mapping[str, Table], active: Mapping[Effect, Table], available: Mapping[Effect, Table]
) -> Iterator[Place]:
    """Yield every place of a number in the job's tables, those of effects that are off included."""
    for path, model in (("operation", schema.operation), ("mechanism", schema.mechanism)):
        yield from _places(path, model, tables[path])
    known = [*active, *available, *(effect for effect in schema.effects.values() if not effect.many)]
    for effect in dict.fromkeys(known):
        path, waits = f"effects.{effect.name}", effect in available
        for place in _places(path, effect.table, active.get(effect)):
            yield place._replace(label=label(effect, place.key), waits=waits)


def _places(path: str, model: type[Table], table: Table | None) -> Iterator[Place]:
    for key, quantity in quantities_of(model).items():
        yield Place(path, key, key, quantity, table is not None and value_of(table, key) is not None)


def value_of(table: Table, key: str) -> object:
    """Value of a table, or of a table inside it by "table.key"; None if it is not given."""
    value: object = table
    for name in key.split("."):
        value = getattr(value, name, None)
    return value


def flat(raw: Mapping[str, Any], known: Iterable[str]) -> dict[str, Any]:
    """Table whose keys are labels, which TOML splits at their dots: [bounds.rod] m has the label "rod.m".

    Entries of a label and of longer labels may be in the same table: mass.max, and mass.rod.mass.max. An unknown key
    next to known labels with the same beginning is a label too: rod.n next to rod.m is a mistake of rod.n, not of rod.
    """
    names, entries = set(known), dict[str, Any]()
    begun = {name[:place] for name in names if "." in name for place, sign in enumerate(name) if sign == "."}
    for name, value in raw.items():
        for called, entry in _split_labels(name, value, names, begun):
            entries[called] = _merge(entries.get(called), entry)
    return entries


def _merge(first: object, second: object) -> object:
    """Union of two entries of one label if both are tables, else the later one."""
    return {**first, **second} if isinstance(first, Mapping) and isinstance(second, Mapping) else second


def _split_labels(
    name: str, value: object, known: Collection[str], begun: Collection[str]
) -> Iterator[tuple[str, Any]]:
    """Yield each label in an entry of a table with its part of the entry.

    begun: beginnings of the known labels, up to any of their dots.
    """
    if not isinstance(value, Mapping):
        yield name, value
        return
    slips = value.keys() - _ENDS if name not in known and name in begun else ()
    inner = [key for key in value if key in slips or f"{name}.{key}" in known or f"{name}.{key}" in begun]
    rest = {key: entry for key, entry in value.items() if key not in inner}
    if rest or not inner:
        yield name, rest
    for key in inner:
        yield from _split_labels(f"{name}.{key}", value[key], known, begun)


def label_entries(cursor: Cursor, known: Iterable[str]) -> dict[str, Cursor]:
    """Entries by label of a table as in `flat`; known: the known labels. Raises BadInput."""
    return cursor.entries(flat(cursor.table(), known))


def bounds(cursor: Cursor, schema: SceneSchema, known: list[Place]) -> dict[str, Bound]:
    """Bounds by name from the table [bounds]; known: places of all numbers of the scene.

    The bound of a number of an effect that is off is checked and left out.
    """
    read: dict[str, Bound] = {}
    entries: dict[str, Any] = {}
    with cursor.faults:
        labels = {f"{place.table}.{place.key}".removeprefix("effects."): place.label for place in known}
        for name, value in flat(cursor.table(), [*schema.variables, *labels, *labels.values()]).items():
            label = name if name in schema.variables else labels.get(name, name)
            entries[label] = _merge(entries.get(label), value)
    misread = {fault.key for fault in cursor.faults.mistakes}
    for name, place in cursor.entries(entries).items():
        if f"mechanism.{name}" in misread:
            continue
        with cursor.faults:
            quantity, counts = number_or_waiting(place, schema, known)
            bound = _bound(place, quantity)
            if counts:
                read[name] = bound
    return read


def number_or_waiting(
    cursor: Cursor, schema: SceneSchema, known: Sequence[Place], sort: str = "number to bound"
) -> tuple[Quantity, bool]:
    """Quantity of the number of a label, and whether it counts: false for a number of an effect that is off.

    Raises BadInput.
    """
    label = cursor.label
    waiting = [place for place in known if place.waits and place.label == label]
    if waiting and not any(place.label == label and place.given for place in known):
        return waiting[0].quantity, False
    return quantity_of_label(cursor, schema, known, sort), True


def quantity_of_label(
    cursor: Cursor, schema: SceneSchema, known: Sequence[Place], sort: str = "number to bound"
) -> Quantity:
    """Quantity of a design variable or of the number of this label; sort: kind of thing for the message.

    Raises BadInput.
    """
    name, key = cursor.label, cursor.path
    places = [place for place in known if place.label == name]
    given = [place for place in places if place.given]
    if name in schema.variables:
        kind = Quantity(schema.variables[name])
        return next((place.quantity for place in places if place.table == "mechanism"), kind)
    if not places:
        names = [*schema.variables, *sorted({place.label for place in known if place.given} - set(schema.variables))]
        raise cursor.unknown(sort, name, names)
    if not given:
        where = " or ".join(f"{place.table}.{place.key}" for place in places)
        raise cursor.fault(f"{name} has no value in this scene", remedy=f"Give {where}, or take {key} out")
    if len(given) > 1:
        where = ", ".join(f"{place.table}.{place.key}" for place in given)
        raise cursor.fault(f"{name} may mean {where}", remedy=f"Take {key} out")
    return given[0].quantity


def _bound(cursor: Cursor, quantity: Quantity) -> Bound:
    """One bound: a value that fixes the number, or a table of its ends. Raises BadInput."""
    raw, key = cursor.raw, cursor.path
    if not isinstance(raw, Mapping):
        value = cursor.number(quantity)
        return Bound(value, value, True, _unit(raw))
    cursor = cursor.apart()
    cursor.check_keys(raw, ("min", "max", "free"))
    given = raw.get("free", True)
    free = {"true": True, "false": False}.get(given.lower()) if isinstance(given, str) else given
    if not isinstance(free, bool):
        problem, allowed = "it is neither true nor false", "true, false"
        cursor.faults.add(cursor.at("free").fault(problem, given, allowed, "Correct the value"))
    ends = _ends(cursor, [end for end in ("min", "max") if end in raw], quantity)
    for end in ("min", "max"):
        if end not in raw and not any(nearest(name, (end,), least=SAME) for name in raw):
            problem = f"{end} is missing: a bound has two ends"
            remedy = f"Give min and max of {key}, or one value to fix it"
            cursor.faults.add(cursor.at(end).fault(problem, remedy=remedy, grade=GAP))
    cursor.faults.tell()
    return Bound(ends["min"], ends["max"], free is True, _unit(raw["min"]))


def limits(cursor: Cursor, schema: SceneSchema, active: Collection[Effect]) -> dict[str, LimitRange]:
    """Limits by figure from the table [limits]."""
    faults, inner = cursor.faults, dict[str, Cursor]()
    with faults:
        inner = label_entries(cursor, schema.figures)
    limitable = [name for name, figure in schema.figures.items() if figure.sides]
    for name, place in inner.items():
        if name in schema.figures and name not in limitable:
            problem, remedy = "this figure cannot be limited", "Limit another, or take it out"
            faults.add(place.fault(problem, allowed=", ".join(limitable), remedy=remedy, grade=NAME))
    cursor.check_keys([name for name in inner if name not in schema.figures], limitable, "figure to limit")
    on = {effect.name for effect in active}
    read = {}
    for name in (name for name in inner if name in limitable):
        with faults:
            givers = [giver for giver, effect in schema.effects.items() if name in _effect_figures(effect)]
            if givers and not on.intersection(givers):
                off = (
                    f"effect {givers[0]} is off: it" if len(givers) == 1 else f"effects {' and '.join(givers)} are off:"
                )
                problem = f"{off} gives {name}" if len(givers) == 1 else f"{off} each of them gives {name}"
                remedy = f"Put {' or '.join(givers)} on, or take the limit out"
                raise inner[name].fault(problem, remedy=remedy)
            read[name] = _limit(inner[name], schema.figures[name])
    return read


def _effect_figures(effect: Effect) -> Collection[str]:
    """Figures of an effect."""
    if isinstance(effect, Check):
        return {*effect.over_cycle, *effect.rows}
    return effect.rows if isinstance(effect, Speed) else ()


def _limit(cursor: Cursor, figure: Figure) -> LimitRange:
    """One limit of a figure. Raises BadInput."""
    raw, sides = cursor.raw, " and ".join(figure.sides)
    if not isinstance(raw, Mapping):
        raise cursor.fault("it is not a table", raw, f"a table with {sides}", f"Write a table with {sides}")
    if not raw:
        raise cursor.fault("the limit is empty", allowed=sides, remedy="Give a side, or take the limit out")
    cursor = cursor.apart()
    cursor.check_keys(raw, ("min", "max"))
    given = [side for side in raw if side in ("min", "max")]
    for side in given:
        if side not in figure.sides:
            problem, remedy = f"{figure.name} has no limit {side}", f"Limit its {sides}"
            cursor.faults.add(cursor.at(side).fault(problem, raw[side], sides, remedy))
    ends = _ends(cursor, [side for side in given if side in figure.sides], Quantity(figure.kind))
    cursor.faults.tell()
    return LimitRange(ends.get("min"), ends.get("max"), _unit(next(iter(raw.values()))))


def _ends(cursor: Cursor, given: Iterable[str], quantity: Quantity) -> dict[str, float]:
    """Given ends of a range, SI; adds a mistake if min is more than max."""
    ends = {}
    for end in given:
        with cursor.faults:
            ends[end] = cursor.at(end).number(quantity)
    if len(ends) == 2 and ends["min"] > ends["max"]:
        low, high = (shown(cursor.at(end).raw) for end in ("min", "max"))
        problem = f"min is more than max (min {low}, max {high})"
        cursor.faults.add(cursor.fault(problem, allowed="min <= max", remedy="Exchange or correct them"))
    return ends


def _unit(raw: object) -> str:
    """Unit of a value that has been read."""
    return unit_of(raw) if isinstance(raw, str) else "1"
