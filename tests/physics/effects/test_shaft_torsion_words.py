"""The twisting shaft: what it takes away, what it refuses, what it shows and says."""

import math

import numpy as np
import pytest
from twisting_shafts import CENTRES, HALF, J4, OMEGA, PLAIN, read, sampler, shaft, twist

import loomopt as lo
from loomopt.base.quantities import shortest_text
from loomopt.interface import tables
from loomopt.interface.cli.app import run
from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.model.model import _with, with_words_fixed
from loomopt.model.sampling import Sampler
from loomopt.physics.effects.kinds import Load

# What it takes away, what it refuses, what it says ------------------------------------------------------------------


def test_the_rocker_s_own_inertia_stays_with_the_rocker():
    base, more = shaft(2e6, 45.0), shaft(2e6, 45.0).with_effect("rocker_inertia")
    phi = np.linspace(0.1, 6.0, 7)
    results = [registry.of(scene).sampler(scene, {}) for scene in (base, more)]
    pieces, u = results[0].cycle.located(phi)
    acceleration = (
        results[0].model.instant(systems.numpy(), results[0].given, results[0].node(pieces, u)).pose.acceleration
    )
    forces = [item.at("shaft_peak", pieces, u) for item in results]
    assert forces[1] - forces[0] == pytest.approx(0.05 * acceleration, rel=1e-11)
    assert twist(results[1], phi) == pytest.approx(twist(results[0], phi), rel=1e-14)


def test_the_counterweight_moves_with_the_reed():
    """With J from J4, m4e r4e² and JS alike the shaft's answer is the same."""
    whole = shaft(2e6, 45.0).set("effects.inertia.J4", "0.7 kg*m^2")
    parts = shaft(2e6, 45.0).update(
        {
            "effects.inertia.J4": "0.6 kg*m^2",
            "effects.counterweight_inertia.JS": "0.01 kg*m^2",
            "mechanism.m4e": "10 kg",
            "mechanism.r4e": "0.09486832980505138 m",
        }
    )
    first, other = (lo.evaluate(scene).figures for scene in (whole, parts))
    for name in ("M3_fdc", "peak_torque", "shaft_peak", "twist_peak", "reed_front"):
        assert first[name] == pytest.approx(other[name], rel=1e-11)


