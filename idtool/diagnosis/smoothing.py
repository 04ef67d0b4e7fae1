"""Fit a smooth correction to what a model leaves over one variable."""

from __future__ import annotations

import numpy as np

from idtool.fit.covariance import correlation_rows
from idtool.fit.joint import JointFit
from idtool.model.motion import Array
from idtool.parameters.correction import VARIABLES, Correction

#: Knots that are tried; the Bayesian criterion picks.
_KNOTS = (8, 16, 32, 64)
#: Extremes of the variable with so few rows are left out.
_EDGE = 0.002


def fit_correction(fit: JointFit, depends_on: list[str]) -> Correction | None:
    """The correction in the first of the variables that comes again on another day; None if none does."""
    variable = next((name for name in depends_on if name in VARIABLES), None)
    motion = fit.model.recording.motion
    values: Array | None = getattr(motion, variable) if variable else None
    if variable is None or values is None:
        return None
    rows, weight = fit.model.recording.row, fit.model.recording.row_weight
    worth = len(fit.residual) / correlation_rows(fit.residual, fit.model.recording.filtered_trial)
    best: tuple[float, Correction] | None = None
    low, high = np.quantile(values[rows], [_EDGE, 1.0 - _EDGE])
    for count in _KNOTS:
        knots = np.linspace(low, high, count + 2)
        for directed in (False, True) if variable != "velocity" else (False,):
            columns = weight[:, None] * _hats(values[rows], knots)
            if directed:
                columns = columns * np.sign(motion.velocity[rows])[:, None]
            used = np.sum(columns, axis=0) != 0.0
            coefficients = np.zeros(count)
            coefficients[used] = np.linalg.lstsq(columns[:, used], fit.residual, rcond=1e-6)[0]
            left = fit.residual - columns @ coefficients
            cost = worth * np.log(float(left @ left)) + count * np.log(worth)
            if best is None or cost < best[0]:
                torque = np.concatenate([[0.0], coefficients, [0.0]])
                best = float(cost), Correction(variable, directed, knots, torque)
    assert best is not None
    return best[1]


def _hats(values: Array, knots: Array) -> Array:
    """Piecewise linear functions that are one at one inner knot each, shape (rows, inner knots)."""
    step = knots[1] - knots[0]
    return np.asarray(np.maximum(1.0 - np.abs(values[:, None] - knots[None, 1:-1]) / step, 0.0))
