"""The public functions as a notebook uses them."""

import dataclasses
import doctest
import inspect
import pickle
import pydoc
import re
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

import loomopt as lo
from loomopt.interface import api
from loomopt.interface.cli.app import run
from loomopt.scenes.packaged import problems
from loomopt.solving.answer import solution
from loomopt.solving.certificate.certificate import Draft, certify
from loomopt.solving.search import search

SCENE = lo.load("beatup-light")


def failing(*arguments):
    refused = dataclasses.replace(certify(*arguments), passed=False, reasons=("the moon is wrong",))
    return Draft(lambda cycle: refused)


@pytest.fixture(scope="module")
def answer():
    return lo.solve(SCENE, target="balance")


def test_the_public_names_are_listed_and_lead_somewhere():
    for name in lo.__all__:
        assert getattr(lo, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = lo.nonsense
    assert issubclass(lo.BadInput, ValueError)


def test_an_answer_says_what_was_found(answer):
    assert isinstance(answer, lo.Answer)
    assert isinstance(answer, lo.Evaluation)
    assert isinstance(answer.scene, lo.Scene)
    assert (answer.status, answer.certificate.passed, answer.admissible) == ("optimal", True, True)
    assert answer.design["l1"] == pytest.approx(0.03, rel=1e-9)
    assert answer.figures["M3_fdc"] == pytest.approx(-76.9811021, rel=1e-8)
    assert {price.limit for price in answer.binding} >= {"l1", "l4"}
    assert answer.table().loc["l1", "design"] == pytest.approx(30, rel=1e-9)
    assert answer.today.design["l1"] == 0.031


def test_curves_are_those_of_the_design(answer):
    curves = answer.curves()
    assert curves.equals(lo.simulate(SCENE, answer.design))
    assert not curves.equals(lo.simulate(SCENE))
    front = np.argmin(np.abs(curves["phi [rad]"] - answer.figures["beta"]))
    assert curves["M3 [N*m]"][front] == pytest.approx(answer.figures["M3_fdc"], rel=1e-9)
    assert curves["Md [N*m]"].abs().max() <= answer.figures["peak_torque"] * (1 + 1e-8)


@pytest.mark.parametrize("name", ["design", "status", "figures", "scene"])
def test_an_answer_cannot_be_changed(answer, name):
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(answer, name, None)


@pytest.mark.parametrize("name", ["name", "operation", "bounds"])
def test_a_scene_cannot_be_changed(name):
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(SCENE, name, None)


def test_changing_a_scene_makes_another_and_leaves_it():
    before = (SCENE.hash, dict(SCENE.operation), list(SCENE.effects), dict(SCENE.bounds))
    others = [
        SCENE.set("operation.M0", "900 N*m"),
        SCENE.with_effect("gravity"),
        SCENE.without_effect("resistance"),
        SCENE.set("bounds.l1.max", "33 mm"),
    ]
    assert len({SCENE.hash, *(other.hash for other in others)}) == 5
    assert (SCENE.hash, dict(SCENE.operation), list(SCENE.effects), dict(SCENE.bounds)) == before


def test_todays_machine_is_evaluated_without_a_design_and_what_is_not_named_stays():
    today = lo.evaluate(SCENE)
    assert today.design == {name: SCENE.mechanism[name] for name in today.design}
    assert lo.evaluate(SCENE, {}).figures == today.figures
    other = lo.evaluate(SCENE, {"l1": 0.03})
    assert other.design == {**today.design, "l1": 0.03}
    assert other.figures["swing"] < today.figures["swing"]


def test_an_answers_design_evaluates_to_its_figures(answer):
    again = lo.evaluate(SCENE, answer.design)
    assert again.admissible
    for name, value in answer.figures.items():
        assert again.figures[name] == (None if value is None else pytest.approx(value, rel=1e-12, abs=1e-9))


@pytest.mark.parametrize("design", [{"l9": 1.0}, {"l1": "30 kg"}, {"l1": 0.0}, {"l4": 0.5}, {"m4e": -1.0}, "l1"])
@pytest.mark.parametrize("function", ["evaluate", "simulate"])
def test_a_bad_design_is_bad_input(function, design):
    with pytest.raises(lo.BadInput):
        getattr(lo, function)(SCENE, design)


@pytest.mark.parametrize(
    "arguments",
    [
        {"target": "ballance"},
        {"accuracy": 0.0},
        {"accuracy": 2.0},
        {"accuracy": float("nan")},
        {"starts": 0},
    ],
)
def test_bad_settings_are_bad_input(arguments):
    with pytest.raises(lo.BadInput):
        lo.solve(SCENE, **arguments)


def test_a_neighbours_answer_is_a_warm_start_to_the_same_design(answer):
    scene = SCENE.set("operation.M0", "610 N*m")
    cold, warm = lo.solve(scene), lo.solve(scene, warm_start=answer)
    assert warm.status == cold.status == "optimal"
    assert warm.figures["M3_fdc"] == pytest.approx(cold.figures["M3_fdc"], rel=1e-9)
    for name, value in cold.design.items():
        assert warm.design[name] == pytest.approx(value, rel=1e-7, abs=1e-9)
    assert warm.solver["iterations"] < cold.solver["iterations"]


def test_progress_is_told(answer):
    iterations: list[int] = []
    starts: list[tuple[int, ...]] = []
    second_answer = lo.solve(
        SCENE, starts=3, on_iteration=iterations.append, on_start=lambda *report: starts.append(report)
    )
    assert starts == [(1, 3), (2, 3), (3, 3)]
    assert len(iterations) >= 3
    assert second_answer.design == pytest.approx(answer.design, rel=1e-7, abs=1e-9)


def test_a_scene_from_tables_is_the_scene_from_the_file():
    assert lo.scene(SCENE.document).hash == SCENE.hash


def test_an_answer_travels_between_processes(answer):
    plain = lo.Answer(dataclasses.replace(answer.result, point=None), answer.target)
    assert pickle.loads(pickle.dumps(plain)).as_dict() == answer.as_dict()


PUBLIC = {
    *("Answer", "BadInput", "Budget", "StudyTable", "EffectsStudy", "Evaluation", "Proofs", "Scene", "ToleranceStudy"),
    "AccuracyStudy",
    *("accuracy", "budget", "compare", "new", "problems", "schema", "sensitivity", "SensitivityStudy"),
    *("effects", "evaluate", "load", "pareto", "prove", "scene", "simulate", "solve", "sweep", "tolerance"),
}
"""What scripts rely on: a name more is an entry of the changelog, a name less one of "changes the interface"."""
METHODS = {
    "Answer": {
        *(
            "admissible",
            "alternative",
            "named_target",
            "animate",
            "as_dict",
            "asked",
            "before",
            "binding",
            "budget",
            "certificate",
            "clash",
            "curves",
            "design",
            "draw",
        ),
        *(
            "effects",
            "evaluate",
            "explanation",
            "export",
            "figures",
            "global_bound",
            "limits",
            "message",
            "optima",
            "plot",
            "plot_forces",
        ),
        *(
            "point",
            "problem",
            "proofs",
            "prove",
            "reached",
            "relaxation",
            "scene",
            "sentences",
            "simulate",
            "solver",
            "sought",
            "task_name",
        ),
        *(
            "beside",
            "outcome",
            "status",
            "table",
            "target",
            "terms",
            "time",
            "to_frame",
            "evaluate_today",
            "today",
            "units",
        ),
        *(
            "report",
            "result",
            "robust",
            "rounded",
            "undefined",
            "members",
            "change",
            "worse",
            "bind_together",
            "design_is",
        ),
    },
    "Scene": {
        *("active", "bounds", "call", "called", "change", "document", "effects", "equations", "free", "full", "given"),
        *("effect_table", "job", "jobs", "limits", "mechanism", "name", "operation", "origin", "paths", "schema"),
        *("set", "show"),
        *("shown_in", "source", "table", "tables", "targets", "title", "unit_for", "units", "update", "with_effect"),
        *("hash", "without_effect", "without_limit"),
    },
}


def test_the_public_names_are_these():
    assert set(lo.__all__) == PUBLIC
    answer = lo.solve("beatup-light", starts=1)
    for name, thing in (("Answer", answer), ("Scene", answer.scene)):
        assert {item for item in dir(thing) if not item.startswith("_")} == METHODS[name]


LISTED = "import sys, loomopt; print(*dir(loomopt)); print(*(n for n in sys.modules if n.startswith('loomopt.')))"


def test_an_editor_completes_the_public_names_and_nothing_is_imported_for_it():
    done = subprocess.run([sys.executable, "-c", LISTED], capture_output=True, text=True, check=True)
    names, modules = done.stdout.split("\n")[:2]
    assert set(names.split()) == {*lo.__all__, "__version__"}
    assert modules == "loomopt.base", "which holds the version"


def test_help_shows_every_public_function_with_its_documentation():
    text = pydoc.plain(pydoc.render_doc(lo))
    for name in lo.__all__:
        assert name in text
        if inspect.isfunction(getattr(lo, name)):
            assert f"{name}(" in text
            assert inspect.getdoc(getattr(lo, name)).splitlines()[0] in text


@pytest.mark.parametrize("given", [str, lambda path: path], ids=["text", "path"])
def test_a_scene_may_be_given_by_its_path(tmp_path, answer, given):
    path = tmp_path / "my.toml"
    path.write_text(problems()["beatup-light"].read_text())
    assert lo.solve(given(path)).design == answer.design
    assert lo.evaluate(given(path)).figures == lo.evaluate(SCENE).figures
    assert lo.simulate(given(path), answer).equals(answer.curves())
    assert lo.prove(given(path), answer) == answer.prove()


def test_a_packaged_name_does_as_well_and_a_wrong_one_is_bad_input(answer):
    assert lo.solve("beatup-light").design == answer.design
    for function in (lo.solve, lo.evaluate, lo.simulate, lo.prove):
        with pytest.raises(lo.BadInput, match="beatup-lite"):
            function("beatup-lite")


def test_an_answer_stands_for_its_design_in_another_scene(answer):
    heavy = lo.load("beatup-heavy").with_effect("gravity")
    assert lo.evaluate(heavy, answer).figures == lo.evaluate(heavy, answer.design).figures
    assert lo.evaluate(heavy, answer).figures != answer.figures
    assert lo.simulate(heavy, answer).equals(lo.simulate(heavy, answer.design))
    assert lo.prove(heavy, answer) == lo.prove(heavy, answer.design)
    assert lo.evaluate(heavy, lo.evaluate(SCENE, answer)).figures == lo.evaluate(heavy, answer).figures


def test_an_answer_of_another_job_stands_for_nothing():
    static = lo.solve("shedding-static")
    for function in (lo.evaluate, lo.simulate, lo.prove):
        with pytest.raises(lo.BadInput, match="of job shedding, the scene of job beatup"):
            function(SCENE, static)


def test_an_answer_is_evaluated_simulated_and_proven_in_its_own_scene_for_its_own_target():
    scene = lo.load("shedding").with_effect("dry_friction").set("operation.speed", "400 rpm")
    answer = lo.solve(scene, "speed")
    again = answer.evaluate()
    assert answer.status == "optimal"
    assert (again.admissible, again.effects, again.limits) == (True, answer.effects, answer.limits)
    assert {n: v for n, v in again.figures.items() if v is not None} == pytest.approx(
        {n: v for n, v in answer.figures.items() if v is not None}, rel=1e-12, abs=1e-9
    )
    assert not lo.evaluate(scene, answer).admissible, "today's speed is a limit of the default target"
    assert lo.evaluate(scene, answer, "speed").limits == again.limits
    curves = answer.simulate()
    assert curves.equals(answer.curves())
    assert "dry_friction [N]" in curves
    assert (curves.attrs["target"], curves.attrs["effects"]) == ("speed", ", ".join(answer.effects))
    assert len(answer.simulate(accuracy=1e-3)) < len(curves)
    assert answer.prove().target == "speed"
    assert answer.prove(slack=1e-7).passed


def test_no_message_speaks_of_the_command_line_to_python():
    no_design: Any = [0.03]
    calls = [
        lambda: lo.solve(SCENE, "ballance"),
        lambda: lo.solve(SCENE, accuracy=1.0),
        lambda: lo.solve(SCENE, starts=0),
        lambda: lo.prove(SCENE, slack=1.0),
        lambda: lo.prove(SCENE, target="ballance"),
        lambda: lo.evaluate(SCENE, None, "ballance"),
        lambda: lo.simulate(SCENE, None, "ballance"),
        lambda: lo.simulate(SCENE, accuracy=2.0),
        lambda: lo.evaluate(SCENE, no_design),
        lambda: lo.evaluate(SCENE, {"l9": 1.0}),
        lambda: SCENE.set("limits.reed_centrifugal.max", "1 N"),
        lambda: SCENE.set("operation.M0", 3),
        lambda: lo.scene({"problem": {"job": "beatup"}}),
        lambda: lo.load("shedding").set("mechanism.law", "spline"),
        lambda: SCENE.free(["swing"]),
    ]
    for call in calls:
        with pytest.raises(lo.BadInput) as caught:
            call()
        assert "--" not in str(caught.value)
        assert "loomopt solve" not in str(caught.value)


def test_no_answer_speaks_of_the_command_line_to_python(monkeypatch):
    assert not [text for text in solution.ADVICE.values() if "--" in text]
    monkeypatch.setattr(search, "draft_certificate", failing)
    assert "--" not in lo.solve(SCENE).message
    law = lo.solve(lo.load("shedding").set("targets.law.intervals", 8), "law")
    assert "--" not in law._repr_html_().replace("-->", "").replace("<!--", "")


def test_each_step_is_told_before_it():
    steps: list[str] = []
    lo.solve(SCENE, starts=3, prove=True, on_step=steps.append)
    texts = [step for step in steps if "equations" not in step]
    assert texts == ["building the balance", *(f"start {k} of 3" for k in (1, 2, 3)), "certifying", "proving"]


def test_what_is_looked_for_where_nothing_is_admissible_is_told_one_by_one():
    steps: list[str] = []
    assert lo.solve(SCENE, "retrofit", on_step=steps.append).status == "infeasible"
    looked = [step for step in steps if re.match(r"looking for the least relaxation \d", step)]
    places = [tuple(map(int, step.split(":")[0].split()[-3::2])) for step in looked]
    assert places == sorted(places)
    assert places[0][0] == 1
    assert len({of for _, of in places}) == 1
    assert 1 < places[-1][0] <= places[-1][1]


@pytest.mark.parametrize("name", ["beatup", "rapier", "shedding"])
def test_a_scene_has_the_equations_that_show_prints(name, capsys):
    assert run(["show", name, "--equations"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    equations = lo.load(name).equations()
    assert all(" ".join(item.text.split()) in printed and item.name in printed for item in equations)
    assert all(item.latex and item._repr_latex_() == rf"$\displaystyle {item.latex}$" for item in equations)


def test_an_effect_is_in_the_equations_while_it_is_on():
    on = SCENE.with_effect("gravity")
    off = on.without_effect("gravity")
    assert any(
        "M_gravity" in equation.text and "M_{\\mathrm{gravity}}" in equation.latex for equation in on.equations()
    )
    assert not any("gravity" in equation.text + equation.latex + equation.name for equation in off.equations())
    assert off.equations() == SCENE.equations()


EQUATED = "import sys, loomopt as lo; s = lo.load('beatup'); a = 'sympy' in sys.modules; s.equations(); print(a)"


@pytest.mark.slow
def test_sympy_waits_until_equations_are_asked_for():
    done = subprocess.run([sys.executable, "-c", EQUATED], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


SLOW = ("accuracy", "effects", "pareto", "sensitivity")
"""Functions whose example takes seconds."""
QUICK = sorted(set(api.__all__) - {"Answer", "Evaluation", "Scene", "scene", *SLOW})


@pytest.mark.parametrize("name", [*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW)])
def test_public_functions_have_examples_that_run(name):
    function = getattr(api, name)
    (example,) = doctest.DocTestFinder(recurse=False).find(function, name, module=api, globs=dict(vars(api)))
    assert example.examples
    assert doctest.DocTestRunner().run(example).failed == 0
