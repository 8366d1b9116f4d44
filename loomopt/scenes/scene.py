"""A scene: one loom job with its numbers, checked and in SI; every change of it is a new scene."""

import functools
import math
from collections.abc import Callable, Collection, Hashable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Protocol, TypeVar, cast

from loomopt.base import arguments
from loomopt.base.errors import MACHINE, SAME, BadInput, Faults, clean, nearest, refusal, shown, unknown
from loomopt.base.quantities import quantity_of
from loomopt.base.records import Frozen, Shown, freeze, lazy
from loomopt.base.units import show
from loomopt.physics.effects.kinds import Effect, Load, label, owned, required
from loomopt.physics.schema import Table
from loomopt.scenes import display, former_names, synonyms
from loomopt.scenes import tables as read
from loomopt.scenes.cursor import Cursor
from loomopt.scenes.document import Paths, copied, looked_up, removed, replaced
from loomopt.scenes.tables import Bound, JobNames, LimitRange, Place, SceneSchema

_Table = TypeVar("_Table", bound=Table)
_Made = TypeVar("_Made")

TABLES = (
    *("problem", "operation", "mechanism", "effects", "available", "bounds", "limits", "tolerances", "accept"),
    *("steps", "stock", "display", "targets"),
)

_KEY = "a dotted key", 'Write "operation.M0"'
_SI = "an SI unit", 'Write "N*m"'
_NAMES = "Name them in a list"
_MOST_DIGITS = 17
_DIGITS = f"1 to {_MOST_DIGITS}", "Give 6, or leave it out"


class Equation(Protocol):
    """Equation of a scene: its name, its plain text, and its LaTeX."""

    @property
    def name(self) -> str:
        """Name of the equation."""

    @property
    def text(self) -> str:
        """Equation as plain text."""

    @property
    def latex(self) -> str:
        """Equation in LaTeX."""

    def _repr_latex_(self) -> str:
        """LaTeX that Jupyter shows."""


class Jobs(JobNames, Protocol):
    """Jobs by name, as a scene uses them."""

    def schema(self, job: str, document: Mapping[str, Any], effects: Collection[str], /) -> SceneSchema:
        """Schema of a scene of a job, with the effects it names where a distribution brings them."""

    def check(self, scene: "Scene", /) -> None:
        """Raise BadInput if the job cannot compute today's machine."""

    def equations(self, scene: "Scene", /) -> tuple[Equation, ...]:
        """Equations that a scene really uses."""


@dataclass(frozen=True)
class Call:
    """Changes of a scene by a call: dotted keys set, effects put on, then off, bounds freed; target: as it names."""

    set: Mapping[str, Any] = field(default_factory=Frozen)
    on: tuple[str, ...] = ()
    off: tuple[str, ...] = ()
    free: tuple[str, ...] = ()
    target: str | None = None

    @property
    def changes(self) -> list[str]:
        """Sentences on the changes."""
        changes = [*(f"{name} on" for name in self.on), *(f"{name} off" for name in self.off)]
        changes += [f"{key} = {value if isinstance(value, str) else shown(value)}" for key, value in self.set.items()]
        return changes + [f"{name} free" for name in self.free]

    def then(self, later: "Call") -> "Call":
        """Call that has the same result as this one followed by a later one."""
        earlier = {key: value for key, value in self.set.items() if key not in later.set}
        off = tuple(name for name in self.off if name not in later.on and not later.sets(f"effects.{name}"))
        free = tuple(name for name in self.free if not {f"bounds.{name}", f"bounds.{name}.free"} & set(later.set))
        return Call(
            Frozen({**earlier, **later.set}),
            _unique(*(name for name in self.on if name not in later.off), *later.on),
            _unique(*off, *later.off),
            _unique(*free, *later.free),
            later.target or self.target,
        )

    def sets(self, key: str) -> bool:
        """Whether it sets a dotted key, or one inside it."""
        return any(f"{name}.".startswith(f"{key}.") for name in self.set)

    def as_dict(self) -> dict[str, Any]:
        """JSON data."""
        switches = {"with": list(self.on), "without": list(self.off), "free": list(self.free), "target": self.target}
        return {"set": copied(self.set, ""), **switches}


def _unique(*names: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(names))


