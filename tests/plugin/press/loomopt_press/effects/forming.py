"""Forming of the sheet: output term F from where the slide meets it, `height` above its lowest position."""

from loomopt.base.quantities import Force, PositiveLength
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Inputs, Load, Motion
from loomopt.physics.mechanisms.dyad import heron
from loomopt.physics.schema import Table


class Parameters(Table):
    """F: force that forms the sheet, N; height: of the slide above its lowest position where it meets it, m."""

    F: Force
    height: PositiveLength


def corners(at: Inputs[object]) -> tuple[Number, ...]:
    """Crank angles, rad, where the slide meets the sheet and where it turns."""
    crank, rod = at.values["crank"], at.values["rod"]
    reach = crank + rod - at.table["height"]
    meets = at.maths.atan2(heron(at.maths, crank, rod, reach), crank * crank + (reach - rod) * (reach + rod))
    return at.maths.pi - meets, at.maths.pi


def switch(angle: float, corners: tuple[float, ...]) -> float:
    """1 while the sheet is formed, 0 elsewhere."""
    meets, turns = corners
    return 1.0 if meets <= angle % 6.283185307179586 < turns else 0.0


def force(at: Inputs[Motion]) -> Number:
    """F or nothing, N."""
    return at.table["F"] * at.switch


EFFECT = Load(
    name="forming",
    summary="forming of the sheet",
    table=Parameters,
    rank=10,
    acts="output",
    force=force,
    corners=corners,
    switch=switch,
    cases={1.0: "while the sheet is formed", 0.0: "elsewhere"},
    examples=({"F": "500 kN", "height": "6 mm"},),
)
