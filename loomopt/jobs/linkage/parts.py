"""The table [parts] of a linkage scene: read into parts in an order in which each hangs on those before it.

A number of a part is the name of one in [mechanism], its opposite ("-d"), or a literal with its unit; what kind of
quantity a name stands for follows from its uses.
"""

import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from typing import Annotated, Any, NamedTuple

from loomopt.base.errors import GAP, WHOLE, BadInput, Faults, misread, nearest, refusal, shown, unknown
from loomopt.base.quantities import Angle, Coordinate, PositiveLength, Quantity, described
from loomopt.base.units import QuantityError
from loomopt.physics.mechanisms import chain
from loomopt.physics.mechanisms.cam_laws import LAWS
from loomopt.physics.mechanisms.chain import FRAME_NAME, Chain, Part, Ref

PositiveAngle = Annotated[float, Quantity("angle", above=0, below=2 * math.pi)]
DwellAngle = Annotated[float, Quantity("angle", least=0, below=2 * math.pi)]

Json = dict[str, Any]
Kind = Any
"""What a number may be: an annotated float of `base.quantities`."""
Used = dict[str, tuple[Kind, str]]
"""Numbers of [mechanism] by name, in the order of their first use: what each may be, and what it is in words."""

MOST_PARTS, LONGEST_NAME = 100, 40
"""Parts of a linkage that is still one, and letters of a name that fits a table."""
_NAME = re.compile(r"[^\W\d_]\w*")


class Number(NamedTuple):
    """A number of a table; kind: what it may be; needed: always.

    text: what it is in words, {} for the table's name, {key} for another word of the table.
    """

    kind: Kind
    text: str
    needed: bool = False


class Word(NamedTuple):
    """A word of a part; sort: what it names, a key of _SORTS; needed: always."""

    sort: str
    needed: bool = False


JOINT, LINK, NEW_JOINT, NEW_LINK = "joint", "link", "new joint", "new link"
RATIO, WHOLE_RATIO, LAW, PAIR = "ratio", "whole ratio", "law", "two joints"
ONE_LINK, TWO_LINKS, LEFT_RIGHT, AHEAD_BEHIND = "one link", "two links", "left or right", "ahead or behind"
SLIDE, EVENT, ANGLE = "slider or slot", "event", "angle"
SENSE, EXTREME, REST = "sense", "extreme", "end of a rest"
SENSES = {"forward": 1, "backward": -1, "counter-clockwise": 1, "clockwise": -1}
Keys = Mapping[str, Word | Number]
"""What a table may hold, in the order shown."""

_TURNING: Keys = {
    "at": Word(JOINT, True),
    "pin": Word(NEW_JOINT),
    "length": Number(PositiveLength, "length of {}"),
}
KEYS: Mapping[str, Keys] = {
    "pivot": {"x": Number(Coordinate, "x of pivot {}"), "y": Number(Coordinate, "y of pivot {}")},
    "crank": {
        **_TURNING,
        "start": Number(Angle, "angle of crank {} at crank angle 0"),
        "ratio": Word(WHOLE_RATIO),
    },
    "dyad": {
        "joins": Word(PAIR, True),
        "pin": Word(NEW_JOINT, True),
        "side": Word(LEFT_RIGHT, True),
        "links": Word(TWO_LINKS, True),
    },
    "slider": {
        "from": Word(JOINT, True),
        "through": Word(JOINT, True),
        "guide": Word(LINK),
        "direction": Number(Angle, "direction of the guide of {}"),
        "offset": Number(Coordinate, "guide of {} to the left of its joint"),
        "side": Word(AHEAD_BEHIND, True),
        "pin": Word(NEW_JOINT, True),
        "links": Word(ONE_LINK, True),
    },
    "slot": {
        "at": Word(JOINT, True),
        "through": Word(JOINT, True),
        "link": Word(NEW_LINK, True),
        "offset": Number(Coordinate, "slot of {} to the left of its joint"),
        "pin": Word(NEW_JOINT),
        "length": Number(PositiveLength, "pin of {} from its joint"),
    },
    "point": {
        "on": Word(LINK, True),
        "radius": Number(PositiveLength, "distance of point {} from its link's first joint"),
        "angle": Number(Angle, "angle of point {} from its link's line"),
        "along": Number(Coordinate, "place of point {} along its link's line"),
        "across": Number(Coordinate, "place of point {} to the left of its link's line"),
    },
    "gear": {
        **_TURNING,
        "with": Word(LINK, True),
        "carrier": Word(LINK),
        "ratio": Word(RATIO, True),
        "start": Number(Angle, "angle of gear {} where its mate stands at zero"),
        "zero": Number(Angle, "angle of the mate of gear {} from which it counts"),
    },
    "cam": {
        **_TURNING,
        "law": Word(LAW, True),
        "start": Number(Angle, "angle of cam follower {} in its lower dwell"),
        "lift": Number(Angle, "angle by which cam follower {} rises", True),
        "begins": Number(Angle, "crank angle where cam follower {} begins to rise"),
        "rise": Number(PositiveAngle, "crank angle over which cam follower {} rises", True),
        "far_dwell": Number(DwellAngle, "crank angle over which cam follower {} stays up"),
        "return": Number(PositiveAngle, "crank angle over which cam follower {} returns", True),
    },
}
"""What each kind of part may hold, in the order shown."""

