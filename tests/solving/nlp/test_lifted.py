"""Choices and chains that become variables: only where many are chosen from, and where the design moves them."""

from dataclasses import replace
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from steps import COUNT, HEIGHTS, NAMES, program

from loomopt.model.program import Variable
from loomopt.solving.nlp.expressions import FEW_CHOICES, Lifts, Options, expressions, identity, value_at
from loomopt.solving.nlp.ipopt import FIRST_SLOTS, LEADING, SLOTS_WITH_STATIONS, Calls
from loomopt.solving.nlp.point import Settings
from loomopt.solving.nlp.rows import structure


def made(count=FEW_CHOICES + 1):
    """Return lifts over x, a switch, and as many values that x moves."""
    x, place = ca.SX.sym("x", 3), ca.SX.sym("place")
    values = [(k + 1) * x[k % 3] for k in range(count)]
    return SimpleNamespace(lifts=Lifts(x), x=x, place=place, values=values)


def at(made, value, place):
    """Return a value at x = (2, 3, 5), each lifted variable at what it is worth, and a place."""
    symbols = [variable.symbol for variable in made.lifts.variables]
    worth = [variable.formula for variable in made.lifts.variables]
    (result,) = ca.substitute([ca.SX(value)], symbols, worth) if symbols else [ca.SX(value)]
    return float(ca.Function("f", [made.x, made.place], [result])([2.0, 3.0, 5.0], place))


@pytest.mark.parametrize("count", [2, FEW_CHOICES, FEW_CHOICES + 1, 30])
@pytest.mark.parametrize("place", [0.0, 1.0])
def test_the_value_at_a_place_is_chosen_whatever_becomes_of_it(count, place):
    case = made(count)
    value = case.lifts.choose(case.place, case.values)
    assert at(case, value, place) == at(case, case.values[int(place)], place)
    assert len(case.lifts.choices) == (count > FEW_CHOICES)
    assert value_at(place, case.values) is case.values[int(place)]
    assert case.lifts.choose(int(place), case.values) is case.values[int(place)]
    assert at(case, value_at(case.place, case.values), place) == at(case, value, place)


def test_what_the_design_does_not_move_is_no_variable():
    case = made()
    fixed = [ca.SX.sym("p") for _ in range(FEW_CHOICES + 1)]
    value = case.lifts.choose(case.place, fixed)
    assert case.lifts.variables == []
    assert not value.is_symbolic()
    assert ca.depends_on(value, ca.vertcat(*fixed))


def test_one_choice_is_one_variable_however_often_it_is_asked_for():
    case = made()
    first = case.lifts.choose(case.place, case.values)
    assert identity(case.lifts.choose(case.place, Options(case.values))) == identity(first)
    other = case.lifts.choose(case.place, case.values[::-1])
    elsewhere = case.lifts.choose(ca.SX.sym("other"), case.values)
    assert len({identity(item) for item in (first, other, elsewhere)}) == len(case.lifts.choices) == 3
    assert case.lifts.choices[0].options is case.lifts.choices[2].options, "one column, whose slopes are taken once"


def test_numbers_are_the_same_by_value_and_expressions_by_what_they_are():
    x = ca.SX.sym("x")
    assert identity(2.0) == identity(2)
    assert identity(x) == identity(ca.vertcat(x, 1)[0])
    assert identity(x) != identity(ca.SX.sym("x"))


def built(lifted, **changes):
    task = program(lifted=lifted, **changes)
    sampler = Calls(task, Settings()).sampler(task.starts[0])
    return expressions(structure(task, sampler, 2))


def test_a_chain_is_lifted_value_by_value_each_from_those_before_it():
    written = built(lifted=True)
    symbols = [chained_value.symbol.name() for chained_value in written.lifts.chained_values]
    assert symbols == list(HEIGHTS)
    for k, chained_value in enumerate(written.lifts.chained_values):
        read = {symbol.name() for symbol in ca.symvar(chained_value.formula)} & set(HEIGHTS)
        assert read == ({HEIGHTS[k - 1]} if k else set())
    assert built(lifted=False).lifts.chained_values == []


def test_rows_read_a_few_variables():
    """At a station the heights there, in a slot two that are chosen; without a chain all that comes before."""
    written, plain = built(lifted=True), built(lifted=False)
    counts = read(written)
    assert len(counts) == 1 + COUNT + 2, "the row of h3, the stations, two slots"
    assert (max(counts), counts[-2:]) == (2, [2, 2])
    assert [len(item.lifts.choices) for item in (written, plain)] == [4, 4], "two heights a slot"
    assert read(plain) == [4, 2, 2], "h3 hangs on x0 to x3"


def read(written):
    """Return how many variables each row reads."""
    variables = ca.vertcat(written.x, *(variable.symbol for variable in written.lifts.variables))
    return np.diff(ca.jacobian(written.g, variables).sparsity().T.colind()).tolist()


def test_what_hangs_on_no_variable_is_no_chain():
    """With the steps given, only the wave's rise is a variable: nothing is lifted, no row stands at a corner."""
    rise = Variable("raise", 1.0, 2.0, 1.0, (1, 2))
    task = replace(program(), variables=(rise,), parameters=dict.fromkeys(NAMES, 0.5))
    calls = Calls(task, Settings())
    values = structure(task, calls.sampler({"raise": 1.5}), 2)
    assert (values.chained_values, values.stations, values.station_rows) == ((), (), [[]])
    assert expressions(values).lifts.variables == []
    assert (calls.slots, calls.leading) == (FIRST_SLOTS, LEADING)
    assert (Calls(program(), Settings()).slots, SLOTS_WITH_STATIONS) == (2, (2, 1))
