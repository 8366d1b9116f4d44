"""Program of a beat-up scene and a target: variables, limits, objectives and their scales."""

import math
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple, final

from loomopt.base.records import Frozen, lazy
from loomopt.jobs.base import Ends, Task, bound_limits, distinct, ends, size_read, steady
from loomopt.jobs.beatup import model as beatup
from loomopt.jobs.beatup.model import LENGTHS
from loomopt.jobs.beatup.scene import RESISTED, VARIABLES, BeatupTarget, RetrofitTarget, TorqueTarget
from loomopt.maths.systems import FLOAT
from loomopt.model import change
from loomopt.model.change import today
from loomopt.model.drive import TORQUE
from loomopt.model.limits import Limit, RatioLimit
from loomopt.model.model import JobModel
from loomopt.model.numbers import curves, numbers, words
from loomopt.model.objectives import Magnitude, Objective, Peak, Value
from loomopt.model.program import Added, Goal, Move, Numbers, Preference, Variable, goals
from loomopt.model.sampling import Sampler, sampled
from loomopt.physics.cycle import Where
from loomopt.physics.effects.kinds import Check, Load, model_of
from loomopt.physics.tolerances import INDIFFERENT, NO_MASS, SHOWN_AS_ZERO
from loomopt.scenes.scene import Scene

COUNTERWEIGHT = ("m4e", "r4e")
BALANCED = 1e-8
"""|M3| at front dead centre below this share of the peak torque is called zero (words of the beat-up only)."""
BALANCE = Goal("M3_fdc", 0.0, 0.0, BALANCED, "peak_torque")
"""Goal of target balance, which may be out of reach."""
AMPLE, LONG = 10.0, 3.0
"""Inertia beyond which no counterweight is of use, in those of the reed; radius beyond which none is built, in l4."""


def counterweight_holding(reed: float, front: float, resistance: float) -> float:
    """Inertia, kg·m², that balances the resistance at front dead centre with today's acceleration of the reed.

    reed: today's inertia, kg·m²; front: today's reed torque at front dead centre, N·m; resistance: N·m. It follows
    from M3 = M0 − J ψ'' ω² [Yuan24, eq 2].
    """
    return reed * abs(resistance / (front - resistance)) if front != resistance else 0.0


def counterweight_room(known: Mapping[str, float], bounds: Mapping[str, Ends], inertia: float) -> dict[str, Ends]:
    """Bounds of mass, kg, and radius, m, of the counterweight, reduced to a useful range for scales and starts.

    known: today's m4e, r4e and l4; inertia: that of the reed, or the one that balances the resistance, kg·m²; 0 if
    there is none to compare with: the bounds are then not reduced.
    """
    room, ample = {name: bounds[name] for name in COUNTERWEIGHT}, AMPLE * inertia
    if room["m4e"][1] * room["r4e"][1] ** 2 > ample > 0.0:
        low, high = room["r4e"]
        room["r4e"] = low, min(high, max(low, known["r4e"], LONG * known["l4"]))
        low, high = room["m4e"]
        room["m4e"] = low, min(high, max(low, known["m4e"], ample / room["r4e"][1] ** 2))
    return room


USED = {"s": 0.4, "m4e": 0.5, "r4e": 0.9}
MUCH = {"m4e": 0.98, "r4e": 0.9}
"""Shares of the counterweight's room that a solve starts from."""
SAMPLES = 180
"""Samples of one turn that are enough for a size."""
MASKED = 1e-3
"""A reed torque that moves by less than this share of the resistance is scaled by the resistance."""


def resisted(scene: Scene) -> Where:
    """Pieces of the cycle in which the cloth resists; for a curve those in which it is not 0 everywhere."""
    curve = next((pulse for (name, _), pulse in curves(scene).items() if name == RESISTED[0]), None)
    return RESISTED if curve is None else (RESISTED[0], curve.acting)


def model(scene: Scene, known: Numbers, design: Numbers | None = None, changes: bool = False) -> JobModel:
    """Mechanism with the effects of the scene, prepared for its states. Raises BadInput.

    known: numbers of the scene; design: numbers that differ from today's; changes: whether the change is read.
    """
    changing = tuple(VARIABLES) if changes else ()
    physics = beatup.model(scene.active, words(scene), frozenset(known), resisted(scene), changing)
    return steady(scene, physics, known, design)


