"""Solve a program with its whole-cycle rows held everywhere: solve at a few nodes, add the true extremes, repeat.

Semi-infinite programming by exchange. Nodes are never dropped (that can cycle); the extremes are found on the
design just reached, in plain NumPy, and between any two nodes.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from loomopt.cycle import TURN, Cycle, Floats
from loomopt.nlp.calls import Calls
from loomopt.nlp.families import Family
from loomopt.nlp.follow import follow, polish
from loomopt.nlp.point import SUCCESS, Point, Settings, sampler_at
from loomopt.nlp.polish import BINDING
from loomopt.nlp.transcribe import Transcription
from loomopt.program.program import Program
from loomopt.program.sampling import Extreme, Sampler, Tally

ROUNDS, ELASTIC_ROUNDS, LEADING = 16, 32, 4
STANDS = 1e-7
"""Largest excess of a row at a point that the certificate should look at."""
NEEDED = 1e-9
"""Excess of an elastic solve, in natural sizes, that is more than rounding."""


def solve(
    program: Program,
    start: Mapping[str, float],
    settings: Settings,
    warm: Point | None = None,
    elastic: bool = False,
) -> Point:
    """Solve a program from a start (SI) or warm from a solved neighbour of the same structure."""
    if warm:
        within = {v.name: min(max(warm.x[v.name], v.lower), v.upper) for v in program.variables}
        warm = replace(warm, x=within)
    return _Run(program, settings, elastic).go(dict(warm.x if warm else start), warm)


class _Run:
    """One exchange: the state that goes from round to round."""

    def __init__(self, program: Program, settings: Settings, elastic: bool) -> None:
        self.program, self.settings, self.elastic = program, settings, elastic
        self.calls = Calls(program, settings, elastic)
        self.iterations = 0

    def go(self, x: dict[str, float], warm: Point | None) -> Point:
        calls = self.calls
        followed = follow(calls, warm) if warm and warm.reached else None
        if followed:
            return followed
        sampler = self.calls.sampler(x)
        if sampler is None:
            return Point(x, "Not_Assembled", False)
        peaks = calls.peaks(sampler)
        nodes = [list(kept) for kept in warm.nodes] if warm else [found[:LEADING] for found in peaks]
        if self.settings.uniform:
            nodes = [_uniform(sampler, family, self.settings.uniform) for family in calls.families]
        raw: Mapping[str, Floats] = warm.raw if warm else {}
        last = raw
        status, reached, violation, extra = "Maximum_Rounds_Exceeded", False, math.inf, None
        for _ in range(ELASTIC_ROUNDS if self.elastic else ROUNDS):
            nlp = calls.transcribed(sampler, max(map(len, nodes), default=0), warm=bool(raw))
            before, cold = x, not raw
            status, x, extra, raw = self._solve(nlp, sampler, before, extra, peaks, nodes, raw)
            if status not in SUCCESS and not cold:
                status, x, extra, raw = self._solve(nlp, sampler, before, None, peaks, nodes, {})
            last = raw
            order, here = sampler.cycle, self.calls.sampler(x)
            if here is None:
                return Point(x, "Invalid_Number_Detected", False, self.iterations)
            sampler = here
            if sampler.cycle.order != order.order:
                nodes, raw = [[_moved(e, order, sampler) for e in of] for of in nodes], {}
            peaks = calls.peaks(sampler)
            violation = 0.0 if self.settings.uniform else self._extend(nodes, peaks, extra)
            reached = status in SUCCESS or self._stands(nlp, sampler, x, extra, nodes)
            if not reached or violation <= self.settings.excess:
                break
            followed = self._followed(nlp, Point(x, status, True, raw=raw), nodes, peaks)
            if followed:
                return followed
        kept = tuple(map(tuple, nodes))
        point = Point(x, status, reached, self.iterations, kept, violation, last, calls.built)
        if extra is None or not reached or not self.settings.polished:
            return point
        if self.elastic:
            return replace(point, reached=violation <= STANDS, relaxed=self._relaxed(extra))
        x, touching = polish(calls, x, extra, point, peaks)
        binding = tuple(map(tuple, touching))
        return replace(point, x=x, binding=binding, built=calls.built, structure=self.program.structure)

    def _followed(
        self, nlp: Transcription, point: Point, nodes: Sequence[list[Extreme]], peaks: Sequence[list[Extreme]]
    ) -> Point | None:
        """Return the answer that pivots lead to from what binds where IPOPT stopped; None where they do not.

        They move the nodes with the extremes, where the exchange can only add: along a flat direction that shifts the
        extremes it creeps.
        """
        if self.elastic or point.status not in SUCCESS or not point.raw or not self.settings.polished:
            return None
        prices = point.raw["lam_g"][-len(nodes) * nlp.slots :].reshape(len(nodes), nlp.slots)
        pairs = zip(nodes, prices, strict=True)
        binding = tuple(tuple(e for e, p in zip(of, own, strict=False) if p > BINDING) for of, own in pairs)
        kept = tuple(map(tuple, peaks))
        found = follow(self.calls, replace(point, nodes=kept, binding=binding, structure=self.program.structure))
        return replace(found, iterations=self.iterations) if found else None

    def _stands(
        self,
        nlp: Transcription,
        sampler: Sampler,
        x: Mapping[str, float],
        extra: Floats,
        nodes: Sequence[list[Extreme]],
    ) -> bool:
        """Say whether all rows hold where IPOPT gave up: then the certificate judges, not the solver's word."""
        grown = max(map(len, nodes), default=0) > nlp.slots or sampler.corner_count != nlp.structure.corners
        if self.elastic or len(extra) != nlp.structure.extras or grown:
            return False
        arguments = self.calls.arguments(nlp, sampler, x, extra, nodes)
        rows = np.asarray(nlp.jacobian(arguments["x0"], arguments["p"])[0]).ravel()
        return bool(np.all(rows <= arguments["ubg"] + STANDS) and np.all(rows >= arguments["lbg"] - STANDS))

    def _solve(
        self,
        nlp: Transcription,
        sampler: Sampler,
        x: Mapping[str, float],
        extra: Floats | None,
        peaks: Sequence[list[Extreme]],
        nodes: Sequence[list[Extreme]],
        raw: Mapping[str, Floats],
    ) -> tuple[str, dict[str, float], Floats, Mapping[str, Floats]]:
        """Run IPOPT once; returns its status, the variables, the epigraph or elastic variables, and the raw answer."""
        if extra is None:
            extra = raw["extra"] if raw else self.calls.first_extra(nlp, sampler, peaks)
        arguments = self.calls.arguments(nlp, sampler, x, extra, nodes)
        if self.calls.overdetermined(arguments):
            return "Not_Enough_Degrees_Of_Freedom", dict(x), extra, {}
        if raw:
            arguments |= {"lam_x0": raw["lam_x"], "lam_g0": _padded(raw["lam_g"], len(arguments["lbg"]))}
        solver = nlp.solver(bool(raw), self.settings)
        answer = solver(**arguments)
        stats = solver.stats()
        status = str(stats["return_status"])
        if status in {"NonIpopt_Exception_Thrown", "User_Requested_Stop"}:
            raise KeyboardInterrupt
        self.iterations += int(stats.get("iter_count", 0))
        calls = sum(int(count) for name, count in stats.items() if name.startswith("n_call_nlp_"))
        Tally.positions += calls * max(1, sum(map(len, nodes)))
        flat = np.asarray(answer["x"]).ravel()
        extra = flat[len(self.program.variables) :]
        keep = {
            "lam_x": np.asarray(answer["lam_x"]).ravel(),
            "lam_g": np.asarray(answer["lam_g"]).ravel(),
            "extra": extra,
        }
        return status, self.calls.design(flat), extra, keep

    def _extend(self, nodes: Sequence[list[Extreme]], peaks: Sequence[list[Extreme]], extra: Floats) -> float:
        """Add the extremes that exceed their bound; returns the largest excess relative to the row's size."""
        worst = 0.0
        for chosen, found, family in zip(nodes, peaks, self.calls.families, strict=True):
            for extreme in found:
                excess = self.calls.excess(family, extreme, extra)
                worst = max(worst, excess)
                if excess > self.settings.excess:
                    chosen.append(extreme)
        return worst

    def _relaxed(self, extra: Floats) -> dict[int, float]:
        """Return the excess each relaxable limit needs, SI, where it is more than rounding."""
        limits = self.program.limits
        needs = {k: extra[2 * g] - extra[2 * g + 1] * (limits[k].sign == 0) for k, g in self.program.soft.items()}
        return {k: float(need * limits[k].scale) for k, need in needs.items() if abs(need) > NEEDED}


