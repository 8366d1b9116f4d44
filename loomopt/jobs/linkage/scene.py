"""Schema of a linkage scene: it follows from the parts, output, events, windows and targets of the scene."""

import functools
import json
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from pydantic import Field, create_model

from loomopt.base.errors import Faults, refusal, unknown
from loomopt.base.quantities import Angle, Coordinate, PositiveLength, PositiveNumber, PureNumber, Speed, Torque, read
from loomopt.base.units import QuantityError, ShowValue, usual
from loomopt.jobs.linkage import parts
from loomopt.jobs.linkage.model import (
    CONTACT,
    MATCH,
    MATCH_SQUARE,
    OBLIQUITY,
    PATH,
    RADIUS,
    RMS_TORQUE,
    SCAN,
    TORQUE_SQUARE,
    EventRule,
    Linkage,
    Match,
    Output,
    Path,
    Reach,
    Rms,
    Turn,
    UnfoundError,
    Window,
    contact_peaks,
    extreme_turn,
    extremes,
    number,
)
from loomopt.jobs.linkage.parts import KEYS, Json, NumberKey, Numbers, WordKey
from loomopt.maths import systems
from loomopt.model import drive
from loomopt.model.change import CHANGE
from loomopt.physics.balance import Given
from loomopt.physics.cycle import Node, Where
from loomopt.physics.effects import kinds
from loomopt.physics.mechanisms import chain, free_cams
from loomopt.physics.mechanisms.chain import SENSES, Chain
from loomopt.physics.mechanisms.dyad import dot
from loomopt.physics.schema import DIGITS, Axis, Figure, Name, Table, Target, TargetTable
from loomopt.scenes import csv_tables
from loomopt.scenes.cursor import Cursor
from loomopt.scenes.scene import Scene, cursor
from loomopt.scenes.synonyms import Synonym
from loomopt.scenes.tables import SceneSchema


class Operation(Table):
    """Operation of the machine."""

    speed: Speed | None = Field(None, description="speed of the crank")
    M0: Torque | None = Field(None, description="largest torque of the resistance, in place of its key torque")


class LinkageTarget(TargetTable):
    """A target of the scene: figures that are optimised in order, or a path."""

    least: tuple[Name, ...] = Field((), description="figures or numbers that are minimised, in order")
    most: tuple[Name, ...] = Field((), description="figures or numbers that are maximised, after those")
    point: Name | None = Field(None, description="joint that should follow a path")
    table: Name | None = Field(
        None, description="CSV file of the path: x [mm], y [mm], and phi [deg] where its timing is given"
    )
    match: Name | None = Field(
        None, description="CSV file of a function that the output should be: phi [deg], q in deg or mm"
    )
    digits: int | None = Field(None, ge=0, le=15, description=DIGITS)
    weights: dict[str, PureNumber] = Field({}, description="number → weight of its change from today; 1 by default")

    @property
    def objectives(self) -> tuple[tuple[str, str], ...]:
        """Figures to optimise, in order, each with "least" or "most"."""
        path = ((PATH, "least"),) if self.point else ()
        match = ((MATCH, "least"),) if self.match else ()
        return (*path, *match, *((name, "least") for name in self.least), *((name, "most") for name in self.most))


DEFAULT = {"torque": {"least": ["peak_torque"]}}
"""The target of a scene that names none."""
REACHES = ("x_max", "x_min", "y_max", "y_min")
FEWEST = 2
"""Points of a path."""
FORMS = {"angle": "link", "slide": "slider or slot", "x": "joint", "y": "joint"}
"""Key of [output] → what it measures."""
SCALE, TRAVEL = "what the output is multiplied by", "travel between {} and {before}{after}"
VALUE = "value from which the travel over window {} counts"
OUTPUT_KEYS: parts.Keys = {
    **{form: WordKey(description) for form, description in FORMS.items()},
    "against": WordKey(parts.LINK),
    "sense": WordKey(parts.SENSE),
    "scale": NumberKey(PositiveNumber, SCALE),
    "zero": NumberKey(Angle, "direction from which the output counts"),
}
EVENT_KEYS: Mapping[str, parts.Keys] = {
    "extreme": {
        "extreme": WordKey(parts.EXTREME, True),
        "near": WordKey(parts.ANGLE),
        "rest": WordKey(parts.REST),
        "of": WordKey(parts.LINK),
    },
    "travel": {
        "travel": NumberKey(parts.PositiveAngle, TRAVEL, True),
        "before": WordKey(parts.EVENT),
        "after": WordKey(parts.EVENT),
    },
    "angle": {"angle": NumberKey(Angle, "crank angle of {}", True)},
}
"""Keys of an event, by the key that gives its kind."""
WINDOW_KEYS: parts.Keys = {
    "after": WordKey(parts.EVENT, True),
    "begins": NumberKey(Angle, "crank angle from {after} where window {} begins"),
    "ends": NumberKey(Angle, "crank angle from {after} where window {} ends"),
    "until": WordKey(parts.EVENT),
    "level": WordKey(parts.EVENT),
    **{form: WordKey(description) for form, description in FORMS.items()},
    "value": NumberKey(Coordinate, VALUE),
}


def _output_schema() -> Json:
    """JSON Schema of [output]."""
    one_form: Json = {"oneOf": [{"required": [form]} for form in FORMS]}
    table_schema = parts.keys_schema(OUTPUT_KEYS)
    scale = [parts.number_schema(NumberKey(kind, SCALE)) for kind in (PositiveNumber, PositiveLength)]
    return table_schema | one_form | {"properties": table_schema["properties"] | {"scale": {"anyOf": scale}}}


def _events_schema() -> Json:
    """JSON Schema of [events]."""
    lengths = {**EVENT_KEYS["travel"], "travel": NumberKey(PositiveLength, TRAVEL, True)}
    forms = [parts.keys_schema(keys) for keys in (*EVENT_KEYS.values(), lengths)]
    return {"type": "object", "propertyNames": parts.NAME_SCHEMA, "additionalProperties": {"anyOf": forms}}


