"""Fronts of the packaged machines against known points, slopes and ends; rows do not depend on who solves them."""

import contextlib
import itertools
import json
import math
import pickle
import re

import pytest
from support import slow

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.studies.front import front, plan, trade
from loomopt.studies.front.trade import read_front
from loomopt.studies.run import run
from loomopt.studies.run.rows import Row, Side, StudyTask

RPM = math.pi / 30
CLOSE = 1e-9


def ends(trade):
    """Return the rows of both ends."""
    return [trade.solved(task, None) for task in trade.batch(())]


def at(trade, value, parent, **more):
    """Return the row with the second axis held at a value, from a parent; cold without one."""
    ask = {"also": [], "held": (parent.warm["held"] if parent else []), "wide": False} | more
    task = StudyTask(99, parent.point if parent else None, {trade.axes[1]: value}, ask)
    return trade.solved(task, parent)


def read(row, axis):
    return plan.value(row, axis)


def untimed(row):
    return {name: value for name, value in json.loads(json.dumps(row.as_dict())).items() if name != "seconds"}


@pytest.fixture(scope="module")
def mass():
    trade = front.trade(lo.load("beatup"), ("peak_torque", "m4e"), "balance")
    return trade, run.run(trade)


@pytest.fixture(scope="module")
def torque():
    trade = front.trade(lo.load("beatup"), ("peak_torque", "M3_fdc"))
    return trade, ends(trade)


@pytest.fixture(scope="module")
def preload():
    trade = front.trade(lo.load("shedding"), ("K1", "X0"), points=12)
    return trade, run.run(trade)


MASS = {0.0: 96.540355060, 1.0: 95.103966045, 3.0: 92.460846773, 5.0: 90.088516886, 6.286039692: 88.689413492}


@pytest.mark.parametrize(("kilograms", "peak"), MASS.items())
def test_peak_torque_against_counterweight(mass, kilograms, peak):
    trade, rows = mass
    row = at(trade, kilograms, rows[1])
    assert row.certified
    assert row.reached == {"M3_fdc": True}
    assert read(row, "peak_torque") == pytest.approx(peak, rel=CLOSE)
    assert read(row, "m4e") == pytest.approx(kilograms, abs=1e-9)
    assert abs(row.figures["M3_fdc"]) < 1e-8


def test_slope_of_the_counterweight(mass):
    trade, rows = mass
    assert at(trade, 0.01, rows[1]).multipliers[plan.sloped(("peak_torque", "m4e"))] == pytest.approx(-1.477, abs=5e-4)


def test_area_of_the_front(mass):
    second_front = trade.read_front(*mass)
    masses, peaks = plan.values(second_front.rows, "m4e"), plan.values(second_front.rows, "peak_torque")
    assert masses[0] == 0.0
    assert masses[-1] == pytest.approx(6.286039692, rel=1e-8)
    corners = list(zip([*masses, 7.0], [97.0 - peak for peak in [*peaks, peaks[-1]]], strict=True))
    area = sum((b[0] - a[0]) * (a[1] + b[1]) / 2 for a, b in itertools.pairwise(corners))
    assert area == pytest.approx(34.892414, rel=1e-3)


def test_every_point_is_certified_and_none_is_as_good_as_another(mass):
    second_front = trade.read_front(*mass)
    assert len(second_front.rows) >= 40
    assert all(row.certified and row.status == "optimal" for row in second_front.rows)
    for axis, rising in (("m4e", 1), ("peak_torque", -1)):
        assert all(rising * (b - a) > 0.0 for a, b in itertools.pairwise(plan.values(second_front.rows, axis)))


