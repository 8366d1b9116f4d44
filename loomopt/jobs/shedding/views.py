"""Shedding's own views: the cam, its profile, the cam force, and what a designer should know beside the numbers."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, get_args

from loomopt.jobs import registry
from loomopt.jobs.shedding.model import LAW, RETURN, RISE, SEGMENT
from loomopt.maths.systems import FLOAT, Number
from loomopt.model.curves import POWER
from loomopt.model.sampling import Sampler, near_zero
from loomopt.physics.cycle import Node
from loomopt.physics.effects.kinds import Load
from loomopt.picture.job_views import JobViews, Marks, Span
from loomopt.picture.panels import BY_EFFECT, Curve, Panel
from loomopt.scenes.scene import Scene

if TYPE_CHECKING:
    from loomopt.model.separation import Parted
    from loomopt.picture.equations import Equation
    from loomopt.picture.shapes import Drawing

ALIKE = 1e-9
"""Forces this close, relative, in N, are one."""
FLOATS, NARROW = 1e-3, math.radians(5.0)
"""Share of the spring's largest force that holds no roller; rad: a narrower stretch is where the force touches zero."""


class SheddingViews(JobViews):
    """The cam with its follower, its equations, forces on the frame, and remarks."""

    angle = "cam angle"
    lists = {"law": "s'' at {count} knots"}  # noqa: RUF012 (never changed)

    def linkage(self, scene: Scene, design: Mapping[str, float]) -> "Drawing":
        """Return the cam with its follower in both dwells and at the least cam force, full scale. Raises BadInput."""
        from loomopt.jobs.shedding import drawing

        found = drawing.cam(scene, design)
        return drawing.linkage(scene, found, registry.of(scene).figures(scene, design))

    def joints_csv(self, scene: Scene, design: Mapping[str, float]) -> str:
        """Return the profile as CSV. Raises BadInput."""
        from loomopt.jobs.shedding import drawing

        return drawing.joints_csv(scene, drawing.cam(scene, design))

    def missing(self, scene: Scene) -> tuple[str, ...]:
        """Return the keys of the follower that the scene does not give."""
        from loomopt.jobs.shedding import drawing

        return drawing.missing(scene)

    def equations(self, scene: Scene) -> "tuple[Equation, ...]":
        """Return the equations the scene really uses."""
        from loomopt.jobs.shedding import equations

        return equations.equations(registry.of(scene).model(scene))

    def marks(self, scene: Scene, design: Mapping[str, float]) -> Marks:
        """Return the dwells, cam angles in rad, and where the cam force is least if the frame stays on its cam."""
        job = registry.of(scene)
        values = job.sampler(scene, design).given.values
        found: dict[str, float | Span] = {}
        if float(values["far_dwell"]) > 0.0:
            found["far dwell"] = Span(float(values["begin.far"]), float(values["begin.return"]))
        if float(values["near_dwell"]) > 0.0:
            found["near dwell"] = Span(float(values["begin.near"]), 0.0)
        parted = job.parted(scene, job.sampler(scene, design))
        if parted is None or not parted.course.parted:
            angle = job.figures(scene, design)["contact_angle"]
            found["least cam force"] = math.nan if angle is None else angle
        if parted is None:
            return found

        from loomopt.picture.parted import marks

        return marks(parted, found)

    def words(self) -> Mapping[str, Curve]:
        """Return what the curves are called."""
        return {
            "X": Curve("frame travel"),
            "X_cam": Curve("cam"),
            "gap": Curve("frame to cam", most="gap_max"),
            "X_1": Curve("frame speed"),
            "X_2": Curve("frame acceleration"),
            "X_3": Curve(shown=False),
            "s_2": Curve("acceleration s'' of the cam law", peak="law_acceleration"),
            "N": Curve("cam force", least="contact_min", most="contact_max", wide=True),
            "return_spring": Curve(panel=BY_EFFECT),
            "cam_torque": Curve(peak="peak_torque"),
            "pressure_angle": Curve(peak="pressure_angle_max"),
            "curvature": Curve("pitch", least="curvature_min", most="curvature_max"),
            "profile_curvature": Curve(shown=False),
        }

    def panels(self, scene: Scene, design: Mapping[str, float], columns: Sequence[str]) -> tuple[Panel, ...]:
        """Return all panels, with what contact and the roller ask for."""
        values = registry.of(scene).numbers_of(scene, design)
        levels = {"N [N]": {"contact is lost below N_min =": (values["N_min"],)}}
        if "roller_radius" in values:
            levels["curvature [1/m]"] = {"undercut above 1/roller_radius =": (1 / values["roller_radius"],)}
        found = super().panels(scene, design, columns)
        # The law's own acceleration has the frame's shape: it says more only where it is limited. There is no torque in
        # the dwells, and where forces are known in them alone, none is known.
        partly = bool(registry.of(scene).model(scene).known_in)
        left = {"s_2 [1]": "law_acceleration" not in scene.limits, "cam_torque [N*m]": partly, POWER: partly}
        shown = [panel for panel in found if not left.get(panel.columns[0])]
        shown = [panel._replace(levels={**panel.levels, **levels.get(panel.columns[0], {})}) for panel in shown]
        if "X_cam [m]" not in columns:
            return tuple(shown)
        from loomopt.picture.parted import together

        return together(shown, ("X [m]", "X_cam [m]"), "travel of frame and cam")

    def remarks(self, scene: Scene, design: Mapping[str, float]) -> tuple[str, ...]:
        """Return what there is to remark upon: forces known in the dwells only, a roller that floats, an undercut."""
        job = registry.of(scene)
        sampler = job.sampler(scene, design)
        undercut = () if self.missing(scene) else _undercut(scene, design)
        parted = _parted(scene, job.parted(scene, sampler))
        return (*super().remarks(scene, design), *_partly(sampler), *_floating(scene, sampler), *undercut, *parted)