@final
class BeatupTask(Task):
    """Task of the crank-rocker; s = m4e r4e² is a variable if only this product of mass and radius counts."""

    read_from = Frozen(mu_min=("mu_near", "mu_far"))

    @lazy
    def known(self) -> dict[str, float]:
        """Every number of the scene; today's lengths also with the names today.*."""
        return numbers(self.scene) | {today(name): self.scene.mechanism[name] for name in LENGTHS}

    @lazy
    def model(self) -> JobModel:
        """The mechanism, with the change from today if the target or an axis needs it."""
        return model(self.scene, self.known, changes=self.changes)

    @property
    def changes(self) -> bool:
        """Whether the change from today is read."""
        return self.target == "retrofit" or "change" in self.traded

    @property
    def trades_balance(self) -> bool:
        """Whether the reed torque at front dead centre is an axis; the target's demand on it then does not apply."""
        return "M3_fdc" in self.traded

    @lazy
    def direct(self) -> bool:
        """Whether m4e and r4e are variables themselves, because more than s = m4e r4e² counts or s has no range."""
        names = {*self.scene.limits, *self.traded}
        read = self.changes or bool(names & {"r4", *COUNTERWEIGHT})
        for effect in self.scene.active:
            is_limited = isinstance(effect, Check) and (effect.demands or names & {*effect.over_cycle, *effect.rows})
            reads = {*effect.reads, *model_of(effect, self.scene.effects[effect.name]).reads}
            read = read or bool(reads & set(COUNTERWEIGHT) and (isinstance(effect, Load) or is_limited))
        fixed = all(self.limited[name][0] == self.limited[name][1] for name in COUNTERWEIGHT)
        return read or fixed or self.limited["r4e"][1] == 0.0

    # Variables.

    @lazy
    def bounded(self) -> tuple[Variable, ...]:
        """The lengths, every bounded number, and the counterweight: by mass and radius, or by s and radius."""
        ends = {name: pair for name, pair in self.limited.items() if self.direct or name != "m4e"}
        variables = tuple(self.variable(name, pair) for name, pair in ends.items())
        return (
            variables
            if self.direct
            else (*variables, Variable("s", -math.inf, math.inf, self.inertia, (0.0, self.most)))
        )

    def scale(self, name: str, ends: Ends) -> float:
        """Scale of a variable: the frame for lengths, else its largest useful value."""
        if name in LENGTHS:
            return self.length
        return max(abs(self.known[name]), *map(abs, self.room(name, ends))) or self.length

    def room(self, name: str, ends: Ends) -> Ends:
        """Range of the random starts: the useful range of the counterweight."""
        return self.counterweight.get(name, ends)

    def parameters(self) -> dict[str, float]:
        """Every known number that is not a variable; m4e follows from s if s is a variable."""
        taken = {variable.name for variable in self.variables} | {"m4e"}
        values = {name: value for name, value in self.known.items() if name not in taken}
        if not self.changes:
            return values
        weights = self.scene.table(RetrofitTarget).weights
        return values | change.parameters(VARIABLES, self.known, self.limited, weights)

    # Limits.

    def bounds(self) -> list[Limit]:
        """Bounds of the variables; if s is a variable, bounds of the mass are limits on the ratio of s and r4e²."""
        limits = [limit for v in self.variables if v.called in self.scene.bounds for limit in bound_limits(v, False)]
        if self.direct:
            return limits
        return limits + [
            RatioLimit("m4e", sign, "s", value, self.inertia, "r4e_square", relaxable=sign >= 0 or value > 0.0)
            for sign, value in ends(*self.limited["m4e"])
        ]

    def goal_limits(self) -> list[Limit]:
        """Limit that the target sets to the reed torque at front dead centre."""
        if self.trades_balance or self.target not in ("retrofit", "torque"):
            return []
        tolerance = self.scene.table(TorqueTarget).M3_tolerance if self.target == "torque" else 0.0
        tolerance = 0.01 * self.resistance if tolerance is None else tolerance
        sides = [(0, 0.0)] if tolerance == 0.0 else [(-1, -tolerance), (1, tolerance)]
        return [self.row_limit("M3_fdc", sign, "M3_fdc", value, self.torque) for sign, value in sides]

    def goals(self) -> tuple[Goal, ...]:
        """Goal of the reed torque; for balance, the tolerance within which it counts as zero."""
        if self.target != "balance":
            return goals(self.goal_limits())
        return () if self.trades_balance else (BALANCE,)

    # Levels, starts and moves.

    def objectives(self) -> tuple[Objective, ...]:
        """Target's levels in order."""
        peak = Peak(TORQUE, TORQUE, self.peak)
        levels = {
            "balance": (Magnitude("M3_fdc", "M3_fdc", self.torque), peak),
            "torque": (peak,),
            "pulse": (Value("pulse_rms", "pulse_mean_square", self.mean_square, power=2),),
            "retrofit": (Value("change", "change", 1.0),),
        }
        return *levels[self.target], *self.least()

    def starts(self) -> tuple[dict[str, float], ...]:
        """Today's machine moved just inside its bounds, with a good part of the counterweight in use.

        Never only today's m4e = r4e = 0, where the gradient with respect to a counterweight is zero. If mass and radius
        count themselves, a light and a heavy counterweight may be separate optima: then there is a second start.
        """
        first = self.inside({v.name: self.known.get(v.name, 0.0) for v in self.variables})

        def using(shares: Mapping[str, float]) -> dict[str, float]:
            given = {v.name: v.range for v in self.variables if v.name in shares}
            return first | {name: low + shares[name] * (high - low) for name, (low, high) in given.items()}

        retrofit = self.target == "retrofit"
        return distinct([using(USED), *([first] if retrofit else [using(MUCH)] if self.direct else [])])

    def moves(self) -> list[Move]:
        """Directions in which all figures may be constant: the counterweight's mass and radius, a common scale."""
        names = {variable.name for variable in self.variables}
        used, above = ("s", NO_MASS * self.most) if "s" in names else ("m4e", 0.0)
        wishes = {
            "m4e": (Preference("least", "least added mass"),),
            "r4e": (
                Preference("most", "least added mass, so the largest radius", used, above),
                Preference("today", "no mass, so the radius nearest today's"),
            ),
        }
        room = [name for name in COUNTERWEIGHT if name in names and self.limited[name][0] < self.limited[name][1]]
        moves = [self.move("counterweight", name, wishes[name]) for name in room]
        return [*moves, self.scale_move("scale", LENGTHS), *self.axis_moves()]

    def added(self) -> Added | None:
        """Added mass, which must pay: the counterweight, by its mass or by s."""
        table = self.scene.targets[self.target] if self.target else None
        if not isinstance(table, BeatupTarget) or self.limited["m4e"][1] == 0.0:
            return None
        row = "m4e" if self.direct else "s"
        size = next(v.scale for v in self.variables if v.name == row)
        share = table.indifference
        without = {row: 0.0} if self.limited["m4e"][0] == 0.0 else {}
        return Added(Value("m4e", row, size), without, INDIFFERENT if share is None else share, share is None)

    # Scales, from today's machine without the change from today.

    @lazy
    def sampler(self) -> Sampler:
        """Today's machine."""
        return sampled(model(self.scene, self.known), self.known, SAMPLES)

    @property
    def length(self) -> float:
        """Length of the frame, m: scale of lengths."""
        return self.known["l4"]

    @lazy
    def resistance(self) -> float:
        """Resistance of the cloth, N·m."""
        curve = next((pulse for (name, _), pulse in curves(self.scene).items() if name == RESISTED[0]), None)
        if curve is not None:
            return curve.largest
        return self.known.get("M0", 0.0) if RESISTED[0] in self.scene.effects else 0.0

    @lazy
    def front(self) -> float:
        """The reed torque at front dead centre, N·m."""
        return self.sampler.static.get("M3_fdc", 0.0)

    @lazy
    def reed(self) -> float:
        """Inertia of the reed without a counterweight, kg·m²."""
        given = self.sampler.given
        bare = given._replace(values={**given.values, "s": 0.0})
        loads = [load for load in self.sampler.model.loads if isinstance(load, Load) and "s" in load.reads]
        return max((float(load.moved(bare.inputs(FLOAT, load))) for load in loads if load.moved), default=0.0)

    @lazy
    def counterweight(self) -> dict[str, Ends]:
        """Useful bounds of mass and radius of the counterweight."""
        holding = counterweight_holding(self.reed, self.front, self.resistance)
        return counterweight_room(self.known, self.limited, max(self.reed, holding))

    @lazy
    def most(self) -> float:
        """Largest useful inertia of a counterweight, kg·m²."""
        return self.counterweight["m4e"][1] * self.counterweight["r4e"][1] ** 2

    @lazy
    def inertia(self) -> float:
        """Scale of inertias, kg·m²: that of the reed or of the counterweight, whichever is larger."""
        return max(self.reed, self.most) or 1.0

    @lazy
    def peak(self) -> float:
        """The peak crank torque, N·m."""
        return (self.sampler.peak(TORQUE) if self.sampler.model.loads else 0.0) or 1.0

    @lazy
    def torque(self) -> float:
        """Part of the reed torque that a design can change, N·m: all but the resistance."""
        return max(abs(self.front - self.resistance), MASKED * self.resistance) or self.peak

    @lazy
    def mean_square(self) -> float:
        """Scale of the mean square of the reed torque over the pulse, (N·m)²."""
        return self.torque * max(self.torque, self.resistance)

    def figure_size(self, name: str) -> float:
        """Scale of a figure."""
        if name == TORQUE:
            return self.peak
        if self.sampler.model.has_quantity(name):
            return abs(self.sampler.peak(name)) or 1.0
        kind = self.scene.schema.figures[name].kind
        fixed = {"torque": self.torque, "length": self.length, "inertia": self.inertia, "angle": 1.0}
        return fixed.get(kind) or size_read(self.sampler, name, self.scene.schema.figures)

    def size(self, axis: str) -> float:
        """Scale of an axis of a front."""
        if axis not in self.scene.schema.figures:
            return next(v.scale for v in self.variables if axis in (v.name, v.called))
        return {"change": 1.0, "pulse_rms": self.mean_square}.get(axis) or self.figure_size(axis)


