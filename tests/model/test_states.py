"""A state: one linear coordinate between the output and loads that move with it; its force stands for theirs.

Made up: an elastic arm carries the mass and the spring, and passes on the mean of their force, and its first harmonic
times the gain of a resonance. Both are of first harmonic already, so what the arm passes on is known in closed form.
"""

import itertools
import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from made_up import CLOTH, FRONT, INERTIA, NUMBERS, SPRING, Yoke

from loomopt.maths import systems
from loomopt.model.limits import DesignLimit
from loomopt.model.model import CycleQuantity, DesignRow, JobModel
from loomopt.model.objectives import Peak
from loomopt.model.program import Program, Variable
from loomopt.model.reading import Reading
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import Node
from loomopt.physics.effects.kinds import Load, State
from loomopt.physics.schema import Table
from loomopt.solving.nlp import exchange
from loomopt.solving.nlp.point import Settings, sampler_at
from loomopt.solving.nlp.transcribe import transcribe

SAMPLES = 8


class ArmTable(Table):
    ratio: float


def harmonics(at, carried):
    """Return mean and first harmonic of the carried force, the latter times 1 / (1 − ratio²)."""
    angles = [2 * at.maths.pi * k / SAMPLES for k in range(SAMPLES)]
    cosine, sine = at.maths.cos, at.maths.sin
    weights = [[1 for _ in angles], [cosine(angle) for angle in angles], [sine(angle) for angle in angles]]
    mean, cosines, sines = carried.weigh(angles, weights)
    share = 2 / (1 - at.table["ratio"] ** 2) / SAMPLES
    return {"arm.mean": mean / SAMPLES, "arm.cosine": share * cosines, "arm.sine": share * sines}


def passed_on(at, reply):
    mean, cosine, sine = (at.values[f"arm.{name}"] for name in ("mean", "cosine", "sine"))
    return mean + cosine * at.maths.cos(at.pose.phi) + sine * at.maths.sin(at.pose.phi)


def drag(at):
    return 0 * at.pose.q + 0.7


ARM = State(
    name="arm",
    summary="an elastic arm",
    table=ArmTable,
    carries=("inertia", "spring"),
    derived=harmonics,
    force=passed_on,
    coordinate=lambda *_: 0,
    motion=lambda written, values: (0, 0),
    term=lambda written, values: 0,
    difference=("x_a", "x"),
    rests=lambda values: "two harmonics are all there are",
)
DRAG = Load(name="drag", summary="", table=Table, acts="drive", force=drag)
STIFF = JobModel(
    Yoke(),
    (INERTIA, SPRING, CLOTH, DRAG),
    own_quantities={"torque": CycleQuantity(lambda at: at.crank_torque), "force": CycleQuantity(lambda at: at.force)},
    own_rows={"front_force": DesignRow(lambda at: at.force, event=FRONT)},
)
ELASTIC = replace(STIFF, effects=(*STIFF.effects, ARM))
WITH_ARM = {**NUMBERS, "arm.ratio": 0.5}
SYSTEMS = {"float": systems.FLOAT, "numpy": systems.numpy(), "mpmath": systems.mpmath()}


def by_hand(phi, pressed, ratio=0.5, **changes):
    """Return Q and the crank torque at one crank angle, from the closed form."""
    v = {**NUMBERS, **{key.replace("__", "."): value for key, value in changes.items()}}
    r, k, contact = v["r"], v["spring.k"], math.cos(v["cloth.width"])
    first = v["inertia.m"] * r * v["speed"] ** 2 - k * r
    force = k * (r - v["spring.p"]) + first * math.cos(phi) / (1 - ratio**2)
    force += v["cloth.F"] * (-math.cos(phi) - contact) / (1 - contact) if pressed else 0.0
    return force, force * r * math.sin(phi) + 0.7


@pytest.mark.parametrize("system", SYSTEMS.values(), ids=SYSTEMS)
def test_the_state_s_force_stands_for_what_it_carries(system):
    sampler = Sampler(ELASTIC, WITH_ARM)
    reading = sampler.read(system)
    for piece, u in itertools.product(range(2), (0.0, 0.3, 0.8)):
        phi = float(sampler.cycle.angles(np.array([piece]), np.array([u]))[0])
        pressed = bool(sampler.cycle.switch(piece)["cloth"])
        force, torque = by_hand(phi, pressed)
        assert float(reading.at("force", piece, system.number(u))) == pytest.approx(force, rel=1e-12)
        assert float(reading.at("torque", piece, system.number(u))) == pytest.approx(torque, rel=1e-12)
    assert float(reading.single("front_force")) == pytest.approx(by_hand(math.pi, True)[0], rel=1e-12)


def test_the_state_s_force_stands_in_symbols_too():
    system = systems.casadi()
    symbols = {name: ca.SX.sym("v") for name in WITH_ARM}
    given = ELASTIC.given(system, symbols)
    phi = ca.SX.sym("phi")
    value = ELASTIC.quantity(system, given, "force", Node(phi, {"cloth": 1.0}))
    slope = ca.gradient(value, symbols["spring.k"])
    traced = ca.Function("f", [*symbols.values(), phi], [value, slope])
    for angle in (2.4, 3.0):
        force, by_stiffness = map(float, traced(*WITH_ARM.values(), angle))
        assert force == pytest.approx(by_hand(angle, True)[0], rel=1e-12)
        assert by_stiffness == pytest.approx((0.05 - 0.04) - 0.05 * math.cos(angle) / 0.75, rel=1e-12)


