"""The rapier's own views; what draws and prints is imported when it is first asked for."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from loomopt.jobs import registry
from loomopt.jobs.rapier.model import read
from loomopt.maths.systems import FLOAT
from loomopt.physics.cycle import TURN
from loomopt.picture.job_views import JobViews, Marks, Span
from loomopt.scenes.scene import Scene

if TYPE_CHECKING:
    from loomopt.picture.equations import Equation
    from loomopt.picture.panels import Curve
    from loomopt.picture.shapes import Drawing

SWUNG = "of sley and driving link"


class RapierViews(JobViews):
    """The drive in both dead centres of the sley and at the hand-over, its equations, and where the head dwells."""

    def linkage(self, scene: Scene, design: Mapping[str, float]) -> "Drawing":
        """Return the drive in both dead centres and at the hand-over, at full scale. Raises BadInput."""
        from loomopt.jobs.rapier import drawing
        from loomopt.picture.shapes import drawn_units

        return drawing.linkage(registry.of(scene).numbers_of(scene, design), scene.name, drawn_units(scene))

    def joints_csv(self, scene: Scene, design: Mapping[str, float]) -> str:
        """Return its joints as CSV. Raises BadInput."""
        from loomopt.jobs.rapier import drawing
        from loomopt.picture.shapes import drawn_units

        return drawing.joints_csv(registry.of(scene).numbers_of(scene, design), drawn_units(scene))

    def equations(self, scene: Scene) -> "tuple[Equation, ...]":
        """Return the equations the scene really uses."""
        from loomopt.jobs.rapier import equations

        return equations.equations(registry.of(scene).model(scene))

    def marks(self, scene: Scene, design: Mapping[str, float]) -> Marks:
        """Return the sley's dead centres, rad, the hand-over and the dwell."""
        sampler = registry.of(scene).sampler(scene, design)
        events, reading = sampler.model.kinematics.events(FLOAT, sampler.given), read(sampler)
        found = {name: float(angle) % TURN for name, angle in events.items()} | {"hand-over": reading.phi_stroke}
        if "s_dwell" not in scene.operation:
            return found
        return {**found, "dwell": Span(TURN - reading.dwell_before, reading.dwell_after)}

    def words(self) -> "Mapping[str, Curve]":
        """Return what the curves are called."""
        from loomopt.picture.panels import Curve

        return {
            "S": Curve("head travel"),
            "S_1": Curve("head speed"),
            "S_2": Curve("head acceleration", peak="peak_acceleration"),
            "S_3": Curve("head jerk", peak="peak_jerk"),
            "phi3": Curve("sley", SWUNG),
            "phi6": Curve("driving link", SWUNG),
            "phi63": Curve("link on the sley", SWUNG),
            "mu": Curve("transmission angle", least="mu_min"),
            "Q": Curve("tape force", peak="tape_force"),
            "Md": Curve("crank torque", peak="peak_torque"),
        }


VIEWS = RapierViews()
