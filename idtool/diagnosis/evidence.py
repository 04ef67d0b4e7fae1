"""How much better one fit is than another: robust score tests and leave-one-trial-out error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from idtool.fit.joint import JointFit, effective_rows
from idtool.model.motion import Array


@dataclass(frozen=True)
class Background:
    """What a fit has already used: an orthonormal basis of its Jacobian, and its residual."""

    fit: JointFit
    basis: Array
    residual: Array
    effective: float

    @classmethod
    def of(cls, fit: JointFit) -> Background:
        """Prepare the tests of one fit."""
        jacobian = fit.jacobian[:, fit.free]
        norm = np.linalg.norm(jacobian, axis=0)
        basis = np.linalg.qr(jacobian[:, norm > 0] / norm[norm > 0])[0]
        penalty = fit.start * (fit.model.filtered_noise / fit.bend)
        stacked = np.concatenate([fit.residual, penalty])
        return cls(fit, basis, stacked - basis @ (basis.T @ stacked), effective_rows(fit))

    def free_of_fit(self, columns: Array) -> Array:
        """Columns with what the fit's own parameters could do taken out."""
        return np.asarray(columns - self.basis @ (self.basis.T @ columns))


@dataclass(frozen=True)
class Score:
    """A candidate's columns against a residual.

    Attributes:
        gain: share of the residual sum of squares that the columns would take away.
        p_value: of no relation, robust against autocorrelation.
        step: least-squares coefficients of the columns.
    """

    gain: float
    p_value: float
    step: Array


def score(background: Background, columns: Array) -> Score:
    """Regress a fit's residual on columns, shape (filtered rows + trials, n)."""
    free = background.free_of_fit(columns)
    norm = np.linalg.norm(free, axis=0)
    original = np.linalg.norm(columns, axis=0)
    alive = norm > 1e-6 * np.where(original > 0, original, 1.0)
    if not alive.any():
        return Score(0.0, 1.0, np.zeros(columns.shape[1]))
    scaled = free[:, alive] / norm[alive]
    r = background.residual
    coefficients = np.linalg.lstsq(scaled, r, rcond=1e-8)[0]
    gain = float(1.0 - np.sum((r - scaled @ coefficients) ** 2) / np.sum(r**2))
    step = np.zeros(columns.shape[1])
    step[alive] = coefficients / norm[alive]
    return Score(max(gain, 0.0), _chance(background, gain, int(alive.sum())), step)


def _chance(background: Background, gain: float, columns: int) -> float:
    """P-value of a gain: an F-test in which autocorrelated rows count as the fewer they are worth."""
    spare = max(background.effective - len(background.fit.x) - columns, 1.0)
    ratio = gain / columns / max((1.0 - gain) / spare, 1e-300)
    return float(stats.f.sf(ratio, columns, spare))


def left_out_errors(fit: JointFit) -> Array:
    """Sum of squares of each trial when the parameters are fitted on the others, (trials,).

    Linearised about the fit (exact for a linear model): leaving a trial out moves the parameters by
    the known leave-one-out formula, so no refit is needed. A trial without which the others could not
    determine the parameters is left in.
    """
    trial = fit.model.recording.filtered_trial
    rows = len(trial)
    free = fit.free
    jacobian = fit.jacobian[:, free]
    scale = np.linalg.norm(jacobian, axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    jacobian = jacobian / scale
    information = jacobian.T @ jacobian
    errors = np.empty(fit.model.recording.trials)
    # the rows of a trial lie together
    bounds = np.searchsorted(trial, np.arange(len(errors) + 1))
    for t in range(len(errors)):
        mine = slice(bounds[t], bounds[t + 1])
        own = np.concatenate([jacobian[mine], jacobian[rows + t][None, :]])
        rest = information - own.T @ own
        residual = fit.residual[mine]
        if np.linalg.cond(rest) < 1e10:
            penalty = fit.start[t] * fit.model.filtered_noise / fit.bend
            # jacobian is that of minus the residual stack
            shift = np.linalg.solve(rest, own.T @ np.append(residual, penalty))
            residual = residual + jacobian[mine] @ shift
        errors[t] = residual @ residual
    return errors
