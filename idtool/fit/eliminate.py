"""Taking out what the start deflections explain, stretch by stretch (variable projection).

Each filtered row belongs to one stretch, whose bristle start is one linear unknown with a Gaussian prior; so
the normal equations of the starts are diagonal, and one pass over the rows is all that it takes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from idtool.model.jit import jit
from idtool.model.motion import Array


@jit()
def eliminate(
    column: Array, start_column: Array, pointer: NDArray[np.intp], weight: Array, free: Array
) -> Array:
    """A column freed from what the starts explain, into `free`, and how far it moves each, (stretches,).

    Args:
        column: shape (filtered rows,).
        start_column: derivative of each row with respect to its stretch's start, shape (filtered rows,).
        pointer: first row of each stretch, and the number of rows at its end, shape (stretches + 1,).
        weight: root of the weight of each start's prior, shape (stretches,).
        free: shape (filtered rows,).
    """
    share = np.zeros(len(weight))
    for s in range(len(weight)):
        norm = weight[s] * weight[s]
        along = 0.0
        for k in range(pointer[s], pointer[s + 1]):
            norm += start_column[k] * start_column[k]
            along += start_column[k] * column[k]
        share[s] = along / norm
        for k in range(pointer[s], pointer[s + 1]):
            free[k] = column[k] - start_column[k] * share[s]
    return share


@jit()
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
