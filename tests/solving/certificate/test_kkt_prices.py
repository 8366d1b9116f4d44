"""Prices in SI units: what an objective's figure would fall per unit of a limit."""

from dataclasses import replace

import pytest
from support import toy

from loomopt.model.limits import DesignLimit, RatioLimit
from loomopt.model.objectives import Magnitude, Peak, Value, Worst
from loomopt.model.sampling import Sampler
from loomopt.solving.certificate.kkt import price_limit

WAVES = {"w": lambda m, v, phi: v["x"] * m.cos(phi)}
ROWS = {"square": lambda v: v["x"] ** 2, "size": lambda v: v["x"], "inverse": lambda v: 1 / v["x"]}
SAMPLER = Sampler(toy.program("x", ROWS, WAVES, objectives=("square",)).model, {"x": -4.0})
LIMIT = DesignLimit("size", 1, "size", -4.0, 2.0)


def worth(objective, multiplier=0.5, limit=LIMIT):
    return price_limit(SAMPLER, limit, objective, multiplier)


def test_a_multiplier_is_in_natural_sizes():
    assert worth(Value("size", "size", 6.0)).worth == pytest.approx(0.5 * 6 / 2)
    assert worth(Value("size", "size", 6.0), -0.5).worth == pytest.approx(1.5)


@pytest.mark.parametrize(
    ("objective", "expected"),
    [
        (Value("size", "square", 1.0, power=2), 0.25 / 8),
        (Peak("w", "w", 1.0), 0.25),
        (Value("mean", "square", 1.0, power=2), 0.25 / 8),
        (Value("size", "inverse", 1.0, power=-1), 0.25 * 16),
    ],
)
def test_a_power_is_undone(objective, expected):
    """d(size²) = 2 size d(size), at |size| = 4."""
    assert worth(objective).worth == pytest.approx(expected, rel=1e-12)


def test_a_weighed_limit_is_worth_its_weight():
    weighed = RatioLimit("size", 1, "size", -4.0, 2.0, "square")
    assert worth(Value("size", "size", 6.0), limit=weighed).worth == pytest.approx(1.5 * 16)


def test_the_side_is_the_limits_or_where_an_equality_pushes():
    objective = Value("size", "size", 1.0)
    assert [worth(objective, m, replace(LIMIT, sign=s)).side for s, m in ((1, 1), (-1, 1), (0, 1), (0, -1))] == [
        1, -1, 1, -1,
    ]  # fmt: skip


def test_the_figure_of_an_objective():
    assert Magnitude("size", "size", 1.0).figure_of(SAMPLER) == -4.0
    assert Magnitude("nobody", "size", 1.0).figure_of(SAMPLER) == 4.0
    assert Peak("size", "w", 1.0).figure_of(SAMPLER) == pytest.approx(4.0)
    assert Value("mean", "square", 1.0, power=2).figure_of(SAMPLER) == pytest.approx(4.0)
    assert Worst("both", "size", 1.0, ("square",)).figure_of(SAMPLER) == pytest.approx(16.0)
