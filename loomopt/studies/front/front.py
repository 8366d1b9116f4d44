"""Pareto front of two figures of a machine, by adaptive ε-constraints, every point certified.

The least of one axis with the other at most ε, then the least of the other, so that no point is only weakly efficient;
non-convex parts are reached too [Haimes, Lasdon, Wismer, IEEE Trans. SMC 1 (1971); Mavrotas, AMC 213 (2009)].
"""

import math
from collections.abc import Mapping, Sequence

from loomopt.base import arguments
from loomopt.base.errors import BadInput, misread, refusal, shown
from loomopt.base.quantities import read as read_quantity
from loomopt.base.units import SI_UNIT, QuantityError
from loomopt.model.axes import FORMS
from loomopt.physics.schema import Sense
from loomopt.physics.tolerances import ACCURACY
from loomopt.scenes import numbers
from loomopt.scenes.former_names import current
from loomopt.scenes.scene import Scene
from loomopt.solving.answer.solution import UnitFormatter
from loomopt.solving.options import check_effects, check_numbers, target_name
from loomopt.studies.front.trade import POINTS, Trade

FEWEST = 3
"""Points of a front."""
ENDS = "LO:HI UNIT as text, or both ends as numbers in SI"
"""How a range is given."""
LIMITING_SIDE: Mapping[Sense, str] = {"least": "min", "most": "max"}
"""Sense of an axis → side of a limit that excludes the end of its front."""
NONE = "none"
"""What is given in place of a target, where the scene's limits alone hold."""
Ranges = Mapping[str, tuple[float, float]]
Given = Mapping[str, str | Sequence[float]]
"""Axis → "LO:HI UNIT", or both ends, SI."""


def demanding(scene: Scene, target: str | None) -> str | None:
    """Target whose demands a front holds: the job's default without one, None for "none". Raises BadInput.

    A target's demands on what is traded fall away.
    """
    allowed = ", ".join((*scene.schema.targets, NONE))
    if target is not None:
        arguments.text(target, "target", allowed, "Choose one of them")
    if target and target not in (NONE, *scene.schema.targets):
        raise refusal(
            f"job {scene.job} has no target {target}", scene.origin, "target", target, allowed, "Choose one of them."
        )
    return None if target == NONE else target_name(scene, target)


def trade(
    scene: Scene,
    axes: Sequence[str],
    target: str | None = None,
    *,
    maximise: str | Sequence[str] = (),
    minimise: str | Sequence[str] = (),
    ranges: Ranges | None = None,
    points: int | None = None,
    accuracy: float = ACCURACY,
) -> Trade:
    """Plan of the front of two axes: the first one is optimised, the second one limited.

    target: whose demands hold, None for none; maximise, minimise: axes of which the most, the least is wanted; of any
    other the end that it offers alone or first, or the least. ranges: axis → from, to, SI: of a number that the scene
    does not bound they bound it. A number that the scene holds is freed as an axis. Raises BadInput.
    """
    check_numbers(accuracy, None)
    check_effects(scene)
    if target is not None:
        target_name(scene, target)
    first, second = _two(scene, axes)
    axes, former = (first, second), scene.schema.former_names
    maximise, minimise = (
        tuple(current(name, former) for name in _named(given, key, axes))
        for given, key in ((maximise, "maximise"), (minimise, "minimise"))
    )
    ranges = {current(name, former): ends for name, ends in (ranges or {}).items()}
    stray = [name for name in (*maximise, *minimise, *ranges) if name not in axes]
    if stray:
        remedy = "Name one of the two axes."
        raise BadInput(f"{stray[0]} is not one of the two axes", key=stray[0], allowed=", ".join(axes), remedy=remedy)
    allowed = f"a whole number from {FEWEST} to {numbers.MOST_VALUES}"
    count = POINTS if points is None else arguments.whole(points, "points", allowed, "Correct the number")
    if not FEWEST <= count <= numbers.MOST_VALUES:
        problem = "a front needs more points" if count < FEWEST else "the number of points is out of range"
        raise BadInput(problem, key="points", value=shown(points), allowed=allowed, remedy="Correct the number.")
    for name, (low, high) in ranges.items():
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            value, allowed = f"{low:g}:{high:g} in SI", "the smaller end, then the larger one"
            raise BadInput(
                "the first end of a range must be smaller",
                key=name,
                value=value,
                allowed=allowed,
                remedy="Write the smaller end first",
            )
    senses = _sense(scene, first, minimise, maximise), _sense(scene, second, minimise, maximise)
    open_ended, lifted = _lifted(scene, dict(zip((first, second), senses, strict=True)))
    result = Trade(
        _freed(_bounded(open_ended, ranges), axes),
        (first, second),
        senses,
        target,
        tuple(ranges.items()),
        count,
        float(accuracy),
        lifted,
    )
    _ = result.solver
    return result


