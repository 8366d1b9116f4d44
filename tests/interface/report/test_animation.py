"""A mechanism that moves: as a page, as a GIF, or one message where ffmpeg is missing; along a front it morphs."""

import json
import re
import shutil

import pytest
from PIL import Image

import loomopt as lo
from loomopt.interface.cli.app import run
from loomopt.interface.report import animation
from loomopt.picture.motion import POSES


@pytest.fixture(scope="module")
def answer():
    return lo.solve("beatup-light", starts=1)


@pytest.fixture(scope="module")
def sweep():
    return lo.sweep("shedding", {"operation.speed": "590:600:10 rpm"})


def positions(html):
    return json.loads(re.search(r'<script type="application/json">(.*?)</script>', html, re.DOTALL)[1])


def test_a_gif_goes_round_once(answer, tmp_path):
    answer.animate(tmp_path / "a.gif")
    with Image.open(tmp_path / "a.gif") as picture:
        assert getattr(picture, "n_frames", 1) == POSES / animation.EVERY
        assert picture.info["loop"] == 0
        shown = []
        for place in (0, 10, 30):
            picture.seek(place)
            shown.append(picture.convert("RGB").tobytes())
    assert len(set(shown)) == 3
    assert (tmp_path / "a.gif").stat().st_size < 500_000


def test_the_same_animation_gives_the_same_bytes(answer, tmp_path):
    for name in ("a.html", "b.html"):
        answer.animate(tmp_path / name)
    assert (tmp_path / "a.html").read_bytes() == (tmp_path / "b.html").read_bytes()


def test_jupyter_shows_the_page_in_a_frame_of_its_own(answer):
    shown = answer.animate()
    html = shown._repr_html_()
    assert html.startswith("<iframe srcdoc=")
    assert "<script" not in html  # it is escaped into the frame's attribute
    assert shown.page in html.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", '"').replace(
        "&#x27;", "'"
    ).replace("&amp;", "&")


def test_a_study_is_one_picture_of_its_designs(sweep, tmp_path):
    sweep.animate(tmp_path / "a.html")
    data = positions((tmp_path / "a.html").read_text(encoding="utf-8"))
    assert len(data["poses"]["design"]) == len(data["told"]) == 2
    assert data["told"][0].startswith("operation.speed 590 rpm")
    assert len(list(animation.frames(sweep.animate()))) > POSES / animation.EVERY / 2


def test_without_ffmpeg_a_film_is_one_message(answer, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(lo.BadInput, match="ffmpeg"):
        answer.animate("a.mp4")
    assert run(["show", "beatup", "--animate", "a.mp4"]) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert output.err.count("\n") == 1
    assert run(["sweep", "shedding", "--over", "operation.speed=590:600:10 rpm", "--animate", "a.mp4"]) == 2
    assert list(tmp_path.iterdir()) == []


def test_a_film_is_what_ffmpeg_makes_of_the_frames(answer, tmp_path, monkeypatch):
    """A stand-in for ffmpeg writes down what it is given."""
    tool = tmp_path / "ffmpeg"
    tool.write_text('#!/bin/sh\nfor last; do :; done\nwc -c > "$last"\n')
    tool.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    answer.animate(tmp_path / "a.mp4")
    width, height = next(iter(animation.frames(answer.animate()))).size
    assert int((tmp_path / "a.mp4").read_text()) == 3 * width * height * POSES / animation.EVERY
    tool.write_text("#!/bin/sh\necho broken >&2\nexit 1\n")
    with pytest.raises(lo.BadInput, match="broken"):
        answer.animate(tmp_path / "b.mp4")
    assert not (tmp_path / "b.mp4").exists()


@pytest.mark.parametrize("words", [["show", "shedding"]])
def test_the_command_writes_it(words, tmp_path):
    assert run([*words, "--animate", str(tmp_path / "a.html"), "--animate", str(tmp_path / "b.gif")]) == 0
    assert positions((tmp_path / "a.html").read_text(encoding="utf-8"))["poses"]["design"]
    with Image.open(tmp_path / "b.gif") as picture:
        assert getattr(picture, "n_frames", 1) == POSES / animation.EVERY
    assert run([*words, "--animate", str(tmp_path / "a.txt")]) == 2


def test_what_cannot_be_drawn_does_not_move(tmp_path):
    scene = lo.load("shedding")
    bare = {**scene.document, "mechanism": {k: v for k, v in scene.document["mechanism"].items() if k != "arm"}}
    with pytest.raises(lo.BadInput, match="arm"):
        lo.evaluate(lo.scene(bare)).animate(tmp_path / "a.html")
