"""What the least relaxation is read from: prices of rows, sums of needs, and the worse of two rows."""

from dataclasses import replace

import numpy as np
from support import toy

from loomopt.jobs import registry
from loomopt.physics.tolerances import NEEDED, PRICED
from loomopt.solving.answer.solution import UnitFormatter
from loomopt.solving.nlp.point import Point
from loomopt.solving.nlp.rows import Multipliers, families, row_map
from loomopt.solving.search import elastic

WAVES = {"w": lambda m, v, phi: v["x"] + m.cos(phi), "z": lambda m, v, phi: v["x"] - 1 + m.cos(phi)}
LIMITS = (("x", -1, 2.0), ("w", 1, 0.25), ("y", 1, 1.0), ("z", 1, 0.5))


def program(limits=LIMITS):
    return toy.program("xy", {"f": lambda v: v["x"] ** 2}, WAVES, limits=limits)


def priced(made, prices):
    return tuple(elastic._clashing_limits(made, point_of(made, prices), UnitFormatter(toy.scene_of(toy.ToyJob(made)))))


def point_of(made, prices):
    """Return a point with these multipliers of rows, in their order; without any where there are none."""
    rows = row_map(made, 0, elastic=True).with_size(len(prices))
    lam_x = np.zeros(rows.variables + rows.extras)
    return Point({}, "", True, multipliers=Multipliers(rows, lam_x, np.array(prices)) if len(prices) else Multipliers())


def test_single_values_come_first_and_each_whole_cycle_limit_has_a_row_per_slot():
    """x, y and the toy's own far limit; then three slots of each family of w and of z."""
    made = program()
    count = len(families(made, elastic=True))
    slots = 3
    none = [0.0] * (3 + slots * count)
    assert priced(made, none) == ()
    assert priced(made, [-1.0, *none[1:]]) == ("x >= 2",)
    assert priced(made, [1.0, 1.0, *none[2:]]) == ("x >= 2", "y <= 1")
    last = [*none[:-1], -1.0]
    assert priced(made, last) == ("z <= 0.5",)
    first = none.copy()
    first[3] = 1.0
    assert priced(made, first) == ("w <= 0.25",)
    assert PRICED == 1e-6
    assert priced(made, [PRICED, PRICED * 1.001, *none[2:]]) == ("y <= 1",)


def test_rows_at_corners_are_priced_with_their_limit():
    """A free law with a demand: rows of it and, hidden, of contact at 22 knots each, then slots."""
    scene = registry.load("shedding").update({"targets.law.intervals": 12, "operation.N_min": "100 N"})
    made = registry.of(scene).program(scene, "law")
    single = list(made.single_limits.values())
    demand, contact = (made.limits[family.limit] for family in families(made, elastic=True))
    assert (demand.hidden, contact.hidden) == (False, True)
    for place, named in ((0, True), (21, True), (22, False), (43, False), (44, True), (45, True), (46, False)):
        prices = np.zeros(len(single) + 2 * 22 + 2 * 2)
        prices[len(single) + place] = 1.0
        result = elastic._clashing_limits(made, point_of(made, prices), UnitFormatter(scene))
        assert result == ({"N_min >= 100 N": "N_min"} if named else {}), place


def test_without_multipliers_nothing_has_a_price():
    made = program()
    assert priced(made, ()) == ()
    cycles = tuple(made.cycle_limits.values())
    assert priced(replace(made, limits=cycles), ()) == ()


def test_a_need_of_a_billionth_is_none_and_of_two_that_are_equal_the_first_counts():
    made = toy.program("xy", limits=(("x", -1, 2.0), ("x", -1, 3.0), ("y", 1, 1.0), ("y", -1, 1.0)))
    assert elastic._worst_rows(made, {0: 0.5, 1: 0.5, 2: NEEDED, 3: 1.001 * NEEDED}) == {0: 0.5, 3: 1.001 * NEEDED}
    sized = toy.program("xy", limits=(("x", -1, 2.0),), sizes={"x": 100.0})
    assert elastic._worst_rows(sized, {0: 99 * NEEDED}) == {}
    assert elastic._worst_rows(sized, {0: 101 * NEEDED}) == {0: 101 * NEEDED}
