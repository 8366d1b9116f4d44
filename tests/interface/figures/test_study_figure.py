"""The figure of a study: a sweep's panels or a front, gaps, what changes along it, three designs beside it."""

import itertools
import math
from dataclasses import replace

import pytest
from support import inch, overlaps

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.interface.figures import study
from loomopt.studies import sweep
from loomopt.studies.front import front
from loomopt.studies.front.plan import sloped
from loomopt.studies.run.rows import Row

PLAN = sweep.planned(lo.load("beatup"), {"operation.M0": "700:740:10 N*m"}, "torque")
TODAY = lo.evaluate("beatup")


def row(point, certified=True):
    place = {"operation.M0": 700.0 + 10 * point}
    figures = {"peak_torque": 90.0 + point}
    status = "optimal" if certified else "infeasible"
    return Row(
        point, place, None, status, None, dict(TODAY.design) | {"l2": 0.07 + 0.001 * point}, figures, {}, {}, certified
    )


def test_panels_show_the_objective_and_what_differs_with_gaps_and_three_designs():
    figure = study.plot(PLAN, [row(0), row(1), row(2, certified=False), row(3), row(4)])
    axes = figure.axes
    assert [each.get_ylabel() for each in axes[:2]] == ["peak_torque [N*m]", "l2 [mm]"]
    curve = axes[0].get_lines()[0].get_ydata()
    assert [math.isnan(value) for value in curve] == [False, False, True, False, False]
    titles = [each.get_title() for each in axes[2:]]
    assert titles == ["A: operation.M0 700 N*m", "B: operation.M0 730 N*m", "C: operation.M0 740 N*m"]
    assert all(each.lines and not each.texts for each in axes[2:])
    assert axes[1].get_xlabel() == "operation.M0 [N*m]"
    sizes = {round(each.get_xlim()[1] - each.get_xlim()[0], 12) for each in axes[2:]}
    assert len(sizes) == 1, "designs are of one scale"
    assert overlaps.found(figure) == []


def test_without_a_certified_row_there_is_nothing_to_draw():
    with pytest.raises(BadInput, match="no row is certified"):
        study.plot(PLAN, [row(0, certified=False)])


def test_several_lines_have_their_legend_off_the_data():
    over = {"operation.M0": ["700 N*m", "710 N*m"], "bounds.l2.max": ["84 mm", "85 mm"]}
    plan = sweep.planned(lo.load("beatup"), over, "torque")
    places = [(700.0, 0.084), (700.0, 0.085), (710.0, 0.084), (710.0, 0.085)]
    rows = [replace(row(k), place=dict(zip(over, place, strict=True))) for k, place in enumerate(places)]
    figure = study.plot(plan, rows)
    assert [axes.get_legend() for axes in figure.axes] == [None] * len(figure.axes)
    legend = figure.subfigs[0].legends[0]
    assert [text.get_text() for text in legend.get_texts()] == ["bounds.l2.max 84 mm", "bounds.l2.max 85 mm"]


RANGES = {"m4e": (0.0, 2.0)}
FRONT = front.trade(lo.load("beatup"), ("peak_torque", "m4e"), "balance", ranges=RANGES, points=9)


def spot(point, asked, mass, peak, active):
    """Return a row of a front; asked: of m4e, kg."""
    touched = [[f"{name}", "", 1] for name in active]
    warm = {"axes": {"m4e": mass, "peak_torque": peak}, "active": touched, "again": None, "near": None, "fine": None}
    place = {} if asked is None else {"m4e": asked}
    slope = {sloped(("peak_torque", "m4e")): -1.0}
    design = dict(TODAY.design) | {"m4e": mass}
    return Row(point, place, None, "optimal", None, design, {"peak_torque": peak}, slope, {}, True, 0.0, warm)


JUMPING = (
    spot(0, None, 2.0, 90.0, ["l1 min"]),
    spot(1, None, 0.0, 96.0, ["l4 max"]),
    spot(2, 0.5, 0.5, 95.5, ["l4 max"]),
    spot(3, 1.2, 0.8, 95.2, ["l4 max"]),
    spot(4, 1.20001, 1.20001, 92.0, ["l1 min", "swing max"]),
    spot(5, 1.6, 1.6, 91.6, ["l1 min", "swing max"]),
    spot(6, 1.60001, 1.60001, 90.9, ["l1 min"]),
)


def test_a_front_is_one_panel_with_its_changes_named_and_a_jump_left_open():
    figure = study.plot(FRONT, JUMPING)
    panel, listed, *designs = figure.axes
    assert (panel.get_xlabel(), panel.get_ylabel()) == ("m4e [kg]", "peak_torque [N*m]")
    x, y = panel.get_lines()[0].get_data()
    assert [round(value, 5) for value, open_ in zip(x, y, strict=True) if math.isnan(open_)] == [1.0, 1.6]
    assert panel.patches[0].get_x() == pytest.approx(0.8)
    assert panel.patches[0].get_width() == pytest.approx(0.40001)
    said = listed.texts[0].get_text().splitlines()
    assert said == [
        "1  m4e 0.8 kg to 1.20001 kg: jump, l1 min, l4 max, swing max",
        "2  m4e 1.6 kg to 1.60001 kg: jump, swing max",
    ]
    assert [text.get_text() for text in panel.texts] == ["1", "2", "A", "B", "C"]
    assert [each.get_title() for each in designs] == [
        "A: m4e 0 kg\npeak_torque 96 N*m",
        "B: m4e 0.8 kg\npeak_torque 95.2 N*m",
        "C: m4e 2 kg\npeak_torque 90 N*m",
    ]
    assert overlaps.found(figure) == []


def test_many_changes_close_together_are_numbered_without_meeting():
    masses = [0.0, *(1.0 + 0.004 * k for k in range(24)), 2.0]
    rows = [spot(1, None, 0.0, 96.0, ["a 1"]), spot(0, None, 2.0, 90.0, ["a 0"])]
    long = "head within s_dwell after front dead centre"
    rows += [
        spot(k + 2, mass, mass, 96.0 - 3 * mass, [f"{long} max" if k % 2 else "l4 max"])
        for k, mass in enumerate(masses[1:-1])
    ]
    figure = study.plot(FRONT, rows)
    panel, listed = figure.axes[:2]
    numbers = [text for text in panel.texts if text.get_text().isdigit()]
    assert len(numbers) >= 23
    assert all(one.get_position()[0] < other.get_position()[0] for one, other in itertools.pairwise(numbers))
    assert len(listed.texts[0].get_text().splitlines()) >= len(numbers)
    assert overlaps.found(figure) == []


def test_one_design_that_is_best_in_both_is_drawn():
    alone = (replace(JUMPING[0], point=0), replace(JUMPING[0], point=1))
    figure = study.plot(FRONT, alone)
    assert [each.get_title() for each in figure.axes[1:]] == ["A: m4e 2 kg\npeak_torque 90 N*m"]
    assert overlaps.found(figure) == []


def test_a_front_of_an_inch_machine_is_drawn_in_inches():
    scene = inch.scene("beatup", operation__speed="350 rpm")
    figure = study.plot(replace(FRONT, scene=front.trade(scene, FRONT.axes, ranges=RANGES).scene), JUMPING)
    assert (figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel()) == ("m4e [lb]", "peak_torque [lbf*in]")
    assert overlaps.found(figure) == []
