"""Solve a program with its whole-cycle rows held everywhere: solve at a few nodes, add the true extremes, repeat.

Semi-infinite programming by exchange. Nodes are never dropped (that can cycle); the extremes are found on the
design just reached, in plain NumPy, and between any two nodes.
"""

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from loomopt.cycle import Floats
from loomopt.jobs.program import Program
from loomopt.jobs.sampling import Extreme, Sampler
from loomopt.nlp.polish import polished
from loomopt.nlp.transcribe import Family, Transcription, families, transcribe

ROUNDS = 16
FIRST_SLOTS, LEADING = 6, 4
STANDS = 1e-7
"""Largest excess of a row at a point that the certificate should look at."""
TOUCHING, SETTLED, POLISHES = 1e-8, 1e-8, 3
"""Rows this close to their bound are polished onto it; a smaller step no longer moves an extreme's value."""
PENALTY = 10.0
"""Weight of each earlier objective against the next; it must exceed twice the held objective's multiplier."""
SUCCESS = frozenset({"Solve_Succeeded", "Solved_To_Acceptable_Level"})


@dataclass(frozen=True)
class Settings:
    """How to solve: accuracy of whole-cycle rows relative to their size; weight between levels; progress callback."""

    accuracy: float = 1e-8
    penalty: float = PENALTY
    callback: Any = None


@dataclass(frozen=True)
class Point:
    """Where a solve ended.

    x: values of the variables, SI; status: IPOPT's word, "Not_Assembled" where the start has no finite cycle;
    nodes: per family; violation: largest excess between nodes, relative to the row's size.
    """

    x: dict[str, float]
    status: str
    reached: bool
    """Whether the point is worth a certificate: IPOPT converged, or gave up where all rows hold."""
    iterations: int = 0
    nodes: tuple[tuple[Extreme, ...], ...] = ()
    violation: float = math.inf
    raw: Mapping[str, Floats] = field(default_factory=dict)
    built: float = 0.0
    relaxed: dict[int, float] = field(default_factory=dict)
    """Elastic solves only: limit's place → excess it needs, SI."""


def sampler_at(program: Program, x: Mapping[str, float]) -> Sampler | None:
    """Return the design's sampler, or None where the linkage has no real position."""
    try:
        sampler = Sampler(program.model, {**program.parameters, **x})
        return sampler if all(map(math.isfinite, sampler.static.values())) else None
    except (ValueError, ZeroDivisionError, FloatingPointError):
        return None


def solve(
    program: Program,
    start: Mapping[str, float],
    settings: Settings,
    warm: Point | None = None,
    elastic: bool = False,
) -> Point:
    """Solve a program from a start (SI) or warm from a solved neighbour of the same structure."""
    run = _Run(program, settings, elastic)
    return run.go(dict(warm.x if warm else start), warm)


