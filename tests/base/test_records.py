"""Mappings that never change, and those that are read only where somebody asks."""

import copy
import json
import pickle
from types import SimpleNamespace

import pytest

from loomopt.base.records import Awaited, Frozen, freeze


def made(request):
    """Return a mapping of five squares, two of them known; request: what has been computed, name by name."""

    def later(names):
        request.append(list(names))
        return {name: int(name) ** 2 for name in names}

    return Awaited("12345", {"1": 1, "3": 9}, later)


def test_a_value_is_computed_when_it_is_read_and_once():
    request = list[list[str]]()
    result = made(request)
    assert (len(result), list(result), "4" in result, "9" in result, result["3"]) == (5, list("12345"), True, False, 9)
    assert request == []
    assert (result["4"], result["4"], result.get("4")) == (16, 16, 16)
    assert request == [["4"]]
    with pytest.raises(KeyError):
        result["9"]


def test_with_the_second_that_is_read_all_the_rest_is_computed():
    request = list[list[str]]()
    result = made(request)
    assert dict(result) == {"1": 1, "2": 4, "3": 9, "4": 16, "5": 25}
    assert list(dict(result)) == list("12345")
    assert request == [["2"], ["4", "5"]]


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


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda item: pickle.loads(pickle.dumps(item))])
def test_a_copy_has_all_values_and_never_changes(copied):
    result = copied(made([]))
    assert type(result) is Frozen
    assert result == {"1": 1, "2": 4, "3": 9, "4": 16, "5": 25}


def test_freezing_leaves_unread_what_is_unread():
    request = list[list[str]]()
    record = SimpleNamespace(squares=made(request), plain={"a": 1})
    freeze(record, "squares", "plain")
    assert (type(record.squares), type(record.plain), request) == (Awaited, Frozen, [])
