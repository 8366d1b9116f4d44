"""What studies read of a job: its targets, peaks and closed forms, said by the job itself."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, NamedTuple

from loomopt.base.records import Frozen
from loomopt.maths.systems import Number

if TYPE_CHECKING:
    from loomopt.scene.scene import Scene


class Crossing(NamedTuple):
    """The first crank angle at which |quantity| passes a level: the figure that tells it, and the level's full name."""

    figure: str
    quantity: str
    level: str


class Family(NamedTuple):
    """Ever finer sets of designs that a target chooses from, such as laws of more and more intervals.

    method: what its ladder is called; target, key: whose scene key says how fine; limit(scene, x): the figure that
    they tend to, SI, in many digits, x the optimum's variables; None where no closed form holds.
    """

    method: str
    target: str
    key: str
    limit: "Callable[[Scene, Mapping[str, Number]], Number | None]"


class Studied(NamedTuple):
    """What a designer reads of a job.

    targets: the optima; peaks: figure → (quantity, whether its sign counts); static: figures of one position;
    motion: what the second derivative of the output's displacement is called.
    """

    targets: tuple[str, ...]
    peaks: Mapping[str, tuple[str, bool]] = Frozen()
    static: tuple[str, ...] = ()
    motion: str = "q_2"
    crossing: Crossing | None = None
    family: Family | None = None
