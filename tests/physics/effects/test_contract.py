"""What an effect declares every job keeps: told, limited, demanded, priced, drawn, written, proven. Made-up effects."""

import functools
import math

import made_up_effects as made_up
import numpy as np
import pytest
from contract import LOOSE, every_job, sampler, scene_of, solve

import loomopt as lo
from loomopt.interface import tables
from loomopt.interface.cli import app
from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import Node
from loomopt.physics.effects.kinds import Check, Demand, Inputs
from loomopt.physics.schema import Figure
from loomopt.studies.check import available_targets

UNIT = {"beatup": "N*m", "rapier": "N", "shedding": "N"}
"""Of the output's force."""
TIGHT = 0.997
"""Share of the optimum's value that a limit or a demand then leaves."""
KEYS = {"most": "made_up_peak", "high": "made_up_size"}


@pytest.fixture(autouse=True)
def plugins(monkeypatch):
    """Have another distribution bring the made-up effects."""
    monkeypatch.setattr(registry, "entry_points", made_up.points)


def tightened(job, key):
    """Return the scene whose check demands a little less than what the free optimum has, and that value, m."""
    value = TIGHT * solve(scene_of(job)).figures[KEYS[key]]
    return value, functools.partial(lambda v: scene_of(job, **{key: f"{v!r} m"}))


def worth_by_solving(scene_at, value, figure):
    """Return what loosening is worth by solving beside it on both sides, to fourth order."""
    h = 2e-5 * abs(value)
    at = [solve(scene_at(value + k * h)) for k in (-2, -1, 1, 2)]
    assert {item.status for item in at} == {"optimal"}
    low2, low, high, high2 = (item.figures[figure] for item in at)
    return (8 * (high - low) - (high2 - low2)) / (12 * h)


def priced(answer, name):
    """Return the figure that a binding limit moves, and by how much."""
    (price,) = [price for price in answer.binding if price.limit == name]
    ((figure, worth),) = price.worth.items()
    return figure, worth


@pytest.mark.few(2)
@every_job
def test_figures_are_told_of_today_and_of_an_answer(job):
    scene = scene_of(job)
    answer, check = solve(scene), scene.schema.effects["made_up_check"]
    assert (answer.status, answer.certificate.passed) == ("optimal", True)
    for result in (lo.evaluate(scene), answer):
        sampled = sampler(scene, result.design)
        pieces, u = sampled.grid(20000)
        pose = sampled.model.instant(systems.numpy(), sampled.given, sampled.node(pieces, u)).pose
        values = check.quantities["made_up_peak"](Inputs(systems.numpy(), sampled.given.values, {}, pose))
        assert result.figures["made_up_peak"] == pytest.approx(np.max(np.abs(values)), rel=1e-6)
        size = check.rows["made_up_size"](Inputs(systems.FLOAT, sampled.given.values, {}, None))
        assert result.figures["made_up_size"] == pytest.approx(size, rel=1e-14)


@every_job
@pytest.mark.parametrize("key", KEYS)
@pytest.mark.few(1)
def test_a_demand_binds_and_its_price_is_that_of_solving_again(job, key):
    value, scene_at = tightened(job, key)
    answer = solve(scene_at(value))
    assert (answer.status, answer.certificate.passed) == ("optimal", True)
    assert answer.figures[KEYS[key]] == pytest.approx(value, rel=1e-8)
    figure, worth = priced(answer, KEYS[key])
    assert abs(worth) == pytest.approx(abs(worth_by_solving(scene_at, value, figure)), rel=1e-4)


@every_job
@pytest.mark.parametrize("name", KEYS.values())
@pytest.mark.few(2)
def test_a_limit_on_its_figure_is_kept_as_a_demand_is(job, name):
    key = next(key for key in KEYS if KEYS[key] == name)
    value, scene_at = tightened(job, key)
    demanded = solve(scene_at(value))
    limited = solve(scene_of(job).set(f"limits.{name}.max", f"{value!r} m"))
    figure, worth = priced(demanded, name)
    assert priced(limited, name) == (figure, pytest.approx(worth, rel=1e-6))
    assert limited.figures[figure] == pytest.approx(demanded.figures[figure], rel=1e-8)
    broken = lo.evaluate(scene_of(job).set(f"limits.{name}.max", f"{value!r} m"), solve(scene_of(job)).design)
    assert [limit.name for limit in broken.limits if not limit.ok] == [name]


@pytest.mark.few(2)
@every_job
def test_a_demand_no_design_keeps_is_named(job):
    answer = solve(scene_of(job, high="-1 mm"))
    assert answer.status == "infeasible"
    assert any(phrase.startswith("made_up_size <=") for phrase in answer.clash)


