"""Arguments of IPOPT for a program, and one run of it [Wächter and Biegler, Mathematical Programming 106 (2006)]."""

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
from loomopt.solving.nlp.rows import (
    CycleStations,
    Multipliers,
    RowFamily,
    chain_names,
    epigraphs,
    families,
    station_places,
    stations,
)
from loomopt.solving.nlp.transcribe import Transcription, transcribe

FIRST_SLOTS, LEADING = 6, 4
"""Nodes that a built NLP has room for (doubled when they are used up), and those of a start: its largest extremes.

The experiment: two of them take IPOPT a third more iterations; eight, or room for twelve, end one target's first start
in another local optimum. Room for three and two of a start take a rapier drive 0.86 of the time, and end one point of
a front of ten in an optimum that is 1.8 % worse.
"""

SLOTS_WITH_STATIONS = 2, 1
"""Both numbers if there are rows at corners from the first solve on. None of 28 free cam laws of 16 and 64 intervals,
with every effect, ends with a node other than its knots, and each node with room adds a twentieth to the time of
building."""

FIRST_SHARE, FIRST_ROOM = 1.01, 0.01
"""Factor and room by which a first epigraph variable is above its rows: inside, so that IPOPT need not move it."""

ELASTIC_SHARE = 1e-3
"""Share of a positive lower bound below which no relaxation goes: lengths stay positive."""


