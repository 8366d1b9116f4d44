"""The nonlinear program is the task it was made from: the same rows, the same slopes."""

import functools

import casadi as ca
import numpy as np
import pytest
from beatup_nlps import EFFECTS, TARGETS, expected_rows, owner_of, program_of, put
from waves import WAVES, model, objective, program

from loomopt.maths import systems
from loomopt.model.reading import Reading
from loomopt.solving.nlp.ipopt import Calls
from loomopt.solving.nlp.point import Elastic, Settings
from loomopt.solving.nlp.rows import families

CASES: list[tuple[tuple[str, ...], str, tuple[tuple[str, str], ...]]]
CASES = [((), target, ()) for target in TARGETS]
CASES += [((name,), "balance", ()) for name in EFFECTS] + [(EFFECTS, target, ()) for target in TARGETS]
CASES += [
    (("centrifugal",), "torque", (("limits.reed_centrifugal.max", "400 N"),)),
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
    limits = list(program.design_limits.values())
    exact = differences(program, sampler, lambda at: [limit.residual(at) / limit.scale for limit in limits])
    assert slopes[: len(limits)] == pytest.approx(exact, rel=1e-9, abs=1e-9)
    begin = len(slopes) - 6 * len(nodes)
    for place, (family, chosen) in enumerate(zip(families(program), nodes, strict=True)):
        ours = slopes[begin + 6 * place : begin + 6 * place + len(chosen)]
        owner = owner_of(program, family)
        size = owner.scale * (owner.value + owner.scale) if family.square else owner.scale
        exact = differences(program, sampler, functools.partial(at_nodes, family.square or family.row, size, chosen))
        assert ours == pytest.approx(exact, rel=1e-9, abs=1e-9 * np.abs(exact).max())


def at_nodes(name, size, nodes, at):
    return [e.sign * at.at(name, e.piece, at.maths.number(e.u)) / size for e in nodes]


def differences(program, sampler, read):
    """Return slopes (rows, variables, each scaled) of what `read` gives of a design, by differences at 40 digits."""
    exact = systems.mpmath(40)
    step = exact.number(10) ** -20

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
    weights = Calls(program, Settings()).weights
    epigraph = iter(extra)
    levels = [
        sampler.figures[level.row] / level.scale if level.is_smooth else next(epigraph) for level in program.objectives
    ]
    assert value == pytest.approx(np.dot(weights, levels), rel=1e-12)


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
    sides = {(limit.name, limit.sign) for limit in program.limits if limit.relaxable}
    value = ca.Function("f", [nlp.nlp["x"], nlp.nlp["p"]], [nlp.nlp["f"]])
    assert nlp.rows.extras == sum(2 if sign == 0 else 1 for _, sign in sides)
    assert float(value(arguments["x0"], arguments["p"])) >= 0
    assert families(program, elastic=True) == []


def built(task, extra, elastic=False):
    """Return a program's objective and rows at x = 0.5, y = −2, and its gradient."""
    calls, x = Calls(task, Settings(), Elastic() if elastic else None), {"x": 0.5, "y": -2.0}
    sampler = calls.sampler(x)
    nodes = [of[:1] for of in calls.peaks(sampler)]
    nlp = calls.nlp(sampler, nodes, warm=False)
    arguments = calls.arguments(nlp, sampler, x, np.array(extra, float), nodes)
    value, slope = nlp.gradient(arguments["x0"], arguments["p"])
    rows = np.asarray(nlp.jacobian(arguments["x0"], arguments["p"])[0]).ravel()
    return float(value), np.asarray(slope).ravel(), rows


def test_levels_are_weighed_and_summed():
    levels = (objective("x", "magnitude", ("y",)), objective("circle", "peak", ("shifted",)), objective("bowl"))
    value, slope, rows = built(program((), levels), [2.5, 4.0])
    bowl = (0.5 - 3) ** 2 + (-2 - 2) ** 2
    assert value == pytest.approx(1e6 * 2.5 + 1e3 * 4.0 + bowl, rel=1e-14)
    assert list(slope[2:]) == [1e6, 1e3]
    assert rows[:4] == pytest.approx([0.5 - 2.5, -0.5 - 2.5, -2 - 2.5, 2 - 2.5], rel=1e-14)
    assert rows[[4, 10]] == pytest.approx([np.hypot(0.5, 2) - 4, np.hypot(2.5, 3) - 4], rel=1e-9)
    assert not rows[[5, 6, 7, 8, 9, 11, 12, 13, 14, 15]].any()


def test_the_worst_of_several_values_has_a_row_for_each():
    value, _, rows = built(program((), (objective("bowl", "value", ("other bowl",)),)), [3.0])
    assert value == 3.0
    assert rows == pytest.approx([22.25 - 3, 6.25 - 3], rel=1e-14)


def test_what_gives_way_is_summed_and_loosens_its_rows():
    task = program([("sum", 1, -5.0), ("apart", 0, 1.0), ("circle", 1, 1.0)], (objective("bowl"),))
    value, _, rows = built(task, [0.1, 0.4, 0.8, 1.6], elastic=True)
    assert value == pytest.approx(2.9, rel=1e-14)
    assert rows[:2] == pytest.approx([3.5 - 0.1, 1.5 - (0.4 - 0.8)], rel=1e-14)
    assert rows[2] == pytest.approx(np.hypot(0.5, 2) - 1.0 - 1.6, rel=1e-12)


def test_nothing_gives_way_in_a_plain_program():
    _, _, rows = built(program([("sum", 1, -5.0), ("circle", 1, 1.0)]), [])
    assert rows[:2] == pytest.approx([3.5, np.hypot(0.5, 2) - 1.0], rel=1e-12)


def test_a_signed_quantity_is_held_from_above_only():
    task = program([("wave", 1, 3.0)], physics=model(signed=WAVES))
    _, _, rows = built(task, [])
    assert rows[0] == pytest.approx(0.5 + 1.5 - 3.0, rel=1e-14)
