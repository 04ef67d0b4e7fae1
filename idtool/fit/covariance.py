"""How far a fit may be off: covariance and degrees of freedom under autocorrelated residuals.

The sandwich estimator over contiguous blocks of each trial, long against the residual's correlation
time. A block that carries much of what is known about a parameter pulls the fit towards itself, which
makes its residuals too small; they are rescaled by what the block's own leverage hides (CR2), and the
degrees of freedom of each parameter are the blocks that it effectively rests on.

Source: Liang & Zeger, Biometrika 73, 1986; Bell & McCaffrey, Survey Methodology 28, 2002.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from idtool.fit.chance import student_quantile
from idtool.model.jit import jit
from idtool.model.motion import Array

#: Length of a block in correlation times, and the fewest blocks.
_BLOCK = 12.0
_FEWEST = 40
#: A block's residual is put up by no more than ten times for what the fit took of it.
_MOST_LEVERAGE = 0.99


@dataclass(frozen=True)
class Uncertainty:
    """Of a fit's free coordinates.

    Attributes:
        covariance: shape (n, n).
        degrees: degrees of freedom of each coordinate's standard error, shape (n,).
    """

    covariance: Array
    degrees: Array

    @property
    def quantile(self) -> Array:
        """Half width of a 95 % interval in standard errors (Student), shape (n,)."""
        return student_quantile(self.degrees, 0.975)

    @property
    def one_sided(self) -> Array:
        """The same of a 95 % limit on one side, shape (n,)."""
        return student_quantile(self.degrees, 0.95)


def uncertainty(jacobian: Array, residual: Array, trial: NDArray[np.intp]) -> Uncertainty:
    """Covariance of least-squares estimates.

    Args:
        jacobian: of the rows and, after them, of any prior, shape (at least rows, n).
        residual: shape (rows,).
        trial: trial of each row, in order, shape (rows,).
    """
    rows, size = len(residual), jacobian.shape[1]
    scale = np.linalg.norm(jacobian, axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    scaled = jacobian / scale
    values, vectors = np.linalg.eigh(scaled.T @ scaled)
    alive = values > 1e-12 * max(float(values[-1]), 1e-300) if size else np.zeros(0, dtype=bool)
    # in the coordinates of `whiten` the information is the unit matrix
    whiten = vectors[:, alive] / np.sqrt(values[alive])
    white = scaled[:rows] @ whiten
    rho = autocorrelation(residual, trial)
    starts = block_starts(trial, _correlation_time(rho))
    meat = np.zeros((white.shape[1], white.shape[1]))
    squares = np.zeros(size)
    direction = whiten / np.maximum(np.linalg.norm(whiten, axis=1, keepdims=True), 1e-300)
    for begin, end in zip(starts, np.append(starts[1:], rows), strict=True):
        block = white[begin:end]
        leverage, axes = np.linalg.eigh(block.T @ block)
        score = axes.T @ (block.T @ residual[begin:end])
        score = axes @ (score / np.sqrt(1.0 - np.clip(leverage, 0.0, _MOST_LEVERAGE)))
        meat += np.outer(score, score)
        squares += np.sum((direction @ block.T) ** 2, axis=1) ** 2
    meat *= _cut_at_edges(rho, rows / len(starts))
    covariance = whiten @ meat @ whiten.T
    # few blocks can make it fall below what white noise alone would give: never less than that
    noise = float(residual @ residual) / max(rows - size, 1)
    floor = noise * np.sum(whiten**2, axis=1)
    lift = np.sqrt(np.maximum(1.0, floor / np.maximum(np.diag(covariance), 1e-300)))
    covariance = covariance * np.outer(lift, lift) / np.outer(scale, scale)
    return Uncertainty(covariance, np.clip(1.0 / np.maximum(squares, 1e-300), 1.0, max(len(starts) - 1, 1)))


def block_starts(trial: NDArray[np.intp], time: float, fewest: int = _FEWEST) -> NDArray[np.intp]:
    """First row of each block: contiguous parts of a trial, long against the correlation time.

    Args:
        trial: trial of each row.
        time: correlation time, rows.
        fewest: shorter blocks rather than fewer of them.
    """
    length = max(4, int(np.ceil(_BLOCK * time)))
    length = min(length, max(len(trial) // fewest, 4))
    first = np.flatnonzero(np.diff(trial, prepend=-1))
    sizes = np.diff(np.append(first, len(trial)))
    parts = [
        begin + (np.arange(max(size // length, 1)) * size) // max(size // length, 1)
        for begin, size in zip(first, sizes, strict=True)
    ]
    return np.concatenate(parts).astype(np.intp)


def _cut_at_edges(rho: Array, length: float) -> float:
    """Factor that makes up for the correlation between neighbouring blocks, which their sums miss."""
    missed = 2.0 * float(np.sum(np.arange(1, len(rho) + 1) * rho)) / length
    whole = _correlation_time(rho)
    return whole / max(whole - missed, 0.5 * whole)


def _correlation_time(rho: Array) -> float:
    return 1.0 + 2.0 * float(rho.sum())


def correlation_rows(residual: Array, trial: NDArray[np.intp]) -> float:
    """Integrated autocorrelation time of a residual, in rows (1 for white noise)."""
    return _correlation_time(autocorrelation(residual, trial))


def autocorrelation(residual: Array, trial: NDArray[np.intp]) -> Array:
    """Autocorrelation inside trials at lags 1, 2, ... up to where it first falls below 0.05."""
    centred = residual - residual.mean()
    variance = float(np.mean(centred**2))
    bounds = np.concatenate([[0], np.flatnonzero(trial[1:] != trial[:-1]) + 1, [len(trial)]])
    return _above(0.05 * variance, centred, bounds, min(200, len(residual) // 8)) / variance


@jit()
def _above(least: float, values: Array, bounds: NDArray[np.intp], most: int) -> Array:
    """Mean products of rows of one trial that lie 1, 2, ... rows apart, as long as they are no less."""
    found = np.empty(most)
    for lag in range(1, most):
        products, pairs = _at_lag(values, bounds, lag)
        if pairs < 20 or products <= 0.0 or products < least * pairs:
            return found[: lag - 1]
        found[lag - 1] = products / pairs
    return found[: max(most - 1, 0)]


@jit(fastmath={"reassoc"})  # a sum in any order, so that it goes by vector units
def _at_lag(values: Array, bounds: NDArray[np.intp], lag: int) -> tuple[float, int]:
    """Sum of the products of rows of one trial that lie `lag` rows apart, and how many pairs there are."""
    products, pairs = 0.0, 0
    for number in range(len(bounds) - 1):
        begin, end = bounds[number], bounds[number + 1]
        late, early = values[begin + lag : end], values[begin : max(end - lag, begin)]
        pairs += len(late)
        for k in range(len(late)):  # from zero, as an index that may be negative keeps vector units idle
            products += late[k] * early[k]
    return products, pairs
