"""Views of the rapier; the modules that draw and print are imported at their first use."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import TYPE_CHECKING

from loomopt.jobs import registry
from loomopt.jobs.rapier.model import read
from loomopt.maths import systems
from loomopt.maths.systems import FLOAT
from loomopt.model.model import JobModel
from loomopt.physics import balance
from loomopt.physics.cycle import TURN
from loomopt.physics.mechanisms.dyad import Dyad
from loomopt.physics.mechanisms.rapier_drive import Dimensions, Sley, Stand, polar
from loomopt.picture import effect_equations
from loomopt.picture.equations import Angle, Equation, Symbols, equation, loop, moving, symbol, sympy
from loomopt.picture.job_views import LinkViews, Marks, Span
from loomopt.scenes.scene import Scene


def equations(model: JobModel) -> tuple[Equation, ...]:
    """Equations of a rapier scene: dead centres, both loops, travel, each term, balance, crank torque.

    An effect that is not in the scene leaves no symbol and no term.
    """
    d = Dimensions(*(symbol(name) for name in Dimensions.__dataclass_fields__))
    return (*_sley(d), *_five_bar(d), *_travel(d), *_forces(model))


def _sley(d: Dimensions) -> list[Equation]:
    """Run the sley's own closed forms on symbols, and close the loop A0 A B1 B0; phi7: direction of A0→B0 from x."""
    sp, sley = sympy(), Sley(systems.sympy(), d)
    phi1, beta, beta_r, phi7, phi2, phi3 = (symbol(name) for name in ("phi1", "beta", "beta_r", "phi7", "phi2", "phi3"))
    crank = phi1 + beta + phi7
    sides = (
        (d.l1 * sp.cos(crank) + d.l2 * sp.cos(phi2), d.l71 * sp.cos(phi7) + d.l3 * sp.cos(phi3)),
        (d.l1 * sp.sin(crank) + d.l2 * sp.sin(phi2), d.l71 * sp.sin(phi7) + d.l3 * sp.sin(phi3)),
    )
    return [
        equation("front dead centre", beta, sley.stand.beta),
        equation("rear dead centre", beta_r, sley.centres.beta_r),
        equation("rear dead centre", symbol("phi1_rear"), sp.pi + beta_r - beta),
        equation("direction of A0 B0", phi7, sley.stand.frame_angle),
        *loop(sides, phi1, (moving("phi2"), moving("phi3")), kind="sley: "),
    ]


def _five_bar(d: Dimensions) -> list[Equation]:
    """Close the loop C0 C D B2 B0; the second crank turns twice as fast, against the first."""
    sp, phi1 = sympy(), symbol("phi1")
    phi4, sley = Angle("phi4", sp.Integer(-2), sp.Integer(0)), moving("phi3")
    phi5, phi6 = moving("phi5"), moving("phi6")
    carrier = sley.symbol + d.alpha
    sides = tuple(
        (
            pivot + d.l4 * part(phi4.symbol) + d.l5 * part(phi5.symbol),
            d.l3p * part(carrier) + d.l6 * part(phi6.symbol),
        )
        for pivot, part in ((d.C0x, sp.cos), (d.C0y, sp.sin))
    )
    return [
        equation("second crank", phi4.symbol, d.phi40 - 2 * phi1),
        *loop(sides, phi1, (phi5, phi6), (sley, phi4), kind="five-bar: "),
    ]


def _travel(d: Dimensions) -> list[Equation]:
    """Write the rapier's travel S and its derivatives [Hong17, eq 1]."""
    phi60, angle = symbol("phi60"), moving("phi63")
    phi3, phi6 = moving("phi3"), moving("phi6")
    return [
        equation("at front dead centre", phi60, sympy().Function("phi6")(0)),
        equation("driving link on the sley", angle.symbol, phi6.symbol - phi3.symbol - phi60 + d.phi30),
        equation("travel", symbol("S"), d.travel * angle.symbol),
        equation("travel", symbol("S'"), d.travel * (phi6.rate - phi3.rate)),
        equation("travel", symbol("S''"), d.travel * (phi6.second - phi3.second)),
    ]


