"""Mappings that never change, and those that are read only where somebody asks."""

import copy
import json
import pickle
from types import SimpleNamespace

import pytest

from loomopt.base.records import Awaited, Frozen, freeze


def made(asked):
    """Return a mapping of five squares, two of them known; asked: what has been computed, name by name."""

    def later(names):
        asked.append(list(names))
        return {name: int(name) ** 2 for name in names}

    return Awaited("12345", {"1": 1, "3": 9}, later)


def test_a_value_is_computed_when_it_is_read_and_once():
    asked = list[list[str]]()
    found = made(asked)
    assert (len(found), list(found), "4" in found, "9" in found, found["3"]) == (5, list("12345"), True, False, 9)
    assert asked == []
    assert (found["4"], found["4"], found.get("4")) == (16, 16, 16)
    assert asked == [["4"]]
    with pytest.raises(KeyError):
        found["9"]


def test_with_the_second_that_is_read_all_the_rest_is_computed():
    asked = list[list[str]]()
    found = made(asked)
    assert dict(found) == {"1": 1, "2": 4, "3": 9, "4": 16, "5": 25}
    assert list(dict(found)) == list("12345")
    assert asked == [["2"], ["4", "5"]]


def test_it_is_a_mapping_like_any_other():
    whole = {"1": 1, "2": 4, "3": 9, "4": 16, "5": 25}
    assert made([]) == whole
    assert whole == made([])
    assert made([]) == made([])
    assert {**made([])} == made([]) | {} == whole
    assert made([]) | {"1": 0} == whole | {"1": 0}
    assert json.dumps(dict(made([]))) == json.dumps(whole)
    assert repr(made([])) == repr(whole)
    with pytest.raises(TypeError):
        made([])["1"] = 2


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda each: pickle.loads(pickle.dumps(each))])
def test_a_copy_has_all_values_and_never_changes(copied):
    found = copied(made([]))
    assert type(found) is Frozen
    assert found == {"1": 1, "2": 4, "3": 9, "4": 16, "5": 25}


def test_freezing_leaves_unread_what_is_unread():
    asked = list[list[str]]()
    record = SimpleNamespace(squares=made(asked), plain={"a": 1})
    freeze(record, "squares", "plain")
    assert (type(record.squares), type(record.plain), asked) == (Awaited, Frozen, [])
