"""The return spring as coils that can be made, against a search by hand over diameters and every wire that is sold.

Formulas: Shigley's Mechanical Engineering Design, ch. 10; recomputed here and in `coil_by_hand` in plain arithmetic.
"""

import copy
import functools
import math
from dataclasses import replace

import numpy as np
import pytest
from jsonschema import Draft202012Validator
from support import slow
from support.shedding_cases import plain, product

import loomopt as lo
from loomopt.interface.text import json_schema
from loomopt.jobs import registry
from loomopt.physics.effects.shedding.coil import WIRES
from loomopt.solving.answer.report import evaluate
from reference.coils import Contact, Steel, hook, length, lightest, mass, rate, shear, softest, surge, tensile, winding

STEEL = Steel()
SOLD = [wire for wire in WIRES if 0.002 <= wire <= 0.0095]
"""What the packaged scenes' bounds allow."""
RPM = math.pi / 30
RATE = "coils give K1"


@functools.cache
def coiled(name="shedding-printed-travel", target=None, **changes):
    """Return the answer of a packaged scene with coils; in keys, __ stands for a dot."""
    scene = lo.load(name).with_effect("coil")
    return lo.solve(scene.update({key.replace("__", "."): value for key, value in changes.items()}), target, starts=1)


def loosened(answer, relaxation, more):
    """Return an answer's scene with a relaxation granted, `more` beyond it, relative to what it asks for."""
    value = relaxation.needed * (1 + more * (1 if relaxation.side == "max" else -1))
    key, unit = {
        "speed": ("operation.speed", "rad/s"),
        "travel": ("mechanism.travel", "m"),
        "bending_share": ("effects.coil.bending_share", ""),
        "surge_ratio": ("effects.coil.surge_ratio", ""),
        "spring_length": ("effects.coil.spring_length", "m"),
        "wire": ("bounds.wire", "m"),
    }[relaxation.limit]
    return answer.scene.set(key, f"{value!r} {unit}".strip())


# The softest coils -----------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_coils_of_the_printed_travel_are_the_softest_of_all_that_are_sold():
    """Every size by hand; the solver tries the neighbours of the ideal size only."""
    answer, contact = coiled(), Contact(plain.PRINTED)
    by_hand = {wire: K1 for wire in SOLD if (K1 := softest(STEEL, contact, wire))}
    assert len(by_hand) == 8
    best = min(by_hand, key=by_hand.get)
    assert (answer.status, answer.certificate.passed, answer.certificate.whole_cycle) == ("optimal", True, "bounded")
    assert answer.design["wire"] == best == 0.0085
    assert answer.design["wire"] in WIRES
    assert answer.figures["K1"] == pytest.approx(by_hand[best], rel=1e-7)
    assert "of those sold, tried 8.5 mm, 9 mm" in answer.message


@pytest.mark.parametrize("wire", [size for size in SOLD if size >= 0.0056])
@pytest.mark.few(1)
def test_every_size_by_itself_is_as_soft_as_by_hand(wire):
    known = softest(STEEL, Contact(plain.PRINTED), wire)
    answer = coiled(effects__coil__sizes="any", bounds__wire=f"{wire!r} m")
    assert answer.status == ("optimal" if known else "infeasible")
    if known:
        assert answer.design["wire"] == wire
        assert answer.figures["K1"] == pytest.approx(known, rel=1e-7)
        assert answer.figures["K1"] >= coiled().figures["K1"] * (1 - 1e-9)


def test_any_size_is_a_little_softer_than_those_sold():
    free, sold = coiled(effects__coil__sizes="any"), coiled()
    assert free.status == "optimal"
    assert free.design["wire"] not in WIRES
    assert 0.0085 < free.design["wire"] < 0.009
    assert free.figures["K1"] == pytest.approx(softest(STEEL, Contact(plain.PRINTED), free.design["wire"]), rel=1e-7)
    assert 0.99 * sold.figures["K1"] < free.figures["K1"] < sold.figures["K1"]
    assert f"Any size would have wire {1e3 * free.design['wire']:.6g} mm" in sold.message


