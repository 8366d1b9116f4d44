"""The table [parts] of a linkage scene: read into parts, so that a part depends only on those before it.

A number of a part is the name of one in [mechanism], its opposite ("-d"), a multiple ("2 * d", "d / 3"), or a literal
with its unit; the kind of quantity of a name follows from its uses.
"""

import itertools
import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import Annotated, Any, NamedTuple

from loomopt.base.errors import GAP, WHOLE, BadInput, Faults, nearest, shown
from loomopt.base.quantities import Angle, Coordinate, PositiveLength, Quantity, described
from loomopt.physics.mechanisms import chain
from loomopt.physics.mechanisms.cam_laws import LAWS, TURN_LAWS
from loomopt.physics.mechanisms.cam_moves import Move
from loomopt.physics.mechanisms.chain import FRAME_NAME, NOTHING, SENSES, Chain, Part, Ref
from loomopt.scenes.cursor import Cursor

PositiveAngle = Annotated[float, Quantity("angle", above=0, below=2 * math.pi)]
DwellAngle = Annotated[float, Quantity("angle", least=0, below=2 * math.pi)]
SignedNumber = Annotated[float, Quantity("number")]

Json = dict[str, Any]
Kind = Any
"""Type of a number: an annotated float of `base.quantities`."""
Used = dict[str, tuple[Kind, str]]
"""Numbers of [mechanism] by name, in the order of their first use: kind and description of each."""

MOST_PARTS, LONGEST_NAME = 100, 40
"""Parts of a linkage that is still one, and letters of a name that fits a table."""
_NAME = re.compile(r"[^\W\d_]\w*")
_FACTOR = r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)"
_MULTIPLE = re.compile(rf"(-?)\s*(?:({_FACTOR})\s*\*\s*)?([^\W\d_]\w*)(?:\s*/\s*({_FACTOR}))?")
"""A name, or a multiple of it: sign, factor, name, divisor."""


class NumberKey(NamedTuple):
    """Number of a table; kind: kind of quantity; needed: whether it is required.

    text: description, with {} for the table's name and {key} for another word of the table.
    """

    kind: Kind
    text: str
    needed: bool = False


class WordKey(NamedTuple):
    """A word of a part; sort: what it names, a key of _SORTS; needed: always."""

    sort: str
    needed: bool = False


JOINT, LINK, NEW_JOINT, NEW_LINK = "joint", "link", "new joint", "new link"
RATIO, WHOLE_RATIO, PAIR = "ratio", "whole ratio", "two joints"
LAW, MOVE_LAW, KNOTS = "law", "law of a move", "intervals"
ONE_LINK, TWO_LINKS, LEFT_RIGHT, AHEAD_BEHIND = "one link", "two links", "left or right", "ahead or behind"
SLIDE, EVENT, ANGLE = "slider or slot", "event", "angle"
SENSE, EXTREME, REST = "sense", "extreme", "end of a rest"
Keys = Mapping[str, WordKey | NumberKey]
"""Keys of a table, in the order shown."""

