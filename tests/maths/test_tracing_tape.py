"""The tape: every operation in every number system to the last bit, what is shared, what is computed beforehand."""

import importlib
import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from support.bits import bits

from loomopt.maths import recording, systems
from loomopt.maths.jets import variables
from loomopt.maths.recording import DEEPEST, Tape

FORMULAS = {
    "sum": lambda m, x, y: 3 - (x + y) - (2.5 - y) + 1 + x,
    "product": lambda m, x, y: 2 * x * y * 0.5,
    "quotient": lambda m, x, y: x / y + 3 / x + y / 4,
    "powers": lambda m, x, y: x**2 - y**3 + x ** (-1) * y**4,
    "signs": lambda m, x, y: -x * +y - -y,
    "angles": lambda m, x, y: m.sin(x * y) * m.cos(x - y),
    "root": lambda m, x, y: m.sqrt(x**2 + y**2),
    "angle": lambda m, x, y: m.atan2(y * x, x - y) + m.atan2(y, 0.3) + m.atan2(0.3, x),
    "pi": lambda m, x, y: m.pi * x / 2 - m.pi**2,
    "number": lambda m, x, y: m.number(0.1) * x + m.number(0.1),
    "chosen": lambda m, x, y: m.choose(1.0, (x, x * y, y)) + m.choose(2, (0, 1, -1)) * x,
    "fraction": lambda m, x, y: x * Fraction(3, 8).numerator / Fraction(3, 8).denominator,
    "scalar": lambda m, x, y: np.float64(1.5) * x - np.float64(0.25) / y,
    "all": lambda m, x, y: m.atan2(m.sqrt(1 + x * x) / (2 - y), m.sin(x / y) ** 2 + 0.1),
}
X, Y = 1.3, -0.7
flint = importlib.import_module("flint")
SYSTEMS = {
    "float": (systems.FLOAT, lambda x: x),
    "numpy": (systems.numpy(), lambda x: x * np.linspace(0.5, 2.0, 7)),
    "mpmath": (systems.mpmath(), systems.mpmath().number),
    "balls": (systems.balls(), lambda x: systems.ball_series(x, 1e-3)),
    "jets": (systems.jets(), lambda x: variables([x * np.linspace(0.5, 2.0, 7)], np.array([[1.0, x]]), curved=True)[0]),
    "jets of a number": (systems.jets(), lambda x: variables([x], np.array([[1.0, x]]), curved=False)[0]),
}


def written(formula, called=1):
    """Return a formula of (maths, known number, number of the call) as a program; called: how many are of the call."""
    tape = Tape()
    inputs = [tape.input(), tape.input()]
    return tape.program((formula(recording.recorded(tape), *inputs),), inputs[2 - called :], inputs[: 2 - called])


def run(program, system, x, y, called=1):
    inputs = [x, y]
    return program([system])(inputs[: 2 - called])(*inputs[2 - called :])[0]


WITHOUT_NUMPY = "mpmath", "balls"
"""Systems whose numbers do not meet one of NumPy."""


@pytest.mark.parametrize("called", [0, 1, 2])
@pytest.mark.parametrize(
    ("name", "system"), [(n, s) for n in FORMULAS for s in SYSTEMS if n != "scalar" or s not in WITHOUT_NUMPY]
)
def test_every_operation_gives_the_same_bits_in_every_system(name, system, called):
    """Whatever is known beforehand: nothing, one of the numbers, or both."""
    formula, (maths, number) = FORMULAS[name], SYSTEMS[system]
    x, y = number(X), number(Y)
    assert bits(run(written(formula, called), maths, x, y, called)) == bits(formula(maths, x, y))


def counting(system=systems.FLOAT):
    """Return a number system, and a list of what its sine is called with and what is made a constant."""
    request, constants = [], []

    def sin(x):
        request.append(x)
        return system.sin(x)

    def constant(x):
        constants.append(x)
        return x

    return replace(system, sin=sin, constant=constant), request, constants


def test_equal_expressions_are_computed_once():
    def formula(m, x, y):
        return m.sin(x + y) * m.sin(x + y) + m.sin(y + x) / m.sin(x + y)

    values, request, _ = counting()
    assert run(written(formula, 2), values, X, Y, 2) == formula(systems.FLOAT, X, Y)
    assert request == [X + Y, Y + X], "the order of a sum is kept: jets and others may add in theirs"


def test_what_no_output_needs_is_left_out_unless_it_may_fail():
    values, request, _ = counting()
    tape = Tape()
    m, x = recording.recorded(tape), tape.input()
    m.sin(x)
    before = len(tape.operations)
    _ = (m.pi * x + 1) * x
    assert tape.program((x,), [x], [], since=before)([values])([])(X) == (X,)
    assert request == []
    assert tape.program((x,), [x], [], since=0)([values])([])(X) == (X,)
    assert request == [X]
    dead = 1 / x
    assert dead.place == len(tape.operations) - 1
    function = tape.program((x,), [x], [], since=dead.place)([values])([])
    with pytest.raises(ZeroDivisionError):
        function(0.0)


def test_what_is_known_is_computed_once_for_all_calls_and_what_always_is_once_for_all_designs():
    def formula(m, x, y):
        return m.sin(m.pi * 2) + m.sin(x) * m.sin(y)

    values, request, _ = counting()
    bind = written(formula)([values])
    assert request == [math.pi * 2]
    function = bind([X])
    assert request == [math.pi * 2, X]
    for y in (0.25, 0.5):
        assert function(y)[0] == formula(systems.FLOAT, X, y)
    assert request == [math.pi * 2, X, 0.25, 0.5]
    assert bind([0.125])(0.25)[0] == formula(systems.FLOAT, 0.125, 0.25), "of another design nothing is left"