# Names and numbers, for the scene's other tables too.


NAME_ALLOWED = f"up to {LONGEST_NAME} letters, digits and _, a letter first"


def check_name(name: str, key: str, taken: Mapping[str, str] | None = None) -> None:
    """Raise BadInput for what can be no name; key: where it stands; taken: what else is called so, by name."""
    if not _NAME.fullmatch(name) or len(name) > LONGEST_NAME:
        raise refusal("it is not a name", "", key, name, NAME_ALLOWED, "Give it another name")
    if taken and name in taken:
        raise refusal(f"{name} is the name of {taken[name]}", "", key, remedy="Give it another name")


def reference(raw: object, key: str, kind: Kind, names: Collection[str]) -> Ref:
    """Return the number that a part or event names, or a literal with its unit; names: those of [mechanism]."""
    quantity: Quantity = kind.__metadata__[0]
    if not isinstance(raw, str):
        if quantity.kind == "number" and isinstance(raw, int | float) and not isinstance(raw, bool):
            return Ref("", 1, _validated(quantity, raw, key))
        allowed = f"the name of a number of [mechanism], or {described(quantity.kind)}"
        problem = "it is neither the name of a number nor a quantity"
        raise refusal(problem, "", key, raw, allowed, "Write either, in quotes")
    text = raw.strip()
    name = text.removeprefix("-").strip()
    if name in names:
        positive = quantity.least >= 0 or quantity.above >= 0
        if positive and name != text:
            raise refusal("it cannot be negative", "", key, raw, remedy=f'Write "{name}"')
        return Ref(name, 1 if name == text else -1)
    if name[:1] in (*"+.0123456789", ""):
        return Ref("", 1, _validated(quantity, text, key))
    raise unknown("number of [mechanism]", name, names, "", key, remedy="Add it to [mechanism], or correct the name")


def _validated(quantity: Quantity, raw: object, key: str) -> float:
    try:
        return quantity.validate(raw)
    except QuantityError as error:
        raise misread(error, "", key, raw) from None


def use(used: Used, ref: Ref, kind: Kind, text: str, key: str) -> None:
    """Note what a number is used as; text: what it is in words. Raises BadInput for one of two kinds."""
    if not ref.name:
        return
    if ref.name not in used:
        used[ref.name] = kind, text
        return
    known, said = used[ref.name]
    one, other = known.__metadata__[0], kind.__metadata__[0]
    if one.kind != other.kind:
        problem = f"{ref.name} is used as two kinds of quantity: {one.kind} ({said}) and {other.kind} ({text})"
        raise refusal(problem, "", key, remedy="Give each a number of its own")
    narrower = kind if (other.least, other.above, -other.below) > (one.least, one.above, -one.below) else known
    used[ref.name] = narrower, f"{said}; {text}"


# What one key holds: how it is read, and how an editor checks it.


class Sort(NamedTuple):
    """What a word may be: read(raw, key) returns it or raises BadInput; schema() returns its JSON Schema."""

    read: Callable[[object, str], Any]
    schema: Callable[[], Json]


NAME_SCHEMA: Json = {"type": "string", "pattern": rf"^[^\s!-@\[-`{{-~][^\s!-/:-@\[-^`{{-~]{{0,{LONGEST_NAME - 1}}}$"}
"""A name of the scene's own, as `check_name` reads it."""


