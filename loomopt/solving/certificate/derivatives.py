"""What a certificate asks of the rows at one design: slopes in all variables, and curvatures along a few directions."""

import abc
from collections.abc import Mapping, Sequence
from typing import ClassVar

from loomopt.model.program import Program
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.cycle import Floats
from loomopt.solving.certificate.kkt import ActiveRow


class Derivatives(abc.ABC):
    """Derivatives of a program's rows at one design, in some number system; `by` is what it is called.

    x: variables, SI; all results are with respect to the variables that are not held (`names`), in their own scale.
    """

    by: ClassVar[str]
    error: ClassVar[float]
    """Of slopes and curvatures, relative to the largest derivative of a row where that exceeds 1."""
    last: ClassVar[bool] = False
    """Whether no other way judges where these leave a verdict in doubt."""

    def __init__(self, program: Program, x: Mapping[str, float], sampler: Sampler, rows: Sequence[ActiveRow]) -> None:
        self.program, self.sampler, self.rows = program, sampler, tuple(rows)
        self.names = [v.name for v in program.variables if v.name not in program.held]
        self.x = {name: x[name] for name in self.names}
        self.known = {**program.parameters, **{name: x[name] for name in program.held}, **sampler.hints}
        sizes = {v.name: v.scale for v in program.variables}
        self.sizes = [sizes[name] for name in self.names]

    @abc.abstractmethod
    def gradients(self) -> Floats:
        """Return (rows, variables): first derivatives; at an extreme, those of the extreme's value."""

    @abc.abstractmethod
    def curvatures(self, basis: Floats) -> Floats:
        """Return (rows, k, k): second derivatives along the columns of basis (variables, k).

        At an interior extreme of the cycle, g_xx − g_xφ g_φx / g_φφ: the extreme moves with the design [Hettich and
        Kortanek, Semi-infinite programming, SIAM Review 35 (1993), 380-429].
        """

    @abc.abstractmethod
    def thirds(self, line: Floats, basis: Floats) -> tuple[Floats, Floats]:
        """Return (rows, k, k), third derivatives once along a line (variables,), twice along basis (variables, k).

        And the largest error of each row's. Extremes of the cycle move along: to third order it is enough that each
        does so by its first, u_x = −g_ux / g_uu, for its value does not change with u [Wigner's 2n + 1 rule; Griewank
        and Walther, Evaluating Derivatives, 2nd ed., section 15.4].
        """

    def at_corner(self, node: Extreme) -> bool:
        """Say whether a node is the end of a piece; a cycle without corners has none."""
        return node.u in (0.0, 1.0) and bool(self.sampler.cycle.order)
