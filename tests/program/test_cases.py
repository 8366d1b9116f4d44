"""Several cases, such as several fabrics on one machine: the same formulas at several sets of scene numbers."""

import itertools
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from made_up import CLOTH, FRONT, INERTIA, NUMBERS, SPRING, Yoke
from scipy.optimize import minimize
from worst import WorstPeak

from loomopt.maths import systems
from loomopt.model.limits import CycleLimit, DesignLimit
from loomopt.model.model import Integral, JobModel, Quantity, Row, cased
from loomopt.model.objectives import Peak
from loomopt.model.program import Program, Variable
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import TURN, Node
from loomopt.solving.nlp import exchange
from loomopt.solving.nlp.point import Settings

OTHER = {"cloth.F": 700.0, "cloth.width": 1.7}
"""The second fabric: softer, and pressed earlier."""
THIRD = {"cloth.F": 4000.0, "cloth.width": 0.35}
ONE = JobModel(
    Yoke(),
    (INERTIA, SPRING, CLOTH),
    own_quantities={"torque": Quantity(lambda at: at.crank_torque), "force": Quantity(lambda at: at.force)},
    own_rows={"front_force": Row(lambda at: at.force, event=FRONT), "stroke": Row(lambda at: at.values["stroke"])},
)
FABRICS = replace(ONE, cases=(tuple(OTHER), tuple(THIRD)))
ALL = {**NUMBERS, **{cased(n, k + 1): v for k, case in enumerate((OTHER, THIRD)) for n, v in case.items()}}
CASES: tuple[dict[str, float], ...] = ({}, OTHER, THIRD)


def name_of(name, case):
    return cased(name, case) if case else name


def alone(case, **changes):
    """Return the machine with one fabric only."""
    return Sampler(ONE, {**NUMBERS, **CASES[case], **changes})


def test_switches_and_corners_of_all_cases_make_one_cycle():
    sampler = Sampler(FABRICS, ALL)
    assert FABRICS.switches == ("cloth", "cloth [case 1]", "cloth [case 2]")
    assert sampler.cycle.pieces == 6
    widths = [c.get("cloth.width", NUMBERS["cloth.width"]) for c in CASES]
    expected = sorted([np.pi - width for width in widths] + [np.pi] * 3)
    assert np.sort(np.mod(sampler.cycle.starts[:-1], TURN)) == pytest.approx(expected, rel=1e-15)
    for case, width in enumerate(widths):
        on = sampler.cycle.on((name_of("cloth", case), 1.0))
        assert np.diff(sampler.cycle.starts)[on].sum() == pytest.approx(width, rel=1e-14)


@pytest.mark.parametrize("case", range(3))
def test_a_case_is_the_machine_with_its_numbers(case):
    together, single = Sampler(FABRICS, ALL), alone(case)
    for quantity in ("torque", "force"):
        pieces, u = together.grid(500)
        inside = (u > 0) & (u < 1) & (np.diff(together.cycle.starts)[pieces] > 0)
        angles = together.cycle.angles(pieces, u)[inside]
        values = together.at(name_of(quantity, case), pieces, u)[inside]
        assert values == pytest.approx(single.at(quantity, *single.cycle.located(angles)), rel=1e-12, abs=1e-10)
        assert together.peak(name_of(quantity, case)) == pytest.approx(single.peak(quantity), rel=1e-12)
    assert together.single(name_of("front_force", case)) == pytest.approx(single.single("front_force"), rel=1e-15)
    assert together.single(name_of("stroke", case)) == pytest.approx(0.1, rel=1e-15)
    assert set(together.static) == {"front_force", "stroke"}, "of the first case, if nothing is asked by name"


@pytest.mark.parametrize(
    ("system", "case"), [(m, k) for m in (systems.FLOAT, systems.mpmath(), systems.numpy()) for k in range(3)]
)
def test_every_number_system_gives_the_same_values_of_a_case(system, case):
    sampler = Sampler(FABRICS, ALL)
    reading = sampler.read(system)
    name = name_of("torque", case)
    for piece, u in itertools.product(range(sampler.cycle.pieces), (0.1, 0.7)):
        value = float(sampler.at(name, np.array([piece]), np.array([u]))[0])
        assert float(reading.at(name, piece, system.number(u))) == pytest.approx(value, rel=1e-12, abs=1e-12)
    front = name_of("front_force", case)
    assert float(reading.single(front)) == pytest.approx(sampler.single(front), rel=1e-14)


def test_the_switch_of_a_case_at_an_event_is_its_own():
    """Just before the front the cloth is pressed in every case."""
    sampler = Sampler(FABRICS, ALL)
    assert set(sampler.stills) == {FRONT, cased(FRONT, 1), cased(FRONT, 2)}
    assert all(still[name_of("cloth", case)] == 1.0 for case, still in enumerate(sampler.stills.values()))
    forces = [sampler.single(name_of("front_force", case)) for case in range(3)]
    spring_and_mass = 3000 * (0.1 - 0.04) - 2 * 0.05 * 60**2
    assert forces == pytest.approx([spring_and_mass + force for force in (1500, 700, 4000)], rel=1e-12)


def test_cases_are_part_of_the_structure():
    assert len({ONE.key, FABRICS.key, replace(ONE, cases=(tuple(OTHER),)).key}) == 3
    assert FABRICS.has_quantity("torque [case 2]")
    assert not FABRICS.has_quantity("torque [case 3]")
    assert FABRICS.has_row("front_force [case 1]")
    assert not ONE.has_row("front_force [case 1]")


