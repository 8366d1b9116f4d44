"""A first level that can vanish is held at 0, and later levels have the rest."""

import numpy as np
import pytest
from support import toy

from loomopt.model.objectives import Magnitude, Peak, Value
from loomopt.solving.search import vanishing_levels

WAVES = {
    "wave": lambda m, v, phi: (v["x"] - 1) * m.cos(phi) + (v["y"] + v["x"] - 3) * m.sin(phi),
    "other": lambda m, v, phi: v["z"] * m.cos(phi) + v["x"] + v["y"],
}
BOUNDS = {"x": (-5.0, 5.0), "y": (-5.0, 5.0), "z": (-4.0, 5.0)}


def test_the_first_level_is_0_and_the_second_is_least_beside_it():
    program = toy.program(
        "xyz", {"g": lambda v: (v["z"] - 2) ** 2 + v["x"] + v["y"]}, WAVES, (), ("peak wave", "g"), None, BOUNDS
    )
    answer = toy.solve(program)
    assert answer.status == "optimal"
    assert [answer.design[name] for name in "xyz"] == pytest.approx([1, 2, 2], abs=1e-9)
    assert answer.figures["wave"] <= 1e-9


def test_rows_that_span_all_are_chosen_and_no_more():
    rows = np.array([[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 1e-12], [1.0, 1.0, 0.0]])
    chosen = vanishing_levels.independent_rows(rows)
    assert len(chosen) == 2
    assert np.linalg.matrix_rank(rows[chosen]) == 2
    assert vanishing_levels.independent_rows(np.zeros((3, 2))) == []


def test_only_a_peak_of_a_size_can_be_held_at_0():
    signed = toy.model(waves=WAVES, signed=True)
    plain = toy.model(waves=WAVES)
    assert vanishing_levels.smooth_quantities(plain, Peak("wave", "wave", 1.0)) == ("wave",)
    assert vanishing_levels.smooth_quantities(signed, Peak("wave", "wave", 1.0)) == ()
    assert vanishing_levels.smooth_quantities(plain, Magnitude("f", "f", 1.0)) == ()
    assert vanishing_levels.smooth_quantities(plain, Value("f", "f", 1.0)) == ()
