"""Levels of which the first can vanish: it is held at 0 exactly, and the later levels are sought beside that.

A peak that vanishes has no slope to weigh against a later level: its square is flat there, and an NLP of both trades a
little of one for the other. What vanishes over the whole cycle vanishes at a few crank angles, as many as the design
has ways to change it: these are equalities, and the later levels have the rest.
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
from loomopt.solving.nlp.point import sampler_at
from loomopt.solving.search.search import Search, as_read, at, judged, objectives, tried

NEAR_ZERO, ANGLES = 1e-3, 12
"""Share of its natural size from which a level is tried at 0, and the crank angles among which those of equalities are
chosen: two components at each are more rows than a linkage has ways to change its forces."""

HELD = "held at 0"
"""What the equalities are called: no limit of a designer's."""


class Spot(NamedTuple):
    """A quantity at one crank angle, rad, with the switches there."""

    quantity: str
    phi: float
    switch: tuple[tuple[str, float], ...]

    @property
    def name(self) -> str:
        """The row's name, which says all that its formula depends on."""
        return f"{self.quantity} at {self.phi!r} {self.switch}"

    def row(self) -> DesignRow:
        """Return it as a row of the design."""
        return DesignRow(functools.partial(_value, self))


def _value(spot: Spot, at: Instant) -> Number:
    node = Node(at.maths.number(spot.phi), {name: at.maths.number(value) for name, value in spot.switch})
    return at.model.together(at.maths, at.given, node)(spot.quantity)


def held(search: Search) -> Search:
    """Return the search with its first level held at 0 and the later ones sought beside it, if that passes.

    As it is where the first level cannot vanish, is not near 0, or has vanished in a best that is certified.
    """
    program, best = search.program, search.best
    first, *later = program.objectives
    sampler = sampler_at(program, best.x) if best and later else None
    names = smooth(program.model, first)
    if best is None or sampler is None or not names:
        return search
    share = (first.merit(sampler) / first.scale) ** (1 / first.power)
    if share > NEAR_ZERO or (search.passed and first.vanishes(sampler)):
        return search
    bare = replace(search, candidates=(), best=None)
    alone = tried(at(replace(bare, program=replace(program, objectives=(first,))), "holding 0"), best.x)
    x = alone.candidates[-1].point.x
    sampler = sampler_at(program, x)
    if sampler is None or not first.vanishes(sampler):
        return search
    rest = tried(replace(bare, program=_without(program, x, sampler, names)), x)
    rest = held(judged(rest))
    found = rest.best
    if found is None or not rest.passed:
        return search
    x = as_read(search, found.x)
    sampler = sampler_at(program, x)
    if sampler is None or not first.vanishes(sampler):
        return search
    levels = (Level(first.figure, 0.0, 0.0, 0.0), *found.certificate.levels)
    # Rows and directions are those of another program.
    certificate = replace(found.certificate, levels=levels, frame=(), level=())
    return replace(
        search, best=best._replace(objectives=objectives(program, x), moved=found.x, certificate=certificate)
    )


def smooth(model: JobModel, level: Objective) -> tuple[str, ...]:
    """Return the quantities that all vanish where a peak does, smooth ones; none of a level that is no such peak."""
    if not isinstance(level, Peak) or level.least_of(model.signed) < 0.0:
        return ()
    if level.power == 1:
        return (level.row,)
    parts = tuple(f"{level.figure}_{axis}" for axis in COMPONENTS)
    return parts if all(map(model.has_quantity, parts)) else ()


def _without(program: Program, x: Mapping[str, float], sampler: Sampler, names: tuple[str, ...]) -> Program:
    """Return a program of the later levels, what the first reads being 0 at crank angles as an equality each."""
    first = program.objectives[0]
    size = first.scale ** (1 / first.power)
    phi = TURN * (np.arange(ANGLES) + 0.5) / ANGLES
    switches = [tuple(sorted(sampler.cycle.switch(int(piece)).items())) for piece in sampler.cycle.located(phi)[0]]
    spots = [Spot(name, float(p), s) for name in names for p, s in zip(phi.tolist(), switches, strict=True)]
    model = replace(program.model, own_rows={**program.model.own_rows, **{spot.name: spot.row() for spot in spots}})
    rows = [ActiveRow(HELD, spot.name, size, 1.0, 0, 0.0) for spot in spots]
    read = sampler_at(replace(program, model=model), x)
    assert read is not None
    found = JetDerivatives(replace(program, model=model), x, read, rows)
    slopes = found.gradients()[:, [name not in program.fixed for name in found.names]]
    chosen = [spots[k] for k in independent(slopes)]
    model = replace(program.model, own_rows={**program.model.own_rows, **{spot.name: spot.row() for spot in chosen}})
    limits = [DesignLimit(HELD, 0, spot.name, 0.0, size, relaxable=False, hidden=True) for spot in chosen]
    return replace(program, model=model, limits=(*program.limits, *limits), objectives=program.objectives[1:])


def independent(slopes: Floats) -> list[int]:
    """Return places of rows that span all rows of slopes (rows, variables), the longest first."""
    left, chosen = slopes.copy(), list[int]()
    largest = float(np.linalg.norm(left, axis=1).max(initial=0.0))
    for _ in range(min(left.shape)):
        lengths = np.linalg.norm(left, axis=1)
        place = int(lengths.argmax())
        if not lengths[place] > RANK * max(largest, math.ulp(1.0)):
            break
        chosen.append(place)
        way = left[place] / lengths[place]
        left = left - np.outer(left @ way, way)
    return chosen
