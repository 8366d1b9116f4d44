"""What a person reads: tables and sentences that fit the terminal and lose nothing."""

import dataclasses
import json
import re
import shlex

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import loomopt as lo
from loomopt.base.quantities import read
from loomopt.interface import answer_table, api
from loomopt.interface.text import answers, layout, scenes
from loomopt.jobs.registry import load
from loomopt.physics.effects import kinds
from loomopt.picture.table import TextTable, call, restore_spaces, unbroken
from loomopt.solving.answer.solution import Sentences, UnitFormatter

SCENE = load("beatup-light")
EFFECTS = kinds.of("loomopt.physics.effects.beatup")
WORDS = st.text(st.characters(codec="ascii", exclude_categories=["C", "Z"]), min_size=1, max_size=9)
CELLS = st.lists(WORDS, max_size=12).map(" ".join)
GRID = TextTable("", ("name", "", "what"), (("a", "12", "one two three four"), ("bb", "3", "five")), right=(1,))


@pytest.fixture(scope="module")
def answer():
    return api.solve(SCENE)


@pytest.fixture(scope="module")
def infeasible():
    return api.solve(SCENE, "retrofit")


def text(*parts, columns=80):
    return layout.render(parts, columns)


def row(shown, name):
    """Return the words of the line that begins with a name."""
    return next(line.split() for line in shown.splitlines() if line.startswith(f"{name} "))


def test_a_table_aligns_and_wraps_text_but_no_numbers():
    assert text(GRID, columns=None).splitlines() == [
        "name      what",
        "----------------------------",
        "a     12  one two three four",
        "bb     3  five",
    ]
    assert text(GRID, columns=24).splitlines() == [
        "name      what",
        "------------------------",
        "a     12  one two three",
        "          four",
        "bb     3  five",
    ]


def test_headings_stand_in_two_lines_on_the_rule():
    grid = TextTable("Title", ("phi\n[deg]", "plain"), (("1", "2"),), right=(0, 1))
    assert text(grid).splitlines() == ["Title", "  phi", "[deg]  plain", "------------", "    1      2"]


@given(st.lists(st.tuples(WORDS, CELLS, CELLS), max_size=5), st.integers(50, 120))
@settings(deadline=None, derandomize=True)
def test_a_table_fits_the_width_and_keeps_every_word(lines, columns):
    shown = text(TextTable("", ("name", "x", "y"), tuple(lines)), columns=columns)
    assert all(len(line) <= columns for line in shown.splitlines())
    assert sorted(shown.split()[4:]) == sorted(word for line in lines for cell in line for word in cell.split())


def test_a_title_that_is_wider_than_its_table_stands_on_one_line():
    grid = TextTable("Binding limits and their prices", ("limit", "by"), (("X0 <= 80 mm", "740 N/m"),))
    assert text(grid, columns=60).splitlines()[0] == grid.title


@given(CELLS, st.integers(20, 90))
@settings(deadline=None, derandomize=True)
def test_a_paragraph_fits_the_width_and_keeps_every_word(sentence, columns):
    shown = text(f"    {sentence}", columns=columns)
    assert all(len(line) <= columns for line in shown.splitlines())
    assert shown.split() == sentence.split()
    assert layout.render([sentence], None) == sentence


def test_a_joined_phrase_is_never_broken():
    phrases = [f"l{k} >= {k}00 mm" for k in range(1, 9)]
    lines = text("Limits: " + ", ".join(unbroken(phrase) for phrase in phrases), columns=40).splitlines()
    assert len(lines) > 2
    assert all(any(phrase in line for line in lines) for phrase in phrases)


@pytest.mark.parametrize("columns", [40, 60, 80, 120])
def test_a_call_of_the_shell_that_is_longer_than_the_screen_goes_on_in_the_next_line(columns):
    words = ["loomopt", "solve", "my loom.toml", "--set", "operation.speed=560 rpm", "--without", "bearing_friction"]
    words += ["--with", "counterweight_inertia", "--with", "rod_inertia", "--free", "J4"]
    shown = text(f"At 1 %, that may go: {call(shlex.join(words))}", columns=columns)
    assert all(len(line) <= columns for line in shown.splitlines())
    assert shlex.split(shown[shown.index("loomopt") :].replace("\\\n", "")) == words


def test_an_option_longer_than_the_screen_is_not_broken():
    words = [
        "loomopt",
        "solve",
        "x.toml",
        "--set",
        f"effects.resistance.table={'long/' * 12}pulse.csv",
        "--with",
        "coil",
    ]
    shown = text(f"That may go: {call(shlex.join(words))}", columns=40)
    assert shlex.split(shown[shown.index("loomopt") :].replace("\\\n", "")) == words