def _windows_schema() -> Json:
    """JSON Schema of [windows]."""
    forms = [parts.keys_schema({**WINDOW_KEYS, "value": NumberKey(kind, VALUE)}) for kind in (Coordinate, Angle)]
    return {"type": "object", "propertyNames": parts.NAME_SCHEMA, "additionalProperties": {"anyOf": forms}}


TABLES: Mapping[str, tuple[str, Callable[[], Json]]] = {
    "parts": (f"the parts of the linkage by name: {', '.join(list(KEYS)[:-1])} or {list(KEYS)[-1]}", parts.schema),
    "output": ("output of the linkage: angle, slide, x or y of a link, part or joint", _output_schema),
    "events": ("named crank angles: extremes of the output, travels from them, or angles", _events_schema),
    "windows": ("stretches of crank angles after an event", _windows_schema),
}
"""Tables that only linkage scenes have: their description and JSON Schema."""
READ_TABLES = ("mechanism", *TABLES)


def _table_schema(name: str) -> Json:
    """JSON Schema of one of these tables."""
    text, schema = TABLES[name]
    return {"description": text, **schema()}


class LinkageScene(NamedTuple):
    """Contents of the scene's tables; numbers: name → kind of quantity and words, in the scene's order."""

    linkage: Linkage
    numbers: Mapping[str, tuple[Any, str]]
    windows: tuple[Window, ...] = ()

    @property
    def knots(self) -> tuple[str, ...]:
        """Numbers of free cam laws, which a scene need not give."""
        return tuple(name for cam in self.linkage.chain.cams for name in chain.cam_knots(cam))


Known = Mapping[str, EventRule]


def _output(cursor: Cursor, linked: Chain, numbers: Numbers) -> Output:
    raw = cursor.table()
    forms = [form for form in FORMS if form in raw]
    if len(forms) != 1:
        problem = f"the output is one of {', '.join(FORMS)}: {'none' if not forms else ' and '.join(forms)} is given"
        raise cursor.fault(problem, remedy='Such as angle = "rocker", slide = "ram" or y = "P"')
    form = forms[0]
    kind, slides_now = _scale(raw.get("scale", ""), form, numbers.names)
    read = parts.entries(cursor, {**OUTPUT_KEYS, "scale": NumberKey(kind, SCALE)}, numbers)
    joints, links, slides = parts.kinds_of(linked)
    name = _checked_name(cursor.at(form), {"angle": links, "slide": slides}.get(form, joints), FORMS[form])
    for key in ("against", "zero"):
        if key in raw and form != "angle":
            raise cursor.at(key).fault(f"{key} is for an angle alone", remedy="Take it out")
    against = _checked_name(cursor.at("against"), links, "link") if "against" in raw else ""
    sense = SENSES[read.words.get("sense", "forward")]
    scale, zero = read.numbers.get("scale"), read.numbers.get("zero")
    carrier = "" if against or scale else _carrier(linked, form, name)
    return Output(form, name, against, sense, scale, zero, slides_now, carrier)


def _carrier(linked: Chain, form: str, name: str) -> str:
    """Link or joint that carries the mass of an output: `Output.carrier`."""
    if form == "angle":
        return name if linked.origins.get(name) in linked.pivots else ""
    if form != "slide":
        return name
    part = next(part for part in linked.parts if part.name == name)
    on_frame = part.kind == "slider" and part.word("guide") in ("", chain.FRAME_NAME)
    return part.word("pin") if on_frame else ""


def _checked_name(cursor: Cursor, known: Iterable[str], sort: str) -> str:
    """Name after a check that it is known. Raises BadInput."""
    return cursor.word(sorted(known), sort)


def _scale(raw: object, form: str, names: Mapping[str, object]) -> tuple[Any, bool]:
    """Kind of an output's scale, and whether the output then slides: an angle times a length is one."""
    text = names.get(parts.multiple(raw.strip())[0], raw) if isinstance(raw, str) else raw
    if form != "angle":
        return PositiveNumber, True
    try:
        read(str(text), "length")
    except QuantityError:
        return PositiveNumber, False
    return PositiveLength, True


def _places(cursor: Cursor, linked: Chain, numbers: Numbers, output: Output) -> tuple[EventRule, ...]:
    places: dict[str, EventRule] = {}
    travel = NumberKey(PositiveLength if output.slides else parts.PositiveAngle, TRAVEL, True)
    forms = {**EVENT_KEYS, "travel": {**EVENT_KEYS["travel"], "travel": travel}}
    for name, place in cursor.entries().items():
        table = place.table()
        parts.check_name(place, name)
        given = [form for form in forms if form in table]
        if len(given) != 1:
            problem = "an event needs an extreme, a travel from another event, or an angle"
            raise place.fault(problem, remedy='Such as { extreme = "max", near = "60 deg" }')
        read = parts.entries(place, forms[given[0]], numbers, name=name)
        if given[0] == "travel":
            places[name] = _travel(place, name, read, places)
        else:
            extreme = read.words.get("extreme", "")
            rest, near = read.words.get("rest", ""), read.words.get("near")
            of = _of(place, linked, near) if "of" in table else ""
            places[name] = EventRule(name, extreme, near, angle=read.numbers.get("angle"), rest=rest, of=of)
    return tuple(places.values())


def _of(cursor: Cursor, linked: Chain, near: float | None) -> str:
    """Link, slider or slot of which an event is an extreme."""
    if near is None:
        problem = "an extreme of another link needs the crank angle near which it is"
        raise cursor.at("of").fault(problem, remedy='Add near = "60 deg"')
    _, links, slides = parts.kinds_of(linked)
    return _checked_name(cursor.at("of"), [*links, *slides], "link, slider or slot")


