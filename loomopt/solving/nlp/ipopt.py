"""How IPOPT is asked to work, and one run of it [Wächter and Biegler, Mathematical Programming 106 (2006)]."""

import contextlib
import functools
import math
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from loomopt.base import interrupts
from loomopt.model.program import Program
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import SAME_OBJECTIVE
from loomopt.solving.nlp.point import SUCCESS, Elastic, Known, Point, Settings, sampler_at
from loomopt.solving.nlp.rows import HeldStations, Multipliers, RowFamily, chained, epigraphs, families, held, stations
from loomopt.solving.nlp.transcribe import Transcription, transcribe

FIRST_SLOTS, LEADING = 6, 4
"""Nodes that a built NLP has room for (doubled when they are used up), and those of a start: its largest extremes.

The experiment: two of them take IPOPT a third more iterations; eight, or room for twelve, end one target's first start
in another local optimum. Room for three and two of a start take a rapier drive 0.86 of the time, and end one point of
a front of ten in an optimum that is 1.8 % worse.
"""

BESIDE_STATIONS = 2, 1
"""The same where rows stand at corners from the first. None of 28 free cam laws of 16 and 64 intervals, with every
effect, ends at a node beside its knots, and each that there is room for takes a twentieth of building."""

FIRST_SHARE, FIRST_ROOM = 1.01, 0.01
"""Factor and room by which a first epigraph variable stands above its rows: inside, so that IPOPT need not move it."""

ELASTIC_SHARE = 1e-3
"""Share of a positive lower bound below which no relaxation goes: lengths stay positive."""