def test_multipliers_are_the_slope_between_neighbours(mass):
    second_front = trade.read_front(*mass)
    slopes = [row.multipliers[plan.sloped(("peak_torque", "m4e"))] for row in second_front.rows[:-1]]
    points = list(
        zip(plan.values(second_front.rows, "m4e"), plan.values(second_front.rows, "peak_torque"), strict=True)
    )
    for (item, other), (left, right) in zip(itertools.pairwise(points[:-1]), itertools.pairwise(slopes), strict=True):
        if other[0] - item[0] > 1e-3:
            secant = (other[1] - item[1]) / (other[0] - item[0])
            assert min(left, right) - 1e-5 < secant < max(left, right) + 1e-5


def test_what_changes_along_the_counterweight_is_told(mass):
    changes = {change.limits[0].text: change for change in trade.read_front(*mass).changes}
    assert set(changes) == {"l4 max", "l1 min"}
    assert changes["l4 max"].at == pytest.approx(2.2654, abs=1e-4)
    assert changes["l4 max"].kind == "active set"
    assert changes["l1 min"].at == pytest.approx(6.286039692, rel=1e-8)
    assert changes["l1 min"].kind == "kink"


def test_rounds_are_batches_of_eight_with_parents_of_earlier_rounds(mass):
    trade, rows = mass
    done: tuple[Row, ...] = ()
    while batch := trade.batch(done):
        assert len(batch) <= plan.BATCH or all("trial" in task.ask for task in batch)
        assert [task.point for task in batch] == list(range(len(done), len(done) + len(batch)))
        assert all(task.parent is None or task.parent < len(done) for task in batch)
        if len(done) in (2, 10):
            assert len(batch) == plan.BATCH
        done = rows[: len(done) + len(batch)]
    assert len(done) == len(rows)


def test_a_row_read_back_from_json_gives_the_same_bits(mass):
    trade, rows = mass
    again = pickle.loads(pickle.dumps(trade))
    back = [Row.from_dict(json.loads(json.dumps(row.as_dict()))) for row in rows]
    done = [len(rows[:2]), 10, 18]
    for first in done:
        task = again.batch(back[:first])[-1]
        assert untimed(again.solved(task, back[task.parent])) == untimed(rows[task.point])


def test_keys_differ_where_rows_do():
    scene = lo.load("beatup")
    axes = ("peak_torque", "m4e")
    trades = [
        front.trade(scene, axes, "balance"),
        front.trade(scene, axes[::-1], "balance"),
        front.trade(scene, axes, "torque"),
        front.trade(scene, axes, "balance", points=9),
        front.trade(scene, axes, "balance", ranges={"m4e": (0.0, 2.0)}),
        front.trade(lo.load("beatup-heavy"), axes, "balance"),
    ]
    assert len({trade.key for trade in trades}) == len(trades)
    assert pickle.loads(pickle.dumps(trades[0])).key == trades[0].key


TORQUE = {
    0.0: 88.689413492,
    20.0: 86.308489640,
    40.0: 83.927565788,
    45.3960098: 83.28519136,
    68.018897919: 82.337138533,
}


@pytest.mark.few(3)
@pytest.mark.parametrize(("reed", "peak"), TORQUE.items())
def test_peak_torque_against_reed_torque(torque, reed, peak):
    trade, (least, balanced) = torque
    row = at(trade, reed, balanced if reed < 40.0 else least)
    assert row.certified
    assert read(row, "M3_fdc") == pytest.approx(reed, abs=1e-7)
    assert read(row, "peak_torque") == pytest.approx(peak, rel=1e-9)


def test_of_equally_good_counterweights_the_lightest_is_taken(torque):
    trade, (_, balanced) = torque
    row = at(trade, 20.0, balanced)
    assert (row.design["r4e"], balanced.design["r4e"]) == (0.08, 0.08)
    assert balanced.design["m4e"] == pytest.approx(6.286039692, abs=1e-8)
    assert 0.0 < row.design["m4e"] < balanced.design["m4e"]


