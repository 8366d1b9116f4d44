"""Contact of the roller that is lost: the frame leaves its cam, flies, lands, rebounds; simulated, no part of a solve.

It leaves where the cam force N falls below zero, for the cam cannot pull. In flight eq 4 holds without N [Qiu21]:

    M X¨ + C X˙ + K1 (X + X0) = G + T(X) − F sgn X˙        T goes on in proportion beyond 0 … h; at rest friction sticks

It lands where X = X_cam and leaves again with X˙⁺ = X˙_cam − e (X˙⁻ − X˙_cam). A rebound below 1e-6 of the cam's top
speed ends in contact. Cam and follower are rigid, the landing takes no time; contact is taken to begin at cam angle 0.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from loomopt.base.quantities import Quantity
from loomopt.physics.effects.kinds import EffectClash, Event, EventTerms, Motion, Rule
from loomopt.physics.schema import Figure, Table, Values

if TYPE_CHECKING:
    from loomopt.physics.motion.flight import Cam, Course
    from loomopt.physics.motion.free import Body

UNKNOWN = "the load of the frame in flight depends on its travel X, and this pull is not known by travel"


class Parameters(Table):
    """Values of the landing, and how long to go on."""

    restitution: Annotated[float, Quantity("number", least=0, below=1)] = Field(
        description="ratio of the speeds after and before a landing, relative to the cam"
    )
    turns: int = Field(50, ge=1, le=10_000, description="largest number of simulated turns of the cam")


@dataclass(frozen=True)
class FreeFrame(Motion):
    """The frame off its cam, as loads may read it, SI; direction: the sign of X˙, within ±1 at rest."""

    q: float
    rate: float
    change: float
    direction: float
    travel: float
    omega: float
    omega_dot: None = None

    @property
    def lowered(self) -> float:
        """X over the travel, beyond 0 and 1 too."""
        return self.q / self.travel

    @property
    def velocity(self) -> float:
        """X˙, m/s."""
        return self.rate

    @property
    def acceleration(self) -> float:
        """X¨, m/s²."""
        return self.change


def free(given: Values, q: float, velocity: float, acceleration: float, direction: float) -> FreeFrame:
    """Frame off its cam."""
    return FreeFrame(q, velocity, acceleration, direction, given["travel"], given["speed"])


def places(given: Values) -> Mapping[str, float]:
    """Travel, m, of a half open shed."""
    return {"half_open": given["travel"] / 2}


def follow(body: "Body", cam: "Cam", table: Values) -> "Course":
    """Frame's course until its state at cam angle 0 repeats."""
    from loomopt.physics.motion import flight

    return flight.follow(body, cam, table["restitution"], int(table["turns"]))


def read(course: "Course") -> dict[str, float | None]:
    """Figures of the first flight, and of the period if the motion is periodic; SI, rad."""
    (lift_off, landing), first, period = course.first, course.first_landing, course.period
    speed = first.speed if first else None
    return {
        "lift_off": lift_off,
        "landing": landing,
        "gap_max": course.gap_max,
        "landing_speed": speed,
        "landing_energy": None if speed is None else course.body.mass * speed**2 / 2,
        "landings": None if period is None else sum(len(turn.landings) for turn in course.periodic),
        "period": period,
    }


def rules(terms: EventTerms) -> Sequence[Rule]:
    """Take-off of the frame from the cam, its motion in flight, and its state after a landing."""
    symbol, total = terms.symbol, terms.total
    X, omega = symbol("X"), symbol("omega")
    before, after, face = symbol("X'_before"), symbol("X'_after"), symbol("X'_cam")
    e, fastest, v = symbol("restitution"), symbol("X'_cam_max"), symbol("landing_speed")
    note = "X, X', X'' are the frame's own" + (", and friction is against X'" if terms.friction != 0 else "")
    equations = [
        Rule("lift-off", symbol("N"), "<=", 0, "and falling, where X = X_cam"),
        Rule("flight", total, "=", 0, f"while X > X_cam; {note}"),
    ]
    if terms.friction != 0:
        condition = f"where X' = 0 and the other terms together are no more than {terms.friction}"
        equations.append(Rule("at rest in flight", symbol("X''"), "=", 0, condition))
    return [
        *equations,
        Rule("landing", X, "=", symbol("X_cam"), "again"),
        Rule("landing", after, "=", face - e * (before - face)),
        Rule("end of the rebounds", e * (face - before), "<=", fastest / 10**6),
        Rule("landing_speed", v, "=", omega * (before - face)),
        Rule("landing_energy", symbol("landing_energy"), "=", terms.mass * v**2 / 2),
    ]


EFFECT = Event(
    name="separation",
    summary="flight of the frame where the roller leaves the cam",
    table=Parameters,
    rank=70,
    needs=("operation.speed",),
    companions=("inertia",),
    clashes=(EffectClash("warp_tension", UNKNOWN, "shape", ("step", "levels")),),
    force="cam_force",
    least="lift",
    free=free,
    places=places,
    follow=follow,
    read=read,
    rules=rules,
    figures=(
        Figure("lift_off", "angle", "cam angle where the roller first leaves the cam", sides=()),
        Figure("landing", "angle", "cam angle where it lands first, counted on beyond a turn", sides=()),
        Figure("gap_max", "length", "largest gap between frame and cam in the first flight", sides=()),
        Figure("landing_speed", "velocity", "speed of the frame against the cam at the first landing", sides=()),
        Figure("landing_energy", "energy", "kinetic energy of that speed", sides=()),
        Figure("landings", "number", "landings in one period", sides=()),
        Figure("period", "number", "turns of the cam after which the motion repeats", sides=()),
    ),
    examples=({"restitution": "0.3", "turns": "50"},),
)
