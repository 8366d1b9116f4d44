"""The press's own views: its drawing, its equations, and where its dead centres are."""

import math
from collections.abc import Mapping, Sequence

from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.model.model import JobModel
from loomopt.physics import balance
from loomopt.picture import effect_equations
from loomopt.picture.equations import Equation, Symbols, equation, symbol
from loomopt.picture.job_views import JobViews
from loomopt.picture.panels import Panel
from loomopt.picture.shapes import Drawing, drawn_units
from loomopt.scenes.scene import Scene
from loomopt_press import drawing
from loomopt_press.model import BOTTOM, TOP, SlidePose


def equations(model: JobModel) -> tuple[Equation, ...]:
    """Travel with its derivatives, each term, balance and crank torque."""
    names = "q", "q'", "q''"
    slide = SlidePose(systems.sympy(), symbol("crank"), symbol("rod"), symbol("phi"), symbol("omega"))
    travel = zip(names, (slide.q, slide.q1, slide.q2), strict=True)
    pose = balance.Pose(slide.phi, slide.omega, *map(symbol, names))
    known = effect_equations.given(model, Symbols())
    written = [equation("travel", symbol(name), value) for name, value in travel]
    return (*written, *effect_equations.forces(model, pose, known, "Q", "Q"))


class PressViews(JobViews):
    """A crank above, the slide below."""

    def linkage(self, scene: Scene, design: Mapping[str, float]) -> Drawing:
        """Press in both dead centres and half way, at full scale."""
        return drawing.linkage(registry.of(scene).numbers_of(scene, design), scene.name, drawn_units(scene))

    def joints_csv(self, scene: Scene, design: Mapping[str, float]) -> str:
        """Its joints as CSV."""
        return drawing.skeleton(registry.of(scene).numbers_of(scene, design)).csv(drawn_units(scene))

    def equations(self, scene: Scene) -> tuple[Equation, ...]:
        """Equations the scene really uses."""
        return equations(registry.of(scene).model(scene))

    def marks(self, scene: Scene, design: Mapping[str, float]) -> dict[str, float]:
        """Both dead centres, rad."""
        return {TOP: 0.0, BOTTOM: math.pi}

    def panels(self, scene: Scene, design: Mapping[str, float], columns: Sequence[str]) -> tuple[Panel, ...]:
        """Torque, force and travel."""
        shown = {"crank torque": "Md [N*m]", "force": "Q [N]", "travel": "q [m]"}
        return tuple(Panel((column,), name) for name, column in shown.items() if column in columns)


VIEWS = PressViews()
