"""Taking out what the start deflections explain, stretch by stretch (variable projection).

Each filtered row belongs to one stretch, whose bristle start is one linear unknown with a Gaussian prior; so
the normal equations of the starts are diagonal, and one pass over the rows is all that it takes.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from idtool.model.motion import Array


@numba.njit(cache=True)
def eliminate(
    columns: Array, start_column: Array, pointer: NDArray[np.intp], weight: Array
) -> tuple[Array, Array]:
    """Columns freed from what the starts explain, and how far each moves them.

    Args:
        columns: shape (filtered rows, n), stored by rows.
        start_column: derivative of each row with respect to its stretch's start, shape (filtered rows,).
        pointer: first row of each stretch, and the number of rows at its end, shape (stretches + 1,).
        weight: root of the weight of each start's prior, shape (stretches,).

    Returns:
        Shapes (filtered rows, n) and (stretches, n).
    """
    rows, n = columns.shape
    stretches = len(weight)
    free = np.empty((rows, n))
    share = np.zeros((stretches, n))
    for s in range(stretches):
        norm = weight[s] * weight[s]
        for k in range(pointer[s], pointer[s + 1]):
            norm += start_column[k] * start_column[k]
            for j in range(n):
                share[s, j] += start_column[k] * columns[k, j]
        for j in range(n):
            share[s, j] /= norm
        for k in range(pointer[s], pointer[s + 1]):
            for j in range(n):
                free[k, j] = columns[k, j] - start_column[k] * share[s, j]
    return free, share


@numba.njit(cache=True)
def moments(left: Array, right: Array, pointer: NDArray[np.intp]) -> Array:
    """Products of columns summed over the rows of each stretch.

    Args:
        left, right: shapes (filtered rows, m) and (filtered rows, n), stored by rows.
        pointer: as in `eliminate`.

    Returns:
        Shape (stretches, m, n).
    """
    m, n = left.shape[1], right.shape[1]
    total = np.zeros((len(pointer) - 1, m, n))
    for s in range(len(pointer) - 1):
        for k in range(pointer[s], pointer[s + 1]):
            for i in range(m):
                for j in range(n):
                    total[s, i, j] += left[k, i] * right[k, j]
    return total