def test_slopes_against_reed_torque(torque):
    trade, (least, balanced) = torque
    slopes = [
        at(trade, reed, parent).multipliers[plan.sloped(("peak_torque", "M3_fdc"))]
        for reed, parent in ((20.0, balanced), (45.5, least), (50.0, least), (64.0, least))
    ]
    assert slopes == pytest.approx([-0.119, -0.096, -0.042, -0.0416], abs=6e-4)


@pytest.mark.slow
def test_the_counterweight_that_is_used_up_is_told():
    trade = front.trade(lo.load("beatup"), ("peak_torque", "M3_fdc"), ranges={"M3_fdc": (45.0, 46.0)}, points=5)
    second_front = read_front(trade, run.run(trade))
    torques = plan.values(second_front.rows, "M3_fdc")
    assert (torques[0], torques[-1]) == pytest.approx((45.0, 46.0), abs=1e-7)
    used, left = (
        next(c for c in second_front.changes if Side.read(name) in c.limits) for name in ("m4e min", "theta max")
    )
    assert used.interval[0] < 45.3960098 < used.interval[1]
    assert used.kind == "active set"
    assert left.interval[0] < 45.639 < left.interval[1]
    assert all(c.interval[1] - c.interval[0] < 0.07 for c in (used, left))


@pytest.mark.few(1)
@pytest.mark.parametrize(("most", "low", "high"), [((), 600.0, 800.0), (("M0",), 700.0, 950.0)])
def test_reed_torque_against_resistance_in_closed_form(most, low, high):
    trade = front.trade(lo.load("beatup"), ("M3_fdc", "M0"), maximise=most, ranges={"M0": (low, high)}, points=4)
    second_front = read_front(trade, run.run(trade))
    for resistance, reed in zip(
        plan.values(second_front.rows, "M0"), plan.values(second_front.rows, "M3_fdc"), strict=True
    ):
        assert reed == pytest.approx(max(0.0, 676.981102 - resistance, resistance - 871.503394), abs=2e-6)
    reached = plan.values(second_front.rows, "M0")
    assert (reached[-1] if not most else reached[0]) == pytest.approx(871.503394 if most else 676.981102, abs=2e-6)


@pytest.mark.slow
def test_dwells_of_the_rapier():
    trade = front.trade(lo.load("rapier"), ("peak_acceleration", "dwell"), "stroke-dwell", maximise=("dwell",))
    known = {25.0: 0.672656909, 30.0: 0.694984754, 35.0: 0.714035795, 45.0: 0.751506644}
    cold = at(trade, math.radians(35.0), None)
    for degrees, peak in known.items():
        row = cold if degrees == 35.0 else at(trade, math.radians(degrees), cold)
        assert row.certified
        assert row.reached == {"stroke": True}
        assert read(row, "peak_acceleration") == pytest.approx(peak, rel=2e-9)
        assert min(row.figures["dwell_after"], row.figures["dwell_before"]) == pytest.approx(math.radians(degrees))
        assert row.multipliers[plan.sloped(("peak_acceleration", "dwell"))] > 0.0


STIFFNESS = {0.080: 102602.609425, 0.060: 119901.395181, 0.040: 144270.372242, 0.020: 181234.597037}


@pytest.mark.slow
@pytest.mark.parametrize(("preload_", "stiffness"), STIFFNESS.items())
def test_stiffness_against_preload(preload, preload_, stiffness):
    trade, rows = preload
    row = at(trade, preload_, rows[0])
    assert row.certified
    assert read(row, "K1") == pytest.approx(stiffness, rel=1e-10)


def test_statics_govern_a_short_spring(preload):
    second_front = trade.read_front(*preload)
    (change,) = second_front.changes
    assert change.kind == "kink"
    assert change.limits == (Side("N_min", "min"),)
    assert change.at == pytest.approx(2.096358e-3, abs=5e-10)
    static = (369.55 + 124.545) / 0.001
    assert read(at(preload[0], 0.001, preload[1][1]), "K1") == pytest.approx(static, rel=1e-10)