def test_a_case_s_derivatives_are_traced_with_its_own_numbers():
    system = systems.casadi()
    symbols = {name: ca.SX.sym("v") for name in ALL}
    given = FABRICS.given(system, symbols)
    for case in range(3):
        value = FABRICS.quantity(system, given, name_of("force", case), Node(3.0, dict.fromkeys(FABRICS.switches, 1)))
        traced = ca.Function("f", list(symbols.values()), [ca.jacobian(value, ca.vertcat(*symbols.values()))])
        slopes = dict(zip(symbols, np.asarray(traced(*ALL.values())).ravel(), strict=True))
        for other in range(3):
            assert (slopes[name_of("cloth.F", other)] != 0.0) == (other == case)


def task(limits=(), rows=("torque",)):
    """Return the program that balances the three fabrics by a spring; limits: (row, sign, value)."""
    variables = (
        Variable("spring.k", 0.0, 2e4, 1e3, (0.0, 2e4)),
        Variable("spring.p", -0.2, 0.2, 0.1, (-0.2, 0.2)),
    )
    parameters = {name: value for name, value in ALL.items() if name not in ("spring.k", "spring.p")}
    names = [name_of(row, case) for row in rows for case in range(3)]
    level = WorstPeak("torque", names[0], 10.0, tuple(names[1:]))
    own = tuple(
        (CycleLimit if FABRICS.has_quantity(row) else DesignLimit)(row, sign, row, value, 100.0)
        for row, sign, value in limits
    )
    start = {"spring.k": 3000.0, "spring.p": 0.04}
    return Program(FABRICS, variables, parameters, own, (level,), (start,))


def dense(x):
    """Return the objective by plain formulas on many crank angles, without the model."""
    phi = np.linspace(0, 2 * np.pi, 20_001)
    k, p = x
    peaks = []
    for case in CASES:
        v = {**NUMBERS, **case}
        q = v["r"] * (1 - np.cos(phi))
        force = v["inertia.m"] * v["r"] * np.cos(phi) * v["speed"] ** 2 + k * (q - p)
        met = np.cos(v["cloth.width"])
        fade = v["cloth.F"] * (-np.cos(phi) - met) / (1 - met)
        force += np.where((phi > np.pi - v["cloth.width"]) & (phi < np.pi), fade, 0.0)
        peaks.append(np.abs(force * v["r"] * np.sin(phi)).max())
    return max(peaks)


def test_the_least_peak_over_all_fabrics_is_that_of_brute_force():
    program = task()
    point = exchange.solve(program, program.starts[0], Settings())
    assert point.reached
    best = np.array([point.x["spring.k"], point.x["spring.p"]])
    value = program.objectives[0].merit(Sampler(FABRICS, {**program.parameters, **point.x}))
    assert dense(best) == pytest.approx(value, rel=1e-6)
    tried = []
    for start in ([3000, 0.04], [5000, 0.1], [8000, 0.05]):
        simplex = [start, [start[0] * 1.3, start[1]], [start[0], start[1] + 0.03]]
        options = {"xatol": 1e-9, "fatol": 1e-9, "maxiter": 4000, "initial_simplex": simplex}
        bounds = [(v.lower, v.upper) for v in program.variables]
        found = minimize(dense, start, method="Nelder-Mead", bounds=bounds, options=options)
        tried.append(found.fun)
    assert value <= min(tried) * (1 + 1e-6)
    assert value < dense((3000, 0.04)) * 0.99


@pytest.mark.parametrize("case", range(3))
def test_the_worst_of_all_is_worse_than_any_fabric_alone(case):
    together = task()
    point = exchange.solve(together, together.starts[0], Settings())
    worst = together.objectives[0].merit(Sampler(FABRICS, {**together.parameters, **point.x}))
    own = replace(together, objectives=(Peak("torque", name_of("torque", case), 10.0),))
    single = exchange.solve(own, own.starts[0], Settings())
    best = Sampler(FABRICS, {**own.parameters, **single.x}).peak(name_of("torque", case))
    assert best <= worst * (1 + 1e-9)


def test_limits_may_speak_of_one_case():
    free = task()
    at = Sampler(FABRICS, {**free.parameters, **exchange.solve(free, free.starts[0], Settings()).x})
    peak, front = at.peak("force [case 2]"), at.single("front_force [case 1]")
    for row, sign, value in (("force [case 2]", 1, 0.9 * peak), ("front_force [case 1]", -1, front + 20.0)):
        program = task(((row, sign, value),))
        point = exchange.solve(program, program.starts[0], Settings())
        assert point.reached
        held = Sampler(FABRICS, {**program.parameters, **point.x})
        assert program.limits[0].excess(held) == pytest.approx(0.0, abs=1e-9)
        assert program.objectives[0].merit(held) > free.objectives[0].merit(at)


def test_a_mean_is_that_of_the_first_case():
    square = {"force_square": Quantity(lambda at: at.force**2, figure=False)}
    mean = Integral("mean_square", "rms", "force_square", ("cloth", 1.0))
    quantities = {**FABRICS.own_quantities, **square}
    together = Sampler(replace(FABRICS, own_quantities=quantities, integrals=(mean,)), ALL)
    single = Sampler(replace(ONE, own_quantities=quantities, integrals=(mean,)), NUMBERS)
    assert together.single("rms") == pytest.approx(single.single("rms"), rel=1e-12)
