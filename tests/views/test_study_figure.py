"""The figure of a sweep: what the target is about, gaps where there is no answer, three designs beside it."""

import math
from dataclasses import replace

import pytest

import loomopt as lo
from loomopt.errors import BadInput
from loomopt.studies import sweep
from loomopt.studies.rows import Row
from loomopt.views import study_figure

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
    figure = study_figure.plot(PLAN, [row(0), row(1), row(2, certified=False), row(3), row(4)])
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


def test_without_a_certified_row_there_is_nothing_to_draw():
    with pytest.raises(BadInput, match="no row is certified"):
        study_figure.plot(PLAN, [row(0, certified=False)])


def test_several_lines_have_their_legend_off_the_data():
    over = {"operation.M0": ["700 N*m", "710 N*m"], "bounds.l2.max": ["84 mm", "85 mm"]}
    plan = sweep.planned(lo.load("beatup"), over, "torque")
    places = [(700.0, 0.084), (700.0, 0.085), (710.0, 0.084), (710.0, 0.085)]
    rows = [replace(row(k), place=dict(zip(over, place, strict=True))) for k, place in enumerate(places)]
    figure = study_figure.plot(plan, rows)
    assert [axes.get_legend() for axes in figure.axes] == [None] * len(figure.axes)
    legend = figure.subfigs[0].legends[0]
    assert [text.get_text() for text in legend.get_texts()] == ["bounds.l2.max 84 mm", "bounds.l2.max 85 mm"]
