"""Second order of toys: what is open, what curves, what Newton's step corrects, and what is settled."""

import numpy as np
import pytest
from support import toy

from loomopt.model.program import AxisMove, Preference, ScaleMove
from loomopt.model.sampling import Sampler
from loomopt.solving.certificate import kkt, second_order
from loomopt.solving.certificate.certificate import certify
from loomopt.solving.certificate.derivatives_mp import MpmathDerivatives
from loomopt.solving.certificate.kkt import active_set
from loomopt.solving.certificate.second_order import Local


def local_at(program, **x):
    sampler = Sampler(program.model, x)
    active = active_set(program, sampler)
    exact = MpmathDerivatives(program, x, sampler, active.rows)
    return Local(program, x, sampler, active, exact, exact.gradients())


def curvature(program, **x):
    """Return what second order says of the first level."""
    local = local_at(program, **x)
    system = kkt.system(local.active, 0, [])
    return second_order.second_order_of(local, 0, system, kkt.solve_system(local.gradients, system))


def of(formula, **limits):
    rows = {"f": formula}
    return toy.program("xy", rows, limits=[(name, *limit) for name, limit in limits.items()])


def valley(bend):
    return of(lambda v: v["x"] ** 2 + bend * v["y"] ** 2)


@pytest.mark.parametrize(
    ("bend", "minimum", "unique", "final"),
    [
        (1.0, True, True, True),
        (1e-7, True, True, True),
        (4e-8, True, False, False),
        (0.0, True, False, False),
        (-4e-8, True, False, False),
        (-1e-7, False, False, False),
        (-1.0, False, False, False),
    ],
)
def test_curvature_counts_above_1e_7(bend, minimum, unique, final):
    second_curvature = curvature(valley(bend), x=0.0, y=0.0)
    assert (second_curvature.minimum, second_curvature.unique, second_curvature.determined) == (minimum, unique, final)


def test_a_touching_limit_closes_a_way_that_falls():
    """x² − y² with y open to both sides, to one, held, and shut from both."""
    falls = {"f": lambda v: v["x"] ** 2 - v["y"] ** 2}
    assert not curvature(toy.program("xy", falls), x=0.0, y=0.0).minimum
    assert not curvature(toy.program("xy", falls, limits=(("y", -1, 0.0),)), x=0.0, y=0.0).minimum
    assert curvature(toy.program("xy", falls, limits=(("y", 0, 0.0),)), x=0.0, y=0.0).minimum
    shut = (("y", -1, 0.0), ("y", 1, 0.0))
    second_curvature = curvature(toy.program("xy", falls, limits=shut), x=0.0, y=0.0)
    assert (second_curvature.minimum, second_curvature.unique) == (True, True)


@pytest.mark.parametrize(("bend", "off"), [(1.0, 1e-6), (2e-3, 1e-4), (2e-5, 1e-3)])
def test_newtons_step_leads_to_the_bottom_of_a_bowl_however_shallow(bend, off):
    second_curvature = curvature(of(lambda v: bend * (v["x"] - 1) ** 2 / 2 + (v["y"] - 2) ** 2), x=1 + off, y=2.0)
    assert second_curvature.step == pytest.approx([-off, 0.0], rel=1e-9, abs=1e-12)


def test_newtons_step_does_not_follow_what_is_nearly_level():
    second_curvature = curvature(of(lambda v: 5e-6 * (v["x"] - 1) ** 2 / 2 + (v["y"] - 2) ** 2), x=1.001, y=2.0)
    assert len(second_curvature.step) == 0 or second_curvature.step == pytest.approx([0.0, 0.0], abs=1e-12)


def test_newtons_step_leads_back_onto_what_binds():
    program = of(lambda v: -v["x"] + (v["y"] - 1) ** 2, x=(1, 3.0))
    second_curvature = curvature(program, x=3 - 4e-8, y=1 + 1e-5)
    assert second_curvature.step == pytest.approx([4e-8, -1e-5], rel=1e-9)
    assert len(curvature(program, x=3.0, y=1.0).step) == 0


def test_a_step_within_rounding_is_none():
    assert len(curvature(of(lambda v: (v["x"] ** 2 + v["y"] ** 2) / 2), x=0.9e-13, y=0.0).step) == 0
    assert curvature(of(lambda v: (v["x"] ** 2 + v["y"] ** 2) / 2), x=1.5e-13, y=0.0).step[0] == pytest.approx(-1.5e-13)


def test_the_certificate_tells_the_first_step_and_its_length():
    program = toy.program("xy", {"f": lambda v: (v["x"] - 1) ** 2 + v["y"] ** 2}, sizes={"x": 4.0})
    certificate = certify(program, {"x": 1 + 4e-8, "y": 0.0}, 1e-8)
    assert certificate.correction == pytest.approx({"x": -4e-8, "y": 0.0}, rel=1e-8, abs=1e-18)
    assert certificate.step == pytest.approx(1e-8, rel=1e-6), "in units of the scale"
    assert certificate.error == pytest.approx(1e-8, rel=1e-6)