def test_the_price_of_speed_is_told_where_a_made_up_load_alone_needs_it():
    still = lo.load("shedding").without_effect("inertia")
    assert not [price for price in solve(still).binding if price.limit == "speed"]

    def scene_at(speed):
        return still.update({"effects.made_up_output": {"c": "40", "a": "0"}, "operation.speed": f"{speed!r} rad/s"})

    speed = still.operation["speed"]
    figure, worth = priced(solve(scene_at(speed)), "speed")
    assert worth == pytest.approx(worth_by_solving(scene_at, speed, figure), rel=1e-4)


@every_job
def test_curves_have_columns_of_loads_and_quantities_with_both_sides_of_corners(job):
    scene = scene_of(job)
    frame = tables.curves(scene, {})
    output, drive = frame[f"made_up_output [{UNIT[job]}]"], frame["made_up_drive [N*m]"]
    phi = frame["phi [rad]"]
    for corner, sides in ((made_up.BEGINS, (False, True)), (made_up.ENDS, (True, False))):
        rows = np.flatnonzero(np.abs(phi - corner) < 1e-12)
        assert len(rows) == 2
        assert tuple(drive.iloc[rows] != 0.0) == sides
        jump = output.iloc[rows[1]] - output.iloc[rows[0]]
        assert jump == pytest.approx(0.3 if sides[1] else -0.3, rel=1e-9)
    assert np.max(np.abs(frame["made_up_peak [m]"])) == pytest.approx(
        lo.evaluate(scene).figures["made_up_peak"], rel=1e-3
    )


@every_job
def test_loads_are_in_the_force_and_in_the_torque(job):
    scene, without = scene_of(job), lo.load(job)
    both = [sampler(item) for item in (scene, without)]
    for phi in (0.4, 1.9, 4.0):
        nodes = [Node(phi, s.cycle.switch(s.cycle.place(phi)[0])) for s in both]
        at, before = (s.model.instant(systems.FLOAT, s.given, n) for s, n in zip(both, nodes, strict=True))
        on = made_up.BEGINS <= phi < made_up.ENDS
        drag = 0.02 * at.pose.velocity + 0.3 * on
        assert at.force - before.force == pytest.approx(drag, rel=1e-9)
        crank = 0.01 * at.pose.omega * on * math.sin(phi) ** 2
        assert at.crank_torque - before.crank_torque == pytest.approx(drag * at.pose.q1 + crank, rel=1e-9, abs=1e-12)


@every_job
def test_corners_part_the_cycle(job):
    starts = sampler(scene_of(job)).cycle.starts
    for corner in (made_up.BEGINS, made_up.ENDS):
        assert np.min(np.abs(np.mod(starts - corner + 1, 2 * math.pi) - 1)) < 1e-12


@every_job
def test_equations_have_a_term_and_a_reading(job, capsys):
    given = {"made_up_drive.b": "0.01", "made_up_output.c": "0.02", "made_up_output.a": "0.3"}
    given |= {f"made_up_check.{key}": value for key, value in LOOSE.items()}
    sets = [word for key, value in given.items() for word in ("--set", f"effects.{key}={value}")]
    assert app.run(["show", job, *sets, "--equations"]) == 0
    written = capsys.readouterr().out

    def after(title):
        return written.split(f"\n{title}\n    ")[1].split("\n")[0]

    inside, elsewhere = after("made_up_output").split(" for 1.1 <= phi <= 2.6, else ")
    velocity = {"beatup": "q'", "rapier": "S'", "shedding": "X'"}[job]
    assert sorted(elsewhere.split("*")) == sorted(["c", "omega", velocity])
    assert inside.split(" = ")[1].replace(elsewhere, "d") in ("a + d", "d + a")
    assert "_made_up_output" in after("balance")
    assert "_made_up_drive" in after("cam torque" if job == "shedding" else "crank torque")
    readings = written.split("\nmade_up_check\n")[1]
    for line in ("made_up_peak =", "made_up_peak <= most_max", "made_up_size =", "made_up_size <= high_max"):
        assert line in readings


@every_job
def test_proofs_read_its_quantity_and_its_demands(job):
    scene, answer = scene_of(job), solve(scene_of(job))
    proofs = lo.prove(scene, answer.design).proofs
    record = {proof.text: proof.status for proof in proofs if proof.text.startswith("made_up")}
    assert record.pop("made_up_peak as claimed") == "proven"
    assert sorted(record) == ["made_up_peak <= 1e+06 mm", "made_up_size <= 1e+06 mm"]
    assert set(record.values()) == {"proven"}
    for key, name in KEYS.items():
        value = TIGHT * answer.figures[name]
        proofs = lo.prove(scene_of(job, **{key: f"{value!r} m"}), answer.design).proofs
        (broken,) = [proof for proof in proofs if proof.limit == name]
        assert broken.status == "violated"
        assert broken.margin == pytest.approx(value - answer.figures[name], rel=1e-6)


