"""How each job shows itself: one record of functions, so that tables, drawings and notebooks know no mechanism."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from loomopt.views.equations import Equation
    from loomopt.views.shapes import Drawing

Numbers = Mapping[str, float]


@dataclass(frozen=True)
class JobView:
    """A job's own views; a design, SI, may name only some numbers, the others are today's.

    linkage(scene, design): the mechanism drawn at full scale in the positions that matter.
    joints_csv(scene, design): the joints it draws, as CSV, mm. Both raise BadInput for a design that does not assemble.
    equations(scene): the equations the scene really uses.
    """

    linkage: Callable[[Any, Numbers], "Drawing"]
    joints_csv: Callable[[Any, Numbers], str]
    equations: Callable[[Any], tuple["Equation", ...]]


def view(scene: Any) -> JobView:
    """Return the views of a scene's job."""
    return VIEWS[scene.job.name]


def full(scene: Any, design: Numbers) -> dict[str, float]:
    """Return the mechanism's numbers with a design's instead of today's, SI."""
    return {**scene.mechanism, **design}


def _beatup_linkage(scene: Any, design: Numbers) -> "Drawing":
    from loomopt.views import crank_rocker_drawing

    return crank_rocker_drawing.linkage(full(scene, design), scene.name)


def _beatup_joints(scene: Any, design: Numbers) -> str:
    from loomopt.views import crank_rocker_drawing

    return crank_rocker_drawing.joints_csv(full(scene, design))


def _beatup_equations(scene: Any) -> tuple["Equation", ...]:
    from loomopt.jobs import beatup_program
    from loomopt.views import beatup_equations

    return beatup_equations.equations(beatup_program.model(scene))


def _rapier_linkage(scene: Any, design: Numbers) -> "Drawing":
    from loomopt.views import rapier_drawing

    return rapier_drawing.linkage(full(scene, design), scene.name)


def _rapier_joints(scene: Any, design: Numbers) -> str:
    from loomopt.views import rapier_drawing

    return rapier_drawing.joints_csv(full(scene, design))


def _rapier_equations(scene: Any) -> tuple["Equation", ...]:
    from loomopt.views import rapier_equations

    return rapier_equations.equations(scene)


VIEWS = {
    "beatup": JobView(_beatup_linkage, _beatup_joints, _beatup_equations),
    "rapier": JobView(_rapier_linkage, _rapier_joints, _rapier_equations),
}
"""Job name → its views; the modules behind them are imported when they are first used."""
