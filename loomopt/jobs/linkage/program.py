"""From a linkage scene and a target to the program: variables, limits, objectives and their scales."""

import itertools
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import final

import numpy as np

from loomopt.base.errors import refusal
from loomopt.base.records import lazy
from loomopt.jobs.base import Ends, Task, distinct, ends, size_read, steady
from loomopt.jobs.linkage import model as linkages
from loomopt.jobs.linkage.model import (
    OBLIQUITY,
    PATH,
    PATH_SQUARE,
    Approach,
    Path,
    PeaksOf,
    linkage_of,
    roller_peaks,
)
from loomopt.jobs.linkage.scene import PULSED, LinkageTarget, match, path, reaches, read_tables, rms_figures
from loomopt.maths.systems import FLOAT
from loomopt.model import change
from loomopt.model.axes import opposing
from loomopt.model.change import CHANGE
from loomopt.model.limits import CycleLimit, DesignLimit, Limit
from loomopt.model.model import JobModel
from loomopt.model.numbers import bounds, curves, numbers, words
from loomopt.model.objectives import Magnitude, Objective, Peak, Value, WorstPeak, opposite
from loomopt.model.program import Goal, Move, Numbers
from loomopt.model.sampling import Sampler, sampled
from loomopt.physics.cycle import Node
from loomopt.physics.mechanisms import free_cams
from loomopt.physics.tolerances import FEASIBLE
from loomopt.scenes.scene import Scene

TURNING_SHARE = 0.01
"""Least |q''| at an extreme whose load or angle is optimised, as a share of today's largest |q''|. With a tenth of this
share 2 of 12 starts of a six-bar end in an optimum, with this one 7 of 7."""
APPROACH_MARGIN, NEXT_TO_EVENT = 0.01, 0.05
"""What the output stays short of the travel of an optimised event between the event and its extreme, as a share of the
travel; and the part next to the event where it does not, as a share of the crank angle between both."""
KNOT_ROOM = 0.2
"""Half the range of the random starts of a knot, as a share of the largest third derivative of today's laws."""
RESTING_SHARE = 0.001
"""The same share at events of a window whose travel or length is optimised: a rest needs a small |q''|. With it 11 of
11 starts reach a six-bar's least travel; without it the best of 27 starts has no certificate."""


def known_numbers(scene: Scene) -> dict[str, float]:
    """Every number of the scene by full name, SI, with the knots of free cam laws."""
    return dict(free_cams.with_knots(read_tables(scene.document).linkage.chain, numbers(scene)))


def model(
    scene: Scene, target: str = "", design: Numbers | None = None, approaches: tuple[Approach, ...] = ()
) -> JobModel:
    """Linkage with the effects the scene calls for, as its states need it. Raises BadInput.

    target: whose path its point should follow; design: what is not today's; approaches: of events that must not jump.
    """
    known = read_tables(scene.document)
    pathed = path(scene, target)
    linkage = replace(known.linkage, path=pathed) if pathed else known.linkage
    values = known_numbers(scene)
    curve = next((pulse for (name, _), pulse in curves(scene).items() if name == PULSED), None)
    rms = rms_figures(known, scene.document, curve.acting if curve else 1.0)
    reached = reaches(scene.document, linkage.chain)
    function = match(scene, target)
    physics = linkages.model(
        linkage, scene.active, words(scene), frozenset(values), reached, known.windows, rms, function, approaches
    )
    return steady(scene, physics, values, design)


