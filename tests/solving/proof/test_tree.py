"""The search over boxes on rows written down here: narrowing, discarding, halving, and what is left when it stops."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from loomopt.maths.intervals import Interval, variable
from loomopt.solving.proof.reading import LIMIT, LateError, Read
from loomopt.solving.proof.tree import BATCH, Question, Tree, grown

LOW, HIGH = np.array([-1.0, -2.0]), np.array([2.0, 1.0])


class Written:
    """Reads x² + y² + 1 as the objective and 1 − x ≤ 0 as a limit; wild: rows without bounds in some boxes."""

    of = (0, LIMIT)

    def __init__(self, wild=False):
        self.task = SimpleNamespace(sizes=HIGH - LOW)
        self.wild = wild

    def read(self, low, high, until=math.inf):
        def rows(a, b):
            x, y = (variable(k, 2, a[k], b[k]) for k in range(2))
            return [x * x + y * y + 1.0, 1.0 - x]

        def stacked(parts):
            return Interval(
                np.vstack([p.low + np.zeros((1, low.shape[1])) for p in parts]), np.vstack([p.high for p in parts])
            )

        whole, middle = rows(low, high), rows((low + high) / 2, (low + high) / 2)
        ends = [
            [np.broadcast_to(getattr(row.g, end), (2, 1, low.shape[1])) for row in whole] for end in ("low", "high")
        ]
        value, slope = stacked([row.v for row in whole]), Interval(*(np.concatenate(item, axis=1) for item in ends))
        if self.wild:
            value = Interval(np.full_like(value.low, -np.inf), np.full_like(value.high, np.inf))
            slope = Interval(np.full_like(slope.low, -np.inf), np.full_like(slope.high, np.inf))
        return Read(value, stacked([row.v for row in middle]), slope, self.of)


def question(cut, reader=None, better=lambda middles: None):
    values: Any = reader or Written()
    return Question(values, 0, cut, np.zeros(2), (), better)


def whole():
    return Tree.whole(LOW, HIGH)


def test_what_is_true_is_proven():
    """The least of x² + y² + 1 where x ≥ 1 is 2."""
    tree = whole()
    while not tree.closed:
        grown(tree, question(2.0 - 1e-6))
    assert math.isinf(tree.stuck)
    assert tree.bound == math.inf
    assert tree.boxes < 500


def test_what_is_not_true_is_not_and_the_best_design_stays_in_an_open_box():
    tree, request = whole(), question(2.0 + 1e-6)
    for _ in range(60):
        grown(tree, request)
        fixed = (tree.low[0] <= 1.0) & (tree.high[0] >= 1.0) & (tree.low[1] <= 0.0) & (tree.high[1] >= 0.0)
        assert fixed.any() or tree.stuck <= 2.0
    assert tree.bound <= 2.0


def test_bounds_of_open_boxes_rise_and_never_pass_the_optimum():
    tree, seen = whole(), []
    for _ in range(25):
        grown(tree, question(2.0 + 1e-3))
        seen.append(tree.bound)
    assert seen == sorted(seen)
    assert 1.9 < seen[-1] <= 2.0


def test_a_better_middle_ends_the_search():
    shown = []

    def better(middles):
        shown.append(middles)
        return middles[:, 0] if middles.shape[1] else None

    tree, result = whole(), None
    while result is None:
        result = grown(tree, question(3.0, better=better))
    assert result[0] >= 1.0 - 1e-9
    assert result[0] ** 2 + result[1] ** 2 + 1 <= 3.0


def test_boxes_of_which_nothing_is_known_are_halved_and_never_discarded():
    tree = whole()
    for _ in range(6):
        grown(tree, question(-5.0, Written(wild=True)))
    assert tree.low.shape[1] == 2**6
    assert np.prod(tree.high - tree.low, axis=0).sum() == pytest.approx(9.0)
    assert tree.bound == -math.inf


def test_what_is_no_number_discards_nothing():
    class Broken(Written):
        def read(self, low, high, until=math.inf):
            read = super().read(low, high)
            nothing = np.full_like(read.value.low, np.nan)
            return read._replace(value=Interval(nothing, nothing), middle=Interval(nothing, nothing))

    tree = whole()
    with np.errstate(all="ignore"):
        grown(tree, question(-5.0, Broken()))
    assert tree.low.shape[1] == 2


def test_what_cannot_be_halved_is_kept_as_open():
    low = np.array([1.0, 0.0])
    tree = Tree.whole(low, np.nextafter(low, 3.0))
    for _ in range(3):
        grown(tree, question(2.5, Written(wild=True)))
    assert tree.closed
    assert tree.stuck == -math.inf == tree.bound


def test_boxes_whose_read_is_given_up_stay_open_and_do_not_count():
    class Late(Written):
        def read(self, low, high, until=math.inf):
            raise LateError

    tree, request = whole(), question(2.0 - 1e-6)
    for _ in range(5):
        grown(tree, request)
    boxes, bound, left = tree.boxes, tree.bound, tree.low.shape[1]
    assert grown(tree, question(2.0 - 1e-6, Late()), until=0.0) is None
    assert (tree.boxes, tree.bound, tree.low.shape[1]) == (boxes, bound, left)
    while not tree.closed:
        grown(tree, request)
    assert math.isinf(tree.stuck)


def test_the_most_promising_boxes_are_read_first():
    tree = Tree(np.zeros((1, 3000)), np.ones((1, 3000)), np.arange(3000.0)[::-1].copy())
    _, _, least = tree.take()
    assert sorted(least) == list(range(BATCH))
    assert tree.boxes == BATCH
    assert tree.bound == BATCH
    assert tree.lowest() is not None
    assert Tree.empty(1).lowest() is None