# A family: which machines one linkage can balance, M3 = M0 − J ψ'' ω² at front dead centre with J in a band.


class Band(NamedTuple):
    """Balance of a member: kappa = M0/ω², kg·m²; least, most: inertia without and with all counterweight, kg·m².

    bend: ψ'' at front dead centre.
    """

    kappa: float
    least: float
    most: float
    bend: float


def member_balance(
    scene: Scene, design: Mapping[str, float], figures: Mapping[str, float | None], member_numbers: Collection[str]
) -> Band | None:
    """Balance of a member; None if other torques than cloth and inertia act at front dead centre."""
    front, alpha, inertia = (figures.get(name) for name in ("M3_fdc", "alpha_fdc", "J4"))
    speed, resistance = scene.operation.get("speed"), scene.operation.get("M0")
    if front is None or alpha is None or inertia is None or not speed or not resistance:
        return None
    if abs(resistance - inertia * alpha - front) > SHOWN_AS_ZERO * resistance:
        return None
    bare = inertia - design["m4e"] * design["r4e"] ** 2
    ends = {name: (design[name], design[name]) for name in COUNTERWEIGHT}
    for name in COUNTERWEIGHT:
        bound = scene.bounds.get(name)
        if bound is not None and bound.free and (name in member_numbers or "m4e" in member_numbers):
            ends[name] = bound.min, bound.max
    least, most = (ends["m4e"][k] * ends["r4e"][k] ** 2 for k in range(2))
    return Band(resistance / speed**2, bare + least, bare + most, alpha / speed**2)


