"""The linear-quadratic problem of a finite sequence of maps, by Riccati's recursion."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def solve(
    A: Sequence[Array], B: Sequence[Array], Q: Array, R: Array, end: Array, slope: Array
) -> tuple[list[Array], list[Array]]:
    """Minimise half of the sum of x'Q x + u'R u and of the cost of the last state.

    Parameters
    ----------
    A, B
        The k maps x -> A x + B u (s, s), (s, m).
    Q, R
        Weights (s, s), (m, m).
    end, slope
        Second and first derivative of the cost of the last state (s, s), (s,).

    Returns
    -------
    K, k
        The solution is u = -K x - k, for each map (m, s), (m,).
    """
    P, p = end, slope
    K: list[Array] = []
    k: list[Array] = []
    for a, b in zip(reversed(A), reversed(B), strict=True):
        size = R + b.T @ P @ b
        K.append(np.asarray(np.linalg.solve(size, b.T @ P @ a)))
        k.append(np.asarray(np.linalg.solve(size, b.T @ p)))
        closed = a - b @ K[-1]
        p = closed.T @ p
        P = Q + a.T @ P @ closed
        P = 0.5 * (P + P.T)
    return K[::-1], k[::-1]
