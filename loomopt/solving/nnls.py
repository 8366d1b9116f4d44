"""Non-negative least squares (Lawson and Hanson 1974), for multipliers that owe nothing to the solver."""

import numpy as np

from loomopt.cycle import Floats
from loomopt.tolerances import NNLS_EXCHANGES, NNLS_GONE, NNLS_PULL, NNLS_RANK


def nnls(matrix: Floats, target: Floats) -> Floats:
    """Return y ≥ 0 that minimises ‖matrix y − target‖; SciPy's would cost half a second of imports.

    matrix: (m, n); target: (m,). Raises nothing; stops after 10 n exchanges at the best point found.
    """
    count = matrix.shape[1]
    chosen = np.zeros(count, dtype=bool)
    answer = np.zeros(count)
    tolerance = NNLS_PULL * (1 + np.abs(matrix).sum())
    for _ in range(NNLS_EXCHANGES * count):
        pull = np.where(chosen, -np.inf, matrix.T @ (target - matrix @ answer))
        if chosen.all() or pull.max(initial=-np.inf) <= tolerance:
            break
        entering = int(pull.argmax())
        chosen[entering] = True
        trial = _least_squares(matrix, target, chosen)
        if trial[entering] <= 0:
            chosen[entering] = False
            break
        while chosen.any() and trial[chosen].min() <= 0:
            leaving = chosen & (trial <= 0)
            step = np.min(answer[leaving] / (answer[leaving] - trial[leaving]))
            answer = answer + step * (trial - answer)
            chosen &= answer > NNLS_GONE * max(1.0, float(np.abs(answer).max()))
            answer[~chosen] = 0
            trial = _least_squares(matrix, target, chosen)
        answer = trial
    return answer


def _least_squares(matrix: Floats, target: Floats, chosen: np.ndarray) -> Floats:
    """Return the unconstrained solution over the chosen columns, 0 elsewhere."""
    result = np.zeros(matrix.shape[1])
    if chosen.any():
        result[chosen] = np.linalg.lstsq(matrix[:, chosen], target, rcond=NNLS_RANK)[0]
    return result