_TURNING: Keys = {
    "at": WordKey(JOINT, True),
    "pin": WordKey(NEW_JOINT),
    "length": NumberKey(PositiveLength, "length of {}"),
}
KEYS: Mapping[str, Keys] = {
    "pivot": {"x": NumberKey(Coordinate, "x of pivot {}"), "y": NumberKey(Coordinate, "y of pivot {}")},
    "crank": {
        **_TURNING,
        "start": NumberKey(Angle, "angle of crank {} at crank angle 0"),
        "ratio": WordKey(WHOLE_RATIO),
    },
    "dyad": {
        "joins": WordKey(PAIR, True),
        "pin": WordKey(NEW_JOINT, True),
        "side": WordKey(LEFT_RIGHT, True),
        "links": WordKey(TWO_LINKS, True),
    },
    "slider": {
        "from": WordKey(JOINT, True),
        "through": WordKey(JOINT, True),
        "guide": WordKey(LINK),
        "direction": NumberKey(Angle, "direction of the guide of {}"),
        "offset": NumberKey(Coordinate, "guide of {} to the left of its joint"),
        "side": WordKey(AHEAD_BEHIND, True),
        "pin": WordKey(NEW_JOINT, True),
        "links": WordKey(ONE_LINK, True),
    },
    "slot": {
        "at": WordKey(JOINT, True),
        "through": WordKey(JOINT, True),
        "link": WordKey(NEW_LINK, True),
        "offset": NumberKey(Coordinate, "slot of {} to the left of its joint"),
        "pin": WordKey(NEW_JOINT),
        "length": NumberKey(PositiveLength, "pin of {} from its joint"),
    },
    "point": {
        "on": WordKey(LINK, True),
        "radius": NumberKey(PositiveLength, "distance of point {} from its link's first joint"),
        "angle": NumberKey(Angle, "angle of point {} from its link's line"),
        "along": NumberKey(Coordinate, "place of point {} along its link's line"),
        "across": NumberKey(Coordinate, "place of point {} to the left of its link's line"),
    },
    "gear": {
        **_TURNING,
        "with": WordKey(LINK, True),
        "carrier": WordKey(LINK),
        "ratio": WordKey(RATIO, True),
        "start": NumberKey(Angle, "angle of gear {} when its mate is at the angle zero"),
        "zero": NumberKey(Angle, "angle of the mate of gear {} from which it counts"),
    },
    "cam": {
        **_TURNING,
        "law": WordKey(LAW, True),
        "start": NumberKey(Angle, "angle of cam follower {} in its lower dwell"),
        "lift": NumberKey(Angle, "angle by which cam follower {} rises", True),
        "begins": NumberKey(Angle, "crank angle where cam follower {} begins to rise"),
        "rise": NumberKey(PositiveAngle, "crank angle over which cam follower {} rises", True),
        "far_dwell": NumberKey(DwellAngle, "crank angle over which cam follower {} stays up"),
        "return": NumberKey(PositiveAngle, "crank angle over which cam follower {} returns", True),
        "shaft": WordKey(JOINT),
        "sense": WordKey(SENSE),
    },
    "roller": {
        "at": WordKey(JOINT, True),
        "cam": WordKey(LINK, True),
        "radius": NumberKey(PositiveLength, "radius of roller {}", True),
    },
}
"""Keys of each kind of part, in the order shown; of a cam in its short form."""
_SHORT = ("law", "lift", "rise", "far_dwell", "return")
LISTED_CAM: Keys = {
    **{key: entry for key, entry in KEYS["cam"].items() if key not in _SHORT},
    "begins": NumberKey(Angle, "crank angle where the first move of cam follower {} begins"),
}
"""Keys of a cam that lists its moves, beside the list `moves`."""
MOVE_KEYS: Keys = {
    "angle": NumberKey(PositiveAngle, "crank angle that {} takes", True),
    "to": NumberKey(Angle, "angle of the follower at the end of {}"),
    "law": WordKey(MOVE_LAW),
    "slope": NumberKey(SignedNumber, "first derivative of the follower's angle at the end of {}"),
    "bend": NumberKey(SignedNumber, "second derivative of the follower's angle at the end of {}"),
    "jerk": NumberKey(SignedNumber, "third derivative of the follower's angle at the end of {}"),
    "knots": WordKey(KNOTS),
}
"""Keys of a move of a cam; without `to` it is a dwell."""
_DERIVATIVES = ("slope", "bend", "jerk")
MOST_KNOTS = 64
"""Intervals of the spline of a move."""

# Names and numbers, for the scene's other tables too.


NAME_ALLOWED = f"up to {LONGEST_NAME} letters, digits and _, a letter first"


def check_name(cursor: Cursor, name: str, taken: Mapping[str, str] | None = None) -> None:
    """Raise BadInput for an invalid name; taken: reserved names, with their meanings."""
    if not _NAME.fullmatch(name) or len(name) > LONGEST_NAME:
        raise cursor.fault("it is not a name", name, NAME_ALLOWED, "Give it another name")
    if taken and name in taken:
        raise cursor.fault(f"{name} is the name of {taken[name]}", remedy="Give it another name")


