"""Reader of designs: JSON of a `design`, in SI or with units, or of a whole answer with its scene."""

import math
import re
import sys
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from loomopt.base.errors import BadInput, Faults, clean, refusal, shown
from loomopt.base.quantities import Quantity, described, quantities_of, quantity_of
from loomopt.base.records import Frozen
from loomopt.base.units import DISPLAY_UNIT, SI_UNIT, show
from loomopt.physics.effects.kinds import Check, label
from loomopt.scenes.cursor import LARGEST_FILE, Cursor
from loomopt.scenes.document import Paths, copied, looked_up
from loomopt.scenes.scene import Call, Jobs, Scene, build

LONGEST = 1000
"""Numbers in a list."""
LARGEST = 1e60
"""SI; fourth powers of it are still numbers."""
OUTGROWN = 10.0
"""Factor on a machine's longest length above which a bare number is not in metres: one in mm differs by 1000."""
MEANT = {"length": "metres", "angle": "radians"}
"""Unit that a user may mean by a bare number, by kind of quantity."""
Design = Mapping[str, float | Sequence[float]]
"""A design by label, SI and rad; parts of it may be lists of numbers."""
Given = Mapping[str, float | str | Sequence[float | str]]
"""A design as it is given: numbers, or text with units."""
_ALLOWED = "a finite number in SI units, not negative"
_PLACE = re.compile("0|[1-9][0-9]{0,2}")
_GIVE = "Give an answer's design, or a part of it"
_GIVE_FILE = "Give the JSON that `loomopt solve --json` prints, or its design object"


def read(path: Path, scene: Scene) -> dict[str, float]:
    """Design in a JSON file, SI and rad, by design variable. Raises BadInput."""
    return checked(read_given(path).design, scene, named(path))


def named(path: Path) -> str:
    """Name of the file of a design in messages."""
    return "standard input" if str(path) == PIPE else clean(str(path))


def loaded(path: Path) -> object:
    """Unchecked contents of a JSON file of a design or an answer; `-` is the pipe. Raises BadInput."""
    import json

    origin = named(path)
    try:
        raw = _pipe_bytes() if str(path) == PIPE else Cursor(None, "", Faults(origin)).content(path, "design")
        if len(raw) > LARGEST_FILE:
            raise refusal("the file is too large for a design", origin, allowed="up to 1 MB", remedy=_GIVE_FILE)
        contents: object = json.loads(
            raw.decode("utf-8-sig"), object_pairs_hook=lambda pairs: _unique_entries(pairs, origin)
        )
    except BadInput:
        raise
    except (ValueError, RecursionError):
        raise refusal("the file is not JSON", origin, remedy=_GIVE_FILE) from None
    return contents


def _pipe_bytes() -> bytes:
    """Bytes of a pipe, at most one above the limit. Raises BadInput for an empty pipe."""
    raw = b"" if sys.stdin is None else sys.stdin.buffer.read(LARGEST_FILE + 1)
    if not raw.strip():
        remedy = "Pipe an answer in: loomopt solve PROBLEM --json | loomopt evaluate PROBLEM --design -"
        raise refusal("nothing came through the pipe", named(Path(PIPE)), remedy=remedy)
    return raw


def _unique_entries(pairs: Sequence[tuple[str, object]], origin: str) -> dict[str, object]:
    """Entries of a JSON object. Raises BadInput where a name comes twice."""
    entries: dict[str, object] = {}
    for name, value in pairs:
        if name in entries:
            raise refusal("a name occurs twice in one object", origin, name, remedy="Take out all but one")
        entries[name] = value
    return entries


def packed(design: Mapping[str, float], names: Iterable[str]) -> dict[str, float | Sequence[float]]:
    """A design with NAME_0, NAME_1 ... of each named list as one tuple."""
    numbers: dict[str, float | Sequence[float]] = dict(design)
    for name in names:
        members = {k: key for key in design if (k := _place(key, name)) is not None}
        if members:
            numbers = {key: value for key, value in numbers.items() if key not in members.values()}
            numbers[name] = tuple(design[members[k]] for k in sorted(members))
    return numbers


