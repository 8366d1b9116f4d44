"""The nonlinear program is the task it was made from: the same rows, the same slopes, built once per structure."""

import functools

import casadi as ca
import numpy as np
import pytest

from loomopt import maths
from loomopt.cycle import TURN
from loomopt.jobs import registry
from loomopt.nlp import transcribe as module
from loomopt.nlp.calls import Calls
from loomopt.nlp.families import epigraphs, families
from loomopt.nlp.layout import Layout
from loomopt.nlp.point import Settings, sampler_at
from loomopt.nlp.transcribe import transcribe
from loomopt.program.reading import Reading

EFFECTS = ("counterweight_inertia", "rocker_inertia", "rod_inertia", "gravity", "bearing_friction", "centrifugal")
TARGETS = ("balance", "pulse", "torque", "retrofit")
DESIGN = {"l1": 0.0311, "l2": 0.07, "l3": 0.152, "l4": 0.166, "m4e": 3.0, "r4e": 0.06, "s": 3.0 * 0.06**2}


def program_of(effects=(), target="balance", changes=()):
    scene = registry.load("beatup")
    for name in effects:
        scene = scene.with_effect(name)
    return registry.of(scene).program(scene.update(dict(changes)), target)


def put(program, elastic=False):
    """Return a program's NLP with its arguments at DESIGN, and the sampler there; two nodes a family."""
    x = {variable.name: DESIGN[variable.name] for variable in program.variables}
    sampler = sampler_at(program, x)
    calls = Calls(program, Settings(), elastic)
    nodes = [found[:2] for found in calls.peaks(sampler)]
    nlp, _ = transcribe(program, sampler, 6, elastic)
    nlp.solver(False, Settings())
    extra = calls.first_extra(nlp, sampler, calls.peaks(sampler))
    return nlp, calls.arguments(nlp, sampler, x, extra, nodes), sampler, nodes, extra


def expected_rows(program, sampler, nodes, extra):
    """Return the rows in the order of the NLP, by plain NumPy: static limits, magnitudes, nodes of each family."""
    rows = [sampler.excess(limit) for limit in program.limits if limit.family == "static"]
    for place, epigraph in enumerate(epigraphs(program)):
        objective = program.objectives[epigraph.objective]
        if objective.form == "magnitude":
            value = sampler.single(objective.row) / objective.scale
            rows += [sign * value - extra[place] for sign in (1, -1)]
    for family, chosen in zip(families(program), nodes, strict=True):
        owner = owner_of(program, family)
        bound = extra[family.epigraph] if family.epigraph >= 0 else owner.value / owner.scale
        rows += [abs(e.value) / owner.scale - bound for e in chosen] + [0.0] * (6 - len(chosen))
    return np.array(rows)


def owner_of(program, family):
    """Return the objective or limit that a family's rows belong to."""
    if family.epigraph >= 0:
        return program.objectives[epigraphs(program)[family.epigraph].objective]
    return program.limits[family.limit]


CASES = [((), target, ()) for target in TARGETS]
CASES += [((name,), "balance", ()) for name in EFFECTS] + [(EFFECTS, target, ()) for target in TARGETS]
CASES += [
    (("centrifugal",), "torque", (("limits.bearing_force.max", "400 N"),)),
    (EFFECTS, "balance", (("limits.shaking_force.max", "2500 N"), ("limits.r4.max", "44 mm"))),
    (("rod_inertia",), "balance", (("effects.rod_inertia.model", "exact"),)),
]


@pytest.mark.parametrize(("effects", "target", "changes"), CASES, ids=str)
def test_rows_are_those_of_the_task(effects, target, changes):
    program = program_of(effects, target, changes)
    nlp, arguments, sampler, nodes, extra = put(program)
    rows = ca.Function("g", [nlp.nlp["x"], nlp.nlp["p"]], [nlp.nlp["g"]])(arguments["x0"], arguments["p"])
    wanted = expected_rows(program, sampler, nodes, extra)
    assert np.asarray(rows).ravel() == pytest.approx(wanted, rel=1e-11, abs=1e-11)


@pytest.mark.parametrize(("effects", "target", "changes"), CASES, ids=str)
def test_slopes_are_those_of_40_digits(effects, target, changes):
    """Corners of the pulse move with the design, so that a node's own angle does too."""
    program = program_of(effects, target, changes)
    nlp, arguments, sampler, nodes, _ = put(program)
    slopes = np.asarray(nlp.jacobian(arguments["x0"], arguments["p"])[1])[:, : len(program.variables)]
    limits = [limit for limit in program.limits if limit.family == "static"]
    exact = differences(program, sampler, lambda at: [at.excess(limit) / limit.scale for limit in limits])
    assert slopes[: len(limits)] == pytest.approx(exact, rel=1e-9, abs=1e-9)
    begin = len(slopes) - 6 * len(nodes)
    for place, (family, chosen) in enumerate(zip(families(program), nodes, strict=True)):
        ours = slopes[begin + 6 * place : begin + 6 * place + len(chosen)]
        size = owner_of(program, family).scale
        exact = differences(program, sampler, functools.partial(at_nodes, family.row, size, chosen))
        assert ours == pytest.approx(exact, rel=1e-9, abs=1e-9 * np.abs(exact).max())