class Numbers:
    """Numbers of [mechanism] by name, with their uses, in the order of their first use."""

    def __init__(self, names: Mapping[str, object]) -> None:
        self.names = names
        self.uses: Used = {}

    def read(self, cursor: Cursor, kind: Kind, text: str) -> Ref:
        """Number that a part or event names, or a literal with its unit; text: its description. Raises BadInput."""
        number = self._reference(cursor, kind)
        if number.name:
            self._use(cursor, number.name, _divided(kind, number.factor), text)
        return number

    def _reference(self, cursor: Cursor, kind: Kind) -> Ref:
        quantity: Quantity = kind.__metadata__[0]
        raw = cursor.raw
        if not isinstance(raw, str):
            if quantity.kind == "number" and isinstance(raw, int | float) and not isinstance(raw, bool):
                return Ref("", 1, cursor.number(quantity))
            allowed = f"the name of a number of [mechanism], or {described(quantity.kind)}"
            problem = "it is neither the name of a number nor a quantity"
            raise cursor.fault(problem, raw, allowed, "Write either, in quotes")
        text = raw.strip()
        name, factor = multiple(text)
        if factor == 0:
            raise cursor.fault("the factor of a number must not be 0", raw, remedy=f'Write "{name}"')
        if name in self.names:
            positive = quantity.least >= 0 or quantity.above >= 0
            if positive and factor < 0:
                raise cursor.fault("it cannot be negative", raw, remedy=f'Write "{text.removeprefix("-").strip()}"')
            return Ref(name, factor)
        if name[:1] in (*"+.0123456789", ""):
            return Ref("", 1, cursor._replace(raw=text).number(quantity))
        remedy = "Add it to [mechanism], or correct the name"
        raise cursor.unknown("number of [mechanism]", name, self.names, remedy)

    def _use(self, cursor: Cursor, name: str, kind: Kind, text: str) -> None:
        """Note a use of a number. Raises BadInput where it is used as two kinds of quantity."""
        if name not in self.uses:
            self.uses[name] = kind, text
            return
        known, words = self.uses[name]
        first, second = known.__metadata__[0], kind.__metadata__[0]
        if first.kind != second.kind:
            problem = f"{name} is used as two kinds of quantity: {first.kind} ({words}) and {second.kind} ({text})"
            raise cursor.fault(problem, remedy="Give each a number of its own")
        narrower = (
            kind if (second.least, second.above, -second.below) > (first.least, first.above, -first.below) else known
        )
        self.uses[name] = narrower, f"{words}; {text}"


def multiple(text: str) -> tuple[str, float]:
    """Name in a text such as "-d", "2 * d" or "d / 3", and its factor; the factor 0 where none is possible."""
    match = _MULTIPLE.fullmatch(text)
    if match is None or not (match[2] or match[4]):
        name = text.removeprefix("-").strip()
        return name, 1 if name == text else -1
    top, bottom = (float(match[place] or 1) for place in (2, 4))
    size = top / bottom if bottom > 0.0 else 0.0
    if not 0.0 < size < math.inf:
        return match[3], 0
    size = int(size) if size == int(size) else size
    return match[3], -size if match[1] else size


def _divided(kind: Kind, factor: float) -> Kind:
    """Quantity of a number of which a multiple is used."""
    quantity: Quantity = kind.__metadata__[0]
    if factor in (1, -1) or math.isinf(quantity.below):
        return kind
    return Annotated[float, quantity._replace(below=quantity.below / abs(factor))]


# What one key holds: how it is read, and how an editor checks it.


class Sort(NamedTuple):
    """Sort of a word: read(cursor) returns it or raises BadInput; schema() returns its JSON Schema."""

    read: Callable[[Cursor], Any]
    schema: Callable[[], Json]


NAME_SCHEMA: Json = {"type": "string", "pattern": rf"^[^\s!-@\[-`{{-~][^\s!-/:-@\[-^`{{-~]{{0,{LONGEST_NAME - 1}}}$"}
"""A new name of the scene, as `check_name` reads it."""


def text_of(raw: object) -> str:
    """A raw word as a message shows it."""
    return raw if isinstance(raw, str) else shown(raw)


def _choice(*names: str, sort: str = "choice") -> Sort:
    return Sort(lambda cursor: cursor.word(names, sort), lambda: {"enum": list(names)})


def _name(cursor: Cursor) -> str:
    if not isinstance(cursor.raw, str):
        raise cursor.fault("it is not a name", cursor.raw, NAME_ALLOWED, 'Write a name in quotes, such as "B"')
    check_name(cursor, cursor.raw)
    return cursor.raw


def _new_name(cursor: Cursor) -> str:
    name = _name(cursor)
    check_name(cursor, name, {FRAME_NAME: "what does not move"})
    return name


def _pair(cursor: Cursor) -> tuple[str, ...]:
    raw = cursor.raw
    if not isinstance(raw, list | tuple) or len(raw) != 2:
        remedy, allowed = 'Write two, such as ["B", "D"]', "a list of two joints"
        raise cursor.fault("a dyad joins two joints", raw, allowed, remedy)
    first, second = (_name(cursor.at(place)) for place in (1, 2))
    if first == second:
        raise cursor.fault(f"both ends of the dyad are joint {first}", remedy="Name two joints")
    return first, second


