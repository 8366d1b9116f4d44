"""What an effect of any kind would have least, and what of it may change nothing: a counterweight as a load."""

from dataclasses import replace
from importlib.metadata import EntryPoint
from typing import Any

import pytest

import loomopt as lo
from loomopt.base.quantities import Length, Mass
from loomopt.jobs import registry
from loomopt.physics.effects.kinds import FlatNumber, Load
from loomopt.physics.schema import Table


class BallastTable(Table):
    """Mass and radius, and a number that nothing reads; kg, m, m."""

    mass: Mass
    radius: Length
    spare: Length = 0.004


BALLAST: Load[Any] = Load(
    name="ballast",
    summary="a counterweight on the rocker",
    table=BallastTable,
    rank=15,
    acts="output",
    force=lambda at: at.table["mass"] * at.table["radius"] ** 2 * at.pose.acceleration,
    needs=("operation.speed",),
    least="mass",
    axes=(FlatNumber("spare", "spare"),),
)
UNSAID = replace(BALLAST, least="", axes=())
CHANGES = {
    "bounds.m4e": "0 kg",
    "bounds.r4e": "0 mm",
    "effects.ballast": {"mass": "7 kg", "radius": "60 mm"},
    "bounds.mass": {"min": "0 kg", "max": "12.4 kg"},
    "bounds.radius": {"min": "0 mm", "max": "80 mm"},
    "bounds.spare": {"min": "1 mm", "max": "9 mm"},
}


def weighted(monkeypatch, effect):
    """Return the beat-up whose counterweight is a made-up load."""
    name = "SAID" if effect is BALLAST else "UNSAID"
    points = {registry.EFFECTS: (EntryPoint("beatup.ballast", f"test_least_numbers:{name}", registry.EFFECTS),)}
    monkeypatch.setattr(registry, "entry_points", lambda group: points.get(group, ()))
    return lo.load("beatup").update(CHANGES)


SAID = BALLAST


@pytest.mark.slow
def test_the_least_of_a_load_s_number_is_a_level_after_the_target_s_own(monkeypatch):
    """The same inertia as of the job's own counterweight, at the largest radius: so the same mass."""
    plain = lo.solve("beatup")
    answer = lo.solve(weighted(monkeypatch, BALLAST))
    assert (answer.status, answer.certificate.passed) == ("optimal", True)
    assert answer.figures["peak_torque"] == pytest.approx(plain.figures["peak_torque"], rel=1e-9)
    assert plain.design["r4e"] == pytest.approx(0.080, rel=1e-12)
    assert answer.design["radius"] == pytest.approx(0.080, rel=1e-7)
    assert answer.design["mass"] == pytest.approx(plain.design["m4e"], rel=1e-7)
    assert [level.objective for level in answer.certificate.levels][:3] == ["M3_fdc", "peak_torque", "mass"]
    assert answer.design["spare"] == pytest.approx(0.004, rel=1e-9), "nothing reads it: today's"


@pytest.mark.slow
def test_a_load_that_says_nothing_keeps_nearest_to_today(monkeypatch):
    answer = lo.solve(weighted(monkeypatch, UNSAID))
    assert answer.certificate.passed
    assert answer.design["mass"] > 8.0


def test_a_number_that_is_held_is_no_level(monkeypatch):
    scene = weighted(monkeypatch, BALLAST).set("bounds.mass", "2 kg")
    assert [level.figure for level in registry.of(scene).program(scene, "balance").objectives] == [
        "M3_fdc",
        "peak_torque",
    ]


def test_what_is_no_number_of_a_load_cannot_be_least():
    with pytest.raises(ValueError, match="weight is no key of the table"):
        replace(BALLAST, least="weight")
