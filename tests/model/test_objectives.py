"""Each kind of objective: what a design is worth, its rows and pieces, its limits; what an NLP depends on."""

import math

import numpy as np
import pytest
from support import toy
from support.worst import WorstMagnitude, WorstPeak

from loomopt.maths import systems
from loomopt.model.limits import CycleLimit, DesignLimit
from loomopt.model.objectives import Magnitude, Peak, Value, Worst
from loomopt.model.reading import BatchReading
from loomopt.model.sampling import Sampler

ROWS = {"p": lambda v: v["x"] - 5, "q": lambda v: v["y"]}
WAVES = {"wave": lambda m, v, phi: v["x"] * m.cos(phi), "swing": lambda m, v, phi: 4 * v["y"] * m.sin(phi)}
HERE = Sampler(toy.program("xy", ROWS, WAVES).model, {"x": 3.0, "y": 0.5})
"""p = −2, q = 0.5, peaks 3 and 2."""
KINDS = {
    "value": (Value("p", "p", 4.0), -2.0),
    "worst": (Worst("both", "p", 4.0, ("q",)), 0.5),
    "magnitude": (Magnitude("p", "p", 4.0), 2.0),
    "peak": (Peak("top", "wave", 4.0), 3.0),
    "worst magnitude": (WorstMagnitude("both", "p", 4.0, ("q",)), 2.0),
    "worst peak": (WorstPeak("both", "wave", 4.0, ("swing",)), 3.0),
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_design_is_worth_its_largest_piece(kind):
    objective, worth = KINDS[kind]
    assert objective.merit(HERE) == pytest.approx(worth, rel=1e-14)
    assert max(piece.value for piece in objective.pieces(HERE)) == pytest.approx(worth, rel=1e-14)
    sides = [sign * HERE.single(row) for row, sign in objective.sides]
    peaks = [HERE.peak(row) for row in objective.quantities]
    assert max(sides + peaks) == pytest.approx(worth, rel=1e-14)


def test_rows_are_of_the_design_or_over_the_cycle():
    assert {kind: (item.sides, item.quantities) for kind, (item, _) in KINDS.items()} == {
        "value": ((("p", 1.0),), ()),
        "worst": ((("p", 1.0), ("q", 1.0)), ()),
        "magnitude": ((("p", 1.0), ("p", -1.0)), ()),
        "peak": ((), ("wave",)),
        "worst magnitude": ((("p", 1.0), ("p", -1.0), ("q", 1.0), ("q", -1.0)), ()),
        "worst peak": ((), ("wave", "swing")),
    }
    assert [item.is_smooth for item, _ in KINDS.values()] == [True] + [False] * 5
    assert [item.rows for item, _ in KINDS.values()][:4] == [("p",), ("p", "q"), ("p",), ("wave",)]


def test_a_magnitude_has_its_own_sign_and_both_where_it_vanishes():
    there = Sampler(HERE.model, {"x": 5.0, "y": 0.5})
    assert [(piece.value, piece.sign) for piece in Magnitude("p", "p", 4.0).pieces(HERE)] == [(2.0, -1.0)]
    assert [(piece.value, piece.sign) for piece in Magnitude("p", "p", 4.0).pieces(there)] == [(0.0, 1.0), (0.0, -1.0)]


def test_the_pieces_of_a_peak_stand_at_its_extremes():
    for piece in Peak("top", "wave", 4.0).pieces(HERE):
        assert piece.sign == math.copysign(1.0, piece.node.value)
        assert piece.value == piece.node.height


def test_the_structure_is_kind_and_rows():
    kinds = [item for item, _ in KINDS.values()]
    assert len({item.structure for item in kinds}) == len(kinds)
    assert Value("other", "p", 9.0, power=2).structure == kinds[0].structure
    assert Value("p", "q", 4.0).structure != kinds[0].structure
    assert Worst("both", "p", 4.0, ("x",)).structure != kinds[1].structure


def test_what_keeps_an_objective_at_a_value_is_as_many_limits_as_it_has_rows():
    assert {kind: item.limits("cap", 7.0) for kind, (item, _) in list(KINDS.items())[:4]} == {
        "value": [DesignLimit("cap", 1, "p", 7.0, 4.0)],
        "worst": [DesignLimit("cap", 1, "p", 7.0, 4.0), DesignLimit("cap", 1, "q", 7.0, 4.0)],
        "magnitude": [DesignLimit("cap", 1, "p", 7.0, 4.0), DesignLimit("cap", -1, "p", -7.0, 4.0)],
        "peak": [CycleLimit("cap", 1, "wave", 7.0, 4.0)],
    }
    for objective, worth in list(KINDS.values())[:4]:
        excesses = [limit.excess(HERE) for limit in objective.limits("cap", 1.0)]
        assert max(excesses) == pytest.approx((worth - 1.0) / 4.0), "exceeded by as much as the objective is above"


def test_what_an_objective_is_never_less_than():
    assert [item.least for item, _ in KINDS.values()] == [-math.inf, -math.inf, 0.0, 0.0, 0.0, 0.0]
    of_sizes = [item.least_of(()) for item, _ in KINDS.values()]
    of_values = [item.least_of({"wave"}) for item, _ in KINDS.values()]
    assert of_sizes == [-math.inf, -math.inf, 0.0, 0.0, 0.0, 0.0]
    assert of_values == [-math.inf, -math.inf, 0.0, -math.inf, 0.0, -math.inf], "a signed wave may lie below 0"
    bounds = {"p": -8.0, "q": -4.0, "wave": 2.0}
    assert [item.least_within(bounds) for item, _ in list(KINDS.values())[:4]] == [-8.0, -math.inf, 0.0, -math.inf]
    assert Value("q", "q", 1.0).least_within({}) == -math.inf


def test_a_figure_is_sought_least_or_most_and_worsens_the_other_way():
    assert [item.sense for item, _ in list(KINDS.values())[:4]] == ["least", "least", "least magnitude", "least"]
    assert Value("speed", "period", 1.0, power=-1).sense == "most"
    assert [Value("p", "p", 1.0).worsening(3.0, 5.0, most) for most in (False, True)] == [2.0, -2.0]
    assert Magnitude("p", "p", 1.0).worsening(3.0, -5.0, most=False) == 2.0


def test_a_peak_is_watched_by_its_whole_curve_and_all_else_by_itself():
    pieces, u = HERE.grid(16)
    both = {name: np.array([value, value]) for name, value in HERE.values.items()}
    designs = BatchReading(HERE.model, systems.numpy(), both, HERE.cycle, HERE.stills)
    designs.look(["wave"], pieces, u)
    curve = np.tile(HERE.at("wave", pieces, u)[:, None], 2)
    assert Peak("top", "wave", 4.0).watched(designs) == pytest.approx(curve)
    assert Magnitude("p", "p", 4.0).watched(designs) == pytest.approx(np.array([[2.0, 2.0]]))
