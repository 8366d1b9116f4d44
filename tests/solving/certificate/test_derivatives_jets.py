"""Slopes and curvatures by jets: those of 40 digits, on optima, on other machines, and on toys."""

import functools
import math

import numpy as np
import pytest
from support import toy

import loomopt as lo
from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.maths.jets import variables
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import Node
from loomopt.physics.tolerances import JET_ERROR
from loomopt.solving.certificate import derivatives
from loomopt.solving.certificate.batch_derivatives import DesignAt, Designs, JetReading
from loomopt.solving.certificate.derivatives import JetDerivatives
from loomopt.solving.certificate.derivatives_mp import MpmathDerivatives
from loomopt.solving.certificate.kkt import active_set

OPTIMA = [
    ("beatup", "balance"),
    ("beatup", "pulse"),
    ("beatup", "retrofit"),
    ("rapier", "stroke-dwell"),
    ("rapier", "smooth"),
    ("rapier", "match"),
    ("rapier", "dwell"),
    ("shedding", "stiffness"),
    ("shedding", "force"),
    ("shedding", "law"),
    ("shedding", "speed"),
]


@functools.cache
def optimum(problem, target):
    """Return the program of a packaged task and its optimum."""
    scene = lo.load(problem)
    program = registry.of(scene).program(scene, target)
    answer = lo.solve(scene, target, starts=1)
    assert answer.status == "optimal"
    return program, answer.point.x


def both(program, x):
    """Return the derivatives of the active rows at x by jets and by 40 digits."""
    sampler = Sampler(program.model, {**program.parameters, **x})
    rows = active_set(program, sampler).rows
    return JetDerivatives(program, x, sampler, rows), MpmathDerivatives(program, x, sampler, rows)


def assert_alike(program, x):
    """Both ways agree fifty times better than the error jets are said to have."""
    jets, digits = both(program, x)
    assert (jets.by, digits.by) == ("jets", "40 digits")
    basis = np.linalg.qr(np.random.default_rng(3).normal(size=(len(jets.names), 2)))[0]
    for result, wanted in ((jets.gradients(), digits.gradients()), (jets.curvatures(basis), digits.curvatures(basis))):
        sizes = np.abs(wanted).reshape(len(wanted), -1).max(axis=1, initial=1.0)
        off = np.abs(result - wanted).reshape(len(wanted), -1).max(axis=1, initial=0.0)
        assert (off / sizes).max() <= JET_ERROR / 50


@pytest.mark.parametrize(("problem", "target"), OPTIMA)
@pytest.mark.few(3)
def test_slopes_and_curvatures_at_optima_are_those_of_40_digits(problem, target):
    assert_alike(*optimum(problem, target))


@pytest.mark.parametrize(("problem", "target"), OPTIMA[0::3])
@pytest.mark.parametrize("seed", range(3))
def test_slopes_and_curvatures_of_other_machines_are_those_of_40_digits(problem, target, seed):
    program, x = optimum(problem, target)
    rng = np.random.default_rng(seed)
    moved = {v.name: min(max(x[v.name] + 1e-3 * v.scale * rng.normal(), v.lower), v.upper) for v in program.variables}
    assert_alike(program, moved)


def wave(formula, names="xy"):
    """Return the program of least peak of a wave."""
    return toy.program(
        names, {}, {"w": lambda m, v, phi: formula(m, phi, *(v[n] for n in names))}, objectives=("peak w",)
    )


WAVES = {
    "a top that moves": (wave(lambda m, phi, x, y: x * m.cos(phi) + y * m.sin(phi)), (3.0, 4.0)),
    "a lopsided top": (wave(lambda m, phi, x, y: x * m.cos(phi) + y * m.sin(2 * phi)), (1.0, 0.3)),
    "a level wave": (wave(lambda m, phi, x, y: x**2 * y + 0 * phi), (2.0, 3.0)),
    "a number": (wave(lambda m, phi, x, y: x**2 * y), (2.0, 3.0)),
    "a wave of the angle alone": (wave(lambda m, phi, x, y: m.sin(phi)), (2.0, 3.0)),
}


@pytest.mark.parametrize("name", WAVES)
def test_tops_move_with_the_design(name):
    program, (x, y) = WAVES[name]
    assert_alike(program, {"x": x, "y": y})