def test_the_width_is_the_terminals_and_none_in_a_pipe(monkeypatch, capsys):
    monkeypatch.delenv("COLUMNS", raising=False)
    assert layout.width() is None
    for given_columns, width in (("123", 123), ("7", 40)):
        monkeypatch.setenv("COLUMNS", given_columns)
        assert layout.width() == width


def test_an_optimum_shows_today_design_limits_prices_and_certificate(answer):
    shown = text(*answers.solution(answer.result, SCENE))
    assert row(shown, "l1") == ["l1", "31", "30", "mm", "30", "...", "35", "min"]
    assert row(shown, "M3_fdc")[-1] == "no", "balance is out of reach"
    assert row(shown, "mu_min") == ["mu_min", "57.0694", "63.8961", "deg", ">=", "56.5"]
    for price in answer.binding:
        assert price.text in shown
        assert price.reading in shown
    assert "reed_centrifugal" not in shown, "a figure the scene does not have"
    assert "Certificate passed: limits " in shown
    assert all(choice in shown.replace("\n", " ") for choice in answer.certificate.tie_breaks)
    assert max(map(len, shown.splitlines())) <= 80


def test_rounding_is_shown_as_zero_but_a_small_number_is_not():
    scene = load("beatup")
    shown = text(*answers.solution(api.solve(scene).result, scene))
    assert row(shown, "M3_fdc")[1:3] == ["10.0152", "0"]
    tiny = scene.set("effects.inertia.J4", "1e-10 kg*m^2")
    table = text(answer_table.text(api.evaluate(tiny).result, tiny, None, "today"))
    assert row(table, "J4")[1] == "1e-10"


def test_an_infeasible_target_shows_what_clashes_and_what_helps(infeasible):
    shown = text(*answers.solution(infeasible.result, SCENE))
    assert infeasible.status == "infeasible"
    assert "No admissible design exists" in shown
    assert all(limit in shown for limit in infeasible.clash)
    assert all(relaxation.text in shown for relaxation in infeasible.relaxation)
    assert "<- not held" in shown
    assert "Certificate" not in shown


def test_an_uncertified_answer_says_so_first_and_last(answer):
    certificate = dataclasses.replace(answer.certificate, passed=False, reasons=("no minimum",))
    doubtful = dataclasses.replace(
        answer.result, status="uncertified", sentences=Sentences("Not sure."), certificate=certificate
    )
    shown = text(*answers.solution(doubtful, SCENE))
    assert shown.startswith("beatup-light, balance: uncertified\nNot sure.")
    assert "Certificate NOT passed: no minimum" in shown


def test_starts_that_ended_elsewhere_are_told(answer):
    better, worse = dict(answer.optima[0][0]), dict(answer.optima[0][0]) | {"peak_torque": 99.0}
    report = dataclasses.replace(
        answer.result, optima=((better, 3), (worse, 2)), solver={**answer.solver, "starts": 5, "starts_at_best": 3}
    )
    shown = text(*answers.solution(report, SCENE), columns=None)
    assert "Starts: 3 of 5 reached the best. Other optima: " in shown
    assert "peak_torque 99 N*m (2)" in shown


def test_an_evaluated_design_stands_beside_today_and_names_what_it_breaks(answer):
    evaluation = api.evaluate(SCENE, {**answer.design, "l1": 0.02})
    shown = text(*answers.evaluation(evaluation.result, SCENE, api.evaluate(SCENE).result))
    assert shown.startswith("beatup-light: NOT admissible: l1")
    assert row(shown, "l1")[:3] == ["l1", "31", "20"]
    assert "all limits held" in text(*answers.evaluation(api.evaluate(SCENE).result, SCENE, None))


def test_a_scene_shows_every_number_with_its_unit():
    shown = text(*scenes.parts(SCENE))
    assert row(shown, "operation.speed") == ["operation.speed", "600", "rpm", "62.8318531", "rad/s"]
    assert row(shown, "limits.swing.min") == ["limits.swing.min", "22.9", "deg", "0.399680399", "rad"]
    assert row(shown, "effects.resistance.pulse")[1:3] == ["29.8", "deg"]
    assert all(effect in shown for effect in EFFECTS)
    assert all(figure in shown for figure in SCENE.schema.figures)
    assert max(map(len, shown.splitlines())) <= 80


@pytest.mark.parametrize("effect", sorted(set(EFFECTS) - set(SCENE.effects)))
def test_equations_are_short_and_hold_only_what_is_on(effect):
    off = text(*scenes.equations(SCENE), columns=None)
    on = text(*scenes.equations(SCENE.with_effect(effect)), columns=None)
    assert len(off) < 4000
    assert effect not in off
    assert f"\n{effect}\n" in f"\n{on}\n"
    assert "Md = M3*q'" in off


