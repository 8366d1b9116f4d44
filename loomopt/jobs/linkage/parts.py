"""The table [parts] of a linkage scene: read into parts, so that a part depends only on those before it.

A number of a part is the name of one in [mechanism], its opposite ("-d"), a multiple ("2 * d", "d / 3"), or a literal
with its unit; the kind of quantity of a name follows from its uses.
"""

import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import Annotated, Any, NamedTuple

from loomopt.base.errors import GAP, WHOLE, BadInput, Faults, nearest, shown
from loomopt.base.quantities import Angle, Coordinate, PositiveLength, Quantity, described
from loomopt.physics.mechanisms import chain
from loomopt.physics.mechanisms.cam_laws import LAWS
from loomopt.physics.mechanisms.chain import FRAME_NAME, Chain, Part, Ref
from loomopt.scenes.cursor import Cursor

PositiveAngle = Annotated[float, Quantity("angle", above=0, below=2 * math.pi)]
DwellAngle = Annotated[float, Quantity("angle", least=0, below=2 * math.pi)]

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
RATIO, WHOLE_RATIO, LAW, PAIR = "ratio", "whole ratio", "law", "two joints"
ONE_LINK, TWO_LINKS, LEFT_RIGHT, AHEAD_BEHIND = "one link", "two links", "left or right", "ahead or behind"
SLIDE, EVENT, ANGLE = "slider or slot", "event", "angle"
SENSE, EXTREME, REST = "sense", "extreme", "end of a rest"
SENSES = {"forward": 1, "backward": -1, "counter-clockwise": 1, "clockwise": -1}
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
    },
}
"""Keys of each kind of part, in the order shown."""

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
        {"if": {"properties": {"kind": {"const": kind}}}, "then": keys_schema(known, kind)}
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
        read = entries(cursor, KEYS[kind], numbers, f"a {kind}", name)
        part = Part(kind, name, tuple(read.words.items()), tuple(read.numbers.items()))
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
        spent = sum(numbers[key].value for key in ("rise", "far_dwell", "return") if key in numbers)
        if numbers["lift"] == Ref(""):
            raise cursor.at("lift").fault("the cam lifts nothing", remedy="Give an angle other than 0")
        if spent > 2 * math.pi:
            raise cursor.fault("rise, far_dwell and return are more than a turn", remedy="Make them shorter")
    same = [key for key in ("from", "at") if part.word(key) and part.word(key) == part.word("through")]
    if same:
        raise cursor.at("through").fault(f"{same[0]} and through are one joint", remedy="Name two joints")


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
        if part.kind == "point" or provided & (words | wanted):
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
