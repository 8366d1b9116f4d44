"""Slopes and curvatures in 40 digits: those of formulas whose derivatives are written down, to 13 digits and more."""

import math
from dataclasses import replace

import numpy as np
import pytest
from support import toy

from loomopt.model.sampling import Extreme, Sampler
from loomopt.solving.certificate.derivatives_mp import MpmathDerivatives
from loomopt.solving.certificate.kkt import active_set


def exact_at(program, x):
    """Return a program's rows around x, and their places by name."""
    sampler = Sampler(program.model, x)
    active = active_set(program, sampler)
    return MpmathDerivatives(program, x, sampler, active.rows), {row.name: k for k, row in enumerate(active.rows)}


BENT = {
    "f": lambda v: v["x"] ** 3 * v["y"] ** 2 + v["y"] ** 4,
    "g": lambda v: v["x"] ** 4 - 3 * v["x"] * v["y"],
}


def test_slopes_and_curvatures_of_polynomials():
    x, y = 1.25, -0.75
    program = toy.program("xy", BENT, limits=(("g", 1, x**4 - 3 * x * y),))
    exact, place = exact_at(program, {"x": x, "y": y})
    gradients, curved = exact.gradients(), exact.curvatures(np.eye(2))
    assert gradients[place["f"]] == pytest.approx([3 * x**2 * y**2, 2 * x**3 * y + 4 * y**3], rel=1e-15)
    assert gradients[place["g"]] == pytest.approx([4 * x**3 - 3 * y, -3 * x], rel=1e-15)
    bent = np.array([[6 * x * y**2, 6 * x**2 * y], [6 * x**2 * y, 2 * x**3 + 12 * y**2]])
    assert curved[place["f"]] == pytest.approx(bent, rel=1e-14)
    assert curved[place["g"]] == pytest.approx(np.array([[12 * x**2, -3.0], [-3.0, 0.0]]), abs=1e-14)


def test_curvatures_are_of_second_order():
    """A one-sided difference would be off by the third derivative times its step: 6e-10 here."""
    program = toy.program("x", {"f": lambda v: 100 * v["x"] ** 3})
    exact, place = exact_at(program, {"x": 0.0})
    assert abs(exact.curvatures(np.eye(1))[place["f"], 0, 0]) < 1e-14


def test_derivatives_are_in_natural_sizes_and_along_the_basis():
    program = toy.program("xy", BENT, sizes={"x": 10.0, "y": 0.5, "f": 4.0})
    x, y = 2.0, 0.25
    exact, place = exact_at(program, {"x": x, "y": y})
    assert exact.gradients()[place["f"]] == pytest.approx(
        [10 * 3 * x**2 * y**2 / 4, 0.5 * (2 * x**3 * y + 4 * y**3) / 4], rel=1e-15
    )
    basis = np.array([[0.6, 0.8], [-0.8, 0.6]])
    plain, turned = exact.curvatures(np.eye(2))[place["f"]], exact.curvatures(basis)[place["f"]]
    assert turned == pytest.approx(basis.T @ plain @ basis, rel=1e-13)


def test_a_variable_that_is_held_without_a_limit_has_no_column():
    program = toy.program("xy", BENT)
    y = program.variables[1]._replace(lower=2.0, upper=2.0)
    exact, _ = exact_at(replace(program, variables=(program.variables[0], y)), {"x": 1.0, "y": 2.0})
    assert exact.names == ["x"]
    assert exact.gradients().shape[1] == 1


def test_an_extreme_that_moves_with_the_design_bends_the_peak():
    """The peak of x cos φ + y sin φ is √(x² + y²): slope (c, s), curvature across it 1/√(x² + y²)."""
    waves = {"w": lambda m, v, phi: v["x"] * m.cos(phi) + v["y"] * m.sin(phi)}
    exact, place = exact_at(toy.program("xy", {}, waves, objectives=("peak w",)), {"x": 3.0, "y": 4.0})
    assert exact.gradients()[place["w"]] == pytest.approx([0.6, 0.8], rel=1e-14)
    expected = np.array([[0.64, -0.48], [-0.48, 0.36]]) / 5
    assert exact.curvatures(np.eye(2))[place["w"]] == pytest.approx(expected, rel=1e-12)


