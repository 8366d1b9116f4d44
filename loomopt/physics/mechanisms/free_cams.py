"""Third derivatives at the knots of free cam laws that a scene leaves open: near to those of septics."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from loomopt.maths.systems import FLOAT
from loomopt.physics.mechanisms.cam_moves import CamMotion, CamMoves
from loomopt.physics.mechanisms.chain import Chain, ChainPose, Part, cam_knots, cam_moves, knot_names, moves_of
from loomopt.physics.schema import Values

if TYPE_CHECKING:
    from loomopt.maths.turning_points import Floats


def with_knots(chain: Chain, values: Values) -> Values:
    """Numbers with the third derivatives at the knots of all splines; those that lack make the laws near to septics."""
    lacking = {name: cam for cam in chain.cams for name in cam_knots(cam) if name not in values}
    if not lacking:
        return values
    known = dict(values)
    for cam in dict.fromkeys(lacking.values()):
        known |= _default_knots(cam, {**dict.fromkeys(cam_knots(cam), 0.0), **known}, values)
    return known


def _default_knots(cam: Part, zeros: Values, given: Values) -> dict[str, float]:
    """Third derivatives nearest to those of the septics with which the splines reach their ends."""
    names, near = cam_knots(cam), dict[str, float]()
    places = [k for k, move in enumerate(moves_of(cam)) if move.intervals > 1]

    def motion(values: Values) -> CamMotion:
        return CamMotion(FLOAT, cam_moves(ChainPose(FLOAT, values, None), cam), 0.0, 0.0)

    septics = motion(zeros).cam
    plain = replace(septics, moves=tuple(move._replace(intervals=1, open_end=False) for move in septics.moves))
    for k in places:
        count = septics.moves[k].intervals
        for name, i in zip(knot_names(cam, k), range(1, count + 1), strict=False):
            at = CamMotion(FLOAT, plain, plain.edges[k] + plain.turns[k] * i / count, float(_first_stretch(plain, k)))
            near[name] = float(given.get(name, at.angle(3)))

    def gaps(values: Values) -> "Floats":
        here = motion(values)
        scale = [here.cam.turns[k] ** order for k in places for order in range(3)]
        rows = [here.gaps(k) for k in places]
        flat = [row.get(name, 0.0) for row in rows for name in ("angle", "slope", "bend")]
        return np.array(flat, dtype=np.float64) * np.array(scale, dtype=np.float64)

    free = [name for name in names if name not in given]
    base = {**zeros, **near}
    here = gaps(base)
    slopes = np.column_stack([gaps({**base, name: base[name] + 1.0}) - here for name in free])
    step = np.linalg.lstsq(slopes, -here, rcond=None)[0]
    return near | {name: near[name] + float(change) for name, change in zip(free, step, strict=True)}


def _first_stretch(cam: CamMoves, k: int) -> int:
    return next(place for place, stretch in enumerate(cam.stretches) if stretch.move == k)


def _roller(pose: ChainPose, part: Part) -> None:
    """Place nothing: a roller turns on a joint of another part."""