def test_an_extreme_is_settled_by_newtons_step_from_where_it_was_sampled():
    program = wave(lambda m, phi, x: x * m.cos(phi - 1), "x")
    jets, _ = both(program, {"x": 1.0})
    assert sorted(jets.u) == pytest.approx([0.5 / math.pi, 0.5 / math.pi + 0.5], rel=1e-15)
    batch = Designs([DesignAt(program, {"x": 1.0}, jets.sampler, jets.rows)])
    for off, settles in ((1e-6, True), (2e-2, False)):
        u = np.array([[0.5 / math.pi + off] * 2])
        assert batch.newton_step(batch.x, u)[0, 0] == pytest.approx(0.5 / math.pi if settles else u[0, 0], abs=1e-15)


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_what_is_no_number_is_said_so(value):
    rows = toy.program("x", {"f": lambda v: v["x"] + value})
    for program in (rows, wave(lambda m, phi, x: x + 0 * phi + value, "x")):
        sampler = Sampler(program.model, {"x": 1.0})
        with pytest.raises(ArithmeticError, match="no number"):
            JetDerivatives(program, {"x": 1.0}, sampler, active_set(program, sampler).rows).gradients()


def test_the_end_of_a_root_has_no_slope_in_floats():
    program = toy.program("x", formulas={"f": lambda m, v: m.sqrt(v["x"])})
    sampler = Sampler(program.model, {"x": 0.0})
    with pytest.raises(ArithmeticError):
        JetDerivatives(program, {"x": 0.0}, sampler, active_set(program, sampler).rows).gradients()


def test_a_batch_of_designs_is_judged_in_one_pass():
    """Of 20 designs beside each other the peaks' slopes are those of each alone."""
    program, x = optimum("beatup", "balance")
    names = [v.name for v in program.variables]
    shares = 1 + 1e-3 * np.random.default_rng(0).normal(size=(20, len(names)))
    several = {n: np.array([[x[n]]]) * shares[:, k : k + 1] for k, n in enumerate(names)}
    system, angles = systems.jets(), np.array([0.1, 1.0, 4.0])

    def slopes(values):
        of = dict(zip(names, variables(list(values.values()), np.eye(len(names)), curved=True), strict=True))
        given = program.model.given(system, {**program.parameters, **of})
        return program.model.quantity(
            system, given, "peak_torque", Node(angles, {"resistance": np.array([0.0, 0.0, 1.0])})
        )

    together = slopes(several).whole()
    assert together.g.shape == (20, 3, len(names))
    for k in range(20):
        alone = slopes({n: float(several[n][k, 0]) for n in names}).whole()
        assert together.v[k] == pytest.approx(alone.v, rel=1e-13)
        assert together.g[k] == pytest.approx(alone.g, rel=1e-12, abs=1e-10)
        assert together.h[k] == pytest.approx(alone.h, rel=1e-11, abs=1e-8)


def test_all_whole_cycle_rows_are_read_in_one_pass_whatever_their_quantities(monkeypatch):
    program, x = optimum("rapier", "stroke-dwell")
    sampler = Sampler(program.model, {**program.parameters, **x})
    rows = active_set(program, sampler).rows
    read, whole = [], JetReading.along

    def counted(self, names, pieces, u):
        read.append(names)
        return whole(self, names, pieces, u)

    monkeypatch.setattr(JetReading, "along", counted)
    result = JetDerivatives(program, x, sampler, rows)
    result.gradients()
    result.curvatures(np.eye(len(result.names)))
    names = tuple(dict.fromkeys(row.reads for row in rows if row.node))
    assert len(names) > 1
    assert read == [names]
    # Of many variables in three: for the extremes, for slopes, and along the few directions that are asked.
    monkeypatch.setattr(derivatives, "AT_ONCE", 0)
    apart, basis = JetDerivatives(program, x, sampler, rows), np.eye(len(result.names))[:, :2]
    sizes = np.abs(result.gradients()).max(axis=1, initial=1.0)
    assert np.abs(apart.gradients() - result.gradients()).max(axis=1) == pytest.approx(0.0 * sizes, abs=1e-12)
    assert apart.curvatures(basis) == pytest.approx(result.curvatures(basis), rel=1e-10, abs=1e-8)
    assert read == [names] * 4


def test_an_extreme_that_stands_beside_its_place_is_read_again_there():
    program = wave(lambda m, phi, x: x * m.cos(phi - 1), "x")
    sampler = Sampler(program.model, {"x": 1.0})
    rows = active_set(program, sampler).rows
    off = [row._replace(node=row.node._replace(u=row.node.u + 1e-5)) for row in rows]
    there, neighbour = (JetDerivatives(program, {"x": 1.0}, sampler, item) for item in (rows, off))
    assert neighbour.u == pytest.approx(there.u, abs=1e-15)
    assert neighbour.gradients() == pytest.approx(there.gradients(), abs=1e-14)
    assert neighbour.curvatures(np.eye(1)) == pytest.approx(there.curvatures(np.eye(1)), abs=1e-13)
