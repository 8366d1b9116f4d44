"""How IPOPT is asked to work, and one run of it [Wächter and Biegler, Mathematical Programming 106 (2006)]."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.cycle import Floats
from loomopt.solving.nlp.calls import Calls
from loomopt.solving.nlp.rows import Multipliers
from loomopt.solving.nlp.transcribe import Transcription

STOPPED = frozenset({"NonIpopt_Exception_Thrown", "User_Requested_Stop"})
"""What IPOPT says when its callback raised, or asked it to stop."""


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

    Raises KeyboardInterrupt on Ctrl-C.
    """
    arguments = calls.arguments(nlp, sampler, x, extra, nodes)
    if calls.overdetermined(arguments):
        none = Multipliers(nlp.rows, np.zeros(len(arguments["x0"])), np.zeros(nlp.rows.size))
        return IpoptAnswer("Not_Enough_Degrees_Of_Freedom", dict(x), extra, none, 0)
    if warm:
        arguments |= {"lam_x0": warm.lam_x, "lam_g0": warm.grown(nlp.rows)}
    solver = nlp.solver(bool(warm), calls.settings)
    said = solver(**arguments)
    stats = solver.stats()
    status = str(stats["return_status"])
    if status in STOPPED:
        raise KeyboardInterrupt
    evaluated = sum(int(count) for name, count in stats.items() if name.startswith("n_call_nlp_"))
    sampler.session.positions += evaluated * max(1, sum(map(len, nodes)))
    flat, lam_x, lam_g = (np.asarray(said[name]).ravel() for name in ("x", "lam_x", "lam_g"))
    design, reached = nlp.rows.parted(flat)
    multipliers = Multipliers(nlp.rows, lam_x, lam_g)
    iterations, value = int(stats.get("iter_count", 0)), float(np.asarray(said["f"]).item())
    return IpoptAnswer(status, calls.design(design), reached, multipliers, iterations, value)


class IterationCallback:
    """Reports each iteration; one CasADi callback per NLP size, kept alive with it."""

    def __init__(self, report: Callable[[int], None]) -> None:
        self.report = report
        self._made: dict[tuple[int, int, int], Any] = {}

    def for_size(self, variables: int, rows: int, parameters: int) -> Any:
        """Return the CasADi callback for an NLP of this size."""
        size = (variables, rows, parameters)
        if size not in self._made:
            self._made[size] = _make(self.report, *size)
        return self._made[size]


def _make(report: Callable[[int], None], variables: int, rows: int, parameters: int) -> Any:
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
            report(self.count)
            self.count += 1
            return [0]

    return Report()
