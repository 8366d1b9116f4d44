"""How much there is to compute: the size of a program's expression graph."""

from collections.abc import Mapping

from loomopt.model.program import Program
from loomopt.nlp.expressions import expressions
from loomopt.nlp.point import sampler_at
from loomopt.nlp.structure import structure


def nodes(program: Program, x: Mapping[str, float]) -> int | None:
    """Return how many nodes objectives and rows are made of, a whole-cycle row at one crank angle.

    x: variables, SI, at which the cycle has the pieces that are meant; None where the mechanism does not assemble.
    """
    import casadi as ca

    sampler = sampler_at(program, x)
    if sampler is None:
        return None
    made = expressions(structure(program, sampler, 1))
    return int(ca.n_nodes(ca.vertcat(made.f, made.g)))
