"""Tables as a person reads them: no exponents through a column, no rounding told as a number."""

import io
import pickle
import re

import pandas as pd
import pytest

import loomopt as lo
from loomopt.interface import answer_table
from loomopt.interface.table_frame import TableFrame

EXPONENT = re.compile(r"\d[eE][-+]\d")


@pytest.mark.parametrize(
    ("problem", "target", "zero"),
    [
        ("beatup", "balance", "M3_fdc"),
        ("beatup-heavy", "retrofit", "theta"),
        ("shedding", "stiffness", "contact_min"),
        ("shedding-static", "force", "contact_min"),
    ],
)
def test_an_answers_table_shows_rounding_as_zero_and_no_exponents(problem, target, zero):
    answer = lo.solve(problem, target)
    table = answer.table()
    assert isinstance(table, TableFrame)
    for shown in (repr(table), table._repr_html_(), str(table[["design", "max"]])):
        assert EXPONENT.findall(shown.replace("1e+06", "")) == []
    assert table.loc[zero, "design"] == 0.0
    assert abs(answer.figures[zero]) < 1e-9, "which is rounding, and stands in the figures as it was found"
    for name, value in answer.figures.items():
        if name in table.index and table.loc[name, "design"] == 0.0:
            assert abs(value) < 1e-6, "only rounding is shown as zero"


def test_a_huge_bound_leaves_its_column_readable():
    scene = lo.load("beatup").set("bounds.m4e.max", "1e8 kg")
    shown = repr(answer_table.frame(lo.evaluate(scene).result, scene))
    assert EXPONENT.findall(shown) == ["1e+0"], "its own cell alone"
    assert re.search(r"^l1 +mm +31 +30 +35 +True *$", shown, re.MULTILINE)


def test_a_small_number_is_not_rounding():
    scene = lo.load("beatup").set("effects.inertia.J4", "1e-10 kg*m^2")
    assert answer_table.frame(lo.evaluate(scene).result, scene).loc["J4", "design"] == 1e-10


def test_it_is_a_table_as_any_other():
    frame = TableFrame({"a": [1.0, 1e-12, 3e9], "b": ["x", "y", "z"]})
    assert frame.dtypes["a"].kind == "f"
    assert isinstance(frame[frame["a"] > 0.5], TableFrame)
    assert pickle.loads(pickle.dumps(frame)).equals(frame)
    assert list(frame["a"]) == [1.0, 1e-12, 3e9]
    assert pd.read_csv(io.StringIO(frame.to_csv(index=False)))["a"].tolist() == [1.0, 1e-12, 3e9]
    assert pd.get_option("display.float_format") is None
    assert re.search(r"^1 +1e-12 +y$", repr(frame), re.MULTILINE)
    assert re.search(r"^0 +1 +x$", repr(frame), re.MULTILINE)