REFUSED = {
    "practically rigid": ({"stiffness": "100 MN*m/rad", "damping": "300 N*m*s/rad"}, "is 202.1 times the speed"),
    "no damping": ({"stiffness": "2 MN*m/rad", "damping": "0 N*m*s/rad"}, "out of range"),
    "no stiffness": ({"stiffness": "0 N*m/rad", "damping": "45 N*m*s/rad"}, "out of range"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_has_no_steady_state_to_trust_is_refused_by_name(case):
    table, message = REFUSED[case]
    with pytest.raises(lo.BadInput, match=message) as error:
        lo.evaluate(PLAIN.set("effects.shaft_torsion", table))
    assert error.value.key.startswith("effects.shaft_torsion")
    if case == "practically rigid":
        assert "rigid model" in error.value.remedy


@pytest.mark.parametrize("other", ["gravity", "bearing_friction"])
def test_effects_that_cannot_stand_beside_it_are_refused_naming_both(other):
    with pytest.raises(lo.BadInput, match=f"effects shaft_torsion and {other} cannot be on together"):
        PLAIN.with_effect("shaft_torsion").with_effect(other)
    clashes = {clash.effect for clash in PLAIN.schema.effects["shaft_torsion"].clashes}
    assert clashes == {"gravity", "bearing_friction", "speed_fluctuation"}


def test_it_needs_what_it_carries():
    with pytest.raises(lo.BadInput, match="needs the effect inertia"):
        PLAIN.without_effect("inertia").with_effect("shaft_torsion")


def test_a_load_with_corners_that_no_oscillator_answers_is_not_carried():
    from dataclasses import replace

    from loomopt.physics.effects.kinds import faults

    known = PLAIN.schema.effects
    resistance = known["resistance"]
    assert isinstance(resistance, Load)
    dumb = replace(resistance, response=None)
    on = [known["inertia"], dumb, known["shaft_torsion"]]
    (fault,) = faults({effect: effect.table(**effect.examples[0]) for effect in on})
    assert (
        fault.problem == "effect shaft_torsion carries resistance, which has corners: its response has no closed form"
    )


def test_a_machine_too_sharp_for_harmonics_is_refused():
    """10 um from a change point: at 180 deg rod and rocker are all but stretched."""
    with pytest.raises(lo.BadInput, match="too sharp for 512 harmonics"):
        lo.evaluate(shaft(2e6, 45.0).set("mechanism.l3", "133.01 mm"))


def test_sharper_machines_have_more_harmonics_and_the_digits_of_more_still():
    scene = shaft(2e6, 45.0).set("mechanism.l3", "140 mm")
    job = registry.of(scene)
    model, values = job.model(scene), job.numbers(scene)
    count = int({key: word for _, key, word in model.words}["harmonics"])
    assert count > 32
    more = _with(model, tuple((e, k, str(2 * count) if k == "harmonics" else w) for e, k, w in model.words), ())
    assert with_words_fixed(more, values) is more
    first, other = Sampler(model, values), Sampler(more, values)
    for name in ("shaft_peak", "twist_peak", "peak_torque"):
        assert first.peak(name) == pytest.approx(other.peak(name), rel=1e-12)


def test_means_resolve_what_rings_on_their_pieces():
    """Of a shaft that swings 16 times in the pulse the mean square is that of a rule ten times as fine."""
    stiff = registry.of(PLAIN).sampler(shaft(9e7, 200.0), {})
    (mean,) = stiff.model.integrals
    assert mean.parts == 5
    pieces, u = np.zeros(1, dtype=int), (np.arange(200000) + 0.5) / 200000
    inside = int(np.flatnonzero(stiff.cycle.on(("resistance", 1.0)))[0])
    squares = stiff.at("M3_square", np.full(len(u), inside) + pieces, u)
    assert stiff.single("pulse_rms") == pytest.approx(math.sqrt(np.mean(squares)), rel=1e-9)
    assert sampler(2e6, 45.0).model.integrals[0].parts == 1


def test_curves_show_reed_and_shaft_and_where_the_reed_is_nearest_to_the_fell():
    scene = shaft(2e6, 45.0)
    frame, figures = tables.curves(scene, {}), lo.evaluate(scene).figures
    assert frame["psi_r [rad]"].to_numpy() == pytest.approx((frame["psi [rad]"] + frame["twist [rad]"]).to_numpy())
    nearest = frame.iloc[int(frame["psi_r [rad]"].argmin())]
    assert nearest["psi_r [rad]"] == figures["reed_front"]
    marks = registry.of(scene).views.marks(scene, {})
    assert marks["reed front"] == pytest.approx(nearest["phi [rad]"], abs=1e-12)
    assert np.abs(frame["twist [rad]"]).max() == pytest.approx(figures["twist_peak"], rel=1e-14)
    assert frame["M3 [N*m]"].to_numpy() == pytest.approx(frame["shaft_torsion [N*m]"].to_numpy())
    assert np.abs(frame["M3 [N*m]"]).max() == pytest.approx(figures["shaft_peak"], rel=1e-14)


@pytest.mark.parametrize(("k", "share"), [(5e5, "17"), (2e6, None)])
def test_a_reed_that_twists_away_while_it_beats_up_is_remarked_upon(k, share):
    scene = shaft(k, 45.0 if k == 2e6 else 22.0)
    remarks = registry.of(scene).views.remarks(scene, {})
    second_sampler = sampler(k, 45.0 if k == 2e6 else 22.0)
    phi = np.linspace(CENTRES.beta - HALF, CENTRES.beta + HALF, 4001)
    largest, travel = np.abs(twist(second_sampler, phi)).max(), np.ptp(read(second_sampler, phi).pose.q)
    assert (largest > 0.1 * travel) == bool(share) == bool(remarks)
    if share:
        assert f"{100 * largest / travel:.3g} % of the rocker's travel there" in remarks[0]
    assert registry.of(PLAIN).views.remarks(PLAIN, {}) == ()


@pytest.mark.parametrize("command", ["evaluate", "simulate"])
def test_the_remark_stands_wherever_figures_or_curves_are_shown(command, capsys):
    assert (
        run([command, "beatup", "--with", "shaft_torsion", "--set", "effects.shaft_torsion.stiffness=5e5 N*m/rad"]) == 0
    )
    assert capsys.readouterr().err.startswith("Remark: while resistance acts the twist reaches")


def test_equations_are_the_effect_s_own_and_the_product_obeys_them():
    scene = shaft(2e6, 45.0).with_effect("rocker_inertia")
    written = [equation for equation in registry.of(scene).views.equations(scene) if equation.name == "shaft_torsion"]
    assert [equation.text for equation in written] == [
        "c*omega*z' + k*z + omega^2*z''*(J4 + m4e*r4e^2) = M_inertia + M_resistance",
        "z = -psi + psi_r after every turn the same",
        "M_shaft_torsion = c*omega*z' + k*z",
    ]
    balance = next(equation for equation in registry.of(scene).views.equations(scene) if equation.name == "balance")
    assert balance.text == "M3 = M_rocker_inertia + M_shaft_torsion"
    result, h = sampler(2e6, 45.0), 2e-4
    for phi in (0.5, 1.2, 2.5, 4.0):
        low, z, high = (float(twist(result, phi + sign * h)) for sign in (-1, 0, 1))
        pieces, u = result.cycle.located(np.array([phi]))
        terms = result.model.instant(systems.numpy(), result.given, result.node(pieces, u)).terms()
        carried = sum(float(np.ravel(value)[0]) for name, value in terms.items() if name != "shaft_torsion")
        left = J4 * OMEGA**2 * (high - 2 * z + low) / h**2 + 45.0 * OMEGA * (high - low) / (2 * h) + 2e6 * z
        assert left == pytest.approx(carried, abs=2e-2)


def test_an_inch_machine_at_350_rpm_is_told_in_its_own_units():
    metric = shaft(2e6, 45.0).set("operation.speed", "350 rpm")
    changes = {
        "effects.shaft_torsion.stiffness": shortest_text(2e6, "lbf*ft/deg", "rotary stiffness"),
        "effects.shaft_torsion.damping": shortest_text(45.0, "lbf*ft*s/rad", "rotary damping"),
        "display.torque": "lbf*ft",
    }
    inches = metric.update(changes)
    first, other = lo.evaluate(metric).figures, lo.evaluate(inches).figures
    assert other["shaft_peak"] == pytest.approx(first["shaft_peak"], rel=1e-14)
    assert "lbf*ft" in repr(lo.evaluate(inches))