class Calls:
    """How one program is put to its NLP; charges what had to be built on the way.

    slots: nodes of each family that a first NLP has room for; leading: those of a start.
    """

    def __init__(
        self, program: Program, settings: Settings, ways: Elastic | None = None, known: Known | None = None
    ) -> None:
        self.program, self.settings, self.ways, self.known = program, settings, ways, known or Known()
        self.elastic = elastic = ways is not None
        self.families, self.epigraphs = families(program, elastic), epigraphs(program, elastic)
        names = [variable.name for variable in program.variables]
        self.slots, self.leading = BESIDE_STATIONS if chained(program.model, names) else (FIRST_SLOTS, LEADING)
        count = len(program.objectives)
        self.weights = [settings.penalty ** (count - 1 - k) for k in range(count)]
        self.built = 0.0

    def sampler(self, x: Mapping[str, float]) -> Sampler | None:
        """Return the sampler of variables x (SI), or None where the linkage has no real position."""
        return sampler_at(self.program, x, self.settings.sampled)

    def peaks(self, sampler: Sampler) -> list[list[Extreme]]:
        """Return the local extremes of each family's quantity, largest first."""
        sampler.search(family.row for family in self.families)
        return [sampler.extremes(family.row, family.where) for family in self.families]

    def loose(self, sampler: Sampler, extremes: Sequence[Sequence[Extreme]]) -> list[list[Extreme]]:
        """Return of each family the extremes that no row of a station holds: these need a node."""
        corners = stations(self.program.model, sampler.given, [v.name for v in self.program.variables])
        stood = HeldStations(corners, sampler.cycle)
        rows = [set(held([corner.switch for corner in corners], family)) for family in self.families]
        pairs = zip(rows, extremes, strict=True)
        return [[e for e in of if stood.station(e) not in own] for own, of in pairs]

    def transcribed(self, sampler: Sampler, nodes: Sequence[Sequence[Extreme]], warm: bool) -> Transcription:
        """Return the NLP with room for nodes of each family, its solver made; charges what had to be built."""
        slots = self.slots
        while any(len(of) > slots for of in nodes):
            slots *= 2
        began = time.perf_counter()
        building = functools.partial(self.settings.say, "building the equations")
        nlp, fresh = transcribe(self.program, sampler, slots, self.elastic, building)
        nlp.solver(warm, self.settings)
        if fresh:
            self.settings.say()
        self.built += time.perf_counter() - began if fresh else 0.0
        return nlp

    def arguments(
        self,
        nlp: Transcription,
        sampler: Sampler,
        x: Mapping[str, float],
        extra: Floats,
        nodes: Sequence[Sequence[Extreme]],
    ) -> dict[str, Any]:
        """Return what the NLP is called with: start, parameters and bounds, all scaled."""
        rows, (lower, upper) = nlp.rows, self._bounds()
        scaled = np.array([x[v.name] / v.scale for v in self.program.variables])
        lbg, ubg = np.full(rows.size, -np.inf), np.zeros(rows.size)
        rows.of_limits(lbg)[[self.program.limits[k].sign == 0 for k in rows.limits]] = 0.0
        rows.at_nodes(ubg)[~rows.used(list(map(len, nodes)))] = 1.0
        return {
            "x0": rows.joined(np.clip(scaled, lower, upper), extra),
            "p": nlp.structure.vector(self.program, sampler, self.weights, nodes, self._costs(nlp)),
            "lbx": rows.joined(lower, np.full(len(extra), 0.0 if self.elastic else -np.inf)),
            "ubx": rows.joined(upper, self._most(nlp)),
            "lbg": lbg,
            "ubg": ubg,
        }

    def _bounds(self) -> tuple[Floats, Floats]:
        """Return the variables' bounds, scaled; limits that may give way are none, but what is positive stays so."""
        variables = self.program.variables
        lower = np.array([v.lower / v.scale for v in variables])
        upper = np.array([v.upper / v.scale for v in variables])
        if not self.elastic:
            return lower, upper
        sides = [(limit.row, limit.sign) for limit in self.program.bound_limits.values()]
        down, up = ({name for name, sign in sides if sign in (side, 0)} for side in (-1, 1))
        least = np.where(lower >= 0.0, ELASTIC_SHARE * lower, -np.inf)
        return (
            np.where([v.name in down for v in variables], least, lower),
            np.where([v.name in up for v in variables], np.inf, upper),
        )

    def _ways(self, nlp: Transcription) -> Floats:
        """Return the cost of each excess, infinite where a limit is firm; nothing for a program that is not elastic."""
        if self.ways is None:
            return np.zeros(0)
        return np.array(self.ways.costs or np.ones(nlp.rows.extras))

    def _costs(self, nlp: Transcription) -> Floats:
        costs = self._ways(nlp)
        return np.where(np.isinf(costs), 0.0, costs)

    def _most(self, nlp: Transcription) -> Floats:
        """Return upper bounds of the epigraph variables, or of the excesses: none where a limit is firm."""
        if self.ways is None:
            return np.full(nlp.rows.extras, np.inf)
        return np.where(np.isinf(self._ways(nlp)), 0.0, np.inf)

    def overdetermined(self, arguments: Mapping[str, Any]) -> bool:
        """Say whether more equalities than free variables leave nothing to solve for."""
        return bool(np.sum(arguments["lbg"] == 0.0) > np.sum(arguments["lbx"] < arguments["ubx"]))

    def design(self, scaled: Floats) -> dict[str, float]:
        """Return the design's variables, SI, of the NLP's."""
        x = {v.name: float(value * v.scale) for v, value in zip(self.program.variables, scaled, strict=True)}
        if self.elastic:
            return x
        return {v.name: min(max(x[v.name], v.lower), v.upper) for v in self.program.variables}

    def first_extra(self, nlp: Transcription, sampler: Sampler) -> Floats:
        """Return epigraph variables just above the start's own values, or ones for an elastic start."""
        if self.ways:
            beside = self.ways.beside
            return beside.extra if beside else np.ones(nlp.rows.extras)
        levels = [self.program.objectives[epigraph.objective] for epigraph in self.epigraphs]
        first = np.array([level.merit(sampler) / level.scale for level in levels])
        share = np.where(first < 0.0, 1 / FIRST_SHARE, FIRST_SHARE)
        return np.asarray(share * first + FIRST_ROOM)

    def excess(self, family: RowFamily, extreme: Extreme, extra: Floats) -> float:
        """Return by how much an extreme exceeds its bound, relative to the row's size."""
        if family.epigraph >= 0:
            scale = self.program.objectives[self.epigraphs[family.epigraph].objective].scale
            return float(extreme.height / scale - extra[family.epigraph])
        limit, ways = self.program.limits[family.limit], self.program.excess_places
        bound = limit.bound / limit.scale
        bound += extra[ways[family.limit][0]] if self.elastic and family.limit in ways else 0.0
        return float(extreme.height / limit.scale - bound)

    def worth(self, point: Point) -> float:
        """Return the NLP's objective at a point that has its epigraph variables."""
        return math.fsum(w * h for w, h in zip(self.weights, self._heights(point.x, point.extra), strict=True))

    def is_worse(self, answer: "IpoptAnswer", start: Sampler) -> bool:
        """Say whether a solve ended nowhere, or at a worse point than its start."""
        if answer.status not in SUCCESS:
            return True
        levels = zip(self.weights, self.program.objectives, strict=True)
        return answer.value > math.fsum(weight * of.merit(start) / of.scale for weight, of in levels) + SAME_OBJECTIVE

    def is_beaten(self, answer: "IpoptAnswer") -> bool:
        """Say whether a solve at some nodes is already no better than is known."""
        if self.ways is not None:
            costs = np.array(self.ways.costs or np.ones(len(answer.extra)))
            return float(np.sum(answer.extra[costs == 1.0])) > self.known.most
        return answer.value > self.known.most and not self._falls_earlier(answer)

    def _falls_earlier(self, answer: "IpoptAnswer") -> bool:
        """Say whether an objective before the last is lower at some nodes than is known, those before it the same."""
        if len(self.known.levels) < 2:
            return False
        for here, known in zip(self._heights(answer.x, answer.extra), self.known.levels[:-1], strict=False):
            if abs(here - known) > SAME_OBJECTIVE:
                return bool(here < known)
        return False

    def _heights(self, x: Mapping[str, float], extra: Floats) -> Iterator[float]:
        """Yield the objectives as the NLP has them, in natural sizes: of an epigraph variable its own value.

        Nothing where the linkage has no real position.
        """
        heights = {epigraph.objective: float(extra[k]) for k, epigraph in enumerate(self.epigraphs)}
        sampler = self.sampler(x)
        if sampler is None:
            return
        for k, objective in enumerate(self.program.objectives):
            yield heights[k] if k in heights else objective.merit(sampler) / objective.scale

    def first_nodes(self, loose: Sequence[Sequence[Extreme]]) -> tuple[tuple[Extreme, ...], ...]:
        """Return a start's nodes: its own largest extremes."""
        return tuple(tuple(of[: self.leading]) for of in loose)

    def with_known(self, nodes: Sequence[Sequence[Extreme]]) -> tuple[tuple[Extreme, ...], ...]:
        """Return nodes with those known to bind after them, as many as there is room for."""
        if not self.known.nodes:
            return tuple(map(tuple, nodes))
        room = [max(self.slots, len(of)) for of in nodes]
        return tuple((*of, *known)[:most] for of, known, most in zip(nodes, self.known.nodes, room, strict=True))

    def violation(self, peaks: Sequence[Sequence[Extreme]], extra: Floats) -> float:
        """Return the largest excess of an extreme, relative to its row's size; 0 where there is none."""
        pairs = zip(self.families, peaks, strict=True)
        return max((self.excess(family, e, extra) for family, of in pairs for e in of), default=0.0)


