"""A CasADi callback that reports IPOPT's iterations."""

from collections.abc import Callable
from typing import Any


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
