"""The figure of a study: a sweep's panels or a front, gaps, what changes along it, three designs beside it."""

import itertools
import math
from dataclasses import replace

import pytest
from matplotlib.text import Text
from support import inch, overlaps, slow

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.interface import study_table
from loomopt.interface.figures import charts
from loomopt.interface.study.points import StudyTable
from loomopt.jobs import registry
from loomopt.studies import sweep
from loomopt.studies.front import front
from loomopt.studies.front.plan import sloped
from loomopt.studies.run.rows import Row

PLAN = sweep.plan_sweep(lo.load("beatup"), {"operation.M0": "700:740:10 N*m"}, "torque")
TODAY = lo.evaluate("beatup")


def plot(plan, rows):
    return StudyTable(plan, tuple(rows)).plot()


def row(point, certified=True):
    place = {"operation.M0": 700.0 + 10 * point}
    figures = {"peak_torque": 90.0 + point}
    status = "optimal" if certified else "infeasible"
    return Row(
        point, place, None, status, None, dict(TODAY.design) | {"l2": 0.07 + 0.001 * point}, figures, {}, {}, certified
    )


@pytest.mark.slow
def test_panels_show_the_objective_and_what_differs_with_gaps_and_three_designs():
    figure = plot(PLAN, [row(0), row(1), row(2, certified=False), row(3), row(4)])
    axes = figure.axes
    assert [axis.get_title("left") for axis in axes[:2]] == ["peak_torque [N*m]", "l2 [mm]"]
    curve = axes[0].get_lines()[0].get_ydata()
    assert [math.isnan(value) for value in curve] == [False, False, True, False, False]
    titles = [axis.get_title() for axis in axes[2:]]
    assert titles == ["A: operation.M0 700 N*m", "B: operation.M0 730 N*m", "C: operation.M0 740 N*m"]
    assert all(axis.lines and not axis.texts for axis in axes[2:])
    assert axes[1].get_xlabel() == "operation.M0 [N*m]"
    sizes = {round(axis.get_xlim()[1] - axis.get_xlim()[0], 12) for axis in axes[2:]}
    assert len(sizes) == 1, "designs are of one scale"
    assert overlaps.overlapping_at_every_size(figure) == []


def test_without_a_certified_row_there_is_nothing_to_draw():
    with pytest.raises(BadInput, match="no row is certified"):
        plot(PLAN, [row(0, certified=False)])


def test_several_lines_have_their_legend_off_the_data():
    over = {"operation.M0": ["700 N*m", "710 N*m"], "bounds.l2.max": ["84 mm", "85 mm"]}
    plan = sweep.plan_sweep(lo.load("beatup"), over, "torque")
    places = [(700.0, 0.084), (700.0, 0.085), (710.0, 0.084), (710.0, 0.085)]
    rows = [replace(row(k), place=dict(zip(over, place, strict=True))) for k, place in enumerate(places)]
    figure = plot(plan, rows)
    assert [axes.get_legend() for axes in figure.axes] == [None] * len(figure.axes)
    legend = figure.subfigs[0].legends[0]
    assert [text.get_text() for text in legend.get_texts()] == ["bounds.l2.max 84 mm", "bounds.l2.max 85 mm"]


RANGES = {"m4e": (0.0, 2.0)}
FRONT = front.trade(lo.load("beatup"), ("peak_torque", "m4e"), "balance", ranges=RANGES, points=9)


def spot(point, request, mass, peak, active):
    """Return a row of a front; request: of m4e, kg."""
    touched = [[f"{name}", "", 1] for name in active]
    warm = {"axes": {"m4e": mass, "peak_torque": peak}, "active": touched, "again": None, "near": None, "fine": None}
    place = {} if request is None else {"m4e": request}
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