STOPPED = frozenset({"NonIpopt_Exception_Thrown", "User_Requested_Stop"})
"""What IPOPT says when its callback raised, or asked it to stop."""
WARNING, ON_CTRL_C = "CasADi - ", "KeyboardInterruptException"
"""How CasADi begins a warning, and which one it gives on Ctrl-C: whoever pressed it knows."""


class IpoptAnswer(NamedTuple):
    """What IPOPT said.

    extra: the epigraph or elastic variables; multipliers: 0 where it did not run; value: of the objective.
    """

    status: str
    x: dict[str, float]
    extra: Floats
    multipliers: Multipliers
    iterations: int
    value: float = math.inf


def run(
    calls: Calls,
    nlp: Transcription,
    sampler: Sampler,
    x: Mapping[str, float],
    extra: Floats,
    nodes: Sequence[Sequence[Extreme]],
    warm: Multipliers,
) -> IpoptAnswer:
    """Return IPOPT's answer from variables x (SI) and extra; warm: multipliers to start from, if there are any.

    Raises KeyboardInterrupt on Ctrl-C, and what the callback raises.
    """
    arguments = calls.arguments(nlp, sampler, x, extra, nodes)
    if calls.overdetermined(arguments):
        none = Multipliers(nlp.rows, np.zeros(len(arguments["x0"])), np.zeros(nlp.rows.size))
        return IpoptAnswer("Not_Enough_Degrees_Of_Freedom", dict(x), extra, none, 0)
    if warm:
        arguments |= {"lam_x0": warm.lam_x, "lam_g0": warm.grown(nlp.rows)}
    solver = nlp.solver(bool(warm), calls.settings)
    with _no_warning_on_ctrl_c():
        said = solver(**arguments)
    interrupts.check()
    stats = solver.stats()
    status = str(stats["return_status"])
    if status in STOPPED:
        raise calls.settings.callback.error() if calls.settings.callback else KeyboardInterrupt
    evaluated = sum(int(count) for name, count in stats.items() if name.startswith("n_call_nlp_"))
    sampler.session.positions += evaluated * max(1, sum(map(len, nodes)))
    flat, lam_x, lam_g = (np.asarray(said[name]).ravel() for name in ("x", "lam_x", "lam_g"))
    design, reached = nlp.rows.parted(flat)
    multipliers = Multipliers(nlp.rows, lam_x, lam_g)
    iterations, value = int(stats.get("iter_count", 0)), float(np.asarray(said["f"]).item())
    return IpoptAnswer(status, calls.design(design), reached, multipliers, iterations, value)


