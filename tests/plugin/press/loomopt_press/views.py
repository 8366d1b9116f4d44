"""The press's own views: its drawing, its equations, and where its dead centres are."""

import math
from collections.abc import Mapping, Sequence

from loomopt.jobs import registry
from loomopt.picture.equations import Equation
from loomopt.picture.job_views import JobViews
from loomopt.picture.panels import Panel
from loomopt.picture.shapes import Drawing, drawn_units
from loomopt.scenes.scene import Scene
from loomopt_press import drawing, equations
from loomopt_press.model import BOTTOM, TOP


class PressViews(JobViews):
    """A crank above, the slide below."""

    def linkage(self, scene: Scene, design: Mapping[str, float]) -> Drawing:
        """Return the press in both dead centres and half way, at full scale."""
        return drawing.linkage(registry.of(scene).numbers_of(scene, design), scene.name, drawn_units(scene))

    def joints_csv(self, scene: Scene, design: Mapping[str, float]) -> str:
        """Return its joints as CSV."""
        return drawing.skeleton(registry.of(scene).numbers_of(scene, design)).csv(drawn_units(scene))

    def equations(self, scene: Scene) -> tuple[Equation, ...]:
        """Return the equations the scene really uses."""
        return equations.equations(registry.of(scene).model(scene))

    def marks(self, scene: Scene, design: Mapping[str, float]) -> dict[str, float]:
        """Return both dead centres, rad."""
        return {TOP: 0.0, BOTTOM: math.pi}

    def panels(self, scene: Scene, design: Mapping[str, float], columns: Sequence[str]) -> tuple[Panel, ...]:
        """Return torque, force and travel."""
        shown = {"crank torque": "Md [N*m]", "force": "Q [N]", "travel": "q [m]"}
        return tuple(Panel((column,), name) for name, column in shown.items() if column in columns)


VIEWS = PressViews()
