"""Least cam force, highest speed, and what limits are worth: against searches by hand and the envelope theorem."""

import math
from dataclasses import replace

import pytest
from support.shedding_cases import framed

import loomopt as lo
from reference import shedding as plain
from reference.cam_force import RPM, least_peak, lopsided, peak, softest

PAPER, PRINTED, PRESSED = plain.PAPER, plain.PRINTED, plain.PRESSED
MUCH = replace(PAPER, C=35, F=20, N_min=60, angles=(100, 70, 130, 60))
KEY = {"N_min": "operation.N_min", "travel": "mechanism.travel", "speed": "operation.speed"}
KEY |= {"X0": "bounds.X0.max", "K1": "bounds.K1.max"}
UNIT = {"N_min": "N", "travel": "m", "speed": "rad/s", "X0": "m", "K1": "N/m"}
OUTWARD = {"K1": 1, "X0": 1, "travel": -1, "speed": -1, "N_min": -1}
"""The way in which a limit is loosened."""
FRAMES = {
    "paper": PAPER,
    "printed travel": PRINTED,
    "much": MUCH,
    "pressed": PRESSED,
    "4567": replace(MUCH, law=plain.LAWS[5]),
}


def solved(scene, target="stiffness"):
    """Return the certified answer."""
    answer = lo.solve(scene, target)
    assert answer.status == "optimal", answer.message
    assert answer.certificate.passed
    return answer


def worths(answer):
    """Return each binding limit's worth for the target's objective."""
    (figure,) = {name for price in answer.binding for name in price.worth}
    return {price.limit: price.worth[figure] for price in answer.binding}


def confirmed(scene, target, figure, names, rel, share=1e-5):
    """Assert that worths are the central differences of answers to slightly moved limits."""
    answer = solved(scene, target)
    for name in names:
        price = next(price for price in answer.binding if price.limit == name)
        step = share * (abs(price.value) or 1.0)
        ends = []
        for sign in (-1, 1):
            value = price.value + sign * OUTWARD[name] * step
            key = KEY[name] if target != "speed" or name not in ("K1", "X0") else f"mechanism.{name}"
            ends.append(solved(scene.set(key, f"{value!r} {UNIT[name]}"), target).figures[figure])
        fall = (ends[0] - ends[1]) / (2 * step)
        assert price.worth[figure] == pytest.approx(-fall if target == "speed" else fall, rel=rel), name


@pytest.mark.parametrize("name", FRAMES)
def test_prices_of_the_least_stiffness_are_its_derivatives_in_closed_form(name):
    """Envelope theorem: −dk/dX0, dk/dN_min, dk/dtravel, dk/dω, the term of the governing angle alone."""
    reference = FRAMES[name]
    expected = {key: abs(float(value)) for key, value in plain.worths(reference).items()}
    result = worths(solved(framed(reference)))
    assert result == {
        "X0": pytest.approx(expected["X0"], rel=1e-8),
        "N_min": pytest.approx(expected["N_min"], rel=1e-8),
        "travel": pytest.approx(expected["travel"], rel=1e-8),
        "speed": pytest.approx(expected["w"], rel=1e-8),
    }


def test_prices_of_the_packaged_scene_are_the_known_ones():
    """3196.19 N/m per rad/s, 739.68 N/m per mm of preload, 7.2092 per m, 868.65 N/m per mm of travel."""
    result = worths(solved(lo.load("shedding")))
    assert result == {
        "speed": pytest.approx(3196.191836106885, rel=1e-9),
        "X0": pytest.approx(739681.6814820211, rel=1e-9),
        "N_min": pytest.approx(7.20918976256772, rel=1e-9),
        "travel": pytest.approx(868647.1495575441, rel=1e-9),
    }


@pytest.mark.parametrize("reference", [replace(PAPER, N_min=20), MUCH], ids=["paper, a demand", "much"])
def test_prices_of_the_least_stiffness_are_confirmed_by_solving_again(reference):
    confirmed(framed(reference), "stiffness", "K1", ("X0", "N_min", "travel", "speed"), 1e-6)