@dataclass(frozen=True, repr=False)
class Scene(Shown):
    """Job with all its numbers, SI. Every change returns a new scene or raises BadInput.

    document: the raw tables, never to be changed; origin: the file they came from; schema: what its job declares.
    operation, mechanism: numbers given or defaulted; tables: both as their models, words and lists too.
    effects: tables of those that are on, in the order of the job, by name; active: the effects themselves.
    bounds: by label of number; limits: by name of figure; targets: every target of the job.
    paths: where the files lie that it names. call: what was changed since it was read.
    """

    document: Mapping[str, Any]
    origin: str
    schema: SceneSchema
    jobs: Jobs = field(compare=False)
    name: str
    title: str
    source: str
    operation: Mapping[str, float]
    mechanism: Mapping[str, float]
    tables: Mapping[str, Table]
    effects: Mapping[str, Table]
    active: tuple[Effect, ...]
    bounds: Mapping[str, Bound]
    limits: Mapping[str, LimitRange]
    targets: Mapping[str, Table]
    paths: Paths = field(compare=False)
    call: Call = field(default_factory=Call, compare=False)

    def __post_init__(self) -> None:
        """Freeze the mappings of the dataclass."""
        freeze(self, "operation", "mechanism", "tables", "effects", "bounds", "limits", "targets")

    def __reduce__(self) -> tuple[Callable[..., "Scene"], tuple[Mapping[str, Any], Jobs, str, Paths, Call]]:
        """Constructor and tables for pickle: formulas cannot be pickled."""
        return build, (self.document, self.jobs, self.origin, self.paths, self.call)

    def __repr__(self) -> str:
        on = ", ".join(self.effects) or "none"
        return f"<Scene {self.name}: {self.title} (job {self.job}; effects {on})>"

    @property
    def job(self) -> str:
        """The name of its job."""
        return self.schema.name

    def effect_table(self, model: type[_Table]) -> _Table | None:
        """Table of an active effect.

        Parameters
        ----------
        model : class of the effect's values.

        Returns
        -------
        Table; None where the effect is off.
        """
        return next((table for table in self.effects.values() if isinstance(table, model)), None)

    @lazy
    def _cache(self) -> dict[Hashable, object]:
        """Objects that were made from the scene, by key."""
        return {}

    @lazy
    def _files(self) -> list[str]:
        """Files that were read for it by now: they may change, where it does not."""
        return []

    def table(self, model: type[_Table]) -> _Table:
        """Table [operation], [mechanism] or that of a target.

        Parameters
        ----------
        model : class of the table's values.

        Returns
        -------
        Table.
        """
        return next(table for table in (*self.tables.values(), *self.targets.values()) if isinstance(table, model))

    def full(self, name: str) -> str:
        """Full name of a number by the designer's name.

        Parameters
        ----------
        name : such as "J4".

        Returns
        -------
        Full name, of the first given number where several active effects have one of this name; any other name is
        returned as it is.

        Examples
        --------
        >>> import loomopt as lo
        >>> lo.load("beatup").full("J4")
        'inertia.J4'
        """
        arguments.text(name, "name", "the name of a number", 'Write "l1"')
        if name in self.mechanism or name in self.operation:
            return name
        tables = [(effect, self.effects[effect.name]) for effect in self.active]
        called = [(e, key, table) for e, table in tables for key in e.table.model_fields if label(e, key) == name]
        called.sort(key=lambda entry: getattr(entry[2], entry[1]) is None)
        return owned(*called[0][:2]) if called else name

    def given(self, key: str) -> str | None:
        """Text of a number in the scene.

        Parameters
        ----------
        key : dotted key, such as "mechanism.l1".

        Returns
        -------
        Text as it is written; None for a table, or where the key is not set.

        Examples
        --------
        >>> import loomopt as lo
        >>> lo.load("beatup").given("operation.M0")
        '745 N*m'
        """
        name = synonyms.current_key(arguments.text(key, "key", *_KEY), self.schema.synonyms, self.document)
        value = looked_up(self.document, name.split("."))
        if value is None or isinstance(value, Mapping):
            return None
        return value if isinstance(value, str) else shown(value)

    @lazy
    def units(self) -> Mapping[str, str]:
        """Kind of quantity → the unit in which a person sees it: of [display], else as written, else composed."""
        return display.units(self.document, self.schema, self.active, (self.bounds, self.limits))

    def shown_in(self, kind: str) -> str:
        """Unit in which a person reads quantities of a kind.

        Parameters
        ----------
        kind : such as "length".

        Returns
        -------
        Unit.

        Raises
        ------
        BadInput : the kind is unknown.
        """
        return self.units[self._kind_of_quantity(kind)]

    def _kind_of_quantity(self, kind: str) -> str:
        """Known kind of quantity. Raises BadInput for an unknown one."""
        if not isinstance(kind, str) or kind not in self.units:
            allowed = ", ".join(self.units)
            raise refusal("unknown kind of quantity", "", "kind", kind, allowed, "Choose one of them")
        return kind

    def unit_for(self, si: str) -> str:
        """Display unit for an SI unit.

        Parameters
        ----------
        si : SI unit, such as "m/rad".

        Returns
        -------
        Unit.

        Raises
        ------
        BadInput : it is not text.
        """
        return display.unit_for(arguments.text(si, "si", *_SI), self.units)

    def show(self, value: float, kind: str, digits: int = 6) -> str:
        """SI value as text, with the unit in which a person reads its kind.

        Parameters
        ----------
        value : SI value.
        kind : kind of quantity, such as "length".
        digits : number of significant digits.

        Returns
        -------
        Number and unit.

        Raises
        ------
        BadInput : the kind or the number of digits is invalid.

        Examples
        --------
        >>> import loomopt as lo
        >>> lo.load("beatup").show(0.031, "length")
        '31 mm'
        """
        arguments.number(value, "value", "a number in SI", "Give a number")
        if not 1 <= arguments.whole(digits, "digits", *_DIGITS) <= _MOST_DIGITS:
            raise refusal("the number of digits is invalid", "", "digits", digits, *_DIGITS)
        return show(value, self.shown_in(kind), digits)

    def set(self, key: str, value: object) -> "Scene":
        """Scene with one number or word changed.

        See also `update`.

        Parameters
        ----------
        key : dotted key, such as "operation.M0".
        value : its value; a quantity is text with its unit.

        Returns
        -------
        New scene.

        Raises
        ------
        BadInput : the key or the value is invalid.

        Examples
        --------
        >>> import loomopt as lo
        >>> lo.load("beatup").set("operation.M0", "800 N*m").given("operation.M0")
        '800 N*m'
        """
        return self.update({arguments.text(key, "key", *_KEY): value})

    def update(self, values: Mapping[str, object]) -> "Scene":
        """Scene with several numbers or words changed at once.

        A key of an effect that is off puts the effect on, with its other values from [available]. A bound that is one
        value becomes a range once its min and max are set.

        Parameters
        ----------
        values : value of each dotted key.

        Returns
        -------
        New scene.

        Raises
        ------
        BadInput : a key or a value is invalid.

        Examples
        --------
        >>> import loomopt as lo
        >>> scene = lo.load("beatup").update({"bounds.l1.min": "31 mm", "operation.M0": "800 N*m"})
        >>> scene.bounds["l1"].min
        0.031
        """
        return self.change(values)

    def change(self, values: Mapping[str, object], on: Iterable[str] = (), off: Iterable[str] = ()) -> "Scene":
        """Scene with keys set, then effects put on, then effects taken off.

        Parameters
        ----------
        values : value of each dotted key.
        on : names of effects.
        off : names of effects.

        Returns
        -------
        New scene.

        Raises
        ------
        BadInput : the resulting scene is invalid; scenes between the steps may be.
        """
        values = arguments.table(values, "values", "key of the scene → its value", 'Write {"operation.M0": "800 N*m"}')
        on, off = (arguments.names(names, "effects", ", ".join(self.schema.effects), _NAMES) for names in (on, off))
        changed = self.called(Call(values, tuple(on), tuple(off)), values)
        return self if changed.document is self.document else changed

    def called(self, call: Call, caller_keys: Iterable[str] = ()) -> "Scene":
        """Scene with the changes of a call.

        Parameters
        ----------
        call : changes of the call.
        caller_keys : keys whose paths are the caller's, not the scene's.

        Returns
        -------
        New scene.

        Raises
        ------
        BadInput : a change is invalid.
        """
        keys = {key: former_names.current_key(key, self.schema.former_names) for key in call.set}
        by_key = {keys[key]: value for key, value in copied(call.set, self.origin).items()}
        values = Frozen(synonyms.current_values(by_key, self.schema.synonyms, self.document, self.origin))
        document = self._off(self._on(self._set(values), call.on), call.off)
        new_call = self.call.then(replace(call, set=values, free=()))
        if document is not self.document:
            changed = _build_scene(
                document, self.jobs, self.origin, self.paths.set_by_caller(caller_keys), new_call, self
            )
        else:
            changed = self if new_call == self.call else replace(self, call=new_call)
        return changed.free(call.free) if call.free else changed

    def _set(self, values: Mapping[str, object]) -> Mapping[str, Any]:
        document, faults = self.document, Faults()
        for key, value in values.items():
            with faults:
                document = self._with_key(document, key, value, values)
        faults.tell()
        return document

    def _with_key(
        self, document: Mapping[str, Any], key: str, value: object, values: Mapping[str, object]
    ) -> Mapping[str, Any]:
        parts = self._path(key)
        effect = self.schema.effects.get(parts[1]) if parts[0] == "effects" and len(parts) > 1 else None
        table_path = parts[: 3 if effect and effect.many else 2]
        inside = looked_up(document, table_path)
        if parts[0] == "effects" and len(parts) > len(table_path) and inside is None:
            document = _put_on(document, *table_path[1:])
        if parts[0] == "bounds" and len(parts) > 2 and not isinstance(inside, Mapping):
            document = replaced(document, table_path, {}, self.origin, key)
        document = replaced(document, parts, value, self.origin, key)
        for rival_key in _replaced_keys(effect, parts[len(table_path) :]):
            # A curve takes the place of numbers, and they that of a curve, but for what is set in the same call.
            place = [*table_path, rival_key]
            if looked_up(document, place) is not None and ".".join(place) not in values:
                document = removed(document, place)
        return document

    def with_effect(self, *names: str) -> "Scene":
        """Scene with effects put on together.

        Parameters
        ----------
        *names : names of effects; their values are those of [available.NAME].

        Returns
        -------
        New scene.

        Raises
        ------
        BadInput : an effect is unknown, has no values, or cannot be combined with another.

        Examples
        --------
        >>> import loomopt as lo
        >>> "gravity" in lo.load("beatup").with_effect("gravity").effects
        True
        """
        return self.change({}, on=names)

    def _on(self, document: Mapping[str, Any], names: Iterable[str]) -> Mapping[str, Any]:
        for name in names:
            parts = self._effect_path(name)
            if looked_up(document, ("effects", *parts)) is None:
                self._demand_values(document, name, parts)
                document = _put_on(document, *parts)
        return document

    def _demand_values(self, document: Mapping[str, Any], name: str, parts: list[str]) -> None:
        """Raise BadInput for an effect that is off and has no table in [available]."""
        keys = [f"effects.{name}.{key}" for key in required(self._effect(name))]
        if keys and looked_up(document, ("available", *parts)) is None:
            remedy = f"Set {', '.join(keys)} instead, which puts it on, or add the table [available.{name}]"
            raise refusal(f"effect {name} has no values", self.origin, f"available.{name}", remedy=remedy)

    def without_effect(self, *names: str) -> "Scene":
        """Scene with effects taken off together.

        Parameters
        ----------
        *names : names of effects; their values stay in [available.NAME].

        Returns
        -------
        New scene.

        Raises
        ------
        BadInput : an effect is unknown, or another needs it.

        Examples
        --------
        >>> import loomopt as lo
        >>> "resistance" in lo.load("beatup").without_effect("resistance").effects
        False
        """
        return self.change({}, off=names)

    def _off(self, document: Mapping[str, Any], names: Iterable[str]) -> Mapping[str, Any]:
        for name, parts in [(name, self._effect_path(name)) for name in names]:
            values = looked_up(document, ("effects", *parts))
            if values is not None:
                document = removed(document, ("effects", *parts))
                document = replaced(document, ("available", *parts), values, self.origin, f"available.{name}")
        return document

    def free(self, names: Iterable[str] | str) -> "Scene":
        """Scene with bounds freed that `free = false` fixes at today's value.

        Parameters
        ----------
        names : names of bounds, as a list or as text such as "J4, M0".

        Returns
        -------
        New scene.

        Raises
        ------
        BadInput : a name is not that of a bound with two ends.
        """
        single = names.replace(",", " ").split() if isinstance(names, str) else names
        named = arguments.names(single, "names", "names of bounds", 'Write ["J4"]')
        ranges = [name for name, bound in self.bounds.items() if bound.min < bound.max]
        groups = {group: [n for n in of if n in ranges] for group, of in self.schema.groups.items()}
        free_names = [member for name in named for member in groups.get(name) or [name]]
        for name in free_names:
            if name not in ranges:
                single = [bound for bound in ranges if not self.bounds[bound].free]
                choices = ", ".join(dict.fromkeys([*(group for group, of in groups.items() if of), *single]))
                allowed = choices or "nothing: no bound has free = false"
                near = nearest(name, [*ranges, *(group for group, of in groups.items() if of)], least=SAME)
                remedy = f'Perhaps "{near}" is meant' if near else "Give it min and max in [bounds]"
                raise refusal(f"{name} cannot be freed", self.origin, f"bounds.{name}", allowed=allowed, remedy=remedy)
        document = self._set({f"bounds.{name}.free": True for name in free_names})
        return build(document, self.jobs, self.origin, self.paths, self.call.then(Call(free=tuple(named))))

    def without_limit(self, name: str, sides: Iterable[str]) -> "Scene":
        """Scene without sides of a limit.

        Parameters
        ----------
        name : name of a limit of the scene.
        sides : "min", "max" or both.

        Returns
        -------
        New scene.
        """
        place = "limits", *former_names.current(name, self.schema.former_names).split(".")
        limit = looked_up(self.document, place)
        left = set(limit) - set(sides) if isinstance(limit, Mapping) else set()
        document: Mapping[str, Any] = self.document
        for gone in [(*place, side) for side in sides] if left else [place]:
            document = removed(document, gone)
        return build(document, self.jobs, self.origin, self.paths, self.call)

    def equations(self) -> tuple[Equation, ...]:
        """Equations the scene really uses: `name`, `text` and `latex` of each, which Jupyter shows."""
        return self.jobs.equations(self)

    @property
    def hash(self) -> str:
        """Twelve hex digits of all that decides an answer: the checked numbers, SI, no name or title."""
        import hashlib
        import json

        content = {
            "job": self.job,
            "operation": self.tables["operation"].model_dump(exclude_none=True),
            "mechanism": self.tables["mechanism"].model_dump(exclude_none=True),
            "effects": {
                effect.name: table.model_dump(exclude_none=True)
                for effect, table in zip(self.active, self.effects.values(), strict=True)
            },
            "bounds": {name: (bound.min, bound.max, bound.free) for name, bound in self.bounds.items()},
            "limits": {name: (limit.min, limit.max) for name, limit in self.limits.items()},
            "targets": {name: _decisive_values(table) for name, table in self.targets.items()},
            **{name: self.document.get(name, {}) for name in self.schema.tables},
        }
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:12]

    def _path(self, key: str) -> list[str]:
        """Names of a dotted key."""
        parts = key.split(".")
        known = (*TABLES, *self.schema.tables)
        if all(parts) and (len(parts) > 1 or key in known):
            return parts
        problem = f"unknown table {shown(key)}" if len(parts) == 1 else "a name in the key is empty"
        meant = " or ".join(self._keys_of(key)) if len(parts) == 1 else ""
        remedy = f"Name the table too: {meant}" if meant else "Name the table and the key, such as operation.M0"
        raise refusal(problem, self.origin, key, allowed=", ".join(known), remedy=remedy)

    def _keys_of(self, name: str) -> list[str]:
        """Dotted keys that a designer's name may mean."""
        schema = self.schema
        known: dict[str, Iterable[str]] = {
            "operation": schema.operation.model_fields,
            "mechanism": schema.mechanism.model_fields,
            **{f"effects.{e.name}": e.table.model_fields for e in schema.effects.values() if not e.many},
            "bounds": {*schema.variables, *self.bounds},
        }
        sides = {figure.name: figure.sides for figure in schema.figures.values()}
        near = nearest(name, [*(key for names in known.values() for key in names), *sides], least=SAME)
        keys = [f"{table}.{near}" for table, names in known.items() if near in names]
        return keys or [f"limits.{near}.{side}" for side in sides.get(near, ())]

    def _effect(self, name: str) -> Effect:
        """Declared effect; for an instance, its kind."""
        return self.jobs.schema(self.job, self.document, (self._kind(name),)).effects[self._kind(name)]

    def _kind(self, name: str) -> str:
        """Kind of an effect as the command names it: "mass" of "mass.rod"."""
        return name.split(".")[0]

    def _effect_path(self, name: str) -> list[str]:
        """Path of an effect's table inside [effects]; raises BadInput for one that is not declared."""
        known = self.jobs.schema(self.job, self.document, (self._kind(name),)).effects
        if self._kind(name) not in known:
            raise unknown("effect", name, known, self.origin, "effects")
        return name.split(".")


