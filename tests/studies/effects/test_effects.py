"""What each effect is worth: the table of the reference, the traps in it, and what is verified of leaving some out."""

import dataclasses
import json
import pickle
from concurrent.futures import ThreadPoolExecutor

import made_up_effects_of_a_reed as made_up
import pytest
from support import inch, slow, uncoiled

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.interface.study import effects as effects_text
from loomopt.solving import engine
from loomopt.studies.effects import study
from loomopt.studies.run import run
from loomopt.studies.run.rows import StudyTask

# The peak's column is of tests/reference/beatup.py at the reference's design, over 4 million angles. The rod's weight,
# inside the drive, is in it; M3, the design and the regrets are those of a rod without weight.
TABLE = {  # shift of M3 and of the peak, N·m; regret of M3, % of its natural size
    "inertia": (677.009, -77.201606, 13.804),
    "rocker_inertia": (54.59525, -6.640084, 7.114),
    "counterweight_inertia": (11.57419, -1.407698, 1.030),
    "gravity": (7.95174, -0.944246, 0.486),
    "rod_inertia": (0.0, -2.157494, 0.0),
    "bearing_friction": (-2.0, 0.392090, 0.0),
    "centrifugal": (0.0, 0.0, 0.0),
    "resistance": (-745.0, None, 0.0),
}
SCALES = {"M3_fdc": 734.985, "peak_torque": 93.850}


@pytest.fixture(scope="module")
def plan():
    return study.plan_effects(lo.load("beatup"))


@pytest.fixture(scope="module")
def rows(plan):
    return run.run(plan)


@pytest.fixture(scope="module")
def beatup(plan, rows):
    return effects_text.summarise_effects(plan, rows)


@pytest.fixture(scope="module")
def shedding():
    return lo.effects(uncoiled.scene("shedding"))


def row_of(study, name):
    return next(row for row in study.rows if row.effect == name)


def alike(study):
    """Return all that a study says but how long it took."""
    said = study.as_dict()
    for each in (said["reference"], *said["rows"], said["together"] or {}):
        each |= {"build_s": 0, "solve_s": 0}
    return json.dumps(said)


def test_the_reference_has_all_effects_on_that_combine(beatup):
    assert set(TABLE) <= set(beatup.reference.effects)
    assert beatup.reference.figures["M3_fdc"] == pytest.approx(-4.130151, abs=6e-7)
    assert beatup.reference.figures["peak_torque"] == pytest.approx(93.221830, abs=6e-7)
    assert beatup.reference.scales == pytest.approx(SCALES, abs=6e-4)
    assert beatup.reference.status == "optimal"


@pytest.mark.parametrize("name", TABLE)
def test_shift_and_regret_of_the_reference_table(beatup, name):
    row, (torque, peak, regret) = row_of(beatup, name), TABLE[name]
    assert row.shift["M3_fdc"] * beatup.reference.scales["M3_fdc"] == pytest.approx(torque, abs=6e-4)
    if peak is not None:
        assert row.shift["peak_torque"] * beatup.reference.scales["peak_torque"] == pytest.approx(peak, abs=6e-4)
    assert 100 * row.regret["M3_fdc"] == pytest.approx(regret, abs=6e-4)
    assert row.status == "optimal"
    assert row.excess == 0.0


@pytest.mark.parametrize("name", ["shaft_torsion", "speed_fluctuation"])
def test_an_effect_that_the_reference_leaves_off_changes_no_share(beatup, rows, name):
    """Shares are of the machine that is weighed: the same as with the effect in [available]."""
    found = effects_text.summarise_effects(study.plan_effects(lo.load("beatup").with_effect(name)), rows)
    assert name not in found.reference.effects
    assert found.reference.scales == pytest.approx(SCALES, abs=6e-4)
    assert alike(found) == alike(beatup)


@pytest.mark.slow
def test_an_effect_with_which_no_design_is_admissible_changes_no_size():
    """The coil of the packaged shedding: no design keeps its limits."""
    for scene in (lo.load("shedding"), lo.load("shedding").with_effect("coil")):
        plan = study.plan_effects(scene)
        rows = [plan.solved(task, None) for task in plan.batch([])]
        while not (course := study.EffectsCourse(plan, rows)).judge:
            rows += [plan.solved(task, None) for task in plan.batch(rows)]
        assert course.aside == {"coil"}
        assert course.judge.scales == pytest.approx({"K1": 102601.180602}, rel=1e-9)


