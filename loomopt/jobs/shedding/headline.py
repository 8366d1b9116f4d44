"""One sentence of what an optimum reached, and one of what today's spring does."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from loomopt.effects.shedding.coil import INDEX
from loomopt.jobs.shedding import design as shedding_design
from loomopt.jobs.shedding import program as shedding_program
from loomopt.maths import FLOAT
from loomopt.mechanisms.tension_spring import Coil, strength
from loomopt.units import show

CLOSE = 1e-9
"""Share of the largest cam force below which contact just holds."""


def headline(scene: Any, target: str, figures: Mapping[str, float | None]) -> str:
    """Say what an optimum of the target reached, and what today's spring would do; figures in SI."""
    size = {name: value or 0.0 for name, value in figures.items()}
    stiffness = show(size["K1"], scene.unit("K1", "stiffness"), 9)
    speed = show(size["speed"], scene.unit("speed", "angular speed"), 9)
    kept = "keeps the roller on the cam all round"
    if "levels" in [getattr(own, "shape", "") for own in scene.effects.values()]:
        kept = "keeps the roller on the cam in both dwells"
    said = {
        "stiffness": f"The least return spring that {kept} has {stiffness}.",
        "law": f"With the cam law chosen too, the least return spring that {kept} has {stiffness}.",
        "force": f"The least peak cam force is {size['contact_max']:.6g} N, with a return spring of {stiffness}.",
        "speed": f"Today's spring {kept} up to {speed}.",
    }[target]
    return said if target == "speed" else f"{said} {today(scene)}".strip()


def today(scene: Any) -> str:
    """Say whether today's spring holds the roller on the cam, and where and by how much it would lift off."""
    found = shedding_design.figures(scene, shedding_design.today(scene))
    least, most = found["contact_min"] or 0.0, abs(found["contact_max"] or 0.0)
    wanted, angle = scene.operation["N_min"], math.degrees(found["contact_angle"] or 0.0)
    spring = f"Today's spring ({show(scene.mechanism['K1'], scene.unit('K1', 'stiffness'), 9)})"
    if least >= wanted - CLOSE * max(most, 1.0):
        return f"{spring} holds: the cam force is never less than {least:.6g} N."
    lost = f"the cam force would be {least:.6g} N at {angle:.4f} deg"
    speed = found["contact_speed"]
    if speed:
        lost += f"; it holds up to {show(speed, scene.unit('speed', 'angular speed'), 7)}"
    return f"{spring} would lift off: {lost}." if least < 0.0 else f"{spring} is too soft: {lost}."


def explain(scene: Any, clash: Sequence[str]) -> str:
    """Say why coils that surge late enough are stressed too much, and what helps; "" where that is not what clashes."""
    own = scene.effects.get("coil")
    named = {limit.split()[0] for limit in clash}
    if own is None or "surge_ratio" not in named or not named & {"shear_share", "bending_share"}:
        return ""
    known, limited = shedding_program.numbers(scene), shedding_program.bounds(scene)
    stretch = limited["X0"][1] + known["travel"]
    thinnest = limited.get("coil.wire", (own.wire, own.wire))[0]
    slimmest = Coil(1.0, INDEX[1], 1.0, own.shear_modulus, own.density, 0.0, own.elasticity)
    surge = own.surge_ratio * known["speed"] / (2 * math.pi)
    least = 2 * slimmest.wahl * stretch * surge * math.sqrt(2 * own.shear_modulus * own.density)
    most = own.shear_share * strength(FLOAT, thinnest, own.strength, own.strength_exponent)
    if least <= most:
        return ""
    return (
        f"Coils that surge at {own.surge_ratio:g} times the cam's speed and stretch by X0 + travel = "
        f"{1e3 * stretch:.4g} mm carry at least {1e-6 * least:.4g} MPa of shear, whatever their size "
        f"(tau >= 2 K_W (X0 + travel) f sqrt(2 G rho)); the wire allows {1e-6 * most:.4g} MPa at most. "
        "Less preload asks for a stiffer spring. A lower speed, less travel or a softer cam law (target law) helps."
    )