@pytest.mark.few(1)
@pytest.mark.parametrize("name", ["sold", "any", "short", "slow"])
def test_every_figure_of_the_coils_is_plain_arithmetic_and_every_demand_is_held(name):
    changes = {"any": {"effects__coil__sizes": "any"}, "short": {"effects__coil__spring_length": "200 mm"}}
    answer = coiled("shedding", operation__speed="300 rpm") if name == "slow" else coiled(**changes.get(name, {}))
    assert answer.status == "optimal"
    v, result, cam = answer.design, answer.figures, answer.scene.operation["speed"] / (2 * math.pi)
    travel = answer.scene.mechanism["travel"]
    d, D, n, initial = (v[key] for key in ("wire", "diameter", "turns", "initial_tension"))
    F, stretch = v["K1"] * (v["X0"] + travel) / 2, v["X0"] + travel
    space = 0.200 if name == "short" else 0.400
    expected = {
        "coil_index": D / d,
        "shear_stress": shear(d, D, F),
        "shear_share": shear(d, D, F) / tensile(STEEL, d),
        "bending_share": hook(d, D, F) / tensile(STEEL, d),
        "surge_ratio": surge(STEEL, d, D, n) / cam,
        "spring_length": length(STEEL, d, D, n, initial, stretch),
        "spring_mass": 2 * mass(STEEL, d, D, n),
        "spring_force_max": 2 * F,
        "K1": 2 * rate(STEEL, d, D, n),
    }
    for key, value in expected.items():
        assert result[key] == pytest.approx(value, rel=1e-9), key
    least, most = winding(d, D)
    small = 1e-9
    assert 4 - small <= expected["coil_index"] <= 12 + small
    assert expected["shear_share"] <= 0.5 + small
    assert expected["bending_share"] <= 0.75 + small
    assert expected["surge_ratio"] >= 13 * (1 - small)
    assert expected["spring_length"] <= space * (1 + small)
    assert least * (1 - small) <= initial <= min(most, v["K1"] * v["X0"] / 2) * (1 + small)
    assert all(limit.ok for limit in answer.limits)
    assert result["contact_min"] >= -1e-9 * result["contact_max"]


def test_todays_coils_that_do_not_give_k1_are_shown_as_not_held():
    """6 mm wire on 45 mm, 8 turns, two of them: 34311 N/m, not 8029.14; their 100 N are less than winding gives."""
    scene = lo.load("shedding-printed-travel").with_effect("coil")
    limits = {limit.name: limit for limit in lo.evaluate(scene).limits}
    given = 2 * rate(STEEL, 0.006, 0.045, 8)
    assert given == pytest.approx(34311.111, rel=1e-7)
    assert limits[RATE].value == pytest.approx(given - 8029.14, rel=1e-12)
    assert not limits[RATE].ok
    assert not limits["initial tension: no less than winding gives"].ok
    assert winding(0.006, 0.045)[0] > 100
    subset = (
        "coil_index",
        "shear_share",
        "bending_share",
        "surge_ratio",
        "spring_length",
        "coils are drawn open at the top",
    )
    assert all(limits[name].ok for name in subset)
    right = lo.evaluate(scene.set("mechanism.K1", f"{given!r} N/m"))
    assert next(limit for limit in right.limits if limit.name == RATE).ok


# Where no coil will do -------------------------------------------------------------------------------------------


def test_at_600_rpm_and_the_long_travel_no_coil_will_do_and_the_reason_is_said():
    """tau >= 2 K_W (X0 + travel) f sqrt(2 G rho) of any coil that surges at f, with the slimmest index 12."""
    answer = coiled("shedding")
    assert answer.status == "infeasible"
    assert not any(softest(STEEL, Contact(plain.PAPER), wire) for wire in SOLD)
    wahl = 47 / 44 + 0.615 / 12
    least = 2 * wahl * 0.1456 * 13 * 10 * math.sqrt(2 * STEEL.G * STEEL.density)
    most = STEEL.shear_share * STEEL.strength / 2**STEEL.exponent
    assert least == pytest.approx(float(plain.stress_bound(0.1456, 130, shear=STEEL.G)), rel=1e-12)
    assert least > most
    for text in (f"{least / 1e6:.4g} MPa", f"{most / 1e6:.4g} MPa", "2 K_W (X0 + travel) f sqrt(2 G rho)", "145.6 mm"):
        assert text in answer.message
        assert text in answer.explanation
    assert all(word in answer.explanation for word in ("lower speed", "less travel", "softer cam law"))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "changes"), [("shedding", {}), ("shedding-printed-travel", {"bounds__wire": "6 mm"})])
