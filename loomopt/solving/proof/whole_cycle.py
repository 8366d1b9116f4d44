"""Proof over the whole cycle: every limit, the assembly and every claimed peak, for all crank angles.

Whole-cycle rows are bounded on boxes of crank angle, single values enclosed, in Arb's ball arithmetic. What binds
touches its limit, so it is proven up to a slack: a share of the quantity's largest magnitude over the cycle.
"""

import math
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from loomopt.base import arguments
from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.jobs.base import Job
from loomopt.model import model
from loomopt.model.limits import CycleLimit, Limit
from loomopt.model.program import Program
from loomopt.model.sampling import Sampler
from loomopt.model.session import working
from loomopt.physics.cycle import Where
from loomopt.physics.tolerances import LEAST_SLACK, MOST_SLACK, SLACK
from loomopt.scenes import designs
from loomopt.scenes.scene import Scene
from loomopt.solving.answer.solution import Proof, Proofs, Sentences, Solution, UnitFormatter
from loomopt.solving.certificate import taylor_bounds
from loomopt.solving.certificate.taylor_bounds import Boxes
from loomopt.solving.options import check_effects, target_name

RANK = {"proven": 0, "undecided": 1, "violated": 2}
"""Statuses from best to worst."""


@working()
def prove(
    scene: Scene,
    design: Mapping[str, float],
    target: str | None = None,
    slack: float = SLACK,
    limits_of: Program | None = None,
) -> Proofs:
    """Proofs of a design's limits (SI; numbers that it does not name are today's).

    slack: what is left open, relative to each quantity's largest magnitude over the cycle; limits_of: a program whose
    limits are proven; those of the target by default. Raises BadInput.
    """
    allowed, remedy = f"{LEAST_SLACK:g} to {MOST_SLACK:g}", "Give 1e-8, or leave it out."
    if not LEAST_SLACK <= arguments.number(slack, "slack", allowed, remedy) <= MOST_SLACK:
        raise BadInput("the slack is out of range", key="slack", value=f"{slack:g}", allowed=allowed, remedy=remedy)
    job, name = registry.of(scene), target_name(scene, target)
    check_effects(scene, "prove")
    job.demand(scene, name)
    full = {**job.today(scene), **design}
    program_scene, program_target = (scene, name) if limits_of else job.adopted(scene, full, name)
    program = limits_of or job.program(program_scene, program_target)
    reads = _readings(program_scene, job, program, full, slack)
    formatter = UnitFormatter(program_scene)
    proofs = tuple(
        proof._replace(unit=formatter.si(proof.name)) for proof in _merged(_decided(program, job, formatter, reads))
    )
    whole = reads[1].sampler
    return Proofs(scene.name, name, proofs, scene, model.uncovered(whole.model.effects, whole.given.tables))


LEAST_BOXES, FIRST_BOXES, GROWTH, SECONDS = 100, 500, 4, 5.0
"""Boxes that every claim gets at least, boxes of every claim in the first round (every packaged row takes fewer),
growth of that number from round to round, and s of its thread from which on no claim gets more than the least."""


def _decided(program: Program, job: Job, formatter: UnitFormatter, reads: "tuple[_Read, _Read]") -> list[Proof]:
    """Proofs of claims: a few boxes for each claim, then more in every round for open claims, while time is left."""
    start_time = time.thread_time()
    most = min(FIRST_BOXES, taylor_bounds.MOST_BOXES)

    def is_late() -> bool:
        return time.thread_time() - start_time > SECONDS

    def first_stop(boxes: int) -> bool:
        return boxes >= most or (boxes >= LEAST_BOXES and is_late())

    def stop(boxes: int) -> bool:
        return boxes >= most or is_late()

    claims = list(_claims(program, job, formatter, *reads))
    for read in reads:
        read.boxes.share(claim[1].quantity for claim in claims if not isinstance(claim, Proof) and claim[0] is read)
    proofs = [claim if isinstance(claim, Proof) else _over_cycle(*claim, first_stop) for claim in claims]
    while most < taylor_bounds.MOST_BOXES and not is_late():
        most = min(GROWTH * most, taylor_bounds.MOST_BOXES)
        for place, claim in enumerate(claims):
            if not isinstance(claim, Proof) and proofs[place].status == "undecided" and not is_late():
                more = _over_cycle(*claim, stop)
                proofs[place] = more if more.boxes >= proofs[place].boxes else proofs[place]
    return proofs


def _merged(proofs: list[Proof]) -> Iterator[Proof]:
    """Yield one proof for all rows of one limit: the worst status, the least margin, all boxes."""
    groups: dict[tuple[str, str], list[Proof]] = {}
    for proof in proofs:
        groups.setdefault((proof.limit, proof.text), []).append(proof)
    for rows in groups.values():
        worst = max(rows, key=lambda proof: (RANK[proof.status], -proof.margin))
        yield worst._replace(boxes=sum(proof.boxes for proof in rows))


@dataclass(frozen=True)
class _Read:
    """Design read in floats and in balls; slack: relative margin of the proofs."""

    sampler: Sampler
    boxes: Boxes
    slack: float


@dataclass(frozen=True)
class _Claim:
    """Claim that a quantity (or its magnitude if unsigned) is below a bound; peak: its refined maximum; all SI."""

    name: str
    text: str
    quantity: str
    bound: float
    peak: float
    where: Where | None = None
    kind: Literal["limit", "assembly", "peak"] = "limit"


