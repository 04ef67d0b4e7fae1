"""How much of a residual a candidate takes away, and whether that may be chance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from idtool.effects.base import Effect
from idtool.fit import noise
from idtool.fit.basis import beyond, orthonormal
from idtool.fit.joint import JointFit, kept
from idtool.model.motion import Array
from idtool.signals import Recording


@dataclass(frozen=True)
class Background:
    """What a fit has already used: an orthonormal basis of its Jacobian, and its residual. The fit keeps it,
    so that it must not keep the fit: neither would be let go."""

    recording: Recording
    basis: Array
    residual: Array

    def chance(self, left: Array, columns: Array) -> float:
        """P-value of what columns took away, the noise being what they left.

        Args:
            left: what they leave of `residual`, shape (filtered rows or more,).
            columns: shape (filtered rows or more, n).
        """
        trial = self.recording.filtered_trial
        n = len(trial)
        return noise.p_value(left[:n], trial, self.residual[:n], self.basis[:n], columns[:n])

    def beside(self, columns: Array) -> Background:
        """The same with what more columns, shape (filtered rows, n), can explain taken out as well."""
        n, rows = len(columns), len(self.basis)
        padded = np.vstack([columns, np.zeros((rows - n, columns.shape[1]))])
        more = beyond(self.basis, padded)
        basis = np.hstack([self.basis, more])
        return Background(self.recording, basis, self.residual - more @ (more.T @ self.residual))

    def free_of_fit(self, columns: Array) -> Array:
        """Columns with what the fit's own parameters could do taken out."""
        return np.asarray(columns - self.basis @ (self.basis.T @ columns))


@kept
def background_of(fit: JointFit) -> Background:
    """What the tests of a fit need."""
    stacked = np.concatenate([fit.residual, fit.penalty])
    basis = fit.basis
    return Background(fit.model.recording, basis, stacked - basis @ (basis.T @ stacked))


@dataclass(frozen=True)
class Score:
    """A candidate's columns against a residual.

    Attributes:
        gain: share of the residual sum of squares that the columns would take away.
        step: least-squares coefficients of the columns.
        left: what they leave of the residual.
        columns: the columns, shape (filtered rows + trials, n).
    """

    gain: float
    step: Array
    left: Array
    columns: Array


def score(background: Background, columns: Array) -> Score:
    """Regress a fit's residual on columns, shape (filtered rows + trials, n)."""
    free = background.free_of_fit(columns)
    norm = np.linalg.norm(free, axis=0)
    original = np.linalg.norm(columns, axis=0)
    alive = norm > 1e-6 * np.where(original > 0, original, 1.0)
    r = background.residual
    step = np.zeros(columns.shape[1])
    if not alive.any():
        return Score(0.0, step, r, columns)
    scaled = free[:, alive] / norm[alive]
    coefficients = np.linalg.lstsq(scaled.T @ scaled, scaled.T @ r, rcond=1e-12)[0]
    left = r - scaled @ coefficients
    step[alive] = coefficients / norm[alive]
    return Score(max(float(1.0 - np.sum(left**2) / np.sum(r**2)), 0.0), step, left, columns)


def chance_of(
    fit: JointFit, effect: Effect, rows: NDArray[np.bool_] | None = None, beside: Sequence[Array] = ()
) -> float:
    """P-value of an effect that is in a model: of no relation to what the rest of the model leaves.

    Args:
        fit: with the effect.
        effect: it.
        rows: the filtered rows to ask; None is all.
        beside: columns that could stand for it too, shape (filtered rows, n) each.
    """
    own = np.array([name.startswith(f"{effect.name}.") for name in fit.model.names])
    chosen = np.arange(len(fit.residual)) if rows is None else np.flatnonzero(rows)
    jacobian, left = fit.jacobian[chosen], fit.residual[chosen]
    # what sits at a bound for the effect's sake could stand for it
    basis = orthonormal(np.hstack([jacobian[:, ~own], *(columns[chosen] for columns in beside)]))
    columns = jacobian[:, own]  # of minus the residual
    # one number alone says where the effect vanishes; among several that of a shape says nothing
    coordinates = effect.active(fit.model.recording.motion)
    without = left + columns @ (fit.x[own] - (coordinates[0].null if len(coordinates) == 1 else 0.0))
    trial = fit.model.recording.filtered_trial[chosen]
    without -= basis @ (basis.T @ without)
    if beside:  # the fit left out of account what they take
        more = beyond(basis, columns)
        left = without - more @ (more.T @ without)
    return noise.p_value(left, trial, without, basis, columns)