@pytest.mark.parametrize(
    ("reference", "known"),
    [
        (PAPER, (15679.7298884, 235692.140706, 2.09635756e-3)),
        (PRINTED, (3469.3702032797, 224210.392871, 2.20371141e-3)),
        (PRESSED, (583.6413384231, 22545.653537, 0.01685469e-3)),
        (MUCH, None),
        (replace(PAPER, law="modified_sine", angles=(90, 80, 150, 40), N_min=200), None),
        (replace(PAPER, law=lopsided(8), C=35), None),
        (replace(PRINTED, shape="step", F=20), None),
    ],
    ids=["paper", "printed travel", "pressed", "much", "modified sine", "spline", "step"],
)
@pytest.mark.few(3)
def test_the_least_peak_force_is_that_of_a_search_over_preload_and_stiffness(reference, known):
    """Known values: the linear programme in K1 and K1 X0 of tests/reference/shedding.py."""
    force, K1, X0 = least_peak(reference, reference.X0)
    answer = solved(framed(reference), "force")
    assert answer.figures["contact_max"] == pytest.approx(force, rel=1e-9)
    assert answer.figures["contact_max"] == pytest.approx(
        peak(reference, answer.figures["K1"], answer.figures["X0"]), rel=1e-9
    )
    assert answer.figures["K1"] == pytest.approx(softest(reference, answer.figures["X0"]), rel=1e-9)
    assert [answer.figures["K1"], answer.figures["X0"]] == pytest.approx([K1, X0], rel=1e-6)
    if known:
        assert answer.figures["contact_max"] == pytest.approx(known[0], rel=1e-9)
        assert [answer.figures["K1"], answer.figures["X0"]] == pytest.approx(known[1:], rel=1e-6)


def test_the_least_peak_force_wants_a_stiffer_spring_than_the_least_stiffness():
    """15.7 kN with 235.7 kN/m against 22.4 kN with 102.6 kN/m."""
    scene = lo.load("shedding")
    soft, gentle = solved(scene), solved(scene, "force")
    assert soft.figures["contact_max"] == pytest.approx(22375.2600550662, rel=1e-9)
    assert gentle.figures["contact_max"] < 0.71 * soft.figures["contact_max"]
    assert gentle.figures["K1"] > 2 * soft.figures["K1"]


def test_a_bound_on_the_stiffness_binds_the_least_peak_force():
    scene = lo.load("shedding").set("bounds.K1.max", "150 kN/m")
    answer = solved(scene, "force")
    force, K1, X0 = least_peak(PAPER, 0.08, 150e3)
    assert answer.figures["contact_max"] == pytest.approx(19942.992051816, rel=1e-9)
    assert answer.figures["contact_max"] == pytest.approx(force, rel=1e-9)
    assert [answer.figures["K1"], answer.figures["X0"]] == pytest.approx([K1, X0], rel=1e-7)
    confirmed(scene, "force", "contact_max", ("K1", "travel", "speed"), 1e-5)


def test_prices_of_the_least_peak_force_are_confirmed_by_solving_again():
    """Where the preload is free, a demand of one newton more shifts all of the force by one."""
    scene = framed(MUCH)
    assert worths(solved(scene, "force"))["N_min"] == pytest.approx(1, rel=1e-9)
    confirmed(scene, "force", "contact_max", ("N_min", "travel", "speed"), 1e-5)


@pytest.mark.few(3)
@pytest.mark.parametrize(
    ("reference", "K1"),
    [
        (PAPER, 8029.14),
        (PAPER, 6176.1875),
        (PRINTED, 8029.14),
        (MUCH, 20000),
        (PRESSED, 3000),
        (replace(PAPER, law="harmonic", angles=(150, 0, 150, 60)), 15000),
        (replace(PAPER, law=lopsided(7), shape="step"), 30000),
    ],
    ids=["paper", "by statics", "printed travel", "much", "pressed", "harmonic", "spline"],
)
def test_the_highest_speed_is_where_the_spring_becomes_the_least(reference, K1):
    answer = solved(framed(reference).set("mechanism.K1", f"{K1} N/m"), "speed")
    speed = answer.figures["contact_speed"]
    assert answer.design["speed"] == pytest.approx(speed, rel=1e-9)
    assert answer.design["K1"] == K1
    assert answer.design["X0"] == reference.X0
    needed = [plain.least_stiffness(replace(reference, rpm=speed / RPM * share))[0] for share in (1, 1 + 1e-6)]
    assert needed[0] == pytest.approx(K1, rel=1e-9)
    assert needed[1] > K1


@pytest.mark.parametrize("target_speed", ["15 rpm", "140 rpm", "2400 rpm"])
def test_the_highest_speed_does_not_depend_on_todays(target_speed):
    """144.508702549280 rpm."""
    answer = solved(lo.load("shedding").set("operation.speed", target_speed), "speed")
    assert answer.figures["contact_speed"] / RPM == pytest.approx(144.508702549280, rel=1e-9)


def test_a_speed_that_is_bounded_stops_at_its_bound():
    scene = lo.load("shedding").set("bounds.speed", {"min": "60 rpm", "max": "100 rpm"})
    answer = solved(scene, "speed")
    assert answer.design["speed"] / RPM == pytest.approx(100, rel=1e-9)
    assert [price.limit for price in answer.binding] == ["speed"]


