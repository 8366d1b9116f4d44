"""What the tests of figures rest on: a made-up overlap of each kind is found, and a clean figure has none."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from support import overlaps


@pytest.fixture
def axes():
    figure = Figure(figsize=(6, 4))
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.2, 0.2, 0.6, 0.6))
    phi = np.linspace(0, 360, 200)
    axes.plot(phi, np.sin(np.radians(phi)), label="sine")
    axes.set_title("a sine")
    return axes


def test_a_clean_figure_has_none(axes):
    assert overlaps.overlapping(axes.figure) == []


def test_a_text_on_a_curve_a_text_or_a_border_is_found(axes):
    axes.text(90, 0.97, "on the top", ha="center")
    assert overlaps.overlapping(axes.figure) == ["'on the top' meets the line sine"]
    axes.texts[0].set_position((200, 0.5))
    axes.text(200, 0.55, "on the other")
    assert overlaps.overlapping(axes.figure) == ["'on the top' meets 'on the other'"]
    axes.texts[1].set_position((340, -0.5))
    assert any("meets the right border" in item for item in overlaps.overlapping(axes.figure))


def test_a_legend_over_the_data_or_over_a_text_is_found(axes):
    legend = axes.legend(loc=(0.1, 0.85))
    assert any(item.startswith("legend ['sine'] meets the line sine") for item in overlaps.overlapping(axes.figure))
    legend.set_loc("upper right")
    assert overlaps.overlapping(axes.figure) == []
    axes.text(300, 0.8, "here")
    assert any("meets the legend" in item for item in overlaps.overlapping(axes.figure))
    axes.texts[0].remove()
    axes.figure.legend(["sine"], loc=(0.62, 0.72))
    assert any(item.startswith("two legends meet") for item in overlaps.overlapping(axes.figure))


def test_a_text_on_a_single_point_is_found(axes):
    axes.plot(300, 0.5, "o", label="peak")
    axes.text(295, 0.5, "peak")
    assert "'peak' meets a point of peak" in overlaps.overlapping(axes.figure)


def test_a_text_that_leaves_the_figure_is_found(axes):
    axes.set_ylabel("a name that is far too long for axes of such a height, and goes on and on", fontsize=14)
    assert any(item.endswith("leaves the figure") for item in overlaps.overlapping(axes.figure))


def test_what_is_not_drawn_meets_nothing(axes):
    axes.text(90, 0.97, "unseen", ha="center", visible=False)
    axes.plot([200, 300], [0.5, np.nan], label="gap")
    axes.text(250, 0.5, "in the gap")
    assert overlaps.overlapping(axes.figure) == []
