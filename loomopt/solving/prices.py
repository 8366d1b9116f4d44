"""What a limit costs: its multiplier in the units a designer reads, and the figure that it is told of."""

from dataclasses import replace

from loomopt.model.program import Limit, Objective
from loomopt.model.sampling import Sampler
from loomopt.solving.verdict import Binding


def figure_of(sampler: Sampler, objective: Objective) -> float:
    """Return the figure of an objective, SI: with its sign where it is a number of its own."""
    if objective.form != "peak" and objective.figure in sampler.figures:
        return sampler.figures[objective.figure]
    return float(sampler.merit(objective) ** (1 / objective.power))


def priced(sampler: Sampler, limit: Limit, objective: Objective, multiplier: float) -> Binding:
    """Return a binding limit with its multiplier in SI units of objective per limit.

    A number that is kept, and would rather be on the other side of its limit, is told as a limit of that side.
    """
    limit = replace(limit, sign=-limit.sign) if multiplier < 0.0 else limit
    weight = sampler.single(limit.weight) if limit.weight else 1.0
    worth = abs(multiplier) * objective.scale / limit.scale * weight
    if objective.power != 1:
        # The row is a power of the figure: its slope with respect to the figure.
        worth /= abs(objective.power * figure_of(sampler, objective) ** (objective.power - 1))
    side = limit.sign or (1 if multiplier > 0 else -1)
    return Binding(limit, side, objective, worth)
