"""What a certificate asks of the rows at one design: slopes in all variables, and curvatures along a few directions."""

import abc
from collections.abc import Mapping, Sequence
from typing import ClassVar

from loomopt.cycle import Floats
from loomopt.program.program import Program
from loomopt.program.sampling import Extreme, Sampler
from loomopt.solving.rows import Row


class Derivatives(abc.ABC):
    """Derivatives of a program's rows at one design, in some number system; `by` is what it is called.

    x: variables, SI; all results are with respect to the variables that are not held (`names`), in their own scale.
    """

    by: ClassVar[str]

    def __init__(self, program: Program, x: Mapping[str, float], sampler: Sampler, rows: Sequence[Row]) -> None:
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

    def at_corner(self, node: Extreme) -> bool:
        """Say whether a node is the end of a piece; a cycle without corners has none."""
        return node.u in (0.0, 1.0) and bool(self.sampler.cycle.order)
