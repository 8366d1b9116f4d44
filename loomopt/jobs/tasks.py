"""How the solver speaks to a job: one record of functions each, so that it knows no mechanism by name."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from loomopt.cycle import Floats
from loomopt.jobs.beatup import curves as beatup_curves
from loomopt.jobs.beatup import design as beatup_design
from loomopt.jobs.beatup import program as beatup_program
from loomopt.jobs.rapier import curves as rapier_curves
from loomopt.jobs.rapier import design as rapier_design
from loomopt.jobs.rapier import program as rapier_program
from loomopt.jobs.shedding import curves as shedding_curves
from loomopt.jobs.shedding import design as shedding_design
from loomopt.jobs.shedding import headline as shedding_headline
from loomopt.jobs.shedding import program as shedding_program
from loomopt.program.program import Move, Program, Wish
from loomopt.program.sampling import Sampler

Numbers = Mapping[str, float]


def _nothing(scene: Any, clash: Sequence[str]) -> str:
    return ""


def _any(scene: Any) -> dict[str, Sequence[float]]:
    return {}


def _quantities(model: Any) -> dict[str, str]:
    return {name: name for name in model.quantities} | {"mu_min": "obliquity"}


def _same(scene: Any, design: Mapping[str, Any], target: str) -> tuple[Any, str]:
    return scene, target


@dataclass(frozen=True)
class Task:
    """A job at work; all numbers SI.

    demand(scene, target): raises BadInput where the scene lacks what the target needs.
    program(scene, target): the task as data. today(scene): today's design.
    design(program, x), values(program, design): NLP variables to design and back.
    tidy(program, x): x without what is only rounding. moves(program), wish(scene, move, x): the silent levels.
    figures(scene, design): every figure. sampler(scene, design): the design's cycle.
    curves(scene, design, steps, also): its curves by column, at equal steps and other angles, rad.
    marks(scene, design): crank angles a reader looks for, rad.
    peaks(model): figures that are extremes over the cycle → their quantities.
    adopted(scene, design, target): the scene whose own are a design's lists, and the target whose limits it keeps.
    sizes(scene): the freed variables that come in sizes only → those sold, ascending.
    explain(scene, clash): what physics says of why the limits `clash` (phrases) do; "" where it says nothing.
    """

    demand: Callable[[Any, str], None]
    program: Callable[[Any, str], Program]
    today: Callable[[Any], dict[str, float]]
    design: Callable[[Program, Numbers], dict[str, float]]
    values: Callable[[Program, Numbers], dict[str, float]]
    tidy: Callable[[Program, Numbers], dict[str, float]]
    moves: Callable[[Program], tuple[Move, ...]]
    wish: Callable[[Any, Move, Numbers], Wish | None]
    figures: Callable[[Any, Numbers], dict[str, float | None]]
    sampler: Callable[[Any, Numbers], Sampler]
    curves: Callable[..., dict[str, Floats]]
    marks: Callable[[Any, Numbers], dict[str, float]]
    peaks: Callable[[Any], Mapping[str, str]] = _quantities
    adopted: Callable[[Any, Mapping[str, Any], str], tuple[Any, str]] = _same
    explain: Callable[[Any, Sequence[str]], str] = _nothing
    sizes: Callable[[Any], Mapping[str, Sequence[float]]] = _any


TASKS = {
    "beatup": Task(
        demand=beatup_program.demand,
        program=beatup_program.program,
        today=beatup_program.today,
        design=beatup_design.design,
        values=beatup_design.values,
        tidy=beatup_design.tidy,
        moves=beatup_design.moves,
        wish=beatup_design.wish,
        figures=beatup_design.figures,
        sampler=beatup_design.sampler,
        curves=beatup_curves.curves,
        marks=beatup_curves.marks,
    ),
    "rapier": Task(
        demand=rapier_program.demand,
        program=rapier_program.program,
        today=rapier_program.today,
        design=rapier_design.design,
        values=rapier_design.values,
        tidy=rapier_design.tidy,
        moves=rapier_design.moves,
        wish=rapier_design.wish,
        figures=rapier_design.figures,
        sampler=rapier_design.sampler,
        curves=rapier_curves.curves,
        marks=rapier_curves.marks,
        peaks=rapier_design.peaks,
    ),
    "shedding": Task(
        demand=shedding_program.demand,
        program=shedding_program.program,
        today=shedding_program.today,
        design=shedding_design.design,
        values=shedding_design.values,
        tidy=shedding_design.tidy,
        moves=shedding_design.moves,
        wish=shedding_design.wish,
        figures=shedding_design.figures,
        sampler=shedding_design.sampler,
        curves=shedding_curves.curves,
        marks=shedding_curves.marks,
        explain=shedding_headline.explain,
        sizes=shedding_program.sizes,
        peaks=shedding_design.peaks,
        adopted=shedding_design.adopted,
    ),
}
"""Job name → its functions."""