@pytest.mark.slow
def test_stiffness_against_speed():
    ranges = {"speed": (10 * RPM, 900 * RPM)}
    trade = front.trade(lo.load("shedding"), ("K1", "speed"), maximise=("speed",), ranges=ranges, points=3)
    rows = run.run(trade)
    for speed, stiffness in ((200.0, 13354.018003), (400.0, 46819.099799), (900.0, 228117.326425)):
        row = at(trade, speed * RPM, rows[0])
        assert row.certified
        assert read(row, "K1") == pytest.approx(stiffness, rel=1e-10)
    second_front = read_front(trade, rows)
    assert second_front.changes[0].at / RPM == pytest.approx(119.2122, abs=1e-4)
    assert second_front.changes[0].kind == "kink"
    assert plan.values(second_front.rows, "speed")[-1] == pytest.approx(900 * RPM)


def test_the_end_of_an_axis_that_has_one_need_not_be_named():
    rapier = lo.load("rapier")
    alone = front.trade(rapier, ("peak_acceleration", "dwell"))
    assert alone.senses == ("least", "most")
    assert alone.key == front.trade(rapier, ("peak_acceleration", "dwell"), maximise=("dwell",)).key
    with pytest.raises(BadInput, match="dwell cannot be minimised, it can only be maximised"):
        front.trade(rapier, ("peak_acceleration", "dwell"), minimise=("dwell",))
    assert front.trade(lo.load("shedding"), ("K1", "X0"), ranges={"X0": (0.02, 0.08)}).senses == ("least", "least")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("axis", "low", "high", "reached"),
    slow.after(
        2,
        [
            ("m4e", 50.0, 60.0, "6.28604 kg"),
            ("peak_torque", 10.0, 20.0, "88.6894 N*m"),
            ("m4e", -5.0, -1.0, "0 kg"),
            ("peak_torque", 100.0, 120.0, "96.5404 N*m"),
        ],
    ),
)
def test_a_range_that_no_point_lies_in_is_told(axis, low, high, reached):
    study = front.trade(lo.load("beatup"), ("peak_torque", "m4e"), "balance", ranges={axis: (low, high)}, points=4)
    with pytest.raises(BadInput, match=re.escape(f"lies in the range; it comes to {reached}")) as error:
        run.run(study)
    assert error.value.key == axis


@pytest.mark.slow
def test_the_moment_of_inertia_costs_what_its_counterweight_does(mass):
    """Of a counterweight at its largest radius J4 = J4⁰ + m4e r4e²: both fronts are one."""
    trade = front.trade(lo.load("beatup"), ("peak_torque", "J4"), "balance", points=4)
    values, other = ends(trade), mass[1]
    for row, same in zip(values, other[:2], strict=True):
        assert row.certified
        assert read(row, "J4") == pytest.approx(0.62 + read(same, "m4e") * 0.08**2, abs=CLOSE)
        assert read(row, "J4") == pytest.approx(row.figures["J4"], rel=CLOSE)
        assert read(row, "peak_torque") == pytest.approx(read(same, "peak_torque"), rel=CLOSE)


@pytest.mark.slow
def test_what_the_least_change_from_today_buys():
    """Today's machine has no counterweight: its radius counts as a change, its largest does not stand for none."""
    trade = front.trade(lo.load("beatup"), ("peak_torque", "change"), points=3)
    second_front = read_front(trade, run.run(trade))
    assert all(row.certified for row in second_front.rows)
    assert len(plan.values(second_front.rows, "change")) >= 3
    for before, row in itertools.pairwise(second_front.rows):
        assert row.figures["change"] == pytest.approx(read(row, "change"), abs=CLOSE)
        assert read(row, "peak_torque") < read(before, "peak_torque")


def loose():
    """Return the shedding scene without bounds on K1, X0 from 0."""
    document = lo.load("shedding").document
    bounds = {name: bound for name, bound in document["bounds"].items() if name != "K1"}
    return registry.scene({**document, "bounds": bounds})