def _parted(scene: Scene, parted: "Parted | None") -> Iterator[str]:
    """Say where the roller leaves the cam, where an effect says what then becomes of the frame."""
    if parted:
        from loomopt.picture.parted import remarks

        yield from remarks(scene, parted)


def _floating(scene: Scene, sampler: Sampler) -> Iterator[str]:
    """Say over which cam angles nothing holds the roller on the cam, where no least force is asked for."""
    if scene.operation["N_min"] > 0.0:
        return
    spans = near_zero(sampler, "lift", FLOATS * abs(sampler.static["spring_force_max"]), NARROW)
    if spans:
        told = " and ".join(f"from {scene.show(a, 'angle', 4)} to {scene.show(b, 'angle', 4)}" for a, b in spans)
        whole = scene.show(sum(end - begin for begin, end in spans), "angle", 3)
        yield (
            f"N_min is 0, and the cam force is less than {100 * FLOATS:g} % of the spring's largest force {told}: the "
            f"roller floats for {whole} of the turn. What helps: an N_min above 0"
        )


def _undercut(scene: Scene, design: Mapping[str, float]) -> Iterator[str]:
    from loomopt.jobs.shedding import drawing

    found = drawing.cam(scene, design)
    if found.undercut:
        roller, radius = found.follower.roller_radius, 1 / found.undercut.value
        angle, most = scene.show(found.sampler.angle(found.undercut), "angle", 5), scene.show(radius, "length", 4)
        yield (
            f"the cam is undercut at {angle}: the roller's centre turns there with a radius of {most}, "
            f"{scene.show(roller - radius, 'length', 3)} less than roller_radius = {scene.show(roller, 'length')}, so "
            f"the profile is cut away and X not followed. What helps: a roller_radius below {most}, or a larger "
            f"base_radius"
        )


def _partly(sampler: Sampler) -> Iterator[str]:
    """Say of loads that are known in the dwells only what acts where contact is then not judged."""
    acting = " and ".join(_acting(sampler))
    for load in sampler.model.loads:
        words = sampler.model.words_of(load.name)
        if acting and isinstance(load, Load) and load.known_in(words):
            shape = " and ".join(f"{key} {word}" for key, word in words.items())
            verb = "act" if " and " in acting else "acts"
            yield (
                f"{load.name} with {shape} is known in the dwells only: contact is judged there, and not in the moves, "
                f"where {acting} {verb}. Choose {_others(load, words)} to judge the whole cycle"
            )


def _others(load: Load[Any], words: Mapping[str, str]) -> str:
    """Return the words of a load's table with which it is known all over the cycle."""
    found = []
    for key, word in words.items():
        said = [each for each in get_args(load.own.model_fields[key].annotation) if each != word]
        found.append(f"{key} = " + " or ".join(f'"{each}"' for each in said if not load.known_in({**words, key: each})))
    return " and ".join(found)


def _acting(sampler: Sampler) -> list[str]:
    """Return the loads that act while the frame moves: they need the speed, or differ between rise and return."""
    rise, back = (_terms(sampler, segment) for segment in (RISE, RETURN))
    moved = {load.name for load in sampler.model.loads if "operation.speed" in load.needs}
    moved |= {name for name, term in rise.items() if not math.isclose(term, back[name], rel_tol=ALIKE, abs_tol=ALIKE)}
    return [load.name for load in sampler.model.loads if load.name in moved]


def _terms(sampler: Sampler, segment: int) -> dict[str, Number]:
    """Return each load's term a quarter of the way into a move, on the law's first formula."""
    values = sampler.given.values
    begin, share, length = {RISE: (0, 1, "rise"), RETURN: (values["begin.near"], -1, "return")}[segment]
    node = Node(begin + share * values[length] / 4, {SEGMENT: segment, LAW: 0.0})
    return sampler.model.instant(FLOAT, sampler.given, node).terms()


VIEWS = SheddingViews()
