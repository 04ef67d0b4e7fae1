"""Evidence under noise with memory: every hypothesis is judged by what it leaves itself.

The rows of a residual are not independent, and how many they are worth depends on what is still missing: a
large effect that the model lacks makes its residual slow, and would so pass for chance. The test here counts
independent pieces of evidence instead of rows: contiguous blocks that are long against the memory of the
products of a column and what the hypothesis leaves. A slow remainder then hides no fast effect, since those
products forget soon; and an effect that follows the residual in some places only by chance has blocks that
contradict each other.

Source: cluster-robust Wald test, Liang & Zeger, Biometrika 73, 1986; its F distribution as Hotelling's T2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import special

from idtool.fit.basis import beyond
from idtool.fit.covariance import block_starts, correlation_rows
from idtool.model.motion import Array

#: Blocks beyond what columns need, at least.
_SPARE = 8


def p_value(left: Array, trial: NDArray[np.intp], residual: Array, known: Array, columns: Array) -> float:
    """Of no relation between a residual and columns.

    Args:
        left: what the columns leave of the residual, shape (rows,).
        trial: trial of each row; the rows of one lie together.
        residual: shape (rows,).
        known: orthonormal columns that the model has already, shape (rows, m).
        columns: what is tested, shape (rows, n).
    """
    basis = beyond(known, columns)
    count = basis.shape[1]
    if count == 0:
        return 1.0
    products = basis * left[:, None]
    memory = max(correlation_rows(column, trial) for column in products.T)
    starts = block_starts(trial, memory, fewest=2 * count + _SPARE)
    blocks = np.add.reduceat(products, starts, axis=0)
    spare = len(blocks) - count
    if spare < 1:
        return 1.0
    # what the columns took away of each block hides in what they left
    leverage = np.add.reduceat(basis**2, starts, axis=0)
    blocks = blocks / np.sqrt(1.0 - np.minimum(leverage, 0.9))
    meat = blocks.T @ blocks
    along = basis.T @ residual
    wald = max(float(along @ np.linalg.lstsq(meat, along, rcond=1e-12)[0]), 0.0)
    return float(special.fdtrc(count, spare, wald * spare / count / len(blocks)))
