"""Formulas of links that must close, of checks and of the design alone, as they are read at an instant."""

from collections.abc import Callable
from typing import Any

from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.kinds import Check
from loomopt.physics.schema import Values
from loomopt.program.instant import Instant


def of_group(formula: Callable[..., Number], at: Instant) -> Number:
    """Return a quantity of links that must close."""
    return formula(at.maths, at.given, at.node.phi, lambda: at.pose)


def of_check(check: Check[Any], name: str, at: Instant) -> Number:
    """Return a quantity of a check, SI."""
    return check.quantities[name](at.maths, at.pose, at.values, at.given.own[check.name])


def of_design(formula: Callable[[Maths, Values], Number], at: Instant) -> Number:
    """Return a row of the design alone, SI."""
    return formula(at.maths, at.values)


def row_of(check: Check[Any], name: str, at: Instant) -> Number:
    """Return a row of a check, SI."""
    return check.rows[name](at.maths, at.values, at.given.own[check.name])
