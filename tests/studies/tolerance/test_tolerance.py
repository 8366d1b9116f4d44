"""Tolerance studies: spreads and yields compared with independent references, and the same bits with any executor.

The references of spreads are complex steps and implicit derivatives in 40 digits. Those of yields are 16 scrambles of
2^20 Sobol points.
"""

import functools
import math
import multiprocessing
import sqlite3
import tracemalloc
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.interface.files.store_file import read_studies
from loomopt.jobs import registry
from loomopt.model.machines import BLOCK
from loomopt.solving import engine
from loomopt.studies.tolerance import study
from loomopt.studies.tolerance.plan import plan_tolerance

SIX_HUNDREDTHS = "0.06 mm"
LINKS = dict.fromkeys(("l1", "l2", "l3", "l4"), SIX_HUNDREDTHS)
DRIVE = dict.fromkeys(("l4", "l5", "l6", "l3p", "C0x", "C0y"), SIX_HUNDREDTHS) | dict.fromkeys(
    ("alpha", "phi40"), "0.03 deg"
)
DIGITS = 3e-11
"""Relative error of a linear standard deviation: slopes are differences of the sixth order."""
FREE_DIRECTION = 2e-8
"""The same where the optimum has a free direction: the design is accurate to 1e-8 there."""
SE = 4.0
"""Largest deviation of a sampled value, in standard errors of both values together."""


@functools.cache
def optimum(problem, target=None):
    return dict(engine.solve(registry.load(problem), target).design)


def make_plan(problem, made, accept=None, samples=20_000, seed=0):
    changes = {"tolerances": made} | ({"accept": accept} if accept else {})
    return plan_tolerance(registry.load(problem).update(changes), optimum(problem), None, samples, seed)


@functools.cache
def beatup():
    return study.run(make_plan("beatup", LINKS, {"M3_fdc": "1 N*m"}))


def linear(problem, made):
    plan = make_plan(problem, made)
    spreads = {name: study.share_variance(plan, figure.by_number) for name, figure in study.slopes(plan).items()}
    return {name: sigma for name, (sigma, _) in spreads.items()}, {name: share for name, (_, share) in spreads.items()}


def test_linear_spread_of_the_balanced_beatup():
    sigmas, shares = linear("beatup", LINKS)
    assert sigmas["M3_fdc"] == pytest.approx(0.656203505476, rel=DIGITS)
    assert shares["M3_fdc"]["l1"] == pytest.approx(0.97990735, abs=5e-9)
    assert sigmas["peak_torque"] == pytest.approx(0.160426555, abs=5e-10)
    assert shares["peak_torque"]["l1"] == pytest.approx(0.9761, abs=5e-5)
    assert math.fsum(shares["swing"].values()) == pytest.approx(1.0, abs=1e-14)


@pytest.mark.parametrize(
    ("number", "plus_minus", "sigma"),
    [("M0", "5 %", 12.416667), ("speed", "1 %", 4.966667), ("J4", "2 %", 4.664027)],
)
def test_cloth_and_speed_move_the_reed_torque_more_than_links_do(number, plus_minus, sigma):
    assert linear("beatup", {number: plus_minus})[0]["M3_fdc"] == pytest.approx(sigma, abs=6e-7)


@pytest.mark.parametrize(("correlation", "sigma"), [(0.0, 0.656203505), (0.5, 0.584249106), (0.9, 0.519559622)])
def test_lengths_made_on_one_machine(correlation, sigma):
    made = {"plus_minus": SIX_HUNDREDTHS, "group": "machine", "correlation": correlation}
    assert linear("beatup", dict.fromkeys(LINKS, made))[0]["M3_fdc"] == pytest.approx(sigma, abs=6e-10)


@pytest.mark.parametrize(
    ("standard", "sigma"), [("IT7", 0.117488326), ("ISO 2768-f", 1.122591564), ("ISO 2768-m", 2.283848822)]
)
def test_classes_of_the_links(standard, sigma):
    assert linear("beatup", {key: {"class": standard} for key in LINKS})[0]["M3_fdc"] == pytest.approx(sigma, rel=1e-8)


def test_uniform_links():
    made = {"plus_minus": "0.05 mm", "spread": "uniform"}
    assert linear("beatup", dict.fromkeys(LINKS, made))[0]["M3_fdc"] == pytest.approx(0.947148, abs=6e-7)


@pytest.mark.slow
def test_linear_spread_of_the_rapier():
    sigmas, shares = linear("rapier", DRIVE)
    assert 1e3 * sigmas["stroke"] == pytest.approx(0.3171858877, rel=FREE_DIRECTION)
    assert math.degrees(sigmas["dwell_after"]) == pytest.approx(0.2491946306, rel=FREE_DIRECTION)
    assert math.degrees(sigmas["dwell_before"]) == pytest.approx(0.2604240165, rel=FREE_DIRECTION)
    assert math.degrees(sigmas["mu_min"]) == pytest.approx(0.0379328956, rel=FREE_DIRECTION)
    assert sigmas["peak_acceleration"] == pytest.approx(9.027666887e-4, rel=FREE_DIRECTION)
    assert shares["stroke"]["l6"] == pytest.approx(0.266, abs=5e-4)
    assert [round(100 * shares[name]["l4"]) for name in ("dwell_after", "dwell_before", "peak_acceleration")] == [
        89,
        98,
        96,
    ]