def test_scalars_that_meet_what_varies_in_arithmetic_become_constants_once():
    def formula(m, x, y):
        return 2 * y + 2 / y - x * y + m.atan2(y, 3.0) + y**4 + (x + 5) * m.choose(0, (y, 7))

    values, _, constants = counting()
    function = written(formula)([values])([X])
    assert function(Y)[0] == formula(systems.FLOAT, X, Y)
    assert function(X)[0] == formula(systems.FLOAT, X, X)
    assert sorted(constants) == [X, 2, X + 5]


def test_two_systems_share_a_formula():
    """The design's numbers in one, the nodes' in the other, as samplers do."""
    tape = Tape()
    first, second = recording.recorded(tape, 0), recording.recorded(tape, 1)
    x, y = tape.input(), tape.input()
    program = tape.program((first.sin(x) * second.sin(y) * second.sin(x),), [y], [x])
    item, by_first, _ = counting()
    two, by_second, _ = counting()
    assert program([item, two])([X])(Y)[0] == math.sin(X) * math.sin(Y) * math.sin(X)
    assert (by_first, by_second) == ([X], [X, Y])


def test_outputs_may_be_inputs_numbers_and_several():
    tape = Tape()
    x, y = tape.input(), tape.input()
    program = tape.program((x, 2, y, x * y, x * y, -0.0, "a word"), [y], [x])
    second_program = program([systems.FLOAT])([X])(Y)
    assert second_program == (X, 2, Y, X * Y, X * Y, 0.0, "a word")
    assert math.copysign(1.0, second_program[5]) == -1.0
    assert type(second_program[1]) is int
    assert tape.program((), [], [])([systems.FLOAT])([])() == ()


def test_literals_that_are_equal_but_not_the_same_stay_apart():
    tape = Tape()
    numbers = (
        1,
        1.0,
        True,
        np.float64(1.0),
        Fraction(1),
        0.0,
        -0.0,
        0,
        math.inf,
        -math.inf,
        math.nan,
        -3,
        -3.5,
        1e-300,
    )
    x = tape.input()
    tape.program(tuple(x + number for number in numbers), [x], [])
    assert len(tape.operations) == 1 + 2 * len(numbers)
    program = tape.program(numbers, [x], [])([systems.FLOAT])([])(X)
    assert [(type(value), repr(value)) for value in program] == [(type(value), repr(value)) for value in numbers]
    assert tape.program((x * -3, (-3) ** x, x - -3.5), [x], [])([systems.FLOAT])([])(2.0) == (-6.0, 9, 5.5)


@pytest.mark.parametrize("places", [1.0, np.array([2.0, 0.0, 1.0, 1.0]), np.array([0.0, 0.0, 0.0, 0.0])])
def test_a_place_of_the_node_chooses_when_the_function_is_called(places):
    tape = Tape()
    m, place, x = recording.recorded(tape), tape.input(), tape.input()
    program = tape.program((m.choose(place, (x * x, 1, -x)) + m.choose(place, (1, 3, 5)),), [place, x], [])
    values, u = systems.numpy(), np.linspace(0.1, 0.7, 4)
    expected = values.choose(places, (u * u, 1, -u)) + values.choose(places, (1, 3, 5))
    assert bits(program([values])([])(places, u)[0]) == bits(expected)


def test_one_recording_serves_every_piece():
    tape = Tape()
    m, place, x = recording.recorded(tape), tape.input(), tape.input()
    function = tape.program((m.choose(place, (x, x + 1, 10)),), [place, x], [])([systems.FLOAT])([])
    assert [function(place, 0.5)[0] for place in (0.0, 1, 2.0)] == [0.5, 1.5, 10]
    with pytest.raises(IndexError):
        function(3.0, 0.5)


def test_deep_and_wide_formulas_are_written_in_pieces():
    """A thousand operations nested in each other, and more of them than a compiler nests brackets."""
    tape = Tape()
    x = tape.input()
    value, expected = x, X
    for k in range(1000):
        value, expected = (value + k) * x, (expected + k) * X
    assert DEEPEST < 100
    assert tape.program((value,), [x], [])([systems.FLOAT])([])(X) == (expected,)


def test_names_are_taken_again_when_they_are_free():
    """Each result is read twice, by the next one: more than two need not be kept at a time."""
    tape = Tape()
    x = tape.input()
    value, expected = x, X
    for _ in range(100):
        value, expected = value * value - value, expected * expected - expected
        value, expected = value / 2, expected / 2
    function = tape.program((value,), [x], [])([systems.FLOAT])([])
    assert function(X) == (expected,)
    assert function.func.__code__.co_nlocals <= 5


@pytest.mark.parametrize(
    "decision",
    [
        lambda x: 1 if x else 0,
        lambda x: x == 1,
        lambda x: x != 1,
        lambda x: x > 0,
        lambda x: x >= 0,
        lambda x: max(x, 0),
        float,
        int,
        abs,
        math.sin,
        np.sin,
        lambda x: {x: 1},
        lambda x: [1, 2][x],
    ],
)
def test_a_number_that_is_not_known_yet_decides_nothing(decision):
    with pytest.raises(TypeError):
        decision(Tape().input())


def test_numbers_of_two_tapes_do_not_meet():
    with pytest.raises(ValueError, match="another tape"):
        _ = Tape().input() + Tape().input()


def test_an_input_stands_for_what_is_known_and_an_input_for_itself():
    tape = Tape()
    x = tape.input()
    assert tape.known(x).place == x.place
    stand_in = tape.known(x * x)
    program = tape.program((stand_in + x,), [x], [stand_in])
    assert program([systems.FLOAT])([100.0])(X) == (100.0 + X,)
