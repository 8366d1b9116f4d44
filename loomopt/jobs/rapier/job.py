"""The rapier job: stroke and dwells of a five-bar drive on the sley [Hong17]."""

import math
from collections.abc import Container, Mapping
from typing import TYPE_CHECKING, final

import numpy as np

from loomopt.base.errors import BadInput, refusal
from loomopt.jobs import base
from loomopt.jobs.base import EVERY, Crossing, Figures, InBox, Job, Studied
from loomopt.jobs.rapier.model import jerk_mean, match_mean, read, read_many, shared_linkage
from loomopt.jobs.rapier.program import SIDES, RapierTask, model
from loomopt.jobs.rapier.scene import FIGURES, SCHEMA, STROKE, VARIABLES, MatchTarget, match_table, read_match
from loomopt.maths import periodic_cubic
from loomopt.maths.systems import FLOAT, Number
from loomopt.model.curves import Columns
from loomopt.model.model import JobModel
from loomopt.model.program import Numbers, Program
from loomopt.model.sampling import Sampler
from loomopt.physics.mechanisms import rapier_drive
from loomopt.scenes.csv_tables import Record
from loomopt.scenes.scene import Scene

if TYPE_CHECKING:
    from loomopt.model.machines import Machines


@final
class Rapier(Job):
    """A five-bar rapier drive on the sley of a four-bar, with one 2:1 gear."""

    name = "rapier"
    # Its table is read with the design, because the file may change before the figure is read.
    at_once = ("match_rms",)
    own_schema = SCHEMA
    task = RapierTask

    def open_boxes(self, model: JobModel) -> str:
        """Boxes of drives do not close."""
        return "no global claim: boxes of 1 % round a drive's optimum do not close in any time worth waiting for"

    def check(self, scene: Scene) -> None:
        """Raise BadInput when today's drive does not turn, or the dwells leave no time to travel."""
        fault = rapier_drive.fault_of(scene.mechanism, scene.show)
        if fault:
            raise BadInput(
                f"today's drive does not turn all round: {fault}",
                file=scene.origin,
                key="mechanism",
                remedy="Correct its dimensions: today's machine must assemble at every crank angle.",
            )
        for name in ("dwell", *STROKE[2:]):
            least = scene.limits[name].min if name in scene.limits else None
            if least is None:
                continue
            if "s_dwell" not in scene.operation:
                raise refusal("a dwell needs s_dwell", scene.origin, "operation.s_dwell", remedy="Give it")
            if not 0.0 < least < math.pi:
                key, allowed = f"limits.{name}.min", "more than 0 deg and less than 180 deg"
                raise refusal(
                    "the dwell is out of range", scene.origin, key, scene.given(key), allowed, "Correct the value"
                )

    def model(self, scene: Scene, design: Numbers | None = None) -> JobModel:
        """Drive with the effects the scene calls for."""
        return model(scene)

    def demand(self, scene: Scene, target: str) -> None:
        """Raise BadInput if a target needs a number that the scene does not have."""
        base.demand(scene, target)
        if target == "match":
            match_table(scene)

    def tables(self, scene: Scene, target: str) -> tuple[Record, ...]:
        """Remarks on the tables that are read: head travel for target match."""
        if target != "match":
            return super().tables(scene, target)
        read = read_match(scene)
        misfit = {"S": periodic_cubic.misfit(read.columns["phi1"], read.columns["S"])}
        return (*super().tables(scene, target), read.record("targets.match.table", misfit, "the head travel to match"))

    def design(self, program: Program, x: Numbers) -> dict[str, float]:
        """Design, SI, of NLP variables: the drive's own, and every other number that is freed."""
        fixed = {limit.row for limit in program.bound_limits.values() if limit.sign == 0} - set(STROKE)
        free_names = {v.name for v in program.variables if v.lower < v.upper or v.name in fixed} - {
            "phi_stroke",
            "dwell",
        }
        values = {**program.parameters, **x}
        return {
            name: values[name]
            for name in (*VARIABLES, *(name for name in x if name in free_names and name not in VARIABLES))
        }

    def figures_of(
        self, scene: Scene, sampled: "Sampler | Machines", names: Container[str] = EVERY
    ) -> dict[str, Number]:
        """Every figure of a machine, or of many, SI; None for one whose numbers the scene does not have."""
        peaks = {name: of for name, of in self.peaks(sampled.model).items() if name in names and name != "stroke"}
        sampled.search(("S", *peaks.values()))
        reading = read(sampled) if isinstance(sampled, Sampler) else read_many(sampled)
        figures, static = base.static_figures(scene, sampled, names), sampled.static
        figures |= {"stroke": reading.stroke, "phi_stroke": reading.phi_stroke}
        if "s_dwell" in scene.operation:
            figures |= {"dwell_after": reading.dwell_after, "dwell_before": reading.dwell_before}
            figures["dwell"] = np.minimum(reading.dwell_after, reading.dwell_before)
        figures |= {name: sampled.peak(of) for name, of in peaks.items()}
        if "mu_min" in names:
            figures["mu_min"] = math.pi / 2 - figures["mu_min"]
        figures["sley_mu_min"] = np.minimum(static["sley_mu_near"], static["sley_mu_far"])
        if "rms_jerk" in names:
            figures["rms_jerk"] = np.sqrt(sampled.mean(jerk_mean()))
        if "match_rms" in names and scene.table(MatchTarget).table is not None:
            figures["match_rms"] = np.sqrt(sampled.mean(match_mean(*match_table(scene))))
        return figures

    def over_cycle(self, model: JobModel) -> dict[str, str]:
        """Figures that are read over the cycle, with their quantities."""
        return {**super().over_cycle(model), "rms_jerk": ""}

    def peaks(self, model: JobModel) -> dict[str, str]:
        """Figures that are extremes over the cycle."""
        return {name: name for name in model.quantities} | {"stroke": "S", "mu_min": "obliquity"}

    def in_boxes(self, scene: Scene, model: JobModel) -> dict[str, InBox]:
        """Reading of each figure over a box of numbers: dwells end where the head leaves s_dwell."""
        boxes = super().in_boxes(scene, model)
        boxes |= {"stroke": InBox(quantity="S", largest=True), "sley_mu_min": InBox(("sley_mu_near", "sley_mu_far"))}
        boxes["mu_min"] = InBox(quantity="obliquity", sign=-1.0, offset=math.pi / 2)
        sides = {"dwell_after": 1, "dwell_before": -1} if "s_dwell" in scene.operation else {}
        return boxes | {name: InBox(quantity="dwell_travel", leaves=side) for name, side in sides.items()}

    def say(self, scene: Scene, target: str, figures: Figures) -> str:
        """Sentence on an optimum of the target; figures in SI."""

        def text(name: str, digits: int = 9) -> str:
            return scene.show(figures.get(name) or 0.0, FIGURES[name].kind, digits)

        if target == "match":
            return f"The head travel comes within {text('match_rms', 6)} rms of the table."
        stroke_and_dwell = f"stroke {text('stroke')} and {text('dwell', 4)} of dwell"
        if target == "stroke-dwell":
            return f"With {stroke_and_dwell}, the least peak head acceleration is {text('peak_acceleration')}."
        if target == "smooth":
            return f"With {stroke_and_dwell}, the least rms head jerk is {text('rms_jerk')}."
        return f"With stroke {text('stroke')}, the largest dwell on both sides is {text('dwell')}."

    def columns(self, scene: Scene, sampler: Sampler) -> Columns:
        """S with three derivatives, φ3, φ6, φ63, the folded transmission angle, terms, tape force and torque."""
        front = sampler.model.kinematics.still(FLOAT, sampler.given, "front dead centre", {}).joints  # type: ignore[attr-defined]
        gap = math.atan2(front.dyad.link2.y, front.dyad.link2.x) - front.phi3
        centres = shared_linkage(sampler.given).centres
        rear = math.pi + centres.beta_r - centres.beta
        return Columns(
            {
                "S [m]": lambda at: at.pose.q,
                "S_1 [m/rad]": lambda at: at.pose.q1,
                "S_2 [m/rad^2]": lambda at: at.pose.q2,
                "S_3 [m/rad^3]": lambda at: at.pose.q3,
                "phi3 [rad]": lambda at: at.pose.joints.phi3,
                "phi6 [rad]": lambda at: at.pose.joints.phi3 + gap + at.pose.joints.phi63(at.pose.front),
                "phi63 [rad]": lambda at: at.pose.joints.phi63(at.pose.front),
                "mu [rad]": lambda at: math.pi / 2 - abs(at.pose.joints.obliquity),
            },
            "N",
            ("Q [N]", lambda at: at.force),
            ("Md [N*m]", lambda at: at.crank_torque),
            also=(read(sampler).phi_stroke, rear),
        )

    def studied(self, scene: Scene) -> Studied:
        """Quantities that studies show: peak acceleration, stroke, and where the head leaves its dwell."""
        peaks = {"peak_acceleration": ("peak_acceleration", False), "stroke": ("S", True)}
        leaves = next(iter(self.crossings(scene).get("dwell_after", ())), None)
        return Studied(("stroke-dwell",), peaks, motion="S_2", crossing=leaves)

    def crossings(self, scene: Scene) -> Mapping[str, tuple[Crossing, ...]]:
        """Crank angles at which the head leaves its dwells."""
        if "s_dwell" not in scene.operation:
            return {}
        crossings = {name: (Crossing(name, "S", "s_dwell", int(side)),) for name, side in SIDES.items()}
        return crossings | {"dwell": tuple(crossing for (crossing,) in crossings.values())}


JOB = Rapier()