def test_the_lowest_value_counts_with_its_sign():
    """Of x − 2 + cos φ / 4 at x = 0 the largest magnitude is 2.25, at φ = π: it falls as x grows."""
    waves = {"w": lambda m, v, phi: v["x"] - 2 + m.cos(phi) / 4}
    exact, place = exact_at(toy.program("x", {}, waves, objectives=("peak w",)), {"x": 0.0})
    assert exact.gradients()[place["w"]] == pytest.approx([-1.0], rel=1e-15)


def test_an_extreme_is_settled_by_newtons_step_from_where_it_was_sampled():
    waves = {"w": lambda m, v, phi: v["x"] * m.cos(phi - 1)}
    program = toy.program("x", {}, waves, objectives=("peak w",))
    exact, place = exact_at(program, {"x": 1.0})
    assert sorted(map(float, exact.u.values())) == pytest.approx([0.5 / math.pi, 0.5 / math.pi + 0.5], rel=1e-14)
    row = exact.rows[place["w"]]
    for off, settles in ((1e-6, True), (2e-2, False)):
        node = Extreme(0, 0.5 / math.pi + off, 1.0)
        moved = float(exact._newton_step(row, node, exact._reading(exact.base)))
        wanted = 0.5 / math.pi if settles else node.u
        assert moved == pytest.approx(wanted, abs=1e-15), "a step of more than 1e-3 is of no extreme"


def test_a_peak_without_curvature_is_no_division_by_zero():
    waves = {"w": lambda m, v, phi: v["x"] ** 2 + 0 * phi}
    exact, place = exact_at(toy.program("x", {}, waves, objectives=("peak w",)), {"x": 2.0})
    assert exact.gradients()[place["w"]] == pytest.approx([4.0], rel=1e-15)
    assert exact.curvatures(np.eye(1))[place["w"], 0, 0] == pytest.approx(2.0, rel=1e-14)


def test_rows_are_off_their_bounds_by_what_they_exceed_and_pieces_as_large_as_they_are():
    waves = {"w": lambda m, v, phi: v["x"] * m.cos(phi)}
    limits = (("w", 1, 1.0), ("y", -1, 2.0))
    program = toy.program("xy", {}, waves, limits=limits, objectives=("peak w", "|y|"), sizes={"w": 4.0, "y": 2.0})
    exact, _ = exact_at(program, {"x": 1 + 1e-7, "y": 2 - 1e-7})
    values = [float(value) for value in exact._values(exact.base)]
    ends = sum(row.limit is not None and row.node is not None for row in exact.rows)
    assert ends == 3, "a cosine touches at both ends of the turn and at its middle"
    assert values[:ends] == pytest.approx([1e-7 / 4] * ends, rel=1e-6)
    assert values[ends] == pytest.approx(1e-7 / 2, rel=1e-6)
    assert values[ends + 1 : -1] == pytest.approx([0.25] * ends, rel=1e-6)
    assert values[-1] == pytest.approx(1.0, rel=1e-6)


def test_a_lopsided_extreme_bends_the_peak_by_its_own_curvature():
    """Of x cos φ + y sin 2 φ, whose third derivative in φ is not zero at its top."""
    waves = {"w": lambda m, v, phi: v["x"] * m.cos(phi) + v["y"] * m.sin(2 * phi)}
    x, y, phi = 1.0, 0.3, 0.4
    for _ in range(20):
        bend = -x * math.cos(phi) - 4 * y * math.sin(2 * phi)
        phi -= (-x * math.sin(phi) + 2 * y * math.cos(2 * phi)) / bend
    moves = np.array([-math.sin(phi), 2 * math.cos(2 * phi)])
    program = toy.program("xy", {}, waves, objectives=("peak w",), signed=True)
    exact, place = exact_at(program, {"x": x, "y": y})
    assert exact.curvatures(np.eye(2))[place["w"]] == pytest.approx(-np.outer(moves, moves) / bend, rel=1e-11)