def _replaced_keys(effect: Effect | None, key: list[str]) -> tuple[str, ...]:
    """Keys of an effect's table that a set key replaces."""
    curve = effect.tabulated if isinstance(effect, Load) else None
    if curve is None or len(key) != 1:
        return ()
    return curve.instead if key[0] == curve.key else (curve.key,) if key[0] in curve.instead else ()


def _decisive_values(table: Table) -> dict[str, Any]:
    """Values of a target's table that decide an answer; an indifference and digits only where they are given."""
    return table.model_dump(exclude={"expected"} | ({"indifference", "digits"} - table.model_fields_set))


def _put_on(document: Mapping[str, Any], *effect: str) -> Mapping[str, Any]:
    """Move an effect's table from [available] to [effects]."""
    table = looked_up(document, ("available", *effect))
    on = replaced(document, ("effects", *effect), {} if table is None else table, "", f"effects.{'.'.join(effect)}")
    return on if table is None else removed(on, ("available", *effect))


def build(
    document: Mapping[str, Any], jobs: Jobs, origin: str, paths: Paths | None = None, call: Call | None = None
) -> Scene:
    """Scene that raw tables describe; jobs: those it may name; origin: file name, for messages.

    paths: where the files lie that it names; without, they are the caller's own. call: what made these tables of those
    that were read. Raises BadInput that names all that is wrong, the worst first.
    """
    return _build_scene(copied(document, origin), jobs, origin, paths, call)