class _Run:
    """One exchange: the state that goes from round to round."""

    def __init__(self, program: Program, settings: Settings, elastic: bool) -> None:
        self.program, self.settings, self.elastic = program, settings, elastic
        self.families = families(program, elastic)
        count = len(program.objectives)
        self.weights = [settings.penalty ** (count - 1 - k) for k in range(count)]
        self.iterations, self.built = 0, 0.0

    def go(self, x: dict[str, float], warm: Point | None) -> Point:
        sampler = sampler_at(self.program, x)
        if sampler is None:
            return Point(x, "Not_Assembled", False)
        peaks = [sampler.extremes(family.row) for family in self.families]
        nodes = [list(kept) for kept in warm.nodes] if warm else [found[:LEADING] for found in peaks]
        raw: Mapping[str, Floats] = warm.raw if warm else {}
        status, reached, violation, extra = "Maximum_Rounds_Exceeded", False, math.inf, None
        for _ in range(ROUNDS):
            nlp = self._transcribed(sampler, max(map(len, nodes), default=0), warm=bool(raw))
            before, cold = x, not raw
            status, x, extra, raw = self._solve(nlp, sampler, before, extra, peaks, nodes, raw)
            if status not in SUCCESS and not cold:
                status, x, extra, raw = self._solve(nlp, sampler, before, None, peaks, nodes, {})
            sampler = sampler_at(self.program, x)
            if sampler is None:
                return Point(x, "Invalid_Number_Detected", False, self.iterations)
            peaks = [sampler.extremes(family.row) for family in self.families]
            violation = self._extend(nodes, peaks, extra)
            reached = status in SUCCESS or self._stands(nlp, sampler, x, extra, nodes)
            if not reached or violation <= self.settings.accuracy / 100:
                break
        relaxed = self._relaxed(extra) if self.elastic and extra is not None else {}
        if reached and extra is not None and not self.elastic:
            x = self._polish(x, extra, raw, peaks)
        kept = tuple(tuple(chosen) for chosen in nodes)
        return Point(x, status, reached, self.iterations, kept, violation, raw, self.built, relaxed)

    def _transcribed(self, sampler: Sampler, nodes: int, warm: bool) -> Transcription:
        """Return the NLP with room for that many nodes a family, its solver made; charges what had to be built."""
        slots = FIRST_SLOTS
        while slots < nodes:
            slots *= 2
        began = time.perf_counter()
        nlp, fresh = transcribe(self.program, sampler, slots, self.elastic)
        nlp.solver(warm, self.settings.callback)
        self.built += time.perf_counter() - began if fresh else 0.0
        return nlp

    def _stands(
        self,
        nlp: Transcription,
        sampler: Sampler,
        x: Mapping[str, float],
        extra: Floats,
        nodes: Sequence[list[Extreme]],
    ) -> bool:
        """Say whether all rows hold where IPOPT gave up: then the certificate judges, not the solver's word."""
        if self.elastic or len(extra) != nlp.extras or max(map(len, nodes), default=0) > nlp.slots:
            return False
        arguments = self._arguments(nlp, sampler, x, extra, nodes)
        rows = np.asarray(nlp.jacobian(arguments["x0"], arguments["p"])[0]).ravel()
        return bool(np.all(rows <= arguments["ubg"] + STANDS) and np.all(rows >= arguments["lbg"] - STANDS))

    def _polish(
        self, x: dict[str, float], extra: Floats, raw: Mapping[str, Floats], peaks: Sequence[list[Extreme]]
    ) -> dict[str, float]:
        """Return x put exactly on what binds, each touching extreme of the cycle as one row at its own angle."""
        for _ in range(POLISHES):
            sampler = sampler_at(self.program, x)
            if sampler is None:
                return x
            touching = [
                [e for e in found if self._excess(family, e, extra) >= -TOUCHING]
                for family, found in zip(self.families, peaks, strict=True)
            ]
            nlp = self._transcribed(sampler, max(map(len, touching), default=0), warm=False)
            arguments = self._arguments(nlp, sampler, x, extra, touching)
            rows = len(arguments["ubg"]) - len(self.families) * nlp.slots
            active = ~np.array(self._idle_rows(nlp, touching)[rows:], dtype=bool)
            lam_g = np.concatenate([raw["lam_g"][:rows], active.astype(float)])
            flat = polished(nlp.jacobian, arguments, arguments["x0"], raw["lam_x"], lam_g)
            x, extra = self._design(flat), flat[len(self.program.variables) :]
            moved = sampler_at(self.program, x)
            if moved is None or np.abs(flat - arguments["x0"]).max() <= SETTLED:
                return x
            peaks = [moved.extremes(family.row) for family in self.families]
        return x

    def _design(self, flat: Floats) -> dict[str, float]:
        """Return the variables, SI, of the NLP's scaled vector."""
        found = {v.name: float(value * v.scale) for v, value in zip(self.program.variables, flat, strict=False)}
        if self.elastic:
            return found
        return {v.name: min(max(found[v.name], v.lower), v.upper) for v in self.program.variables}

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
            extra = raw["extra"] if raw else self._first_extra(nlp, sampler, peaks)
        arguments = self._arguments(nlp, sampler, x, extra, nodes)
        if self._overdetermined(arguments):
            return "Not_Enough_Degrees_Of_Freedom", dict(x), extra, {}
        if raw:
            arguments |= {"lam_x0": raw["lam_x"], "lam_g0": _padded(raw["lam_g"], len(arguments["lbg"]))}
        solver = nlp.solver(bool(raw), self.settings.callback)
        answer = solver(**arguments)
        stats = solver.stats()
        status = str(stats["return_status"])
        if status in {"NonIpopt_Exception_Thrown", "User_Requested_Stop"}:
            raise KeyboardInterrupt
        self.iterations += int(stats.get("iter_count", 0))
        flat = np.asarray(answer["x"]).ravel()
        extra = flat[len(self.program.variables) :]
        keep = {
            "lam_x": np.asarray(answer["lam_x"]).ravel(),
            "lam_g": np.asarray(answer["lam_g"]).ravel(),
            "extra": extra,
        }
        return status, self._design(flat), extra, keep

    def _arguments(
        self,
        nlp: Transcription,
        sampler: Sampler,
        x: Mapping[str, float],
        extra: Floats,
        nodes: Sequence[list[Extreme]],
    ) -> dict[str, Any]:
        """Return what the NLP is called with: start, parameters and bounds, all scaled."""
        variables = self.program.variables
        lower = np.array([v.lower / v.scale for v in variables])
        upper = np.array([v.upper / v.scale for v in variables])
        if self.elastic:
            bounded = {limit.row for limit in self.program.limits if limit.family == "variable"}
            open_ended = np.array([v.name in bounded for v in variables])
            lower = np.where(open_ended, np.where(lower >= 0.0, 1e-3 * lower, -np.inf), lower)
            upper = np.where(open_ended, np.inf, upper)
        equal = [limit.sign == 0 for limit in nlp.static] + [False] * (nlp.nlp["g"].numel() - len(nlp.static))
        scaled = np.array([x[v.name] / v.scale for v in variables])
        return {
            "x0": np.concatenate([np.clip(scaled, lower, upper), extra]),
            "p": nlp.vector(self.program, sampler, self.weights, nodes),
            "lbx": np.concatenate([lower, np.zeros(len(extra))]),
            "ubx": np.concatenate([upper, np.full(len(extra), np.inf)]),
            "lbg": np.where(equal, 0.0, -np.inf),
            "ubg": np.where(self._idle_rows(nlp, nodes), 1.0, 0.0),
        }

    def _overdetermined(self, arguments: Mapping[str, Any]) -> bool:
        """Say whether more equalities than free variables leave nothing to solve for."""
        return bool(np.sum(arguments["lbg"] == 0.0) > np.sum(arguments["lbx"] < arguments["ubx"]))

    def _first_extra(self, nlp: Transcription, sampler: Sampler, peaks: Sequence[list[Extreme]]) -> Floats:
        """Return epigraph variables just above the start's own values, or ones for an elastic start."""
        if self.elastic:
            return np.ones(nlp.extras)
        first = []
        for k in nlp.epigraphs:
            objective = self.program.objectives[k]
            if objective.form == "magnitude":
                first.append(abs(sampler.static[objective.row]) / objective.scale)
            else:
                family = next(place for place, f in enumerate(self.families) if f.objective == k)
                first.append(abs(peaks[family][0].value) / objective.scale)
        return 1.01 * np.array(first) + 0.01

    def _idle_rows(self, nlp: Transcription, nodes: Sequence[list[Extreme]]) -> list[bool]:
        """Say which rows belong to unused slots."""
        rows = [False] * (nlp.nlp["g"].numel() - len(self.families) * nlp.slots)
        for chosen in nodes:
            rows += [k >= len(chosen) for k in range(nlp.slots)]
        return rows

    def _excess(self, family: Family, extreme: Extreme, extra: Floats) -> float:
        """Return by how much an extreme exceeds its bound, relative to the row's size."""
        if family.objective >= 0:
            epigraphs = [k for k, o in enumerate(self.program.objectives) if o.form != "value"]
            scale, bound = self.program.objectives[family.objective].scale, extra[epigraphs.index(family.objective)]
        else:
            limit = self.program.limits[family.limit]
            soft = [k for k, other in enumerate(self.program.limits) if other.relaxable]
            scale, bound = limit.scale, limit.value / limit.scale
            bound += extra[2 * soft.index(family.limit)] if self.elastic and family.limit in soft else 0.0
        return float(abs(extreme.value) / scale - bound)

    def _extend(self, nodes: Sequence[list[Extreme]], peaks: Sequence[list[Extreme]], extra: Floats) -> float:
        """Add the extremes that exceed their bound; returns the largest excess relative to the row's size."""
        worst = 0.0
        for chosen, found, family in zip(nodes, peaks, self.families, strict=True):
            for extreme in found:
                excess = self._excess(family, extreme, extra)
                worst = max(worst, excess)
                if excess > self.settings.accuracy / 100:
                    chosen.append(extreme)
        return worst

    def _relaxed(self, extra: Floats) -> dict[int, float]:
        """Return the excess each relaxable limit needs, SI, where it is more than rounding."""
        soft = [k for k, limit in enumerate(self.program.limits) if limit.relaxable]
        needs = {
            k: extra[2 * place] - extra[2 * place + 1] * (self.program.limits[k].sign == 0)
            for place, k in enumerate(soft)
        }
        return {k: float(need * self.program.limits[k].scale) for k, need in needs.items() if abs(need) > 1e-7}


def _padded(multipliers: Floats, size: int) -> Floats:
    """Return multipliers for an NLP that has grown by empty rows at its end."""
    return np.concatenate([multipliers, np.zeros(max(0, size - len(multipliers)))])[:size]


def starts(program: Program, count: int, seed: int = 0) -> list[dict[str, float]]:
    """Return the job's own starts, then random ones within each variable's range, up to `count`; all assemble."""
    own = [dict(start) for start in program.starts if sampler_at(program, start)]
    generator = np.random.default_rng(seed)
    drawn: list[dict[str, float]] = []
    for _ in range(200 * count):
        if len(own) + len(drawn) >= count:
            break
        trial = {v.name: float(generator.uniform(*v.range)) for v in program.variables}
        if sampler_at(program, trial):
            drawn.append(trial)
    return own + drawn


def refreshed(program: Program, point: Point) -> Point:
    """Return the point with its nodes re-read at its own design (for a warm solve of a neighbour)."""
    sampler = sampler_at(program, point.x)
    if sampler is None:
        return point
    return replace(point, nodes=tuple(tuple(sampler.extremes(f.row)) for f in families(program)))
