"""The beat-up's own views; what draws and prints is imported when it is first asked for."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from loomopt.jobs import registry
from loomopt.jobs.beatup.model import FRONT, REAR
from loomopt.maths.systems import FLOAT
from loomopt.model.curves import tops
from loomopt.physics.cycle import TURN
from loomopt.physics.effects.kinds import State
from loomopt.picture.job_views import JobViews, Marks, Span
from loomopt.scenes.scene import Scene

if TYPE_CHECKING:
    from loomopt.picture.equations import Equation
    from loomopt.picture.panels import Curve
    from loomopt.picture.shapes import Drawing


class BeatupViews(JobViews):
    """The crank-rocker in both dead centres, its equations, and where the cloth resists."""

    def linkage(self, scene: Scene, design: Mapping[str, float]) -> "Drawing":
        """Return the crank-rocker in both dead centres at full scale. Raises BadInput."""
        from loomopt.jobs.beatup import drawing
        from loomopt.picture.shapes import drawn_units

        return drawing.linkage(_numbers(scene, design), scene.name, drawn_units(scene))

    def joints_csv(self, scene: Scene, design: Mapping[str, float]) -> str:
        """Return its joints and centres of mass as CSV. Raises BadInput."""
        from loomopt.jobs.beatup import drawing
        from loomopt.picture.shapes import drawn_units

        return drawing.joints_csv(_numbers(scene, design), drawn_units(scene))

    def equations(self, scene: Scene) -> "tuple[Equation, ...]":
        """Return the equations the scene really uses."""
        from loomopt.jobs.beatup import equations

        return equations.equations(registry.of(scene).model(scene))

    def marks(self, scene: Scene, design: Mapping[str, float]) -> Marks:
        """Return both dead centres, rad, and where the cloth begins and ceases to resist."""
        sampler = registry.of(scene).sampler(scene, design)
        model, given = sampler.model, sampler.given
        found: dict[str, float | Span] = {name: float(model.event(FLOAT, given, name)) % TURN for name in (FRONT, REAR)}
        for pulse in model.integrals:
            found["pulse"] = Span(*sampler.cycle.stretch(pulse.where))
        return found | {name.replace("_", " "): tops(sampler, [name])[0] % TURN for name in model.least}

    def remarks(self, scene: Scene, design: Mapping[str, float]) -> tuple[str, ...]:
        """Return what there is to remark upon: a reed that twists away while it beats up."""
        if not any(isinstance(effect, State) for effect in scene.active):
            return ()
        from loomopt.picture.panels import twisted

        return twisted(scene, registry.of(scene).sampler(scene, design))

    def words(self) -> "Mapping[str, Curve]":
        """Return what the curves are called."""
        from loomopt.picture.panels import Curve

        return {
            "psi": Curve("rocker angle"),
            "psi_1": Curve("rocker speed"),
            "psi_2": Curve("rocker acceleration"),
            "psi_tt": Curve("rocker acceleration", at={FRONT: "alpha_fdc"}),
            "psi_r": Curve("reed angle", least="reed_front"),
            "twist": Curve(peak="twist_peak"),
            "mu": Curve("transmission angle", least="mu_min"),
            "M3": Curve("reed torque", at={FRONT: "M3_fdc"}),
            "Md": Curve("crank torque", peak="peak_torque"),
        }


def _numbers(scene: Scene, design: Mapping[str, float]) -> dict[str, float]:
    """Return all numbers of a design, with the offset of the reed's centre of mass where an effect has one."""
    found = registry.of(scene).numbers_of(scene, design)
    return found | {"offset": found.get(scene.full("offset"), 0.0)}


VIEWS = BeatupViews()
