"""Chains of derived values: told where they hang on variables, with the corners where rows are likely to bind."""

import pytest

from loomopt.jobs import registry
from loomopt.jobs.shedding import model as shedding
from loomopt.maths import systems
from loomopt.model.sampling import Sampler
from loomopt.solving.nlp.rows import Station, chain_names, chain_values, station_switches, stations

SCENE = registry.load("shedding")
JOB = registry.of(SCENE)


def task(symmetric=False, intervals=6, **changes):
    values = {"targets.law.intervals": intervals, "targets.law.symmetric": symmetric}
    return JOB.program(SCENE.update({**values, **changes}), "law")


def names(program):
    return [variable.name for variable in program.variables]


@pytest.mark.parametrize("symmetric", [False, True])
def test_a_free_law_is_a_chain_of_its_knots_and_a_given_one_is_none(symmetric):
    program = task(symmetric)
    expected = [f"law_{of}_{k}" for k in range(1, 7) for of in "sv"]
    assert list(chain_names(program.model, names(program))) == expected
    assert chain_names(program.model, ["K1", "X0"]) == ()
    assert stations(program.model, Sampler(program.model, {**program.parameters, **program.starts[0]}).given, []) == ()
    fixed = JOB.program(SCENE, "stiffness")
    assert chain_names(fixed.model, names(fixed)) == ()


def test_stations_are_the_knots_of_rise_and_return_by_their_places_among_all_corners():
    program = task()
    sampler = Sampler(program.model, {**program.parameters, **program.starts[0]})
    result = stations(program.model, sampler.given, names(program))
    angles = program.model.corners(systems.FLOAT, sampler.given)
    rise, back, near = (sampler.given.values[name] for name in ("rise", "return", "begin.near"))
    there = [k / 6 * rise for k in range(1, 6)] + [near - k / 6 * back for k in range(1, 6)]
    assert [angles[station.corner] for station in result] == pytest.approx(there, rel=1e-14)
    assert result[0] == Station(4, {shedding.SEGMENT: 0.0, shedding.LAW: 1.0}), "after four segments"
    assert station_switches(program.model, names(program)) == [station.switch for station in result]


@pytest.mark.parametrize("symmetric", [False, True])
def test_what_is_told_to_follow_is_what_the_model_derives(symmetric):
    program = task(symmetric, intervals=12)
    values = {**program.parameters, **program.starts[0]}
    derived = program.model.given(systems.FLOAT, values).values
    chain = {name: derived[name] for name in chain_names(program.model, names(program))}
    assert chain_values(program.model, names(program), systems.FLOAT, {**values, **chain}) == pytest.approx(
        chain, abs=1e-15
    )
    other = {name: value + 0.01 for name, value in chain.items()}
    given = program.model.given(systems.FLOAT, {**values, **other}).values
    assert {name: given[name] for name in chain} == other
