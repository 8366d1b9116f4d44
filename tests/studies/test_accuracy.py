"""The work-precision study: orders, errors down each ladder, failures as rows, references, the advice, the command."""

import itertools
import json
import math

import pytest

import loomopt as lo
from loomopt.cli import run
from loomopt.jobs.shedding import design as limit_law
from loomopt.studies import accuracy, digits, optima, readings
from loomopt.studies.ladders import Ladder, Outcome, Reference, Row, climbed, grouped, knee, order
from loomopt.studies.subject import Target
from loomopt.studies.tolerances import NO_ORDER
from loomopt.views import accuracy_figure
from tests.views import overlaps

pytestmark = pytest.mark.slow

SMALL = optima.Amount((1e-3, 1e-6, 1e-11), (12, 48), (1e-2, 1e-6, 1e-12), (8, 16, 32))
LINEAR_PROGRAMMES = {
    8: 75219.70679752559,
    16: 59955.4638624003,
    32: 54258.18547511632,
    64: 51851.18118524897,
    128: 50715.05248133707,
}
"""Intervals of a free law → least K1, N/m, by HiGHS (benchmarks/plain_shedding.py, law_lp)."""
JOBS = {"beatup": "psi_2", "rapier": "S_2", "shedding": "X_2"}


def few(subject, full):
    """Yield the solve ladders with few settings."""
    yield from optima.ladders(subject, SMALL)


def studied(name, ladders=None):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(accuracy, "QUICK_REPEATS", 1)
        return accuracy.study(lo.load(name), ladders=ladders or (few, accuracy.LADDERS[1]))


@pytest.fixture(scope="module")
def studies():
    return {name: studied(name) for name in JOBS}


@pytest.fixture(scope="module")
def ladders(studies):
    """Return each job's rows by "quantity, method"."""
    return {name: grouped(study.rows) for name, study in studies.items()}


def test_no_text_of_the_figure_runs_into_anything(studies):
    for study in studies.values():
        figure = accuracy_figure.drawn(study)
        assert figure.axes
        assert overlaps.found(figure) == []


def errors(rows):
    return [row.error for row in rows]


# Orders


@pytest.mark.parametrize(
    ("name", "quantity"),
    [("beatup", "peak_torque"), ("rapier", "peak_acceleration"), ("rapier", "stroke"), ("shedding", "contact_max")],
)
def test_equal_points_find_a_smooth_peak_with_order_two(studies, ladders, name, quantity):
    assert 1.95 <= studies[name].orders[f"{quantity}, sampled points"] <= 2.05
    found = errors(ladders[name][f"{quantity}, sampled points"])
    assert all(after < before for before, after in itertools.pairwise(found))
    assert found[-1] > 1e-10  # 100000 points are still 1000 times further off than refined ones


def test_a_dwell_read_off_equal_points_has_order_one(studies):
    assert 0.95 <= studies["rapier"].orders["dwell_after, sampled points"] <= 1.05


@pytest.mark.parametrize(("name", "motion"), JOBS.items())
def test_finite_differences_have_order_two_until_rounding_takes_over(studies, ladders, name, motion):
    key = f"{motion}, finite differences"
    assert 1.9 <= studies[name].orders[key] <= 2.1
    found = errors(ladders[name][key])
    lowest = found.index(min(found))
    assert all(after < before for before, after in itertools.pairwise(found[: lowest + 1]))
    assert all(after > before for before, after in itertools.pairwise(found[lowest:]))
    assert 1e-4 <= studies[name].knees[key] <= 1e-3
    for other in ("closed form", "automatic differentiation"):
        (row,) = ladders[name][f"{motion}, {other}"]
        assert row.error < 1e-13 < 1e-3 * min(found)


def test_a_free_law_tends_to_the_limit_law_with_order_one(studies, ladders):
    rows = ladders["shedding"]["law K1, spline intervals"]
    assert 1.0 <= studies["shedding"].orders["law K1, spline intervals"] <= 1.35
    limit = limit_law.least_stiffness(lo.load("shedding"), 6e4)
    for intervals, by_hand in LINEAR_PROGRAMMES.items():
        (row,) = (row for row in rows if row.setting == intervals) if intervals in SMALL.intervals else (None,)
        assert row is None or row.error == pytest.approx(float(by_hand / limit - 1), rel=1e-7)
    scaled = [intervals * (by_hand / float(limit) - 1) for intervals, by_hand in LINEAR_PROGRAMMES.items()]
    drops = [before - after for before, after in itertools.pairwise(scaled)]
    assert all(before > 1.3 * after > 0 for before, after in itertools.pairwise(drops))  # n times the error settles


