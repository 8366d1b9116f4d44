"""Where nothing is admissible: said so, with relaxations that help when granted and do not help when cut short."""

import json
import math

import pytest
from support import slow

import loomopt as lo
from loomopt.solving.answer.solution import remedies
from reference.beatup import DESIGN

TIGHT: dict[str, tuple[str, dict[str, object], str]] = {
    "light, torque": ("beatup-light", {}, "torque"),
    "light, retrofit": ("beatup-light", {}, "retrofit"),
    "swing out of reach": ("beatup", {"limits.swing": {"min": "40 deg", "max": "41 deg"}}, "balance"),
    "crank fixed": ("beatup", {"bounds.l1": "36 mm"}, "balance"),
    "transmission angle": ("beatup", {"limits.mu_min.min": "75 deg"}, "balance"),
    "pulse": ("beatup", {"limits.pulse_rms.max": "200 N*m"}, "pulse"),
    "too strong a cloth": ("beatup", {"operation.M0": "1000 N*m"}, "retrofit"),
    "eccentricity": ("beatup", {"limits.r4": {"min": "20 mm", "max": "21 mm"}}, "balance"),
}
UNITS = {"l1": "m", "l2": "m", "l3": "m", "l4": "m", "r4e": "m", "r4": "m", "m4e": "kg"}
UNITS |= {"swing": "rad", "theta": "rad", "mu_min": "rad", "peak_torque": "N*m", "pulse_rms": "N*m", "M3_fdc": "N*m"}


def scene_of(name):
    problem, changes, target = TIGHT[name]
    return lo.load(problem).update(changes), target


@pytest.fixture(scope="module")
def answer_of():
    known = {}

    def solved(name):
        if name not in known:
            known[name] = lo.solve(*scene_of(name))
        return known[name]

    return solved


def granted(scene, target, relaxations, share=1.0, more=0.0):
    """Return scene and target with each relaxation granted to a share; a retrofit's M3 = 0 becomes torque's tolerance.

    more: how far beyond, relative to the limit.
    """
    for relaxation in relaxations:
        outward = 1 if relaxation.side == "max" else -1
        value = relaxation.value + share * (relaxation.needed - relaxation.value)
        value += outward * more * max(abs(relaxation.needed), abs(relaxation.value))
        name, unit = relaxation.limit, UNITS[relaxation.limit]
        if name == "M3_fdc":
            scene, target = scene.set("targets.torque.M3_tolerance", f"{abs(value)!r} {unit}"), "torque"
            continue
        table = "bounds" if name in DESIGN else "limits"
        old = getattr(scene, table)[name]
        ends = {"min": old.min, "max": old.max} | {relaxation.side: value}
        scene = scene.set(f"{table}.{name}", {side: f"{end!r} {unit}" for side, end in ends.items() if end is not None})
    return scene, target


def assert_just_enough(scene, target, relaxations):
    """Assert that relaxations make a design possible, and 99 % of them do not.

    At the edge itself the admissible set shrinks to a point, where optima need not have multipliers: 1e-6 beyond it a
    design must be found that keeps every limit, 1e-3 beyond it it must be certified too.
    """
    edge = lo.solve(*granted(scene, target, relaxations, more=1e-6))
    assert edge.status in ("optimal", "uncertified"), edge.message
    assert edge.admissible
    assert lo.solve(*granted(scene, target, relaxations, more=1e-3)).status == "optimal"
    assert lo.solve(*granted(scene, target, relaxations, share=0.99)).status == "infeasible"


def together(answer):
    """Return the relaxations that are meant to be granted at once."""
    return [relaxation for relaxation in answer.relaxation if not relaxation.alone] or list(answer.relaxation[:1])


@pytest.mark.few(4)
@pytest.mark.parametrize("name", TIGHT)
def test_it_is_called_infeasible_and_says_which_limits_clash(answer_of, name):
    answer = answer_of(name)
    assert answer.status == "infeasible"
    assert answer.clash
    assert answer.relaxation
    for text in answer.clash:
        assert text in answer.message
    assert "No admissible design" in answer.message
    assert answer.certificate is None
    assert not answer.binding


@pytest.mark.parametrize("name", TIGHT)
def test_what_it_prints_holds_a_design_and_no_nan(answer_of, name):
    printed = answer_of(name).as_dict()
    text = json.dumps(printed, allow_nan=False)
    assert "NaN" not in text
    assert set(DESIGN) <= set(printed["design"])
    assert printed["figures"]["swing"] > 0
    assert printed["figures"]["peak_torque"] > 0
    assert all(math.isfinite(relaxation["needed"]) for relaxation in printed["relaxation"])
    assert any(not limit["ok"] for limit in printed["limits"]), "the design shown cannot keep every limit"


@pytest.mark.few(1)
@pytest.mark.parametrize("name", slow.after(4, TIGHT))
def test_the_least_relaxation_helps_and_no_less_does(answer_of, name):
    scene, target = scene_of(name)
    assert_just_enough(scene, target, together(answer_of(name)))


