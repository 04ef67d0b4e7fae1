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


@jit(inline="always")  # so that it is summed as the loop around it may be
def _filtered(
    columns: Array, data: Array, indices: NDArray[np.int32], begin: int, end: int
) -> tuple[float, float, float, float]:
    """Of four columns, stored by rows, the filtered row whose weights lie from `begin` to `end`."""
    c0 = c1 = c2 = c3 = 0.0
    # indices without a sign: to ask of one whether it is negative costs six times the sum
    for p in range(np.uintp(begin), np.uintp(end)):
        w, row = data[p], np.uintp(indices[p])
        c0 += w * columns[row, 0]
        c1 += w * columns[row, 1]
        c2 += w * columns[row, 2]
        c3 += w * columns[row, 3]
    return c0, c1, c2, c3


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
    by_rows = columns.T
    for k in range(np.uintp(free.shape[1])):
        free[0, k], free[1, k], free[2, k], free[3, k] = _filtered(
            by_rows, data, indices, indptr[k], indptr[k + np.uintp(1)]
        )
    share = np.empty((4, len(weight)))
    for j in range(4):
        one = eliminate(free[j], start_column, pointer, weight, free[j])
        for s in range(len(weight)):  # a whole row at once takes three seconds more to compile
            share[j, s] = one[s]
    return share


@jit()
def filtered_moments(
    columns: Array,
    data: Array,
    indices: NDArray[np.int32],
    indptr: NDArray[np.int32],
    right: Array,
    pointer: NDArray[np.intp],
) -> Array:
    """Products of four columns, filtered, with each other and with others, summed over the rows of each
    stretch.

    Args:
        columns: at full rate, stored by rows, shape (rows, 4).
        data, indices, indptr: the filter as a sparse matrix (CSR).
        right: filtered already, stored by rows, shape (filtered rows, n).
        pointer: as in `eliminate`.

    Returns:
        Shape (stretches, 4, 4 + n).
    """
    n = right.shape[1]
    total = np.zeros((len(pointer) - 1, 4, 4 + n))
    both = np.empty(4 + n)
    for s in range(len(pointer) - 1):
        products = total[s]
        for k in range(np.uintp(pointer[s]), np.uintp(pointer[s + 1])):
            four = _filtered(columns, data, indices, indptr[k], indptr[k + np.uintp(1)])
            both[0], both[1], both[2], both[3] = four
            for j in range(n):
                both[4 + j] = right[k, j]
            for j in range(4 + n):
                products[0, j] += four[0] * both[j]
                products[1, j] += four[1] * both[j]
                products[2, j] += four[2] * both[j]
                products[3, j] += four[3] * both[j]
    return total
