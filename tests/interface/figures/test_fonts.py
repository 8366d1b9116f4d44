"""Titles in any script: written in a font that has it where there is one, and never a warning on the terminal."""

import sys
import warnings

import pytest

import loomopt as lo
from loomopt.interface.cli.app import run
from loomopt.interface.figures import figure
from loomopt.interface.files import outputs

CHINESE = "织机打纬机构"
FRAKTUR = "\U0001d51a"
"""A letter that the usual font has not; STIXGeneral has it, which comes with matplotlib too."""
QUICK = ((CHINESE, "png"), (FRAKTUR, "svg"))


def test_a_text_is_written_in_the_first_font_that_has_it():
    assert figure.families("Webstuhl, métier à tisser, ткацкий станок: φ ± 5°") == [figure.FONT]
    assert len(figure.families(f"a{FRAKTUR}")) == 2
    assert figure.families("") == [figure.FONT]


def test_what_no_font_has_takes_no_font_of_boxes():
    assert figure.BOXES not in figure.families("\U0010fffd" + CHINESE)
    assert figure._characters(__file__) == frozenset()


@pytest.mark.parametrize(
    ("title", "ending"),
    [
        pytest.param(title, ending, marks=[pytest.mark.slow] * ((title, ending) not in QUICK))
        for title in (CHINESE, FRAKTUR, "نول", "🧵", "\ue000")
        for ending in ("png", "svg", "pdf")
    ],
)
def test_a_title_in_any_script_is_drawn_without_a_warning(tmp_path, ending, title):
    scene = lo.load("beatup").set("problem.title", title)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        outputs.curves(tmp_path / f"curves.{ending}", scene, {})
        outputs.picture(tmp_path / f"linkage.{ending}", scene.set("problem.name", "织机"), {})
    assert (tmp_path / f"curves.{ending}").stat().st_size > 1000


@pytest.mark.slow
def test_the_command_says_nothing_of_fonts(tmp_path, capfd):
    assert run(["simulate", "beatup", "--set", f"problem.title={CHINESE}", "--out", str(tmp_path / "curves.png")]) == 0
    sys.stderr.flush()
    assert capfd.readouterr().err == f"Wrote {tmp_path / 'curves.png'}\n"
