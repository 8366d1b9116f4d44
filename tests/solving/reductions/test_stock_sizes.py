"""From a continuous optimum to sizes that are sold, tried on a stand-in whose every answer is written down."""

from dataclasses import dataclass, field, replace

import pytest

import loomopt as lo
from loomopt.base.units import DISPLAY_UNIT, show
from loomopt.solving.answer.solution import Sentences, Solution
from loomopt.solving.certificate.records import Certificate, Level
from loomopt.solving.reductions.stock_sizes import FARTHEST_SIZE, fitted

MM = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0)
SIZES = tuple(float(f"{size:g}e-3") for size in MM)
ALL = (0.0, 1.0)


@dataclass(frozen=True)
class Bound:
    min: float
    max: float


@dataclass(frozen=True)
class Scene:
    """Bounds, m, and what was set."""

    bounds: dict = field(default_factory=dict)

    schema = lo.load("shedding").schema

    def show(self, value, kind, digits=6):
        return show(value, DISPLAY_UNIT[kind], digits)

    def set(self, key, text):
        table, name = key.split(".")
        assert table == "bounds"
        value, unit = text.split()
        assert unit == "m"
        return replace(self, bounds={**self.bounds, name: Bound(float(value), float(value))})


def scene_of(bound):
    return Scene({"wire": Bound(*bound)})


def solution(wire, status="optimal", **figures):
    """Return an answer; its objectives are its figures, in their order."""
    levels = tuple(Level(name, 0.0, 0.0, 0.0) for name in figures)
    certificate = Certificate(status == "optimal", (), levels, 0.0, 0.0, True, True)
    return Solution(
        problem="stand-in",
        effects=(),
        design={"wire": wire},
        figures=figures,
        units={},
        limits=(),
        status=status,
        sentences=Sentences(f"Solved at {wire}."),
        certificate=certificate,
    )


class Solve:
    """Solves by a table: size, mm -> objectives, or a status; a size without an entry is infeasible."""

    def __init__(self, answers):
        self.answers, self.tried = answers, []

    def __call__(self, scene):
        bound = scene.bounds["wire"]
        assert bound.min == bound.max
        assert bound.min in SIZES, "a size as it is sold, to the last bit"
        size = MM[SIZES.index(bound.min)]
        self.tried.append(size)
        result = self.answers.get(size, "infeasible")
        if isinstance(result, str):
            return solution(bound.min, result, K1=0.0)
        return solution(bound.min, **result)


def fit(wire, answers, bound=ALL, sizes=SIZES):
    """Return the answer that is kept, and the sizes tried, mm."""
    solve = Solve(answers)
    ideal = solution(wire / 1000, K1=100.0, spring_mass=1.0)
    result = fitted(scene_of(bound), ideal, {"wire": sizes}, solve)
    return result, solve.tried


def objectives(K1, mass=1.0):
    return {"K1": K1, "spring_mass": mass}


def test_only_the_nearest_size_on_either_side_is_tried():
    """Sizes further off are not asked, whatever they would answer."""
    result, tried = fit(5.4, {4.0: objectives(1), 5.0: objectives(103), 6.0: objectives(102), 7.0: objectives(1)})
    assert tried == [5.0, 6.0]
    assert result.design == {"wire": 0.006}
    assert (result.status, result.figures["K1"]) == ("optimal", 102)


@pytest.mark.parametrize(("below", "above", "remaining"), [(101, 102, 5.0), (102, 101, 6.0), (101, 101.0001, 5.0)])
def test_the_better_neighbour_is_kept(below, above, remaining):
    result, _ = fit(5.4, {5.0: objectives(below), 6.0: objectives(above)})
    assert result.design["wire"] == remaining / 1000


def test_inadmissible_sizes_are_walked_past_outward():
    result, tried = fit(5.4, {3.0: objectives(120), 2.0: objectives(90), 8.0: objectives(110), 9.0: objectives(90)})
    assert tried == [5.0, 4.0, 3.0, 6.0, 7.0, 8.0]
    assert result.design["wire"] == 0.008


@pytest.mark.parametrize("status", ["infeasible", "uncertified", "failed"])
def test_an_answer_that_is_not_certified_is_none(status):
    result, tried = fit(5.4, {5.0: status, 4.0: objectives(105), 6.0: objectives(104)})
    assert tried == [5.0, 4.0, 6.0]
    assert result.design["wire"] == 0.006
    result, tried = fit(5.4, {5.0: objectives(105), 6.0: status, 7.0: status})
    assert result.design["wire"] == 0.005


