"""Plan of a sweep: points that are searched from scratch, and parents of the others."""

import itertools
import math

import pytest

from loomopt.base.errors import BadInput
from loomopt.scenes import numbers
from loomopt.studies.sweep import COARSE, Lattice


def line(count):
    return Lattice((tuple(range(count)),))


@pytest.mark.parametrize("shape", [(1,), (2,), (9,), (21,), (5, 9), (3, 2, 4)])
def test_rounds_contain_every_point_once_and_begin_with_the_corners(shape):
    lattice = Lattice(tuple(tuple(range(count)) for count in shape))
    points = [point for points in lattice.rounds for point in points]
    assert sorted(points) == list(range(math.prod(shape)))
    corners = set(itertools.product(*((0, count - 1) for count in shape)))
    assert corners <= {lattice.places(point) for point in lattice.rounds[0]}


def test_a_line_is_halved_from_points_eight_apart():
    assert line(21).rounds == [[0, 8, 16, 20], [4, 12], [2, 6, 10, 14, 18], [*range(1, 20, 2)]]
    assert COARSE == 8


def test_the_nearest_neighbour_is_the_lower_of_two_and_its_mirror_image_is_added():
    assert line(9).neighbours(4, [0, 8]) == [0, 8]
    assert line(9).neighbours(3, [0, 2, 4, 8]) == [2, 4]
    assert line(9).neighbours(3, [0, 4, 8]) == [4]
    square = Lattice((tuple(range(9)), tuple(range(9))))
    assert square.neighbours(4 * 9 + 4, [0, 8, 72, 80]) == [0, 80]


def test_neighbours_are_near_by_size_in_any_order_of_values():
    lattice = Lattice(((2, 0, 1),))
    assert lattice.rounds == [[0, 1], [2]]
    assert lattice.neighbours(2, [0, 1]) == [0, 1]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("600:700:25 N*m", ["600 N*m", "625 N*m", "650 N*m", "675 N*m", "700 N*m"]),
        ("0:0.3:0.1 mm", ["0 mm", "0.1 mm", "0.2 mm", "0.3 mm"]),
        ("0:1:0.4", ["0", "0.4", "0.8", "1"]),
        ("-2.5e1 : 25 : 25 deg", ["-25 deg", "0 deg", "25 deg"]),
        ("5:5:1 kg", ["5 kg"]),
        ("1e-7:3e-7:1e-7 m", ["0.0000001 m", "0.0000002 m", "0.0000003 m"]),
    ],
)
def test_steps_are_exact_and_both_ends_are_there(text, expected):
    assert numbers.range_values(text, "key") == expected


@pytest.mark.parametrize(
    "text", ["", "600", "600:900", "600:900:0 mm", "900:600:25 mm", "600:900:-25 mm", "a:b:c mm", "0:1:1e-9 mm",
             "600:900:25,5 mm", "1_0:20:1 mm", "0:inf:1 mm", "0:1e400:1 mm", "600:900:25:3 mm"]
)  # fmt: skip
def test_an_invalid_range_is_refused(text):
    with pytest.raises(BadInput) as error:
        numbers.range_values(text, "operation.M0")
    assert "LO:HI:STEP UNIT" in str(error.value)
    assert len(str(error.value).splitlines()) == 1
