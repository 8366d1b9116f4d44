"""What a drawing is called: today's machine, the best design, the nearest one where limits are not held."""

import dataclasses
import json
from xml.etree import ElementTree

import pytest

import loomopt as lo
from loomopt.interface.cli.app import run
from loomopt.interface.files import outputs, svg
from loomopt.interface.text import notebook
from loomopt.solving.answer.solution import Finding

TOO_WIDE = {"limits.swing.min": "30 deg", "limits.swing.max": "31 deg"}


@pytest.fixture(scope="module")
def nearest():
    """Return an answer that no admissible design exists for."""
    return lo.solve(lo.load("beatup").update(TOO_WIDE), starts=1)


def title(text):
    """Return an SVG's title, which must stand on its sheet too."""
    root = ElementTree.fromstring(text)
    named = root.find("{*}title").text
    assert named in [item.text for item in root.iter("{http://www.w3.org/2000/svg}text")]
    return named


def test_todays_machine_is_drawn_as_such(tmp_path, capsys):
    scene = lo.load("beatup")
    assert run(["show", "beatup", "--figure", str(tmp_path / "a.svg")]) == 0
    assert run(["export", "beatup", "--out", str(tmp_path / "b.svg")]) == 0
    for name in ("a.svg", "b.svg"):
        assert (tmp_path / name).read_text(encoding="utf-8") == svg.render(outputs.drawing(scene, {}))
    assert title(svg.render(outputs.drawing(scene, {}))) == "beatup: today's machine"


def test_the_nearest_design_of_an_infeasible_target_is_drawn_as_such(nearest, tmp_path):
    assert nearest.status == "infeasible"
    outputs.answer(tmp_path / "out", nearest.result, nearest.scene)
    drawn = (tmp_path / "out/linkage.svg").read_text(encoding="utf-8")
    broken = {limit.name for limit in nearest.limits if not limit.ok}
    message, _, named = title(drawn).partition("; limits not held: ")
    assert message == "beatup: nearest design for balance"
    assert set(named.split(", ")) == broken != set()
    assert "nearest design" in notebook.html(nearest.result)


def test_a_design_that_breaks_limits_is_exported_as_such(nearest, tmp_path, capsys):
    (tmp_path / "answer.json").write_text(json.dumps(nearest.as_dict()))
    arguments = ["export", "beatup", "--design", str(tmp_path / "answer.json"), "--out", str(tmp_path / "a.svg")]
    assert run(arguments) == 0
    message = title((tmp_path / "a.svg").read_text(encoding="utf-8"))
    assert message.startswith("beatup: nearest design for balance; limits not held: ")
    assert run([*arguments, "--set", "limits.swing.max=30 deg"]) == 0
    message = title((tmp_path / "a.svg").read_text(encoding="utf-8"))
    assert message.startswith("beatup: a given design; limits not held: "), "in another scene it is not an answer"


def test_every_file_that_is_asked_for_is_written_or_a_second_one_refused(tmp_path, capsys):
    paths = [tmp_path / name for name in ("a.svg", "a.dxf", "a.csv", "b.svg", "b.png")]
    outs = [word for path in paths[:3] for word in ("--out", str(path))]
    assert run(["export", "beatup", *outs]) == 0
    assert run(["show", "beatup", "--figure", str(paths[3]), "--figure", str(paths[4])]) == 0
    assert [path.exists() for path in paths] == [True] * 5
    capsys.readouterr()
    assert run(["solve", "beatup", "--out", str(tmp_path / "c"), "--out", str(tmp_path / "d")]) == 2
    assert "given more than once" in capsys.readouterr().err
    assert not (tmp_path / "d").exists()


def test_todays_machine_is_called_so_wherever_it_is_evaluated():
    assert outputs.describe_design(lo.evaluate("beatup-light").result).text == "today's machine"
    assert outputs.describe_design(lo.evaluate("beatup-light", {"l1": 0.0305}).result).name.startswith("a given design")


@pytest.mark.parametrize(
    ("status", "message"),
    [
        ("optimal", "best design for balance"),
        ("uncertified", "uncertified design for balance"),
        ("interrupted", "best design for balance so far, interrupted"),
        ("failed", "no design for balance found, where the search ended"),
    ],
)
def test_an_answer_says_what_its_design_is(nearest, status, message):
    fixed = dataclasses.replace(nearest.result, status=status, limits=())
    assert outputs.describe_design(fixed).text == message
    broken = Finding("swing", 0.5, None, 0.4, ok=False)
    assert (
        outputs.describe_design(dataclasses.replace(fixed, limits=(broken,))).text
        == f"{message}; limits not held: swing"
    )
    rounding = broken._replace(rounding=True)
    assert outputs.describe_design(dataclasses.replace(fixed, limits=(rounding,))).text == message