EVENT = {
    "beatup": lambda pose: pose.q1,
    "rapier": lambda pose: pose.q1,
    "shedding": lambda pose: pose.lowered - 0.5,
}
"""What is zero at the event that is called in."""


@every_job
def test_an_event_that_an_effect_calls_in_is_there_and_parts_the_cycle(job):
    scene = lo.load(job).set("effects.made_up_event.jump", "0.5")
    sampled = sampler(scene)
    load = {"beatup": made_up.DEAD_CENTRE, "rapier": made_up.TURNS, "shedding": made_up.HALF_OPEN}[job]
    angles = load.corners(Inputs(systems.FLOAT, sampled.given.values, {}, None))
    events = angles[: {"beatup": 1, "shedding": 2}.get(job)]

    def at(angle, neighbour=0.0):
        node = Node(angle, sampled.cycle.switch(sampled.cycle.place(angle + neighbour)[0]))
        return sampled.model.instant(systems.FLOAT, sampled.given, node)

    assert all(abs(EVENT[job](at(angle).pose)) < 1e-12 for angle in events)
    for angle in angles:
        assert np.min(np.abs(np.mod(sampled.cycle.starts - angle + 1, 2 * math.pi) - 1)) < 1e-12
        jump = at(angle, 1e-7).terms()["made_up_event"] - at(angle, -1e-7).terms()["made_up_event"]
        assert abs(jump) == pytest.approx(0.5)
    answer = solve(scene)
    assert (answer.status, answer.certificate.passed) == ("optimal", True)


def test_corners_beside_an_event_that_lies_on_the_laws_own_are_there_too():
    made = {"effects.made_up_event.jump": "0.5", "targets.law.symmetric": "true", "targets.law.intervals": 8}
    scene = lo.load("shedding").update(made)
    answer = lo.solve(scene, "law", starts=1)
    assert (answer.status, answer.certificate.passed) == ("optimal", True)
    program = registry.find("shedding").program(scene.without_effect("warp_tension"), "law")
    sampled = Sampler(program.model, {**program.parameters, **program.starts[0]})
    for angle in (made_up.BEGINS, made_up.ENDS, sampled.given.values["half_open"][0]):
        assert np.sum(np.abs(sampled.cycle.starts - angle) < 1e-9) == 1


@pytest.mark.slow
@every_job
def test_numbers_of_an_effect_are_chosen_the_least_made_so_and_what_nothing_reads_kept(job):
    ranges = {"thickness": ("1 mm", "9 mm"), "spare": ("2 mm", "8 mm")}
    changes = {"effects.made_up_plate": dict(made_up.PLATE.examples[0])}
    changes |= {f"bounds.{name}": {"min": low, "max": high} for name, (low, high) in ranges.items()}
    scene = lo.load(job).update(changes)
    for target in available_targets(scene):
        answer = lo.solve(scene, target, starts=1)
        assert (answer.status, answer.certificate.passed) == ("optimal", True), target
        assert answer.design["spare"] == pytest.approx(0.007, rel=1e-9), target
        assert answer.figures["plate"] == answer.design["thickness"]
        assert answer.figures["plate"] >= 0.003 * (1 - 1e-9)
    assert solve(scene).figures["plate"] == pytest.approx(0.003, rel=1e-8)


@pytest.mark.slow
@every_job
def test_every_target_still_certifies_with_made_up_effects_on(job):
    scene = scene_of(job)
    assert available_targets(scene) == list(scene.schema.targets)
    for target in available_targets(scene)[1:]:
        answer = lo.solve(scene, target, starts=1)
        assert (answer.status, answer.certificate.passed) == ("optimal", True), target


@pytest.mark.parametrize(
    ("declared", "message"),
    [
        ({"figures": ()}, "made_up_peak is no figure"),
        ({"figures": (Figure("made_up_peak", "length", ""),)}, "made_up_peak has no least"),
        ({"demands": (Demand("made_up_peak", -1, 0.0),)}, "made_up_peak has no least"),
        ({"demands": (Demand("another", 1, 0.0),)}, "another is neither a quantity nor a row"),
        ({"demands": (Demand("made_up_size", 1, "low"),)}, "low is no key"),
        ({"least": "another"}, "another is neither a row nor a key of the table"),
    ],
)
def test_a_check_that_no_job_could_keep_is_refused_where_it_is_declared(declared, message):
    values = {
        name: getattr(made_up.BEATUP, name) for name in ("name", "summary", "table", "quantities", "rows", "figures")
    }
    with pytest.raises(ValueError, match=message):
        Check(**values | declared)
