"""How a job shows itself: what its own views return, and views/ renders."""

import abc
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from loomopt.model.separation import Parted
from loomopt.physics.cycle import TURN
from loomopt.physics.motion.flight import Landing
from loomopt.picture.panels import Panel
from loomopt.scenes.scene import Scene

if TYPE_CHECKING:
    from loomopt.picture.equations import Equation
    from loomopt.picture.panels import Curve, Panel
    from loomopt.picture.shapes import Drawing
    from loomopt.scenes.scene import Scene

Numbers = Mapping[str, float]


class Span(NamedTuple):
    """A stretch of the cycle, rad, that may run over angle 0: where it begins and where it ends."""

    begin: float
    end: float


Marks = Mapping[str, float | Span]
"""Name → a crank angle, rad, or a stretch of the cycle."""


class JobViews(abc.ABC):
    """A job's own views; a design, SI, may name only some numbers, the others are today's.

    angle: what phi is; lists: part of a design that is a list → what its numbers are, "{count}" for how many.
    """

    angle: str = "crank angle"
    lists: Mapping[str, str] = {}

    @abc.abstractmethod
    def linkage(self, scene: "Scene", design: Numbers) -> "Drawing":
        """Return the mechanism drawn at full scale in the positions that matter. Raises BadInput."""

    @abc.abstractmethod
    def joints_csv(self, scene: "Scene", design: Numbers) -> str:
        """Return what `linkage` draws as CSV in its unit: joints and masses, or a profile. Raises BadInput."""

    @abc.abstractmethod
    def equations(self, scene: "Scene") -> "tuple[Equation, ...]":
        """Return the equations the scene really uses."""

    @abc.abstractmethod
    def marks(self, scene: "Scene", design: Numbers) -> Marks:
        """Return the crank angles and stretches of the cycle a reader looks for."""

    def panels(self, scene: "Scene", design: Numbers, columns: Sequence[str]) -> "tuple[Panel, ...]":
        """Return what a figure of the curves shows: all columns in the words of `words`, unless a job knows better."""
        from loomopt.picture.panels import arranged

        return arranged(scene, design, columns, self.words())

    def words(self) -> "Mapping[str, Curve]":
        """Return what is known of the columns of the curves, by name."""
        return {}

    def remarks(self, scene: "Scene", design: Numbers) -> tuple[str, ...]:
        """Return what to know beside the numbers, each a sentence without its full stop: what checks remark."""
        from loomopt.model.numbers import numbers
        from loomopt.physics.effects.kinds import Check, owned

        known = numbers(scene) | {scene.full(name): value for name, value in design.items()}
        told = []
        for check in (effect for effect in scene.active if isinstance(effect, Check)):
            own = {key: known.get(owned(check, key)) for key in check.own.model_fields}
            told.append(check.remark(known, own, scene.show))
        return tuple(text for text in told if text)

    def missing(self, scene: "Scene") -> tuple[str, ...]:
        """Return the keys without which the scene cannot be drawn."""
        return ()


WIDE_FLIGHT = 0.1
"""rad; a flight less wide has no mark of its own: hops after a landing."""


def remarks(scene: Scene, parted: Parted) -> Iterator[str]:
    """Yield where contact is lost and how hard it is found again, and whether that repeats."""
    name, course = parted.event.name, parted.course
    if not course.parted:
        yield f"{name}: contact is never lost"
        return
    (begin, end), first = course.first, course.first_landing
    told = f"{name}: contact is lost at {scene.show(begin, 'angle')}"
    if first is None or end is None:
        told += " and never found again"
    else:
        told += f" and found again at {scene.show(end, 'angle')}, at {_landing_speed(scene, first)} against the cam"
    yield f"{told}; figures of forces and torque are those of an output held on its cam, and no solve reads {name}"
    if course.period is None:
        turns = len(course.turns)
        yield f"{name}: not periodic in {turns} turns; curves are those of the last one"
        return
    landings = [landing for turn in course.periodic for landing in turn.landings]
    hardest = max(landings, key=lambda landing: -landing.speed, default=None)
    often = "every turn" if course.period == 1 else f"every {course.period} turns"
    count = "1 landing" if len(landings) == 1 else f"{len(landings)} landings"
    worst = f", the hardest at {_landing_speed(scene, hardest)}" if hardest else ""
    yield f"{name}: in the end the motion repeats {often}, with {count}{worst}"


def _landing_speed(scene: Scene, landing: Landing) -> str:
    return scene.show(abs(landing.speed), "velocity", 5)


def marks(parted: Parted, every: Marks) -> Marks:
    """Return marks over the period, rad: those of every turn, where contact is lost, and where wide flights end."""
    found, lifts, landings = dict[str, float | Span](), list[float](), list[float]()
    turns = parted.course.periodic
    for k, turn in enumerate(turns):
        for name, mark in every.items():
            found[f"{name} of turn {k + 1}" if k else name] = _of_turn(mark, k, len(turns))
        lifts += [k * TURN + angle for angle in turn.lifts]
        landings += [k * TURN + landing.angle for landing in turn.landings]
    whole, events = len(turns) * TURN, sorted([*lifts, *landings])
    wide = [
        each for each in landings if (each - events[events.index(each) - 1]) % whole >= WIDE_FLIGHT or len(events) == 1
    ]
    for word, angles in (("lift-off", lifts), ("landing", wide)):
        found |= {f"{word} {k + 1}" if k else word: angle for k, angle in enumerate(angles)}
    return found


def _of_turn(mark: float | Span, turn: int, turns: int) -> float | Span:
    """Return a mark in one of several turns, counted from 0."""
    if not isinstance(mark, Span):
        return turn * TURN + mark
    ahead = TURN if turns > 1 and mark.end < mark.begin else 0.0
    return Span(turn * TURN + mark.begin, turn * TURN + mark.end + ahead)


def together(panels: Sequence[Panel], columns: tuple[str, str], name: str) -> tuple[Panel, ...]:
    """Return panels with two columns in the panel of the first, across the figure."""
    first, second = (next(panel for panel in panels if panel.columns[0] == column) for column in columns)
    names = (*first.labels, *second.labels)
    joined = first._replace(columns=columns, name=name, names=names, wide=True)
    return tuple(joined if panel is first else panel for panel in panels if panel is not second)
