"""Records are the standard library's frozen dataclasses in everything that a class can be asked."""

import ast
import copy
import dataclasses
import inspect
import pickle
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import field, fields
from pathlib import Path
from typing import Any, ClassVar, Generic, TypeVar

import pytest

import loomopt
from loomopt import records

Item = TypeVar("Item")


class Plain:
    """A base that is no dataclass."""

    unit: str
    scale: float = 1.0


def family(decorator: Any) -> Any:
    """Return classes made by one decorator: defaults, factories, bases, generics, methods of their own."""

    @decorator(frozen=True)
    class Link(Plain):
        """A link."""

        __qualname__, __module__ = "Link", __name__
        known: ClassVar[int] = 4
        length: float
        name: str = "l1"
        marks: Mapping[str, Any] = field(default_factory=dict, repr=False)
        seen: list[int] = field(default_factory=list, init=False, compare=False)

    @decorator(frozen=True)
    class Crank(Link):
        """A link that turns."""

        __qualname__, __module__ = "Crank", __name__
        name: str = "crank"
        speed: float = field(default=1.0, kw_only=True)

        def __post_init__(self):
            self.seen.append(len(self.marks))

    @decorator(frozen=True, kw_only=True, eq=False)
    class Rocker(Link, Generic[Item]):
        """A link that rocks, the same as itself only."""

        __qualname__, __module__ = "Rocker", __name__
        item: Item
        swing: float = 0.4

    @decorator(frozen=True, repr=False)
    class Shown:
        """What prints in its own way."""

        __qualname__, __module__ = "Shown", __name__
        value: float

        def __repr__(self):
            return f"<{self.value}>"

        def __eq__(self, other):
            return NotImplemented

    @decorator(frozen=True)
    class Empty:
        """Nothing."""

        __qualname__, __module__ = "Empty", __name__

    return Link, Crank, Rocker, Shown, Empty


def instances(classes):
    Link, Crank, Rocker, Shown, Empty = classes
    marks = {"a": [1]}
    return [
        *(Link(1.0), Link(1.0, "l2"), Link(length=float("nan"), marks=marks), Link(1.0, marks=marks)),
        *(Crank(1.0), Crank(1.0, "l1", marks, speed=2.0), Rocker(1.0, item=3), Rocker(1.0, "r", item=Link(2.0))),
        *(Shown(1.0), Shown(1.0), Empty(), Empty()),
    ]


OURS, STANDARD = family(records.record), family(dataclasses.dataclass)
Link, Crank, Rocker, Shown, Empty = OURS
PAIRS = list(zip(OURS, STANDARD, strict=True))
MADE = list(zip(instances(OURS), instances(STANDARD), strict=True))
RECORDS = [ours for ours, _ in MADE]


def described(cls):
    known = [(f.name, f.type, f.default, f.default_factory, f.init, f.repr, f.compare, f.kw_only) for f in fields(cls)]
    parameters = inspect.signature(cls).parameters.values()
    takes = [(p.name, p.kind, p.annotation, p.default is inspect.Parameter.empty) for p in parameters]
    params = {name: getattr(cls.__dataclass_params__, name) for name in ("eq", "repr", "frozen", "order")}
    methods = {name: getattr(cls, name).__qualname__ for name in ("__init__",)}
    defaults = {name: cls.__dict__.get(name) for name in ("name", "speed", "swing", "marks", "known")}
    return known, takes, params, methods, defaults, cls.__match_args__, cls.__doc__, cls.__hash__ is None


@pytest.mark.parametrize(("ours", "standard"), PAIRS, ids=lambda cls: cls.__name__)
def test_a_class_is_described_as_the_standard_decorator_describes_it(ours, standard):
    assert dataclasses.is_dataclass(ours)
    assert described(ours) == described(standard)


@pytest.mark.parametrize(("ours", "standard"), MADE, ids=repr)
def test_an_instance_holds_and_prints_the_same(ours, standard):
    assert repr(ours) == repr(standard)
    assert list(vars(ours)) == list(vars(standard))
    assert str(dataclasses.asdict(ours)) == str(dataclasses.asdict(standard))


def test_instances_compare_and_hash_as_theirs_do():
    for ours, standard in MADE:
        assert [ours == other for other, _ in MADE] == [standard == other for _, other in MADE]
        assert ("__hash__" in vars(type(ours))) == ("__hash__" in vars(type(standard)))
    assert len({Empty(), Empty(), Shown(1.0)}) == 2
    assert hash(Shown(2.0)) == hash(Shown(2.0)) == hash(STANDARD[3](2.0))
    with pytest.raises(TypeError, match="unhashable"):
        hash(Link(1.0))