def test_the_least_relaxations_help_when_granted_and_not_when_cut_short(name, changes):
    answer = coiled(name, **changes)
    assert answer.status == "infeasible"
    alone = [relaxation for relaxation in answer.relaxation if relaxation.alone]
    assert "speed" in [relaxation.limit for relaxation in alone]
    for relaxation in alone:
        helped = lo.solve(loosened(answer, relaxation, 1e-3), starts=1)
        assert helped.status == "optimal", relaxation.text
    shortest = next(relaxation for relaxation in alone if relaxation.limit == "speed")
    assert lo.solve(loosened(answer, shortest, -1e-3), starts=1).status == "infeasible"


@pytest.mark.slow
def test_the_fastest_cam_that_any_coil_keeps_up_with_is_that_found_by_hand():
    """The thickest wire; by hand some diameter will do just below the speed, none just above it."""
    (relaxation,) = [item for item in coiled("shedding").relaxation if item.limit == "speed"]
    rpm = relaxation.needed / RPM
    for share, remaining in ((0.9995, True), (1.0005, False)):
        contact = Contact(replace(plain.PAPER, rpm=rpm * share))
        assert any(softest(STEEL, contact, wire, 10_001) for wire in (0.009, 0.0094, 0.0095)) is remaining


@pytest.mark.few(1)
@pytest.mark.parametrize("rpm", [100, 200, 300, 370])
def test_slower_cams_of_the_long_travel_have_coils(rpm):
    answer, contact = coiled("shedding", operation__speed=f"{rpm} rpm"), Contact(replace(plain.PAPER, rpm=rpm))
    assert (answer.status, answer.certificate.whole_cycle) == ("optimal", "bounded")
    best = min(K1 for wire in SOLD if (K1 := softest(STEEL, contact, wire)))
    assert answer.figures["K1"] == pytest.approx(best, rel=1e-7)
    assert answer.design["wire"] in WIRES


def test_the_stress_bound_is_told_only_where_it_is_broken():
    """At 200 rpm coils carry 491.8 MPa of 915.8 at least: here it is the space that is short."""
    answer = coiled("shedding", operation__speed="200 rpm", effects__coil__spring_length="100 mm")
    assert answer.status == "infeasible"
    assert "491.8 MPa" not in answer.message


@pytest.mark.slow
def test_sizes_that_are_not_sold_are_no_answer():
    answer = coiled(bounds__wire__min="8.6 mm", bounds__wire__max="8.9 mm")
    assert answer.status == "infeasible"
    assert "No wire that is sold gives an admissible design (tried none in bounds)" in answer.message
    assert answer.certificate is None


# Prices and other targets ----------------------------------------------------------------------------------------

FIXED = {"bounds__wire": "8.5 mm"}
SHORT = {"bounds__wire": "8 mm", "effects__coil__spring_length": "200 mm"}
PRICED = {
    "surge_ratio": (FIXED, "effects__coil__surge_ratio", 13.0, "", -1),
    "bending_share": (FIXED, "effects__coil__bending_share", 0.75, "", 1),
    "speed": (FIXED, "operation__speed", 20 * math.pi, " rad/s", -1),
    "travel": (FIXED, "mechanism__travel", 0.0145, " m", -1),
    "wire": (FIXED, "bounds__wire", 0.0085, " m", 1),
    "spring_length": (SHORT, "effects__coil__spring_length", 0.2, " m", 1),
}


@pytest.mark.parametrize("name", PRICED)
@pytest.mark.few(1)
def test_prices_of_the_coils_are_those_of_solving_again(name):
    changes, key, now, unit, loosen = PRICED[name]
    price = next(price for price in coiled(**changes).binding if price.limit == name)
    step = 1e-4 * now
    ends = [coiled(**{**changes, key: f"{now + sign * step!r}{unit}"}) for sign in (1, -1)]
    assert [end.status for end in ends] == ["optimal"] * 2
    slope = (ends[0].figures["K1"] - ends[1].figures["K1"]) / (2 * step)
    assert abs(slope) * now > 1e-3 * ends[0].figures["K1"]
    assert price.worth["K1"] == pytest.approx(-loosen * slope, rel=1e-4)


