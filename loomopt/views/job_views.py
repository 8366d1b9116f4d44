"""How each job shows itself: one record of functions, so that tables, drawings and notebooks know no mechanism."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from loomopt.picture import panels as panels_of

if TYPE_CHECKING:
    from loomopt.picture.equations import Equation
    from loomopt.picture.panels import Panel
    from loomopt.picture.shapes import Drawing

Numbers = Mapping[str, float]


def no_remarks(scene: Any, design: Numbers) -> tuple[str, ...]:
    """Return nothing: a job that has nothing to remark upon."""
    return ()


def nothing_missing(scene: Any) -> tuple[str, ...]:
    """Return nothing: every scene of the job can be drawn."""
    return ()


@dataclass(frozen=True)
class JobView:
    """A job's own views; a design, SI, may name only some numbers, the others are today's.

    linkage(scene, design): the mechanism drawn at full scale in the positions that matter.
    joints_csv(scene, design): what it draws as CSV for the workshop, mm: joints, or the cam's profile. Both raise
    BadInput for a design that does not assemble, and where numbers are missing(scene), which names their keys.
    equations(scene): the equations the scene really uses.
    panels(scene, design, columns): what a figure of the curves shows.
    remarks(scene, design): what to know beside the numbers, each a sentence without its full stop.
    angle: what phi is; lists: part of a design that is a list → what its numbers are, "{count}" for how many.
    """

    linkage: Callable[[Any, Numbers], "Drawing"]
    joints_csv: Callable[[Any, Numbers], str]
    equations: Callable[[Any], tuple["Equation", ...]]
    panels: Callable[[Any, Numbers, Sequence[str]], tuple["Panel", ...]] = panels_of.each
    remarks: Callable[[Any, Numbers], tuple[str, ...]] = no_remarks
    missing: Callable[[Any], tuple[str, ...]] = nothing_missing
    angle: str = "crank angle"
    lists: Mapping[str, str] = field(default_factory=dict)


def view(scene: Any) -> JobView:
    """Return the views of a scene's job."""
    return VIEWS[scene.job.name]


def full(scene: Any, design: Numbers) -> dict[str, float]:
    """Return the mechanism's numbers with a design's instead of today's, SI."""
    return {**scene.mechanism, **design}


def _beatup_linkage(scene: Any, design: Numbers) -> "Drawing":
    from loomopt.jobs.beatup import drawing as crank_rocker_drawing

    return crank_rocker_drawing.linkage(full(scene, design), scene.name)


def _beatup_joints(scene: Any, design: Numbers) -> str:
    from loomopt.jobs.beatup import drawing as crank_rocker_drawing

    return crank_rocker_drawing.joints_csv(full(scene, design))


def _beatup_equations(scene: Any) -> tuple["Equation", ...]:
    from loomopt.jobs.beatup import equations as beatup_equations
    from loomopt.jobs.beatup import program as beatup_program

    return beatup_equations.equations(beatup_program.model(scene))


def _rapier_linkage(scene: Any, design: Numbers) -> "Drawing":
    from loomopt.jobs.rapier import drawing as rapier_drawing

    return rapier_drawing.linkage(full(scene, design), scene.name)


def _rapier_joints(scene: Any, design: Numbers) -> str:
    from loomopt.jobs.rapier import drawing as rapier_drawing

    return rapier_drawing.joints_csv(full(scene, design))


def _rapier_equations(scene: Any) -> tuple["Equation", ...]:
    from loomopt.jobs.rapier import equations as rapier_equations

    return rapier_equations.equations(scene)


def _shedding_linkage(scene: Any, design: Numbers) -> "Drawing":
    from loomopt.jobs.shedding import drawing as shedding_drawing

    return shedding_drawing.linkage(scene, design)


def _shedding_profile(scene: Any, design: Numbers) -> str:
    from loomopt.jobs.shedding import drawing as shedding_drawing

    return shedding_drawing.joints_csv(scene, design)


def _shedding_equations(scene: Any) -> tuple["Equation", ...]:
    from loomopt.jobs.shedding import equations as shedding_equations

    return shedding_equations.equations(scene)


def _shedding_panels(scene: Any, design: Numbers, columns: Sequence[str]) -> tuple["Panel", ...]:
    from loomopt.jobs.shedding import panels as shedding_panels

    return shedding_panels.panels(scene, design, columns)


def _shedding_remarks(scene: Any, design: Numbers) -> tuple[str, ...]:
    from loomopt.jobs.shedding import remarks as shedding_remarks

    return shedding_remarks.remarks(scene, design)


def _shedding_missing(scene: Any) -> tuple[str, ...]:
    from loomopt.jobs.shedding import cam_curves

    return cam_curves.missing(scene)


VIEWS = {
    "beatup": JobView(_beatup_linkage, _beatup_joints, _beatup_equations),
    "rapier": JobView(_rapier_linkage, _rapier_joints, _rapier_equations),
    "shedding": JobView(
        _shedding_linkage,
        _shedding_profile,
        _shedding_equations,
        _shedding_panels,
        _shedding_remarks,
        _shedding_missing,
        angle="cam angle",
        lists={"law": "s'' at {count} knots"},
    ),
}
"""Job name → its views; the modules behind them are imported when they are first used."""