def _links(count: int, example: str) -> Sort:
    def read(cursor: Cursor) -> tuple[str, ...]:
        if not isinstance(cursor.raw, Mapping) or len(cursor.raw) != count:
            problem = f"it has {count} link{'s' * (count > 1)}, each with its length"
            raise cursor.fault(problem, cursor.raw, f"a table such as {example}", "Write one")
        return tuple(_new_name(cursor.at(name)._replace(raw=name)) for name in cursor.raw)

    def schema() -> Json:
        lengths = number_schema(NumberKey(PositiveLength, "its length"))
        ends: Json = {"minProperties": count, "maxProperties": count}
        return {"type": "object", "additionalProperties": lengths, "propertyNames": NAME_SCHEMA, **ends}

    return Sort(read, schema)


def _ratio(cursor: Cursor) -> int | float:
    value = cursor.number(Quantity("number"))
    if value == 0 or abs(value) > MOST_PARTS:
        allowed = f"a number but 0, at most {MOST_PARTS} in size; negative where it turns the other way"
        raise cursor.fault("it is not a ratio", cursor.raw, allowed, "Correct it")
    return int(value) if value == int(value) else value


def _whole_ratio(cursor: Cursor) -> int:
    ratio = _ratio(cursor)
    if not isinstance(ratio, int):
        remedy = "After a turn of the main shaft it must stand as before: a whole number, negative the other way round"
        raise cursor.fault("it is not a whole number", cursor.raw, remedy=remedy)
    return ratio


def _intervals(cursor: Cursor) -> int:
    raw = cursor.raw
    if not isinstance(raw, int) or isinstance(raw, bool) or not 2 <= raw <= MOST_KNOTS:
        remedy = "It is the number of intervals of a free law, at whose knots it is designed"
        raise cursor.fault("it is not a number of intervals", raw, f"a whole number from 2 to {MOST_KNOTS}", remedy)
    return raw


def number_schema(number: NumberKey) -> Json:
    """JSON Schema of a number of the linkage: a quantity, or the name of a number of [mechanism]."""
    quantity = number.kind.__metadata__[0].schema()
    name: Json = {"type": "string", "pattern": r"^[ \t]*-?[ \t]*([0-9.]+[ \t]*\*[ \t]*)?[^\s\d+.*-]"}
    words = re.sub(r" (?:of|from|between|and) (?:\{\w*\})+| \{\w*\}", "", number.text)
    description = f'{words}: a number of [mechanism], a multiple of one such as "2 * d", or a quantity'
    return {"if": name, "else": quantity, "description": description}


def _name_schema() -> Json:
    return NAME_SCHEMA


def _pair_schema() -> Json:
    return {"type": "array", "items": NAME_SCHEMA, "minItems": 2, "maxItems": 2, "uniqueItems": True}


_KNOWN_NAME, _FRESH_NAME = Sort(_name, _name_schema), Sort(_new_name, _name_schema)
_SORTS: Mapping[str, Sort] = {
    JOINT: _KNOWN_NAME,
    LINK: _KNOWN_NAME,
    SLIDE: _KNOWN_NAME,
    EVENT: _KNOWN_NAME,
    NEW_JOINT: _FRESH_NAME,
    NEW_LINK: _FRESH_NAME,
    RATIO: Sort(_ratio, Quantity("number").schema),
    WHOLE_RATIO: Sort(_whole_ratio, Quantity("number").schema),
    ANGLE: Sort(lambda cursor: cursor.number(Quantity("angle")), Quantity("angle").schema),
    LAW: _choice(*LAWS),
    MOVE_LAW: _choice(*LAWS, *TURN_LAWS),
    KNOTS: Sort(_intervals, lambda: {"type": "integer", "minimum": 2, "maximum": MOST_KNOTS}),
    PAIR: Sort(_pair, _pair_schema),
    ONE_LINK: _links(1, '{ rod = "l2" }'),
    TWO_LINKS: _links(2, '{ rod = "l2", rocker = "l3" }'),
    LEFT_RIGHT: _choice("left", "right"),
    AHEAD_BEHIND: _choice("ahead", "behind"),
    SENSE: _choice(*SENSES, sort=SENSE),
    EXTREME: _choice("max", "min", sort=EXTREME),
    REST: _choice("begins", "ends", sort=REST),
}


