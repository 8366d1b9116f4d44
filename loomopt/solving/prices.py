"""What a limit costs: its multiplier in the units a designer reads."""

from loomopt.program.program import Limit, Objective
from loomopt.program.sampling import Sampler
from loomopt.solving.verdict import Binding


def priced(sampler: Sampler, limit: Limit, objective: Objective, multiplier: float) -> Binding:
    """Return a binding limit with its multiplier in SI units of objective per limit."""
    weight = sampler.single(limit.weight) if limit.weight else 1.0
    worth = abs(multiplier) * objective.scale / limit.scale * weight
    if objective.power != 1:
        figure = sampler.single(objective.figure)
        worth /= abs(objective.power * figure ** (objective.power - 1))
    side = limit.sign or (1 if multiplier > 0 else -1)
    return Binding(limit, side, objective, worth)