def _uniform(sampler: Sampler, family: Family, count: int) -> list[Extreme]:
    """Return equal nodes of one turn for a family's row: both signs of it where its magnitude counts."""
    pieces, u = sampler.cycle.located(TURN * np.arange(count) / count)
    on = sampler.cycle.on(family.where)[pieces]
    places = list(zip(pieces[on].tolist(), u[on].tolist(), strict=True))
    if family.row in sampler.model.signed:
        return [Extreme(*place, 0.0, signed=True) for place in places]
    return [Extreme(*place, sign) for place in places for sign in (1.0, -1.0)]


def _moved(node: Extreme, before: Cycle, sampler: Sampler) -> Extreme:
    """Return a node of a cycle whose corners stood in another order, at the same crank angle."""
    angle = float(before.angles(np.array([node.piece]), np.array([node.u]))[0])
    return Extreme(*sampler.cycle.place(angle), node.value, node.signed)


def _padded(multipliers: Floats, size: int) -> Floats:
    """Return multipliers for an NLP that has grown by empty rows at its end."""
    return np.concatenate([multipliers, np.zeros(max(0, size - len(multipliers)))])[:size]


def starts(program: Program, count: int, seed: int = 0) -> list[dict[str, float]]:
    """Return the job's own starts, all of them, then random ones within each variable's range, up to `count`."""
    own = [start for start in (_started(program, x) for x in program.starts) if start]
    generator = np.random.default_rng(seed)
    drawn: list[dict[str, float]] = []
    for _ in range(200 * count):
        if len(own) + len(drawn) >= count:
            break
        trial = _started(program, {v.name: float(generator.uniform(*v.range)) for v in program.variables})
        if trial:
            drawn.append(trial)
    return own + drawn


def _started(program: Program, x: Mapping[str, float]) -> dict[str, float] | None:
    """Return a start with the variables that follow from the others; None where the linkage has no real cycle."""
    try:
        full = program.completed(x)
    except (ValueError, ZeroDivisionError):
        return None
    return full if sampler_at(program, full) else None
