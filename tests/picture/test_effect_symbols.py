"""Symbols of effects in equations: of what is given only, no two alike, names with dots read back by SymPy."""

from importlib.metadata import EntryPoint

import pytest

import loomopt as lo
from loomopt.base.quantities import Length, Mass
from loomopt.jobs import registry
from loomopt.physics.effects.kinds import Check, Load
from loomopt.physics.schema import Figure, Table
from loomopt.picture.equations import sympy


class PointTable(Table):
    """A mass, where it sits, and two numbers that may be left out; kg, m, kg, m."""

    m: Mass
    at: Length = 0.0
    J4: Mass | None = None
    phi: Length | None = None


def force(at):
    result = at.table["m"] * at.table["at"] ** 2 * at.pose.acceleration
    return result + sum(at.table[key] for key in ("J4", "phi") if key in at.table)


MASS = Load(name="mass", summary="a mass", table=PointTable, rank=15, acts="output", force=force, many=True)
SINGLE = Load(name="single", summary="one", table=PointTable, rank=16, acts="output", force=force)
DOTS: Check[object] = Check(
    name="dots",
    summary="names with dots",
    table=Table,
    rows={"mu.x": lambda at: at.values["l2"] + at.values["l3"]},
    figures=(Figure("mu.x", "length", "a row"),),
)
NAMES = {"mass": "MASS", "single": "SINGLE", "dots": "DOTS"}


@pytest.fixture
def written(monkeypatch):
    """Return the equations of the beat-up with these effects' tables, by name."""
    points = tuple(EntryPoint(f"beatup.{name}", f"{__name__}:{of}", registry.EFFECTS) for name, of in NAMES.items())
    monkeypatch.setattr(registry, "entry_points", lambda group: points if group == registry.EFFECTS else ())

    def of(**tables):
        scene = lo.load("beatup").update({f"effects.{name}": table for name, table in tables.items()})
        return {equation.name: equation for equation in scene.equations()}

    return of


def right(equation):
    """Return the right side as SymPy reads it."""
    return sympy().sympify(equation.text.split(" = ")[1].replace("^", "**").replace("q''", "q2"))


def names(equation):
    return {str(free_symbol) for free_symbol in right(equation).free_symbols}


def test_a_key_that_is_not_given_is_not_written(written):
    assert names(written(single={"m": "1 kg"})["single"]) == {"m", "at", "omega", "q2"}
    assert "J4_single" in names(written(single={"m": "1 kg", "J4": "2 kg"})["single"])


def test_no_two_numbers_share_a_symbol(written):
    """J4 is the reed's, phi the crank's angle, and each instance has numbers of its own."""
    result = written(
        single={"m": "1 kg", "J4": "2 kg", "phi": "3 mm"},
        mass={"rod": {"m": "1 kg", "J4": "2 kg"}, "rocker": {"m": "1 kg"}},
    )
    assert names(result["inertia"]) >= {"J4", "m4e", "r4e"}
    assert names(result["mass.rod"]) == {"rod_m", "rod_at", "rod_J4", "omega", "q2"}
    assert names(result["mass.rocker"]) == {"rocker_m", "rocker_at", "omega", "q2"}
    assert names(result["single"]) == {"m", "at", "J4_single", "phi_single", "omega", "q2"}
    assert names(result["balance"]) >= {"M_mass_rod", "M_mass_rocker", "M_single"}


def test_names_with_dots_are_read_back_and_drawn(written):
    result = written(dots={}, mass={"rod": {"m": "1 kg"}})
    assert result["dots"].text == "mu_x = l2 + l3"
    assert result["dots"].latex == r"\mathrm{mu\ x} = l_{2} + l_{3}"
    assert r"M_{\mathrm{mass\ rod}} =" in result["mass.rod"].latex