def keys_schema(known: Keys, kind: str = "") -> Json:
    """JSON Schema of a table that holds these keys and no others; kind: of a part."""
    schemas = {
        key: number_schema(entry) if isinstance(entry, NumberKey) else _SORTS[entry.sort].schema()
        for key, entry in known.items()
    }
    properties: Json = {"kind": {"const": kind}, **schemas} if kind else schemas
    needed = [key for key in properties if key == "kind" or known[key].needed]
    return {"type": "object", "properties": properties, "required": needed, "additionalProperties": False}


def schema() -> Json:
    """JSON Schema of [parts]."""
    rules: list[Json] = [
        {
            "if": {"properties": {"kind": {"const": kind}}},
            "then": _cam_schema() if kind == "cam" else keys_schema(known, kind),
        }
        for kind, known in KEYS.items()
    ]
    part: Json = {
        "type": "object",
        "required": ["kind"],
        "properties": {"kind": {"enum": list(KEYS)}},
        "allOf": rules,
    }
    names: Json = {"propertyNames": NAME_SCHEMA, "minProperties": 1, "maxProperties": MOST_PARTS}
    return {"type": "object", "additionalProperties": part, **names}


def _cam_schema() -> Json:
    """JSON Schema of a cam, which lists its moves or gives rise, dwell and return."""
    listed = keys_schema(LISTED_CAM, "cam")
    moves: Json = {"type": "array", "minItems": 2, "maxItems": MOST_PARTS, "items": keys_schema(MOVE_KEYS)}
    listed |= {"properties": listed["properties"] | {"moves": moves}, "required": [*listed["required"], "moves"]}
    return {"if": {"required": ["moves"]}, "then": listed, "else": keys_schema(KEYS["cam"], "cam")}


class TableEntries(NamedTuple):
    """Entries of a table: its words by key, and its numbers by key (of a link by its name), both in its order."""

    words: Mapping[str, Any]
    numbers: Mapping[str, Ref]


def entries(cursor: Cursor, known: Keys, numbers: Numbers, of: str = "", name: str = "") -> TableEntries:
    """Words and numbers of a table. Raises BadInput with all mistakes.

    known: the keys that it may hold; numbers: those of [mechanism]; of: what the table is, in words; name: its name.
    """
    cursor = cursor.apart()
    table, words, read = cursor.entries(), dict[str, Any](), dict[str, Ref]()
    strange = [key for key in table if key not in known and key != "kind"]
    for key in strange:
        cursor.faults.add(table[key].unknown(f"key of {of}" if of else "key", key, known, given=table))
    near = {nearest(key, known, table) for key in strange}
    texts = {key: text_of(table[key].raw if key in table else "") for key in known if isinstance(known[key], WordKey)}
    for key, sort in known.items():
        if key not in table:
            if sort.needed and key not in near:
                cursor.faults.add(cursor.at(key).fault(f"{of or 'the table'} needs {key}", remedy="Add it", grade=GAP))
            continue
        with cursor.faults:
            if isinstance(sort, NumberKey):
                read[key] = numbers.read(table[key], sort.kind, sort.text.format(name, **texts))
            else:
                words[key] = _SORTS[sort.sort].read(table[key])
        if key == "links" and isinstance(table[key].raw, Mapping):
            for link, length in table[key].entries().items():
                with cursor.faults:
                    read[link] = numbers.read(length, PositiveLength, f"length of {link}")
    cursor.faults.tell()
    return TableEntries(words, read)


# One part.


def _part(name: str, cursor: Cursor, numbers: Numbers) -> Part | None:
    """Part; None if mistakes prevent it."""
    faults = cursor.faults
    before = len(faults.mistakes)
    with faults:
        check_name(cursor, name, {FRAME_NAME: "what does not move"})
    with faults:
        kind = _kind(cursor)
        listed = kind == "cam" and cursor.at("moves").raw is not None
        moves = _moves(cursor.at("moves"), numbers, name) if listed else NO_MOVES
        table = {key: value for key, value in cursor.table().items() if key != "moves"} if listed else cursor.raw
        keys = LISTED_CAM if listed else KEYS[kind]
        read = entries(
            cursor._replace(raw=table), keys, numbers, f"a {kind} with moves" if listed else f"a {kind}", name
        )
        words, refs = {**read.words, **moves.words}, {**read.numbers, **moves.numbers}
        part = Part(kind, name, tuple(words.items()), tuple(refs.items()))
        if len(faults.mistakes) == before:
            _check_sense(cursor, part)
            return part
    return None


