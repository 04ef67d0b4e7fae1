"""An orthonormal basis of columns that are many rows long."""

from __future__ import annotations

import numpy as np

from idtool.model.motion import Array

#: A direction this much shorter than the longest, all columns scaled to one length, is rounding.
_SHORTEST = 1e-6


def orthonormal(columns: Array) -> Array:
    """An orthonormal basis of what columns span, shape (rows, rank).

    By the eigenvectors of their products, twice: as exact as a singular value decomposition where it keeps
    a direction, and many times faster where there are many rows (CholeskyQR2: Fukaya et al., ScalA 2014).

    Args:
        columns: shape (rows, n), of any lengths; what is all zero is left out.
    """
    size = np.linalg.norm(columns, axis=0)
    scaled: Array = columns[:, size > 0.0] / size[size > 0.0]
    if scaled.shape[1] == 0:
        return np.empty((len(columns), 0))
    values, vectors = np.linalg.eigh(scaled.T @ scaled)
    kept = values > _SHORTEST**2 * values[-1]
    basis = scaled @ (vectors[:, kept] / np.sqrt(values[kept]))
    values, vectors = np.linalg.eigh(basis.T @ basis)
    return np.asarray(basis @ (vectors / np.sqrt(values)))


def beyond(known: Array, columns: Array) -> Array:
    """An orthonormal basis of what columns span beside what is known already, shape (rows, rank).

    Args:
        known: orthonormal columns, shape (rows, m).
        columns: shape (rows, n); one of which no more than rounding is left counts for nothing.
    """
    free = columns - known @ (known.T @ columns)
    left, size = np.linalg.norm(free, axis=0), np.linalg.norm(columns, axis=0)
    return orthonormal(free[:, left > _SHORTEST * size])