def test_the_walk_ends_after_a_few_sizes():
    assert FARTHEST_SIZE == 4
    result, tried = fit(6.5, {1.0: objectives(1), 2.0: objectives(1), 11.0: objectives(1)})
    assert tried == [6.0, 5.0, 4.0, 3.0, 7.0, 8.0, 9.0, 10.0]
    assert result.status == "infeasible"


@pytest.mark.parametrize(
    ("bound", "expected"),
    [
        ((0.0045, 0.0075), [5.0, 6.0]),
        ((0.005, 0.006), [5.0, 6.0]),
        ((0.0052, 0.0075), [6.0]),
        ((0.0045, 0.0055), [5.0]),
    ],
)
def test_sizes_out_of_bounds_are_not_tried(bound, expected):
    result, tried = fit(5.4, dict.fromkeys(MM, objectives(105)), bound)
    assert tried == expected
    assert result.design["wire"] * 1000 == pytest.approx(expected[0], rel=1e-15)


def test_the_walk_stops_at_a_bound():
    _, tried = fit(5.4, {}, (0.004, 0.007))
    assert tried == [5.0, 4.0, 6.0, 7.0]


def test_where_nothing_that_is_sold_fits_the_answer_says_so_and_is_none_to_build():
    result, _ = fit(5.4, {}, (0.004, 0.007))
    assert result.status == "infeasible"
    expected = "No wire that is sold gives an admissible design (tried 5 mm, 4 mm, 6 mm, 7 mm). "
    assert result.message == expected + "Any size would have wire 5.4 mm."
    assert result.certificate is None
    assert result.binding == ()


def test_where_nothing_sold_lies_in_bounds_that_is_said():
    result, tried = fit(5.4, dict.fromkeys(MM, objectives(105)), (0.0052, 0.0058))
    assert (result.status, tried) == ("infeasible", [])
    assert "(tried none in bounds)" in result.message


def test_nothing_is_sold_at_all():
    result, tried = fit(5.4, {}, sizes=())
    assert (result.status, tried) == ("infeasible", [])


@pytest.mark.parametrize(("wire", "expected"), [(0.3, [1.0]), (14.0, [12.0])])
def test_beyond_the_ends_of_the_list_there_is_one_neighbour(wire, expected):
    result, tried = fit(wire, {expected[0]: objectives(140)})
    assert (tried, result.status) == (expected, "optimal")


@pytest.mark.parametrize("off", [0.0, 5e-10, -5e-10])
def test_an_optimum_at_a_size_is_taken_as_it_is(off):
    solve, ideal = Solve({}), solution(0.005 * (1 + off), K1=100.0)
    assert fitted(scene_of(ALL), ideal, {"wire": SIZES}, solve) is ideal
    assert solve.tried == []


def test_an_optimum_a_little_off_a_size_is_not():
    _, tried = fit(5.0 * (1 + 1e-7), {5.0: objectives(101)})
    assert tried == [5.0, 6.0, 7.0, 8.0, 9.0]


def test_of_two_sizes_equally_good_the_next_objective_chooses():
    near = 100 * (1 + 1e-10)
    result, _ = fit(5.4, {5.0: objectives(100, 1.2), 6.0: objectives(near, 1.1)})
    assert result.design["wire"] == 0.006
    result, _ = fit(5.4, {5.0: objectives(100, 1.1), 6.0: objectives(near, 1.2)})
    assert result.design["wire"] == 0.005
    result, _ = fit(5.4, {5.0: objectives(100, 1.2), 6.0: objectives(100 * (1 + 1e-6), 1.1)})
    assert result.design["wire"] == 0.005


def test_of_two_sizes_equally_good_in_everything_the_smaller_is_kept():
    result, _ = fit(5.4, {5.0: objectives(101, 1.1), 6.0: objectives(101, 1.1)})
    assert result.design["wire"] == 0.005


def test_the_message_says_what_any_size_would_have_and_what_was_tried():
    result, _ = fit(5.4, {5.0: objectives(103), 6.0: objectives(102)})
    message = "Any size would have wire 5.4 mm and K1 100 N/m; of those sold, tried 5 mm, 6 mm."
    assert result.message == f"Solved at 0.006. {message}"
    assert result.explanation == message