def _kind(cursor: Cursor) -> str:
    """Kind of a part. Raises BadInput."""
    if not isinstance(cursor.raw, Mapping):
        raise cursor.fault("a part is a table", cursor.raw, 'a table, such as { kind = "pivot" }', "Write one")
    place = cursor.at("kind")
    if "kind" not in cursor.raw:
        raise place.fault("the part has no kind", allowed=", ".join(KEYS), remedy="Add it", grade=GAP)
    return place.word(KEYS, "kind of part")


def _check_sense(cursor: Cursor, part: Part) -> None:
    """Raise BadInput for keys that mean nothing together."""
    numbers, pin = part.numbers, part.word("pin")
    if "length" in KEYS[part.kind] and bool(pin) != ("length" in numbers):
        missing, problem = ("length", f"pin {pin} needs a length") if pin else ("pin", "length is that of a pin")
        raise cursor.at(missing).fault(problem, remedy=f"Add {missing}", grade=GAP)
    if part.kind == "point":
        polar = {"radius", "angle"} & numbers.keys()
        cartesian = {"along", "across"} & numbers.keys()
        if polar and cartesian:
            problem = (
                f"{' and '.join(sorted(polar))} and {' and '.join(sorted(cartesian))} define the same quantity twice"
            )
            raise cursor.fault(problem, remedy="Give radius and angle, or along and across")
        if "radius" not in numbers and not cartesian:
            raise cursor.fault("the point has no place", remedy="Add radius and angle, or along and across")
    if part.kind == "gear" and part.word("with") == (part.word("carrier") or FRAME_NAME):
        remedy = "Name another link, or another carrier (without one it is the frame)"
        raise cursor.at("with").fault("its mate does not turn against its carrier", remedy=remedy)
    if part.kind == "cam":
        spent = sum(ref.value for key, ref in numbers.items() if key in _SHORT[2:] or key.endswith(".angle"))
        if numbers.get("lift") == NOTHING:
            raise cursor.at("lift").fault("the cam lifts nothing", remedy="Give an angle other than 0")
        if spent > 2 * math.pi:
            what = "the moves" if part.moves else "rise, far_dwell and return"
            raise cursor.fault(f"{what} are more than a turn", remedy="Make them shorter")
    same = [key for key in ("from", "at") if part.word(key) and part.word(key) == part.word("through")]
    if same:
        raise cursor.at("through").fault(f"{same[0]} and through are one joint", remedy="Name two joints")


# Moves of a cam.


NO_MOVES = TableEntries({}, {})


def _moves(cursor: Cursor, numbers: Numbers, cam: str) -> TableEntries:
    """List of a cam's moves: the moves as a word, and their numbers. Raises BadInput with all mistakes."""
    cursor = cursor.apart()
    raw = cursor.raw
    if not isinstance(raw, list | tuple) or not 1 < len(raw) <= MOST_PARTS:
        allowed = f"a list of 2 to {MOST_PARTS} tables"
        remedy = 'Such as [{ angle = "70 deg", to = "23 deg" }, { angle = "70 deg", to = "0 deg" }]'
        raise cursor.fault("the moves are not a list of tables", raw, allowed, remedy)
    places, read = [cursor.at(k) for k in range(1, len(raw) + 1)], list[TableEntries]()
    for k, place in enumerate(places, 1):
        with cursor.faults:
            place.table()
            read.append(entries(place, MOVE_KEYS, numbers, "a move", f"move {k} of {cam}"))
    cursor.faults.tell()
    for fault in _move_faults(cursor, read):
        cursor.faults.add(fault)
    cursor.faults.tell()
    moves, before = list[Move](), NOTHING
    for k, move in enumerate(read):
        end = move.numbers.get("to", before)
        law = None if end == before else move.words.get("law", "")
        if law in TURN_LAWS:
            turns_before = bool(moves) and moves[-1].law in TURN_LAWS and not moves[-1].back
            rests_after = k + 1 == len(read) or "to" not in read[k + 1].numbers
            back = turns_before or (rests_after and bool(moves) and moves[-1].law is not None)
        else:
            back = bool(law) and end == NOTHING
        intervals = move.words.get("knots", 1)
        free = intervals > 1 and k + 1 < len(read) and read[k + 1].words.get("knots", 1) > 1
        moves.append(Move(law, back, intervals, open_end=free and "bend" not in move.numbers))
        before = end
    refs = {f"moves.{k}.{key}": ref for k, move in enumerate(read, 1) for key, ref in move.numbers.items()}
    return TableEntries({"moves": tuple(moves)}, refs)


