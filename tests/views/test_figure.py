import subprocess
import sys
from pathlib import Path

import matplotlib
import matplotlib.image
import numpy as np
import pandas as pd
import pytest

from loomopt.errors import BadInput
from loomopt.jobs.beatup import drawing as crank_rocker_drawing
from loomopt.views import figure, svg

PAPER = {"l1": 0.031, "l2": 0.065, "l3": 0.155, "l4": 0.167}
MARKS = {"front dead centre": 1.15, "rear dead centre": 4.25, "pulse begins": 0.89, "pulse ends": 1.41}
MAGIC = {".png": b"\x89PNG", ".pdf": b"%PDF", ".svg": b"<"}


@pytest.fixture
def frame():
    phi = np.linspace(0, 2 * np.pi, 91)
    columns = {"phi [rad]": phi, "psi [rad]": 2.5 + 0.2 * np.cos(phi), "psi_1 [1]": -0.2 * np.sin(phi)}
    columns |= {"psi_2 [1]": -0.2 * np.cos(phi), "M_R [N*m]": 0 * phi, "M3 [N*m]": 700 * np.cos(phi)}
    return pd.DataFrame(columns | {"Md [N*m]": 90 * np.sin(2 * phi), "piece": 0 * phi})


@pytest.mark.parametrize("ending", figure.SUFFIXES)
def test_drawing_and_curves_are_written_in_the_format_asked_for(tmp_path, frame, ending):
    for name, write in (
        ("d", lambda path: figure.draw(crank_rocker_drawing.linkage(PAPER, "A $title_ <&"), path)),
        ("c", lambda path: figure.curves(frame, path, "A $title_ <&", MARKS)),
    ):
        path, again = tmp_path / f"{name}{ending}", tmp_path / f"{name}2{ending}"
        write(path)
        write(again)
        assert path.read_bytes().startswith(MAGIC[ending])
        assert path.read_bytes() == again.read_bytes()


def test_a_drawing_as_svg_is_the_one_at_full_scale(tmp_path):
    drawn = crank_rocker_drawing.linkage(PAPER, "t")
    figure.draw(drawn, tmp_path / "a.svg")
    assert (tmp_path / "a.svg").read_text(encoding="utf-8") == svg.render(drawn)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_a_picture_has_the_same_size_for_any_machine(tmp_path, size):
    figure.draw(
        crank_rocker_drawing.linkage({name: size * value for name, value in PAPER.items()}, "t"), tmp_path / "a.png"
    )
    image = matplotlib.image.imread(tmp_path / "a.png")
    assert max(image.shape[:2]) == pytest.approx(1417, abs=2)
    assert image[..., :3].min() < 0.3
    edges = np.concatenate([image[0], image[-1], image[:, 0], image[:, -1]])
    assert np.all(edges[:, :3] == 1.0)


def test_another_ending_is_bad_input(tmp_path, frame):
    with pytest.raises(BadInput, match=r"\.png, \.pdf, \.svg"):
        figure.draw(crank_rocker_drawing.linkage(PAPER, "t"), tmp_path / "a.jpg")
    with pytest.raises(BadInput, match=r"\.png, \.pdf, \.svg"):
        figure.curves(frame, tmp_path / "a.jpg", "t")
    assert not list(tmp_path.iterdir())


def panels(monkeypatch, frame, marks):
    """Return the axes that `curves` would save."""
    kept = []
    monkeypatch.setattr(figure, "_save", lambda drawn, path: kept.append(drawn))
    figure.curves(frame, Path("a.png"), "t", marks)
    kept[0].canvas.draw()
    return [axes for axes in kept[0].axes if axes.get_visible()]


def test_each_column_with_a_unit_has_a_panel_in_degrees(monkeypatch, frame):
    axes = panels(monkeypatch, frame, None)
    labels = [panel.get_ylabel() for panel in axes]
    assert set(labels) == {"psi [deg]", "psi_1", "psi_2", "M_R [N*m]", "M3 [N*m]", "Md [N*m]"}
    assert axes[0].get_xlim() == pytest.approx((0, 360))
    assert axes[0].lines[-1].get_ydata()[0] == pytest.approx(np.degrees(2.7))


@pytest.mark.parametrize("count", [2, 7])
def test_marks_stand_where_they_belong_and_no_labels_overlap(monkeypatch, frame, count):
    axes = panels(monkeypatch, frame.iloc[:, :count], MARKS)
    at = sorted(line.get_xdata()[0] for line in axes[0].lines if len(line.get_xdata()) == 2)
    assert any(x == pytest.approx(np.degrees(1.15)) for x in at)
    assert any(x == pytest.approx(np.degrees(4.25)) for x in at)
    (shade,) = axes[0].patches
    assert (shade.get_x(), shade.get_width()) == pytest.approx((np.degrees(0.89), np.degrees(0.52)))
    canvas = axes[0].figure.canvas.get_renderer()
    boxes = [text.get_window_extent(canvas) for panel in axes for text in panel.texts]
    boxes += [panel.yaxis.label.get_window_extent(canvas) for panel in axes]
    boxes.append(axes[0].figure._suptitle.get_window_extent(canvas))
    assert len(boxes) >= 5
    assert not [1 for k, one in enumerate(boxes) for other in boxes[:k] if one.overlaps(other)]


def test_marks_and_pulse_are_found_a_turn_later_on_an_axis_that_starts_late(monkeypatch, frame):
    late = frame.assign(**{"phi [rad]": frame["phi [rad]"] + 1.0})
    panel = panels(monkeypatch, late, MARKS)[0]
    spans = [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in panel.patches]
    low, high = np.degrees([1.0, 1.0 + 2 * np.pi])
    assert spans == [pytest.approx((low, np.degrees(1.41))), pytest.approx((np.degrees(0.89) + 360, high))]


def test_a_stretch_through_zero_is_shaded_on_both_sides_and_undefined_marks_are_left_out(monkeypatch, frame):
    marks = {"front dead centre": 0.0, "hand-over": np.radians(182.5), "lost": float("nan")}
    marks |= {"dwell begins": np.radians(323.4), "dwell ends": np.radians(35.9), "pause before begins": 5.0}
    panel = panels(monkeypatch, frame, marks)[0]
    spans = sorted((patch.get_x(), patch.get_x() + patch.get_width()) for patch in panel.patches)
    assert spans == [pytest.approx((0, 35.9)), pytest.approx((323.4, 360))]
    upright = sorted(line.get_xdata()[0] for line in panel.lines if np.ptp(line.get_xdata()) == 0)
    assert upright == pytest.approx([0, 182.5, np.degrees(5.0), 360])
    assert {text.get_text() for text in panel.texts} == {
        "front dead centre",
        "hand-over",
        "dwell",
        "pause before begins",
    }


def test_a_table_without_curves_is_refused(tmp_path, frame):
    for empty in (frame[["phi [rad]"]], frame[["psi [rad]"]]):
        with pytest.raises(ValueError, match="phi"):
            figure.curves(empty, tmp_path / "a.png", "t")


def test_the_users_settings_do_not_change_a_figure_and_stay(tmp_path, frame):
    figure.curves(frame, tmp_path / "a.png", "t", MARKS)
    with matplotlib.rc_context({"axes.facecolor": "black", "font.size": 30}):
        figure.curves(frame, tmp_path / "b.png", "t", MARKS)
        assert matplotlib.rcParams["font.size"] == 30
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_matplotlib_is_imported_only_when_something_is_drawn():
    script = "import sys, loomopt.views.figure as f; print('matplotlib' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert run.stdout == "False\n"
