"""Prices in SI units: what an objective's figure would fall per unit of a limit."""

from dataclasses import replace

import pytest
from support import toy

from loomopt.model.program import Limit, Objective
from loomopt.model.sampling import Sampler
from loomopt.solving.certificate.kkt import figure_of, priced

WAVES = {"w": lambda m, v, phi: v["x"] * m.cos(phi)}
ROWS = {"square": lambda v: v["x"] ** 2, "size": lambda v: v["x"], "inverse": lambda v: 1 / v["x"]}
SAMPLER = Sampler(toy.program("x", ROWS, WAVES, objectives=("square",)).model, {"x": -4.0})
LIMIT = Limit("size", 1, "size", -4.0, 2.0, "static")


def worth(objective, multiplier=0.5, limit=LIMIT):
    return priced(SAMPLER, limit, objective, multiplier)


def test_a_multiplier_is_in_natural_sizes():
    assert worth(Objective("size", "size", "value", 6.0)).worth == pytest.approx(0.5 * 6 / 2)
    assert worth(Objective("size", "size", "value", 6.0), -0.5).worth == pytest.approx(1.5)


@pytest.mark.parametrize(
    ("objective", "expected"),
    [
        (Objective("size", "square", "value", 1.0, power=2), 0.25 / 8),
        (Objective("w", "w", "peak", 1.0), 0.25),
        (Objective("mean", "square", "value", 1.0, power=2), 0.25 / 8),
        (Objective("size", "inverse", "value", 1.0, power=-1), 0.25 * 16),
    ],
)
def test_a_power_is_undone(objective, expected):
    """d(size²) = 2 size d(size), at |size| = 4."""
    assert worth(objective).worth == pytest.approx(expected, rel=1e-12)


def test_a_weighed_limit_is_worth_its_weight():
    weighed = replace(LIMIT, weight="square")
    assert worth(Objective("size", "size", "value", 6.0), limit=weighed).worth == pytest.approx(1.5 * 16)


def test_the_side_is_the_limits_or_where_an_equality_pushes():
    objective = Objective("size", "size", "value", 1.0)
    assert [worth(objective, m, replace(LIMIT, sign=s)).side for s, m in ((1, 1), (-1, 1), (0, 1), (0, -1))] == [
        1, -1, 1, -1,
    ]  # fmt: skip


def test_the_figure_of_an_objective():
    assert figure_of(SAMPLER, Objective("size", "size", "magnitude", 1.0)) == -4.0
    assert figure_of(SAMPLER, Objective("nobody", "size", "magnitude", 1.0)) == 4.0
    assert figure_of(SAMPLER, Objective("size", "w", "peak", 1.0)) == pytest.approx(4.0)
    assert figure_of(SAMPLER, Objective("mean", "square", "value", 1.0, power=2)) == pytest.approx(4.0)
    both = Objective("both", "square", "value", 1.0, others=("size",), combine="sum")
    assert figure_of(SAMPLER, both) == pytest.approx(12.0)
