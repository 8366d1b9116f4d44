"""The press drawn in three positions, its equations, and where its dead centres are."""

import math
from collections.abc import Mapping, Sequence

from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.physics import balance
from loomopt.picture import effect_equations
from loomopt.picture.drawing import Label, Skeleton, along, place
from loomopt.picture.equations import Equation, Symbols, equation, symbol
from loomopt.picture.job_views import JobViews
from loomopt.picture.panels import Panel
from loomopt.picture.shapes import Drawing, Point, drawn_units
from loomopt.scenes.scene import Scene
from loomopt_press.model import BOTTOM, TOP, SlidePose

HALF = "half way"


class PressViews(JobViews):
    """A crank above, the slide below."""

    def linkage(self, scene: Scene, design: Mapping[str, float]) -> Drawing:
        """Return the press in both dead centres and half way, at full scale."""
        known = registry.of(scene).numbers_of(scene, design)
        units, skeleton, height = drawn_units(scene), self._skeleton(known), 0.02 * (known["crank"] + known["rod"])
        strokes, at = skeleton.strokes(height), skeleton.at(HALF)
        labels = [
            Label("frame", at["A"], math.pi, "A"),
            Label(HALF, at["B"], 0.0, "B"),
            Label(HALF, at["C"], 0.0, "C"),
            along(HALF, at["A"], at["B"], math.pi / 2, f"crank = {units.size(known['crank'])}"),
            along(HALF, at["B"], at["C"], 0.0, f"rod = {units.size(known['rod'])}"),
        ]
        legend = (*((event, event) for event in skeleton.joints), ("notes", units.said))
        return Drawing(scene.name, height, (*strokes, *place(labels, strokes, height)), legend, units.length)

    def joints_csv(self, scene: Scene, design: Mapping[str, float]) -> str:
        """Return its joints as CSV."""
        return self._skeleton(registry.of(scene).numbers_of(scene, design)).csv(drawn_units(scene))

    def equations(self, scene: Scene) -> tuple[Equation, ...]:
        """Return the equations the scene really uses."""
        model, names = registry.of(scene).model(scene), ("q", "q'", "q''")
        slide = SlidePose(systems.sympy(), symbol("crank"), symbol("rod"), symbol("phi"), symbol("omega"))
        travel = zip(names, (slide.q, slide.q1, slide.q2), strict=True)
        pose = balance.Pose(slide.phi, slide.omega, *map(symbol, names))
        known = effect_equations.given(model, Symbols())
        written = [equation("travel", symbol(name), value) for name, value in travel]
        return (*written, *effect_equations.forces(model, pose, known, "Q", "Q"))

    def marks(self, scene: Scene, design: Mapping[str, float]) -> dict[str, float]:
        """Return both dead centres, rad."""
        return {TOP: 0.0, BOTTOM: math.pi}

    def panels(self, scene: Scene, design: Mapping[str, float], columns: Sequence[str]) -> tuple[Panel, ...]:
        """Return torque, force and travel."""
        shown = {"crank torque": "Md [N*m]", "force": "Q [N]", "travel": "q [m]"}
        return tuple(Panel((column,), name) for name, column in shown.items() if column in columns)

    def _skeleton(self, known: Mapping[str, float]) -> Skeleton:
        shaft, crank, rod = Point(0.0, 0.0), known["crank"], known["rod"]
        positions = {TOP: 0.0, HALF: math.pi / 2, BOTTOM: math.pi}
        joints = {}
        for event, phi in positions.items():
            pin = shaft.towards(math.pi / 2 - phi, crank)
            joints[event] = {"B": pin, "C": Point(0.0, pin.y - math.sqrt(rod**2 - pin.x**2))}
        return Skeleton({"A": shaft}, joints, (("A", "B"), ("B", "C")), (("A", crank),))


VIEWS = PressViews()