@pytest.mark.slow
def test_an_end_without_a_least_asks_for_a_range():
    trade = front.trade(loose(), ("K1", "X0"), points=3)
    with pytest.raises(BadInput, match=r"the least X0 is not reached: K1 grows without limit.*--range of X0 or of K1"):
        trade.batch(ends(trade))


@pytest.mark.slow
def test_a_free_law_whose_middle_counts_is_traded_against_the_speed_that_keeps_contact():
    """Today's machine has no such law: what follows from one is read from the law that the task begins with."""
    scene = lo.load("shedding").set("effects.warp_tension.shape", "step")
    trade = front.trade(scene, ("K1", "contact_speed"), "law", maximise=("contact_speed",), points=3)
    second_front = read_front(trade, run.run(trade))
    assert [row.status for row in second_front.rows] == ["optimal"] * len(second_front.rows)
    stiff, fast = plan.values(second_front.rows, "K1"), plan.values(second_front.rows, "contact_speed")
    assert len(stiff) > 2
    assert sorted(stiff) == list(stiff)
    assert sorted(fast) == list(fast)


@pytest.mark.parametrize(
    ("certified", "angle", "report"), [(False, math.pi, True), (True, math.pi, False), (False, 3.0, False)]
)
def test_an_end_that_no_limit_stops_is_told(certified, angle, report):
    """With the dwell sought, nothing reads how long it is to last after front dead centre: at most half a turn."""
    trade = front.trade(lo.load("rapier"), ("dwell", "dwell_after"), maximise=("dwell", "dwell_after"), points=3)
    program = trade.solver.base
    x = {v.name: v.lower for v in program.variables} | {"dwell": 1.0, "dwell_after": angle, "phi_stroke": 3.0}
    row = Row(0, {}, None, "", None, {}, {}, {}, {}, certified, 0.0, {"point": {"x": x}})
    wrong = "dwell_after reaches an end of its range, where no limit stops it"
    with pytest.raises(BadInput, match=wrong) if report else contextlib.nullcontext():
        trade._refuse({0: row, 1: row})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ranges", "axis", "reached"),
    [
        ({"X0": (0.02, 0.08)}, "X0", (0.02, 0.08)),
        ({"K1": (1e5, 2e5)}, "K1", (2e5, 102602.609425)),
    ],
)
def test_a_range_ends_the_front(ranges, axis, reached):
    trade = front.trade(loose(), ("K1", "X0"), ranges=ranges, points=3)
    second_front = read_front(trade, run.run(trade))
    assert (plan.values(second_front.rows, axis)[0], plan.values(second_front.rows, axis)[-1]) == pytest.approx(reached)


@pytest.mark.parametrize(
    ("axes", "more", "message"),
    [
        (("peak_torque", "nonsense"), {}, 'unknown axis "nonsense"'),
        (("peak_torque", "m4e"), {"maximise": ("peak_torque",)}, "it can only be minimised"),
        (("peak_torque", "peak_torque"), {}, "two axes that differ"),
        (("peak_torque", "m4e"), {"ranges": {"m4e": (2.0, 1.0)}}, "must be smaller"),
        (("peak_torque", "m4e"), {"points": 2}, "more points"),
        (("peak_torque", "m4e"), {"points": 99_999_999_999}, "number of points is out of range.*3 to 20000"),
        (("peak_torque", "m4e"), {"points": 3.5}, "it is not a whole number"),
        (("peak_torque", "m4e"), {"maximise": "l1"}, "l1 is not one of the two axes"),
        (("peak_torque", "m4e"), {"target": "nothing"}, "no target nothing"),
        (("peak_torque", "reed_centrifugal"), {}, "nothing in the scene gives reed_centrifugal"),
    ],
)
def test_bad_input_names_what_is_wrong(axes, more, message):
    with pytest.raises(BadInput, match=message):
        front.trade(lo.load("beatup"), axes, **more)