@pytest.mark.slow
def test_with_the_law_freed_the_coils_are_softer_and_the_softest_of_that_law():
    answer = coiled(target="law", targets__law__intervals=8)
    assert (answer.status, answer.certificate.whole_cycle) == ("optimal", "bounded")
    assert answer.design["wire"] in WIRES
    assert answer.figures["K1"] < 0.8 * coiled().figures["K1"]
    case = replace(plain.PRINTED, law=tuple(answer.design["law"]))
    assert answer.figures["K1"] == pytest.approx(softest(STEEL, Contact(case), answer.design["wire"]), rel=1e-7)


@pytest.mark.slow
def test_the_least_peak_force_with_coils_is_less_than_with_the_softest_of_them():
    answer, softer = coiled(target="force"), coiled()
    assert (answer.status, answer.certificate.whole_cycle) == ("optimal", "bounded")
    assert answer.design["wire"] in WIRES
    assert answer.design["wire"] == 0.0075
    assert all(limit.ok for limit in answer.limits)
    free = lo.solve(lo.load("shedding-printed-travel"), "force", starts=1).figures["contact_max"]
    assert free < answer.figures["contact_max"] < softer.figures["contact_max"]
    v = answer.design
    assert v["K1"] == pytest.approx(2 * rate(STEEL, v["wire"], v["diameter"], v["turns"]), rel=1e-9)


TODAY = {"wire": "7.5 mm", "diameter": "45 mm", "turns": "8", "initial_tension": "450 N"}
"""Coils that keep every demand at 25 mm of preload."""


@pytest.mark.few(1)
@pytest.mark.parametrize(("ratio", "stops"), [("13", "contact"), ("18", "surge")])
def test_the_highest_speed_of_todays_coils_is_where_contact_ends_or_they_surge(ratio, stops):
    values = {f"effects__coil__{key}": value for key, value in TODAY.items()} | {"effects__coil__surge_ratio": ratio}
    answer = coiled(target="speed", mechanism__X0="25 mm", **values)
    K1 = 2 * rate(STEEL, 0.0075, 0.045, 8)
    contact = float(plain.contact_speed(replace(plain.PRINTED, X0=0.025), K1))
    surging = 60 * surge(STEEL, 0.0075, 0.045, 8) / float(ratio)
    assert (answer.status, answer.certificate.whole_cycle) == ("optimal", "bounded")
    assert answer.design["K1"] == pytest.approx(K1, rel=1e-9)
    assert (contact < surging) == (stops == "contact")
    assert answer.design["speed"] / RPM == pytest.approx(min(contact, surging), rel=1e-9)
    assert {name: answer.design[name] for name in ("wire", "turns", "X0")} == pytest.approx(
        {"wire": 0.0075, "turns": 8, "X0": 0.025}, rel=1e-12
    )


@pytest.mark.slow
def test_at_too_great_a_stress_no_speed_will_do():
    """6 mm wire drawn by 94.5 mm: the hooks carry 1.9 GPa, whatever the speed."""
    answer = coiled(target="speed", effects__coil__initial_tension="200 N")
    force = rate(STEEL, 0.006, 0.045, 8) * 0.0945
    assert hook(0.006, 0.045, force) > 1.5 * STEEL.bending_share * tensile(STEEL, 0.006)
    assert answer.status == "infeasible"
    assert answer.relaxation


# Machines at random ----------------------------------------------------------------------------------------------


def machine(seed):
    """Return a small heald frame; [Qiu21]'s is of 37.7 kg, 14.5 or 65.6 mm, 600 rpm."""
    draw = np.random.default_rng(seed)
    M, T1 = draw.uniform(3, 40), draw.uniform(20, 150)
    return plain.Scene(
        travel=round(draw.uniform(5, 40)) / 1000,
        rpm=round(draw.uniform(200, 700)),
        M=round(M, 3),
        G=round(9.8 * M, 2),
        T1=round(T1, 2),
        T2=round(T1 * draw.uniform(0.3, 1), 2),
        C=float(draw.choice([0, 35])),
        N_min=float(draw.choice([0, 20])),
        law=str(draw.choice(["cycloidal", "modified_sine", "polynomial_345"])),
    )