def flat(design: Design) -> dict[str, float]:
    """Design with the numbers of lists under separate names, NAME_0, NAME_1 ..."""
    numbers: dict[str, float] = {}
    for name, value in design.items():
        numbers |= {name: value} if isinstance(value, float | int) else {f"{name}_{k}": v for k, v in enumerate(value)}
    return numbers


def in_list(key: str, lists: Collection[str]) -> bool:
    """Whether a number of a flat design is one of a list's."""
    return any(_place(key, name) is not None for name in lists)


def _place(key: str, name: str) -> int | None:
    number = key.removeprefix(f"{name}_")
    return int(number) if number != key and _PLACE.fullmatch(number) else None


def checked(data: object, scene: Scene, origin: str = "<design>") -> dict[str, float]:
    """A design given as a mapping, SI and rad, after checking names, numbers and assembly. Raises BadInput.

    A number in it is SI; text is a number with its unit.
    """
    kinds = _numbers(scene)
    lists = {name: Quantity(kind) for name, kind in scene.schema.lists.items()}
    if not isinstance(data, Mapping) or not data:
        known = ", ".join(scene.schema.variables)
        raise refusal("there is no design", origin, allowed=f"an object of {known}, SI", remedy=_GIVE)
    whole = Cursor(data, "design", Faults(origin))
    data = {str(name): value for name, value in data.items() if name not in lists} | _list_numbers(whole, lists)
    design = {}
    for name, place in whole.entries(data).items():
        listed = next((lists[of] for of in lists if _place(name, of) is not None), None)
        if listed:
            kinds[name] = listed
        of, member, _ = name.partition("[")
        if member and of in kinds:
            problem = f"{of} belongs to one member of a family, and one machine is needed"
            remedy = "Give members[0].design of the answer, or another's, with that member's numbers set"
            raise place.fault(problem, remedy=remedy)
        if name not in kinds:
            raise place.unknown("design variable", name, [*kinds, *lists])
        design[name] = _number(place, kinds[name])
        if not isinstance(place.raw, str) and abs(design[name]) > _largest(scene, name, kinds[name].kind):
            raise _other_unit(place, scene, kinds[name].kind, design[name])
    for of in lists:
        places = sorted(k for name in design if (k := _place(name, of)) is not None)
        if places != list(range(len(places))):
            remedy = f"Give all from {of}_0 on, or {of} as a list"
            raise whole.at(of).fault(f"numbers of {of} are missing", remedy=remedy)
    fault = scene.schema.fault({**scene.mechanism, **design}, scene.show)
    if fault:
        remedy = "Correct its lengths; numbers without a unit are metres and radians"
        raise whole.fault(f"the design does not assemble: {fault}", remedy=remedy)
    for effect, table in zip(scene.active, scene.effects.values(), strict=True):
        numbers = {key: design.get(label(effect, key), value) for key, value in table}
        fault = effect.fault(numbers) if isinstance(effect, Check) else ""
        if fault:
            remedy = "Correct its lengths; numbers without a unit are metres"
            raise whole.fault(f"the {effect.name} cannot be made: {fault}", remedy=remedy)
    return design


def _number(cursor: Cursor, quantity: Quantity) -> float:
    """One number of a design, SI. Raises BadInput."""
    value = cursor.raw
    if isinstance(value, str):
        return cursor.number(quantity)
    allowed = f"{_ALLOWED}, or {described(quantity.kind)}"
    if not isinstance(value, bool) and isinstance(value, int | float) and abs(value) < LARGEST:
        if _fits(quantity, value):
            return float(value)
        allowed = f"{_ALLOWED}; {quantity.range}"
    raise cursor.fault("the value is out of range", value, allowed, "Correct the number")


