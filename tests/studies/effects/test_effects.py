"""Impact of effects: the reference table, its traps, and the verification of effects left out together."""

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
TABLE = {  # shift of M3 and of the peak, N·m; regret of M3, % of its scale
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


def row_of(result, name):
    return next(row for row in result.rows if row.effect == name)


def without_times(result):
    """JSON text of a result, with all times set to 0."""
    data = result.as_dict()
    for part in (data["reference"], *data["rows"], data["together"] or {}):
        part |= {"build_s": 0, "solve_s": 0}
    return json.dumps(data)


@pytest.mark.slow
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
    """Shares are of the reference machine: the same as with the effect in [available]."""
    result = effects_text.summarise_effects(study.plan_effects(lo.load("beatup").with_effect(name)), rows)
    assert name not in result.reference.effects
    assert result.reference.scales == pytest.approx(SCALES, abs=6e-4)
    assert without_times(result) == without_times(beatup)


@pytest.mark.slow
def test_an_effect_with_which_no_design_is_admissible_changes_no_size():
    """No design satisfies the limits with the coil of the packaged shedding."""
    for scene in (lo.load("shedding"), lo.load("shedding").with_effect("coil")):
        plan = study.plan_effects(scene)
        rows = [plan.solved(task, None) for task in plan.batch([])]
        while not (course := study.EffectsCourse(plan, rows)).reference_design:
            rows += [plan.solved(task, None) for task in plan.batch(rows)]
        assert course.inadmissible == {"coil"}
        assert course.reference_design.scales == pytest.approx({"K1": 102601.180602}, rel=1e-9)


def test_at_one_percent_two_effects_may_be_left_out_together(beatup):
    assert beatup.left_out == ("bearing_friction", "centrifugal")
    assert beatup.kept == tuple(name for name in beatup.reference.effects if name not in beatup.left_out)
    assert beatup.together.effect == "bearing_friction, centrifugal"
    assert beatup.together.may_go
    assert beatup.together.shift["peak_torque"] == pytest.approx(0.392090 / 93.850, rel=1e-4)


def test_a_regret_of_zero_does_not_let_an_effect_go(beatup):
    row = row_of(beatup, "resistance")
    assert max(row.regret.values()) < 1e-12
    assert row.excess == 0.0
    assert not row.may_go
    assert "resistance" in beatup.kept


@pytest.mark.few(1)
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
    omitted = frozenset({"gravity", *off}) | course.base
    row = plan.solved(StudyTask(0, None, dict.fromkeys(omitted, 0.0)), None)
    impact = course.reference_design.measure_omission("", plan.without(omitted), row, 0.01)
    assert 100 * impact.regret["M3_fdc"] == pytest.approx(regret, abs=6e-3 if regret > 1 else 6e-4)


def test_an_absent_effect_adds_no_node_to_the_graph(beatup):
    nodes = {row.effect: row.nodes for row in beatup.rows}
    assert all(nodes[name] < beatup.reference.nodes for name in TABLE if name != "centrifugal")
    assert nodes["centrifugal"] == beatup.reference.nodes, "figures only: no objective and no limit reads it"
    assert all(row.solve_s > 0.0 for row in beatup.rows if row.status == "optimal")


@pytest.mark.slow
def test_the_same_result_with_and_without_an_executor(shedding):
    with ThreadPoolExecutor(2) as threads:
        assert without_times(lo.effects(uncoiled.scene("shedding"), executor=threads)) == without_times(shedding)


def test_a_plan_in_another_process_is_the_same(plan, rows):
    again = pickle.loads(pickle.dumps(plan))
    assert again.key == plan.key
    assert again.solved(StudyTask(0, None, rows[3].place), None).design == rows[3].design
    assert again.batch(rows[:1]) == plan.batch(rows[:1])
    assert plan.batch(rows) == []


@pytest.mark.slow
def test_inches_change_units_and_nothing_else(shedding):
    result = lo.effects(uncoiled.scene(inch.scene("shedding")))
    assert result.left_out == shedding.left_out
    for row, metric in zip(result.rows, shedding.rows, strict=True):
        assert row.regret == pytest.approx(metric.regret, abs=1e-7)
        assert row.excess == pytest.approx(metric.excess, abs=1e-7)
    regret = shedding.table().loc["damping", "K1 regret [N/m]"]
    assert regret == pytest.approx(102602.60942536 - 103143.06, rel=2e-2), "roughly as solved separately"
    assert result.table().loc["damping", "K1 regret [lbf/in]"] == pytest.approx(regret / 175.126835, rel=1e-6)
    assert result.table(si=True).loc["damping", "K1 regret [N/m]"] == pytest.approx(regret, rel=1e-6)


@pytest.mark.slow
def test_of_effects_that_may_go_only_separately_the_largest_comes_back_first():
    result = lo.effects(made_up.scene(push=4.0, pull=5.0))
    for name, torque in (("push", 4.0), ("pull", 5.0)):
        assert row_of(result, name).shift["M3_fdc"] == pytest.approx(-torque / 734.985, rel=1e-5)
        assert row_of(result, name).may_go
    assert result.tolerance < 9.0 / 734.985, "not both"
    assert result.left_out == ("push",), "pull is worth more"
    assert result.kept == ("inertia", "resistance", "pull")
    assert (result.together.effect, result.together.may_go) == ("push", True)
    assert result.largest_omission.effect == "push"
    assert result.largest_omission.value == row_of(result, "push").largest_share


@pytest.mark.slow
def test_an_effect_with_which_no_design_is_admissible_stays_out():
    result = lo.effects("shedding")
    assert "coil" not in [row.effect for row in result.rows]
    assert result.out["coil"].startswith("with it no design is admissible; limits that clash: ")
    assert "coil" not in (*result.kept, *result.left_out, *result.reference.effects)
    assert row_of(result, "inertia").regret["K1"] < -0.9, "a softer spring is no better one"
    assert row_of(result, "inertia").excess > 0.9
    assert not row_of(result, "inertia").may_go


@pytest.mark.slow
def test_a_target_of_geometry_needs_no_effect():
    result = lo.effects("rapier", "dwell")
    assert {"head_inertia", "tape_friction"} <= set(result.left_out)
    assert result.kept == ()
    assert result.command == "loomopt solve rapier --target dwell"


@pytest.mark.slow
def test_a_variant_without_an_admissible_design_stays_as_a_row_with_its_reason():
    result = lo.effects(made_up.scene(), "retrofit")
    assert result.reference.status == "optimal"
    assert [row.status for row in result.rows] == ["infeasible"] * 2
    assert row_of(result, "inertia").why == "limits that clash: M3_fdc = 0 N*m"
    assert row_of(result, "inertia").regret == {"change": None}
    assert (result.left_out, result.together, result.largest_omission) == ((), None, None)


@pytest.mark.slow
def test_more_speed_is_no_regret():
    result = lo.effects(uncoiled.scene("shedding"), "speed")
    assert row_of(result, "warp_tension").regret["speed"] > 0.0, "the optimum without it is slower"
    assert row_of(result, "damping").regret["speed"] < 0.0
    assert row_of(result, "inertia").status == "needed"
    assert row_of(result, "inertia").why == "target speed needs the effect inertia"


@pytest.mark.slow
def test_an_effect_that_another_one_needs_goes_or_stays_with_it():
    result = lo.effects(made_up.scene(push=100, leaning=100))
    push, leaning = row_of(result, "push"), row_of(result, "leaning")
    assert push.why == "leaning is off with it"
    assert push.shift["M3_fdc"] == pytest.approx(0.0, abs=1e-12)
    assert leaning.shift["M3_fdc"] == pytest.approx(100 / 734.985, rel=1e-5)
    assert (push.may_go, leaning.may_go) == (True, False)
    assert result.left_out == (), "leaning must stay, and needs it"


@pytest.fixture
def refusing(monkeypatch):
    """Make solve refuse the made-up motor."""
    solve = engine.solve

    def solving(scene, *given, **options):
        if "motor" in scene.effects:
            raise BadInput("solve without the effect motor, evaluate with it", key="effects.motor")
        return solve(scene, *given, **options)

    monkeypatch.setattr(engine, "solve", solving)
    monkeypatch.setattr(study, "YIELDING", (made_up.Moving,))


@pytest.mark.few(1)
@pytest.mark.parametrize(("torque", "may_go"), [(3.0, True), (30.0, False)])
def test_an_effect_that_solve_does_not_accept_is_measured_at_the_reference(refusing, torque, may_go):
    result = lo.effects(made_up.scene(motor=torque))
    row = row_of(result, "motor")
    assert row.status == "evaluated"
    assert row.shift["M3_fdc"] == pytest.approx(-torque / 734.985, rel=1e-5), "without minus with"
    assert row.regret["M3_fdc"] is None
    assert row.may_go is may_go
    assert ("motor" in result.left_out, result.judged) == (may_go, () if may_go else ("motor",))
    assert result.reference.effects == ("inertia", "resistance")
    assert "motor" not in result.kept


@pytest.mark.slow
@pytest.mark.parametrize(
    ("motor", "left_out"), slow.after(1, [(6.0, ("push",)), (0.5, ("motor", "push")), (4.0, ("motor",))])
)
def test_an_effect_that_solve_does_not_accept_is_left_out_only_within_the_joint_tolerance(refusing, motor, left_out):
    """1 % allows 7.35 N*m; push needs 5. If both may go only separately, the one with the larger impact comes back."""
    torques = {"push": 5.0, "motor": motor}
    result = lo.effects(made_up.scene(**torques))
    assert [row_of(result, name).may_go for name in torques] == [True, True]
    assert result.left_out == left_out
    assert result.judged == (() if "motor" in left_out else ("motor",))
    assert result.together.shift["M3_fdc"] == pytest.approx(-sum(torques[n] for n in left_out) / 734.985, rel=1e-5)
    stays = sorted(set(torques) - set(left_out))
    assert (f"{' '.join(stays)} may be left out alone, but not together" in result._repr_html_()) is bool(stays)


@pytest.mark.slow
def test_without_an_admissible_design_all_rows_are_infeasible():
    result = lo.effects(lo.load("shedding-static").set("bounds.K1.max", "100 N/m"))
    assert result.reference.status == "infeasible"
    assert result.reference.scales == {}
    assert {row.status for row in result.rows} == {"infeasible"}
    assert (result.left_out, result.largest_omission) == ((), None)


@pytest.mark.parametrize("tolerance", [0.0, -0.01, float("nan"), float("inf")])
def test_a_tolerance_is_a_positive_number(tolerance):
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


def test_its_repr_and_its_page_have_the_summary(beatup):
    assert repr(beatup).startswith("<EffectsStudy beatup, balance: at 1 % bearing_friction, centrifugal")
    page = beatup._repr_html_()
    assert "At 1 %, bearing_friction and centrifugal may be left out" in page
    assert "speed_fluctuation may be left out alone, but not together with the others." in page
    assert "Evaluate the design with speed_fluctuation, which solve does not accept." in page
    assert "resistance, rod_inertia and gravity the design is as good, but its figures change" in page
    assert "solve" not in page.split("</thead>")[0], "times differ from run to run"
    with pytest.raises(TypeError, match="cannot be changed"):
        beatup.rows[0].shift["M3_fdc"] = 0.0


def test_the_table_has_shares_units_and_provenance(beatup):
    table = beatup.table()
    assert table.index.name == "without"
    assert table.loc["rocker_inertia", "M3_fdc shift [N*m]"] == pytest.approx(54.59525, abs=1e-5)
    assert table.loc["rocker_inertia", "M3_fdc regret [%]"] == pytest.approx(7.114, abs=1e-3)
    assert set(table.index[table["may go"]]) == {*beatup.left_out, "speed_fluctuation"}
    assert table.attrs["study"] == "effects"
    assert table.attrs["tolerance"] == "0.01"


@pytest.fixture(scope="module")
def kinematic():
    """Impact of effects on a target of geometry, with few free variables."""
    fixed = ("l4", "l5", "l6", "l3p", "alpha", "C0x")
    return lo.effects(lo.load("rapier").update({f"bounds.{name}.free": False for name in fixed}))


@pytest.mark.slow
def test_figures_that_need_an_omitted_effect_are_named_even_if_the_target_reads_none(kinematic):
    assert kinematic.left_out == ("head_inertia", "tape_friction", "tape_stretch")
    inertia, friction, stretch = kinematic.rows
    assert (inertia.missing_figures, inertia.changed_figures) == (
        ("head_overrun",),
        ("tape_force", "peak_torque", "peak_power"),
    )
    assert (friction.missing_figures, friction.changed_figures) == ((), ("tape_force", "peak_torque", "peak_power"))
    assert (stretch.missing_figures, stretch.changed_figures) == (("head_overrun",), ())
    assert kinematic.together.missing_figures == ("tape_force", "peak_torque", "peak_power", "head_overrun")
    without = lo.evaluate(kinematic.scene.without_effect(*kinematic.scene.effects))
    assert all(without.figures[name] is None for name in kinematic.together.missing_figures)
    reads = kinematic.reference.reads
    assert {"peak_acceleration", "stroke", "dwell_after"} <= set(reads)
    assert not set(kinematic.together.missing_figures) & set(reads)
    (sentence,) = [line for line in effects_text.verdict(kinematic.result) if line.startswith("Of the other figures: ")]
    assert "without tape_stretch head_overrun is missing; " in sentence
    assert "without all of them tape_force, peak_torque, peak_power and head_overrun are missing" in sentence
    assert sentence.endswith("Target stroke-dwell reads none of these figures.")
    table = kinematic.table()
    assert table.loc["head_inertia", "takes away"] == "head_overrun"
    assert table.loc["tape_friction", "changes"] == "tape_force, peak_torque, peak_power"
    figures = kinematic.as_dict()["other_figures"]["head_inertia"]
    assert figures == {"takes_away": ["head_overrun"], "changes": ["tape_force", "peak_torque", "peak_power"]}
    assert kinematic.as_dict()["reference"]["reads"] == list(reads)


@pytest.mark.slow
def test_figures_of_the_target_that_need_an_omitted_effect_are_named(kinematic):
    row = dataclasses.replace(kinematic.rows[0], missing_figures=("stroke", "tape_force"))
    (sentence,) = effects_text.omission_sentences(dataclasses.replace(kinematic.result, rows=(row,)))
    assert sentence.endswith("Target stroke-dwell reads stroke of them.")
    none = dataclasses.replace(row, missing_figures=(), changed_figures=())
    assert effects_text.omission_sentences(dataclasses.replace(kinematic.result, rows=(none,))) == []


def test_figures_of_an_effect_that_may_go_are_named_for_a_target_of_forces_too(beatup):
    centrifugal = next(row for row in beatup.rows if row.effect == "centrifugal")
    assert set(centrifugal.missing_figures) == {"reed_centrifugal", "shaking_force"}
    assert any(
        "without centrifugal reed_centrifugal and shaking_force are missing" in line
        for line in effects_text.verdict(beatup.result)
    )