def _build_scene(
    original: Mapping[str, Any],
    jobs: Jobs,
    origin: str,
    paths: Paths | None = None,
    call: Call | None = None,
    before: Scene | None = None,
) -> Scene:
    """Scene of raw tables, which no other code changes.

    before: a scene whose tables are read again where these are not the very same.
    """
    faults = Faults(origin)
    raw = _raw_tables(original, TABLES)
    problem = read.problem(Cursor(raw["problem"], "problem", faults), jobs)
    named = [name for table in ("effects", "available") if isinstance(raw[table], Mapping) for name in raw[table]]
    try:
        schema = jobs.schema(problem.job, original, named)
        current = former_names.current_document(original, schema.former_names, origin)
        current = synonyms.current_document(current, schema.synonyms, origin)
        if current is not original:
            original, schema = current, jobs.schema(problem.job, current, named)
    except BadInput as error:
        faults.add(error.placed(origin, original))
        raise faults.error() from None
    known = (*TABLES, *schema.tables)
    raw = _raw_tables(original, known)
    top = Cursor(raw, "", faults)
    top.check_keys(original, known, "table")
    last = before if before is not None and before.schema is schema else None

    def stays(*names: str) -> bool:
        return last is not None and all(original.get(name) is last.document.get(name) for name in names)

    tables = {
        name: last.tables[name] if last and stays(name) else top.at(name).record(model)
        for name, model in (("operation", schema.operation), ("mechanism", schema.mechanism))
    }
    if last and stays("effects"):
        active = dict(zip(last.active, last.effects.values(), strict=True))
    else:
        active = read.effects(top.at("effects"), schema)

    @functools.cache
    def available() -> dict[Effect, Table]:
        return read.effects(top.at("available"), schema)

    if not stays("available"):
        available()
    same_keys = last is not None and _keys(tables) == _keys(last.tables)
    if not (same_keys and stays("effects")):
        read.check_needs(top, schema, tables, active)

    def known_places() -> list[Place]:
        return list(read.places(schema, tables, active, available()))

    targets = {name: target.table for name, target in schema.targets.items()}
    if isinstance(raw["targets"], Mapping):
        raw["targets"] = {**{name: {} for name in targets}, **raw["targets"]}
    display.read(top.at("display"))
    scene = Scene(
        document=original,
        origin=clean(origin),
        schema=schema,
        jobs=jobs,
        name=problem.name,
        title=clean(" ".join(str(problem.title).split())),
        source=clean(" ".join(str(problem.source).split())),
        operation=_numbers(tables["operation"]),
        mechanism=_numbers(tables["mechanism"]),
        tables=tables,
        effects={effect.name: table for effect, table in active.items()},
        active=tuple(active),
        bounds=last.bounds
        if last and same_keys and stays("bounds", "effects", "available")
        else read.bounds(top.at("bounds"), schema, known_places()),
        limits=last.limits if last and stays("limits", "effects") else read.limits(top.at("limits"), schema, active),
        targets=last.targets if last and stays("targets") else read.records(top.at("targets"), targets, "target"),
        paths=paths or Paths(),
        call=call or Call(),
    )
    if raw["tolerances"] or raw["accept"]:
        from loomopt.scenes import tolerances

        tolerances.read(top.at("tolerances"), schema, known_places())
        tolerances.bands(top.at("accept"), schema)
    if raw["steps"] or raw["stock"]:
        from loomopt.scenes import sizes

        sizes.read(top, schema, known_places())
    if _is_checkable(scene, faults):
        try:
            jobs.check(scene)
        except BadInput as error:
            for fault in error.faults:
                fault.grade = MACHINE
                faults.add(fault)
    faults.tell()
    return scene