def text_of(raw: object) -> str:
    """Return a raw word as a message shows it."""
    return raw if isinstance(raw, str) else shown(raw)


def _choice(*names: str, what: str = "choice") -> Sort:
    def read(raw: object, key: str) -> str:
        if not isinstance(raw, str) or raw not in names:
            raise unknown(what, text_of(raw), names, "", key)
        return raw

    return Sort(read, lambda: {"enum": list(names)})


def _called(raw: object, key: str) -> str:
    if not isinstance(raw, str):
        raise refusal("it is not a name", "", key, raw, NAME_ALLOWED, 'Write a name in quotes, such as "B"')
    check_name(raw, key)
    return raw


def _new(raw: object, key: str) -> str:
    name = _called(raw, key)
    check_name(name, key, {FRAME_NAME: "what does not move"})
    return name


def _pair(raw: object, key: str) -> tuple[str, ...]:
    if not isinstance(raw, list | tuple) or len(raw) != 2:
        remedy, allowed = 'Write two, such as ["B", "D"]', "a list of two joints"
        raise refusal("a dyad joins two joints", "", key, raw, allowed, remedy)
    first, second = (_called(each, f"{key}.{place}") for place, each in enumerate(raw, 1))
    if first == second:
        raise refusal(f"both ends of the dyad hang on {first}", "", key, remedy="Name two joints")
    return first, second


def _links(count: int, such_as: str) -> Sort:
    def read(raw: object, key: str) -> tuple[str, ...]:
        if not isinstance(raw, Mapping) or len(raw) != count:
            wanted = f"it has {count} link{'s' * (count > 1)}, each with its length"
            raise refusal(wanted, "", key, raw, f"a table such as {such_as}", "Write one")
        return tuple(_new(name, f"{key}.{name}") for name in raw)

    def schema() -> Json:
        lengths = number_schema(Number(PositiveLength, "its length"))
        ends: Json = {"minProperties": count, "maxProperties": count}
        return {"type": "object", "additionalProperties": lengths, "propertyNames": NAME_SCHEMA, **ends}

    return Sort(read, schema)


def _ratio(raw: object, key: str) -> int | float:
    value = _validated(Quantity("number"), raw, key)
    if value == 0 or abs(value) > MOST_PARTS:
        allowed = f"a number but 0, at most {MOST_PARTS} in size; negative where it turns the other way"
        raise refusal("it is no ratio", "", key, raw, allowed, "Correct it")
    return int(value) if value == int(value) else value


def _whole_ratio(raw: object, key: str) -> int:
    found = _ratio(raw, key)
    if not isinstance(found, int):
        remedy = "After a turn of the main shaft it must stand as before: a whole number, negative the other way round"
        raise refusal("it is not a whole number", "", key, raw, remedy=remedy)
    return found


def _angle(raw: object, key: str) -> float:
    return _validated(Quantity("angle"), raw, key)


def number_schema(number: Number) -> Json:
    """Return the JSON Schema of a number of the linkage: a quantity, or the name of a number of [mechanism]."""
    quantity = number.kind.__metadata__[0].schema()
    name: Json = {"type": "string", "pattern": r"^[ \t]*-?[ \t]*[^\s\d+.-]"}
    said = re.sub(r" (?:of|from|between|and) (?:\{\w*\})+| \{\w*\}", "", number.text)
    return {"if": name, "else": quantity, "description": f"{said}: a number of [mechanism], or a quantity"}


def _name_schema() -> Json:
    return NAME_SCHEMA


def _pair_schema() -> Json:
    return {"type": "array", "items": NAME_SCHEMA, "minItems": 2, "maxItems": 2, "uniqueItems": True}


