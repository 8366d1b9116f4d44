"""Input spoilt at random, a few hundred: read or refused by one plain line, nothing else (adversarial/fuzz.py)."""

import importlib
import random

import pytest

from loomopt.base.errors import BadInput
from loomopt.jobs import registry

COUNTS = {"scenes": 150, "files": 30, "linkages": 40, "designs": 100, "tables": 100, "calls": 30}


@pytest.fixture(scope="module")
def fuzz():
    return importlib.import_module("benchmarks.adversarial.fuzz")


@pytest.mark.parametrize("kind", COUNTS)
def test_what_is_spoilt_is_read_or_refused(fuzz, kind):
    seen, raised = fuzz.fuzz(kind, COUNTS[kind], seed=2026)
    assert raised == {}
    assert set(seen) == {"read", "refused"}
    assert min(seen.values()) >= COUNTS[kind] // 10, "it must reach what is read as well as what is refused"


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["files", "linkages"])
def test_spoilt_files_are_read_or_refused(fuzz, kind):
    seen, raised = fuzz.fuzz(kind, 200, seed=1)
    assert raised == {}
    assert min(seen.values()) >= 200 // 10


@pytest.mark.slow
@pytest.mark.whole
@pytest.mark.parametrize("kind", ["files", "linkages"])
def test_every_spoilt_file_of_the_full_study_is_read_or_refused(fuzz, kind):
    seen, raised = fuzz.fuzz(kind, fuzz.FULL[kind], seed=0)
    assert raised == {}
    assert min(seen.values()) >= fuzz.FULL[kind] // 10


def test_the_same_seed_and_number_are_the_same_input(fuzz):
    documents = []
    for _ in range(2):
        draw, document = random.Random("scenes 0 5"), {"a": {"l1": "31 mm", "l2": "65 mm"}, "b": {"c": 1.0}}
        for _ in range(5):
            fuzz.spoil(draw, document)
        documents.append(repr(document))
    assert documents[0] == documents[1]


@pytest.mark.parametrize(
    "error",
    [ValueError("not ours"), RuntimeWarning("a figure"), BadInput("two\nlines" * 999, allowed="x" * 9999)],
    ids=["another error", "a warning", "plain"],
)
def test_anything_else_is_told_with_its_number(fuzz, monkeypatch, error):
    """A message of bad input is a plain line whatever it is made of; every other error is a finding."""

    def load(*arguments):
        raise error

    monkeypatch.setattr(registry, "load", load)
    monkeypatch.setitem(fuzz.KINDS, "calls", lambda draw, folder: fuzz.called(["show", "beatup"]))
    seen, raised = fuzz.fuzz("calls", 2, seed=0)
    if isinstance(error, BadInput):
        assert (dict(seen), raised) == ({"refused": 2}, {})
    else:
        assert sorted(raised) == [0, 1]
        assert type(error).__name__ in raised[0]


@pytest.mark.parametrize("data", [{"a": [1.0, {"b": float("nan")}]}, [float("inf")]])
def test_a_number_that_is_none_is_found(fuzz, data):
    fuzz.finite({"a": [1.0, "nan", None, True]})
    with pytest.raises(AssertionError):
        fuzz.finite(data)


@pytest.mark.parametrize("text", ["a\rb", "x" * 3000, "Traceback (most recent call last)", "\x1b[31m"])
def test_a_message_that_is_not_one_plain_line_is_found(fuzz, text):
    fuzz.plain_line("loomopt: a.toml: l1: it is wrong. Mend it.")
    with pytest.raises(AssertionError):
        fuzz.plain_line(text)