def _travel(cursor: Cursor, name: str, read: parts.TableEntries, known: Known) -> EventRule:
    sides = [side for side in ("before", "after") if side in read.words]
    if len(sides) != 1:
        raise cursor.fault("a travel lies before or after another event", remedy='Such as before = "bottom"')
    side = cursor.at(sides[0])
    reference = _checked_name(side, known, "event above it")
    if not known[reference].extreme or known[reference].of:
        problem = f"a travel counts from an extreme of the output, and {reference} is not one"
        raise side.fault(problem, remedy='Name an event with extreme = "max" or "min"')
    rise = 1 if known[reference].extreme == "max" else -1
    before = -1 if sides[0] == "before" else 1
    return EventRule(name, travel=read.numbers["travel"], reference=reference, side=before, rise=rise)


def _windows(cursor: Cursor, linked: Chain, numbers: Numbers, places: Sequence[EventRule]) -> tuple[Window, ...]:
    known, windows = [place.name for place in places], []
    for name, place in cursor.entries().items():
        place.table()
        parts.check_name(place, name)
        kind = Angle if "angle" in place.table() else Coordinate
        keys = {**WINDOW_KEYS, "value": NumberKey(kind, VALUE)}
        read = parts.entries(place, keys, numbers, "a window", name)
        after = _checked_name(place.at("after"), known, "event")
        until, level = (
            _checked_name(place.at(word), known, "event") if word in read.words else "" for word in ("until", "level")
        )
        output, value = _coordinate(place, linked, read.words), read.numbers.get("value")
        if bool(level) == bool(value):
            problem = "a window needs level or value, not both: its travel is measured from there"
            raise place.at("level").fault(problem, remedy='Such as level = "rear"')
        if value and output is None:
            remedy = f"Name the coordinate that it is a value of: {', '.join(FORMS)}"
            raise place.at("value").fault("the window has no coordinate", remedy=remedy)
        begins, ends = read.numbers.get("begins"), read.numbers.get("ends")
        if (until and (begins or ends)) or not (until or (begins and ends)):
            problem = "a window has begins and ends, crank angles from the event, or the event until"
            raise place.fault(problem, remedy='Such as begins = "130 deg", ends = "240 deg", or until = "leave"')
        windows.append(Window(name, after, begins, ends, level, until, output, value))
    return tuple(windows)


def _coordinate(cursor: Cursor, linked: Chain, words: Mapping[str, Any]) -> Output | None:
    """Coordinate of a window that is not the output; None where none is named."""
    forms = [form for form in FORMS if form in words]
    if len(forms) > 1:
        raise cursor.fault(f"a window has one coordinate, not {' and '.join(forms)}", remedy="Take one out")
    if not forms:
        return None
    form, (joints, links, slides) = forms[0], parts.kinds_of(linked)
    name = _checked_name(cursor.at(form), {"angle": links, "slide": slides}.get(form, joints), FORMS[form])
    return Output(form, name, slides=form != "angle")


@functools.lru_cache(maxsize=64)
def _read(text: str) -> LinkageScene:
    scene = Cursor({"mechanism": {}} | json.loads(text), "", Faults())
    mechanism = scene.at("mechanism").table()
    numbers = Numbers(mechanism)
    scene.at("parts").table()
    linked = parts.linked(scene.at("parts"), numbers)
    output = _output(scene.at("output"), linked, numbers)
    places = _places(scene.at("events"), linked, numbers, output)
    windows = _windows(scene.at("windows"), linked, numbers, places)
    knots = {
        name: (parts.SignedNumber, f"third derivative of a free law of {cam.name} at a knot")
        for cam in linked.cams
        for name in chain.cam_knots(cam)
    }
    numbers.uses |= knots
    for name in mechanism:
        place = scene.at("mechanism").at(name)
        parts.check_name(place, name)
        if name not in numbers.uses:
            raise place.fault(f"number {name} is not used", remedy="Use it, or take it out")
    return LinkageScene(
        Linkage(linked, output, places),
        {name: numbers.uses[name] for name in (*mechanism, *(name for name in knots if name not in mechanism))},
        windows,
    )


def read_tables(document: Mapping[str, Any]) -> LinkageScene:
    """Contents of the tables that only linkage scenes have. Raises BadInput."""
    return _read(json.dumps({name: document.get(name, {}) for name in READ_TABLES}, default=repr))


# Figures, targets and axes.


def figures_read(document: Mapping[str, Any]) -> set[str]:
    """Figures that limits or targets name, by their full names."""
    names, limits = set(_target_names(document, "least", "most")), document.get("limits", {})
    for name, limit in limits.items() if isinstance(limits, Mapping) else ():
        inner = [f"{name}.{key}" for key in limit] if isinstance(limit, Mapping) else []
        names |= {name, *inner}
    return names


def reaches(document: Mapping[str, Any], linked: Chain) -> tuple[Reach, ...]:
    """Reaches of joints that limits or targets name."""
    joints = parts.kinds_of(linked)[0]
    possible = [Reach(joint, name[0], 1 if name.endswith("max") else -1) for joint in joints for name in REACHES]
    names = figures_read(document)
    return tuple(reach for reach in possible if reach.name in names)


PULSED = "resistance"
"""The effect over whose pulse a mean square may be taken."""


def rms_figures(
    known: LinkageScene, document: Mapping[str, Any], acting: tuple[float, ...] | float = 1.0
) -> tuple[Rms, ...]:
    """Figures of mean squares that limits or targets name; acting: the switches with which the resistance acts."""
    load = "force" if known.linkage.output.slides else "moment"
    places: dict[str, Where] = {window.name: (window.switch, 1.0) for window in known.windows}
    places = {PULSED: (PULSED, acting)} | places
    possible = [Rms(quantity, over, where) for over, where in places.items() for quantity in (load, "jerk")]
    names = figures_read(document)
    return tuple(rms for rms in possible if rms.name in names)


