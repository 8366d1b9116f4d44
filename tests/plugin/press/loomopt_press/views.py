"""The press's own views: its drawing, its equations, and where its dead centres are."""

import math
from collections.abc import Mapping, Sequence

from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.model.model import JobModel
from loomopt.model.sampling import Sampler
from loomopt.physics import balance
from loomopt.picture import effect_equations
from loomopt.picture.equations import Equation, Symbols, equation, symbol
from loomopt.picture.job_views import LinkViews
from loomopt.picture.panels import Panel
from loomopt.scenes.scene import Scene
from loomopt_press.drawing import PressDrawing
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


class PressViews(LinkViews):
    """A crank above, the slide below."""

    def drawn(self, scene: Scene, design: Mapping[str, float]) -> PressDrawing:
        """Press in both dead centres and half way."""
        numbers = registry.of(scene).numbers_of(scene, design)
        return PressDrawing(numbers["crank"], numbers["rod"])

    def sampler(self, scene: Scene, design: Mapping[str, float]) -> Sampler:
        """Samples of a design."""
        return registry.of(scene).sampler(scene, design)

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
