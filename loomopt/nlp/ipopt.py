"""How IPOPT is asked to work, and one run of it [Wächter and Biegler, Mathematical Programming 106 (2006)]."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from loomopt.model.sampling import Extreme, Sampler, Tally
from loomopt.nlp.calls import Calls
from loomopt.nlp.transcribe import Transcription
from loomopt.physics.cycle import Floats

STOPPED = frozenset({"NonIpopt_Exception_Thrown", "User_Requested_Stop"})
"""What IPOPT says when its callback raised, or asked it to stop."""


class Answer(NamedTuple):
    """What IPOPT said.

    extra: the epigraph or elastic variables; raw: its multipliers and `extra` again, nothing where it did not run;
    value: of the objective.
    """

    status: str
    x: dict[str, float]
    extra: Floats
    raw: Mapping[str, Floats]
    iterations: int
    value: float = math.inf


def run(
    calls: Calls,
    nlp: Transcription,
    sampler: Sampler,
    x: Mapping[str, float],
    extra: Floats,
    nodes: Sequence[Sequence[Extreme]],
    raw: Mapping[str, Floats],
) -> Answer:
    """Return IPOPT's answer from variables x (SI) and extra; raw: multipliers to start warm from, if any.

    Raises KeyboardInterrupt on Ctrl-C.
    """
    arguments = calls.arguments(nlp, sampler, x, extra, nodes)
    if calls.overdetermined(arguments):
        return Answer("Not_Enough_Degrees_Of_Freedom", dict(x), extra, {}, 0)
    if raw:
        arguments |= {"lam_x0": raw["lam_x"], "lam_g0": _padded(raw["lam_g"], nlp.rows)}
    solver = nlp.solver(bool(raw), calls.settings)
    said = solver(**arguments)
    stats = solver.stats()
    status = str(stats["return_status"])
    if status in STOPPED:
        raise KeyboardInterrupt
    evaluated = sum(int(count) for name, count in stats.items() if name.startswith("n_call_nlp_"))
    Tally.positions += evaluated * max(1, sum(map(len, nodes)))
    flat, lam_x, lam_g = (np.asarray(said[name]).ravel() for name in ("x", "lam_x", "lam_g"))
    reached = flat[len(calls.program.variables) :]
    said_raw = {"lam_x": lam_x, "lam_g": lam_g, "extra": reached}
    iterations, value = int(stats.get("iter_count", 0)), float(np.asarray(said["f"]).item())
    return Answer(status, calls.design(flat), reached, said_raw, iterations, value)


def _padded(multipliers: Floats, size: int) -> Floats:
    """Return multipliers for an NLP that has grown by empty rows at its end."""
    padded = np.zeros(size)
    common = min(size, len(multipliers))
    padded[:common] = multipliers[:common]
    return padded
