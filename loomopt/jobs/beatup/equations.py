"""The equations a beat-up scene really uses: each effect's own formula, run on symbols."""

from collections.abc import Mapping
from types import SimpleNamespace

from loomopt.maths import systems
from loomopt.model.model import JobModel
from loomopt.physics import balance
from loomopt.physics.mechanisms import crank_rocker
from loomopt.picture import effect_equations
from loomopt.picture.equations import Equation, Expression, Symbols, equation, loop, moving, symbol, sympy


def equations(model: JobModel) -> tuple[Equation, ...]:
    """Return the equations of a beat-up scene: geometry, dead centres, each term, balance, crank torque.

    An effect that is not in the scene leaves no symbol and no term.
    """
    return (
        *_geometry(),
        *_dead_centres(),
        equation("output", symbol("q"), -symbol("psi")),
        *effect_equations.forces(model, _pose(), effect_equations.given(model, _Symbols()), "M3", "M"),
    )


def terms(model: JobModel) -> Mapping[str, Expression]:
    """Return each load's term, N·m, by its effect's name: an expression in φ, ω, q, q', q'' and numbers."""
    return effect_equations.terms(model.loads, _pose(), effect_equations.given(model, _Symbols()))


def _geometry() -> list[Equation]:
    """Close the loop A B C D, and differentiate it once and twice: equations linear in the rates."""
    sp = sympy()
    l1, l2, l3, l4, phi, gamma, psi = (symbol(name) for name in ("l1", "l2", "l3", "l4", "phi", "gamma", "psi"))
    sides = (
        (l1 * sp.cos(phi) + l2 * sp.cos(gamma), l4 + l3 * sp.cos(psi)),
        (l1 * sp.sin(phi) + l2 * sp.sin(gamma), l3 * sp.sin(psi)),
    )
    return loop(sides, phi, (moving("gamma"), moving("psi")))


def _dead_centres() -> list[Equation]:
    """Run the mechanism's own closed forms on symbols."""
    lengths = crank_rocker.Lengths(*(symbol(name) for name in ("l1", "l2", "l3", "l4")))
    centres = crank_rocker.DeadCentres(systems.sympy(), lengths)
    beta, beta_r, psi = symbol("beta"), symbol("beta_r"), sympy().Function("psi")
    return [
        equation("front dead centre", beta, centres.beta),
        equation("rear dead centre", beta_r, centres.beta_r),
        equation("at front dead centre", symbol("psi''_FDC"), centres.psi_2_front),
        equation("dead centres", symbol("theta"), beta - beta_r),
        equation("dead centres", symbol("swing"), psi(systems.sympy().pi + beta_r) - psi(beta)),
    ]


class _Symbols(Symbols):
    """The beat-up's numbers: s = m4e r4e², and today's lengths under names of their own."""

    def __missing__(self, name: str) -> Expression:
        if name == "s":
            return self["m4e"] * self["r4e"] ** 2
        return symbol(f"{name.removeprefix('today.')}_today" if name.startswith("today.") else name)


def _pose() -> balance.Pose:
    """Return a pose of symbols; gamma is the angle of the rod B→C."""
    phi, gamma, sp = symbol("phi"), symbol("gamma"), sympy()
    joints = SimpleNamespace(
        rod_1=symbol("gamma'"),
        rod_2=symbol("gamma''"),
        cos_crank_rod=sp.cos(phi - gamma),
        sin_crank_rod=sp.sin(phi - gamma),
    )
    return balance.Pose(phi, symbol("omega"), symbol("q"), symbol("q'"), symbol("q''"), joints)