def _largest(scene: Scene, name: str, kind: str) -> float:
    """Largest number without a unit that is read as SI; a larger one is in another unit."""
    if kind not in MEANT:
        return LARGEST
    quantities = quantities_of(scene.schema.mechanism)
    sizes = [abs(scene.mechanism[key]) for key in scene.mechanism if quantities[key].kind == kind]
    known = 2 * math.pi if kind == "angle" else OUTGROWN * max(sizes, default=LARGEST)
    bound = scene.bounds.get(name)
    return max(known, abs(bound.min), abs(bound.max)) if bound else known


def _other_unit(cursor: Cursor, scene: Scene, kind: str, value: float) -> BadInput:
    """Mistake of a bare number that is too large for its unit in SI."""
    unit = scene.shown_in(kind)
    unit = DISPLAY_UNIT[kind] if unit == SI_UNIT[kind] else unit
    problem = f"a number without a unit is SI, and this is far beyond the machine: {MEANT[kind]}?"
    remedy = f'Write "{value:.6g} {unit}", or "{show(value, SI_UNIT[kind])}" where {MEANT[kind]} are meant'
    return cursor.fault(problem, value, remedy=remedy)


def _list_numbers(design: Cursor, lists: Mapping[str, Quantity]) -> dict[str, object]:
    """Numbers of a design's lists under separate names. Raises BadInput."""
    numbers: dict[str, object] = {}
    given = design.table()
    for name in lists:
        place, values = design.at(name), given.get(name, [])
        if not isinstance(values, list | tuple) or len(values) > LONGEST:
            allowed = f"a list of up to {LONGEST} numbers"
            raise place.fault("it is not a list, or it is too long", allowed=allowed, remedy=_GIVE)
        if values and any(_place(str(key), name) is not None for key in given):
            raise place.fault(f"{name} is given as a list and by number", remedy=_GIVE)
        numbers |= {f"{name}_{k}": value for k, value in enumerate(values)}
    return numbers


def _numbers(scene: Scene) -> dict[str, Quantity]:
    """Quantity of each number of a scene that a design may hold."""
    quantities: dict[str, Quantity | None] = {}
    for model in (scene.schema.mechanism, scene.schema.operation):
        quantities |= quantities_of(model)
    for effect in scene.active:
        for key in effect.table.model_fields:
            # Of several numbers with one name the first is meant, as in `Scene.full`.
            if quantity := quantity_of(effect.table, key):
                quantities.setdefault(label(effect, key), quantity)
    first = {name: quantities[name] for name in scene.schema.variables}
    return {name: quantity for name, quantity in {**first, **quantities}.items() if quantity}


def _fits(quantity: Quantity, value: float) -> bool:
    """Whether a number in SI lies in its quantity's range."""
    return value >= quantity.least and quantity.above < value < quantity.below


MOST_SENTENCES, LONGEST_TEXT = 8, 200
"""Changes that are listed one by one, the others are counted; characters of one change."""
PIPE = "-"
"""Name in messages of a design that comes through a pipe."""


class DesignGiven(NamedTuple):
    """Contents of a design file: an unchecked design, and further data of a whole answer.

    call: changes of its scene by its call; target, status: those of the answer; document: tables of its scene; files:
    text of the files that these tables name.
    """

    design: object
    call: Call = Call()
    target: str | None = None
    status: str | None = None
    document: Mapping[str, Any] | None = None
    files: Mapping[str, str] = Frozen()