def family_sentence(bands: Sequence[Band], scene: Scene) -> str:
    """Sentence on the members that one ψ'' can balance, "" if it balances all; scene: that of the first member."""
    reached = [b.kappa / b.bend for b in bands]
    pairs = list(zip(bands, reached, strict=True))
    if all(b.least * (1 - SHOWN_AS_ZERO) <= j <= b.most * (1 + SHOWN_AS_ZERO) for b, j in pairs):
        return ""
    needed, allowed = max(b.kappa / b.most for b in bands), min(b.kappa / b.least for b in bands)
    text = f"At front dead centre M3 = M0 - J psi'' speed^2, and this design's psi'' is {bands[0].bend:.6g}."
    text += _ratio(bands, scene) if len({(b.least, b.most) for b in bands}) == 1 else ""
    if needed > allowed:
        return f"{text} Requirements conflict: psi'' must be at least {needed:.6g} and at most {allowed:.6g}."
    return f"{text} All members are balanced by a psi'' from {needed:.6g} to {allowed:.6g}."


def _ratio(bands: Sequence[Band], scene: Scene) -> str:
    """Sentence on the range of members that one ψ'' balances, if all have the same range of counterweights."""
    first, speed = bands[0], scene.operation["speed"]
    low, high = (scene.show(value, "inertia") for value in (first.least, first.most))
    ends = [scene.show(inertia * first.bend * speed**2, "torque") for inertia in (first.least, first.most)]
    spread = max(b.kappa for b in bands) / min(b.kappa for b in bands)
    return (
        f" One psi'' serves M0/speed^2 within a ratio of {first.most / first.least:.4g} (J from {low} to {high}), "
        f"this one M0 from {ends[0]} to {ends[1]} at {scene.show(speed, 'angular speed')}; "
        f"the members' ratio is {spread:.4g}."
    )