# Errors down a ladder


@pytest.mark.parametrize("name", JOBS)
def test_the_exchange_keeps_every_accuracy_it_is_asked(ladders, name):
    for key, rows in ladders[name].items():
        if key.endswith(", exchange") and "design" not in key:
            assert all(row.status == "optimal" and row.error <= 1e-11 for row in rows)
            spent = [row.evaluations for row in rows]
            assert spent == sorted(spent)
            assert spent[-1] > 2 * spent[0]


@pytest.mark.parametrize(
    "key", ["balance peak_torque", "stroke-dwell peak_acceleration", "stiffness K1", "law K1", "law design"]
)
def test_tolerances_of_the_solver_bring_the_error_down(ladders, key):
    rows = next(own[f"{key}, IPOPT tolerance"] for own in ladders.values() if f"{key}, IPOPT tolerance" in own)
    first, middle, last = errors(rows)
    assert first > middle > last
    assert last < 1e-5 * first


@pytest.mark.parametrize("key", ["balance peak_torque", "stiffness K1", "law K1", "stroke-dwell peak_acceleration"])
def test_guessed_second_derivatives_reach_the_same_optimum_and_tell_their_iterations(ladders, key):
    rows = next(own[f"{key}, Hessian"] for own in ladders.values() if f"{key}, Hessian" in own)
    assert [row.setting for row in rows] == ["limited-memory", "exact"]
    assert all(row.error < 1e-8 and "iterations" in row.status for row in rows)


def test_refined_peaks_are_right_to_rounding_from_any_number_of_points(ladders):
    for own in ladders.values():
        for key, rows in own.items():
            if key.endswith("refined points"):
                assert max(errors(rows)) < 1e-13


def test_equal_points_claim_too_little_and_the_exchange_does_not(ladders):
    for name, target in (("beatup", "balance"), ("rapier", "stroke-dwell"), ("shedding", "stiffness")):
        assert ladders[name][f"{target} claimed peak, uniform points"][0].error > 1e-3
        assert max(errors(ladders[name][f"{target} claimed peak, exchange"])) < 1e-11


def test_refining_equal_points_can_be_no_evidence(ladders):
    """12 and 48 points of the turn both have 90 deg as the node nearest to 88.37 deg: the stiffness there, by hand."""
    first, second = errors(ladders["shedding"]["stiffness K1, uniform points"])
    omega, travel, rise, theta = 20 * math.pi, 65.6e-3, math.radians(120), math.radians(90)
    u = theta / rise
    fallen = travel * (u - math.sin(2 * math.pi * u) / (2 * math.pi))
    slowed = travel * 2 * math.pi * math.sin(2 * math.pi * u) * (omega / rise) ** 2
    warp = -83.03 * (2 * fallen / travel - 1)
    there = (369.55 + warp - 369.55 / 9.80665 * slowed) / (80e-3 + fallen)
    true = 102602.609425357429  # 30 digits by golden section, benchmarks/plain_shedding.py
    assert first == pytest.approx(1 - there / true, rel=1e-6)
    assert second == pytest.approx(first, rel=1e-6)


def test_many_digits_leave_float64_far_behind(ladders):
    for name, motion in JOBS.items():
        plain, _, many = ladders[name][f"{motion}, numbers"]
        assert NO_ORDER > plain.error > 1e-18
        assert many.error < 1e-35


# References


@pytest.mark.parametrize(
    ("name", "target", "known"),
    [
        ("beatup", "balance", 88.6894134918),  # four solvers and 40-digit arithmetic
        ("beatup-light", "balance", 82.3371385326),
        ("rapier", "stroke-dwell", 0.694984753569),  # benchmarks/plain_rapier.py: SLSQP exchange, Newton
        ("shedding", "stiffness", 102602.609425357),  # benchmarks/plain_shedding.py: 30 digits
        ("shedding", "law", 59955.4638624003),  # benchmarks/plain_shedding.py: HiGHS
        ("shedding", "force", 15679.7298884577),
    ],
)
def test_reference_optima_are_the_known_ones(name, target, known):
    reference = Target(lo.load(name), target)
    assert float(reference.optimum.objectives[-1]) == pytest.approx(known, rel=2e-12)
    assert reference.optimum.uncertainty < 1e-20


