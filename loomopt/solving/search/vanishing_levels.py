"""First levels that can vanish: the level is fixed at exactly 0, and the later levels are optimised.

A vanishing peak has no slope to balance a later level: its square is flat there, and an NLP of both trades a little of
one for the other. A quantity that vanishes over the whole cycle vanishes at a few crank angles, as many as it has
degrees of freedom: these rows are equalities, and the later levels are optimised with the rest.
"""

import functools
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from loomopt.maths.systems import Number
from loomopt.model.limits import DesignLimit
from loomopt.model.model import COMPONENTS, DesignRow, Instant, JobModel
from loomopt.model.objectives import Objective, Peak
from loomopt.model.program import Program
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import TURN, Floats, Node
from loomopt.physics.tolerances import RANK
from loomopt.solving.certificate.derivatives import JetDerivatives
from loomopt.solving.certificate.kkt import ActiveRow
from loomopt.solving.certificate.records import Level
from loomopt.solving.nlp.point import Point, sampler_at
from loomopt.solving.search.search import (
    Candidate,
    Search,
    at_step,
    certify_best,
    certify_uncorrected,
    objectives,
    printed_design,
    solve_from,
)

NEAR_ZERO, ANGLES = 1e-3, 12
"""Share of its scale below which a level is tried at 0, and the number of crank angles from which those of the
equalities are selected: two components at each are more rows than a linkage has degrees of freedom."""

FIXED_AT_ZERO = "held at 0"
"""Name of the equalities, which are no limits of the designer."""


class Spot(NamedTuple):
    """A quantity at one crank angle, rad, with the switches there."""

    quantity: str
    phi: float
    switch: tuple[tuple[str, float], ...]

    @property
    def name(self) -> str:
        """Name of the row, which contains all that its formula depends on."""
        return f"{self.quantity} at {self.phi!r} {self.switch}"

    def row(self) -> DesignRow:
        """Row of the design with this value."""
        return DesignRow(functools.partial(_value, self))


def _value(spot: Spot, instant: Instant) -> Number:
    node = Node(instant.maths.number(spot.phi), {name: instant.maths.number(value) for name, value in spot.switch})
    return instant.model.together(instant.maths, instant.given, node)(spot.quantity)


def fix_first_level(search: Search) -> Search:
    """The search with its first level fixed at 0 and the later ones optimised, if that passes.

    Unchanged where the first level cannot vanish, is not near 0, or already vanishes in a certified best. A single
    level is moved to 0 where that is certified.
    """
    program, best = search.program, search.best
    first, *later = program.objectives
    sampler = sampler_at(program, best.x) if best else None
    names = smooth_quantities(program.model, first)
    if best is None or sampler is None or not names:
        return search
    share = (first.merit(sampler) / first.scale) ** (1 / first.power)
    if share > NEAR_ZERO or (search.passed and first.vanishes(sampler)):
        return search
    empty_search = replace(search, candidates=(), best=None)
    if not later:
        return _with_zero(search, best.x, sampler, names)
    first_search = solve_from(
        at_step(replace(empty_search, program=replace(program, objectives=(first,))), "holding 0"), best.x
    )
    x = first_search.candidates[-1].point.x
    sampler = sampler_at(program, x)
    if sampler is None or not first.vanishes(sampler):
        return search
    later_program = replace(_with_rows_at_zero(program, x, sampler, names), objectives=tuple(later))
    later_search = solve_from(replace(empty_search, program=later_program), x)
    later_search = fix_first_level(certify_best(later_search))
    later_best = later_search.best
    if later_best is None or not later_search.passed:
        return search
    x = printed_design(search, later_best.x)
    sampler = sampler_at(program, x)
    if sampler is None or not first.vanishes(sampler):
        return search
    levels = (Level(first.figure, 0.0, 0.0, 0.0), *later_best.certificate.levels)
    # Rows and directions belong to another program.
    certificate = replace(later_best.certificate, levels=levels, frame=(), level=())
    return replace(
        search, best=best._replace(objectives=objectives(program, x), moved=later_best.x, certificate=certificate)
    )


def _with_zero(search: Search, x: Mapping[str, float], sampler: Sampler, names: tuple[str, ...]) -> Search:
    """The search of a single level with a design at which it vanishes, if there is one near x.

    The slope of the square falls with the quantity, so that a solve may end where 0 is near and not reached.
    """
    objective = search.program.objectives[0]
    program = _with_rows_at_zero(search.program, x, sampler, names)
    zero = solve_from(replace(search, program=program, candidates=(), best=None), x).candidates[-1].point
    # Multipliers and rows belong to the program with equalities: of the point only the design is taken.
    design = Point(dict(zero.x), zero.status, zero.usable)
    candidate = certify_uncorrected(search, Candidate(design, objectives(search.program, design.x)))
    at_zero = sampler_at(search.program, candidate.x)
    if at_zero is None or not candidate.certificate.passed or not objective.vanishes(at_zero):
        return search
    return replace(search, best=candidate)


def smooth_quantities(model: JobModel, level: Objective) -> tuple[str, ...]:
    """Smooth quantities that all vanish where a peak does; empty for a level that is no such peak."""
    if not isinstance(level, Peak) or level.least_of(model.signed) < 0.0:
        return ()
    if level.power == 1:
        return (level.row,)
    parts = tuple(f"{level.figure}_{axis}" for axis in COMPONENTS)
    return parts if all(map(model.has_quantity, parts)) else ()


def _with_rows_at_zero(program: Program, x: Mapping[str, float], sampler: Sampler, names: tuple[str, ...]) -> Program:
    """A program with the first level's quantities 0 at crank angles, as equalities."""
    first = program.objectives[0]
    size = first.scale ** (1 / first.power)
    phi = TURN * (np.arange(ANGLES) + 0.5) / ANGLES
    switches = [tuple(sorted(sampler.cycle.switch(int(piece)).items())) for piece in sampler.cycle.located(phi)[0]]
    spots = [Spot(name, float(p), s) for name in names for p, s in zip(phi.tolist(), switches, strict=True)]
    model = replace(program.model, own_rows={**program.model.own_rows, **{spot.name: spot.row() for spot in spots}})
    rows = [ActiveRow(FIXED_AT_ZERO, spot.name, size, 1.0, 0, 0.0) for spot in spots]
    sampler_with_rows = sampler_at(replace(program, model=model), x)
    assert sampler_with_rows is not None
    derivatives = JetDerivatives(replace(program, model=model), x, sampler_with_rows, rows)
    slopes = derivatives.gradients()[:, [name not in program.fixed for name in derivatives.names]]
    selected = [spots[k] for k in independent_rows(slopes)]
    model = replace(program.model, own_rows={**program.model.own_rows, **{spot.name: spot.row() for spot in selected}})
    limits = [DesignLimit(FIXED_AT_ZERO, 0, spot.name, 0.0, size, relaxable=False, hidden=True) for spot in selected]
    return replace(program, model=model, limits=(*program.limits, *limits))


def independent_rows(slopes: Floats) -> list[int]:
    """Places of rows that span all rows of slopes (rows, variables), the longest first."""
    remaining, places = slopes.copy(), list[int]()
    largest = float(np.linalg.norm(remaining, axis=1).max(initial=0.0))
    for _ in range(min(remaining.shape)):
        lengths = np.linalg.norm(remaining, axis=1)
        place = int(lengths.argmax())
        if not lengths[place] > RANK * max(largest, math.ulp(1.0)):
            break
        places.append(place)
        direction = remaining[place] / lengths[place]
        remaining = remaining - np.outer(remaining @ direction, direction)
    return places
