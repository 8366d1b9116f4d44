"""The balance of the source's loom: best-known optima, checked by physics written out a second time."""

from dataclasses import replace

import pytest
from support import slow

import loomopt as lo
from loomopt.jobs import registry
from loomopt.model.objectives import Value
from loomopt.solving.nlp import exchange
from reference.beatup import DESIGN, Machine

BEST = {600: (-76.9811021, 82.3371385326), 745: (0.0, 88.6894134918), 800: (0.0, 96.8757999181)}
BEST[900] = (28.4966062, 122.3346355196)
"""M0 -> M3 at front dead centre, peak |Md|, N·m: four solvers, 100 random starts, 40 digits."""
FEW, STARTS = 15, 50
BINDING = {
    600: {"l1 >= 30 mm", "l4 <= 167 mm", "m4e >= 0 kg", "swing >= 22.9 deg", "theta >= -2.2 deg"},
    745: {"l1 >= 30 mm", "l4 <= 167 mm", "swing <= 23.4 deg", "theta <= 2.2 deg"},
    800: {"r4e <= 80 mm", "m4e <= 12.4 kg", "swing <= 23.4 deg", "theta <= 2.2 deg"},
    900: {"r4e <= 80 mm", "m4e <= 12.4 kg", "swing <= 23.4 deg", "mu_min >= 56.5 deg"},
}

resistances = pytest.mark.parametrize("M0", BEST)


def scene_of(M0):
    return lo.load("beatup").set("operation.M0", f"{M0} N*m")


@pytest.fixture(scope="module")
def answers():
    return {M0: lo.solve(scene_of(M0), starts=1) for M0 in BEST}


@resistances
def test_best_known_optimum_is_reached_and_certified(answers, M0):
    answer, (M3, peak) = answers[M0], BEST[M0]
    assert answer.status == "optimal"
    assert answer.certificate.passed
    assert answer.figures["M3_fdc"] == pytest.approx(M3, abs=1e-6, rel=1e-6)
    assert answer.figures["peak_torque"] == pytest.approx(peak, rel=1e-9)


@resistances
def test_independent_evaluation_confirms_optimum_and_limits(answers, M0):
    machine, (M3, peak) = Machine(scene_of(M0)), BEST[M0]
    figures = machine.figures(answers[M0].design, points=100_000)
    assert figures["M3_fdc"] == pytest.approx(M3, abs=1e-6, rel=1e-6)
    assert figures["peak_torque"] == pytest.approx(peak, rel=1e-6)
    assert machine.excess(answers[M0].design) <= 1e-9


@resistances
def test_figures_shown_are_those_of_the_design_shown(answers, M0):
    figures = Machine(scene_of(M0)).figures(answers[M0].design)
    for name in ("swing", "theta", "beta", "mu_min", "alpha_fdc", "J4", "r4", "pulse_rms"):
        assert answers[M0].figures[name] == pytest.approx(figures[name], rel=1e-11, abs=1e-11), name


@resistances
def test_limits_that_bind_are_as_many_as_the_design_can_choose(answers, M0):
    assert {price.text for price in answers[M0].binding} == BINDING[M0]
    assert answers[M0].certificate.minimum


@pytest.mark.few(2)
@resistances
@pytest.mark.parametrize("count", [FEW, pytest.param(STARTS, marks=pytest.mark.slow)])
def test_every_random_start_reaches_the_same_design(answers, M0, count, monkeypatch, record_property):
    """The two silent levels leave nothing to the start: designs agree to 1e-7 of each bound's width."""
    scene, wanted = scene_of(M0), answers[M0]
    program = registry.find("beatup").program(scene, "balance")
    drawn = exchange.starts(program, count + 1, seed=1)[1:]
    assert len(drawn) == count
    reached = []
    for start in drawn:
        monkeypatch.setattr(exchange, "starts", lambda *_, only=start: [only])
        result = lo.solve(scene, starts=1)
        if result.figures["peak_torque"] == pytest.approx(BEST[M0][1], rel=1e-7):
            reached.append(result)
    record_property("share of random starts that reach the best", len(reached) / count)
    assert len(reached) == count
    for result in reached:
        assert result.status == "optimal"
        for name in DESIGN:
            width = scene.bounds[name].max - scene.bounds[name].min
            assert result.design[name] == pytest.approx(wanted.design[name], rel=0, abs=1e-7 * width), name


@pytest.mark.slow
def test_many_starts_in_one_call_say_how_many_were_best():
    answer = lo.solve(scene_of(800), starts=STARTS, seed=3)
    assert answer.solver["starts"] == STARTS
    assert answer.solver["starts_at_best"] == STARTS
    assert answer.figures["peak_torque"] == pytest.approx(BEST[800][1], rel=1e-9)


