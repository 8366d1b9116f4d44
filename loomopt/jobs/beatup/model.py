"""The beat-up model: a four-bar crank-rocker whose reed must be balanced within the space [Yuan24].

q = −ψ, Q = M3 (positive pushes the reed toward the fell), crank torque = Md = −M3 ψ' + drive terms.
"""

import functools
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from loomopt.base.records import lazy
from loomopt.maths.systems import Maths, Number
from loomopt.model import change, drive
from loomopt.model.change import CHANGE
from loomopt.model.kinematics import Arcs, Group, four_bar
from loomopt.model.model import CycleQuantity, DesignRow, Instant, Integral, JobModel
from loomopt.physics import balance
from loomopt.physics.balance import Given
from loomopt.physics.cycle import Node, Where
from loomopt.physics.effects.kinds import Effect, Load, Motion
from loomopt.physics.mechanisms import crank_rocker
from loomopt.physics.schema import Values

FRONT, REAR = "front dead centre", "rear dead centre"
LENGTHS = ("l1", "l2", "l3", "l4")


@dataclass(frozen=True)
class ReedMotion(Motion):
    """Pose at crank angles φ, rad, any shape: q = −ψ; only quantities that loads read are computed."""

    phi: Number
    omega: Number
    joints: crank_rocker.CrankRockerPose
    omega_dot: Number = None

    @property
    def q(self) -> Number:
        """−ψ, rad."""
        return -self.joints.psi

    @lazy
    def q1(self) -> Number:
        """−ψ'."""
        return -self.joints.psi_1

    @lazy
    def q2(self) -> Number:
        """−ψ''."""
        return -self.joints.psi_2


class FourBar(NamedTuple):
    """Quantities of the four lengths that all poses share."""

    lengths: crank_rocker.Lengths
    centres: crank_rocker.DeadCentres


def shared_linkage(given: Given) -> FourBar:
    """Quantities that all poses of a machine share."""
    linkage = given.linkage
    assert isinstance(linkage, FourBar)
    return linkage


@dataclass(frozen=True)
class FrontPose(Motion):
    """The pose at front dead centre, exact: ψ' = 0, and ψ'' in closed form; joints from the positions at β."""

    maths: Maths
    linkage: FourBar
    phi: Number
    omega: Number
    omega_dot: Number
    q1: int = 0

    @property
    def q(self) -> Number:
        """−ψ, rad."""
        return -self.linkage.centres.psi_front

    @property
    def q2(self) -> Number:
        """−ψ''."""
        return -self.linkage.centres.psi_2_front

    @lazy
    def joints(self) -> crank_rocker.CrankRockerPose:
        """The linkage with crank and rod stretched."""
        return crank_rocker.front_pose(self.maths, *self.linkage)


def _obliquity(maths: Maths, given: Given, phi: Number, pose: Callable[[], Any]) -> Number:
    return pose().joints.obliquity


