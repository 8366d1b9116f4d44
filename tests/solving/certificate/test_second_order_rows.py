"""What second order is made of: rank, steps back, lines that are looked along, and the prices they are read with."""

import math

import numpy as np
import pytest
from support import toy

from loomopt.model.program import AxisMove, Preference
from loomopt.model.sampling import Sampler
from loomopt.physics.tolerances import FLAT
from loomopt.solving.certificate import kkt, second_order
from loomopt.solving.certificate.derivatives_mp import MpmathDerivatives
from loomopt.solving.certificate.kkt import LevelMultipliers, active_set
from loomopt.solving.certificate.second_order import CriticalCone, Local


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


def critical(program, **x):
    local = local_at(program, **x)
    system = kkt.system(local.active, 0, [])
    return second_order.critical_cone(local, system, kkt.solve_system(local.gradients, system))


# Rank -------------------------------------------------------------------------------------------------------------


def sloped(*slopes):
    """Return: least x² + y² with a · x = 0 for each slope a."""
    rows = {f"r{k}": lambda v, a=a, b=b: a * v["x"] + b * v["y"] for k, (a, b) in enumerate(slopes)}
    square = {"f": lambda v: v["x"] ** 2 + v["y"] ** 2}
    return toy.program("xy", square | rows, limits=tuple((name, 0, 0.0) for name in rows))


@pytest.mark.parametrize(
    ("slopes", "open_ways"),
    [
        (((1.0, 0.0),), 1),
        (((1e-5, 0.0),), 1),
        (((1.1e-7, 0.0),), 1),
        (((0.9e-7, 0.0),), 2),
        (((1.0, 0.0), (0.0, 1.1e-7)), 0),
        (((1.0, 0.0), (0.0, 0.9e-7)), 1),
        (((1e3, 0.0), (0.0, 1.1e-4)), 0),
        (((1e3, 0.0), (0.0, 0.9e-4)), 1),
        (((1.0, 0.0), (2.0, 0.0)), 1),
    ],
)
def test_slopes_count_above_a_ten_millionth_of_the_largest(slopes, open_ways):
    assert critical(sloped(*slopes), x=0.0, y=0.0).basis.shape == (2, open_ways)


@pytest.mark.parametrize(("slope", "counts"), [(1.1e-7, 1), (0.9e-7, 0), (-1.1e-7, 1)])
def test_a_touching_row_counts_above_a_slope_of_a_ten_millionth(slope, counts):
    rows = {"f": lambda v: v["x"] ** 2 + v["y"] ** 2, "g": lambda v: slope * v["y"]}
    program = toy.program("xy", rows, limits=(("g", 1, 0.0),))
    assert len(critical(program, x=0.0, y=0.0).slopes) == counts


# Steps ------------------------------------------------------------------------------------------------------------


def test_where_nothing_is_open_the_step_leads_back_onto_the_vertex():
    second_curvature = curvature(
        toy.program("xy", {"f": lambda v: v["x"] + v["y"]}, limits=(("x", -1, 1.0), ("y", -1, 2.0))),
        x=1 + 3e-8,
        y=2 - 4e-8,
    )
    assert second_curvature.determined
    assert second_curvature.step == pytest.approx([-3e-8, 4e-8], rel=1e-6)


def test_the_step_onto_a_slanted_row_is_the_shortest():
    """Of 3 x + 4 y = 0, missed by 5e-8."""
    cone = critical(sloped((3.0, 4.0)), x=3e-9, y=4e-9)
    assert cone.back == pytest.approx([-3e-9, -4e-9], rel=1e-6)
    assert np.abs(cone.basis[:, 0]) == pytest.approx([0.8, 0.6])


@pytest.mark.parametrize(("off", "steps"), [(0.9e-13, 0), (1.1e-13, 1)])
def test_a_distance_of_rounding_is_not_corrected(off, steps):
    cone = CriticalCone(np.zeros((1, 0)), np.array([off]), np.zeros((0, 0)))
    assert len(second_order._newton(cone, np.zeros((0, 0)), np.zeros(0), np.zeros(1))) == steps


def test_newtons_step_goes_down_the_slope_and_back():
    cone = CriticalCone(np.eye(3)[:, :2], np.array([0.0, 0.0, 0.25]), np.zeros((0, 2)))
    step = second_order._newton(cone, np.eye(2), np.array([2.0, 4.0]), np.array([1.0, -1.0, 9.0]))
    assert step == pytest.approx([-0.5, 0.25, 0.25])


# Lines and ways -----------------------------------------------------------------------------------------------------


def test_a_level_plane_is_looked_at_along_its_axes_and_both_diagonals():
    half = math.sqrt(0.5)
    result = second_order._lines(np.eye(2))
    assert np.array(result) == pytest.approx(np.array([[1, 0], [0, 1], [half, half], [-half, half]]))
    space = second_order._lines(np.eye(3))
    assert len(space) == 3 + 2 * 3
    assert [np.linalg.norm(line) for line in space] == pytest.approx([1.0] * 9)
    assert second_order._lines(np.zeros((0, 3))) == []