class Calls:
    """Calls of a program's NLP; the time of building NLPs is added to `built`.

    slots: nodes of each family in the first NLP; leading: nodes of each family at a start.
    """

    def __init__(
        self, program: Program, settings: Settings, elastic: Elastic | None = None, known: Known | None = None
    ) -> None:
        self.program, self.settings, self.elastic, self.known = program, settings, elastic, known or Known()
        self.is_elastic = elastic is not None
        self.families, self.epigraphs = families(program, self.is_elastic), epigraphs(program, self.is_elastic)
        names = [variable.name for variable in program.variables]
        self.slots, self.leading = SLOTS_WITH_STATIONS if chain_names(program.model, names) else (FIRST_SLOTS, LEADING)
        count = len(program.objectives)
        self.weights = [settings.penalty ** (count - 1 - k) for k in range(count)]
        self.build_seconds = 0.0

    def sampler(self, x: Mapping[str, float]) -> Sampler | None:
        """Sampler of variables x (SI), or None where the linkage has no real position."""
        return sampler_at(self.program, x, self.settings.sample_count)

    def peaks(self, sampler: Sampler) -> list[list[Extreme]]:
        """Local extremes of each family's quantity, largest first."""
        sampler.search(family.row for family in self.families)
        return [sampler.extremes(family.row, family.where) for family in self.families]

    def nodeless_extremes(self, sampler: Sampler, extremes: Sequence[Sequence[Extreme]]) -> list[list[Extreme]]:
        """Extremes of each family that no station has a row for: these need a node."""
        corners = stations(self.program.model, sampler.given, [v.name for v in self.program.variables])
        cycle_stations = CycleStations(corners, sampler.cycle)
        rows = [set(station_places([corner.switch for corner in corners], family)) for family in self.families]
        pairs = zip(rows, extremes, strict=True)
        return [
            [e for e in family_extremes if cycle_stations.station(e) not in row_places]
            for row_places, family_extremes in pairs
        ]

    def nlp(self, sampler: Sampler, nodes: Sequence[Sequence[Extreme]], warm: bool) -> Transcription:
        """NLP with room for the nodes of each family, with its solver; counts the time of building."""
        slots = self.slots
        while any(len(family_nodes) > slots for family_nodes in nodes):
            slots *= 2
        began = time.perf_counter()
        building = functools.partial(self.settings.say, "building the equations")
        nlp, is_new = transcribe(self.program, sampler, slots, self.is_elastic, building)
        nlp.solver(warm, self.settings)
        if is_new:
            self.settings.say()
        self.build_seconds += time.perf_counter() - began if is_new else 0.0
        return nlp

    def arguments(
        self,
        nlp: Transcription,
        sampler: Sampler,
        x: Mapping[str, float],
        extra: Floats,
        nodes: Sequence[Sequence[Extreme]],
    ) -> dict[str, Any]:
        """Arguments of the NLP: start, parameters and bounds, all scaled."""
        rows, (lower, upper) = nlp.rows, self._bounds()
        scaled = np.array([x[v.name] / v.scale for v in self.program.variables])
        lbg, ubg = np.full(rows.size, -np.inf), np.zeros(rows.size)
        rows.limit_rows(lbg)[[self.program.limits[k].sign == 0 for k in rows.limits]] = 0.0
        rows.node_rows(ubg)[~rows.used_slots(list(map(len, nodes)))] = 1.0
        return {
            "x0": rows.join(np.clip(scaled, lower, upper), extra),
            "p": nlp.structure.vector(self.program, sampler, self.weights, nodes, self._costs(nlp)),
            "lbx": rows.join(lower, np.full(len(extra), 0.0 if self.is_elastic else -np.inf)),
            "ubx": rows.join(upper, self._most(nlp)),
            "lbg": lbg,
            "ubg": ubg,
        }

    def _bounds(self) -> tuple[Floats, Floats]:
        """Bounds of the variables, scaled; relaxable bounds are infinite, but positive variables stay positive."""
        variables = self.program.variables
        lower = np.array([v.lower / v.scale for v in variables])
        upper = np.array([v.upper / v.scale for v in variables])
        if not self.is_elastic:
            return lower, upper
        sides = [(limit.row, limit.sign) for limit in self.program.bound_limits.values()]
        down, up = ({name for name, sign in sides if sign in (side, 0)} for side in (-1, 1))
        least = np.where(lower >= 0.0, ELASTIC_SHARE * lower, -np.inf)
        return (
            np.where([v.name in down for v in variables], least, lower),
            np.where([v.name in up for v in variables], np.inf, upper),
        )

    def _excess_costs(self, nlp: Transcription) -> Floats:
        """Cost of each excess, infinite where a limit is firm; empty for a program that is not elastic."""
        if self.elastic is None:
            return np.zeros(0)
        return np.array(self.elastic.costs or np.ones(nlp.rows.extras))

    def _costs(self, nlp: Transcription) -> Floats:
        costs = self._excess_costs(nlp)
        return np.where(np.isinf(costs), 0.0, costs)

    def _most(self, nlp: Transcription) -> Floats:
        """Upper bounds of the epigraph variables or excesses; 0 for an excess of a firm limit."""
        if self.elastic is None:
            return np.full(nlp.rows.extras, np.inf)
        return np.where(np.isinf(self._excess_costs(nlp)), 0.0, np.inf)

    def is_overdetermined(self, arguments: Mapping[str, Any]) -> bool:
        """Whether there are more equalities than free variables."""
        return bool(np.sum(arguments["lbg"] == 0.0) > np.sum(arguments["lbx"] < arguments["ubx"]))

    def design(self, scaled: Floats) -> dict[str, float]:
        """Variables of the design, SI, from those of the NLP."""
        x = {v.name: float(value * v.scale) for v, value in zip(self.program.variables, scaled, strict=True)}
        if self.is_elastic:
            return x
        return {v.name: min(max(x[v.name], v.lower), v.upper) for v in self.program.variables}

    def first_extra(self, nlp: Transcription, sampler: Sampler) -> Floats:
        """Epigraph variables just above the values at the start; ones for an elastic start."""
        if self.elastic:
            elastic_start = self.elastic.start
            return elastic_start.extra if elastic_start else np.ones(nlp.rows.extras)
        first = self.levels(sampler)
        share = np.where(first < 0.0, 1 / FIRST_SHARE, FIRST_SHARE)
        return np.asarray(share * first + FIRST_ROOM)

    def levels(self, sampler: Sampler) -> Floats:
        """Least admissible values of the epigraph variables, over the whole cycle."""
        objectives = [self.program.objectives[epigraph.objective] for epigraph in self.epigraphs]
        return np.array([objective.merit(sampler) / objective.scale for objective in objectives])

    def excess(self, family: RowFamily, extreme: Extreme, extra: Floats) -> float:
        """Excess of an extreme over its bound, relative to the row's scale."""
        if family.epigraph >= 0:
            scale = self.program.objectives[self.epigraphs[family.epigraph].objective].scale
            return float(extreme.height / scale - extra[family.epigraph])
        limit, ways = self.program.limits[family.limit], self.program.excess_places
        bound = limit.bound / limit.scale
        bound += extra[ways[family.limit][0]] if self.is_elastic and family.limit in ways else 0.0
        return float(extreme.height / limit.scale - bound)

    def objective(self, point: Point) -> float:
        """The NLP's objective at a point that has epigraph variables."""
        return math.fsum(w * h for w, h in zip(self.weights, self._heights(point.x, point.extra), strict=True))

    def is_worse(self, answer: "IpoptAnswer", start: Sampler) -> bool:
        """Whether a solve failed, or ended at a worse point than its start."""
        if answer.status not in SUCCESS:
            return True
        levels = zip(self.weights, self.program.objectives, strict=True)
        return (
            answer.value
            > math.fsum(weight * objective.merit(start) / objective.scale for weight, objective in levels)
            + SAME_OBJECTIVE
        )

    def is_beaten(self, answer: "IpoptAnswer") -> bool:
        """Whether a solve at some nodes is already no better than the best known."""
        if self.elastic is not None:
            costs = np.array(self.elastic.costs or np.ones(len(answer.extra)))
            return float(np.sum(answer.extra[costs == 1.0])) > self.known.cutoff
        return answer.value > self.known.cutoff and not self._falls_earlier(answer)

    def _falls_earlier(self, answer: "IpoptAnswer") -> bool:
        """Whether an objective before the last is lower than the best known, and those before it are equal."""
        if len(self.known.levels) < 2:
            return False
        for height, known_height in zip(self._heights(answer.x, answer.extra), self.known.levels[:-1], strict=False):
            if abs(height - known_height) > SAME_OBJECTIVE:
                return bool(height < known_height)
        return False

    def _heights(self, x: Mapping[str, float], extra: Floats) -> Iterator[float]:
        """Yield the objectives of the NLP in their scales, an epigraph variable for a peak.

        Yields nothing where the linkage has no real position.
        """
        heights = {epigraph.objective: float(extra[k]) for k, epigraph in enumerate(self.epigraphs)}
        sampler = self.sampler(x)
        if sampler is None:
            return
        for k, objective in enumerate(self.program.objectives):
            yield heights[k] if k in heights else objective.merit(sampler) / objective.scale

    def first_nodes(self, loose: Sequence[Sequence[Extreme]]) -> tuple[tuple[Extreme, ...], ...]:
        """Nodes of a start: its largest extremes."""
        return tuple(tuple(family_extremes[: self.leading]) for family_extremes in loose)

    def with_known(self, nodes: Sequence[Sequence[Extreme]]) -> tuple[tuple[Extreme, ...], ...]:
        """Nodes, then the nodes known to bind, up to the number of nodes."""
        if not self.known.nodes:
            return tuple(map(tuple, nodes))
        room = [max(self.slots, len(family_nodes)) for family_nodes in nodes]
        return tuple(
            (*family_nodes, *known_nodes)[:slots]
            for family_nodes, known_nodes, slots in zip(nodes, self.known.nodes, room, strict=True)
        )

    def violation(self, peaks: Sequence[Sequence[Extreme]], extra: Floats) -> float:
        """Largest excess of an extreme, relative to its row's scale; 0 without extremes."""
        pairs = zip(self.families, peaks, strict=True)
        return max(
            (self.excess(family, e, extra) for family, family_extremes in pairs for e in family_extremes), default=0.0
        )


