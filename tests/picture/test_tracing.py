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


def test_a_straight_line_takes_no_node_but_those_it_begins_with():
    def straight(pieces, u):
        angle = STARTS[pieces] * (1 - u) + STARTS[pieces + 1] * u
        return (np.column_stack([2 * angle, 1 - angle]),)

    pieces, u = drawing.traced_nodes(straight, STARTS, 1e-9)
    widths = [STARTS[k + 1] - STARTS[k] for k in (0, 2, 3)]
    assert len(u) == sum(max(2, math.ceil(width / drawing.WIDEST)) for width in widths)
    assert drawing.deviation(straight, pieces, u) < 1e-12


@pytest.mark.parametrize("allowed", [1e-3, 1e-5])
def test_a_sharp_bend_is_followed_as_closely_and_nodes_stand_where_it_is(allowed):
    """A bump 0.01 rad wide; how far lines lie off is measured anew, at angles of its own."""

    def bumped(pieces, u):
        angle = STARTS[pieces] * (1 - u) + STARTS[pieces + 1] * u
        radius = 1 + 0.1 / (1 + ((angle - 2.5) / 0.01) ** 2)
        return (radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]),)

    pieces, u = drawing.traced_nodes(bumped, STARTS, allowed)
    angles = np.append(STARTS[pieces] * (1 - u) + STARTS[pieces + 1] * u, 2 * math.pi)
    begins, ends = angles[:-1], angles[1:]
    share = np.linspace(0, 1, 41)[None]
    at = begins[:, None] * (1 - share) + ends[:, None] * share
    radius = 1 + 0.1 / (1 + ((at - 2.5) / 0.01) ** 2)
    points = radius * np.exp(1j * at)
    along = (points[:, -1:] - points[:, :1]) / np.abs(points[:, -1:] - points[:, :1])
    off = np.abs(((points - points[:, :1]) * np.conj(along)).imag)
    assert off.max() <= 1.05 * allowed
    assert drawing.deviation(bumped, pieces, u) <= allowed
    crowd = np.count_nonzero(np.abs(angles - 2.5) < 0.05)
    assert crowd > 3 * len(angles) * 0.1 / (2 * math.pi)
    again = drawing.traced_nodes(bumped, STARTS, allowed)
    assert np.array_equal(again[0], pieces)
    assert np.array_equal(again[1], u)