@pytest.mark.few(1)
@pytest.mark.parametrize("name", slow.after(4, TIGHT))
def test_each_limit_that_would_do_by_itself_does_and_no_less_of_it(answer_of, name):
    (scene, target), answer = scene_of(name), answer_of(name)
    for relaxation in answer.relaxation:
        if relaxation.alone and [relaxation] != together(answer):  # that one is granted above
            assert_just_enough(scene, target, [relaxation])


@pytest.mark.parametrize("name", TIGHT)
@pytest.mark.few(2)
def test_the_least_relaxation_helps_as_it_is_printed(answer_of, name):
    """Six digits are shown: they must be rounded to the side that helps."""
    printed = [as_printed(item) for item in together(answer_of(name))]
    scene, target = scene_of(name)
    answer = lo.solve(*granted(scene, target, printed))
    assert answer.status != "infeasible", [item.text for item in printed]


def as_printed(relaxation):
    """Return the relaxation with the number its text shows."""
    value, unit = relaxation.text.partition(" -> ")[2].partition(" (by")[0].split()
    return relaxation._replace(needed=float(value) * {"mm": 1e-3, "deg": math.radians(1)}.get(unit, 1.0))


@pytest.mark.few(2)
@pytest.mark.parametrize(
    "changes",
    [
        {"bounds.l1.min": "20 mm"},
        {"bounds.l4.max": "400 mm"},
        {"bounds.l3.min": "100 mm"},
        {"limits.swing.min": "5 deg"},
        {"limits.theta.max": "30 deg"},
        {"limits.mu_min.min": "20 deg"},
    ],
    ids=str,
)
def test_a_limit_not_named_as_enough_by_itself_is_not_enough(answer_of, changes):
    """Loosened without measure, each of the others alone leaves the light cloth's reed torque out of tolerance."""
    assert {relaxation.limit for relaxation in answer_of("light, torque").relaxation if relaxation.alone} == {"M3_fdc"}
    assert lo.solve(lo.load("beatup-light").update(changes), "torque").status == "infeasible"


def test_one_limit_with_two_sides_that_clash_with_each_other_needs_both_or_one():
    """M3 >= 20 N·m in [limits] against the target's own |M3| <= 7.45 N·m: either may give way, alone and fully."""
    answer = lo.solve(lo.load("beatup").set("limits.M3_fdc.min", "20 N*m"), "torque")
    assert answer.status == "infeasible"
    together = {relaxation.side: relaxation.needed for relaxation in answer.relaxation if not relaxation.alone}
    if set(together) == {"min", "max"}:
        assert together["min"] <= together["max"] * (1 + 1e-6)
    for relaxation in (relaxation for relaxation in answer.relaxation if relaxation.alone):
        other = 7.45 if relaxation.side == "min" else 20.0
        assert relaxation.needed == pytest.approx(other, rel=1e-6), "by itself it must meet the other side"


def test_a_scene_with_nothing_to_choose_is_judged_as_it_stands():
    """Without bounds today's machine is the only design: its M3 of 10 N·m is beyond the tolerance of 7.45."""
    scene = lo.load("beatup")
    document = {name: value for name, value in scene.document.items() if name != "bounds"}
    second_scene = lo.scene(document)
    assert lo.solve(second_scene, "torque").status == "infeasible"
    free = lo.solve(second_scene.set("targets.torque.M3_tolerance", "11 N*m"), "torque")
    assert free.status == "optimal"
    assert free.design == pytest.approx({name: scene.mechanism[name] for name in DESIGN}, rel=1e-12)


@pytest.mark.slow
def test_infeasible_is_said_where_balance_stays_beyond_the_tolerance():
    """One fact seen twice: torque is infeasible exactly where the least |M3| is more than its tolerance."""
    for M0, feasible in ((640, False), (680, True), (860, True), (900, False)):
        scene = lo.load("beatup").set("operation.M0", f"{M0} N*m")
        least = abs(lo.solve(scene, "balance").figures["M3_fdc"])
        assert (least <= 0.01 * M0) == feasible
        assert lo.solve(scene, "torque").status == ("optimal" if feasible else "infeasible")


def test_advice_out_of_all_proportion_is_told_last_and_so_called():
    """A reed of 9000 N m is balanced by more mass or none: a counterweight of a bit more, or machines no one builds."""
    answer = lo.solve(lo.load("beatup").set("operation.M0", "9000 N*m"), target="torque")
    fair = [item.in_proportion for remedy in remedies(answer.relaxation) for item in remedy]
    by_itself = [item.in_proportion for item in answer.relaxation if item.alone]
    assert by_itself == sorted(by_itself, reverse=True)
    assert by_itself[0]
    assert not all(fair)
    assert [item.text for remedy in remedies(answer.relaxation) for item in remedy] == [
        r.text for r in answer.relaxation
    ]
    assert f"The least relaxation that helps: {answer.relaxation[0].text}." in answer.message
    assert answer.message.count("out of proportion") == fair.count(False)


def test_a_least_force_that_must_go_ends_at_zero_newtons():
    answer = lo.solve(lo.load("shedding").update({"operation.N_min": "9000 N", "bounds.K1.max": "20 kN/m"}))
    (force,) = [relaxation for relaxation in answer.relaxation if relaxation.limit == "N_min"]
    assert force.needed == 0.0
    assert "N_min >= 9000 N -> 0 N" in answer.message
