"""A matrix of few numbers a row, by compiled code; as scipy.sparse, whose import takes as long as a fit."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from idtool.model.jit import jit
from idtool.model.motion import Array

Index = NDArray[np.int32]


@dataclass(frozen=True)
class SparseRows:
    """Numbers row by row (CSR), the columns of a row in order and each once.

    Attributes:
        data: the numbers, shape (numbers,).
        indices: column of each, shape (numbers,).
        pointer: number that each row begins with, and how many there are, shape (rows + 1,).
        width: columns.
    """

    data: Array
    indices: Index
    pointer: Index
    width: int

    @classmethod
    def of(cls, data: Array, indices: NDArray[np.intp], pointer: NDArray[np.intp], width: int) -> SparseRows:
        """With places of any size."""
        return cls(data, indices.astype(np.int32), pointer.astype(np.int32), width)

    def __len__(self) -> int:
        return len(self.pointer) - 1

    def __matmul__(self, values: Array) -> Array:
        """Product with a vector, (width,), or with columns, (width, n)."""
        values = np.ascontiguousarray(values, dtype=float)
        times = _times if values.ndim == 1 else _times_columns
        return times(*self.csr, values)

    @property
    def csr(self) -> tuple[Array, Index, Index]:
        """Data, indices and pointer, as compiled code takes them."""
        return self.data, self.indices, self.pointer

    def after(self, other: SparseRows) -> SparseRows:
        """What multiplies by `other` first."""
        from scipy import sparse  # few logs ask for it

        shape, between = (len(self), self.width), (len(other), other.width)
        product = sparse.csr_matrix(self.csr, shape) @ sparse.csr_matrix(other.csr, between)
        product.sort_indices()
        return SparseRows(product.data, product.indices, product.indptr, other.width)

    def every(self, step: int) -> SparseRows:
        """Every `step`-th row."""
        counts = np.diff(self.pointer)
        kept = np.arange(len(counts)) % step == 0
        inside = np.repeat(kept, counts)
        pointer = np.append(0, np.cumsum(counts[kept])).astype(np.int32)
        return SparseRows(self.data[inside], self.indices[inside], pointer, self.width)

    def weighted(self, weight: Array) -> SparseRows:
        """Each row times its weight, shape (rows,)."""
        return replace(self, data=self.data * np.repeat(weight, np.diff(self.pointer)))

    def overlap(self, lag: int) -> float:
        """Products of each row with the one `lag` rows on, summed over all rows."""
        return _overlap(*self.csr, lag)


@jit()
def _times(data: Array, indices: Index, pointer: Index, values: Array) -> Array:
    product = np.empty(len(pointer) - 1)
    for k in range(len(product)):
        total = 0.0
        for p in range(np.uintp(pointer[k]), np.uintp(pointer[k + 1])):
            total += data[p] * values[np.uintp(indices[p])]
        product[k] = total
    return product


@jit()
def _times_columns(data: Array, indices: Index, pointer: Index, values: Array) -> Array:
    product = np.zeros((len(pointer) - 1, values.shape[1]))
    for k in range(len(product)):
        row = product[k]
        for p in range(np.uintp(pointer[k]), np.uintp(pointer[k + 1])):
            weight, own = data[p], values[np.uintp(indices[p])]
            for column in range(len(row)):
                row[column] += weight * own[column]
    return product


@jit()
def _overlap(data: Array, indices: Index, pointer: Index, lag: int) -> float:
    total = 0.0
    for k in range(len(pointer) - 1 - lag):
        p, q = pointer[k], pointer[k + lag]
        while p < pointer[k + 1] and q < pointer[k + lag + 1]:
            if indices[p] == indices[q]:
                total += data[p] * data[q]
                p += 1
                q += 1
            elif indices[p] < indices[q]:
                p += 1
            else:
                q += 1
    return total