def test_at_one_percent_two_effects_may_be_left_out_together(beatup):
    assert beatup.left_out == ("bearing_friction", "centrifugal")
    assert beatup.kept == tuple(name for name in beatup.reference.effects if name not in beatup.left_out)
    assert beatup.together.effect == "bearing_friction, centrifugal"
    assert beatup.together.may_go
    assert beatup.together.shift["peak_torque"] == pytest.approx(0.392090 / 93.850, rel=1e-4)


def test_regret_alone_is_a_trap(beatup):
    row = row_of(beatup, "resistance")
    assert max(row.regret.values()) < 1e-12
    assert row.excess == 0.0
    assert not row.may_go
    assert "resistance" in beatup.kept


@pytest.mark.parametrize(
    ("off", "regret"),
    [
        ((), 0.486),
        (("rod_inertia", "bearing_friction", "centrifugal"), 0.232),
        (("rod_inertia", "bearing_friction", "centrifugal", "counterweight_inertia"), 1.75),
    ],
)
def test_omissions_do_not_add_up(plan, rows, off, regret):
    course = study.EffectsCourse(plan, rows)
    gone = frozenset({"gravity", *off}) | course.base
    row = plan.solved(StudyTask(0, None, dict.fromkeys(gone, 0.0)), None)
    worth = course.judge.without("", plan.without(gone), row, 0.01)
    assert 100 * worth.regret["M3_fdc"] == pytest.approx(regret, abs=6e-3 if regret > 1 else 6e-4)


def test_what_is_absent_has_no_node(beatup):
    nodes = {row.effect: row.nodes for row in beatup.rows}
    assert all(nodes[name] < beatup.reference.nodes for name in TABLE if name != "centrifugal")
    assert nodes["centrifugal"] == beatup.reference.nodes, "figures only: no objective and no limit reads it"
    assert all(row.solve_s > 0.0 for row in beatup.rows if row.status == "optimal")


@pytest.mark.slow
def test_the_same_study_whoever_computes_it(shedding):
    with ThreadPoolExecutor(2) as threads:
        assert alike(lo.effects(uncoiled.scene("shedding"), executor=threads)) == alike(shedding)


def test_a_plan_in_another_process_is_the_same(plan, rows):
    again = pickle.loads(pickle.dumps(plan))
    assert again.key == plan.key
    assert again.solved(StudyTask(0, None, rows[3].place), None).design == rows[3].design
    assert again.batch(rows[:1]) == plan.batch(rows[:1])
    assert plan.batch(rows) == []


@pytest.mark.slow
def test_inches_change_units_and_nothing_else(shedding):
    found = lo.effects(uncoiled.scene(inch.scene("shedding")))
    assert found.left_out == shedding.left_out
    for row, other in zip(found.rows, shedding.rows, strict=True):
        assert row.regret == pytest.approx(other.regret, abs=1e-7)
        assert row.excess == pytest.approx(other.excess, abs=1e-7)
    regret = shedding.table().loc["damping", "K1 regret [N/m]"]
    assert regret == pytest.approx(102602.60942536 - 103143.06, rel=2e-2), "as each alone, roughly"
    assert found.table().loc["damping", "K1 regret [lbf/in]"] == pytest.approx(regret / 175.126835, rel=1e-6)
    assert found.table(si=True).loc["damping", "K1 regret [N/m]"] == pytest.approx(regret, rel=1e-6)


def test_what_may_go_one_by_one_but_not_together_comes_back_the_largest_first():
    found = lo.effects(made_up.scene(push=4.0, pull=5.0))
    for name, torque in (("push", 4.0), ("pull", 5.0)):
        assert row_of(found, name).shift["M3_fdc"] == pytest.approx(-torque / 734.985, rel=1e-5)
        assert row_of(found, name).may_go
    assert found.tolerance < 9.0 / 734.985, "not both"
    assert found.left_out == ("push",), "pull is worth more"
    assert found.kept == ("inertia", "resistance", "pull")
    assert (found.together.effect, found.together.may_go) == ("push", True)
    assert found.largest_omission.effect == "push"
    assert found.largest_omission.value == row_of(found, "push").most


@pytest.mark.slow
def test_an_effect_with_which_no_design_is_admissible_stays_out():
    found = lo.effects("shedding")
    assert "coil" not in [row.effect for row in found.rows]
    assert found.out["coil"].startswith("with it no design is admissible; limits that clash: ")
    assert "coil" not in (*found.kept, *found.left_out, *found.reference.effects)
    assert row_of(found, "inertia").regret["K1"] < -0.9, "a softer spring is no better one"
    assert row_of(found, "inertia").excess > 0.9
    assert not row_of(found, "inertia").may_go


@pytest.mark.slow
def test_a_question_of_geometry_needs_no_effect():
    found = lo.effects("rapier", "dwell")
    assert {"head_inertia", "tape_friction"} <= set(found.left_out)
    assert found.kept == ()
    assert found.command == "loomopt solve rapier --target dwell"


