"""Non-negative least squares (Lawson and Hanson 1974), for multipliers that owe nothing to the solver.

The columns in use are held as Q and R⁻¹ of their QR factors, by Gram and Schmidt's method, each column twice [Daniel,
Gragg, Kaufman and Stewart, Math. Comp. 30 (1976), 772-795]: one more costs two products with Q, not a factorization.
"""

import numpy as np

from loomopt.cycle import Floats
from loomopt.tolerances import NNLS_EXCHANGES, NNLS_GONE, NNLS_PULL, NNLS_RANK


def nnls(matrix: Floats, target: Floats) -> Floats:
    """Return y ≥ 0 that minimises ‖matrix y − target‖; SciPy's would cost half a second of imports.

    matrix: (m, n); target: (m,). Stops after 10 n exchanges at the best point found. Raises ArithmeticError where an
    entry is no number.
    """
    if not (np.all(np.isfinite(matrix)) and np.all(np.isfinite(target))):
        raise ArithmeticError("an entry of a system to solve is no number")
    count = matrix.shape[1]
    used = _Used(matrix, target)
    answer = np.zeros(count)
    tolerance = NNLS_PULL * (1 + np.abs(matrix).sum())
    for _ in range(NNLS_EXCHANGES * count):
        pull = used.left @ matrix
        pull[used.columns] = -np.inf
        entering = int(pull.argmax())
        if pull[entering] <= tolerance or not used.add(entering):
            break
        trial = used.solution()
        if trial[entering] <= 0:
            break
        while len(used.columns) and trial[used.columns].min() <= 0:
            leaving = np.array([k for k in used.columns if trial[k] <= 0])
            step = np.min(answer[leaving] / (answer[leaving] - trial[leaving]))
            answer = answer + step * (trial - answer)
            gone = answer <= NNLS_GONE * max(1.0, float(np.abs(answer).max()))
            answer[gone] = 0
            used.keep([k for k in used.columns if not gone[k]])
            trial = used.solution()
        answer = trial
    return answer


class _Used:
    """The columns in use, in the order in which they came; left: of the target by the last solution over them."""

    def __init__(self, matrix: Floats, target: Floats) -> None:
        self.matrix, self.target, self.left = matrix, target, target
        self.columns: list[int] = []
        most = min(matrix.shape)
        self._across, self._inverse = np.zeros((len(matrix), most), order="F"), np.zeros((most, most))

    def add(self, column: int) -> bool:
        """Take a column in use; False where it depends on those that are."""
        count, new = len(self.columns), self.matrix[:, column]
        if count == self._across.shape[1]:
            return False
        across, inverse = self._across[:, :count], self._inverse[:count, :count]
        along = new @ across
        rest = new - across @ along
        more = rest @ across
        rest = rest - across @ more
        length = float(np.linalg.norm(rest))
        if length <= NNLS_RANK * float(np.linalg.norm(new)):
            return False
        self._across[:, count] = rest / length
        self._inverse[:count, count] = -(inverse @ (along + more)) / length
        self._inverse[count, count] = 1 / length
        self.columns.append(column)
        return True

    def keep(self, columns: list[int]) -> None:
        """Take other columns in use."""
        self.columns = []
        for column in columns:
            self.add(column)

    def solution(self) -> Floats:
        """Return the unconstrained solution over the columns in use, 0 elsewhere."""
        count = len(self.columns)
        across, inverse = self._across[:, :count], self._inverse[:count, :count]
        found = np.zeros(self.matrix.shape[1])
        self.left = self.target
        # The second pass takes out what rounding of R⁻¹ leaves.
        for _ in range(2):
            found[self.columns] += inverse @ (self.left @ across)
            self.left = self.target - self.matrix @ found
        return found