def _raw_tables(original: Mapping[str, Any], known: Collection[str]) -> dict[str, Any]:
    """Raw tables, including empty ones; a table with an unknown name is read as a missing one with a similar name."""
    raw: dict[str, Any] = {name: {} for name in known} | dict(original)
    for name in original:
        if name not in known:
            near = nearest(name, known, original, SAME)
            raw |= {near: original[name]} if near not in original else {}
    return raw


def _is_checkable(scene: Scene, faults: Faults) -> bool:
    """Whether today's machine can be checked: no number that it needs is wrong."""
    mechanism = scene.tables["mechanism"]
    wrong = [name for name, value in mechanism if value != value]
    optional = [
        name
        for name in wrong
        if quantity_of(type(mechanism), name) and not type(mechanism).model_fields[name].is_required()
    ]
    lacking = [
        key
        for key, others in scene.schema.instead.items()
        if getattr(mechanism, key) is None and not {*others} <= scene.mechanism.keys()
    ]
    return wrong == optional and not lacking and not faults.within("operation", "effects", "targets")


def given(table: Table) -> dict[str, Any]:
    """Values of a table that are given or defaulted, words and lists too."""
    return {name: value for name, value in table if value is not None}


def _keys(tables: Mapping[str, Table]) -> list[str]:
    """Keys of tables that are given or defaulted, those of tables inside them too."""
    keys = []
    for name, table in tables.items():
        inner = {key: value for key, value in table if isinstance(value, Table)}
        keys += [f"{name}.{key}" for key in (*given(table), *_keys(inner))]
    return keys