def test_a_variant_without_an_admissible_design_stays_as_a_row_with_its_reason():
    found = lo.effects(made_up.scene(), "retrofit")
    assert found.reference.status == "optimal"
    assert [row.status for row in found.rows] == ["infeasible"] * 2
    assert row_of(found, "inertia").why == "limits that clash: M3_fdc = 0 N*m"
    assert row_of(found, "inertia").regret == {"change": None}
    assert (found.left_out, found.together, found.largest_omission) == ((), None, None)


def test_more_speed_is_no_regret():
    found = lo.effects(uncoiled.scene("shedding"), "speed")
    assert row_of(found, "warp_tension").regret["speed"] > 0.0, "without it a slower machine is found"
    assert row_of(found, "damping").regret["speed"] < 0.0
    assert row_of(found, "inertia").status == "needed"
    assert row_of(found, "inertia").why == "target speed needs the effect inertia"


def test_what_another_effect_needs_goes_with_it_or_stays_with_it():
    found = lo.effects(made_up.scene(push=100, leaning=100))
    push, leaning = row_of(found, "push"), row_of(found, "leaning")
    assert push.why == "leaning is off with it"
    assert push.shift["M3_fdc"] == pytest.approx(0.0, abs=1e-12)
    assert leaning.shift["M3_fdc"] == pytest.approx(100 / 734.985, rel=1e-5)
    assert (push.may_go, leaning.may_go) == (True, False)
    assert found.left_out == (), "leaning must stay, and needs it"


@pytest.fixture
def refusing(monkeypatch):
    """Have solve refuse the made-up motor."""
    solve = engine.solve

    def solving(scene, *given, **options):
        if "motor" in scene.effects:
            raise BadInput("solve without the effect motor, evaluate with it", key="effects.motor")
        return solve(scene, *given, **options)

    monkeypatch.setattr(engine, "solve", solving)
    monkeypatch.setattr(study, "YIELDING", (made_up.Moving,))


@pytest.mark.parametrize(("torque", "may_go"), [(3.0, True), (30.0, False)])
def test_what_solve_does_not_take_is_measured_at_the_reference(refusing, torque, may_go):
    found = lo.effects(made_up.scene(motor=torque))
    row = row_of(found, "motor")
    assert row.status == "evaluated"
    assert row.shift["M3_fdc"] == pytest.approx(-torque / 734.985, rel=1e-5), "without minus with"
    assert row.regret["M3_fdc"] is None
    assert row.may_go is may_go
    assert ("motor" in found.left_out, found.judged) == (may_go, () if may_go else ("motor",))
    assert found.reference.effects == ("inertia", "resistance")
    assert "motor" not in found.kept


@pytest.mark.parametrize(
    ("motor", "left_out"), slow.after(1, [(6.0, ("push",)), (0.5, ("motor", "push")), (4.0, ("motor",))])
)
def test_what_solve_does_not_take_is_left_out_only_if_that_holds_together(refusing, motor, left_out):
    """1 % allows 7.35 N*m, and push takes 5; of two that may go by themselves only, the one worth more comes back."""
    torques = {"push": 5.0, "motor": motor}
    found = lo.effects(made_up.scene(**torques))
    assert [row_of(found, name).may_go for name in torques] == [True, True]
    assert found.left_out == left_out
    assert found.judged == (() if "motor" in left_out else ("motor",))
    assert found.together.shift["M3_fdc"] == pytest.approx(-sum(torques[n] for n in left_out) / 734.985, rel=1e-5)
    stays = sorted(set(torques) - set(left_out))
    assert (f"By itself {' '.join(stays)} may go, but not together" in found._repr_html_()) is bool(stays)


@pytest.mark.slow
def test_without_an_admissible_design_the_rows_say_so():
    found = lo.effects(lo.load("shedding-static").set("bounds.K1.max", "100 N/m"))
    assert found.reference.status == "infeasible"
    assert found.reference.scales == {}
    assert {row.status for row in found.rows} == {"infeasible"}
    assert (found.left_out, found.largest_omission) == ((), None)


@pytest.mark.parametrize("tolerance", [0.0, -0.01, float("nan"), float("inf")])
def test_a_tolerance_is_more_than_nothing(tolerance):
    with pytest.raises(BadInput, match="tolerance is out of range") as error:
        lo.effects("beatup", tolerance=tolerance)
    assert error.value.key == "tolerance"