@pytest.mark.parametrize(
    ("made", "sigma"),
    [
        ({"K1": "5130.13047 N/m", "X0": "1 mm"}, 239.656207271),
        ({"K1": "5 %", "X0": "1 mm"}, 239.656207271),
        (
            {
                "K1": {"plus_minus": "5 %", "spread": "uniform"},
                "X0": {"plus_minus": "1 mm", "spread": "uniform"},
            },
            415.096727343,
        ),
    ],
)
def test_linear_spread_of_the_least_cam_force(made, sigma):
    assert linear("shedding", made)[0]["contact_min"] == pytest.approx(sigma, rel=2e-9)


def close(share, value, se):
    return abs(share.value - value) <= SE * math.hypot(share.se, se)


def test_yields_of_the_balanced_beatup():
    result = beatup()
    assert close(result.yields["swing"], 0.5, 1e-5)
    assert close(result.yields["theta"], 0.499924, 7e-6)
    assert close(result.yields["M3_fdc"], 0.872468, 9e-6)
    assert close(result.yields["all"], 0.262233, 17e-6)
    assert result.figures["M3_fdc"].sigma == pytest.approx(0.6562, rel=3e-3)
    assert (result.bad, result.samples) == (0, 20_000)
    assert result.tighten[0][0] == "l1"


def test_yield_of_all_limits_without_a_band():
    result = study.run(make_plan("beatup", LINKS))
    assert close(result.yields["all"], 0.307458, 16e-6)
    assert result.plan.goals_without_band == ("M3_fdc",)
    assert "M3_fdc" not in result.yields


@pytest.mark.slow
def test_yields_of_shedding_and_rapier():
    shedding = study.run(make_plan("shedding", {"K1": "5 %", "X0": "1 mm"}, samples=4000))
    assert close(shedding.yields["N_min"], 0.49987, 1e-4)
    rapier = study.run(make_plan("rapier", DRIVE, {"stroke": "1 mm"}, samples=4000))
    assert close(rapier.yields["dwell_after"], 0.500099, 203e-6)
    assert close(rapier.yields["stroke"], 0.998323, 44e-6)


def test_the_same_bits_with_any_executor_and_others_with_another_seed():
    plan = make_plan("beatup", LINKS, samples=1600)
    serial = study.run(plan)
    with ThreadPoolExecutor(2) as executor:
        assert study.run(plan, executor).as_dict() == serial.as_dict()
    reseeded = study.run(replace(plan, seed=1)).as_dict()
    assert reseeded["figures"]["swing"]["sigma"] != serial.figures["swing"].sigma


@pytest.mark.slow
def test_the_same_bits_from_processes():
    plan = make_plan("shedding", {"K1": "5 %"}, samples=1600)
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as executor:
        parallel = study.run(plan, executor, worst=True).as_dict()
    assert parallel == study.run(plan, worst=True).as_dict()


def test_memory_does_not_grow_with_the_machines():
    """A scramble is summed block by block: four times as many machines need no more memory."""
    tops = []
    for samples in (16 * 2 * BLOCK, 16 * 8 * BLOCK):
        plan = make_plan("shedding", {"K1": "5 %"}, samples=samples)
        sigmas = {name: sigma for name, sigma in linear("shedding", {"K1": "5 %"})[0].items() if name in ("K1",)}
        study.sum_scramble(plan, sigmas, 0)
        tracemalloc.start()
        study.sum_scramble(plan, sigmas, 1)
        tops.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert tops[1] < 1.1 * tops[0]


def test_a_demand_with_a_tolerance_follows_the_machine():
    """A machine with a shorter travel must reach its actual travel, not the nominal one."""
    result = study.run(make_plan("shedding", {"travel": "0.2 mm"}, samples=1600))
    assert result.yields["travel"].value == 1.0


@pytest.mark.slow
def test_machines_that_do_not_assemble_are_bad():
    result = study.run(make_plan("rapier", {"l4": "25 mm", "l5": "25 mm"}, samples=160))
    assert 0 < result.bad < 160
    assert result.yields["all"].value <= 1 - result.bad / 160


