"""Forming of the sheet: output term F from where the slide meets it, `height` above its lowest position."""

from loomopt.base.quantities import Force, PositiveLength
from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.kinds import Load, Motion
from loomopt.physics.mechanisms.dyad import heron
from loomopt.physics.schema import Table, Values


class Own(Table):
    """F: force that forms the sheet, N; height: of the slide above its lowest position where it meets it, m."""

    F: Force
    height: PositiveLength


def corners(maths: Maths, given: Values, own: Values) -> tuple[Number, ...]:
    """Return the crank angles, rad, where the slide meets the sheet and where it turns."""
    crank, rod = given["crank"], given["rod"]
    reach = crank + rod - own["height"]
    meets = maths.atan2(heron(maths, crank, rod, reach), crank * crank + (reach - rod) * (reach + rod))
    return maths.pi - meets, maths.pi


def switch(angle: float, corners: tuple[float, ...]) -> float:
    """Return 1 while the sheet is formed, 0 elsewhere."""
    meets, turns = corners
    return 1.0 if meets <= angle % 6.283185307179586 < turns else 0.0


def force(maths: Maths, pose: Motion, given: Values, own: Values, switch: Number) -> Number:
    """Return F or nothing, N."""
    return own["F"] * switch


EFFECT = Load(
    name="forming",
    summary="forming of the sheet",
    own=Own,
    rank=10,
    acts="output",
    force=force,
    corners=corners,
    switch=switch,
    told={1.0: "while the sheet is formed", 0.0: "elsewhere"},
    examples=({"F": "500 kN", "height": "6 mm"},),
)
