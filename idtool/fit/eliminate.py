"""Taking out what the start deflections explain, stretch by stretch (variable projection).

Each filtered row belongs to one stretch, whose bristle start is one linear unknown with a Gaussian prior; so
the normal equations of the starts are diagonal, and one pass over the rows is all that it takes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from idtool.model.jit import jit
from idtool.model.motion import Array


@jit(fastmath={"reassoc"})  # sums in any order, so that they go by vector units
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
        rows = slice(pointer[s], pointer[s + 1])
        own, start, left = column[rows], start_column[rows], free[rows]
        norm, along = weight[s] * weight[s], 0.0
        for k in range(len(own)):
            norm += start[k] * start[k]
            along += start[k] * own[k]
        share[s] = along / norm
        for k in range(len(own)):
            left[k] = own[k] - start[k] * share[s]
    return share


@jit(fastmath={"reassoc"})
def filter_and_eliminate(
    columns: Array,
    data: Array,
    indices: NDArray[np.int32],
    indptr: NDArray[np.int32],
    start_column: Array,
    pointer: NDArray[np.intp],
    weight: Array,
    free: Array,
) -> Array:
    """`eliminate` of four columns at once, filtered first: into `free`, shape (4, filtered rows), and how far
    each moves each start, (4, stretches).

    Args:
        columns: at full rate, shape (4, rows).
        data, indices, indptr: the filter as a sparse matrix (CSR).
        start_column, pointer, weight: as in `eliminate`.
    """
    # indices without a sign: to ask of one whether it is negative costs six times the sum
    for k in range(np.uintp(free.shape[1])):
        c0 = c1 = c2 = c3 = 0.0
        for p in range(np.uintp(indptr[k]), np.uintp(indptr[k + np.uintp(1)])):
            w, row = data[p], np.uintp(indices[p])
            c0 += w * columns[0, row]
            c1 += w * columns[1, row]
            c2 += w * columns[2, row]
            c3 += w * columns[3, row]
        free[0, k], free[1, k], free[2, k], free[3, k] = c0, c1, c2, c3
    share = np.empty((4, len(weight)))
    for j in range(4):
        share[j] = eliminate(free[j], start_column, pointer, weight, free[j])
    return share


@jit()
def moments(left: Array, right: Array, pointer: NDArray[np.intp]) -> Array:
    """Products of the left columns with each other and with the right ones, summed over the rows of each
    stretch.

    Args:
        left, right: shapes (filtered rows, m) and (filtered rows, n), stored by rows.
        pointer: as in `eliminate`.

    Returns:
        Shape (stretches, m, m + n).
    """
    m, n = left.shape[1], right.shape[1]
    total = np.zeros((len(pointer) - 1, m, m + n))
    for s in range(len(pointer) - 1):
        for k in range(pointer[s], pointer[s + 1]):
            for i in range(m):
                for j in range(m):
                    total[s, i, j] += left[k, i] * left[k, j]
                for j in range(n):
                    total[s, i, m + j] += left[k, i] * right[k, j]
    return total
