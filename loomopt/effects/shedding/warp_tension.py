"""Pull of the warp on the heald frame: output term −T, T positive downward [Qiu21, eq 4 and 8].

T is T1 with the shed open upward (X = 0) and −T2 with it open downward. Between them, by `shape`:
    linear   in proportion to the shed: T1 (1 − 2X/h) above the middle, −T2 (2X/h − 1) below; a corner where X = h/2
    step     the cubic STEP of eq 8 over the rise and over the return
    levels   nothing is said: T is T1 and −T2 in the dwells, and contact is judged there only
"""

from collections.abc import Callable
from typing import Any, Literal

from loomopt.maths import Maths, Number
from loomopt.quantities import Force
from loomopt.schema import Load, Table, Values


class Own(Table):
    """T1, T2: pull with the shed open upward and downward, N; shape: how the one becomes the other."""

    T1: Force
    T2: Force
    shape: Literal["levels", "linear", "step"] = "linear"


def linear(maths: Maths, pose: Any, own: Values) -> Number:
    """Return −T, N, in proportion to the shed; pose.below says whether it is past the middle."""
    return (2 * pose.lowered - 1) * maths.choose(pose.below, (own["T1"], own["T2"]))


def step(maths: Maths, pose: Any, own: Values) -> Number:
    """Return −T, N, by the cubic STEP of the law's argument u."""
    return (own["T1"] + own["T2"]) * pose.u**2 * (3 - 2 * pose.u) - own["T1"]


def levels(maths: Maths, pose: Any, own: Values) -> Number:
    """Return −T, N, in the dwells; 0 stands for what is not known between them."""
    return maths.choose(pose.segment, (0, own["T2"], 0, -own["T1"]))


SHAPES: dict[str, Callable[[Maths, Any, Values], Number]] = {"linear": linear, "step": step, "levels": levels}


def force(maths: Maths, pose: Any, given: Values, own: Values, switch: Number) -> Number:
    """Return −T, N, by the shape the scene names."""
    return SHAPES[own["shape"]](maths, pose, own)


EFFECT = Load("warp_tension", "pull of the warp on the heald frame", Own, "output", force)