def test_prices_of_the_highest_speed_are_those_of_the_least_stiffness_turned_round():
    """dω/dp = −(dk/dp)/(dk/dω), and 1/(dk/dω) for the stiffness itself."""
    reference = replace(PAPER, N_min=20)
    scene = framed(reference)
    answer = solved(scene, "speed")
    slopes = plain.worths(replace(reference, rpm=answer.figures["contact_speed"] / RPM))
    expected = {"K1": 1 / slopes["w"]} | {name: -slopes[name] / slopes["w"] for name in ("X0", "travel", "N_min")}
    result = worths(answer)
    assert result == {name: pytest.approx(abs(float(value)), rel=1e-7) for name, value in expected.items()}
    confirmed(scene, "speed", "speed", ("K1", "X0", "travel", "N_min"), 1e-5)


@pytest.mark.parametrize("target", ["stiffness", "force", "speed"])
def test_starting_at_an_answer_gives_it_again(target):
    scene = lo.load("shedding")
    cold = solved(scene, target)
    warm = lo.solve(scene, target, warm_start=cold)
    assert warm.status == "optimal"
    assert warm.design == pytest.approx(cold.design, rel=1e-8)


def test_freed_angles_soften_the_spring_and_still_make_a_turn():
    """Rise and return take what the dwells can give: 130° each, dwells at their least of 50°, by symmetry."""
    scene = lo.load("shedding")
    answer, fixed = solved(scene.free("rise")), solved(scene)
    assert answer.figures["K1"] < 0.9 * fixed.figures["K1"]
    angles = [math.degrees(answer.design[name]) for name in ("rise", "far_dwell", "return", "near_dwell")]
    assert sum(angles) == pytest.approx(360, rel=1e-12)
    assert [angles[1], angles[3]] == pytest.approx([50, 50], abs=1e-6)
    best = plain.least_stiffness(replace(PAPER, angles=tuple(angles)))[0]
    assert answer.figures["K1"] == pytest.approx(float(best), rel=1e-9)
    equal = plain.least_stiffness(replace(PAPER, angles=(130, 50, 130, 50)))[0]
    assert answer.figures["K1"] <= float(equal) * (1 + 1e-9)
    assert [angles[0], angles[2]] == pytest.approx([130, 130], abs=1e-4)


TIED = {
    "operation.N_min": "200 N",
    "mechanism.rise": "110 deg",
    "mechanism.far_dwell": "80 deg",
    "mechanism.return": "130 deg",
    "mechanism.near_dwell": "40 deg",
    "effects.weight.G": "190 N",
    "effects.warp_tension.T1": "150 N",
    "effects.warp_tension.T2": "110 N",
    "effects.inertia.M": "19.4 kg",
    "bounds.X0.max": "120 mm",
}
"""The near dwell asks for (200 + 190 + 150)/0.12 = 4500 N/m; inertia for less at low speeds."""


@pytest.mark.parametrize(("law", "rpm"), [("modified_sine", 160), ("modified_sine", 60), ("cycloidal", 145)])
def test_a_spring_chosen_by_statics_holds_at_the_speed_it_is_certified_for(law, rpm):
    answer = solved(lo.load("shedding").update({**TIED, "mechanism.law": law, "operation.speed": f"{rpm} rpm"}))
    assert answer.figures["K1"] == pytest.approx(4500.0, rel=1e-9)
    assert answer.figures["contact_speed"] >= answer.figures["speed"]


def test_the_speed_a_spring_chosen_by_statics_survives_is_that_at_which_inertia_asks_for_it():
    scene = lo.load("shedding").update({**TIED, "mechanism.law": "modified_sine", "operation.speed": "160 rpm"})
    survived = solved(scene).figures["contact_speed"] / RPM
    softer, stiffer = (solved(scene.set("operation.speed", f"{f * survived!r} rpm")) for f in (1 - 1e-6, 1 + 1e-6))
    assert softer.figures["K1"] == pytest.approx(4500.0, rel=1e-9)
    assert stiffer.figures["K1"] > 4500.0 * (1 + 1e-7)


@pytest.mark.parametrize("excess", [-1e-3, 0.0, 1e-3])
def test_a_bound_that_is_really_broken_at_rest_is_held_at_no_speed(excess):
    """K1 X0 = 540 N holds exactly what N_min, weight and warp ask; a thousandth less does not."""
    scene = lo.load("shedding").update({**TIED, "operation.speed": "145 rpm", "mechanism.X0": "0.12 m"})
    evaluation = lo.evaluate(scene.set("mechanism.K1", f"{4500.0 * (1 + excess)!r} N/m"))
    assert (evaluation.figures["contact_speed"] == 0.0) == (excess < 0.0)