def _numbers(table: Table) -> dict[str, float]:
    """Numbers of a table that are given or defaulted; of a table inside it as "table.key"."""
    numbers = {name: value for name, value in table if isinstance(value, float) and not math.isnan(value)}
    for name, inner in table:
        numbers |= (
            {f"{name}.{key}": value for key, value in _numbers(inner).items()} if isinstance(inner, Table) else {}
        )
    return numbers


def cached(scene: Scene, key: Hashable, make: Callable[[], _Made]) -> _Made:
    """Object made from a scene and stored with it by a key: once, unless files are read for the scene."""
    if key in scene._cache:
        return cast(_Made, scene._cache[key])
    value = make()
    if not scene._files:
        scene._cache[key] = value
    return value


def reads(scene: Scene, file: str) -> None:
    """Note that a file is read for a scene."""
    scene._files.append(file)


def cursor(scene: Scene) -> Cursor:
    """Cursor on the tables of a scene, including empty ones, to read values that the scene does not store."""
    return Cursor({name: {} for name in TABLES} | dict(scene.document), "", Faults(scene.origin))


def places(scene: Scene) -> list[Place]:
    """Places of the numbers of a scene, those of effects that are off left out of account."""
    on = dict(zip(scene.active, scene.effects.values(), strict=True))
    return list(read.places(scene.schema, scene.tables, on, {}))