def figures(known: LinkageScene, document: Mapping[str, Any]) -> dict[str, Figure]:
    """Figures of a linkage."""
    linkage, slides = known.linkage, known.linkage.output.slides
    travel, load = ("length", "force") if slides else ("angle", "torque")
    rates = ("travel velocity", "travel acceleration", "travel jerk") if slides else ("number",) * 3
    figure_list = [*drive.FIGURES, Figure(RMS_TORQUE, "torque", "rms crank torque over the cycle", sides=("max",))]
    for name, event in linkage.loads.items():
        figure_list.append(Figure(name, load, f"{load} at the output at {event}"))
        figure_list.append(Figure(f"angle.{event}", "angle", f"crank angle of {event}"))
    high, low = extremes(linkage.places)
    if high and low:
        figure_list.append(Figure("swing", travel, f"{'stroke' if slides else 'swing'} of the output, {low} to {high}"))
        figure_list.append(Figure("sweep", "angle", f"crank angle from {high} to {low}"))
    for name, kind, text in zip(("velocity", "acceleration", "jerk"), rates, ("q'", "q''", "q'''"), strict=True):
        figure_list.append(Figure(f"peak_{name}", kind, f"peak |{text}| of the output", sides=("max",)))
    figure_list += [Figure(f"mu.{n}", "angle", f"least transmission angle of {n}", ("min",)) for n in linkage.oblique]
    for window in known.windows:
        out, kind = window.output, travel
        text = f"largest travel from {window.level} over window {window.name}"
        if out is not None:
            kind = "length" if out.slides else "angle"
            begin = window.level or "its value"
            text = f"largest distance of the {out.measure} of {out.name} from {begin} over window {window.name}"
        figure_list.append(Figure(f"travel.{window.name}", kind, text, sides=("max",)))
        if window.until:
            text = f"crank angle of window {window.name}, {window.after} to {window.until}"
            figure_list.append(Figure(window.length, "angle", text))
    for rms in rms_figures(known, document):
        text, kind = ("jerk", rates[2]) if rms.quantity == "jerk" else (load, load)
        figure_list.append(Figure(rms.name, kind, f"rms {text} of the output over {rms.over}", sides=("max",)))
    for roller in linkage.rollers:
        figure_list += roller.figures()
    if linkage.rollers:
        figure_list.append(Figure(RADIUS, "length", "largest radius of all cams with rollers", sides=("max",)))
    for reach in reaches(document, linkage.chain):
        side, text = ("max", "largest") if reach.sign > 0 else ("min", "least")
        figure_list.append(Figure(reach.name, "length", f"{text} {reach.axis} of {reach.joint}", sides=(side,)))
    if _has(document, "point"):
        figure_list.append(Figure(PATH, "length", "rms distance of the point from its path", sides=("max",)))
    if _has(document, "match"):
        figure_list.append(Figure(MATCH, travel, "rms distance of the output from its function", sides=("max",)))
    if _reads_change(document):
        figure_list.append(
            Figure(
                CHANGE, "number", "change from today: sum of squares, relative to the widths of the bounds", sides=()
            )
        )
    return {figure.name: figure for figure in figure_list}


def _has(document: Mapping[str, Any], key: str) -> bool:
    """Whether a target has a key."""
    targets = document.get("targets", {})
    return isinstance(targets, Mapping) and any(
        isinstance(table, Mapping) and table.get(key) is not None for table in targets.values()
    )


def _reads_change(document: Mapping[str, Any]) -> bool:
    """Whether a target reads the change from today."""
    return CHANGE in _target_names(document, "least")


def axes(known: LinkageScene, document: Mapping[str, Any]) -> dict[str, Axis]:
    """Axes that are read otherwise than under their own name."""
    load = "force" if known.linkage.output.slides else "torque"
    axis_list = [
        Axis(RMS_TORQUE, "torque", (TORQUE_SQUARE,), senses=("least",), power=2),
        *(
            Axis(f"mu.{part}", "angle", (f"{part}.{OBLIQUITY}",), "peak", ("most",), -1, math.pi / 2)
            for part in known.linkage.oblique
        ),
        *(
            Axis(reach.name, "length", (), "peak", ("least",) if reach.sign > 0 else ("most",), reach.sign)
            for reach in reaches(document, known.linkage.chain)
        ),
        *(Axis(name, load, form="magnitude", senses=("least",)) for name in known.linkage.loads),
        *(axis for roller in known.linkage.rollers for axis in roller.axes()),
        *_roller_axes(known, document),
    ]
    axis_list += [Axis(w.length, "angle", senses=("most", "least")) for w in known.windows if w.until]
    jerk = "travel jerk" if known.linkage.output.slides else "number"
    for rms in rms_figures(known, document):
        kind = jerk if rms.quantity == "jerk" else load
        axis_list.append(Axis(rms.name, kind, (rms.mean,), senses=("least",), power=2))
    if _reads_change(document):
        axis_list.append(Axis(CHANGE, "number", senses=("least",)))
    if _has(document, "match"):
        travel = "length" if known.linkage.output.slides else "angle"
        axis_list.append(Axis(MATCH, travel, (MATCH_SQUARE,), senses=("least",), power=2))
    if _has(document, "point"):
        axis_list.append(Axis(PATH, "length", ("path_mean_square",), senses=("least",), power=2))
    # A number of which a target seeks the most is worth its most where it is traded, too.
    most = dict.fromkeys(name for name in _target_names(document, "most") if name in known.numbers)
    axis_list += [Axis(name, _kind(known, name), senses=("most", "least")) for name in most]
    return {axis.name: axis for axis in axis_list}


def _roller_axes(known: LinkageScene, document: Mapping[str, Any]) -> Iterator[Axis]:
    """Yield the axes of figures that are the largest of several quantities of rollers."""
    names = [roller.name for roller in known.linkage.chain.rollers]
    if not names:
        return
    yield Axis(RADIUS, "length", tuple(f"{RADIUS}.{name}" for name in names), "peak", ("least",))
    for figure, of in contact_peaks(names, _is_preloaded(document), with_width=True).items():
        kind = "pressure" if of.power == 2 else "force"
        yield Axis(figure, kind, of.quantities, "peak", ("least",), power=of.power)


def _is_preloaded(document: Mapping[str, Any]) -> bool:
    """Whether the contacts of a scene have a preload."""
    effects = document.get("effects", {})
    table = effects.get(CONTACT, {}) if isinstance(effects, Mapping) else {}
    return isinstance(table, Mapping) and table.get("preload") is not None


