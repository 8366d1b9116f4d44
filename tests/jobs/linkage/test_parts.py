"""The table [parts]: what is read from it, and one message for each mistake in it."""

import copy
import math
import re

import pytest

from loomopt.base.errors import BadInput, Faults
from loomopt.base.quantities import Angle, Coordinate, PositiveLength
from loomopt.jobs.linkage import parts
from loomopt.physics.mechanisms.chain import Part, Ref, wants
from loomopt.scenes.cursor import Cursor

NAMES = ("l1", "l2", "l3", "l4", "e", "epsilon")
PIVOTS = {"A": {"kind": "pivot"}, "D": {"kind": "pivot", "x": "l4"}}
FOUR_BAR = PIVOTS | {
    "crank": {"kind": "crank", "at": "A", "pin": "B", "length": "l1"},
    "drive": {"kind": "dyad", "joins": ["B", "D"], "pin": "C", "side": "left", "links": {"rod": "l2", "rocker": "l3"}},
}
SLIDER = {"kind": "slider", "from": "C", "through": "D", "pin": "P", "side": "ahead", "links": {"strut": "e"}}
SLOT = {"kind": "slot", "at": "A", "through": "C", "link": "arm"}
GEAR = {"kind": "gear", "at": "C", "with": "rod", "carrier": "rocker", "ratio": -2}
CAM = {"kind": "cam", "at": "D", "law": "cycloidal", "lift": "20 deg", "rise": "90 deg", "return": "90 deg"}
POINT = {"kind": "point", "on": "rocker", "radius": "e", "angle": "epsilon"}


def at(path, raw=None):
    """Return a cursor on a value of a file without a name."""
    return Cursor(raw, path, Faults())


def linked(raw, names):
    """Return the chain that a table of parts describes, and the uses of the numbers that it names."""
    numbers = parts.Numbers(dict.fromkeys(names))
    return parts.linked(at("parts", raw), numbers), numbers.uses


def with_part(name, given, **changed):
    """Return the four-bar with one more part, some of its keys changed or (None) taken out."""
    values = {key: value for key, value in (given | changed).items() if value is not None}
    return FOUR_BAR | {name: values}


def changed(name, **keys):
    """Return the four-bar with keys of one part changed or (None) taken out."""
    return with_part(name, FOUR_BAR[name], **keys)


def test_a_four_bar_is_read_in_an_order_that_can_be_evaluated_whatever_its_own():
    backwards = dict(reversed(FOUR_BAR.items()))
    chain, used = linked(backwards, NAMES)
    assert [part.name for part in chain.parts] == ["D", "A", "crank", "drive"]
    assert linked(FOUR_BAR, NAMES)[0].parts[-1] == Part(
        "dyad",
        "drive",
        (("joins", ("B", "D")), ("pin", "C"), ("side", "left"), ("links", ("rod", "rocker"))),
        (("rod", Ref("l2")), ("rocker", Ref("l3"))),
    )
    assert {name: kind for name, (kind, _) in used.items()} == {
        "l1": PositiveLength,
        "l2": PositiveLength,
        "l3": PositiveLength,
        "l4": Coordinate,
    }
    assert used["l2"][1] == "length of rod"
    assert parts.kinds_of(chain) == (("D", "A", "B", "C"), ("crank", "rod", "rocker"), ())


def test_a_number_used_twice_is_a_tie_and_one_with_a_minus_its_mirror_image():
    tied = changed("D", x="-l4", y="l1")
    chain, used = linked(tied, NAMES)
    pivot = next(part for part in chain.parts if part.name == "D")
    assert pivot.numbers == {"x": Ref("l4", -1), "y": Ref("l1")}
    assert used["l1"] == (PositiveLength, "y of pivot D; length of crank")


@pytest.mark.parametrize(("text", "value"), [("25 mm", 0.025), ("-25 mm", -0.025), (" 0 m ", 0.0), ("1 in", 0.0254)])
def test_a_literal_keeps_its_value_in_SI(text, value):
    assert parts.Numbers(dict.fromkeys(NAMES)).read(at("parts.D.x", text), Coordinate, "x") == Ref("", 1, value)