_NAMED, _OWN_NAME = Sort(_called, _name_schema), Sort(_new, _name_schema)
_SORTS: Mapping[str, Sort] = {
    JOINT: _NAMED,
    LINK: _NAMED,
    SLIDE: _NAMED,
    EVENT: _NAMED,
    NEW_JOINT: _OWN_NAME,
    NEW_LINK: _OWN_NAME,
    RATIO: Sort(_ratio, Quantity("number").schema),
    WHOLE_RATIO: Sort(_whole_ratio, Quantity("number").schema),
    ANGLE: Sort(_angle, Quantity("angle").schema),
    LAW: _choice(*LAWS),
    PAIR: Sort(_pair, _pair_schema),
    ONE_LINK: _links(1, '{ rod = "l2" }'),
    TWO_LINKS: _links(2, '{ rod = "l2", rocker = "l3" }'),
    LEFT_RIGHT: _choice("left", "right"),
    AHEAD_BEHIND: _choice("ahead", "behind"),
    SENSE: _choice(*SENSES, what=SENSE),
    EXTREME: _choice("max", "min", what=EXTREME),
    REST: _choice("begins", "ends", what=REST),
}


def keys_schema(known: Keys, kind: str = "") -> Json:
    """Return the JSON Schema of a table that holds these keys and no others; kind: of a part."""
    found = {
        key: number_schema(each) if isinstance(each, Number) else _SORTS[each.sort].schema()
        for key, each in known.items()
    }
    own: Json = {"kind": {"const": kind}, **found} if kind else found
    needed = [key for key in own if key == "kind" or known[key].needed]
    return {"type": "object", "properties": own, "required": needed, "additionalProperties": False}


def schema() -> Json:
    """Return the JSON Schema of [parts]."""
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


class Entries(NamedTuple):
    """What a table holds: its words by key, and its numbers by key (of a link by its name), both in its order."""

    words: Mapping[str, Any]
    numbers: Mapping[str, Ref]


def entries(
    table: Mapping[str, Any], known: Keys, path: str, names: Collection[str], used: Used, of: str = "", name: str = ""
) -> Entries:
    """Return what a table holds that may hold these keys. Raises BadInput with all mistakes.

    names: the numbers of [mechanism], whose uses `used` notes; of: what the table is, in words, and its name.
    """
    faults, words, numbers = Faults(), dict[str, Any](), dict[str, Ref]()
    strange = [key for key in table if key not in known and key != "kind"]
    for key in strange:
        faults.add(unknown(f"key of {of}" if of else "key", key, known, "", f"{path}.{key}", given=table))
    meant = {nearest(key, known, table) for key in strange}
    said = {key: text_of(table.get(key, "")) for key, each in known.items() if isinstance(each, Word)}
    for key, each in known.items():
        where = f"{path}.{key}"
        if key not in table:
            if each.needed and key not in meant:
                faults.add(refusal(f"{of or 'the table'} needs {key}", "", where, remedy="Add it", grade=GAP))
            continue
        with faults:
            if isinstance(each, Number):
                numbers[key] = _noted(table[key], where, each.kind, each.text.format(name, **said), names, used)
            else:
                words[key] = _SORTS[each.sort].read(table[key], where)
        if key == "links" and isinstance(table[key], Mapping):
            for link, length in table[key].items():
                with faults:
                    text = f"length of {link}"
                    numbers[link] = _noted(length, f"{where}.{link}", PositiveLength, text, names, used)
    faults.tell()
    return Entries(words, numbers)


# One part.


def _part(name: str, raw: object, names: Collection[str], used: Used, faults: Faults) -> Part | None:
    """Return one part; None where its mistakes, which `faults` keeps, leave none."""
    path = f"parts.{name}"
    before = len(faults.found)
    with faults:
        check_name(name, path, {FRAME_NAME: "what does not move"})
    with faults:
        kind, table = _kind(raw, path)
        words, numbers = entries(table, KEYS[kind], path, names, used, f"a {kind}", name)
        found = Part(kind, name, tuple(words.items()), tuple(numbers.items()))
        if len(faults.found) == before:
            _sense(found, path)
            return found
    return None


def _noted(raw: object, key: str, kind: Kind, text: str, names: Collection[str], used: Used) -> Ref:
    ref = reference(raw, key, kind, names)
    use(used, ref, kind, text, key)
    return ref


def _kind(raw: object, path: str) -> tuple[str, Mapping[str, Any]]:
    """Return a part's kind and its table. Raises BadInput."""
    if not isinstance(raw, Mapping):
        allowed = 'a table, such as { kind = "pivot" }'
        raise refusal("a part is a table", "", path, raw, allowed, "Write one")
    if "kind" not in raw:
        allowed = ", ".join(KEYS)
        raise refusal("the part has no kind", "", f"{path}.kind", allowed=allowed, remedy="Add it", grade=GAP)
    kind = raw["kind"]
    if not isinstance(kind, str) or kind not in KEYS:
        raise unknown("kind of part", text_of(kind), KEYS, "", f"{path}.kind")
    return kind, raw


