"""An orthonormal basis of columns that are many rows long."""

from __future__ import annotations

import numpy as np

from idtool.model.motion import Array

#: A direction this much shorter than the longest, all columns scaled to one length, is rounding.
_SHORTEST = 1e-6
#: Where the shortest direction's square is this share of the longest's, rounding leaves the basis orthonormal
#: to 2e-9, which no p-value notices.
_ONCE = 1e-7


def orthonormal(columns: Array) -> Array:
    """An orthonormal basis of what columns span, shape (rows, rank).

    By the eigenvectors of their products, twice where once is not enough: as good as a singular value
    decomposition where it keeps a direction, and many times faster where there are many rows (CholeskyQR2:
    Fukaya et al., ScalA 2014).
    Where no direction is lost it is the basis that is closest to the columns (Loewdin, J. Chem. Phys. 18,
    1950), which rounding does not turn as it turns eigenvectors of equal values.

    Args:
        columns: shape (rows, n), of any lengths; what is all zero is left out.
    """
    products = columns.T @ columns
    size = np.sqrt(np.diag(products))
    there = size > 0.0
    if not there.any():
        return np.empty((len(columns), 0))
    scale = np.where(there, size, 1.0)
    # what is not there has the eigenvalue 0 to itself
    values, vectors = np.linalg.eigh(products / np.outer(scale, scale))
    kept = values > _SHORTEST**2 * values[-1]
    axes = vectors[:, kept] / np.sqrt(values[kept])
    if np.count_nonzero(kept) == np.count_nonzero(there):
        axes = (axes @ vectors[:, kept].T)[:, there]
    basis = columns @ (axes / scale[:, None])
    if values[kept].min() > _ONCE * values[-1]:
        return np.asarray(basis)
    values, vectors = np.linalg.eigh(basis.T @ basis)
    return np.asarray(basis @ (vectors / np.sqrt(values) @ vectors.T))


def beyond(known: Array, columns: Array) -> Array:
    """An orthonormal basis of what columns span beside what is known already, shape (rows, rank).

    Args:
        known: orthonormal columns, shape (rows, m).
        columns: shape (rows, n); one of which no more than rounding is left counts for nothing.
    """
    free = columns - known @ (known.T @ columns)
    left, size = np.linalg.norm(free, axis=0), np.linalg.norm(columns, axis=0)
    return orthonormal(free[:, left > _SHORTEST * size])