def _move_faults(cursor: Cursor, read: Sequence[TableEntries]) -> Iterator[BadInput]:
    """Mistakes of moves that are no motion together: it begins and ends at rest at the angle 0."""
    heights = list(itertools.accumulate((move.numbers.get("to") for move in read), _latest, initial=NOTHING))
    still = [before == after for before, after in itertools.pairwise(heights)]
    if heights[-1] != NOTHING:
        problem = "the last move does not end at the angle 0, where the first one begins"
        yield cursor.at(len(read)).at("to").fault(problem, remedy='Let it end at to = "0 deg"')
    for k, (move, rests) in enumerate(zip(read, still, strict=True), 1):
        place, given = cursor.at(k), [key for key in _DERIVATIVES if move.numbers.get(key, NOTHING) != NOTHING]
        last = k == len(read)
        if rests and "to" in move.numbers:
            yield place.at("to").fault("the move ends where it begins", remedy="For a dwell take it out")
        elif rests and (law_key := next((key for key in ("law", "knots") if key in move.words), "")):
            yield place.at(law_key).fault(f"move {k} is a dwell, which has no law", remedy="Take it out, or add to")
        elif {"law", "knots"} <= move.words.keys():
            yield place.at("knots").fault("a law with a name has no knots", remedy="Take out law, or knots")
        elif given and (rests or last or still[k]):
            problem = f"the follower rests after move {k}, so its {given[0]} there is 0"
            yield place.at(given[0]).fault(problem, remedy="Take it out, or let another move follow")
        elif given:
            for number in (k, k + 1):
                if law := read[number - 1].words.get("law"):
                    problem = f"{law} has derivatives of its own at its ends, and {given[0]} is another one"
                    yield cursor.at(number).at("law").fault(problem, remedy=f"Take out the law or {given[0]}")
        if rests and not last and still[k]:
            yield cursor.at(k + 1).fault("two dwells follow one another", remedy="Write one that takes both angles")


def _latest(before: Ref, after: Ref | None) -> Ref:
    return before if after is None else after


# All parts.


def linked(cursor: Cursor, numbers: Numbers) -> Chain:
    """Table [parts], in an order that can be evaluated; numbers: those of [mechanism]. Raises BadInput."""
    raw, cursor = cursor.raw, cursor.apart()
    if not isinstance(raw, Mapping):
        raise cursor.fault("it is not a table", raw, remedy="Write a table [parts]", grade=WHOLE)
    if len(raw) > MOST_PARTS:
        problem = f"{len(raw)} parts are too many"
        raise cursor.fault(problem, allowed=f"up to {MOST_PARTS}", remedy="Take out parts that drive nothing")
    read = [_part(name, place, numbers) for name, place in cursor.entries().items()]
    parts = [part for part in read if part is not None]
    if len(parts) == len(read):
        for fault in _name_faults(cursor, parts):
            cursor.faults.add(fault)
    cursor.faults.tell()
    return _chain(cursor, parts)


def _name_faults(cursor: Cursor, parts: Sequence[Part]) -> Iterator[BadInput]:
    """Mistakes in the names that parts place and hang on."""
    joints = {name: part.name for part in reversed(parts) for name in chain.joints_of(part)}
    links = {name: part.name for part in reversed(parts) for name in chain.links_of(part)}
    placed: dict[str, tuple[str, str]] = {}
    for part in parts:
        place = cursor.at(part.name)
        for sort, new_names in (("joint", chain.joints_of(part)), ("link", chain.links_of(part))):
            for name in new_names:
                if name in placed:
                    yield _double_name(place, name, sort, part, *placed[name])
                else:
                    placed[name] = part.name, sort
        for sort, names, known, others in (
            ("joint", chain.wanted_joints(part), joints, links),
            ("link", chain.wanted_links(part), links, joints),
        ):
            for name in names:
                if name in known:
                    continue
                where = place.at(_key_of(part, name))
                if name in others or name == FRAME_NAME:
                    description = "the frame" if name == FRAME_NAME else f"a {'link' if sort == 'joint' else 'joint'}"
                    problem = f"{name} is {description}, but a {sort} is needed"
                    yield where.fault(problem, allowed=", ".join(known), remedy=f"Name a {sort}")
                else:
                    yield where.unknown(sort, name, known, f"Add a part that places {name}")
    if parts and not any(part.kind in ("crank", "cam") for part in parts):
        remedy = 'Add a part such as crank = { kind = "crank", at = "A", pin = "B", length = "l1" }'
        yield cursor.fault("nothing is driven: there is no crank", remedy=remedy, grade=GAP)
    if not parts:
        yield cursor.fault("there are no parts", remedy="Add a pivot, a crank and a dyad", grade=GAP)


