"""Limits that have a price only together: what loosening them gives, beside linear programs solved apart."""

import numpy as np
import pytest
from scipy.optimize import linprog
from support import toy

from loomopt.solving.certificate.certificate import certify

A, B = 2.0, 3.0
"""Slopes of two pieces that are each other's mirror image: either variable alone makes one of them rise."""


def worst(extra="", **rows):
    """Return the program of the larger of two mirror images, with rows of its own."""
    pieces = {"f": lambda v: A * v["x"] - B * v["y"], "g": lambda v: A * v["y"] - B * v["x"]}
    return lambda *limits: toy.program("xy", {**pieces, **rows}, limits=limits, objectives=("f, g",))


def fall(rows, steps, equal=()):
    """Return what the larger of the two falls by where limits rows · (x, y) <= 0 are loosened by steps."""
    pieces = [[A, -B, -1.0], [-B, A, -1.0]]
    sides = [(*row, 0.0) for k, row in enumerate(rows) if k not in equal]
    free = [step for k, step in enumerate(steps) if k not in equal]
    fixed = [(*rows[k], 0.0) for k in equal]
    optimum = linprog(
        [0, 0, 1],
        A_ub=[*pieces, *sides],
        b_ub=[0, 0, *free],
        A_eq=fixed or None,
        b_eq=[steps[k] for k in equal] or None,
        bounds=[(None, None)] * 3,
    )
    assert optimum.status == 0
    return -optimum.fun


def test_two_bounds_of_mirror_images():
    certificate = certify(worst()(("x", 1, 0.0), ("y", 1, 0.0)), {"x": 0.0, "y": 0.0}, 1e-8)
    assert certificate.passed
    assert (certificate.unique, certificate.prices_unique) == (True, False)
    assert [(price.limit.name, price.worth) for price in certificate.binding] == [("x", 0.0), ("y", 0.0)]
    (joint,) = certificate.bind_together
    rows = [(1, 0), (0, 1)]
    for steps in ((1.0, 1.0), (2.0, 0.5), (1.0, 0.9), (1.0, 0.0)):
        assert joint.worth(steps) == pytest.approx(fall(rows, steps), abs=1e-12)
    assert joint.worth((1.0, 1.0)) == pytest.approx(B - A)


def test_a_bound_with_a_limit_of_another_size():
    """x ≤ 0 and a row 4 y + x ≤ 0: x alone gains nothing, for the row takes it back."""
    program = worst(sum=lambda v: 4 * v["y"] + v["x"])(("x", 1, 0.0), ("sum", 1, 0.0))
    certificate = certify(program, {"x": 0.0, "y": 0.0}, 1e-8)
    rows = [(1, 0), (1, 4)]
    alone = {price.limit.name: price.worth for price in certificate.binding}
    for k, name in enumerate(("x", "sum")):
        assert alone[name] == pytest.approx(fall(rows, np.eye(2)[k]), abs=1e-12)
    (joint,) = certificate.bind_together
    for steps in ((1.0, 1.0), (1.0, 3.0), (0.2, 1.0)):
        assert joint.worth(steps) == pytest.approx(fall(rows, steps), abs=1e-12)


def test_an_equality_counts_on_the_side_on_which_it_gains():
    certificate = certify(worst()(("x", 0, 0.0), ("y", 1, 0.0)), {"x": 0.0, "y": 0.0}, 1e-8)
    alone = {item.limit.name: item.worth for item in certificate.binding}
    assert alone == {"x": 0.0, "y": 0.0}
    (joint,) = certificate.bind_together
    assert [item.side for item in joint.bindings] == [1, 1]
    for steps in ((1.0, 1.0), (1.0, 2.0)):
        assert joint.worth(steps) == pytest.approx(fall([(1, 0), (0, 1)], steps, equal=(0,)), abs=1e-12)


def test_a_limit_that_only_touches_is_not_said_to_bind():
    program = toy.program(
        "xy", {"f": lambda v: -v["x"] + v["y"] ** 2, "other": lambda v: v["x"] + v["y"]},
        limits=(("x", 1, 0.0), ("other", 1, 0.0)),
    )  # fmt: skip
    certificate = certify(program, {"x": 0.0, "y": 0.0}, 1e-8)
    assert [(price.limit.name, price.worth) for price in certificate.binding] == [("x", 1.0)]
    assert certificate.prices_unique
    assert certificate.bind_together == ()


def test_three_limits_of_which_only_all_gain():
    """x ≥ 0, 2 x ≥ 0 and 3 x ≥ 0: any two leave the third."""
    program = toy.program(
        "xy",
        {"f": lambda v: v["x"] + v["y"] ** 2, "double": lambda v: 2 * v["x"], "triple": lambda v: 3 * v["x"]},
        limits=(("x", -1, 0.0), ("double", -1, 0.0), ("triple", -1, 0.0)),
    )
    certificate = certify(program, {"x": 0.0, "y": 0.0}, 1e-8)
    assert {item.worth for item in certificate.binding} == {0.0}
    (joint,) = certificate.bind_together
    assert [item.limit.name for item in joint.bindings] == ["x", "double", "triple"]
    assert joint.worth((1.0, 1.0, 1.0)) == pytest.approx(1 / 3)
    assert joint.worth((1.0, 2.0, 3.0)) == pytest.approx(1.0)