@final
class LinkageTask(Task):
    """Design task of a linkage: figures and numbers are optimised in the order of the scene."""

    any_numbers = True

    @lazy
    def plain_model(self) -> JobModel:
        """The linkage with the effects the scene calls for."""
        return model(self.scene, self.target, approaches=self.approaches)

    @lazy
    def optimised(self) -> set[str]:
        """Names of the figures and numbers that the target or a front optimises."""
        return {*self.traded, *(name for name, _ in self.levels)}

    @lazy
    def approaches(self) -> tuple[Approach, ...]:
        """Approaches of the events at a travel whose load or crank angle is optimised."""
        linkage = read_tables(self.scene.document).linkage
        loads = {event: {name, f"angle.{event}"} for name, event in linkage.loads.items()}
        if linkage.chain.cams:
            return ()
        return tuple(
            Approach(place, NEXT_TO_EVENT)
            for place in linkage.places
            if place.travel is not None and self.optimised & loads[place.name]
        )

    @lazy
    def model(self) -> JobModel:
        """Linkage with its effects, and with the opposites of numbers that are maximised."""
        model = self.plain_model
        for name, sense in self.levels:
            full = self.scene.full(name)
            if sense == "most" and not self._is_figure(name):
                model = opposing(model, (full,))
            elif sense == "most" and model.has_row(name):
                model = opposing(model, (name,))
        if self.changes:
            model = replace(model, own_rows={**model.own_rows, CHANGE: change.row(self.changing)})
        return model

    @lazy
    def sampler(self) -> Sampler:
        """Today's linkage, without the change from it."""
        return sampled(self.plain_model, self.known)

    @property
    def changes(self) -> bool:
        """Whether the change from today is read."""
        return CHANGE in {*self.traded, *(name for name, _ in self.levels)}

    @lazy
    def changing(self) -> tuple[str, ...]:
        """Numbers whose change from today counts, by full name: those with bounds."""
        return tuple(dict.fromkeys(self.scene.full(name) for name in self.scene.bounds))

    @lazy
    def weights(self) -> dict[str, float]:
        """Weights of their changes, by full name."""
        table = self.scene.targets.get(self.target)
        given = table.weights if isinstance(table, LinkageTarget) else {}
        return {self.scene.full(name): weight for name, weight in given.items()}

    def parameters(self) -> dict[str, float]:
        """Known numbers that are not variables, and those of the change from today."""
        values = super().parameters()
        if self.changes:
            values |= change.parameters(self.changing, self.known, self.limited, self.weights)
        return values

    @property
    def table(self) -> LinkageTarget:
        """Table of the target."""
        table = self.scene.targets[self.target]
        assert isinstance(table, LinkageTarget)
        return table

    @property
    def levels(self) -> tuple[tuple[str, str], ...]:
        """Figures of the target in order, each with "least" or "most"; the default target's where there is no table."""
        if not self.target:
            return ()
        return self.table.objectives or ((("peak_torque", "least"),) if self.target == "torque" else ())

    def _is_figure(self, name: str) -> bool:
        return name in self.scene.schema.figures

    # Variables.

    @lazy
    def known(self) -> dict[str, float]:
        """Every number of the scene by full name."""
        return known_numbers(self.scene)

    @lazy
    def knots(self) -> tuple[str, ...]:
        """Third derivatives at the knots of free cam laws."""
        return read_tables(self.scene.document).knots

    @lazy
    def limited(self) -> dict[str, Ends]:
        """Lower and upper bound of every number; one that the target seeks is free between its bounds."""
        optimised = {self.scene.full(name): name for name, _ in self.levels if name in self.scene.bounds}
        free = {full: (self.scene.bounds[name].min, self.scene.bounds[name].max) for full, name in optimised.items()}
        knots = {name: (-math.inf, math.inf) for name in self.knots if name not in self.scene.bounds}
        return bounds(self.scene, self.known) | free | knots

    def room(self, name: str, ends: Ends) -> Ends:
        """Range of the random starts of a variable; of a knot of a cam law about today's."""
        if name not in self.knots or all(map(math.isfinite, ends)):
            return super().room(name, ends)
        size = KNOT_ROOM * self.knot_size
        return self.known[name] - size, self.known[name] + size

    @lazy
    def knot_size(self) -> float:
        """Largest third derivative at the knots of today's cam laws."""
        return max((abs(self.known[name]) for name in self.knots), default=0.0) or 1.0

    @lazy
    def length(self) -> float:
        """The longest length that there is or may be, m."""
        kinds = self.scene.schema.variables
        lengths = [name for name, kind in kinds.items() if kind == "length"]
        ends = [end for name in lengths for end in (self.known[name], *self.limited[name])]
        return max(map(abs, ends), default=1.0) or 1.0

    def scale(self, name: str, ends: Ends) -> float:
        """Size of a variable: lengths the longest, angles 1 rad, others their own."""
        if name in self.knots:
            return self.knot_size
        kind = self.scene.schema.variables.get(name, "")
        return {"length": self.length, "angle": 1.0}.get(kind) or super().scale(name, ends)

    # Limits.

    def figure(self, name: str, low: float | None, high: float | None) -> list[Limit]:
        """Limits on one figure."""
        size = self.figure_size(name)
        if of := self.roller_peaks.get(name):
            # The largest counts, so that each of them keeps the limit.
            value = 0.0 if high is None else high
            return [CycleLimit(name, 1, row, value**of.power, size**of.power) for row in of.quantities]
        return [self._limit(name, sign, value, size) for sign, value in ends(low, high)]

    @lazy
    def roller_peaks(self) -> Mapping[str, PeaksOf]:
        """Figures that are the largest of several quantities of the rollers."""
        return roller_peaks(linkage_of(self.plain_model), self.plain_model.effects, self.plain_model.known)

    def _limit(self, name: str, sign: int, value: float, size: float) -> Limit:
        if name.startswith("mu."):
            return CycleLimit(name, -1, f"{name[3:]}.{OBLIQUITY}", value, 1.0, complement=math.pi / 2)
        if name == PATH and not self.model.has_quantity(name):
            return DesignLimit(name, sign, PATH, value, size)
        return self.row_limit(name, sign, name, value, size)

    def demand_figures(self) -> None:
        """Raise BadInput for a limit or a level on a figure that nothing in the scene gives."""
        keys = {name: f"limits.{name}" for name in self.scene.limits}
        keys |= {name: f"targets.{self.target}.{sense}" for name, sense in self.levels if self._is_figure(name)}
        for name, key in keys.items():
            known = name.startswith("mu.") or name in self.roller_peaks
            if known or self.model.has_row(name) or self.model.has_quantity(name):
                continue
            problem, remedy = f"nothing in the scene gives the figure {name}", "Add the effects it needs"
            if name == "peak_power" and self.model.loads:
                problem, remedy = "peak_power needs the speed", "Give operation.speed"
            raise refusal(problem, self.scene.origin, key, remedy=f"{remedy}, or take it out")

    def margins(self) -> list[Limit]:
        """Rows by which every part closes over the whole turn; a limit on its transmission angle does so too."""
        return [
            *(
                CycleLimit(text, 1, prefix + row, 1.0, 1.0, relaxable=False)
                for prefix, group in self.model.kinematics.groups.items()
                if f"mu.{prefix[:-1]}" not in self.scene.limits
                for text, row in group.closes.items()
            ),
            *self._turning_margins(),
            *self._approach_margins(),
            *self._spline_ends(),
            *self._contacts(),
        ]

    def goals(self) -> tuple[Goal, ...]:
        """Load at an event that the target minimises first: zero is reached, or is out of reach."""
        name, sense = self.levels[0] if self.levels else ("", "")
        if sense != "least" or name in self.traded or name not in self._loads:
            return ()
        return (Goal(name, 0.0, 0.0, FEASIBLE * self.figure_size(name)),)

    def _contacts(self) -> list[Limit]:
        """Rows by which a lone roller stays on its cam, and no cam is undercut whose pressure is read."""
        linked, limits = linkage_of(self.plain_model).chain, list[Limit]()
        loaded = [roller for roller in linked.rollers if f"force.{roller.name}" in self.roller_peaks]
        for roller in loaded:
            name = roller.name
            if sum(other.word("cam") == roller.word("cam") for other in linked.rollers) == 1:
                row, text = linkages.lift_of(name), f"roller {name} stays on its cam"
                limits.append(CycleLimit(text, 1, row, 0.0, self.figure_size(f"force.{name}")))
            if f"hertz.{name}" in self.roller_peaks and f"undercut.{name}" not in self.scene.limits:
                row, text = f"undercut.{name}", f"the cam of {name} is not undercut"
                limits.append(CycleLimit(text, 1, row, 1.0, 1.0, relaxable=False))
        return limits

    def _spline_ends(self) -> list[Limit]:
        """Rows by which the splines of free cam laws end where they must."""
        sizes = linkages.spline_sizes(linkage_of(self.plain_model).chain, self.known)
        return [DesignLimit(row, 0, row, 0.0, size, relaxable=False, hidden=True) for row, size in sizes.items()]

    def _turning_margins(self) -> list[Limit]:
        """Rows by which the output still turns back at an extreme whose load, crank angle or window is optimised.

        The load of a mass falls to 0 with q'', and the angle moves without bound: at 0 the event is no extreme, and
        without a margin there is no best design. Cams are left out: their output may rest at an extreme.
        """
        linkage, optimised = linkage_of(self.plain_model), self.optimised
        read = {**self._loads, **{f"angle.{event}": event for event in self._loads.values()}}
        events = {read[name] for name in optimised if name in read}
        events |= set(linkages.extremes(linkage.places)) if "sweep" in optimised else set()
        known = read_tables(self.scene.document).windows
        windows = [window for window in known if optimised & {f"travel.{window.name}", window.length}]
        bounding = {name for window in windows for name in (window.after, window.until, window.level)} - events
        shares = {**dict.fromkeys(events, TURNING_SHARE), **dict.fromkeys(bounding, RESTING_SHARE)}
        places = [place for place in linkage.places if place.name in shares and place.extreme and not place.of]
        if not places or linkage.chain.cams:
            return []
        size, limits = size_read(self.sampler, "peak_acceleration", self.scene.schema.figures), list[Limit]()
        for place in places:
            row, sign = linkages.bend_row(place.name), 1 if place.extreme == "max" else -1
            least = min(shares[place.name] * size, abs(self.sampler.single(row)) / 2)
            text = f"the output turns back at {place.name}"
            limits.append(DesignLimit(text, sign, row, -sign * least, size, relaxable=False))
        return limits

    def _approach_margins(self) -> list[Limit]:
        """Rows by which the output does not come back to the travel of an event before its extreme.

        Where it does, the event jumps there: its load and angle then jump, and no design before that is the best.
        """
        limits = list[Limit]()
        for approach in self.approaches:
            today = self.sampler.peak(approach.share, (approach.switch, 1.0))
            most = max(1.0 - APPROACH_MARGIN, (1.0 + today) / 2)
            text = f"the output passes the travel of {approach.place.name} once"
            where = (approach.switch, 1.0)
            limits.append(CycleLimit(text, 1, approach.share, most, 1.0, where=where, relaxable=False))
        return limits

    # Levels, starts and moves.

    def objectives(self) -> tuple[Objective, ...]:
        """Target's levels in order."""
        return *(self.level(name, sense) for name, sense in self.levels), *self.least()

    def higher_levels(self) -> tuple[Objective, ...]:
        """Levels of the target before the first one on the front."""
        before = itertools.takewhile(lambda level: level[0] not in self.traded, self.levels[:-1])
        return tuple(self.level(name, sense) for name, sense in before)

    def level(self, name: str, sense: str) -> Objective:
        """The level of the target: there is one."""
        size = self.figure_size(name) if self._is_figure(name) else self.size(name)
        if name.startswith("mu."):
            return Peak(name, f"{name[3:]}.{OBLIQUITY}", 1.0)
        if of := self.roller_peaks.get(name):
            first, *others = of.quantities
            return WorstPeak(name, first, size**of.power, tuple(others), power=of.power)
        squares = {mean.root: mean.name for mean in self.model.integrals} | {PATH: PATH_SQUARE}
        if name in squares:
            return Value(name, squares[name], size**2, power=2)
        if self.model.has_quantity(name):
            square = self.model.square(name)
            return Peak(name, square, size**2, power=2) if square else Peak(name, name, size)
        row = name if self._is_figure(name) else self.scene.full(name)
        if sense == "most":
            return Value(name, opposite(row), size)
        return Magnitude(name, row, size) if name in self._loads else Value(name, row, size)

    def starts(self) -> tuple[dict[str, float], ...]:
        """Today's linkage, and first one with half of each number of effects: none of it hides what it does."""
        today = self.inside(self.known)
        lengths = self.scene.schema.variables
        half = {
            v.name: (v.lower + v.upper) / 2
            for v in self.variables
            if v.name not in lengths and v.lower < v.upper and math.isfinite(v.upper - v.lower)
        }
        return distinct([today | half, today] if half else [today])

    def moves(self) -> list[Move]:
        """Common scale of the lengths, and numbers of checks."""
        lengths = tuple(name for name, kind in self.scene.schema.variables.items() if kind == "length")
        return [*([self.scale_move("scale", lengths)] if lengths else []), *self.axis_moves()]

    # Scales.

    def figure_size(self, name: str) -> float:
        """Scale of a figure: today's; of a force at an event the largest term that it is made of.

        Where today's is only rounding, as of a machine that is balanced already, the largest figure of its kind.
        """
        if name == CHANGE or name.startswith(("mu.", "angle.")):
            return 1.0
        if name in self._loads:
            return self._force(self._loads[name])
        if of := self.roller_peaks.get(name):
            return max(max(map(self.sampler.peak, of.quantities)), 0.0) ** (1 / of.power) or 1.0
        if name == PATH:
            return self._extent()
        return size_read(self.sampler, name, self.scene.schema.figures)

    @property
    def _loads(self) -> Mapping[str, str]:
        """Events by the name of the output's load there."""
        return linkage_of(self.plain_model).loads

    def _force(self, event: str) -> float:
        """Largest term of the output at an event, N or N·m."""
        phi = float(self.sampler.given.values[linkages.event_value(event)])
        at = self.sampler.model.instant(FLOAT, self.sampler.given, Node(phi, self.sampler.stills.get(event, {})))
        acts = {load.name: load.acts for load in self.sampler.model.loads}
        terms = [abs(float(term)) for name, term in at.terms().items() if acts[name] == "output"]
        return max(terms, default=0.0) or 1.0

    def _extent(self) -> float:
        """Size of the path, m."""
        curve = linkage_of(self.plain_model).path
        assert isinstance(curve, Path)
        return float(max(np.ptp(curve.x), np.ptp(curve.y))) or self.length
