"""Whatever is changed in a scene at random, it is read or refused: never another error."""

import copy
import math
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from loomopt.base.errors import BadInput
from loomopt.base.units import SI_UNIT
from loomopt.jobs.registry import load, scene
from loomopt.scenes import packaged
from loomopt.scenes.scene import Scene

BEATUP = load("beatup")
TEXT = packaged.problems()["beatup"].read_text(encoding="utf-8")


SCALARS = st.one_of(
    st.text(max_size=12),
    st.sampled_from(["1e60 m", "1e-59 m", "1 mm", "5 deg", "0 kg", "inf m", "1e999 kg", "60 mm", "exact", "true"]),
    st.builds("{} {}".format, st.floats(width=32), st.sampled_from(["mm", "deg", "kg", "N*m", "rpm", "kg*m^2"])),
    st.integers(),
    st.floats(),
    st.booleans(),
    st.none(),
    st.dates(),
)
JUNK = st.recursive(
    SCALARS,
    lambda inner: (
        st.lists(inner, max_size=2)
        | st.dictionaries(st.sampled_from(["min", "max", "free", "J4"]) | st.text(max_size=4), inner, max_size=3)
    ),
    max_leaves=4,
)
KEYS = st.sampled_from(["l1", "l2", "J4", "pulse", "swing", "balance", "gravity", "effects", "M0", "min"])


def paths(table, start=()):
    """Return the path of everything in nested tables."""
    inner = [path for name, value in table.items() if isinstance(value, dict) for path in paths(value, (*start, name))]
    return [(*start, name) for name in table] + inner


@st.composite
def mutated(draw):
    """Return the packaged tables with a few values removed, replaced or added at random."""
    document = copy.deepcopy(dict(BEATUP.document))
    if draw(st.booleans()):
        document["effects"] |= document["available"]
    for _ in range(draw(st.integers(1, 3))):
        *path, last = draw(st.sampled_from([path for path in paths(document) if path[0] != "problem"]))
        table = document
        for name in path:
            table = table[name]
        subject = draw(st.sampled_from(["remove", "replace", "add", "rescale", "rescale"]))
        if subject == "remove":
            table.pop(last, None)
        elif subject == "rescale":
            _, _, unit = str(table.get(last, "")).partition(" ")
            table[last] = f"{draw(st.floats(1e-70, 1e70) | st.floats(0, 1000))} {unit}"
        else:
            table[last if subject == "replace" else draw(KEYS)] = draw(JUNK)
    return document


def read_or_refused(call, *arguments):
    """Check that a call gives a scene that works, or plain lines."""
    try:
        result = call(*arguments)
    except BadInput as error:
        assert all(line.isprintable() for line in str(error).split("\n"))  # noqa: PT017 (both outcomes are right)
        return
    assert isinstance(result, Scene)
    assert len(result.hash) == 12
    assert all(result.shown_in(kind) for kind in SI_UNIT)
    assert all(math.isfinite(value) for value in result.mechanism.values())


@pytest.mark.slow
@given(mutated())
@settings(deadline=None, derandomize=True, max_examples=150)
def test_mutated_tables_are_read_or_refused(document):
    read_or_refused(scene, document)


@pytest.mark.slow
@given(st.lists(st.sampled_from(paths(BEATUP.document)).map(".".join) | st.text(max_size=20), max_size=3), JUNK)
@settings(deadline=None, derandomize=True, max_examples=100)
def test_any_key_set_is_read_or_refused(keys, value):
    read_or_refused(BEATUP.update, dict.fromkeys(keys, value))


@given(
    st.lists(
        st.tuples(st.integers(0, len(TEXT) - 1), st.integers(0, 9), st.binary(max_size=6)),
        min_size=1,
        max_size=3,
    )
)
@settings(
    deadline=None,
    derandomize=True,
    max_examples=150,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
def test_mutated_bytes_are_read_or_refused(tmp_path, cuts):
    content = TEXT.encode()
    for at, length, inserted in cuts:
        content = content[:at] + inserted + content[at + length :]
    path = Path(tmp_path / "scene.toml")
    path.write_bytes(content)
    read_or_refused(load, path)
