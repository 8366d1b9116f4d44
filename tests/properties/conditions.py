"""The measure of a float64 result: its error over condition times eps, both from 40 digits.

A result f of data x cannot be known better than eps (|f| + Σ|x ∂f/∂x|): its data are rounded, and so is it. The
derivatives are differences in 40 digits, the data moved by a relative 1e-20. An angle on the turn is taken as at least
1 rad: it was the difference of larger ones.
"""

from loomopt.maths import systems

EPS = 2.0**-52
MANY = systems.mpmath(40)
STEP = MANY.number(10) ** -20
NOTHING = EPS**2
"""What a value of size 1 may be off where it is exactly 0 and stays so to first order."""


def errors(formulas, data, phi=None, terms=None):
    """Return each result's error in units of eps times condition.

    formulas(system, *numbers): results of one number system, by name; data: floats; phi: one more of them, an angle on
    the turn, rad; terms: result -> size of what it is the sum of, where that is larger than its condition tells.
    """
    numbers = [*map(float, data), *([] if phi is None else [phi])]
    exact = [MANY.number(value) for value in numbers]
    steps = [abs(number) * STEP for number in exact]
    if phi is not None:
        steps[-1] = max(steps[-1], STEP)
    true = formulas(MANY, *exact)
    sizes = {name: abs(value) + (terms or {}).get(name, 0) for name, value in true.items()}
    for k, step in enumerate(steps):
        if step:
            moved = formulas(MANY, *exact[:k], exact[k] + step, *exact[k + 1 :])
            for name, value in true.items():
                sizes[name] += abs(moved[name] - value) / STEP
    result = formulas(systems.FLOAT, *numbers)
    return {name: error(result[name], value, sizes[name]) for name, value in true.items()}


def error(result, true, size):
    """Return |found − true| in units of eps · size."""
    return float(abs(MANY.number(float(result)) - true) / (EPS * size + NOTHING))


def assert_right(formulas, data, most, phi=None, terms=None):
    """Assert that every result is right to `most` times condition times eps."""
    wrong = {name: value for name, value in errors(formulas, data, phi, terms).items() if not value <= most}
    assert not wrong, f"{wrong} of {most} allowed, at {data}, {phi}"