def test_pieces_that_share_a_peak_forbid_what_parts_them():
    """max(x + y², −x + y²) at 0: along x the pieces part, along y the peak curves by 2."""
    rows = {"p": lambda v: v["x"] + v["y"] ** 2, "q": lambda v: v["y"] ** 2 - v["x"]}
    program = toy.program("xy", rows, objectives=("p, q",))
    local = local_at(program, x=0.0, y=0.0)
    system = kkt.system(local.active, 0, [])
    cone = second_order.critical_cone(local, system, kkt.solve_system(local.gradients, system))
    assert np.abs(cone.basis) == pytest.approx(np.array([[0.0], [1.0]]))
    assert curvature(program, x=0.0, y=0.0).unique


def cubic(v):
    return v["x"] ** 2 + v["y"] ** 3


def test_a_fall_of_third_order_is_found_by_probing():
    second_curvature = curvature(of(cubic), x=0.0, y=0.0)
    assert (second_curvature.minimum, second_curvature.higher) == (True, "falls")
    assert curvature(of(lambda v: v["x"] ** 2 + v["y"] ** 4), x=0.0, y=0.0).higher == "holds"
    assert curvature(of(cubic, y=(-1, 0.0)), x=0.0, y=0.0).higher == "holds", "the way that falls is shut"
    assert curvature(of(lambda v: cubic(v) + 4e-5 * v["y"] ** 2), x=0.0, y=0.0).higher == "falls"
    assert curvature(of(lambda v: cubic(v) + 1e-2 * v["y"] ** 2), x=0.0, y=0.0).higher == "holds"


# Settled but for moves that change nothing ------------------------------------------------------------------------


def moved(rows, along=("y",), kind=AxisMove, limits=(), objectives=("f", "g"), least=-9.0):
    today, bounds = dict.fromkeys(along, 1.0), dict.fromkeys(along, (least, 9.0))
    move = kind("slide", along, (Preference("today", "tidier"),), today, bounds)
    return toy.program("xy", rows, limits=limits, objectives=objectives, moves=(move,))


IDLE = {"f": lambda v: (v["x"] - 1) ** 2, "g": lambda v: v["x"] ** 3}


def test_a_level_settles_all_but_what_changes_nothing():
    """Level 2 then has nothing to choose, though it has no multipliers of its own: f holds x to second order only."""
    assert curvature(moved(IDLE), x=1.0, y=1.0).determined
    certificate = certify(moved(IDLE), {"x": 1.0, "y": 1.0}, 1e-8)
    assert certificate.passed, certificate.reasons
    assert certificate.levels[1].stationarity == 0.0
    assert not certificate.unique


@pytest.mark.parametrize(
    "program",
    [
        moved(IDLE | {"g": lambda v: v["x"] ** 3 + v["y"]}),
        moved(IDLE | {"g": lambda v: v["x"] ** 3 + (v["y"] - 1) ** 2 * (v["y"] - 9) ** 2 * (v["y"] + 9) ** 2}),
        moved(IDLE, along=("x",)),
        moved(IDLE | {"h": lambda v: v["x"] - v["y"]}, limits=(("h", 1, 0.0),)),
        toy.program("xy", IDLE, objectives=("f", "g")),
    ],
    ids=["a later objective", "one between the ends", "no move", "a limit that is touched", "no moves at all"],
)
def test_what_does_change_something_is_still_to_be_chosen(program):
    assert not curvature(program, x=1.0, y=1.0).determined


def test_the_bound_of_what_moves_does_not_count():
    assert curvature(moved(IDLE, limits=(("x", 1, 5.0),)), x=1.0, y=9.0).determined
    assert not curvature(moved(IDLE, objectives=("f",)), x=1.0, y=1.0).determined, "no later level asks"


def test_a_common_scale_that_changes_nothing_is_settled_too():
    ratio = {"f": lambda v: (v["x"] / v["y"] - 2) ** 2, "g": lambda v: v["x"] / v["y"]}
    assert curvature(moved(ratio, ("x", "y"), ScaleMove, least=0.5), x=2.0, y=1.0).determined
    tilted = ratio | {"g": lambda v: v["x"]}
    assert not curvature(moved(tilted, ("x", "y"), ScaleMove, least=0.5), x=2.0, y=1.0).determined


@pytest.mark.parametrize(
    ("formula", "shut", "looks"),
    [
        (lambda v: v["x"], True, False),
        (lambda v: v["x"] - 1e-14 * v["y"] ** 3, True, True),
        (lambda v: v["x"] ** 2, False, True),
    ],
    ids=["a line without change", "less than a change that counts", "something curves beside it"],
)
def test_a_move_that_changes_nothing_is_looked_along_only_beside_what_curves(monkeypatch, formula, shut, looks):
    looked = []

    def counted(self, lagrangian, way, slope):
        looked.append(way)
        return "holds"

    monkeypatch.setattr(second_order.FeasibleCurve, "verdict", counted)
    program = moved({"f": formula}, limits=(("x", -1, 0.0),) if shut else (), objectives=("f",))
    assert curvature(program, x=0.0, y=1.0).higher == "holds"
    assert bool(looked) == looks