def _lifted(scene: Scene, senses: Mapping[str, Sense]) -> tuple[Scene, tuple[str, ...]]:
    """Scene without the limits that exclude a requested end of the front, and those limits in words.

    On a minimised axis this is a minimum, on a maximised one a maximum. A limit to one value excludes both ends.
    """
    formatter, texts = UnitFormatter(scene), []
    for name, sense in senses.items():
        axis, limit = scene.schema.axes.get(name), scene.limits.get(name)
        if limit is None or axis is None or (axis.form and FORMS[axis.form].is_magnitude):
            continue
        ends = {"min": limit.min, "max": limit.max}
        is_equality = limit.min is not None and limit.min == limit.max
        sides = [side for side in ends if ends[side] is not None and (is_equality or side == LIMITING_SIDE[sense])]
        if sides:
            scene = scene.without_limit(name, sides)
            most = "" if is_equality else " at least" if sides == ["min"] else " at most"
            texts.append(f"{name}{most} {formatter.shown(name, ends[sides[0]] or 0.0)}")
    return scene, tuple(texts)


def _sense(scene: Scene, name: str, minimise: Sequence[str], maximise: Sequence[str]) -> Sense:
    """End of an axis that the front seeks."""
    if name in maximise:
        return "most"
    axis = scene.schema.axes.get(name)
    return axis.senses[0] if axis and name not in minimise else "least"


def si(scene: Scene, given: Given) -> dict[str, tuple[float, float]]:
    """Ranges that are given as text with units, or as SI numbers, in SI, rad. Raises BadInput."""
    table = arguments.table(given, "ranges", f"axis → {ENDS}", 'Write {"m4e": "0:5 kg"}')
    return {name: _ends(scene, current(name, scene.schema.former_names), ends) for name, ends in table.items()}


def _ends(scene: Scene, name: str, given: str | Sequence[float]) -> tuple[float, float]:
    """Both ends of a range, SI. Raises BadInput."""
    if not isinstance(given, str):
        remedy = 'Write "0:5 kg", or (0.0, 5.0)'
        two = arguments.listed(given, name, ENDS, remedy)
        if len(two) != 2:
            raise refusal("a range has two ends", "", name, given, ENDS, remedy)
        return arguments.number(two[0], name, ENDS, remedy), arguments.number(two[1], name, ENDS, remedy)
    axis = scene.schema.axes.get(name)
    kind = (axis.kind if axis else "") or UnitFormatter(scene).kind(name)
    low, high = (_read(text, kind, name) for text in numbers.range_ends(given, name))
    return low, high


def _read(text: str, kind: str, name: str) -> float:
    """End of a range, SI. Raises BadInput."""
    try:
        return read_quantity(text, kind)
    except QuantityError as error:
        raise misread(error, "", name, text) from None


def _two(scene: Scene, axes: Sequence[str]) -> tuple[str, str]:
    """Two axes that differ. Raises BadInput."""
    allowed = ", ".join(scene.schema.axes)
    remedy = 'Write ("A", "B"): the optimised axis, then the axis that it is traded against'
    given = arguments.texts(axes, "axes", allowed, remedy)
    named = tuple(current(name, scene.schema.former_names) for name in given)
    if len(set(named)) != 2 or len(named) != 2:
        problem, wrong = "a front has two axes that differ", ", ".join(given)
        raise refusal(problem, scene.origin, "axes", wrong, allowed, remedy)
    return named[0], named[1]


def _named(given: str | Sequence[str], key: str, axes: Sequence[str]) -> tuple[str, ...]:
    """Axes that an argument names, one or several. Raises BadInput."""
    if isinstance(given, str):
        return (str(given),)
    return arguments.texts(given, key, ", ".join(axes), "Name one of the axes, or both in a list")


def _bounded(scene: Scene, ranges: Ranges) -> Scene:
    """Scene with ranges as bounds of the numbers that are no axes of their own and not bounded."""
    formatter = UnitFormatter(scene)
    changes: dict[str, object] = {}
    for name, (low, high) in ranges.items():
        if name in scene.schema.axes or name in scene.bounds:
            continue
        unit = formatter.si(name)
        for side, end in (("min", low), ("max", high)):
            changes[f"bounds.{name}.{side}"] = f"{end!r} {unit}" if unit != SI_UNIT["number"] else end
    return scene.update(changes) if changes else scene


def _freed(scene: Scene, axes: Sequence[str]) -> Scene:
    """Scene in which axes that it fixes between bounds are free."""
    fixed = [name for name in axes if (b := scene.bounds.get(name)) and not b.free and b.min < b.max]
    return scene.free(fixed) if fixed else scene