def test_curves_fit_the_width_and_show_both_sides_of_a_jump():
    scene = SCENE.with_effect("bearing_friction").with_effect("gravity").with_effect("rod_inertia")
    for columns in (80, 120):
        shown = text(*scenes.curves(scene, {}, columns), columns=columns)
        assert max(map(len, shown.splitlines())) <= columns
        assert all(name in shown for name in ("psi_2", "bearing_friction", "M3", "Md"))
    wide = text(*scenes.curves(scene, {}, None), columns=None)
    front = [line for line in wide.splitlines() if line.startswith(" 65.925 ")]
    assert len(front) == 2
    assert front[0] != front[1]
    assert "-0.0 " not in wide


@pytest.mark.few(1)
@pytest.mark.parametrize("name", ["beatup-light", "rapier", "shedding", "shedding-static"])
def test_the_design_to_retype_is_the_design_to_the_last_digit(name):
    second_answer = api.solve(name)
    shown = text(*answers.solution(second_answer.result, second_answer.scene))
    (line,) = re.findall(r"^to retype: (\{.*?\})", shown, re.MULTILINE | re.DOTALL)
    formatter, typed = UnitFormatter(second_answer.scene), json.loads(line)
    assert list(typed) == list(second_answer.design)
    back = {k: read(v, formatter.kind(k)) if isinstance(v, str) else v for k, v in typed.items()}
    assert back == second_answer.design
    assert api.evaluate(second_answer.scene, back, second_answer.target).admissible
    assert all(isinstance(v, str) == (formatter.unit(k) != "1") for k, v in typed.items())
    assert max(map(len, shown.splitlines())) <= 80
    assert (
        shown.index(f"\n{second_answer.table().index[-1]} ")
        < shown.index("to retype: ")
        < shown.index("Binding limits")
    )


def test_what_was_proven_is_told_in_a_few_lines_and_only_where_it_was_asked_for(answer):
    assert "Proven" not in text(*answers.solution(answer.result, SCENE))
    second_answer = api.solve(SCENE, prove=True)
    assert second_answer.proofs.passed
    shown = text(*answers.solution(second_answer.result, SCENE), columns=None)
    lines = shown[shown.index("Proven at every crank angle") :].splitlines()
    block = [lines[0], *(line for line in lines if line.startswith("    "))]
    boxes = sum(proof.boxes for proof in second_answer.proofs.proofs)
    assert block[0].endswith(f"up to 1e-08 of each quantity's largest magnitude, in {boxes} boxes:")
    assert [line.split(":")[0].strip() for line in block[1:]] == ["limits", "assembly", "peaks as claimed"]
    assert all(proof.summary in shown for proof in second_answer.proofs.proofs)
    assert "NOT proven" not in shown


def test_what_was_not_proven_is_told_beside_what_was(answer):
    proofs = api.prove(SCENE, {**answer.design, "l1": 0.02})
    assert not proofs.passed
    shown = text(*answers.proof_summary(proofs), columns=None)
    missed = [proof for proof in proofs.proofs if proof.status != "proven"]
    assert shown.splitlines()[-1] == "NOT proven: " + ", ".join(f"{item.text} ({item.status})" for item in missed)
    assert all(item.text not in shown.splitlines()[1] for item in missed)
    none = dataclasses.replace(proofs, proofs=tuple(missed))
    assert text(*answers.proof_summary(none)).startswith("NOT proven: ")


def test_the_proofs_stand_in_the_json_as_prove_prints_them():
    second_answer = api.solve(SCENE, prove=True)
    assert second_answer.as_dict()["proofs"] == api.prove(SCENE, second_answer).as_dict()["proofs"]
    assert "proofs" not in api.solve(SCENE).as_dict()


@pytest.mark.slow
def test_points_that_narrow_a_change_down_are_marked_and_counted_apart():
    from loomopt.interface import study_table

    front = lo.pareto("beatup", ("peak_torque", "m4e"), target="balance", points=5)
    parts = study_table.tables(front.study, front.solved)
    head, (grid,) = str(parts[0]), [part for part in parts if isinstance(part, TextTable)]
    marked = [line[0] for line in grid.lines if line[0].endswith(study_table.NARROWS)]
    assert marked
    assert len(grid.lines) - len(marked) <= 5
    assert f"{len(grid.lines) - len(marked)} points and {len(marked)} that locate" in head
    assert front.table()["narrows"].sum() == len(marked)
    assert '"narrows": true' in json.dumps(front.as_dict())


def test_an_evaluation_shows_value_and_limit_of_what_is_no_figure():
    scene = lo.load("shedding-static").set("operation.N_min", "50 N")
    *_, grid = (
        part for part in answers.evaluation(lo.evaluate(scene).result, scene, None) if not isinstance(part, str)
    )
    line = next(line for line in grid.lines if line[0] == "N_min")
    assert line[1:3] == ("148.236", "N")
    assert restore_spaces(line[3]) == ">= 50"