@pytest.mark.parametrize("made", [made for pair in MADE for made in pair], ids=repr)
def test_nothing_of_it_can_be_set_or_deleted(made):
    for name in (*(entry.name for entry in fields(made)), "other"):
        with pytest.raises(dataclasses.FrozenInstanceError, match=f"cannot assign to field '{name}'"):
            setattr(made, name, 1)
        with pytest.raises(dataclasses.FrozenInstanceError, match=f"cannot delete field '{name}'"):
            delattr(made, name)


@pytest.mark.parametrize("classes", [OURS, STANDARD], ids=["ours", "standard"])
def test_a_plain_subclass_may_set_what_is_no_field(classes):
    Noted = type("Noted", classes[:1], {})
    noted: Any = Noted(1.0)
    noted.note = "worn"
    assert noted.note == "worn"
    del noted.note
    with pytest.raises(dataclasses.FrozenInstanceError):
        noted.length = 2.0
    assert noted == Noted(1.0)
    assert noted != classes[0](1.0)


@pytest.mark.parametrize("made", [Link(1.0, "l2"), Crank(1.0, speed=2.0), Shown(3.0), Empty()], ids=repr)
def test_copies_and_pickles_are_the_same_again(made):
    copies = [copy.copy(made), copy.deepcopy(made), pickle.loads(pickle.dumps(made))]
    assert [vars(again) for again in copies] == [vars(made)] * 3
    assert {type(again) for again in copies} == {type(made)}


def test_replace_and_match_know_the_fields():
    crank = dataclasses.replace(Crank(1.0, speed=2.0), length=3.0)
    assert (crank.length, crank.name, crank.speed, crank.seen) == (3.0, "crank", 2.0, [0])
    match crank:
        case Link(length, name):
            assert (length, name) == (3.0, "crank")
        case _:
            pytest.fail("a crank is a link")


def test_a_record_that_holds_itself_prints():
    marks: dict[str, object] = {}
    held = Shown(marks)
    marks["held"] = Empty()
    assert repr(held) == "<{'held': Empty()}>"
    seen = Link(1.0)
    seen.seen.append(seen)
    assert repr(seen) == "Link(length=1.0, name='l1', seen=[...])"


def test_standard_dataclasses_inherit_from_records_and_records_from_them():
    more: Any = {"__annotations__": {"more": float}, "more": 2.0}
    Longer: Any = dataclasses.dataclass(frozen=True)(type("Longer", (Link,), more))
    most: Any = {"__annotations__": {"most": float}, "most": 3.0}
    Longest: Any = records.record(frozen=True)(type("Longest", (Longer,), most))
    longest = Longest(1.0, more=4.0)
    assert [entry.name for entry in fields(Longest)] == ["length", "name", "marks", "seen", "more", "most"]
    assert (longest.length, longest.more, longest.most) == (1.0, 4.0, 3.0)
    with pytest.raises(TypeError, match="non-frozen"):
        dataclasses.dataclass(type("Open", (Link,), {}))


@pytest.mark.parametrize("decorator", [records.record, dataclasses.dataclass])
def test_what_the_standard_library_refuses_is_refused(decorator):
    with pytest.raises((TypeError, SyntaxError), match="default argument"):

        @decorator(frozen=True)
        class Backwards:
            first: float = 1.0
            second: float

    with pytest.raises(ValueError, match="mutable default"):

        @decorator(frozen=True)
        class Shared:
            first: list[int] = []  # noqa: RUF012

    with pytest.raises(TypeError, match="missing 1 required"):
        family(decorator)[0]()


def test_only_frozen_ones_are_made():
    with pytest.raises(TypeError, match="frozen"):
        records.record(frozen=False)


def test_every_frozen_dataclass_of_the_package_is_one():
    """Compiling the others would be most of what importing their modules takes, on the Pythons that compile each."""
    for path in Path(loomopt.__file__).parent.rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        taken = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module == "dataclasses"]
        assert path.stem == "records" or "dataclass" not in {name.name for node in taken for name in node.names}, path
        calls = [ast.unparse(node) for node in ast.walk(tree) if isinstance(node, ast.Call)]
        assert not [call for call in calls if call.startswith("dataclasses.dataclass(frozen")], path


def test_a_class_compiles_one_function_where_the_standard_library_compiles_many():
    """Counted by what the interpreter reports of every source it compiles."""
    script = (
        "import sys\nfrom loomopt.records import dataclass, record\nseen = []\n"
        "sys.addaudithook(lambda event, about: seen.append(about) if event == 'compile' else None)\n"
        "record(frozen=True)(type('Link', (), {'__annotations__': {'length': float}, '__doc__': 'A link.'}))\n"
        "print(len(seen), dataclass is record)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["1", str(sys.version_info < (3, 13))]