def test_a_reference_optimum_is_the_same_in_60_digits_and_from_a_rough_start():
    target = Target(lo.load("beatup-light"), "balance")
    x, point = target.variables(target.answer), target.answer.point
    rough = {name: value * (1 + 1e-7 * (-1) ** k) for k, (name, value) in enumerate(x.items())}
    found = [digits.optimum(target.program, point, start, count) for start, count in ((x, 60), (rough, 40))]
    for other in found:
        assert abs(other.objectives[-1] / target.optimum.objectives[-1] - 1) < 1e-25


def test_the_limit_law_ends_at_rest_when_its_equation_of_motion_is_integrated():
    """Bang until N = 0, then N = 0, from the scene's printed numbers alone: at u = 1 the frame stands at s = 1."""
    integrate = pytest.importorskip("scipy.integrate")
    optimize = pytest.importorskip("scipy.optimize")
    scene = lo.load("shedding")
    stiffness = float(limit_law.least_stiffness(scene, 6e4))
    travel, preload, rate = 65.6e-3, 80e-3, 20 * math.pi / math.radians(120)

    def arc(u, state):
        s = state[0]
        warp = 124.545 * (1 - 2 * s) if s < 0.5 else -83.03 * (2 * s - 1)
        return state[1], (369.55 + warp - stiffness * (travel * s + preload)) / (369.55 / 9.80665 * travel * rate**2)

    def ended(bang):
        begin = math.pi * bang**2, 2 * math.pi * bang
        return integrate.solve_ivp(arc, (bang, 1.0), begin, rtol=1e-11, atol=1e-13, max_step=1e-3).y[:, -1]

    bang = optimize.brentq(lambda u: ended(u)[1], 0.2, 0.6, xtol=1e-13)
    assert ended(bang)[0] == pytest.approx(1.0, abs=1e-8)


def test_the_limit_law_falls_to_that_of_an_impulse_as_the_bound_goes():
    """Without a bound: an impulse, then flight to rest at the bottom in one rise, 35567.2269027 N/m in closed form."""
    scene = lo.load("shedding")
    bounds = [2 * math.pi * size for size in (1, 10, 1000, 1e6)]
    found = [limit_law.least_stiffness(scene.set("limits.law_acceleration.max", repr(most)), 6e4) for most in bounds]
    assert found == sorted(found, reverse=True)
    assert float(found[-1]) == pytest.approx(35567.226902713526, rel=1e-6)  # benchmarks/plain_shedding.py


@pytest.mark.parametrize(
    "changed",
    [
        lambda scene: scene.with_effect("damping"),
        lambda scene: scene.with_effect("dry_friction"),
        lambda scene: scene.with_effect("coil"),
        lambda scene: scene.without_effect("inertia"),
        lambda scene: scene.set("targets.law.symmetric", True),
        lambda scene: scene.set("effects.warp_tension.shape", "step"),
        lambda scene: scene.update({"mechanism.return": "100 deg", "mechanism.near_dwell": "80 deg"}),
        lambda scene: scene.free(["rise"]),
    ],
    ids=["damping", "friction", "coil", "no inertia", "symmetric", "step", "unlike", "free angles"],
)
def test_where_the_limit_law_does_not_hold_there_is_none(changed):
    assert limit_law.least_stiffness(changed(lo.load("shedding")), 1e5) is None


def test_a_spring_that_no_law_needs_more_than_is_no_start():
    assert limit_law.least_stiffness(lo.load("shedding"), 4.9e4) is None


# Rows that fail, and references that are not tight enough


def _ladder(run, reference=lambda _: Reference(1.0), settings=(1.0, 0.1)):
    return Ladder("toy", ("q",), settings, run, lambda _, value: Outcome({"q": value}), reference, float)