@pytest.mark.slow
@pytest.mark.parametrize("seed", slow.after(4, range(12)))
def test_coils_of_random_machines_are_the_softest_and_then_the_lightest_that_are_sold(seed):
    case = machine(seed)
    answer, contact = lo.solve(product(case).with_effect("coil"), starts=1), Contact(case)
    by_hand = {wire: K1 for wire in SOLD if (K1 := softest(STEEL, contact, wire))}
    assert (answer.status, answer.certificate.whole_cycle) == ("optimal", "bounded")
    assert answer.design["wire"] in WIRES
    best = min(by_hand.values())
    assert answer.figures["K1"] == pytest.approx(best, rel=1e-7)
    alike = [wire for wire in by_hand if by_hand[wire] <= best * (1 + 1e-9)]
    if len(alike) > 1:
        masses = {wire: m for wire in alike if (m := lightest(STEEL, contact, wire, best * (1 + 1e-12)))}
        assert answer.design["wire"] == min(masses, key=masses.get)
        assert answer.figures["spring_mass"] == pytest.approx(min(masses.values()), rel=1e-7)


def test_a_design_of_coils_evaluates_to_its_own_figures():
    answer = coiled()
    again = evaluate(answer.scene, answer.design)
    assert dict(again.figures) == dict(answer.figures)
    assert again.admissible


def coil_keys(**changes):
    """Return a scene's keys of the coil, its numbers of today and others."""
    scene = lo.load("shedding")
    return scene.set("effects.coil", {**scene.document["available"]["coil"], **changes})


@pytest.mark.parametrize("diameter", ["6 mm", "5.999 mm", "1 mm"])
@pytest.mark.parametrize("factor", ["Wahl", "EN 13906"])
def test_a_coil_no_wider_than_its_wire_is_refused_in_scenes_and_in_designs(diameter, factor):
    with pytest.raises(lo.BadInput, match=r"effects\.coil: the coil cannot be made: its diameter is not larger"):
        coil_keys(diameter=diameter, factor=factor)
    scene = coil_keys(factor=factor).set("bounds.wire", {"min": "1 mm", "max": "50 mm"})
    scene = scene.set("bounds.diameter", {"min": "1 mm", "max": "50 mm"})
    with pytest.raises(lo.BadInput, match="the coil cannot be made"):
        lo.evaluate(scene, {"wire": "6 mm", "diameter": diameter})


def test_hooks_bent_to_half_their_wire_are_refused():
    with pytest.raises(lo.BadInput, match="hook_factor is not larger than wire / diameter"):
        coil_keys(diameter="12 mm", hook_factor="0.5")
    assert lo.evaluate(coil_keys(diameter="12 mm", hook_factor="0.51")).figures["bending_share"] > 0.0


@pytest.mark.parametrize(
    ("changes", "part"),
    [
        ({"initial_tension": {"min": "20 N"}}, "initial_tension: it is no band of two forces"),
        ({"initial_tension": {"min": "20 N", "max": "3 mm"}}, "initial_tension: it is no band of two forces"),
        ({"initial_tension": {"min": "20 N", "max": "30 N", "most": "3 N"}}, "it is no band of two forces"),
        (
            {"initial_tension": {"min": "30 N", "max": "20 N"}},
            "initial_tension_max: the largest initial tension is less",
        ),
        ({"initial_tension_min": "30 N", "initial_tension_max": "20 N"}, "initial_tension_max: the largest initial"),
        ({"initial_tension": ["20 N", "30 N"]}, "initial_tension: it is not a quantity"),
        ({"hook_length": "20 mm"}, 'hook_length: .*Write hooks = "free"'),
    ],
)
def test_a_key_of_the_wrong_shape_or_without_effect_is_refused(changes, part):
    with pytest.raises(lo.BadInput, match=part):
        coil_keys(**changes)


@pytest.mark.parametrize(
    ("tension", "accepted"),
    [
        ("100 N", True),
        ({"min": "20 N", "max": "30 N"}, True),
        ({"min": "20 N"}, False),
        ({"min": "2 N", "max": "3"}, False),
    ],
)
def test_the_json_schema_accepts_a_band_of_the_initial_tension(tension, accepted):
    document = copy.deepcopy(dict(coil_keys().document))
    document["effects"]["coil"]["initial_tension"] = tension
    schema = json_schema.scene(registry.declared("shedding"))
    assert Draft202012Validator(schema).is_valid(document) is accepted