STOPPED = frozenset({"NonIpopt_Exception_Thrown", "User_Requested_Stop"})
"""Statuses of IPOPT after its callback raised an error or requested a stop."""
WARNING, ON_CTRL_C = "CasADi - ", "KeyboardInterruptException"
"""Prefix of CasADi's warnings, and the warning on Ctrl-C, which is not news to the user."""


class IpoptAnswer(NamedTuple):
    """Result of an IPOPT run.

    extra: the epigraph or elastic variables; multipliers: 0 if IPOPT did not run; value: of the objective.
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
    """Run IPOPT from variables x (SI) and extra; warm: multipliers for a warm start, may be empty.

    Raises KeyboardInterrupt on Ctrl-C, and what the callback raises.
    """
    arguments = calls.arguments(nlp, sampler, x, extra, nodes)
    if calls.is_overdetermined(arguments):
        zero_multipliers = Multipliers(nlp.rows, np.zeros(len(arguments["x0"])), np.zeros(nlp.rows.size))
        return IpoptAnswer("Not_Enough_Degrees_Of_Freedom", dict(x), extra, zero_multipliers, 0)
    if warm:
        arguments |= {"lam_x0": warm.lam_x, "lam_g0": warm.extend(nlp.rows)}
    solver = nlp.solver(bool(warm), calls.settings)
    with _no_warning_on_ctrl_c():
        outputs = solver(**arguments)
    interrupts.check()
    stats = solver.stats()
    status = str(stats["return_status"])
    if status in STOPPED:
        raise calls.settings.callback.error() if calls.settings.callback else KeyboardInterrupt
    evaluations = sum(int(count) for name, count in stats.items() if name.startswith("n_call_nlp_"))
    sampler.session.positions += evaluations * max(1, sum(map(len, nodes)))
    flat, lam_x, lam_g = (np.asarray(outputs[name]).ravel() for name in ("x", "lam_x", "lam_g"))
    design, end_extra = nlp.rows.split(flat)
    multipliers = Multipliers(nlp.rows, lam_x, lam_g)
    iterations, value = int(stats.get("iter_count", 0)), float(np.asarray(outputs["f"]).item())
    return IpoptAnswer(status, calls.design(design), end_extra, multipliers, iterations, value)


class _Unwarned:
    """A stream without CasADi's warning on Ctrl-C, which arrives in pieces; all other text passes."""

    def __init__(self, stream: Any) -> None:
        self._stream, self._pending = stream, ""

    def write(self, text: str) -> int:
        """Write a text; a warning is written as a whole line or not at all."""
        line = self._pending + text if self._pending or text.startswith(WARNING) else ""
        self._pending = "" if line.endswith("\n") else line
        if self._pending or ON_CTRL_C in line:
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
    """Callback of each iteration; one CasADi callback per NLP size, which lives as long as this object.

    An error that a report raises stops IPOPT; `error` returns it.
    """

    def __init__(self, report: Callable[[int], None]) -> None:
        self.report = report
        self.raised: BaseException | None = None
        self._made: dict[tuple[int, int, int], Any] = {}

    def for_size(self, variables: int, rows: int, parameters: int) -> Any:
        """CasADi callback for an NLP of this size."""
        size = (variables, rows, parameters)
        if size not in self._made:
            self._made[size] = _make(self._report, *size)
        return self._made[size]

    def error(self) -> BaseException:
        """The error that a report has raised, once; KeyboardInterrupt without one."""
        error, self.raised = self.raised, None
        return error or KeyboardInterrupt()

    def _report(self, number: int) -> bool:
        """Report an iteration; True if the report raised an error."""
        try:
            self.report(number)
        except BaseException as error:
            self.raised = error
            return True
        return False


def _make(report: Callable[[int], bool], variables: int, rows: int, parameters: int) -> Any:
    """A CasADi callback; defined here so that CasADi is imported only when a callback is needed."""
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
