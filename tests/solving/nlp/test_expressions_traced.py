"""Whole-cycle quantities as functions: traced once, of what they read, at a node as in every other number system."""

import casadi as ca
import numpy as np
import pytest
from steps import COUNT, HEIGHTS, NAMES, program

from loomopt.maths import systems
from loomopt.physics.cycle import Node
from loomopt.solving.nlp.expressions import Lifts, QuantityFunctions

X = {name: 0.1 + 0.05 * k for k, name in enumerate(NAMES)}


def made(bend=0.05):
    """Return the quantities of the toy, over symbols, and these."""
    task = program(bend)
    values = {name: ca.SX.sym(name) for name in (*NAMES, "raise")}
    lifts = Lifts(ca.vertcat(*values.values()))
    given = task.model.given(lifts.maths, values)
    return QuantityFunctions(task.model, values, given, task.model.switches, lifts), values, task.model


def value(expression, symbols, lifts, place=None, number=0.0):
    """Return an expression at X, each lifted variable at what it is worth, and a place at a number."""
    lifted = [variable.symbol for variable in lifts.variables]
    (result,) = (
        ca.substitute([expression], lifted, [variable.formula for variable in lifts.variables])
        if lifted
        else [expression]
    )
    read = ca.vertcat(*symbols.values()), ca.SX.sym("none") if place is None else place
    return float(ca.Function("f", list(read), [result])([{**X, "raise": 1.25}[name] for name in symbols], number))


@pytest.mark.parametrize("name", ["wave", "swing"])
@pytest.mark.parametrize("raised", [0.0, 1.0])
def test_a_quantity_is_that_of_the_model_at_every_node(name, raised):
    quantities, symbols, model = made()
    given = model.given(systems.FLOAT, {**X, "raise": 1.25})
    for k in range(COUNT):
        switch, phi = {"step": float(k), "raised": raised}, 2 * np.pi * (k + 0.3) / COUNT
        here = quantities.at(name, phi, switch)
        wanted = model.quantity(systems.FLOAT, given, name, Node(phi, switch))
        assert value(here, symbols, quantities.lifts) == pytest.approx(wanted, rel=1e-14)
    assert quantities.lifts.variables == [], "a node whose switch is known chooses nothing"


def test_a_formula_is_traced_once_and_reads_what_it_needs():
    quantities, symbols, _ = made()
    first = quantities.at("wave", 0.1, {"step": 0.0, "raised": 0.0})
    traced = quantities._traced["wave"]
    assert {item.name() for item in ca.symvar(first)} == {"x0", "x1"}
    assert traced.numbers.numel() == 1, "raise; the heights are chosen"
    assert [choice.switch for choice in traced.choices] == ["step", "step"]
    quantities.at("wave", 0.2, {"step": 3.0, "raised": 1.0})
    assert quantities._traced["wave"] is traced
    assert list(quantities._traced) == ["wave"]
    assert len(symbols) == COUNT + 1


def test_a_node_whose_switch_is_a_parameter_chooses_variables():
    quantities, symbols, model = made()
    place = ca.SX.sym("place")
    here = quantities.at("wave", 0.4, {"step": place, "raised": 0.0})
    assert len(quantities.lifts.choices) == 2
    given = model.given(systems.FLOAT, {**X, "raise": 1.25})
    wanted = model.quantity(systems.FLOAT, given, "wave", Node(0.4, {"step": 7.0, "raised": 0.0}))
    assert value(here, symbols, quantities.lifts, place, 7.0) == pytest.approx(wanted, rel=1e-14)


def test_what_follows_from_others_is_computed_once_for_all_nodes():
    """The heights are expressions of the steps: nodes share their very nodes."""
    quantities, symbols, _ = made()
    here, there = (quantities.at("wave", 0.4, {"step": 6.0, "raised": raised}) for raised in (0.0, 1.0))
    both = ca.Function("f", [ca.vertcat(*symbols.values())], [ca.vertcat(here, there)])
    alone = ca.Function("f", [ca.vertcat(*symbols.values())], [here])
    assert both.n_instructions() < alone.n_instructions() + 12
    assert HEIGHTS[6] in quantities.given.values