@pytest.mark.slow
def test_a_front_is_one_panel_with_its_changes_named_and_a_jump_left_open():
    figure = plot(FRONT, JUMPING)
    panel, listed, *designs = figure.axes
    assert (panel.get_xlabel(), panel.get_ylabel()) == ("m4e [kg]", "peak_torque [N*m]")
    x, y = panel.get_lines()[0].get_data()
    assert [round(value, 5) for value, open_ in zip(x, y, strict=True) if math.isnan(open_)] == [1.0, 1.6]
    assert panel.patches[0].get_x() == pytest.approx(0.8)
    assert panel.patches[0].get_width() == pytest.approx(0.40001)
    message = listed.texts[0].get_text().splitlines()
    assert message == [
        "1  m4e 0.8 kg to 1.20001 kg: jump, l1 min, l4 max, swing max",
        "2  m4e 1.6 kg to 1.60001 kg: jump, swing max",
    ]
    assert [text.get_text() for text in panel.texts] == ["1", "2", "A", "B", "C"]
    assert all(text.xyann[1] > 0 for text in panel.texts[2:]), "letters stand above the curve"
    assert [design.get_title() for design in designs] == [
        "A: m4e 0 kg\npeak_torque 96 N*m",
        "B: m4e 0.8 kg\npeak_torque 95.2 N*m",
        "C: m4e 2 kg\npeak_torque 90 N*m",
    ]
    assert overlaps.overlapping_at_every_size(figure) == []


@pytest.mark.slow
def test_many_changes_close_together_are_numbered_without_meeting():
    masses = [0.0, *(1.0 + 0.004 * k for k in range(24)), 2.0]
    rows = [spot(1, None, 0.0, 96.0, ["a 1"]), spot(0, None, 2.0, 90.0, ["a 0"])]
    long = "head within s_dwell after front dead centre"
    rows += [
        spot(k + 2, mass, mass, 96.0 - 3 * mass, [f"{long} max" if k % 2 else "l4 max"])
        for k, mass in enumerate(masses[1:-1])
    ]
    figure = plot(FRONT, rows)
    panel, listed = figure.axes[:2]
    numbers = [text for text in panel.texts if text.get_text().isdigit()]
    assert len(numbers) >= 23
    assert all(item.get_position()[0] < other.get_position()[0] for item, other in itertools.pairwise(numbers))
    assert len(listed.texts[0].get_text().splitlines()) >= len(numbers)
    assert overlaps.overlapping_at_every_size(figure) == []


def test_one_design_that_is_best_in_both_is_drawn():
    alone = (replace(JUMPING[0], point=0), replace(JUMPING[0], point=1))
    figure = plot(FRONT, alone)
    assert [item.get_title() for item in figure.axes[1:]] == ["A: m4e 2 kg\npeak_torque 90 N*m"]
    panel = figure.axes[0]
    told_above = " ".join(figure._suptitle.get_text().split())
    assert told_above.endswith("peak_torque and m4e do not conflict: one design is best in both")
    figure.draw_without_rendering()
    texts = [[label.get_text() for label in axis.get_ticklabels()] for axis in (panel.xaxis, panel.yaxis)]
    assert texts == [["2"], ["90"]], "the point's own values, and nothing beside them"
    assert overlaps.overlapping_at_every_size(figure) == []


@pytest.mark.slow
def test_a_front_of_an_inch_machine_is_drawn_in_inches():
    scene = inch.scene("beatup", operation__speed="350 rpm")
    figure = plot(replace(FRONT, scene=front.trade(scene, FRONT.axes, ranges=RANGES).scene), JUMPING)
    assert (figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel()) == ("m4e [lb]", "peak_torque [lbf*in]")
    assert overlaps.overlapping_at_every_size(figure) == []


