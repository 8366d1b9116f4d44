"""The beat-up job: balance the reed torque of a four-bar crank-rocker within the space [Yuan24]."""

from collections.abc import Container, Sequence
from typing import TYPE_CHECKING, final

import numpy as np

from loomopt.base.errors import BadInput
from loomopt.jobs import base
from loomopt.jobs.base import EVERY, Figures, InBox, Job, Studied
from loomopt.jobs.beatup.model import FRONT, LENGTHS
from loomopt.jobs.beatup.program import BALANCE, BeatupTask, family_sentence, member_balance, model
from loomopt.jobs.beatup.scene import RESISTED, SCHEMA, VARIABLES, RetrofitTarget, TorqueTarget, fault
from loomopt.maths.systems import Number
from loomopt.model import change
from loomopt.model.change import CHANGE
from loomopt.model.curves import Columns
from loomopt.model.model import JobModel
from loomopt.model.objectives import opposite
from loomopt.model.program import Numbers, Program
from loomopt.model.sampling import Sampler
from loomopt.physics.effects.kinds import Load
from loomopt.physics.tolerances import NO_MASS
from loomopt.scenes.scene import Scene

if TYPE_CHECKING:
    from loomopt.model.machines import Machines


@final
class Beatup(Job):
    """A four-bar crank-rocker with the reed on its rocker."""

    name = "beatup"
    own_schema = SCHEMA
    task = BeatupTask
    monotone_slack = {"r4e": "s"}  # noqa: RUF012 (never changed)

    def check(self, scene: Scene) -> None:
        """Raise BadInput, with the inequality and the crank angle, when today's machine is no crank-rocker."""
        reason = fault(scene.mechanism, scene.show)
        if reason:
            raise BadInput(
                f"today's machine is not a crank-rocker: {reason}",
                file=scene.origin,
                key="mechanism.l1, l2, l3, l4",
                value=", ".join(str(scene.given(f"mechanism.{name}")) for name in ("l1", "l2", "l3", "l4")),
                remedy="Correct the lengths: the crank l1 must be the shortest link, and shortest + longest link must "
                "be less than the sum of the other two.",
            )

    def model(self, scene: Scene, design: Numbers | None = None) -> JobModel:
        """Crank-rocker with the effects the scene calls for."""
        return model(scene, self.numbers(scene), design)

    def demand(self, scene: Scene, target: str) -> None:
        """Raise BadInput if a target needs a number that the scene does not have."""
        if not any(isinstance(effect, Load) and effect.acts == "output" for effect in scene.active):
            raise BadInput(
                f"target {target} needs a reed torque, and no effect in the scene makes one",
                file=scene.origin,
                key="effects",
                allowed=", ".join(scene.schema.effects),
                remedy="Add the table [effects.inertia] with J4, or another effect.",
            )
        base.demand(scene, target)
        resisted = RESISTED[0] in scene.effects
        if target == "torque" and scene.table(TorqueTarget).M3_tolerance is None and not resisted:
            raise BadInput(
                "target torque needs a tolerance for the reed torque",
                file=scene.origin,
                key="targets.torque.M3_tolerance",
                remedy='Set it, as in M3_tolerance = "8 N*m", or add the effect resistance: then it is 1 % of '
                "its largest torque.",
            )
        for name in scene.table(RetrofitTarget).weights if target == "retrofit" else ():
            if name not in VARIABLES:
                raise BadInput(
                    f"{name} is not a design variable",
                    file=scene.origin,
                    key=f"targets.retrofit.weights.{name}",
                    allowed=", ".join(VARIABLES),
                    remedy="Name a design variable.",
                )

    def today(self, scene: Scene) -> dict[str, float]:
        """Today's design with every other number that the scene bounds."""
        known, variables = self.numbers(scene), scene.schema.variables
        others = [scene.full(name) for name in scene.bounds if name not in variables]
        return {name: known[name] for name in (*variables, *others)}

    def design(self, program: Program, x: Numbers) -> dict[str, float]:
        """Design, SI, of NLP variables: m4e is s/r4e² where the NLP was solved in s."""
        values = {**program.parameters, **x}
        if "s" in x:
            masses = _masses(program)
            mass = x["s"] / x["r4e"] ** 2 if x["r4e"] else min(masses)
            nearest = min(masses, key=lambda limit: abs(limit - mass))
            most = next(v.range[1] for v in program.variables if v.name == "s")
            close = abs(nearest - mass) * x["r4e"] ** 2 <= NO_MASS * most
            values["m4e"] = nearest if close else min(max(mass, min(masses)), max(masses))
        extra = [name for name in x if name not in (*VARIABLES, "s")]
        return {name: values[name] for name in (*VARIABLES, *extra)}

    def values(self, program: Program, design: Numbers) -> dict[str, float]:
        """NLP's variables, SI, of a design; a counterweight without mass is at its largest radius.

        Where m4e = 0 the radius has no effect, unless it is limited, and r4e = 0 would hide how s = m4e r4e² can grow.
        """
        numbers = {**design, "s": design["m4e"] * design["r4e"] ** 2}
        rows = {row for objective in program.objectives for row in objective.rows}
        rows |= {limit.row for limit in program.row_limits}
        if design["m4e"] == 0.0 and rows.isdisjoint({"change", "r4e", opposite("r4e")}):
            numbers |= {v.name: v.upper for v in program.variables if v.name == "r4e"}
        return {v.name: numbers[v.name] for v in program.variables}

    def tidy(self, program: Program, x: Numbers) -> dict[str, float]:
        """NLP variables with a negligible counterweight taken for none, so that mass or radius can settle."""
        known = {v.name: v for v in program.variables}
        radius, masses = known.get("r4e"), _masses(program)
        if "s" not in known or radius is None or x["s"] > NO_MASS * known["s"].range[1]:
            return dict(x)
        if min(masses) == 0.0:
            return {**x, "s": 0.0}
        return {**x, "s": min(masses) * radius.lower**2, "r4e": radius.lower}

    def figures_of(
        self, scene: Scene, sampled: "Sampler | Machines", names: Container[str] = EVERY
    ) -> dict[str, Number]:
        """Every figure of a machine, or of many, SI; None for one whose numbers the scene does not have."""
        figures, limited = base.static_figures(scene, sampled, names), self.task(scene).limited
        figures["mu_min"] = np.minimum(sampled.static["mu_near"], sampled.static["mu_far"])
        signs = dict.fromkeys(sampled.model.quantities, 1) | dict.fromkeys(sampled.model.least, -1)
        called = [name for name in signs if name in names]
        sampled.search(called)
        figures |= {name: signs[name] * sampled.peak(name) for name in called}
        weights = scene.table(RetrofitTarget).weights
        figures[CHANGE] = change.figure(VARIABLES, sampled.values, self.today(scene), limited, weights)
        return figures

    def peaks(self, model: JobModel) -> dict[str, str]:
        """Figures that are extremes over the cycle."""
        return {name: name for name in (*model.quantities, *model.least)} | {"mu_min": "obliquity"}

    def in_boxes(self, scene: Scene, model: JobModel) -> dict[str, InBox]:
        """Reading of each figure over a box of numbers: the transmission angle at both dead centres."""
        boxes = super().in_boxes(scene, model) | {"mu_min": InBox(("mu_near", "mu_far"))}
        return boxes | {name: InBox(quantity=name, sign=-1.0) for name in model.least}

    def say(self, scene: Scene, target: str, figures: Figures) -> str:
        """Sentence on an optimum of the target; figures in SI."""

        def text(name: str) -> str:
            return scene.show(figures[name] or 0.0, "torque")

        front = text("M3_fdc")
        jumps = any(FRONT in effect.reads for effect in scene.active)
        where = "just before front dead centre" if jumps else "at front dead centre"
        if target == "pulse":
            return f"The least reed torque over the pulse is {text('pulse_rms')} rms ({front} {where})."
        peak_text = f"the least peak crank torque over the whole cycle is {text('peak_torque')}"
        if target == "balance":
            value = "" if BALANCE.reached(figures) else front
            return base.balance_sentence("the reed torque", where, value, peak_text)
        if target == "torque":
            return f"With the reed torque at {front} {where}, {peak_text}."
        return f"Balanced with the least change from today's machine; {peak_text.replace('least ', '')}."

    def say_together(self, members: Sequence[tuple[Scene, Numbers, Figures]], member_numbers: frozenset[str]) -> str:
        """Sentence on the M0/ω² that one ψ'' balances with the counterweights, and on those that it cannot.

        M3 = M0 − J ψ'' ω² there, so that a member balances for J = (M0/ω²)/ψ''; "" if another load acts.
        """
        if not member_numbers.isdisjoint(LENGTHS):
            return ""
        candidates = [member_balance(scene, design, figures, member_numbers) for scene, design, figures in members]
        bands = [band for band in candidates if band is not None]
        if len(bands) < len(members):
            return ""
        return family_sentence(bands, members[0][0])

    def columns(self, scene: Scene, sampler: Sampler) -> Columns:
        """ψ, ψ', ψ'', the transmission angle, folded to at most 90°, the terms, M3 and Md."""
        values = sampler.given.values
        return Columns(
            {
                "psi [rad]": lambda at: -at.pose.q,
                "psi_1 [1]": lambda at: -at.pose.q1,
                "psi_2 [1]": lambda at: -at.pose.q2,
                "mu [rad]": lambda at: np.pi / 2 - abs(at.pose.joints.obliquity),
            },
            "N*m",
            ("M3 [N*m]", lambda at: at.force),
            ("Md [N*m]", lambda at: at.crank_torque),
            also=(values["beta"], np.pi + values["beta_r"]),
            closed=True,
        )

    def studied(self, scene: Scene) -> Studied:
        """Quantities that studies show: the balance, the peak torque, the reed torque at front dead centre."""
        return Studied(("balance",), {"peak_torque": ("peak_torque", False)}, ("M3_fdc",), "psi_2")


def _masses(program: Program) -> list[float]:
    """Limits of the counterweight's mass, kg; without any there is none."""
    return [limit.value for limit in program.limits if limit.name == "m4e"] or [0.0]


JOB = Beatup()
