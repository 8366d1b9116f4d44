"""A scene: one loom job with its numbers, checked and in SI; every change of it is a new scene."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from loomopt import scene_tables as read
from loomopt.frozen import freeze
from loomopt.quantities import unit_of
from loomopt.scene_document import copied, looked_up, removed, replaced
from loomopt.scene_errors import clean, refusal, shown, unknown
from loomopt.scene_tables import Bound, Limit
from loomopt.schema import Job, Table
from loomopt.units import DISPLAY_UNIT, fits

TABLES = ("problem", "operation", "mechanism", "effects", "available", "bounds", "limits", "targets")


@dataclass(frozen=True)
class Scene:
    """One job with all its numbers, SI; whatever changes it returns a new scene or raises BadInput.

    document: the raw tables, never to be changed; origin: the file they came from.
    operation, mechanism: numbers given or defaulted; effects: those that are on, in the order of the job.
    bounds: by name of number; limits: by name of figure; targets: every target of the job.
    """

    document: Mapping[str, Any] = field(repr=False)
    origin: str
    job: Job = field(repr=False)
    name: str
    title: str
    source: str = field(repr=False)
    operation: Mapping[str, float]
    mechanism: Mapping[str, float]
    effects: Mapping[str, Table]
    bounds: Mapping[str, Bound]
    limits: Mapping[str, Limit]
    targets: Mapping[str, Table] = field(repr=False)

    def __post_init__(self) -> None:
        """Freeze what a frozen dataclass would leave open."""
        freeze(self, "operation", "mechanism", "effects", "bounds", "limits", "targets")

    def given(self, key: str) -> str | None:
        """Return the raw text of a dotted key such as "mechanism.l1"; None for a table or nothing."""
        value = looked_up(self.document, key.split("."))
        if value is None or isinstance(value, Mapping):
            return None
        return value if isinstance(value, str) else shown(value)

    def unit(self, name: str, kind: str) -> str:
        """Return the unit in which a variable or figure is shown: as the scene writes it, else its kind's."""
        places = [
            ("mechanism", name),
            ("operation", name),
            *(("effects", effect, name) for effect in self.effects),
        ]
        places += [(table, name, *end) for table in ("bounds", "limits") for end in ((), ("min",), ("max",))]
        for place in places:
            text = looked_up(self.document, place)
            if isinstance(text, str) and fits(unit_of(text), kind):
                return unit_of(text)
        return DISPLAY_UNIT[kind]

    def set(self, key: str, value: object) -> "Scene":
        """Return the scene with one dotted key set, such as set("operation.M0", "800 N*m"): see `update`."""
        return self.update({key: value})

    def update(self, values: Mapping[str, object]) -> "Scene":
        """Return the scene with several dotted keys set at once.

        A key of an effect that is off puts it on, with the other values from [available]. A bound that is one
        value becomes a range once its min and max are set.
        """
        document = self.document
        for key, value in values.items():
            parts = self._path(key)
            table, inside = parts[0], looked_up(document, parts[:2])
            if table == "effects" and len(parts) > 2 and inside is None:
                document = _put_on(document, parts[1])
            if table == "bounds" and len(parts) > 2 and not isinstance(inside, Mapping):
                document = replaced(document, parts[:2], {}, self.origin, key)
            document = replaced(document, parts, value, self.origin, key)
        return self._rebuilt(document)

    def with_effect(self, name: str) -> "Scene":
        """Return the scene with an effect put on, its values from [available.NAME]."""
        self._demand_effect(name)
        if name in self.effects:
            return self
        fields = self.job.effects[name].own.model_fields
        keys = [f"effects.{name}.{key}" for key, info in fields.items() if info.is_required()]
        if keys and looked_up(self.document, ("available", name)) is None:
            remedy = f"Set {', '.join(keys)} instead, which puts it on, or add the table [available.{name}]"
            raise refusal(f"effect {name} has no values", self.origin, f"available.{name}", remedy=remedy)
        return self._rebuilt(_put_on(self.document, name))

    def without_effect(self, name: str) -> "Scene":
        """Return the scene with an effect taken off; its values stay in [available.NAME]."""
        self._demand_effect(name)
        if name not in self.effects:
            return self
        document = removed(self.document, "effects", name)
        own, key = self.document["effects"][name], f"available.{name}"
        return self._rebuilt(replaced(document, ("available", name), own, self.origin, key))

    def free(self, names: Iterable[str] | str) -> "Scene":
        """Return the scene with bounds freed that `free = false` holds at today's value; names: "J4, M0"."""
        named = names.replace(",", " ").split() if isinstance(names, str) else list(names)
        ranges = [name for name, bound in self.bounds.items() if bound.min < bound.max]
        groups = {group: [n for n in of if n in ranges] for group, of in self.job.groups.items()}
        asked = [each for name in named for each in groups.get(name) or [name]]
        for name in asked:
            if name not in ranges:
                single = [bound for bound in ranges if not self.bounds[bound].free]
                held = ", ".join([*(group for group, of in groups.items() if of), *single])
                allowed = held or "nothing: no bound has free = false"
                remedy = "Give it min and max in [bounds]"
                raise refusal(f"{name} cannot be freed", self.origin, f"bounds.{name}", allowed=allowed, remedy=remedy)
        return self.update({f"bounds.{name}.free": True for name in asked})

    @property
    def hash(self) -> str:
        """Twelve hex digits of all that decides an answer: the checked numbers, SI, no name or title."""
        import hashlib

        content = {
            "job": self.job.name,
            "operation": dict(self.operation),
            "mechanism": dict(self.mechanism),
            "effects": {name: own.model_dump() for name, own in self.effects.items()},
            "bounds": {name: (bound.min, bound.max, bound.free) for name, bound in self.bounds.items()},
            "limits": {name: (limit.min, limit.max) for name, limit in self.limits.items()},
            "targets": {name: own.model_dump(exclude={"expected"}) for name, own in self.targets.items()},
        }
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:12]

    def _path(self, key: str) -> list[str]:
        """Return the names of a dotted key."""
        parts = key.split(".")
        if all(parts) and (len(parts) > 1 or key in TABLES):
            return parts
        problem = f"unknown table {shown(key)}" if len(parts) == 1 else "a name in the key is empty"
        remedy = "Name the table and the key, such as operation.M0"
        raise refusal(problem, self.origin, key, allowed=", ".join(TABLES), remedy=remedy)

    def _rebuilt(self, document: Mapping[str, Any]) -> "Scene":
        return build(document, {self.job.name: self.job}, self.origin)

    def _demand_effect(self, name: str) -> None:
        if name not in self.job.effects:
            raise unknown("effect", name, self.job.effects, self.origin, "effects")