@dataclass(frozen=True)
class CrankRocker:
    """The beat-up mechanism's motion: crank AB = l1 at φ, rod l2, rocker l3 at ψ, frame l4."""

    structure: str = "beatup"
    arcs: tuple[Arcs, ...] = ()
    breaks: frozenset[str] = frozenset()

    @lazy
    def groups(self) -> Mapping[str, Group]:
        """The dyad of rod and rocker: it comes nearest to folding and stretching at φ = 0 and π."""
        group = four_bar(
            ("l1", "l2", "l3", "l4"),
            1,
            lambda values: 0,
            ("B to D < l2 + l3", "B to D > |l2 - l3|"),
            _obliquity,
        )
        return {"": Group(group.quantities, group.closes, group.rows, group.margins, (0.0, math.pi))}

    def linkage(self, maths: Maths, values: Values) -> FourBar:
        """Lengths and dead centres."""
        lengths = crank_rocker.Lengths(values["l1"], values["l2"], values["l3"], values["l4"])
        return FourBar(lengths, crank_rocker.dead_centres(maths, lengths))

    def derived(self, maths: Maths, given: Given, called: Collection[str]) -> dict[str, Number]:
        """s = m4e r4e², kg·m², and both dead centres, rad."""
        values, centres = given.values, shared_linkage(given).centres
        angles = {"beta": centres.beta, "beta_r": centres.beta_r}
        return angles if "s" in values else angles | {"s": values["m4e"] * values["r4e"] ** 2}

    def hints(self, given: Given, called: Collection[str]) -> dict[str, float]:
        """No values: every event has a formula."""
        return {}

    def pose(self, maths: Maths, given: Given, node: Node) -> ReedMotion:
        """Pose at crank angles φ, rad."""
        pose = crank_rocker.CrankRockerPose(maths, shared_linkage(given).lengths, node.phi)
        return ReedMotion(node.phi, given.values.get("speed"), pose, given.values.get("omega_dot"))

    def still(self, maths: Maths, given: Given, event: str, switch: Values) -> FrontPose:
        """Pose at front dead centre."""
        return FrontPose(
            maths, shared_linkage(given), given.values["beta"], given.values.get("speed"), given.values.get("omega_dot")
        )

    def events(self, maths: Maths, given: Given) -> dict[str, Number]:
        """Both dead centres, rad."""
        return {FRONT: given.values["beta"], REAR: maths.pi + given.values["beta_r"]}


def eccentricity(at: Instant) -> Number:
    """r4 of reed and counterweight together, m [Yuan24, section on eq 10]."""
    values = at.values
    moment = values["m4"] * values["r4"] - values["m4e"] * values["r4e"]
    return moment / (values["m4"] + values["m4e"])


def inertia(at: Instant) -> Number:
    """J4 of reed and counterweight, kg·m² [Yuan24, eq 10]: all that moves with the reed."""
    return balance.total(
        [
            load.moved(at.given.inputs(at.maths, load))
            for load in at.model.loads
            if isinstance(load, Load) and load.moved
        ]
    )


def _front(at: Instant) -> Motion:
    return at.model.kinematics.still(at.maths, at.given, FRONT, {})


ROWS: dict[str, DesignRow] = {
    "swing": DesignRow(lambda at: shared_linkage(at.given).centres.swing),
    "theta": DesignRow(lambda at: shared_linkage(at.given).centres.theta),
    "beta": DesignRow(lambda at: shared_linkage(at.given).centres.beta),
    "M3_fdc": DesignRow(lambda at: at.force, event=FRONT),
    "alpha_fdc": DesignRow(lambda at: shared_linkage(at.given).centres.psi_2_front * _front(at).omega ** 2, ("speed",)),
    "r4": DesignRow(eccentricity, ("m4", "r4", "m4e")),
    "r4e_square": DesignRow(lambda at: at.values["r4e"] ** 2),
}
"""Figures and rows of front dead centre and of the linkage as a whole, SI."""


@functools.lru_cache(maxsize=64)
def model(
    effects: tuple[Effect, ...],
    words: tuple[tuple[str, str, str], ...],
    known: frozenset[str],
    pulse: Where,
    changing: tuple[str, ...] = (),
) -> JobModel:
    """Crank-rocker with effects; changing: the design variables of the retrofit's norm, if the target reads it.

    pulse: the pieces of the cycle in which the cloth resists, which the figure pulse_rms is of.
    """
    reed = any("s" in effect.reads for effect in effects if isinstance(effect, Load) and effect.moved)
    rows = ROWS | ({"J4": DesignRow(inertia)} if reed else {})
    rows |= {CHANGE: change.row(changing)} if changing else {}
    square = {"M3_square": CycleQuantity(lambda at: at.force**2, figure=False)}
    resisted = any(effect.name == pulse[0] for effect in effects)
    means = (Integral("pulse_mean_square", "pulse_rms", "M3_square", pulse),) if resisted else ()
    peaks = drive.quantities(effects, known)
    return JobModel(CrankRocker(), effects, words, peaks | square, rows, integrals=means, known=known)