def test_a_target_that_no_effect_serves_is_refused():
    with pytest.raises(BadInput, match="has no target drop"):
        lo.effects("beatup", "drop")
    scene = lo.load("beatup").without_effect("resistance")
    document = {**scene.document, "available": {}}
    with pytest.raises(BadInput, match="target pulse needs the effect resistance"):
        lo.effects(lo.scene(document), "pulse")


# As an object.


def test_it_says_what_it_is_and_shows_itself(beatup):
    assert repr(beatup).startswith("<EffectsStudy beatup, balance: at 1 % bearing_friction, centrifugal")
    page = beatup._repr_html_()
    assert "At 1 %, bearing_friction and centrifugal may be left out" in page
    assert "By itself speed_fluctuation may go, but not together with what else is left out." in page
    assert "Evaluate the design with speed_fluctuation, which solve does not take." in page
    assert "resistance, rod_inertia and gravity as good a design is found, but its figures are wrong" in page
    assert "solve" not in page.split("</thead>")[0], "times differ from run to run"
    with pytest.raises(TypeError, match="never changes"):
        beatup.rows[0].shift["M3_fdc"] = 0.0


def test_the_table_has_shares_and_units_and_says_where_it_comes_from(beatup):
    table = beatup.table()
    assert table.index.name == "without"
    assert table.loc["rocker_inertia", "M3_fdc shift [N*m]"] == pytest.approx(54.59525, abs=1e-5)
    assert table.loc["rocker_inertia", "M3_fdc regret [%]"] == pytest.approx(7.114, abs=1e-3)
    assert set(table.index[table["may go"]]) == {*beatup.left_out, "speed_fluctuation"}
    assert table.attrs["study"] == "effects"
    assert table.attrs["tolerance"] == "0.01"


@pytest.fixture(scope="module")
def kinematic():
    """What effects are worth for a target of the geometry alone, of which little is free."""
    held = ("l4", "l5", "l6", "l3p", "alpha", "C0x")
    return lo.effects(lo.load("rapier").update({f"bounds.{name}.free": False for name in held}))


def test_what_an_omitted_effect_takes_away_is_told_though_the_target_reads_none(kinematic):
    assert kinematic.left_out == ("head_inertia", "tape_friction", "tape_stretch")
    inertia, friction, stretch = kinematic.rows
    assert (inertia.lost, inertia.moved) == (("head_overrun",), ("tape_force", "peak_torque", "peak_power"))
    assert (friction.lost, friction.moved) == ((), ("tape_force", "peak_torque", "peak_power"))
    assert (stretch.lost, stretch.moved) == (("head_overrun",), ())
    assert kinematic.together.lost == ("tape_force", "peak_torque", "peak_power", "head_overrun")
    without = lo.evaluate(kinematic.scene.without_effect(*kinematic.scene.effects))
    assert all(without.figures[name] is None for name in kinematic.together.lost)
    reads = kinematic.reference.reads
    assert {"peak_acceleration", "stroke", "dwell_after"} <= set(reads)
    assert not set(kinematic.together.lost) & set(reads)
    (told,) = [line for line in effects_text.verdict(kinematic.result) if line.startswith("Of the other figures: ")]
    assert "without tape_stretch head_overrun is gone; " in told
    assert "without them all tape_force, peak_torque, peak_power and head_overrun are gone" in told
    assert told.endswith("Target stroke-dwell reads none of these figures.")
    table = kinematic.table()
    assert table.loc["head_inertia", "takes away"] == "head_overrun"
    assert table.loc["tape_friction", "changes"] == "tape_force, peak_torque, peak_power"
    told = kinematic.as_dict()["other_figures"]["head_inertia"]
    assert told == {"takes_away": ["head_overrun"], "changes": ["tape_force", "peak_torque", "peak_power"]}
    assert kinematic.as_dict()["reference"]["reads"] == list(reads)


def test_what_the_target_reads_and_an_effect_takes_away_is_told_as_such(kinematic):
    lost = dataclasses.replace(kinematic.rows[0], lost=("stroke", "tape_force"))
    (told,) = effects_text.omitted(dataclasses.replace(kinematic.result, rows=(lost,)))
    assert told.endswith("Target stroke-dwell reads stroke of them.")
    none = dataclasses.replace(lost, lost=(), moved=())
    assert effects_text.omitted(dataclasses.replace(kinematic.result, rows=(none,))) == []


def test_figures_of_an_effect_that_may_go_are_named_for_a_target_of_forces_too(beatup):
    centrifugal = next(row for row in beatup.rows if row.effect == "centrifugal")
    assert set(centrifugal.lost) == {"reed_centrifugal", "shaking_force"}
    assert any(
        "without centrifugal reed_centrifugal and shaking_force are gone" in line
        for line in effects_text.verdict(beatup.result)
    )