def _sense(part: Part, path: str) -> None:
    """Raise BadInput for keys that mean nothing together."""
    numbers, pin = part.numbers, part.word("pin")
    if "length" in KEYS[part.kind] and bool(pin) != ("length" in numbers):
        missing, problem = ("length", f"pin {pin} needs a length") if pin else ("pin", "length is that of a pin")
        raise refusal(problem, "", f"{path}.{missing}", remedy=f"Add {missing}", grade=GAP)
    if part.kind == "point":
        polar = {"radius", "angle"} & numbers.keys()
        cartesian = {"along", "across"} & numbers.keys()
        if polar and cartesian:
            problem = f"{' and '.join(sorted(polar))} and {' and '.join(sorted(cartesian))} say the same twice"
            raise refusal(problem, "", path, remedy="Give radius and angle, or along and across")
        if "radius" not in numbers and not cartesian:
            raise refusal("the point has no place", "", path, remedy="Add radius and angle, or along and across")
    if part.kind == "gear" and part.word("with") == (part.word("carrier") or FRAME_NAME):
        remedy = "Name another link, or another carrier (without one it is the frame)"
        raise refusal("its mate does not turn against its carrier", "", f"{path}.with", remedy=remedy)
    if part.kind == "cam":
        spent = sum(numbers[key].value for key in ("rise", "far_dwell", "return") if key in numbers)
        if numbers["lift"] == Ref(""):
            raise refusal("the cam lifts nothing", "", f"{path}.lift", remedy="Give an angle other than 0")
        if spent > 2 * math.pi:
            raise refusal("rise, far_dwell and return are more than a turn", "", path, remedy="Make them shorter")
    same = [key for key in ("from", "at") if part.word(key) and part.word(key) == part.word("through")]
    if same:
        raise refusal(f"{same[0]} and through are one joint", "", f"{path}.through", remedy="Name two joints")


# All parts.


def linked(raw: object, names: Collection[str]) -> tuple[Chain, Used]:
    """Return the parts in an order that can be evaluated, and what the numbers they name are used as.

    raw: the table [parts] as given; names: the numbers of [mechanism]. Raises BadInput with all mistakes.
    """
    if not isinstance(raw, Mapping):
        raise refusal("it is not a table", "", "parts", raw, remedy="Write a table [parts]", grade=WHOLE)
    if len(raw) > MOST_PARTS:
        problem = f"{len(raw)} parts are no linkage of one freedom"
        raise refusal(problem, "", "parts", allowed=f"up to {MOST_PARTS}", remedy="Take out what moves nothing")
    faults, used = Faults(), Used()
    read = [_part(name, each, names, used, faults) for name, each in raw.items()]
    parts = [part for part in read if part is not None]
    if len(parts) == len(read):
        for fault in _misnamed(parts):
            faults.add(fault)
    faults.tell()
    return ordered(parts), used


def _misnamed(parts: Sequence[Part]) -> Iterator[BadInput]:
    """Yield what is wrong with the names that parts place and hang on."""
    joints = {name: part.name for part in reversed(parts) for name in chain.joints_of(part)}
    links = {name: part.name for part in reversed(parts) for name in chain.links_of(part)}
    placed: dict[str, tuple[str, str]] = {}
    for part in parts:
        for sort, own in (("joint", chain.joints_of(part)), ("link", chain.links_of(part))):
            for name in own:
                if name in placed:
                    yield _twice(name, sort, part, *placed[name])
                else:
                    placed[name] = part.name, sort
        for sort, wanted, known, others in (
            ("joint", chain.wanted_joints(part), joints, links),
            ("link", chain.wanted_links(part), links, joints),
        ):
            for name in wanted:
                where = f"parts.{part.name}.{_key_of(part, name)}"
                if name in known:
                    continue
                if name in others or name == FRAME_NAME:
                    other = "the frame" if name == FRAME_NAME else f"a {'link' if sort == 'joint' else 'joint'}"
                    problem = f"{name} is {other}, and a {sort} is wanted"
                    yield refusal(problem, "", where, allowed=", ".join(known), remedy=f"Name a {sort}")
                else:
                    yield unknown(sort, name, known, "", where, remedy=f"Add a part that places {name}")
    if parts and not any(part.kind in ("crank", "cam") for part in parts):
        remedy = 'Add a part such as crank = { kind = "crank", at = "A", pin = "B", length = "l1" }'
        yield refusal("nothing is driven: there is no crank", "", "parts", remedy=remedy, grade=GAP)
    if not parts:
        yield refusal("there are no parts", "", "parts", remedy="Add a pivot, a crank and a dyad", grade=GAP)