def test_a_rigid_arm_changes_nothing():
    stiff, rigid = Sampler(STIFF, NUMBERS), Sampler(ELASTIC, {**NUMBERS, "arm.ratio": 0.0})
    pieces, u = stiff.grid()
    for name in ("force", "torque"):
        assert rigid.at(name, pieces, u) == pytest.approx(stiff.at(name, pieces, u), rel=1e-12, abs=1e-11)


def test_carried_loads_keep_their_own_terms_beside_the_state_s():
    sampler = Sampler(ELASTIC, WITH_ARM)
    terms = ELASTIC.instant(systems.FLOAT, sampler.given, Node(2.8, {"cloth": 1.0})).terms()
    assert list(terms) == ["inertia", "spring", "cloth", "drag", "arm"]
    force, _ = by_hand(2.8, True)
    assert terms["arm"] + terms["cloth"] == pytest.approx(force, rel=1e-12)
    assert terms["inertia"] == pytest.approx(2 * 0.05 * math.cos(2.8) * 3600, rel=1e-12)


def test_a_state_that_carries_nothing_that_is_on_has_no_force_of_its_own():
    alone = replace(ELASTIC, effects=(CLOTH, ARM))
    sampler = Sampler(alone, {name: v for name, v in WITH_ARM.items() if not name.startswith(("inertia", "spring"))})
    assert float(sampler.at("force", np.array([1]), np.array([0.5]))[0]) == pytest.approx(0.0, abs=1e-15)


def task():
    """Return the program that balances an elastic arm by its spring."""
    variables = (
        Variable("spring.k", 0.0, 2e4, 1e3, (0.0, 2e4)),
        Variable("spring.p", -0.2, 0.2, 0.1, (-0.2, 0.2)),
    )
    parameters = {name: value for name, value in WITH_ARM.items() if name not in ("spring.k", "spring.p")}
    level = Peak("torque", "torque", 10.0)
    limits = (DesignLimit("front_force", 1, "front_force", 1400.0, 100.0),)
    return Program(ELASTIC, variables, parameters, limits, (level,), ({"spring.k": 3000.0, "spring.p": 0.04},))


def test_a_program_with_a_state_is_solved():
    program = task()
    point = exchange.solve(program, program.starts[0], Settings())
    assert point.usable
    best = Sampler(ELASTIC, {**program.parameters, **point.x})
    assert program.limits[0].excess(best) <= 1e-9
    value = program.objectives[0].merit(best)
    phi = np.linspace(0, 2 * math.pi, 4001)
    changes = {"spring__k": point.x["spring.k"], "spring__p": point.x["spring.p"]}
    torques = [by_hand(a, math.pi - 0.9 < a < math.pi, **changes)[1] for a in phi]
    assert np.abs(torques).max() == pytest.approx(value, rel=1e-5)
    for k, p in itertools.product((-1e-2, 0.0, 1e-2), repeat=2):
        moved = {"spring.k": point.x["spring.k"] * (1 + k), "spring.p": point.x["spring.p"] + p * 0.1}
        sampler = sampler_at(program, moved)
        if (
            all(v.lower <= moved[v.name] <= v.upper for v in program.variables)
            and program.limits[0].excess(sampler) < 0
        ):
            assert program.objectives[0].merit(sampler) >= value * (1 - 1e-9)


def test_rows_of_the_nlp_are_those_of_40_digits():
    program = task()
    sampler = sampler_at(program, program.starts[0])
    nodes = [sampler.extremes("torque")[:3]]
    nlp, _ = transcribe(program, sampler, 6)
    nlp.solver(False, Settings())
    x0 = [program.starts[0][v.name] / v.scale for v in program.variables]
    rows, slopes = nlp.jacobian([*x0, 0.0], nlp.structure.vector(program, sampler, [1.0], nodes))
    exact = systems.mpmath()
    step = exact.number(10) ** -20

    def at(moved):
        values = {name: exact.number(value) for name, value in sampler.values.items()}
        values |= {v.name: values[v.name] + v.scale * step for v in program.variables if v.name == moved}
        reading = Reading(ELASTIC, exact, ELASTIC.given(exact, values), sampler.cycle, sampler.stills)
        peaks = [e.sign * reading.at("torque", e.piece, exact.number(e.u)) / 10 for e in nodes[0]]
        return [program.limits[0].residual(reading) / 100, *peaks]

    base = at("")
    assert np.asarray(rows).ravel()[:4] == pytest.approx([float(value) for value in base], rel=1e-11)
    for place, variable in enumerate(program.variables):
        exactly = [float((a - b) / step) for a, b in zip(at(variable.name), base, strict=True)]
        assert np.asarray(slopes)[:4, place] == pytest.approx(exactly, rel=1e-9, abs=1e-11)