def _readings(
    scene: Scene, job: Job, program: Program, design: Mapping[str, float], slack: float
) -> tuple[_Read, _Read]:
    """Design read by the target's program, and by the job as a whole."""
    # A fixed variable has the program's value, which a limit may move from the scene's.
    known = {name: value for name, value in job.numbers(scene).items() if name not in program.fixed}
    design_numbers = {scene.full(name): value for name, value in design.items()}
    # A number that the program does not choose is that of the design, or today's where the design has none.
    parameters = {n: design_numbers.get(n, value) for n, value in program.parameters.items()}
    design_program = replace(program, parameters=parameters)
    values = {**parameters, **job.values(design_program, {**known, **design_numbers})}
    samplers = Sampler(program.model, values), job.sampler(scene, design)
    target_read, whole = (_Read(sampler, Boxes(sampler), slack) for sampler in samplers)
    return target_read, whole


def _claims(
    program: Program, job: Job, formatter: UnitFormatter, target_read: _Read, whole: _Read
) -> "Iterator[Proof | tuple[_Read, _Claim]]":
    """Yield claims to be proven: limits over the cycle, assembly, peaks; for single values, finished proofs."""
    for limit in program.row_limits:
        hidden = limit.row if limit.name in program.named_limits else limit.name
        text = hidden if limit.hidden else formatter.limit(limit)
        if isinstance(limit, CycleLimit):
            peak = target_read.sampler.peak(limit.row, limit.where)
            yield target_read, _Claim(limit.name, text, limit.row, limit.bound, peak, limit.where)
        else:
            yield _single(target_read, limit, text)
    for name, (quantity, most) in whole.sampler.model.assembly.items():
        yield whole, _Claim(name, name, quantity, most, whole.sampler.peak(quantity), kind="assembly")
    for figure, quantity in job.peaks(whole.sampler.model).items():
        peak = whole.sampler.peak(quantity)
        if math.isfinite(peak):
            yield whole, _Claim(figure, f"{figure} as claimed", quantity, peak, peak, kind="peak")


def _over_cycle(read: _Read, claim: _Claim, stop: Callable[[int], bool]) -> Proof:
    """Bound one quantity on boxes; both signs where its magnitude counts; stop(boxes): whether to leave it open."""
    slack = read.slack * _largest(read.sampler, claim.quantity)
    signs = (1.0,) if claim.quantity in read.sampler.model.signed else (1.0, -1.0)
    outcomes = [read.boxes.bound(claim.quantity, sign, claim.bound + slack, claim.where, stop) for sign in signs]
    worst = max(outcomes, key=lambda outcome: RANK[outcome.status])
    count = sum(outcome.boxes for outcome in outcomes)
    most, angle = claim.peak, None
    if worst.angle is not None:
        most, angle = _highest(read.sampler, claim, worst.angle)
    open_ = None if worst.open is None else worst.open % (2 * math.pi)
    return Proof(claim.name, claim.text, worst.status, claim.bound - most, slack, count, angle, claim.kind, open=open_)


def _highest(sampler: Sampler, claim: _Claim, angle: float) -> tuple[float, float]:
    """Largest known value of a quantity over the cycle, and its angle, rad.

    angle: where the boxes ended, which may be anywhere beyond the bound, or at a peak that the samples miss.
    """
    height = float(sampler.heights(claim.quantity, sampler.at_angles(claim.quantity, np.array([angle])))[0])
    known = max(sampler.extremes(claim.quantity, claim.where), key=lambda extreme: extreme.height, default=None)
    if known is not None and not height > known.height:
        height, angle = known.height, sampler.angle(known)
    return height, angle % (2 * math.pi)


def _single(read: _Read, limit: Limit, text: str) -> Proof:
    """Enclose one value of the design alone."""
    residual = limit.residual(read.boxes) + read.boxes.maths.number(0.0)
    weight = float(limit.factor(read.boxes))
    residual = residual / weight if weight else residual
    value = abs(float(read.boxes.single(limit.row)))
    size = max(value / (weight or 1.0), abs(limit.value), limit.scale / (weight or 1.0))
    excess = abs(residual) if limit.sign == 0 else residual
    slack = read.slack * size
    status = "proven" if excess <= slack else "violated" if excess > slack else "undecided"
    return Proof(limit.name, text, status, -float(excess.mid()), slack, 1)


def _largest(sampler: Sampler, quantity: str) -> float:
    """Largest magnitude of a quantity over the cycle, as sampled."""
    pieces, u = sampler.grid()
    return float(np.abs(sampler.at(quantity, pieces, u)).max())


def proven(scene: Scene, target: str, answer: Solution) -> Solution:
    """Answer whose certificate has the result of the proof."""
    proofs = prove(scene, designs.flat(answer.design), target)
    answer = replace(answer, proofs=proofs)
    assert answer.certificate is not None
    if proofs.passed:
        return replace(answer, certificate=replace(answer.certificate, whole_cycle="proven"))
    reasons = tuple(f"{proof.text} is {proof.status}" for proof in proofs.proofs if proof.status != "proven")
    certificate = replace(answer.certificate, passed=False, reasons=(*answer.certificate.reasons, *reasons))
    sentences = Sentences(f"A design was reached but not proven: {'; '.join(reasons)}.")
    return replace(answer, certificate=certificate, status="uncertified", sentences=sentences)