def _twice(name: str, sort: str, part: Part, first: str, before: str) -> BadInput:
    path = f"parts.{part.name}"
    if before != sort:
        return refusal(f"{name} is the name of a {before} and of a {sort}", "", path, remedy="Rename one")
    if sort == "link":
        return refusal(f"{name} is a link of {first} and of {part.name}", "", path, remedy="Rename one")
    problem = f"{name} is placed by {first} and by {part.name}: a loop too many, it cannot move"
    remedy = f"Give {part.name} a joint of its own, or take one of the two out"
    return refusal(problem, "", path, remedy=remedy)


def _key_of(part: Part, name: str) -> str:
    if name in part.names("joins"):
        return "joins"
    keys = (key for key, each in KEYS[part.kind].items() if isinstance(each, Word) and part.word(key) == name)
    return next(keys, "kind")


def ordered(parts: Iterable[Part]) -> Chain:
    """Return parts in an order in which each hangs on those before it, otherwise in that given. Raises BadInput."""
    waiting, known, order = list(parts), set[str](), list[Part]()
    while waiting:
        ready = next((part for part in waiting if known.issuperset(chain.wants(part))), None)
        if ready is None:
            raise _waiting(waiting, known)
        known.update(chain.provides(ready))
        order.append(ready)
        waiting.remove(ready)
    return Chain(tuple(order))


def _waiting(waiting: Sequence[Part], known: Collection[str]) -> BadInput:
    """Return the error for parts that wait for each other, without those that only wait for them."""
    while True:
        wanted = {name for part in waiting for name in chain.wants(part)}
        ring = [part for part in waiting if wanted.intersection(chain.provides(part))]
        if len(ring) == len(waiting):
            break
        waiting = ring
    lacking = "; ".join(f"{p.name} for {', '.join(n for n in chain.wants(p) if n not in known)}" for p in waiting)
    problem = f"parts wait for each other ({lacking}): together they are an Assur group of class III or higher"
    remedy = "Only chains of dyads, sliders and slots close in closed form: drive it at another link"
    allowed = "parts of which each hangs on joints and links that others place before it"
    return refusal(problem, "", f"parts.{waiting[0].name}", allowed=allowed, remedy=remedy)


SAYS_NOTHING = ("problem", "mechanism", "parts")
"""Tables that read no part."""


def demand_used(linked: Chain, document: Mapping[str, Any]) -> None:
    """Raise BadInput for parts that move nothing that anything reads; document: the raw scene.

    A part is read where another hangs on it or where a table beside [parts] says its name, or that of a joint or link
    of it. A point is drawn with its path, so it may stand for that alone.
    """
    said = {word for name, own in document.items() if name not in SAYS_NOTHING for word in _said(own)}
    faults, wanted = Faults(), set[str]()
    for part in reversed(linked.parts):
        own = {part.name, *chain.provides(part)}
        if part.kind == "point" or own & (said | wanted):
            wanted.update(chain.wants(part))
            continue
        problem = f"nothing reads the part {part.name}: no other part hangs on it, and no table names it"
        faults.add(refusal(problem, "", f"parts.{part.name}", remedy="Take it out, or name it where it is read"))
    faults.tell()


def _said(raw: object) -> Iterator[str]:
    """Yield every word of a table's keys and texts."""
    if isinstance(raw, Mapping):
        for key, value in raw.items():
            yield from _said(key)
            yield from _said(value)
    elif isinstance(raw, list | tuple):
        for value in raw:
            yield from _said(value)
    elif isinstance(raw, str):
        yield from re.findall(r"\w+", raw)


def kinds_of(linked: Chain) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """Return the names of joints, of links, and of parts in which something slides."""
    return linked.joints, linked.links, linked.slides