def _kind(known: LinkageScene, name: str) -> str:
    """Kind of quantity of a number."""
    return str(known.numbers[name][0].__metadata__[0].kind)


def _target_names(document: Mapping[str, Any], *ends: str) -> Iterator[str]:
    """Yield the figures and numbers of which targets seek the least, or the most."""
    targets = document.get("targets", {})
    for table in targets.values() if isinstance(targets, Mapping) else ():
        for end in ends:
            names = table.get(end, []) if isinstance(table, Mapping) else []
            yield from (name for name in names if isinstance(name, str)) if isinstance(names, list | tuple) else ()


def targets(document: Mapping[str, Any]) -> dict[str, Target]:
    """Targets of the scene, in its order."""
    table, targets = Cursor(document.get("targets", {}), "targets", Faults()), {}
    for name, place in table.entries(table.table() or DEFAULT).items():
        entry, goals = place.table(), []
        if entry.get("point") is not None:
            goals.append(f"{entry['point']} on its path")
        if entry.get("match") is not None:
            goals.append("least distance of the output from its function")
        for key in ("least", "most"):
            names = entry.get(key, ())
            goals += [f"{key} {figure}" for figure in names] if isinstance(names, list | tuple) else []
        targets[name] = Target(name, ", then ".join(goals) or "nothing", LinkageTarget)
    return targets


# The scene as a whole.

EMPTY: Mapping[str, Any] = {
    "parts": {"A": {"kind": "pivot"}, "crank": {"kind": "crank", "at": "A"}},
    "output": {"angle": "crank"},
}
"""The tables of a scene that has none."""


def schema(document: Mapping[str, Any]) -> SceneSchema:
    """Schema of a scene: it depends on the scene's tables. Raises BadInput."""
    tables = {name: document.get(name, {}) for name in (*READ_TABLES, "limits", "targets")}
    if "parts" not in document:
        tables |= {**{name: {} for name in READ_TABLES}, **EMPTY}
    if _is_preloaded(document):
        tables["effects"] = {CONTACT: {"preload": True}}
    return _schema(json.dumps(tables, default=repr))


@functools.lru_cache(maxsize=64)
def _schema(text: str) -> SceneSchema:
    document = json.loads(text)
    known = read_tables(document)
    optional = set(known.knots)
    fields = {
        name: (kind | None, Field(None, description=words)) if name in optional else (kind, Field(description=words))
        for name, (kind, words) in known.numbers.items()
    }
    mechanism = create_model("Mechanism", __base__=Table, __module__=__name__, **fields)  # type: ignore[call-overload]
    scene_targets = targets(document)
    effects = dict(kinds.of("loomopt.physics.effects.linkage", "SLIDING" if known.linkage.output.slides else "EFFECT"))
    if not known.linkage.rollers:
        del effects[CONTACT]
    return SceneSchema(
        name="linkage",
        title="a planar linkage of one's own, described in the scene",
        operation=Operation,
        mechanism=mechanism,
        effects={name: _linkage_effect(effect, known.linkage) for name, effect in effects.items()},
        variables={name: _kind(known, name) for name in known.numbers},
        own_figures=figures(known, document),
        targets=scene_targets,
        default_target=next(iter(scene_targets)),
        fault=functools.partial(fault, known.linkage),
        own_margins={text: "number" for group in known.linkage.groups.values() for text in group.closes},
        own_axes=axes(known, document),
        tables={name: functools.partial(_table_schema, name) for name in TABLES},
        former_names=former_names(known.linkage),
        synonyms=(Synonym("effects.resistance.torque", "operation.M0", "torque", without_other=False),),
    )


def former_names(linkage: Linkage) -> dict[str, str]:
    """Today's names of figures by their former ones: a moment at an event was called a force."""
    return {} if linkage.output.slides else {f"force.{event}": name for name, event in linkage.loads.items()}


def _linkage_effect(effect: kinds.Effect, linkage: Linkage) -> kinds.Effect:
    """An effect as this linkage uses it."""
    return effect.fitted(linkage.chain) if isinstance(effect, kinds.Check) and effect.fitted else effect


def match(scene: Scene, target: str) -> Match | None:
    """Function of a target, else of the first target that has one; None where none has. Raises BadInput."""
    name = table_target(scene, target, "match")
    if name is None:
        return None
    columns = read_match(scene, name).columns
    return Match(columns["phi"], columns["q"])


def read_match(scene: Scene, name: str) -> csv_tables.Table:
    """Table of the function of a target, with its precision. Raises BadInput."""
    table = scene.targets[name]
    assert isinstance(table, LinkageTarget)
    kinds = {"phi": "angle", "q": "length" if read_tables(scene.document).linkage.output.slides else "angle"}
    return csv_tables.read(scene, str(table.match), f"targets.{name}.match", kinds, fewest=FEWEST, digits=table.digits)


def path(scene: Scene, target: str) -> Path | None:
    """Path of a target, else of the first target that has one; None where none has. Raises BadInput."""
    name = table_target(scene, target, "point")
    if name is None:
        return None
    columns = read_path(scene, name).columns
    table = scene.targets[name]
    assert isinstance(table, LinkageTarget)
    return Path(str(table.point), columns.get("phi", ()), columns["x"], columns["y"])


def table_target(scene: Scene, target: str, key: str) -> str | None:
    """Target whose path or function is read for a target: its own, else the first that has one; None where none has.

    key: "point" of a path, "match" of a function.
    """
    names = [name for name, table in scene.targets.items() if getattr(table, key, None)]
    return target if target in names else next(iter(names), None)


def read_path(scene: Scene, name: str) -> csv_tables.Table:
    """Table of the path of a target, with its precision. Raises BadInput."""
    table, key = scene.targets[name], f"targets.{name}.table"
    assert isinstance(table, LinkageTarget)
    kinds, given = {"phi": "angle", "x": "length", "y": "length"}, str(table.table)
    there = csv_tables.columns(scene, given, key, kinds)
    kinds = {column: kind for column, kind in kinds.items() if column in ("x", "y", *there)}
    return csv_tables.read(scene, given, key, kinds, fewest=FEWEST, digits=table.digits)