def test_a_run_that_fails_is_a_row_with_the_reason():
    def run(setting):
        if setting < 0.5:
            raise ValueError("the linkage\nparts")
        return 1.25

    kept, failed = climbed(_ladder(run), 2)
    assert (kept.error, kept.status) == (0.25, "done")
    assert failed == Row("q", "toy", 0.1, None, None, 0, "failed: the linkage parts")


def test_an_error_is_told_only_against_a_reference_a_hundred_times_tighter():
    def told(error, uncertainty):
        return next(climbed(_ladder(lambda _: 1.0 + error, lambda _: Reference(1.0, uncertainty), (1.0,)), 1))

    assert told(1e-3, 0.9e-5).error == pytest.approx(1e-3)
    assert told(1e-3, 1.1e-5).error is None
    assert "nearer than the reference" in told(1e-3, 1.1e-5).status
    (row,) = climbed(_ladder(lambda _: 1.0, lambda _: None, (1.0,)), 1)
    assert row.error is None
    assert "no reference" in row.status
    assert next(climbed(_ladder(lambda _: math.nan, settings=(1.0,)), 1)).status == "done; no number"


def test_a_scene_without_admissible_design_gives_rows_that_say_so():
    scene = lo.load("beatup").update({"limits.swing.min": "40 deg", "limits.swing.max": "41 deg"})
    amount = optima.Amount((1e-3,), (12,), (), ())
    found = accuracy.study(scene, ladders=(lambda subject, full: optima.ladders(subject, amount),))
    assert found.rows
    assert all(row.error is None for row in found.rows)
    assert {row.status for row in found.rows if row.method == "exchange"} == {"infeasible"}
    assert found.advice.startswith("No solve was certified")
    assert found.orders == {}


def test_without_a_limit_law_the_rows_of_intervals_say_so():
    scene = lo.load("shedding").with_effect("damping").set("targets.law.intervals", 8)

    def intervals(subject, full):
        found = optima.ladders(subject, optima.Amount((1e-3,), (12,), (1e-6,), (8,)))
        return (ladder for ladder in found if ladder.method == "spline intervals")

    (row,) = accuracy.study(scene, ladders=(intervals,)).rows
    assert row.error is None
    assert "no reference" in row.status


# Orders and knees of rows made by hand


def rows_of(steps, found):
    return [Row("q", "toy", step, error, 1.0, 1, "done") for step, error in zip(steps, found, strict=True)]


@pytest.mark.parametrize("power", [1, 2, 4])
def test_an_order_is_read_before_rounding(power):
    steps = [2.0**-k for k in range(12)]
    rows = rows_of(steps, [3.0 * h**power + 1e-15 / h for h in steps])
    assert order(rows, float) == pytest.approx(power, rel=0.01)


def test_errors_that_fall_by_chance_have_no_order():
    steps = [1.0, 0.5, 0.25, 0.125]
    assert order(rows_of(steps, [1e-1, 0.99e-1, 1e-6, 0.99e-6]), float) is None
    assert order(rows_of(steps, [1e-1, 1e-1, 1e-1, 1e-1]), float) is None
    assert order(rows_of(steps, [1e-1, 2e-2, None, 1e-4]), float) is None
    assert order(rows_of(steps, [3e-16, 2e-16, 1e-16, 1e-17]), float) is None


def test_the_knee_is_where_errors_stop_falling():
    assert knee(rows_of([4, 3, 2, 1], [1e-2, 1e-5, 1.5e-5, 1e-3])) == 3
    assert knee(rows_of([4, 3, 2], [1e-2, None, 6e-3])) == 4
    assert knee(rows_of([4, 3], [1e-2, None])) is None


# What the study says


@pytest.mark.parametrize("name", JOBS)
def test_the_advice_says_what_the_rows_of_the_exchange_do(studies, name):
    data = json.loads(json.dumps(studies[name].as_dict()))
    exchange = [row for row in data["rows"] if row["method"] == "exchange"]
    own = [row for row in exchange if row["quantity"] == exchange[0]["quantity"]]
    spent = {row["setting"]: row["evaluations"] for row in own}
    usual, finest = spent[1e-6] / spent[1e-3], spent[1e-11] / spent[1e-3]
    settled = [row["error"] for row in own]
    while len(settled) > 1 and settled[0] > 2 * min(row["error"] for row in own):
        settled = settled[1:]
    lost = math.ceil(math.log10(max(*settled, 2.0**-52)))
    assert data["advice"] == (
        f"1e-6 costs {usual:.2g}x of 1e-3 and 1e-11 costs {finest:.2g}x here; below 1e{lost} rounding takes over."
    )
    assert 1.0 < usual < finest


