"""Evidence under noise with memory: every hypothesis is judged by what it leaves itself.

The rows of a residual are not independent, and how many they are worth depends on what is still missing: a
large effect that the model lacks makes its residual slow, and would so pass for chance. The test here counts
independent pieces of evidence instead of rows: contiguous blocks that are long against the memory of the
products of a column and what the hypothesis leaves. A slow remainder then hides no fast effect, since those
products forget soon; and an effect that follows the residual in some places only by chance has blocks that
contradict each other.

What acts in few places rests on few blocks, whose variance says little of itself: it is drawn towards what
noise as everywhere else would give, and the degrees of freedom are those of blocks that know as much.

Sources: cluster-robust Wald test, Liang & Zeger, Biometrika 73, 1986; its F distribution as Hotelling's T2
with degrees of freedom from the blocks, Pustejovsky & Tipton, J. Business & Economic Statistics 36, 2018; a
variance drawn towards a common one, Smyth, Statistical Applications in Genetics 3, 2004.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from idtool.fit.basis import beyond
from idtool.fit.chance import f_tail
from idtool.fit.covariance import block_starts, correlation_rows
from idtool.model.jit import jit
from idtool.model.motion import Array
from idtool.signals.fast_length import fast_length

#: Blocks beyond what columns need, at least.
_SPARE = 8
#: What all rows tell of the variance counts for so many blocks beside those in which the columns act.
_PRIOR = 8.0


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
    # what the columns took away of each block hides in what they left
    leverage = np.add.reduceat(basis**2, starts, axis=0)
    blocks = blocks / np.sqrt(1.0 - np.minimum(leverage, 0.9))
    # as many equal blocks as those in which the columns act would know their variance no better
    equal = _equal_blocks(basis, starts)
    spare = equal + _PRIOR - count + 1.0
    if spare <= 0.0:
        return 1.0
    alike = _if_alike(left, trial, basis, int(np.ceil(len(left) / len(starts))))
    meat = (equal * (blocks.T @ blocks) + _PRIOR * alike) / (equal + _PRIOR)
    along = basis.T @ residual
    wald = max(float(along @ np.linalg.lstsq(meat, along, rcond=1e-12)[0]), 0.0)
    return f_tail(count, spare, wald * spare / (count * (equal + _PRIOR)))


@jit()
def _equal_blocks(basis: Array, starts: NDArray[np.intp]) -> float:
    """How many equal blocks would know a variance as well as these.

    Args:
        basis: orthonormal columns, shape (rows, n).
        starts: first row of each block.
    """
    rows, count = basis.shape
    squares, products = 0.0, np.empty((count, count))
    for index, begin in enumerate(starts):
        products[:] = 0.0
        for row in range(begin, starts[index + 1] if index + 1 < len(starts) else rows):
            for i in range(count):
                for j in range(count):
                    products[i, j] += basis[row, i] * basis[row, j]
        squares += np.sum(products**2) + np.trace(products) ** 2
    return float(count * (count + 1.0) / squares)


def _if_alike(left: Array, trial: NDArray[np.intp], columns: Array, longest: int) -> Array:
    """Covariance of the columns' products with noise that has the memory of `left`, and is alike everywhere.

    Args:
        left: shape (rows,).
        trial: shape (rows,).
        columns: shape (rows, n).
        longest: lag beyond which there is no memory, rows.
    """
    # trials are set apart by as many zeros, so that none meets its neighbour
    place = np.arange(len(left)) + longest * np.cumsum(np.diff(trial, prepend=trial[0]) != 0)
    size = fast_length(int(place[-1]) + 1 + longest)
    padded = np.zeros((columns.shape[1] + 1, size))
    padded[:-1, place], padded[-1, place] = columns.T, left
    spectra = np.fft.rfft(padded)
    memory = np.fft.irfft(np.abs(spectra[-1]) ** 2, size)[:longest]
    memory *= _parzen(np.arange(longest) / longest) / len(left)
    power = 2.0 * np.fft.rfft(memory, size).real - memory[0]  # lags below zero are those above it
    twice = np.where((np.arange(len(power)) == 0) | (2 * np.arange(len(power)) == size), 1.0, 2.0)
    weighted = spectra[:-1] * (twice * np.maximum(power, 0.0))
    return np.asarray((weighted @ spectra[:-1].conj().T).real / size)


def _parzen(lag: Array) -> Array:
    """Parzen's window, which leaves no spectrum below zero (Ann. Math. Statist. 32, 1961); lags below 1."""
    return np.asarray(np.where(lag < 0.5, 1.0 - 6.0 * lag**2 * (1.0 - lag), 2.0 * (1.0 - lag) ** 3))
