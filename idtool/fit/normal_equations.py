"""Linear unknowns of a search, from products of columns alone: some not below zero, starts taken out.

Compiled, because a search asks hundreds of times for some ten unknowns, where a call of LAPACK costs more
than what it computes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from idtool.model.jit import jit
from idtool.model.motion import Array

#: What is linear and how the start deflections pass through sigma1 are found in turn, until that keeps
#: within this share.
_PASSES, _SAME = 20, 1e-3
#: A column of which less than this share of the square is its own is explained by the others.
_NOTHING = 1e-12


@jit()
def in_turn(
    products: Array,
    mixed: Array,
    own: Array,
    weight: Array,
    friction: int,
    damping: int,
    held: float,
    least: float,
) -> tuple[float, Array]:
    """Least squares over the linear unknowns and the starts, which pass through sigma1 too.

    Args:
        products: of the target and the columns with each other over all rows, the target first, shape
            (1 + n, 1 + n).
        mixed: of each stretch's start columns (through sigma0, and through sigma1 where that is fitted) with
            target and columns, shape (stretches, 1 or 2, 1 + n).
        own: of these start columns with each other, shape (stretches, 1 or 2, 1 or 2).
        weight: root of the weight of each start's prior, shape (stretches,).
        friction: how many unknowns are friction, which is not below zero; they come first.
        damping: which unknown is sigma1; -1 for none.
        held: friction level that is held; NaN where it is the first unknown.
        least: least friction level.

    Returns:
        Sum of squares, and the unknowns, shape (n,).
    """
    size = products.shape[0]
    solution = np.zeros(size - 1)
    left, start = np.empty((size, size)), np.empty(size)
    cost, through = 0.0, 0.0  # sigma1 over the level
    for _ in range(_PASSES):
        for a in range(size):
            for b in range(size):
                left[a, b] = products[a, b]
        for s in range(len(weight)):
            norm = weight[s] * weight[s] + own[s, 0, 0]
            for a in range(size):
                start[a] = mixed[s, 0, a]
            if damping >= 0:
                norm += through * (through * own[s, 1, 1] - 2.0 * own[s, 0, 1])
                for a in range(size):
                    start[a] -= through * mixed[s, 1, a]
            for a in range(size):
                for b in range(size):
                    left[a, b] -= start[a] * start[b] / norm
        cost = not_negative(left, friction, solution)
        level = held if held == held else max(solution[0], least)
        before = through
        through = solution[damping] / level if damping >= 0 else 0.0
        if abs(through - before) <= _SAME * through:
            break
    return cost, solution


@jit()
def not_negative(products: Array, count: int, solution: Array) -> float:
    """Least squares whose first `count` unknowns are not below zero; the sum of squares that is left.

    One that would be below zero is held at zero and the others are solved anew. One that the others explain
    is left at zero.

    Args:
        products: of the target and the columns with each other, the target first, shape (1 + n, 1 + n).
        count: how many.
        solution: is overwritten, shape (n,).
    """
    n = products.shape[0] - 1
    kept = np.empty(n, np.bool_)
    for i in range(n):
        kept[i] = products[i + 1, i + 1] > 0.0
    for _ in range(count + 1):
        _solve(products, kept, solution)
        below = False
        for i in range(count):
            if solution[i] < 0.0:
                kept[i] = False
                below = True
        if not below:
            break
    cost: float = products[0, 0]
    for i in range(n):
        cost -= 2.0 * products[i + 1, 0] * solution[i]
        for j in range(n):
            cost += solution[i] * products[i + 1, j + 1] * solution[j]
    rounding: float = 1e-15 * products[0, 0]
    return cost if cost > rounding else rounding


@jit()
def _solve(products: Array, kept: NDArray[np.bool_], solution: Array) -> None:
    """Cholesky with the largest pivot first (Golub & Van Loan 2013, 4.2.8), the columns scaled."""
    n = len(solution)
    order, scale = np.empty(n, np.int64), np.empty(n)
    size = 0
    for i in range(n):
        solution[i] = 0.0
        if kept[i]:
            order[size] = i
            scale[size] = products[i + 1, i + 1] ** 0.5
            size += 1
    matrix, right = np.empty((size, size)), np.empty(size)
    for a in range(size):
        right[a] = products[order[a] + 1, 0] / scale[a]
        for b in range(size):
            matrix[a, b] = products[order[a] + 1, order[b] + 1] / (scale[a] * scale[b])
    rank = 0
    while rank < size:
        best = rank
        for a in range(rank + 1, size):
            if matrix[a, a] > matrix[best, best]:
                best = a
        if not matrix[best, best] > _NOTHING:
            break
        if best != rank:
            order[rank], order[best] = order[best], order[rank]
            scale[rank], scale[best] = scale[best], scale[rank]
            right[rank], right[best] = right[best], right[rank]
            for b in range(size):
                matrix[rank, b], matrix[best, b] = matrix[best, b], matrix[rank, b]
            for a in range(size):
                matrix[a, rank], matrix[a, best] = matrix[a, best], matrix[a, rank]
        root = matrix[rank, rank] ** 0.5
        matrix[rank, rank] = root
        right[rank] /= root
        for a in range(rank + 1, size):
            matrix[a, rank] /= root
        for a in range(rank + 1, size):
            right[a] -= matrix[a, rank] * right[rank]
            for b in range(rank + 1, size):
                matrix[a, b] -= matrix[a, rank] * matrix[b, rank]
        rank += 1
    for a in range(rank - 1, -1, -1):
        for b in range(a + 1, rank):
            right[a] -= matrix[b, a] * right[b]
        right[a] /= matrix[a, a]
        solution[order[a]] = right[a] / scale[a]