def _double_name(cursor: Cursor, name: str, sort: str, part: Part, first: str, before: str) -> BadInput:
    """Mistake of a name that two parts place; first: the other part; before: what it places, a joint or a link."""
    if before != sort:
        return cursor.fault(f"{name} is the name of a {before} and of a {sort}", remedy="Rename one")
    if sort == "link":
        return cursor.fault(f"{name} is a link of {first} and of {part.name}", remedy="Rename one")
    problem = f"{name} is placed by {first} and by {part.name}: the linkage has a loop too many and cannot move"
    return cursor.fault(problem, remedy=f"Give {part.name} a joint of its own, or take one of the two out")


def _key_of(part: Part, name: str) -> str:
    if name in part.names("joins"):
        return "joins"
    keys = (key for key, entry in KEYS[part.kind].items() if isinstance(entry, WordKey) and part.word(key) == name)
    return next(keys, "kind")


def _chain(cursor: Cursor, parts: Sequence[Part]) -> Chain:
    """Parts in an order in which a part depends only on those before it, else in the given order. Raises BadInput."""
    waiting, known, order = list(parts), set[str](), list[Part]()
    while waiting:
        ready = next((part for part in waiting if known.issuperset(chain.wants(part))), None)
        if ready is None:
            raise _cycle_fault(cursor, waiting, known)
        known.update(chain.provides(ready))
        order.append(ready)
        waiting.remove(ready)
    return Chain(tuple(order))


def _cycle_fault(cursor: Cursor, waiting: Sequence[Part], known: Collection[str]) -> BadInput:
    """Mistake of parts that depend on each other, without those that only depend on them."""
    while True:
        wanted = {name for part in waiting for name in chain.wants(part)}
        ring = [part for part in waiting if wanted.intersection(chain.provides(part))]
        if len(ring) == len(waiting):
            break
        waiting = ring
    lacking = "; ".join(f"{p.name} for {', '.join(n for n in chain.wants(p) if n not in known)}" for p in waiting)
    problem = f"parts depend on each other ({lacking}): together they are an Assur group of class III or higher"
    remedy = "Only chains of dyads, sliders and slots close in closed form: drive it at another link"
    allowed = "parts that depend only on joints and links of earlier parts"
    return cursor.at(waiting[0].name).fault(problem, allowed=allowed, remedy=remedy)


SAYS_NOTHING = ("problem", "mechanism", "parts")
"""Tables that read no part."""


def demand_used(linked: Chain, document: Mapping[str, Any]) -> None:
    """Raise BadInput for parts that nothing reads; document: the raw scene.

    A part is read if another part uses it, or if another table names it, one of its joints or one of its links. A point
    may be unread, because its path is drawn.
    """
    words = {word for name, table in document.items() if name not in SAYS_NOTHING for word in _words(table)}
    table, wanted = Cursor(linked, "parts", Faults()), set[str]()
    for part in reversed(linked.parts):
        provided = {part.name, *chain.provides(part)}
        if part.kind in ("point", "roller") or provided & (words | wanted):
            wanted.update(chain.wants(part))
            continue
        problem = f"part {part.name} is not used: no other part depends on it, and no table names it"
        table.faults.add(table.at(part.name).fault(problem, remedy="Take it out, or name it in a table"))
    table.faults.tell()


def _words(raw: object) -> Iterator[str]:
    """Yield every word of a table's keys and texts."""
    if isinstance(raw, Mapping):
        for key, value in raw.items():
            yield from _words(key)
            yield from _words(value)
    elif isinstance(raw, list | tuple):
        for value in raw:
            yield from _words(value)
    elif isinstance(raw, str):
        yield from re.findall(r"\w+", raw)


def kinds_of(linked: Chain) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """Names of joints, of links, and of parts in which something slides."""
    return linked.joints, linked.links, linked.slides