def _put_on(document: Mapping[str, Any], effect: str) -> Mapping[str, Any]:
    """Move an effect's table from [available] to [effects]."""
    own = looked_up(document, ("available", effect))
    on = replaced(document, ("effects", effect), {} if own is None else own, "", f"effects.{effect}")
    return on if own is None else removed(on, "available", effect)


def build(document: Mapping[str, Any], jobs: Mapping[str, Job], origin: str) -> Scene:
    """Return the scene that raw tables describe; jobs: those it may name; origin: file name, for messages.

    Raises BadInput for the first thing that is wrong.
    """
    original = copied(document, origin)
    for name in original:
        if name not in TABLES:
            raise unknown("table", name, TABLES, origin, name)
    raw: dict[str, Any] = {name: {} for name in TABLES} | original
    problem = read.problem(raw["problem"], jobs, origin)
    job = jobs[problem.job]
    tables = {
        "operation": read.checked(job.operation, raw["operation"], origin, "operation"),
        "mechanism": read.checked(job.mechanism, raw["mechanism"], origin, "mechanism"),
    }
    models = {name: effect.own for name, effect in job.effects.items()}
    effects = read.named(raw["effects"], models, "effect", origin, "effects")
    read.named(raw["available"], models, "effect", origin, "available")
    read.demand(job, tables, effects, origin)
    places = list(read.places(job, tables, effects))
    own_targets = {name: {} for name in job.targets} | dict(read.table(raw["targets"], origin, "targets"))
    targets = {name: target.own for name, target in job.targets.items()}
    scene = Scene(
        document=original,
        origin=clean(origin),
        job=job,
        name=problem.name,
        title=clean(" ".join(problem.title.split())),
        source=clean(" ".join(problem.source.split())),
        operation=_given(tables["operation"]),
        mechanism=_given(tables["mechanism"]),
        effects=effects,
        bounds=read.bounds(raw["bounds"], job, places, raw["available"], origin),
        limits=read.limits(raw["limits"], job, effects, origin),
        targets=read.named(own_targets, targets, "target", origin, "targets"),
    )
    job.check(scene)
    return scene


def _given(table: Table) -> dict[str, float]:
    """Return the values of a table that are given or defaulted."""
    return {name: value for name, value in table if value is not None}