def at_nodes(name, size, nodes, at):
    return [e.sign * at.at(name, e.piece, at.maths.number(e.u)) / size for e in nodes]


def differences(program, sampler, read):
    """Return slopes (rows, variables, each scaled) of what `read` gives of a design, by differences at 40 digits."""
    exact = maths.mpmath(40)
    step = exact.number("1e-20")

    def at(moved):
        values = {name: exact.number(value) for name, value in {**sampler.values, **sampler.hints}.items()}
        values |= {v.name: values[v.name] + v.scale * step for v in program.variables if v.name == moved}
        return read(Reading(program.model, exact, program.model.given(exact, values), sampler.cycle, sampler.stills))

    base = at("")
    columns = [[float((a - b) / step) for a, b in zip(at(v.name), base, strict=True)] for v in program.variables]
    return np.array(columns).T.reshape(len(base), len(program.variables))


@pytest.mark.parametrize("target", TARGETS)
def test_objective_is_the_weighted_sum_of_its_levels(target):
    program = program_of((), target)
    nlp, arguments, sampler, _, extra = put(program)
    value = float(ca.Function("f", [nlp.nlp["x"], nlp.nlp["p"]], [nlp.nlp["f"]])(arguments["x0"], arguments["p"]))
    weights = Calls(program, Settings(), False).weights
    levels, epigraph = [], iter(extra)
    for objective in program.objectives:
        form = objective.form
        levels.append(sampler.figures[objective.row] / objective.scale if form == "value" else next(epigraph))
    assert value == pytest.approx(np.dot(weights, levels), rel=1e-12)


def test_numbers_are_parameters_and_only_structure_is_built():
    first, _, sampler, *_ = put(program_of())
    for changes in (
        {"operation.M0": "600 N*m"},
        {"operation.speed": "300 rpm", "limits.swing.max": "25 deg"},
        {"bounds.l1.min": "20 mm", "effects.inertia.J4": "0.9 kg*m^2", "effects.resistance.pulse": "20 deg"},
    ):
        again, fresh = transcribe(program_of(changes=changes.items()), sampler, 6)
        assert again is first
        assert not fresh


@pytest.mark.parametrize(
    ("effects", "target", "changes"),
    [
        (("gravity",), "balance", ()),
        ((), "torque", ()),
        ((), "balance", (("limits.peak_torque.max", "90 N*m"),)),
        ((), "balance", (("limits.swing.max", "22.9 deg"),)),
    ],
    ids=str,
)
def test_another_structure_is_another_program(effects, target, changes):
    assert put(program_of(effects, target, changes))[0] is not put(program_of())[0]


def test_no_more_programs_are_kept_than_there_is_room_for():
    for slots in range(6, 6 + module.CACHE_SIZE + 3):
        program = program_of((), "torque")
        transcribe(program, sampler_at(program, DESIGN), slots)
    assert len(module._cache) <= module.CACHE_SIZE


def test_unused_slots_weigh_nothing():
    nlp, arguments, _, nodes, _ = put(program_of())
    values, slopes = (np.asarray(part) for part in nlp.jacobian(arguments["x0"], arguments["p"]))
    idle = arguments["ubg"] == 1.0
    assert idle.sum() == 6 - len(nodes[0])
    assert not values.ravel()[idle].any()
    assert not slopes[idle].any()


def test_an_elastic_program_has_room_for_every_limit_and_no_objective():
    program = program_of((), "torque")
    nlp, arguments, *_ = put(program, elastic=True)
    soft = {(limit.name, limit.sign) for limit in program.limits if limit.relaxable}
    value = ca.Function("f", [nlp.nlp["x"], nlp.nlp["p"]], [nlp.nlp["f"]])
    assert nlp.structure.extras == 2 * len(soft)
    assert float(value(arguments["x0"], arguments["p"])) >= 0
    assert families(program, elastic=True) == []


def test_layout_gives_back_what_was_written():
    layout, vector = Layout(), np.zeros(9)
    layout.add("one")
    layout.add("grid", 2, 3)
    layout.add("pair", 2)
    layout.write(vector, "grid", [[1, 2, 3], [4, 5, 6]])
    layout.write(vector, "pair", [7, 8])
    layout.write(vector, "one", 9)
    assert layout.size == 9
    assert layout.read(vector, "one") == [9]
    assert layout.read(vector, "pair") == [7, 8]
    assert layout.rows(vector, "grid") == [[1, 2, 3], [4, 5, 6]]


def test_a_node_on_a_corner_keeps_its_side():
    """Both sides of the pulse's begin are one crank angle with and without resistance."""
    nlp, _, sampler, *_ = put(program_of())
    node, cycle = nlp.structure.node, sampler.cycle
    pulse = int(np.flatnonzero(cycle.on(("resistance", 1.0)))[0])
    before = (pulse - 1) % cycle.pieces
    one, other = node.write(cycle, before, 1.0), node.write(cycle, pulse, 0.0)
    corners = np.mod([float(angle) for angle in sampler.model.corners(maths.FLOAT, sampler.given)], TURN)
    angles = [node.read(row, corners).phi % TURN for row in (one, other)]
    assert angles[0] == pytest.approx(angles[1], abs=1e-14)
    assert [node.read(row, corners).switch["resistance"] for row in (one, other)] == [0.0, 1.0]
