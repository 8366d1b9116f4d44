"""Views of the beat-up; the modules that draw and print are imported at their first use."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import TYPE_CHECKING

from loomopt.jobs import registry
from loomopt.jobs.beatup.model import FRONT, REAR
from loomopt.jobs.beatup.scene import VARIABLES
from loomopt.maths import systems
from loomopt.maths.systems import FLOAT
from loomopt.model.change import today
from loomopt.model.curves import tops
from loomopt.model.model import JobModel
from loomopt.model.numbers import table_remarks
from loomopt.physics import balance
from loomopt.physics.cycle import TURN
from loomopt.physics.effects.kinds import Check, State
from loomopt.physics.mechanisms import crank_rocker
from loomopt.physics.mechanisms.dyad import Dyad, Vector
from loomopt.picture import effect_equations
from loomopt.picture.equations import Equation, Expression, Symbols, equation, loop, moving, symbol, sympy
from loomopt.picture.job_views import LinkViews, Marks, Span
from loomopt.scenes.scene import Scene


def equations(model: JobModel) -> tuple[Equation, ...]:
    """Equations of a beat-up scene: geometry, dead centres, each term, balance, crank torque.

    An effect that is not in the scene leaves no symbol and no term.
    """
    return (
        *_geometry(),
        *_dead_centres(),
        equation("output", symbol("q"), -symbol("psi")),
        *effect_equations.forces(model, _pose(), effect_equations.given(model, _Symbols()), "M3", "M"),
    )


def terms(model: JobModel) -> Mapping[str, Expression]:
    """Term of each load, N·m, by its effect's name: an expression in φ, ω, q, q', q'' and numbers."""
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


TODAY = {today(name): f"{name}_today" for name in VARIABLES}
"""Today's numbers → their symbols."""


class _Symbols(Symbols):
    """The beat-up's numbers: s = m4e r4e², and today's lengths under names of their own."""

    def __missing__(self, name: str) -> Expression:
        if name == "s":
            return self["m4e"] * self["r4e"] ** 2
        return symbol(TODAY.get(name, name))


def _pose() -> balance.Pose:
    """Pose of symbols; gamma is the angle of the rod B→C."""
    phi, gamma, psi, sp = symbol("phi"), symbol("gamma"), symbol("psi"), sympy()
    lengths = crank_rocker.Lengths(*(symbol(name) for name in ("l1", "l2", "l3", "l4")))
    rod = Vector(lengths.l2 * sp.cos(gamma), lengths.l2 * sp.sin(gamma))
    rocker = Vector(lengths.l3 * sp.cos(psi), lengths.l3 * sp.sin(psi))
    joints = SimpleNamespace(
        lengths=lengths,
        crank=Vector(lengths.l1 * sp.cos(phi), lengths.l1 * sp.sin(phi)),
        dyad=Dyad(rod, rocker, 2 * lengths.l2 * lengths.l3 * sp.sin(psi - gamma)),
        rod_1=symbol("gamma'"),
        rod_2=symbol("gamma''"),
        cos_crank_rod=sp.cos(phi - gamma),
        sin_crank_rod=sp.sin(phi - gamma),
    )
    return balance.Pose(phi, symbol("omega"), symbol("q"), symbol("q'"), symbol("q''"), joints)


if TYPE_CHECKING:
    from loomopt.model.sampling import Sampler
    from loomopt.picture.equations import Equation
    from loomopt.picture.mechanism_drawing import MechanismDrawing
    from loomopt.picture.panels import Curve


class BeatupViews(LinkViews):
    """The crank-rocker in both dead centres, its equations, and where the cloth resists."""

    def drawn(self, scene: Scene, design: Mapping[str, float]) -> "MechanismDrawing":
        """Crank-rocker in both dead centres. Raises BadInput."""
        from loomopt.jobs.beatup import drawing

        return drawing.of(_numbers(scene, design))

    def sampler(self, scene: Scene, design: Mapping[str, float]) -> "Sampler":
        """Samples of a design."""
        return registry.of(scene).sampler(scene, design)

    def equations(self, scene: Scene) -> "tuple[Equation, ...]":
        """Equations the scene really uses."""

        return equations(registry.of(scene).model(scene))

    def marks(self, scene: Scene, design: Mapping[str, float]) -> Marks:
        """Both dead centres, rad, and where the cloth begins and ceases to resist."""
        sampler = registry.of(scene).sampler(scene, design)
        model, given = sampler.model, sampler.given
        marks: dict[str, float | Span] = {name: float(model.event(FLOAT, given, name)) % TURN for name in (FRONT, REAR)}
        for pulse in model.integrals:
            marks["pulse"] = Span(*sampler.cycle.stretch(pulse.where))
        return marks | {name.replace("_", " "): tops(sampler, [name])[0] % TURN for name in model.least}

    def remarks(self, scene: Scene, design: Mapping[str, float]) -> tuple[str, ...]:
        """Remarks: on curves, checks, a reed that twists away while it beats up."""
        remarks = (
            super().remarks(scene, design) if any(isinstance(e, Check) for e in scene.active) else table_remarks(scene)
        )
        if not any(isinstance(effect, State) for effect in scene.active):
            return remarks
        from loomopt.picture.panels import twist_remarks

        return (*remarks, *twist_remarks(scene, registry.of(scene).sampler(scene, design)))

    def words(self) -> "Mapping[str, Curve]":
        """Names of the curves."""
        from loomopt.picture.panels import Curve

        return {
            "psi": Curve("rocker angle"),
            "psi_1": Curve("rocker speed"),
            "psi_2": Curve("rocker acceleration"),
            "psi_tt": Curve("rocker acceleration", at={FRONT: "alpha_fdc"}),
            "psi_r": Curve("reed angle", least="reed_front"),
            "twist": Curve(peak="twist_peak"),
            "mu": Curve("transmission angle", least="mu_min"),
            "M3": Curve("reed torque", at={FRONT: "M3_fdc"}),
            "Md": Curve("crank torque", peak="peak_torque"),
        }


def _numbers(scene: Scene, design: Mapping[str, float]) -> dict[str, float]:
    """All numbers of a design, with the offset of the reed's centre of mass where an effect has one."""
    numbers = registry.of(scene).numbers_of(scene, design)
    return numbers | {"offset": numbers.get(scene.full("offset"), 0.0)}


VIEWS = BeatupViews()
