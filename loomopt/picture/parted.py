"""Views of an output that may lose contact: remarks, marks over the period, a panel."""

from collections.abc import Iterator, Sequence

from loomopt.model.separation import Parted
from loomopt.physics.cycle import TURN
from loomopt.physics.motion.flight import Landing
from loomopt.picture.job_views import Marks, Span
from loomopt.picture.panels import Panel
from loomopt.scenes.scene import Scene

WIDE_FLIGHT = 0.1
"""rad; a flight less wide has no mark of its own: hops after a landing."""


def remarks(scene: Scene, parted: Parted) -> Iterator[str]:
    """Yield remarks on the loss of contact: its angle, the speed of the landing, and whether it repeats."""
    name, course = parted.event.name, parted.course
    if not course.parted:
        yield f"{name}: contact is never lost"
        return
    (begin, end), first = course.first, course.first_landing
    sentence = f"{name}: contact is lost at {scene.show(begin, 'angle')}"
    if first is None or end is None:
        sentence += " and never found again"
    else:
        sentence += f" and found again at {scene.show(end, 'angle')}, at {_landing_speed(scene, first)} against the cam"
    yield f"{sentence}; figures of forces and torque are those of an output held on its cam, and no solve reads {name}"
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
    """Marks over the period, rad: those of every turn, where contact is lost, and where wide flights end."""
    marks_by_name, lifts, landings = dict[str, float | Span](), list[float](), list[float]()
    turns = parted.course.periodic
    for k, turn in enumerate(turns):
        for name, mark in every.items():
            marks_by_name[f"{name} of turn {k + 1}" if k else name] = _of_turn(mark, k, len(turns))
        lifts += [k * TURN + angle for angle in turn.lifts]
        landings += [k * TURN + landing.angle for landing in turn.landings]
    whole, events = len(turns) * TURN, sorted([*lifts, *landings])
    wide = [
        landing
        for landing in landings
        if (landing - events[events.index(landing) - 1]) % whole >= WIDE_FLIGHT or len(events) == 1
    ]
    for word, angles in (("lift-off", lifts), ("landing", wide)):
        marks_by_name |= {f"{word} {k + 1}" if k else word: angle for k, angle in enumerate(angles)}
    return marks_by_name


def _of_turn(mark: float | Span, turn: int, turns: int) -> float | Span:
    """Mark in one of several turns, counted from 0."""
    if not isinstance(mark, Span):
        return turn * TURN + mark
    ahead = TURN if turns > 1 and mark.end < mark.begin else 0.0
    return Span(turn * TURN + mark.begin, turn * TURN + mark.end + ahead)


def together(panels: Sequence[Panel], columns: tuple[str, str], name: str) -> tuple[Panel, ...]:
    """Panels with two columns in the panel of the first, across the figure."""
    first, second = (next(panel for panel in panels if panel.columns[0] == column) for column in columns)
    names = (*first.labels, *second.labels)
    joined = first._replace(columns=columns, name=name, names=names, wide=True)
    return tuple(joined if panel is first else panel for panel in panels if panel is not second)