def test_every_kind_of_part_is_read():
    document = FOUR_BAR | {
        "E": POINT,
        "ram": SLIDER | {"guide": "frame", "direction": "epsilon", "offset": "3 mm"},
        "slotted": SLOT | {"pin": "Q", "length": "e", "offset": "2 mm"},
        "wheel": GEAR | {"ratio": "-18/27", "zero": "20 deg"},
        "follower": CAM | {"pin": "F", "length": "e", "shaft": "A"},
        "R": {"kind": "roller", "at": "F", "cam": "follower", "radius": "3 mm"},
    }
    chain, used = linked(document, NAMES)
    assert len(chain.parts) == 10
    assert used["epsilon"][0] is Angle
    assert next(part for part in chain.parts if part.name == "wheel").ratio == -18 / 27
    assert parts.KEYS.keys() == {"pivot", "crank", "dyad", "slider", "slot", "point", "gear", "cam", "roller"}


CLASS_III = PIVOTS | {
    "G": {"kind": "pivot", "x": "e"},
    "H": {"kind": "pivot", "y": "e"},
    "crank": FOUR_BAR["crank"],
    "one": {"kind": "dyad", "joins": ["B", "R"], "pin": "P", "side": "left", "links": {"rod": "l2", "plate": "l3"}},
    "Q": {"kind": "point", "on": "plate", "along": "e", "across": "e"},
    "two": {"kind": "dyad", "joins": ["Q", "D"], "pin": "S", "side": "left", "links": {"second": "l2", "third": "l3"}},
    "R": {"kind": "point", "on": "second", "along": "e"},
    "behind": {"kind": "dyad", "joins": ["R", "G"], "pin": "T", "side": "left", "links": {"x1": "l2", "x2": "l3"}},
}