def test_of_a_line_the_ways_are_open_that_no_touching_row_shuts():
    first, both = np.array([[1.0, 0.0]]), np.array([[1.0, 0.0], [-1.0, 0.0]])
    line = np.array([1.0, 0.0])
    for slopes, count in ((np.zeros((0, 2)), 2), (first, 1), (both, 0), (1e-7 * both, 2), (1.1e-7 * both, 0)):
        assert len(CriticalCone(np.eye(2), np.zeros(2), slopes).directions(line)) == count
    assert CriticalCone(np.eye(2), np.zeros(2), first).directions(line)[0].tolist() == [-1.0, 0.0]


# Prices -------------------------------------------------------------------------------------------------------------


@pytest.fixture
def read(monkeypatch):
    """Return what the Lagrangian is asked: prices, held levels, directions and the slope that is left."""
    requests = []

    class Stub:
        def __init__(self, program, x, level, prices, fixed):
            self.of = level, prices, fixed

        def falls(self, direction, slope):
            requests.append((*self.of, direction, slope))
            return False

    monkeypatch.setattr(second_order, "Lagrangian", Stub)
    return requests


def higher(local, level, result, ways):
    """Return what higher orders do where nothing falls along a straight line: no design beside is asked for."""
    cone = second_order.CriticalCone(
        np.eye(2), np.zeros(2), np.zeros((0, 2)), sums=np.zeros((0, len(local.active.rows)))
    )
    curve = second_order._curve(local, cone, np.zeros((2, 0)), np.zeros(0))
    return second_order._higher(
        second_order._lagrangian(local, level, result), curve, ways, result.residual, every=False
    )


def test_rows_of_one_limit_add_up_and_pieces_of_the_objective_have_no_price(read):
    """A wave that touches its limit at three places, and y in units of 2."""
    waves = {"w": lambda m, v, phi: v["x"] * m.cos(phi)}
    rows = {"f": lambda v: v["x"]}
    limits = (("y", 1, 5.0), ("w", 1, 1.0))
    local = local_at(toy.program("xy", rows, waves, limits=limits, sizes={"y": 2.0}), x=1.0, y=0.0)
    assert (local.active.limits, len(local.active.rows)) == (3, 4)
    result = LevelMultipliers(np.array([0.25, 0.5, 0.0, 1.0]), 0.125)
    assert higher(local, 0, result, [np.array([0.0, 1.0])]) == "holds"
    assert read == [(0, {1: 0.75}, {}, {"x": 0.0, "y": 2.0}, 0.125)]


def test_earlier_levels_are_held_by_what_their_pieces_carry(read):
    rows = {"p": lambda v: v["x"], "q": lambda v: v["y"], "g": lambda v: v["x"] - v["y"]}
    local = local_at(toy.program("xy", rows, objectives=("p, q", "g")), x=1.0, y=1.0)
    result = LevelMultipliers(np.array([3.0, 5.0, 1.0]), 0.0)
    assert second_order.level_multiplier(local.active, 0, result) == 8.0
    higher(local, 1, result, [np.array([1.0, 0.0])])
    higher(local, 0, result, [np.array([1.0, 0.0])])
    assert [(level, fixed) for level, _, fixed, _, _ in read] == [(1, {0: 8.0}), (0, {})]


# Moves --------------------------------------------------------------------------------------------------------------


def sliding(bend):
    """Return two levels, of which x² + bend · y² is the first; z changes nothing and is a move."""
    rows = {"f": lambda v: v["x"] ** 2 + bend * v["y"] ** 2, "g": lambda v: v["x"] ** 3}
    move = AxisMove("slide", ("z",), (Preference("today", "tidier"),), {"z": 1.0}, {"z": (-9.0, 9.0)})
    return toy.program("xyz", rows, objectives=("f", "g"), moves=(move,), sizes={"z": 3.0})


@pytest.mark.parametrize(("bend", "final"), [(1.0, True), (1e-7, True), (4e-8, False), (0.0, False)])
def test_what_is_left_beside_a_move_must_curve(bend, final):
    assert curvature(sliding(bend), x=0.0, y=0.0, z=1.0).determined == final


@pytest.mark.parametrize(("bend", "final"), [(FLAT, False), (1.001 * FLAT, True)])
def test_what_is_left_beside_a_move_curves_by_more_than_none(bend, final):
    local = local_at(sliding(1.0), x=0.0, y=0.0, z=1.0)
    basis = np.eye(3)[:, 1:]
    assert second_order._determined_except_moves(local, 0, basis, np.diag([bend, 0.0])) == final


@pytest.mark.parametrize(("off", "is_open"), [(0.0, True), (0.9e-7, True), (1.1e-7, False)])
def test_a_way_is_open_that_lies_in_the_basis_to_a_ten_millionth(off, is_open):
    assert second_order._is_open(np.array([[1.0], [0.0]]), np.array([1.0, off])) == is_open