def test_everything_but_seconds_is_the_same_again(studies):
    again = studied("beatup")

    def still(study):
        data = study.as_dict()
        return data | {"rows": [{k: v for k, v in row.items() if k != "seconds"} for row in data["rows"]]}

    assert still(again) == still(studies["beatup"])
    assert again.knees == studies["beatup"].knees


def test_the_table_carries_units_and_provenance(studies):
    frame = studies["rapier"].table()
    assert list(frame) == ["quantity", "method", "setting", "error [1]", "time [s]", "evaluations", "status"]
    assert len(frame) == len(studies["rapier"].rows)
    assert frame.attrs["scene"] == "rapier"
    assert frame.attrs["scene_hash"] == lo.load("rapier").hash


# The command


@pytest.fixture
def quick(monkeypatch):
    """Let the command study with few settings."""
    monkeypatch.setattr(accuracy, "QUICK_REPEATS", 1)
    monkeypatch.setattr(optima, "QUICK", SMALL)
    monkeypatch.setattr(readings, "SAMPLES", (36, 72, 144))


def test_the_command_prints_one_json_object(quick, capsys):
    assert run(["accuracy", "beatup", "--set", "operation.M0=600 N*m", "--json"]) == 0
    out, err = capsys.readouterr()
    data = json.loads(out)
    assert err == ""
    assert list(data) == ["problem", "rows", "orders", "advice"]
    assert data["problem"] == "beatup"
    wanted = {"quantity", "method", "setting", "error", "seconds", "evaluations", "status"}
    assert all(set(row) == wanted for row in data["rows"])
    assert {"exchange", "uniform points", "sampled points", "finite differences"} <= {r["method"] for r in data["rows"]}


def test_the_command_prints_rows_orders_and_advice_and_writes_figure_and_table(quick, capsys, tmp_path):
    files = [tmp_path / name for name in ("f.png", "f.svg", "f.pdf", "f.csv")]
    assert run(["accuracy", "beatup-light", *(word for file in files for word in ("--out", str(file)))]) == 0
    out, err = capsys.readouterr()
    assert "finite differences" in out
    assert "rounding takes over." in " ".join(out.split())
    assert "In time on this machine: 1e-6 costs" in out
    assert err.count("Wrote ") == 4
    starts = [file.read_bytes()[:8] for file in files]
    assert starts[0] == b"\x89PNG\r\n\x1a\n"
    assert starts[1].startswith(b"<?xml")
    assert starts[2].startswith(b"%PDF")
    assert "balance claimed peak" in files[1].read_text()  # matplotlib names what it draws as outlines in comments
    header = next(line for line in files[3].read_text().splitlines() if not line.startswith("#"))
    assert header == "quantity,method,setting,error [1],time [s],evaluations,status"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["accuracy", "betup"], "betup"),
        (["accuracy", "beatup", "--out", "f.dxf"], ".csv"),
        (["accuracy", "beatup", "--with", "nonsense"], "nonsense"),
        (["accuracy", "beatup", "--set", "mechanism.l1=90 mm"], "l1"),
    ],
)
def test_bad_input_is_refused_before_anything_is_solved(capsys, monkeypatch, arguments, said):
    monkeypatch.setattr(optima, "ladders", pytest.fail)
    assert run(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert said in err


def test_a_study_that_is_stopped_shows_what_was_finished(capsys, monkeypatch):
    genuine = accuracy.climbs

    def stopped(scene, full, on_run):
        yield next(genuine(scene, full, on_run, accuracy.LADDERS[1:]))
        raise KeyboardInterrupt

    monkeypatch.setattr(accuracy, "climbs", stopped)
    assert run(["accuracy", "beatup"]) == 130
    out, err = capsys.readouterr()
    assert "sampled points" in out
    assert "finite differences" not in out
    assert "stopped" in err