def test_machines_have_the_spread_of_their_tolerances():
    group = {"group": "machine", "correlation": 0.64}
    made = {
        "l1": {"plus_minus": "0.06 mm", **group},
        "l2": {"plus_minus": "0.06 mm", "spread": "uniform"},
        "l3": {"plus_minus": "0.06 mm", "spread": "uniform", **group},
        "l4": {"plus_minus": "0.06 mm", **group},
    }
    plan = make_plan("beatup", made)
    machines = study.draw_machines(plan, 0, 0, 4096)
    off = {name: machines[name] - plan.nominal[name] for name in made}
    for name, deviations in off.items():
        assert np.std(deviations) == pytest.approx(plan.sigmas[name], rel=0.01), name
    assert np.abs(off["l2"]).max() <= 6e-5
    assert np.abs(off["l3"]).max() <= 6e-5
    assert np.corrcoef(off["l1"], off["l4"])[0, 1] == pytest.approx(0.64, abs=0.02)
    assert np.corrcoef(off["l1"], off["l2"])[0, 1] == pytest.approx(0.0, abs=0.02)
    later = study.draw_machines(plan, 0, 1024, 10)
    assert all(np.array_equal(later[name], machines[name][1024:1034]) for name in made)


def test_a_plan_without_tolerances_or_with_a_bad_option_is_refused():
    scene = registry.load("beatup")
    with pytest.raises(BadInput, match="no number of the scene has a tolerance"):
        plan_tolerance(scene)
    with pytest.raises(BadInput, match="swing is neither an equality nor a goal"):
        plan_tolerance(scene.update({"tolerances": LINKS, "accept": {"swing": "1 deg"}}))
    with pytest.raises(BadInput, match="samples"):
        plan_tolerance(scene.update({"tolerances": LINKS}), samples=3)
    with pytest.raises(BadInput, match="seed"):
        plan_tolerance(scene.update({"tolerances": LINKS}), seed=-1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("problem", "made", "accept", "expected"),
    [
        ("beatup", LINKS, {"M3_fdc": "1 N*m"}, {"M3_fdc": 0.872468, "theta": 0.499924, "all": 0.262233}),
        ("beatup", {key: {"class": "IT7"} for key in LINKS}, None, {"all": 0.31288}),
        ("beatup", {key: {"class": "ISO 2768-m"} for key in LINKS}, None, {"all": 0.32032}),
        (
            "beatup",
            {key: {"plus_minus": "0.05 mm", "spread": "uniform"} for key in LINKS},
            None,
            {"all": 0.302256},
        ),
        (
            "rapier",
            DRIVE,
            None,
            {"dwell_after": 0.500099, "mu_min": 0.499828, "all": 0.182192},
        ),
    ],
)
def test_yields_of_many_machines(problem, made, accept, expected):
    result = study.run(make_plan(problem, made, accept, samples=100_000))
    for name, value in expected.items():
        assert close(result.yields[name], value, 2.2e-4 if problem == "rapier" else 6e-5), name


@pytest.mark.slow
def test_a_store_keeps_scrambles_and_a_study_resumes_from_it(tmp_path):
    scene = registry.load("shedding").update({"tolerances": {"K1": "5 %"}})
    path = tmp_path / "machines.db"
    serial = lo.tolerance(scene, samples=1600, worst=False).as_dict()
    assert lo.tolerance(scene, samples=1600, worst=False, store=path).as_dict() == serial
    with sqlite3.connect(path) as file:
        file.execute("DELETE FROM row WHERE point > 9")
        before = dict(file.execute("SELECT point, seconds FROM row").fetchall())
    assert len(before) == 10
    with pytest.raises(BadInput, match="10 of the 16 scrambles of this study already"):
        lo.tolerance(scene, samples=1600, worst=False, store=path)
    assert lo.tolerance(scene, samples=1600, worst=False, store=path, resume=True, workers=1).as_dict() == serial
    with sqlite3.connect(path) as file:
        assert file.execute("SELECT count(*) FROM row").fetchall() == [(16,)]
    lo.tolerance(scene, samples=1600, seed=1, worst=False, store=path)
    with sqlite3.connect(path) as file:
        assert file.execute("SELECT count(*) FROM study").fetchall() == [(2,)]
    with pytest.raises(BadInput, match="nothing to resume from"):
        lo.tolerance(scene, samples=1600, worst=False, resume=True)
    with pytest.raises(BadInput, match="a tolerance study, which has no designs"):
        read_studies(path)


def test_a_bound_of_a_dependent_variable_is_no_criterion():
    scene = lo.load("shedding").free("rise").update({"tolerances": {"speed": "1 %"}})
    plan = plan_tolerance(scene, None, "law", 160, 0)
    assert "near_dwell" in plan.evaluated.design
    assert "near_dwell" not in [criterion.name for criterion in plan.criteria]
    assert plan.read({name: np.full(2, plan.nominal[name]) for name in plan.tolerances})["contact_min"].shape == (2,)


def test_the_loss_of_a_limit_without_a_figure_is_divided_by_number():
    result = lo.tolerance(
        lo.load("shedding").update({"tolerances": {"K1": "5 %", "speed": "1 %"}}), samples=160, worst=False
    )
    assert result.yields["N_min"].value == 0.0
    assert result.tighten[0][0] == "speed"