def _check_path(scene: Scene, known: LinkageScene, name: str, table: LinkageTarget) -> None:
    """Raise BadInput for a path without its point or its table; the table is read later."""
    key = f"targets.{name}"
    if table.point is None:
        if table.table is not None:
            problem = "the table of a path needs its point"
            raise refusal(problem, scene.origin, f"{key}.point", remedy="Name the point")
        return
    joints = known.linkage.chain.joints
    if table.point not in joints:
        raise unknown("joint", table.point, joints, scene.origin, f"{key}.point")
    if table.table is None:
        columns = csv_tables.header({"phi": "angle", "x": "length", "y": "length"})
        remedy = f'Write table = "path.csv"; the file has the columns {columns}'
        raise refusal("a path needs a table", scene.origin, f"{key}.table", remedy=remedy)


# What today's linkage must be, and what names must mean.

JUMP, LEVEL = math.pi, 1e-3
"""rad by which an output angle jumps between samples where it passes its cut; and share of the swing by which, where no
`near` is given, one extreme must be beyond the others, so that a small change of the design cannot exchange them."""


def fault(linkage: Linkage, design: Mapping[str, float], shown: ShowValue = usual) -> str:
    """Sentence on the crank angle at which a design does not close, or on its missing event; "" where it works."""
    design = free_cams.with_knots(linkage.chain, design)
    reason = chain.fault(linkage.chain, design, shown)
    if reason:
        return reason
    try:
        linkage.hints(Given(dict(design), {}), ())
    except UnfoundError as error:
        return error.problem
    return ""


def check(scene: Scene) -> None:
    """Raise BadInput where today's linkage does not turn all round, or a name means nothing in it."""
    known, faults = read_tables(scene.document), Faults()
    for check_part in (_check_names, _check_effects, _check_targets, _check_windows, _check_rollers):
        with faults:
            check_part(scene, known)
    with faults:
        parts.demand_used(known.linkage.chain, scene.document)
    if faults.mistakes:
        raise faults.error().placed(scene.origin, scene.document)
    numbers = free_cams.with_knots(known.linkage.chain, scene.mechanism)
    reason = chain.fault(known.linkage.chain, numbers, scene.show)
    if reason:
        remedy = "Correct the dimensions: today's linkage must close at every crank angle"
        raise refusal(f"today's linkage does not turn all round: {reason}", scene.origin, "mechanism", remedy=remedy)
    _check_contacts(scene, known.linkage.chain, numbers)
    _check_output(scene, known.linkage)
    _check_events(scene, known.linkage)
    _check_states(scene, known.linkage)


def _check_rollers(scene: Scene, known: LinkageScene) -> None:
    """Raise BadInput for a roller without a cam shaft, a shaft that moves, and contacts that nothing has."""
    linked, faults, counts = known.linkage.chain, Faults(), dict[str, int]()
    for roller in linked.rollers:
        name, key = roller.word("cam"), f"parts.{roller.name}.cam"
        cam = next((part for part in linked.cams if part.name == name), None)
        if cam is None:
            faults.add(refusal(f"{name} is not a cam", scene.origin, key, remedy="Name a cam"))
            continue
        counts[name] = counts.get(name, 0) + 1
        if not cam.word("shaft"):
            problem, remedy = f"cam {name} has no shaft for roller {roller.name}", 'Add a pivot, such as shaft = "O"'
            faults.add(refusal(problem, scene.origin, f"parts.{name}.shaft", remedy=remedy))
        elif cam.word("shaft") not in linked.pivots:
            problem = f"the shaft {cam.word('shaft')} of cam {name} is not a pivot"
            faults.add(refusal(problem, scene.origin, f"parts.{name}.shaft", remedy="Name a pivot"))
        if counts[name] > 2:
            problem = f"{roller.name} is the third roller of cam {name}: one pushes, and one pushes back"
            faults.add(refusal(problem, scene.origin, key, remedy="Take one out"))
    table = scene.document.get("tolerances", {})
    for name in known.numbers if linked.rollers and isinstance(table, Mapping) else ():
        if name in table:
            problem = f"a tolerance of {name} moves the rollers on cams that are cut already, which is not computed"
            remedy = "Take it out, or take out the rollers"
            faults.add(refusal(problem, scene.origin, f"tolerances.{name}", remedy=remedy))
    if CONTACT in scene.effects:
        alone = [name for name, count in counts.items() if count == 1]
        if alone and getattr(scene.effects[CONTACT], "preload", None) is not None:
            problem = f"cam {alone[0]} has one roller, which nothing presses on it: a preload needs two"
            faults.add(refusal(problem, scene.origin, f"effects.{CONTACT}.preload", remedy="Take it out"))
    faults.tell()


def _check_contacts(scene: Scene, linked: Chain, numbers: Mapping[str, float]) -> None:
    """Raise BadInput for a roller that its cam does not move, and for two that push the same way."""
    pushes: dict[str, tuple[str, float]] = {}
    for roller in linked.rollers:
        cam = linked.cam_of(roller)
        corner = float(linked.corners(cam, systems.FLOAT, numbers)[0])
        switch = {name: float(np.ravel(value)[0]) for name, value in linked.switch(numbers, np.array([corner])).items()}
        contact = linked.contact(roller, linked.pose(systems.FLOAT, numbers, corner, switch))
        lever = float(dot(contact.way, contact.normal))
        key = f"parts.{roller.name}"
        if lever == 0.0:
            problem = f"cam {cam.name} cannot push roller {roller.name}: its joint does not move with {cam.name}"
            raise refusal(problem, scene.origin, f"{key}.at", remedy="Put it on a joint that the cam moves")
        other = pushes.setdefault(cam.name, (roller.name, lever))
        if other[0] != roller.name and other[1] * lever > 0.0:
            problem = f"rollers {other[0]} and {roller.name} push {cam.name} the same way: none pushes it back"
            raise refusal(problem, scene.origin, f"{key}.at", remedy="Put one on the other side of the shaft")


