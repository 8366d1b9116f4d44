"""By how much a design exceeds its limits."""

from loomopt.program.program import Program
from loomopt.program.sampling import Sampler


def excesses(program: Program, sampler: Sampler) -> dict[int, float]:
    """Return how far each limit is exceeded, in its natural size (an equality: how far it is missed)."""
    static = {**sampler.given.values, **sampler.figures}
    found = {}
    for k, limit in enumerate(program.limits):
        if limit.family == "cycle":
            found[k] = (sampler.peak(limit.row, limit.where) - limit.bound) / limit.scale
        else:
            values = sampler.given.values if limit.family == "variable" else static
            residual = limit.residual(values, limit.value) / limit.scale
            found[k] = abs(residual) if limit.sign == 0 else residual
    return found