def read_given(path: Path) -> DesignGiven:
    """Contents of the file of a design or of a whole answer. Raises BadInput."""
    data, origin = loaded(path), named(path)
    if not isinstance(data, dict) or "design" not in data:
        return DesignGiven(data)
    target, status, answer_scene = data.get("target"), data.get("status"), data.get("scene")
    if target is not None and not isinstance(target, str):
        raise refusal("the target is not a name", origin, "target", target, remedy="Correct it or take it out")
    status = status if isinstance(status, str) else None
    if answer_scene is None:
        return DesignGiven(data["design"], Call(target=target), target, status)
    document = answer_scene.get("document") if isinstance(answer_scene, Mapping) else None
    if not isinstance(document, Mapping):
        remedy = "Give the answer as it was printed, or its design object alone"
        key = "scene.document"
        raise refusal("the answer's scene has no tables", origin, key, allowed="a scene's tables", remedy=remedy)
    call = _call(answer_scene["call"], origin) if "call" in answer_scene else Call(target=target)
    files = answer_scene.get("files", {})
    if not isinstance(files, Mapping) or not all(isinstance(text, str) for text in files.values()):
        raise refusal(
            "the answer's files are not text", origin, "scene.files", remedy="Give the answer as it was printed"
        )
    return DesignGiven(data["design"], call, target, status, document, Frozen(files))


def _call(raw: object, origin: str) -> Call:
    """Changes by the call of an answer. Raises BadInput."""
    entries: Mapping[str, Any] = raw if isinstance(raw, Mapping) else {"": raw}
    names = [entries.get(name, []) for name in ("with", "without", "free")]
    values, target = entries.get("set", {}), entries.get("target")
    listed = all(isinstance(entry, list) and all(isinstance(name, str) for name in entry) for entry in names)
    if "" in entries or not listed or not isinstance(values, Mapping) or not isinstance(target, str | None):
        remedy = "Give the answer as it was printed, or its design object alone"
        allowed = "set: keys and values; with, without, free: names; target: a name"
        raise refusal("the changes of the call cannot be read", origin, "scene.call", allowed=allowed, remedy=remedy)
    on, off, free = (tuple(entry) for entry in names)
    return Call(copied(values, origin), on, off, free, target)


def read_answer(path: Path, jobs: Jobs) -> tuple[Scene, DesignGiven]:
    """Scene of an answer in a file, and the contents of the file. Raises BadInput."""
    given, origin = read_given(path), named(path)
    if given.document is None:
        remedy = "Give what `loomopt solve --json` prints; give a design alone by --design, with its scene"
        raise refusal("it is not an answer with its scene", origin, remedy=remedy)
    call = given.call.then(Call(target=given.target))
    try:
        # Somebody else may have made the file: what it names is bound as what a scene file names.
        return build(given.document, jobs, origin, Paths(path.absolute().parent, texts=given.files), call), given
    except BadInput as error:
        faults = Faults()
        for fault in error.faults:
            advice = {"allowed": fault.allowed, "remedy": fault.remedy}
            faults.add(refusal(fault.problem, origin, f"scene.document.{fault.key}", **advice, grade=fault.grade))
        raise faults.error() from None


def resumed(given: DesignGiven, scene: Scene, later: Call, origin: str) -> Scene:
    """Scene with the changes of an answer's call, then those of a later call. Raises BadInput.

    All else is as `scene` has it; a path that the answer's call has set is bound as one that a scene file names.
    """
    if given.document is not None:
        check_job(looked_up(given.document, ("problem", "job")), scene, origin)
    try:
        return scene.called(given.call.then(later), later.set)
    except BadInput as error:
        scene.called(later, later.set)  # which raises its own fault
        remedy = f"{error.remedy.rstrip('.')}; or give its design object alone"
        raise refusal(
            f"the changes of the answer's call are invalid: {error.problem}",
            origin,
            f"scene.call: {error.key}",
            allowed=error.allowed,
            remedy=remedy,
        ) from None


def check_job(job: object, scene: Scene, origin: str) -> None:
    """Raise BadInput for an answer of another job than a scene's."""
    if job != scene.job:
        name = clean(job, 80) if isinstance(job, str) else shown(job)
        remedy = "Give an answer of this job, or the scene of the answer"
        raise refusal(f"the answer is of job {name}, the scene of job {scene.job}", origin, remedy=remedy)