def test_the_start_itself_may_be_the_optimum(answers):
    again = lo.solve(scene_of(745), warm_start=answers[745])
    assert again.status == "optimal"
    assert again.figures["peak_torque"] == pytest.approx(answers[745].figures["peak_torque"], rel=1e-11)


@resistances
def test_a_warm_start_from_a_neighbour_ends_where_a_cold_one_does(answers, M0):
    neighbour = lo.solve(scene_of(M0 + 30), starts=1)
    warm = lo.solve(scene_of(M0), warm_start=neighbour)
    assert warm.status == "optimal"
    assert warm.figures["peak_torque"] == pytest.approx(BEST[M0][1], rel=1e-9)
    for name in DESIGN:
        width = scene_of(M0).bounds[name].max - scene_of(M0).bounds[name].min
        assert warm.design[name] == pytest.approx(answers[M0].design[name], rel=0, abs=1e-7 * width), name


def test_light_cloth_is_told_that_balance_is_out_of_reach_and_what_stops_it(answers):
    message = answers[600].message
    assert "out of reach" in message
    assert "-76.98" in message
    for text in BINDING[600]:
        assert text in message
    assert "l2" not in message, "at the optimum l2 is 84.06 mm, within its limit"


def test_a_balanced_machine_is_called_balanced(answers):
    for M0 in (745, 800):
        assert answers[M0].message.startswith("Balanced")
        assert abs(answers[M0].figures["M3_fdc"]) <= 1e-9


@pytest.mark.parametrize("accuracy", [1e-11, 1e-4])
def test_accuracy_asked_for_is_accuracy_given(accuracy):
    answer = lo.solve(scene_of(745), accuracy=accuracy, starts=1)
    assert answer.status == "optimal"
    assert answer.certificate.violation <= accuracy
    assert answer.figures["peak_torque"] == pytest.approx(BEST[745][1], rel=max(1e-9, accuracy))


# A limit that settles all but the radius of a counterweight of no mass --------------------------------------------


@pytest.mark.few(1)
@pytest.mark.parametrize("pulse", slow.after(3, [295, 302.5, 320, 300, 305, 310, 315, 318]))
def test_a_pulse_that_settles_the_first_level_is_certified(pulse):
    scene = lo.load("beatup").set("limits.pulse_rms.max", f"{pulse} N*m")
    answer = lo.solve(scene, starts=1)
    assert answer.status == "optimal", answer.message
    assert answer.figures["pulse_rms"] == pytest.approx(pulse, rel=1e-9)
    assert Machine(scene).excess(answer.design) <= 1e-9
    price = next(price for price in answer.binding if price.limit == "pulse_rms")
    looser = lo.solve(scene.set("limits.pulse_rms.max", f"{pulse + 0.01} N*m"), starts=1)
    gained = abs(answer.figures["M3_fdc"]) - abs(looser.figures["M3_fdc"])
    assert gained / 0.01 == pytest.approx(price.worth["M3_fdc"], rel=1e-3)


def test_a_variable_of_the_task_may_come_first(monkeypatch):
    """The least m4e r4e² that keeps the reed torque: no table of the scene knows s."""
    scene = lo.load("beatup").set("operation.M0", "800 N*m")
    job = registry.find("beatup")
    program = job.program(scene, "torque")
    size = next(v.scale for v in program.variables if v.name == "s")
    changed = replace(program, objectives=(Value("s", "s", size), *program.objectives))
    monkeypatch.setattr(type(job), "program", lambda *_: changed)
    answer = lo.solve(scene, "torque", starts=1)
    assert answer.status == "optimal", answer.message
    assert answer.figures["M3_fdc"] == pytest.approx(8.0, rel=1e-9)
    assert answer.design["m4e"] * answer.design["r4e"] ** 2 < 0.02
    assert "Limits that stop s: " in answer.message


@pytest.mark.parametrize("effect", ["", "gravity"])
@pytest.mark.parametrize(("bound", "most"), [("r4e", "100 m"), ("r4e", "7 km"), ("m4e", "1e8 kg"), ("m4e", "3e4 kg")])
@pytest.mark.few(4)
def test_a_generous_bound_of_the_counterweight_spoils_no_answer(bound, most, effect):
    scene = lo.load("beatup").set(f"bounds.{bound}.max", most)
    scene = scene.with_effect(effect) if effect else scene
    answer, plain = (
        lo.solve(scene, starts=1),
        lo.solve(lo.load("beatup").with_effect(effect) if effect else lo.load("beatup"), starts=1),
    )
    assert answer.status == "optimal", answer.message
    assert abs(answer.figures["M3_fdc"]) <= abs(plain.figures["M3_fdc"]) + 1e-9
    assert answer.figures["peak_torque"] <= plain.figures["peak_torque"] * (1 + 1e-9), "more room is no loss"