class _Unwarned:
    """A stream without CasADi's warning on Ctrl-C, which it writes in pieces; all else passes."""

    def __init__(self, stream: Any) -> None:
        self._stream, self._held = stream, ""

    def write(self, text: str) -> int:
        """Write a text; of a warning the whole line at its end, or nothing."""
        line = self._held + text if self._held or text.startswith(WARNING) else ""
        self._held = "" if line.endswith("\n") else line
        if self._held or ON_CTRL_C in line:
            return len(text)
        self._stream.write(line or text)
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextlib.contextmanager
def _no_warning_on_ctrl_c() -> Iterator[None]:
    """Keep CasADi from warning of Ctrl-C, which ends a solve as KeyboardInterrupt anyway."""
    stream = sys.stderr
    if stream is None:
        yield
        return
    sys.stderr = unwarned = _Unwarned(stream)
    try:
        yield
    finally:
        if sys.stderr is unwarned:
            sys.stderr = stream


class IterationCallback:
    """Reports each iteration; one CasADi callback per NLP size, kept alive with it.

    What a report raises stops IPOPT, which tells no more than that it was stopped: `error` says why.
    """

    def __init__(self, report: Callable[[int], None]) -> None:
        self.report = report
        self.raised: BaseException | None = None
        self._made: dict[tuple[int, int, int], Any] = {}

    def for_size(self, variables: int, rows: int, parameters: int) -> Any:
        """Return the CasADi callback for an NLP of this size."""
        size = (variables, rows, parameters)
        if size not in self._made:
            self._made[size] = _make(self._told, *size)
        return self._made[size]

    def error(self) -> BaseException:
        """Return what a report has raised, once; without, it was Ctrl-C."""
        found, self.raised = self.raised, None
        return found or KeyboardInterrupt()

    def _told(self, number: int) -> bool:
        """Report an iteration; say whether that has failed."""
        try:
            self.report(number)
        except BaseException as error:
            self.raised = error
            return True
        return False


def _make(report: Callable[[int], bool], variables: int, rows: int, parameters: int) -> Any:
    """Return a CasADi callback; defined here so that CasADi is imported only when one is wanted."""
    import casadi as ca

    shapes = {"x": variables, "f": 1, "g": rows, "lam_x": variables, "lam_g": rows, "lam_p": parameters}

    class Report(ca.Callback):
        def __init__(self) -> None:
            super().__init__()
            self.count = 0
            self.construct("iteration_report", {})

        def get_n_in(self) -> int:
            return int(ca.nlpsol_n_out())

        def get_n_out(self) -> int:
            return 1

        def get_name_in(self, place: int) -> str:
            return str(ca.nlpsol_out(place))

        def get_name_out(self, place: int) -> str:
            return "stop"

        def get_sparsity_in(self, place: int) -> Any:
            return ca.Sparsity.dense(shapes.get(str(ca.nlpsol_out(place)), 0), 1)

        def eval(self, arguments: Any) -> list[int]:
            self.count += 1
            return [int(report(self.count - 1))]

    return Report()