def scene_changes(scene: Scene, given: DesignGiven, origin: str, besides: Call) -> list[str]:
    """Sentences on the differences between a scene and an answer's scene; empty where both are the same.

    origin: what the answer's file is called; besides: changes of the scene by the call, which are left out.
    """
    if given.document is None:
        return []
    here, there = _on(scene.document, scene), _on(given.document, scene)
    changes = [f"{name} on" for name in here if name not in (*there, *besides.on)]
    changes += [f"{name} off" for name in there if name not in (*here, *besides.off)]
    after, before = dict(document_values(scene.document)), dict(document_values(given.document))
    for key in dict.fromkeys([*before, *after]):
        if before.get(key) == after.get(key) or _is_of(besides, key):
            continue
        was = f" ({clean(origin, 80)}: {_text(before[key])})" if key in before else ""
        changes.append(f"{key} = {_text(after[key])}{was}" if key in after else f"{key} left out{was}")
    if given.files:
        from loomopt.scenes.numbers import tables

        now = {key: text for key, text in tables(scene).items() if not _is_of(besides, key)}
        changes += [f"{key} with other rows" for key, text in given.files.items() if now.get(key, text) != text]
    return _shorten(changes)


def _shorten(sentences: Sequence[str]) -> list[str]:
    short = [clean(sentence, LONGEST_TEXT) for sentence in sentences[:MOST_SENTENCES]]
    return short if len(sentences) <= MOST_SENTENCES else [*short, f"and {len(sentences) - MOST_SENTENCES} more"]


def _is_of(call: Call, key: str) -> bool:
    """Whether a call sets a key or a table that contains it, or frees its bound."""
    return any(
        f"{key}.".startswith(f"{prefix}.") for prefix in (*call.set, *(f"bounds.{name}.free" for name in call.free))
    )


def _on(document: Mapping[str, Any], scene: Scene) -> list[str]:
    """Effects that are on in raw tables, including instances, by name."""
    names: list[str] = []
    table = document.get("effects")
    for name, entry in table.items() if isinstance(table, Mapping) else ():
        effect = scene.schema.effects.get(name)
        many = effect is not None and effect.many and isinstance(entry, Mapping)
        names += [f"{name}.{instance}" for instance in entry] if many else [str(name)]
    return names


def remark(scene: Scene, given: DesignGiven, later: Call, changes: Sequence[str], origin: str) -> str:
    """Sentence on the values that an answer adds to a scene besides its design, and on those it does not add; or "".

    later: changes of this call, which are left out; changes: from `scene_changes`.
    """
    current = given.call.then(later).changes
    lasting = [text for text in given.call.changes if text in current]
    sentences = [f"{origin} adds the changes of its call: {', '.join(_shorten(lasting))}"] if lasting else []
    sentences += (
        [f"the settings differ from those of {origin}; {scene.origin} is used: {', '.join(changes)}"] if changes else []
    )
    return "; ".join(sentences)


def _text(value: object) -> str:
    return clean(value, 80) if isinstance(value, str) else shown(value)


def document_values(document: Mapping[str, Any]) -> Iterator[tuple[str, object]]:
    """Yield the values that decide an answer and its display, by dotted key, for effects that are on or off."""
    if (name := looked_up(document, ("problem", "name"))) is not None:
        yield "problem.name", name
    tables = ("operation", "mechanism", "available", "effects", "bounds", "limits", "display", "targets")
    for table in (*tables, *(name for name in document if name not in ("problem", *tables))):
        whole = "effects" if table == "available" else table
        for parts, value in _leaves(document.get(table, {})):
            if table != "targets" or "expected" not in parts:
                yield ".".join((whole, *parts)), value


def _leaves(table: object, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], object]]:
    """Yield the values of nested tables by their paths; a list is one value, alike as JSON and TOML give it."""
    if not isinstance(table, Mapping):
        yield path, list(table) if isinstance(table, list | tuple) else table
        return
    for name, inner in table.items():
        yield from _leaves(inner, (*path, name))
