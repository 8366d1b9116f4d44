"""Each kind of limit: what it exceeds, reads and touches, what an NLP depends on; and one more kind, solved."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from support import toy

from loomopt.maths import systems
from loomopt.model.limits import BoundLimit, CycleLimit, DesignLimit, RatioLimit
from loomopt.model.sampling import Sampler
from loomopt.physics.tolerances import ACTIVE
from loomopt.solving.certificate.certificate import certify

ROWS = {"p": lambda v: 2 * v["x"], "w": lambda v: v["y"] ** 2}
WAVES = {"wave": lambda m, v, phi: v["x"] * m.cos(phi)}
PROGRAM = toy.program("xy", ROWS, WAVES)
X = {"x": 3.0, "y": 0.5}


def sampler(x=X, program=PROGRAM):
    return Sampler(program.model, x)


ABOVE: dict[str, Any] = {
    "bound": (BoundLimit("x", 1, "x", 1.0, 4.0), 3 - 1),
    "value": (DesignLimit("p", 1, "p", 1.0, 4.0), 6 - 1),
    "ratio": (RatioLimit("p/w", 1, "p", 1.0, 4.0, "w"), 6 - 1 * 0.25),
    "wave": (CycleLimit("wave", 1, "wave", 1.0, 4.0), 3 - 1),
}


@pytest.mark.parametrize("kind", ABOVE)
def test_a_maximum_is_exceeded_by_what_is_above_it_in_its_natural_size(kind):
    limit, excess = ABOVE[kind]
    assert limit.excess(sampler()) == pytest.approx(excess / 4, rel=1e-14)
    assert limit.violation(sampler()) == limit.excess(sampler())


@pytest.mark.parametrize("kind", ["bound", "value", "ratio"])
def test_a_minimum_is_exceeded_from_below_and_an_equality_is_missed_on_either_side(kind):
    limit, excess = ABOVE[kind]
    assert replace(limit, sign=-1).excess(sampler()) == pytest.approx(-excess / 4, rel=1e-14)
    equal = replace(limit, sign=0, value=100.0)
    assert equal.excess(sampler()) < 0.0
    assert equal.violation(sampler()) == -equal.excess(sampler())


@pytest.mark.parametrize("kind", ["bound", "value", "ratio"])
def test_a_single_row_is_the_same_in_every_number_system(kind):
    limit, excess = ABOVE[kind]
    for system in (systems.FLOAT, systems.mpmath(), systems.numpy()):
        reading = sampler().read(system)
        assert float(limit.residual(reading)) == pytest.approx(excess, rel=1e-14)
        assert float(limit.residual(reading, system.number(0.0))) == pytest.approx(3 if kind == "bound" else 6)


def test_a_bound_reads_the_variable_though_a_row_has_its_name():
    program = toy.program("xy", {"x": lambda v: 10 * v["x"]})
    there = sampler(program=program)
    assert BoundLimit("x", 1, "x", 0.0, 1.0).excess(there) == 3.0
    assert DesignLimit("x", 1, "x", 0.0, 1.0).excess(there) == 30.0


def test_a_minimum_over_the_cycle_leaves_the_rest_of_its_complement():
    limit = CycleLimit("least", -1, "wave", 1.0, 4.0, complement=5.0)
    assert limit.bound == 4.0
    assert limit.excess(sampler()) == pytest.approx((3 - 4) / 4)
    assert limit.figure(sampler()) == pytest.approx(5 - 3), "what the designer reads, and limits to 1"


def test_what_is_read_is_told():
    assert {kind: limit.reads for kind, (limit, _) in ABOVE.items()} == {
        "bound": ("x",), "value": ("p",), "ratio": ("p", "w"), "wave": ("wave",),
    }  # fmt: skip
    assert [limit.is_of_variable for limit, _ in ABOVE.values()] == [True, False, True, False]
    assert [limit.named_scale for limit, _ in ABOVE.values()] == [4.0, 4.0, 1.0, 4.0]
    assert [float(limit.factor(sampler().rows)) for limit, _ in ABOVE.values()] == [1.0, 1.0, 0.25, 1.0]


def test_the_structure_is_all_but_the_numbers():
    kinds = [limit for limit, _ in ABOVE.values()]
    same = [BoundLimit("p", 1, "p", 1.0, 4.0), DesignLimit("p", 1, "p", 1.0, 4.0), CycleLimit("p", 1, "p", 1.0, 4.0)]
    assert len({limit.structure for limit in (*kinds, *same)}) == 6, "the limit of p is there twice"
    for limit in kinds:
        assert replace(limit, value=9.0, scale=2.0, hidden=True).structure == limit.structure
        for changed in ({"sign": -1}, {"row": "q"}, {"name": "other"}, {"relaxable": False}):
            assert replace(limit, **changed).structure != limit.structure
    wave = kinds[-1]
    assert replace(wave, where=("step", 1.0)).structure != wave.structure
    assert replace(wave, complement=2.0).structure == wave.structure
    assert replace(kinds[2], weight="p").structure != kinds[2].structure


@pytest.mark.parametrize("kind", ABOVE)
def test_a_limit_is_touched_where_it_is_no_farther_than_that(kind):
    limit, _ = ABOVE[kind]
    for share, count in ((0.9, True), (1.1, False)):
        near = {"bound": 1.0, "value": 0.5, "ratio": 0.125, "wave": 1.0}[kind]
        step = share * ACTIVE * limit.scale / (2 if kind in ("value", "ratio") else 1)
        touches = limit.touches(sampler({"x": near - step, "y": 0.5}))
        assert bool(touches) == count
        assert all(of == limit and excess == pytest.approx(-share * ACTIVE, rel=1e-6) for of, excess, _ in touches)


def test_a_whole_cycle_limit_is_touched_at_each_of_its_extremes():
    limit = replace(ABOVE["wave"][0], value=3.0)
    result = limit.touches(sampler())
    assert sorted(float(sampler().angle(touch.node)) for touch in result) == pytest.approx(
        [0.0, np.pi, 2 * np.pi], abs=1e-6
    )
    assert [touch.excess for touch in result] == pytest.approx([0.0] * 3, abs=1e-15)
    assert limit.near(sampler()) == [touch.node for touch in result]


def test_where_the_weight_vanishes_a_ratio_keeps_the_row_from_below():
    limit, here = RatioLimit("p/w", 1, "p", 1.0, 4.0, "w"), sampler({"x": 0.0, "y": 0.0})
    assert limit.touches(here) == []
    for sign in (-1, 0):
        (touch,) = replace(limit, sign=sign).touches(here)
        assert (touch.limit.sign, touch.excess) == (-1, 0.0)


def test_a_program_knows_its_limits_by_kind_and_by_place():
    bound, value, ratio, wave = (limit for limit, _ in ABOVE.values())
    program = replace(PROGRAM, limits=(wave, bound, ratio, value))
    assert program.bound_limits == {1: bound}
    assert program.single_limits == {1: bound, 2: ratio, 3: value}
    assert program.design_limits == {2: ratio, 3: value}
    assert program.cycle_limits == {0: wave}
    assert program.row_limits == (wave, ratio, value)


def test_rows_of_one_side_give_way_together_and_kinds_apart():
    limits = (
        DesignLimit("p", 1, "p", 1.0, 1.0), DesignLimit("p", 1, "w", 1.0, 1.0), BoundLimit("p", 1, "x", 1.0, 1.0),
        DesignLimit("p", -1, "p", 1.0, 1.0), DesignLimit("p", 0, "p", 1.0, 1.0),
        DesignLimit("p", 1, "x", 1.0, 1.0, relaxable=False),
    )  # fmt: skip
    assert replace(PROGRAM, limits=limits).excess_places == {0: (0,), 1: (0,), 2: (1,), 3: (2,), 4: (3, 4)}


# One more kind, of which nothing else knows ------------------------------------------------------------------------


@dataclass(frozen=True)
class ProductLimit(DesignLimit):
    """A limit of the product of two values of the design."""

    other: str

    @property
    def reads(self):
        return self.row, self.other

    def _read(self, rows):
        return rows.single(self.row) * rows.single(self.other)


def square(sign=-1, value=4.0):
    """Return the program that brings x + 4 y down to where x · y is at least 4: x = 4, y = 1, at 8."""
    rows = {"f": lambda v: v["x"] + 4 * v["y"], "first": lambda v: v["x"], "second": lambda v: v["y"]}
    program = toy.program("xy", rows, bounds={"x": (0.5, 20.0), "y": (0.5, 20.0)}, start={"x": 2.0, "y": 3.0})
    limit = ProductLimit("f", sign, "first", value, 2.0, "second")
    return replace(program, limits=(*program.limits, limit))


def test_another_kind_of_limit_is_solved_certified_and_priced():
    answer = toy.solve(square())
    assert answer.status == "optimal", answer.message
    assert answer.design == pytest.approx({"x": 4.0, "y": 1.0}, rel=1e-8)
    (price,) = answer.binding
    assert (price.limit, price.value, price.worth) == ("f", 4.0, {"f": pytest.approx(1.0, rel=1e-6)})
    assert not certify(square(), {"x": 4.01, "y": 4.0 / 4.01}, 1e-8).passed


def test_another_kind_of_limit_gives_way():
    """Within the bounds x · y is at most 400."""
    answer = toy.solve(square(value=500.0))
    assert answer.status == "infeasible"
    assert [(relaxation.limit, relaxation.needed) for relaxation in answer.relaxation if relaxation.limit == "f"] == [
        ("f", pytest.approx(400.0, rel=1e-6))
    ]
