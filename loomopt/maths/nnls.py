"""Non-negative least squares (Lawson and Hanson 1974), and the least curvature over the cone that multipliers leave.

The multipliers are independent of the solver. The columns in use are stored as Q and R⁻¹ of their QR factors, by Gram
and Schmidt's method, each column twice [Daniel, Gragg, Kaufman and Stewart, Math. Comp. 30 (1976), 772-795]: one more
costs two products with Q, not a factorization.
"""

import numpy as np
from numpy.typing import NDArray

CONE_STEPS = 30
"""Projected gradient steps from each eigenvector that locate the least curvature on the critical cone. This is
a heuristic, because the problem is NP-hard: of 2800 random cones of 3 to 5 dimensions, of which under 2 % have a
negative curvature, none was missed; with one step some are (tests/maths/test_cone.py)."""

CONE_OPEN, CONE_TIP = 1e-9, 1e-9
"""Slope up to which a unit direction does not leave a limit, and length below which a projection is the cone's tip:
what non-negative least squares leaves of ROUNDING times the condition of a few dozen slopes."""

NNLS_PULL, NNLS_GONE, NNLS_RANK, NNLS_EXCHANGES = 1e-13, 1e-15, 1e-14, 10
"""Non-negative least squares: pull of a column that enters, size of one that leaves, singular value that counts, each
about a hundred roundings; exchanges allowed per column (Lawson and Hanson need about one)."""

Floats = NDArray[np.float64]


def nnls(matrix: Floats, target: Floats) -> Floats:
    """y ≥ 0 that minimises ‖matrix y − target‖; SciPy's would cost half a second of imports.

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
        """Unconstrained solution over the columns in use, 0 elsewhere."""
        count = len(self.columns)
        across, inverse = self._across[:, :count], self._inverse[:count, :count]
        x = np.zeros(self.matrix.shape[1])
        self.left = self.target
        # The second pass takes out what rounding of R⁻¹ leaves.
        for _ in range(2):
            x[self.columns] += inverse @ (self.left @ across)
            self.left = self.target - self.matrix @ x
        return x


TINY = 1e-300
"""Keeps the step of a matrix of zeros a number."""


def least_on_cone(hessian: Floats, slopes: Floats) -> float:
    """Least d'Hd over unit directions d with slopes d ≤ 0 that was found; infinite without any.

    hessian: (n, n), symmetric; slopes: (m, n). Projected gradients from the eigenvectors: a heuristic, for the
    problem is NP-hard [Murty and Kabadi, Mathematical Programming 39 (1987), 117-129]. What it returns is reached by
    a direction of the cone; that there is nothing less is not proven.
    """
    values, vectors = np.linalg.eigh(hessian)
    if not len(slopes):
        return float(values[0])
    seeds = [sign * vector for vector in vectors.T for sign in (1.0, -1.0)]
    pace, least = 1.0 / max(float(np.abs(hessian).sum(axis=0).max()), TINY), np.inf
    for seed in seeds:
        direction = onto_cone(seed, slopes)
        for _ in range(CONE_STEPS):
            if direction is None:
                break
            bend = float(direction @ hessian @ direction)
            least = min(least, bend)
            direction = onto_cone(direction - pace * (hessian @ direction - bend * direction), slopes)
    return float(least)


def onto_cone(direction: Floats, slopes: Floats) -> Floats | None:
    """Unit direction of the nearest point of the cone slopes d ≤ 0; None where that is its tip."""
    projection = direction - slopes.T @ nnls(slopes.T, direction)
    length = float(np.linalg.norm(projection))
    if length <= CONE_TIP * max(1.0, float(np.linalg.norm(direction))) or np.any(
        slopes @ projection > CONE_OPEN * length
    ):
        return None
    return np.asarray(projection / length)
