"""The public functions as a notebook uses them."""

import dataclasses
import pickle

import numpy as np
import pytest

import loomopt as lo

SCENE = lo.load("beatup-light")


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
    assert answer.before.design["l1"] == 0.031


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
    cold, warm = lo.solve(scene), lo.solve(scene, near=answer)
    assert warm.status == cold.status == "optimal"
    assert warm.figures["M3_fdc"] == pytest.approx(cold.figures["M3_fdc"], rel=1e-9)
    for name, value in cold.design.items():
        assert warm.design[name] == pytest.approx(value, rel=1e-7, abs=1e-9)
    assert warm.solver["iterations"] < cold.solver["iterations"]


def test_progress_is_told(answer):
    iterations: list[int] = []
    starts: list[tuple[int, ...]] = []
    found = lo.solve(SCENE, starts=3, on_iteration=iterations.append, on_start=lambda *told: starts.append(told))
    assert starts == [(1, 3), (2, 3), (3, 3)]
    assert len(iterations) >= 3
    assert found.design == pytest.approx(answer.design, rel=1e-7, abs=1e-9)


def test_a_scene_from_tables_is_the_scene_from_the_file():
    assert lo.scene(SCENE.document).hash == SCENE.hash


def test_an_answer_travels_between_processes(answer):
    plain = dataclasses.replace(answer, point=None, scene=None)
    assert pickle.loads(pickle.dumps(plain)).as_dict() == answer.as_dict()