@pytest.mark.slow
def test_a_sweep_of_all_that_a_rapier_has_shows_all_of_it():
    scene = lo.load("rapier")
    plan = sweep.plan_sweep(scene, {"operation.s_dwell": "4:8:2 mm"})
    today = registry.of(scene).today(scene)
    rows = [
        replace(
            row(k),
            place={"operation.s_dwell": 0.004 + 0.002 * k},
            design={name: value * (1 + 0.01 * k) for name, value in today.items()},
            figures={"peak_acceleration": 0.7 + k},
        )
        for k in range(3)
    ]
    figure = plot(plan, rows)
    shown = [column.heading for column in study_table.shown_columns(plan, rows)]
    assert len(shown) > 5
    assert [axes.get_title("left") for axes in figure.axes[: len(shown)]] == shown
    assert overlaps.overlapping_at_every_size(figure) == []


def two_ways(first, second):
    """Return the figure of a sweep over two numbers, so many values each."""
    over = {
        "operation.M0": [f"{700 + 5 * k} N*m" for k in range(first)],
        "bounds.l2.max": [f"{84 + 0.125 * k} mm" for k in range(second)],
    }
    plan = sweep.plan_sweep(lo.load("beatup"), over, "torque")
    rows = []
    for k in range(first * second):
        item, other = divmod(k, second)
        place = {"operation.M0": 700.0 + 5 * item, "bounds.l2.max": 0.084 + 0.000125 * other}
        figures = {"peak_torque": 90.0 + item + 0.3 * other}
        rows.append(replace(row(k), place=place, figures=figures, design=dict(TODAY.design) | {"l2": 0.07 + 0.001 * k}))
    return plot(plan, rows)


@pytest.mark.slow
@pytest.mark.parametrize(("first", "second"), slow.after(2, [(2, 2), (3, 17), (5, 7), (1, 4)]))
def test_nothing_of_a_two_way_sweep_runs_into_anything(first, second):
    figure = two_ways(first, second)
    assert overlaps.overlapping_at_every_size(figure) == []
    (legend,) = figure.subfigs[0].legends
    drawn = [text.get_text() for text in legend.get_texts()]
    if second <= study_table.LINES:
        assert len(drawn) == second
        assert legend.get_title().get_text() in ("", "None")
    else:
        assert len(drawn) == 6
        assert legend.get_title().get_text() == "6 of 17 lines are drawn, one in 3; the table has all"


@pytest.mark.slow
def test_a_row_that_misses_its_goal_is_marked_and_named():
    rows = [replace(row(k), reached={"M3_fdc": k > 1}) for k in range(4)]
    figure = plot(PLAN, rows)
    (legend,) = figure.subfigs[0].legends
    assert [text.get_text() for text in legend.get_texts()] == ["M3_fdc not reached"]
    for axes in figure.axes[:2]:
        (marks,) = [line for line in axes.lines if line.get_color() == charts.MISSED]
        assert list(marks.get_xdata()) == [700.0, 710.0]
    titles = [axes.get_title() for axes in figure.axes[2:]]
    assert titles[0] == "A: operation.M0 700 N*m\nM3_fdc not reached"
    assert "not reached" not in titles[-1]
    assert overlaps.overlapping_at_every_size(figure) == []


def test_a_size_that_is_given_is_the_figures_size_and_texts_are_as_large_as_there_is_room():
    figure = plot(PLAN, [row(k) for k in range(4)])
    values = figure.get_size_inches()
    sizes = sorted({text.get_fontsize() for text in figure.findobj(Text)})
    figure.set_size_inches(*(values / 2))
    assert list(figure.get_size_inches()) == list(values / 2)
    assert sorted({text.get_fontsize() for text in figure.findobj(Text)}) == pytest.approx([s / 2 for s in sizes])
    figure.set_size_inches(*(values * 2))
    assert sorted({text.get_fontsize() for text in figure.findobj(Text)}) == pytest.approx(sizes)


@pytest.mark.slow
def test_no_common_factor_stands_where_the_names_of_designs_do():
    figure = lo.pareto("shedding", ("K1", "X0"), points=3).plot()
    figure.canvas.draw()
    assert {axis.get_offset_text().get_text() for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)} == {""}