MISTAKES = {
    "not a table": ([], "parts: it is not a table"),
    "no parts": ({}, "parts: there are no parts"),
    "a part that is text": (FOUR_BAR | {"E": "pivot"}, 'parts.E: a part is a table (given: "pivot")'),
    "no kind": (changed("D", kind=None), "parts.D.kind: the part has no kind"),
    "unknown kind": (changed("drive", kind="diad"), 'parts.drive.kind: unknown kind of part "diad"'),
    "kind is a number": (changed("drive", kind=3), 'parts.drive.kind: unknown kind of part "3"'),
    "unknown key": (changed("crank", lenght="l1"), 'parts.crank.lenght: unknown key of a crank "lenght"'),
    "key of another kind": (changed("D", radius="e"), 'parts.D.radius: unknown key of a pivot "radius"'),
    "no at": (changed("crank", at=None), "parts.crank.at: a crank needs at"),
    "no joins": (changed("drive", joins=None), "parts.drive.joins: a dyad needs joins"),
    "no side": (changed("drive", side=None), "parts.drive.side: a dyad needs side"),
    "no links": (changed("drive", links=None), "parts.drive.links: a dyad needs links"),
    "no pin of a dyad": (changed("drive", pin=None), "parts.drive.pin: a dyad needs pin"),
    "no link of a slot": (with_part("s", SLOT, link=None), "parts.s.link: a slot needs link"),
    "not a ratio": (with_part("g", GEAR, ratio=None), "parts.g.ratio: a gear needs ratio"),
    "no law": (with_part("c", CAM, law=None), "parts.c.law: a cam needs law"),
    "no on": (with_part("E", POINT, on=None), "parts.E.on: a point needs on"),
    "joins one": (changed("drive", joins=["B"]), "parts.drive.joins: a dyad joins two joints (given: a list)"),
    "joins three": (changed("drive", joins=["B", "D", "A"]), "parts.drive.joins: a dyad joins two joints"),
    "joins text": (changed("drive", joins="B"), 'parts.drive.joins: a dyad joins two joints (given: "B")'),
    "joins numbers": (changed("drive", joins=[1, 2]), "parts.drive.joins.1: it is not a name (given: 1)"),
    "joins one twice": (changed("drive", joins=["B", "B"]), "parts.drive.joins: both ends of the dyad are joint B"),
    "three links": (
        changed("drive", links={"a": "l1", "b": "l2", "c": "l3"}),
        "parts.drive.links: it has 2 links, each with its length",
    ),
    "links as a list": (changed("drive", links=["l2", "l3"]), "parts.drive.links: it has 2 links"),
    "two links of a slider": (
        with_part("ram", SLIDER, links={"a": "l1", "b": "l2"}),
        "parts.ram.links: it has 1 link, each with its length",
    ),
    "at is a number": (changed("crank", at=3), "parts.crank.at: it is not a name (given: 3)"),
    "side of a slider": (changed("drive", side="ahead"), 'parts.drive.side: unknown choice "ahead"'),
    "side of a dyad": (with_part("ram", SLIDER, side="left"), 'parts.ram.side: unknown choice "left"'),
    "side is a number": (changed("drive", side=1), 'parts.drive.side: unknown choice "1"'),
    "ratio 0": (changed("crank", ratio=0), "parts.crank.ratio: it is not a ratio (given: 0)"),
    "ratio true": (changed("crank", ratio=True), "parts.crank.ratio: it is not a quantity (given: true)"),
    "ratio with a unit": (changed("crank", ratio="2 mm"), "parts.crank.ratio: "),
    "ratio not whole": (changed("crank", ratio=1.5), "parts.crank.ratio: it is not a whole number (given: 1.5)"),
    "ratio not finite": (with_part("g", GEAR, ratio=float("nan")), "parts.g.ratio: it is not a finite number"),
    "unknown number": (changed("crank", length="l7"), 'parts.crank.length: unknown number of [mechanism] "l7"'),
    "a sum": (changed("crank", length="l1 + l2"), 'parts.crank.length: unknown number of [mechanism] "l1 + l2"'),
    "a bare number": (
        changed("crank", length=0.031),
        "parts.crank.length: it is neither the name of a number nor a quantity (given: 0.031)",
    ),
    "a number without unit": (changed("crank", length="31"), "parts.crank.length: "),
    "decimal comma": (changed("crank", length="31,5 mm"), "parts.crank.length: "),
    "an angle for a length": (changed("crank", length="31 deg"), "parts.crank.length: "),
    "a length for an angle": (changed("crank", start="31 mm"), "parts.crank.start: "),
    "no length": (changed("crank", length="0 mm"), "parts.crank.length: it is out of range"),
    "a negative length": (
        changed("drive", links={"rod": "-l2", "rocker": "l3"}),
        "parts.drive.links.rod: it cannot be",
    ),
    "an empty number": (changed("crank", length=""), "parts.crank.length: "),
    "length and angle": (
        with_part("E", POINT, angle="l2"),
        "parts.E.angle: l2 is used as two kinds of quantity: length (length of rod) and angle (angle of point E from",
    ),
    "pin without length": (changed("crank", length=None), "parts.crank.length: pin B needs a length"),
    "length without pin": (with_part("s", SLOT, length="e"), "parts.s.pin: length is that of a pin"),
    "a point told twice": (
        with_part("E", POINT, along="e"),
        "parts.E: angle and radius and along define the same quantity twice",
    ),
    "a point without place": (with_part("E", POINT, radius=None), "parts.E: the point has no place"),
    "unknown joint": (changed("crank", at="AA"), 'parts.crank.at: unknown joint "AA"'),
    "unknown link": (with_part("E", POINT, on="rockr"), 'parts.E.on: unknown link "rockr"'),
    "a link for a joint": (changed("drive", joins=["crank", "D"]), "parts.drive.joins: crank is a link, but a joint"),
    "a joint for a link": (with_part("E", POINT, on="C"), "parts.E.on: C is a joint, but a link is needed"),
    "the frame for a joint": (
        changed("crank", at="frame"),
        "parts.crank.at: frame is the frame, but a joint is needed",
    ),
    "a joint placed twice": (
        with_part("second", FOUR_BAR["drive"], links={"a": "l2", "b": "l3"}),
        "parts.second: C is placed by drive and by second: the linkage has a loop too many and cannot move",
    ),
    "a link placed twice": (
        with_part("second", FOUR_BAR["drive"], pin="F", links={"rod": "l2", "other": "l3"}),
        "parts.second: rod is a link of drive and of second",
    ),
    "joins misspelt": (
        changed("drive", joins=None, join=["B", "D"]),
        'parts.drive.join: unknown key of a dyad "join"',
    ),
    "a joint named as a link": (
        changed("drive", pin="crank"),
        "parts.drive: crank is the name of a link and of a joint",
    ),
    "a blank in the name of a part": (FOUR_BAR | {"my pivot": {"kind": "pivot"}}, "parts.my pivot: it is not a name"),
    "a blank in the name of a joint": (changed("crank", pin="B 1"), 'parts.crank.pin: it is not a name (given: "B 1")'),
    "a blank in the name of a link": (
        changed("drive", links={"my rod": "l2", "rocker": "l3"}),
        'parts.drive.links.my rod: it is not a name (given: "my rod")',
    ),
    "a name that is a number": (FOUR_BAR | {"1": {"kind": "pivot"}}, "parts.1: it is not a name"),
    "a joint called frame": (changed("drive", pin="frame"), "parts.drive.pin: frame is the name of what does not move"),
    "no crank": (PIVOTS, "parts: nothing is driven: there is no crank"),
    "waits for itself": (
        changed("drive", joins=["C", "D"]),
        "parts.drive: parts depend on each other (drive for C): together they are an Assur group of class III or",
    ),
    "Assur group of class III": (
        CLASS_III,
        "parts.one: parts depend on each other (one for R; Q for plate; two for Q; R for second): together they are",
    ),
    "too many parts": (
        FOUR_BAR | {f"P{k}": {"kind": "pivot"} for k in range(3000)},
        "parts: 3004 parts are too many",
    ),
    "a gear on its own mate": (with_part("g", GEAR, carrier="rod"), "parts.g.with: its mate does not turn against"),
    "unknown law": (with_part("c", CAM, law="cycloid"), 'parts.c.law: unknown choice "cycloid"'),
    "a cam that lifts nothing": (with_part("c", CAM, lift="0 deg"), "parts.c.lift: the cam lifts nothing"),
    "a cam of more than a turn": (
        with_part("c", CAM, far_dwell="200 deg"),
        "parts.c: rise, far_dwell and return are more than a turn",
    ),
    "a slot through its own joint": (
        with_part("s", SLOT, through="A"),
        "parts.s.through: at and through are one joint",
    ),
    "a slider through its own joint": (
        with_part("ram", SLIDER, through="C"),
        "parts.ram.through: from and through are one joint",
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_one_message_that_names_part_and_key(mistake):
    raw, begins = copy.deepcopy(MISTAKES[mistake])
    with pytest.raises(BadInput) as caught:
        linked(raw, NAMES)
    error = caught.value
    assert str(error).startswith(begins)
    assert len(error.faults) == 1
    assert "\n" not in str(error)
    assert error.remedy or error.allowed


@pytest.mark.parametrize(
    ("mistake", "meant"),
    [
        ("unknown kind", "dyad"),
        ("unknown key", "length"),
        ("unknown joint", "A"),
        ("unknown link", "rocker"),
        ("unknown law", "cycloidal"),
    ],
)
def test_the_nearest_name_is_told(mistake, meant):
    with pytest.raises(BadInput, match=f'Perhaps "{meant}" is meant'):
        linked(copy.deepcopy(MISTAKES[mistake][0]), NAMES)


def test_several_mistakes_are_a_line_each():
    wrong = changed("crank", length="l7", at=3) | {"E": {"kind": "pint", "on": "rod"}}
    with pytest.raises(BadInput) as caught:
        linked(wrong, NAMES)
    assert {fault.key for fault in caught.value.faults} == {"parts.crank.at", "parts.crank.length", "parts.E.kind"}


DOCUMENT = {
    "output": {"angle": "rocker"},
    "effects": {"mass": {"strut": {"mass": "1 kg"}}, "spring": {"back": {"begins": "H", "ends": "C"}}},
    "limits": {"mu.side": {"min": "40 deg"}},
}


def test_what_nothing_reads_is_refused_and_what_a_table_names_is_read():
    read = FOUR_BAR | {
        "G": {"kind": "pivot", "y": "e"},
        "H": {"kind": "pivot", "x": "e"},
        "ram": SLIDER,
        "side": {"kind": "dyad", "joins": ["C", "G"], "pin": "S", "side": "left", "links": {"m": "l2", "n": "l3"}},
        "E": POINT,
    }
    parts.demand_used(linked(read, NAMES)[0], DOCUMENT)
    idle = read | {"I": {"kind": "pivot"}, "fast": {"kind": "crank", "at": "I", "ratio": 3}, "slotted": SLOT}
    chain, _ = linked(idle, NAMES)
    with pytest.raises(BadInput) as caught:
        parts.demand_used(chain, DOCUMENT)
    assert [fault.key for fault in caught.value.faults] == ["parts.slotted", "parts.fast", "parts.I"]
    assert "part slotted is not used" in str(caught.value)


@pytest.mark.parametrize("name", ["", "a b", "a.b", "-d", "1a", "_a", "a" * 41, "l\n1"])
def test_what_is_no_name_is_told(name):
    with pytest.raises(BadInput, match="it is not a name"):
        parts.check_name(at(f"mechanism.{name}"), name)


def test_a_name_that_is_taken_is_told():
    parts.check_name(at("mechanism.ε"), "ε")
    with pytest.raises(BadInput, match=r"mechanism\.speed: speed is the name of the crank's speed"):
        parts.check_name(at("mechanism.speed"), "speed", {"speed": "the crank's speed"})


def test_wants_of_a_gear_leave_out_the_frame():
    chain, _ = linked(with_part("g", GEAR, **{"with": "frame"}), NAMES)
    assert wants(chain.parts[-1]) == ("C", "rocker")


@pytest.mark.parametrize(
    ("text", "factor"), [("2 * l1", 2), ("0.5*l1", 0.5), ("l1 / 4", 0.25), ("-3 * l1 / 2", -1.5), ("- l1", -1)]
)
def test_a_multiple_of_a_number_is_read(text, factor):
    assert parts.Numbers(dict.fromkeys(NAMES)).read(at("parts.D.x", text), Coordinate, "x") == Ref("l1", factor)
    assert Ref("l1", factor).of({"l1": 0.03}) == pytest.approx(factor * 0.03, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("0 * l1", "must not be 0"),
        ("l1 / 0", "must not be 0"),
        ("-2 * l1", "cannot be negative"),
        ("2 * l9", "unknown number"),
    ],
)
def test_a_multiple_that_cannot_be_is_refused(text, problem):
    with pytest.raises(BadInput, match=problem):
        parts.Numbers(dict.fromkeys(NAMES)).read(at("parts.crank.length", text), PositiveLength, "length")


def test_a_number_whose_multiple_has_a_greatest_value_has_a_smaller_one():
    numbers = parts.Numbers(dict.fromkeys(NAMES))
    numbers.read(at("parts.cam.rise", "2 * epsilon"), parts.PositiveAngle, "rise")
    kind, _ = numbers.uses["epsilon"]
    assert kind.__metadata__[0].below == math.pi


@pytest.mark.parametrize("text", ["l1", "-l1", "2 * l1", "0.5*l1", "l1 / 4", "- .5 * l1"])
def test_an_editor_takes_a_multiple_for_the_name_of_a_number(text):
    schema = parts.number_schema(parts.NumberKey(Coordinate, "x of pivot {}"))
    assert re.search(schema["if"]["pattern"], text)
    assert not re.search(schema["if"]["pattern"], "25 mm")
    assert not re.search(schema["if"]["pattern"], "-.25 mm")