def _check_states(scene: Scene, linkage: Linkage) -> None:
    """Raise BadInput for a steady state behind a cam, whose motion no series of harmonics follows."""
    states = [effect.name for effect in scene.active if isinstance(effect, kinds.State)]
    if states and linkage.chain.cams:
        problem = f"{states[0]} cannot be on in a linkage with a cam: its steady state is a series of harmonics"
        raise refusal(problem, scene.origin, f"effects.{states[0]}", remedy="Take it out, or replace the cam")


def _check_names(scene: Scene, known: LinkageScene) -> None:
    """Raise BadInput for a number that is called as something else is."""
    taken = dict.fromkeys(scene.schema.figures, "a figure") | {"speed": "the crank's speed"}
    taken |= {"M0": "the resistance's torque"} if "M0" in scene.operation else {}
    taken |= dict.fromkeys(("omega", "omega_dot", "phi", "instance"), "a symbol of the equations")
    taken |= {
        kinds.label(effect, key): f"a number of effect {effect.name}"
        for effect, table in zip(scene.active, scene.effects.values(), strict=True)
        for key in effect.table.model_fields
        if getattr(table, key) is not None
    }
    mechanism = cursor(scene).at("mechanism")
    for name in known.numbers:
        parts.check_name(mechanism.at(name), name, taken)


def _check_effects(scene: Scene, known: LinkageScene) -> None:
    """Raise BadInput for a link, joint or event that an effect names and the scene does not have."""
    linked, events = known.linkage.chain, [place.name for place in known.linkage.places]
    faults = Faults()
    for effect, table in zip(scene.active, scene.effects.values(), strict=True):
        path = ".".join(("effects", *effect.path))
        bodies = {"mass": (*linked.links, *linked.joints), "load": linked.joints}.get(effect.kind)
        if bodies is not None and effect.instance not in bodies:
            sort = "joint" if effect.kind == "load" else "link or joint"
            faults.add(unknown(sort, effect.instance, bodies, scene.origin, path))
        for key, value in table.model_dump().items():
            if not isinstance(value, str) or key == "table":
                continue
            joined = effect.kind == "spring"
            places = linked.joints if joined else events
            if value not in places:
                sort = "joint" if joined else "event"
                faults.add(unknown(sort, value, places, scene.origin, f"{path}.{key}", "Add it, or correct the name"))
        with faults:
            _check_sense(effect, table.model_dump(), path, scene.origin)
        with faults:
            _check_resistance(scene, effect, table.model_dump(), path)
        if effect.name == "inertia" and getattr(table, "m", None) is not None and not known.linkage.output.carrier:
            problem = f"{path}.m needs a link of the output that turns about a fixed axis and counts from the frame"
            remedy = f"Take m out, and give the link's mass in [effects.mass.{known.linkage.output.name}]"
            faults.add(refusal(problem, scene.origin, f"{path}.m", remedy=remedy))
    faults.tell()


def _check_resistance(scene: Scene, effect: kinds.Effect, values: Mapping[str, Any], path: str) -> None:
    """Raise BadInput where the torque of the resistance is not given."""
    if effect.name != PULSED or "torque" not in values or values["table"] is not None:
        return
    if values["torque"] is None and "M0" not in scene.operation:
        problem = "the torque of the resistance is missing"
        raise refusal(problem, scene.origin, f"{path}.torque", remedy="Give torque here, or operation.M0")


def _check_sense(effect: kinds.Effect, values: Mapping[str, Any], path: str, origin: str) -> None:
    """Raise BadInput for keys of a table that mean nothing together."""
    given = {key for key, value in values.items() if value is not None}
    if effect.kind == "load":
        if given.isdisjoint(("x", "y", "table")) or ("table" in given and not given.isdisjoint(("x", "y", "begins"))):
            remedy = "Give x and y, with begins and ends or without, or a table"
            raise refusal("a load needs either constant components or a table", origin, path, remedy=remedy)
        if len(given & {"begins", "ends"}) == 1:
            raise refusal("a load begins at an event and ends at another", origin, path, remedy="Give both, or none")
        if "at" in given and "table" not in given:
            raise refusal("at needs a table", origin, f"{path}.at", remedy="Take it out")
    if {"begins", "ends"} <= given and values["begins"] == values["ends"]:
        raise refusal("it begins where it ends", origin, f"{path}.ends", values["ends"], remedy="Name another")


def _check_targets(scene: Scene, known: LinkageScene) -> None:
    """Raise BadInput for objectives that the scene does not have, or that cannot be minimised or maximised."""
    faults, axes_ = Faults(), scene.schema.axes
    bounded = [name for name, bound in scene.bounds.items() if bound.min < bound.max]
    for name, table in scene.targets.items():
        if not isinstance(table, LinkageTarget):
            continue
        key = f"targets.{name}"
        if name in scene.document.get("targets", {}) and not table.objectives:
            faults.add(
                refusal(
                    "the target has nothing to optimise", scene.origin, key, remedy='Such as least = ["peak_torque"]'
                )
            )
        for figure, sense in dict.fromkeys(table.objectives):
            path_ = f"{key}.{ {PATH: 'point', MATCH: 'match'}.get(figure, sense) }"
            axis = axes_.get(figure)
            if figure not in (*axes_, *bounded):
                faults.add(unknown("figure or bounded number", figure, [*axes_, *bounded], scene.origin, path_))
            elif axis and sense not in axis.senses:
                opposite = "least" if sense == "most" else "most"
                verb, way = ("maximised", "minimised") if sense == "most" else ("minimised", "maximised")
                problem = f"{figure} cannot be {verb}, it can only be {way}"
                faults.add(refusal(problem, scene.origin, path_, remedy=f"Write {opposite}, or choose another figure"))
        if len(dict.fromkeys(table.objectives)) < len(table.objectives):
            faults.add(refusal("a figure is listed twice", scene.origin, key, remedy="Take one out"))
        with faults:
            _check_path(scene, known, name, table)
    faults.tell()


