import subprocess
import sys

import matplotlib
import matplotlib.image
import numpy as np
import pandas as pd
import pytest

from loomopt.base.errors import BadInput
from loomopt.interface.figures import charts, figure
from loomopt.interface.files import svg
from loomopt.jobs.beatup import drawing as crank_rocker_drawing
from loomopt.picture import turn
from loomopt.picture.job_views import Marks, Span
from loomopt.picture.panels import single_panels

PAPER = {"l1": 0.031, "l2": 0.065, "l3": 0.155, "l4": 0.167}
MARKS: Marks = {"front dead centre": 1.15, "rear dead centre": 4.25, "pulse": Span(0.89, 1.41)}
MAGIC = {".png": b"\x89PNG", ".pdf": b"%PDF", ".svg": b"<"}


@pytest.fixture
def frame():
    phi = np.linspace(0, 2 * np.pi, 91)
    columns = {"phi [rad]": phi, "psi [rad]": 2.5 + 0.2 * np.cos(phi), "psi_1 [1]": -0.2 * np.sin(phi)}
    columns |= {"psi_2 [1]": -0.2 * np.cos(phi), "M_R [N*m]": 0 * phi, "M3 [N*m]": 700 * np.cos(phi)}
    return pd.DataFrame(columns | {"Md [N*m]": 90 * np.sin(2 * phi), "piece": 0 * phi})


def write_curves(frame, path, title):
    """Write the figure of a table of curves."""
    shown = turn.from_table(frame, MARKS, "deg")
    drawn = charts.draw(turn.charts(title, single_panels(tuple(frame.columns)), shown, None, "crank angle"))
    figure.save(drawn, path)


@pytest.mark.few(1)
@pytest.mark.parametrize("ending", figure.SUFFIXES)
def test_drawing_and_curves_are_written_in_the_format_asked_for(tmp_path, frame, ending):
    for name, write in (
        ("d", lambda path: figure.draw(crank_rocker_drawing.of(PAPER).drawing("A $title_ <&"), path)),
        ("c", lambda path: write_curves(frame, path, "A $title_ <&")),
    ):
        path, again = tmp_path / f"{name}{ending}", tmp_path / f"{name}2{ending}"
        write(path)
        write(again)
        assert path.read_bytes().startswith(MAGIC[ending])
        assert path.read_bytes() == again.read_bytes()


def test_a_drawing_as_svg_is_the_one_at_full_scale(tmp_path):
    drawn = crank_rocker_drawing.of(PAPER).drawing("t")
    figure.draw(drawn, tmp_path / "a.svg")
    assert (tmp_path / "a.svg").read_text(encoding="utf-8") == svg.render(drawn)


@pytest.mark.few(1)
@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_a_picture_has_the_same_size_for_any_machine(tmp_path, size):
    figure.draw(
        crank_rocker_drawing.of({name: size * value for name, value in PAPER.items()}).drawing("t"), tmp_path / "a.png"
    )
    image = matplotlib.image.imread(tmp_path / "a.png")
    assert max(image.shape[:2]) == pytest.approx(1417, abs=2)
    assert image[..., :3].min() < 0.3
    edges = np.concatenate([image[0], image[-1], image[:, 0], image[:, -1]])
    assert np.all(edges[:, :3] == 1.0)


def test_another_ending_is_bad_input(tmp_path):
    with pytest.raises(BadInput, match=r"\.png, \.pdf, \.svg"):
        figure.draw(crank_rocker_drawing.of(PAPER).drawing("t"), tmp_path / "a.jpg")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_the_users_settings_do_not_change_a_figure_and_stay(tmp_path, frame):
    write_curves(frame, tmp_path / "a.png", "t")
    with matplotlib.rc_context({"axes.facecolor": "black", "font.size": 30}):
        write_curves(frame, tmp_path / "b.png", "t")
        assert matplotlib.rcParams["font.size"] == 30
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_matplotlib_is_imported_only_when_something_is_drawn():
    script = "import sys, loomopt.interface.figures.figure as f; print('matplotlib' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert run.stdout == "False\n"
