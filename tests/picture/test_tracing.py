"""Traced curves: straight lines between nodes are as close to the curve as was asked, and no more than it takes."""

import math

import numpy as np
import pytest

from loomopt.jobs.shedding import drawing

STARTS = np.array([0.0, 1.0, 1.0, 4.0, 2 * math.pi])


def circle(radius):
    """Return the curve of a circle over pieces that begin at STARTS, one of them without width."""

    def curve(pieces, u):
        angle = STARTS[pieces] * (1 - u) + STARTS[pieces + 1] * u
        return (radius * np.column_stack([np.cos(angle), np.sin(angle)]),)

    return curve


@pytest.mark.parametrize("allowed", [1e-3, 1e-6])
def test_lines_are_as_close_as_asked_and_a_circle_takes_no_more_than_it_must(allowed):
    pieces, u = drawing.traced_nodes(circle(1.0), STARTS, allowed)
    angles = STARTS[pieces] * (1 - u) + STARTS[pieces + 1] * u
    widths = np.diff([*angles, 2 * math.pi])
    assert np.all(widths > 0)
    sagitta = 1 - np.cos(widths / 2)
    assert sagitta.max() <= allowed
    fewest = max(2 * math.pi / (2 * math.acos(1 - allowed)), 2 * math.pi / drawing.WIDEST)
    assert len(angles) <= 2.1 * fewest


def test_ends_of_pieces_are_nodes_and_a_piece_without_width_has_none():
    pieces, u = drawing.traced_nodes(circle(1.0), STARTS, 1e-3)
    assert {int(piece) for piece in pieces[u == 0.0]} == {0, 2, 3}


def test_the_worst_of_several_curves_counts():
    def both(pieces, u):
        return (*circle(1.0)(pieces, u), *circle(100.0)(pieces, u))

    assert len(drawing.traced_nodes(both, STARTS, 1e-4)[0]) == len(drawing.traced_nodes(circle(100.0), STARTS, 1e-4)[0])