def _pose() -> balance.Pose:
    """Pose of symbols: the output is the rapier's travel."""
    phi1, omega, S, S1, S2 = (symbol(name) for name in ("phi1", "omega", "S", "S'", "S''"))
    links = _linkage(Dimensions(*(symbol(name) for name in Dimensions.__dataclass_fields__)))
    return balance.Pose(phi1, omega, S, S1, S2, links)


def _linkage(d: Dimensions) -> SimpleNamespace:
    """Links of both loops by their directions, as forces in joints read them."""
    sp, system = sympy(), systems.sympy()
    phi2, phi3, phi4, phi5, phi6, phi7 = (symbol(f"phi{k}") for k in range(2, 8))
    rod, sley, link, driving = (
        polar(system, length, angle) for length, angle in ((d.l2, phi2), (d.l3, phi3), (d.l5, phi5), (d.l6, phi6))
    )
    return SimpleNamespace(
        dimensions=d,
        dyad=Dyad(link, driving, 2 * d.l5 * d.l6 * sp.sin(phi6 - phi5)),
        sley_dyad=Dyad(rod, sley, 2 * d.l2 * d.l3 * sp.sin(phi3 - phi2)),
        carrier=polar(system, d.l3p, phi3 + d.alpha),
        main_crank=polar(system, d.l1, symbol("phi1") + symbol("beta") + phi7),
        second_crank=polar(system, d.l4, phi4),
        main_shaft=polar(system, -d.l71, phi7),
        stand=Stand(symbol("beta"), phi7),
        four_bar=SimpleNamespace(rod_1=symbol("phi2'")),
        phi3_1=symbol("phi3'"),
        rates=(symbol("phi5'"), symbol("phi6'")),
    )


def _forces(model: JobModel) -> list[Equation]:
    """Write each term that is on, their balance and the crank torque, and the checks."""
    return effect_equations.forces(
        model, _pose(), effect_equations.given(model, Symbols(speed=symbol("omega"))), "Q", "Q"
    )


if TYPE_CHECKING:
    from loomopt.model.sampling import Sampler
    from loomopt.picture.equations import Equation
    from loomopt.picture.mechanism_drawing import MechanismDrawing
    from loomopt.picture.panels import Curve

SWUNG = "of sley and driving link"


class RapierViews(LinkViews):
    """The drive in both dead centres of the sley and at the hand-over, its equations, and where the head dwells."""

    def drawn(self, scene: Scene, design: Mapping[str, float]) -> "MechanismDrawing":
        """Drive in both dead centres and at the hand-over. Raises BadInput."""
        from loomopt.jobs.rapier import drawing

        return drawing.of(registry.of(scene).numbers_of(scene, design))

    def sampler(self, scene: Scene, design: Mapping[str, float]) -> "Sampler":
        """Samples of a design."""
        return registry.of(scene).sampler(scene, design)

    def equations(self, scene: Scene) -> "tuple[Equation, ...]":
        """Equations the scene really uses."""

        return equations(registry.of(scene).model(scene))

    def marks(self, scene: Scene, design: Mapping[str, float]) -> Marks:
        """Sley's dead centres, rad, the hand-over and the dwell."""
        sampler = registry.of(scene).sampler(scene, design)
        events, reading = sampler.model.kinematics.events(FLOAT, sampler.given), read(sampler)
        marks = {name: float(angle) % TURN for name, angle in events.items()} | {"hand-over": reading.phi_stroke}
        if "s_dwell" not in scene.operation:
            return marks
        return {**marks, "dwell": Span(TURN - reading.dwell_before, reading.dwell_after)}

    def words(self) -> "Mapping[str, Curve]":
        """Names of the curves."""
        from loomopt.picture.panels import Curve

        return {
            "S": Curve("head travel"),
            "S_1": Curve("head speed"),
            "S_2": Curve("head acceleration", peak="peak_acceleration"),
            "S_3": Curve("head jerk", peak="peak_jerk"),
            "phi3": Curve("sley", SWUNG),
            "phi6": Curve("driving link", SWUNG),
            "phi63": Curve("link on the sley", SWUNG),
            "mu": Curve("transmission angle", least="mu_min"),
            "Q": Curve("tape force", peak="tape_force"),
            "Md": Curve("crank torque", peak="peak_torque"),
        }


VIEWS = RapierViews()