def _check_windows(scene: Scene, known: LinkageScene) -> None:
    """Raise BadInput for a window that ends before it begins, or is longer than a turn."""
    for window in known.windows:
        if window.begins is None or window.ends is None:
            continue
        ends = [scene.mechanism[ref.name] if ref.name else ref.value for ref in (window.begins, window.ends)]
        if not 0.0 < ends[1] - ends[0] < 2 * math.pi:
            span = " to ".join(scene.show(end, "angle") for end in ends)
            remedy = "Give an end after the begin, within one turn"
            raise refusal(f"the window is from {span}", scene.origin, f"windows.{window.name}.ends", remedy=remedy)


def _check_output(scene: Scene, linkage: Linkage) -> None:
    """Raise BadInput for an output that does not move, or an angle that jumps at its cut."""
    phi = np.linspace(0.0, 2 * math.pi, SCAN + 1)
    numbers = free_cams.with_knots(linkage.chain, scene.mechanism)
    given = Given(dict(numbers), {})
    node = Node(phi, linkage.chain.switch(numbers, phi))
    q = np.broadcast_to(np.asarray(linkage.pose(systems.numpy(), given, node).order(0), dtype=np.float64), phi.shape)
    form, name = linkage.output.measure, linkage.output.name
    if np.ptp(q) == 0.0:
        problem = f"the output {form} of {name} does not move"
        raise refusal(problem, scene.origin, f"output.{form}", remedy="Name a part that moves")
    scale = 1.0 if linkage.output.scale is None else number(systems.numpy(), scene.mechanism, linkage.output.scale)
    q = q / scale  # rad, of an angle
    jumps = np.abs(np.diff(q)) > JUMP
    if form != "angle" or not np.any(jumps):
        return
    at = scene.show(float(phi[int(np.argmax(jumps))]), "angle")
    unwrapped = np.unwrap(q)
    if abs(unwrapped[-1] - unwrapped[0]) > math.pi:
        problem = f"the output turns all round: its angle jumps by a turn at crank angle {at}, and it never turns back"
        raise refusal(problem, scene.origin, "output.angle", name, remedy='Name a link that swings, or add "against"')
    middle = float(np.rint(np.degrees((unwrapped.max() + unwrapped.min()) / 2))) * (
        1 if linkage.output.sign > 0 else -1
    )
    problem = f"the output angle of {name} jumps at +-180 deg, at crank angle {at}"
    remedy = f'Count it from where it swings about: zero = "{middle % 360:g} deg" in [output]'
    raise refusal(problem, scene.origin, "output.angle", name, remedy=remedy)


def _check_events(scene: Scene, linkage: Linkage) -> None:
    """Raise BadInput for an event that today's linkage does not have, or has at another crank angle."""
    given = Given(dict(free_cams.with_knots(linkage.chain, scene.mechanism)), {})
    if all(place.angle is not None for place in linkage.places):
        return
    try:
        turns = linkage.turns(given)
        for place in linkage.places:
            if place.extreme:
                _check_extreme(scene, linkage.of(place).turns(given) if place.of else turns, place)
        linkage.hints(given, ())
    except UnfoundError as error:
        key = f"events.{error.event}" if error.event else "output"
        remedy = "Name another event, or let the output be what swings" if error.event else "Correct the dimensions"
        raise refusal(error.problem, scene.origin, key, remedy=remedy) from None


def ambiguity(scene: Scene, turns: Sequence[Turn], place: EventRule) -> str:
    """Sentence on an extreme that other turning points equal within `LEVEL` of the swing; "" for a single one."""
    choice = extreme_turn(tuple(turns), place)
    swing = max(turn.q for turn in turns) - min(turn.q for turn in turns)
    equal = [turn for turn in turns if turn.extreme == place.extreme and abs(turn.q - choice.q) <= LEVEL * swing]
    if place.near is not None or len(equal) < 2:
        return ""
    word = "highest" if place.extreme == "max" else "lowest"
    where = _angles(scene, equal)
    return f"the output is {word}, within {LEVEL:.1%} of its swing, at {where}: {place.name} is ambiguous"


def is_named(scene: Scene, event: str) -> bool:
    """Whether anything of a scene reads an event: an effect, by default too, a limit, a target, or another event."""
    document = scene.document
    others = {name: rule for name, rule in document.get("events", {}).items() if name != event}
    effects = [list(vars(table).values()) for table in scene.effects.values()]

    def has(part: object) -> bool:
        if isinstance(part, Mapping):
            return any(has(key) or has(value) for key, value in part.items())
        if isinstance(part, list):
            return any(map(has, part))
        return isinstance(part, str) and event in re.split(r"\W+", part)

    read = {name: table for name, table in document.items() if name not in ("events", "available", "problem")}
    return has([*read.values(), *others.values(), *effects])


def _angles(scene: Scene, turns: Iterable[Turn]) -> str:
    """Crank angles of turns, in words."""
    return ", ".join(scene.show(turn.angle % (2 * math.pi), "angle", 4) for turn in turns)


def _check_extreme(scene: Scene, turns: Sequence[Turn], place: EventRule) -> None:
    """Raise BadInput for an extreme that is another, or that a small change of the design would exchange."""
    key = f"events.{place.name}"
    subject = place.of or "the output"
    candidates = [turn for turn in turns if turn.extreme == place.extreme]
    word = "highest" if place.extreme == "max" else "lowest"

    if place.near is None:
        problem = ambiguity(scene, turns, place)
        if problem and is_named(scene, place.name):
            raise refusal(problem, scene.origin, key, remedy='Add near = "60 deg"')
        return
    distances = [turn.away(place.near) for turn in turns if turn.extreme != place.extreme]
    if min(distances) < min(turn.away(place.near) for turn in candidates):
        where = scene.show(place.near, "angle")
        problem = f"near {where} {subject} has no {place.extreme}: it is {word} at {_angles(scene, candidates)}"
        raise refusal(problem, scene.origin, f"{key}.near", remedy="Correct near, or name the other extreme")
