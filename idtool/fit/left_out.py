"""How well a fit predicts what it did not see.

Every trial (or block of time, where they stand in for trials) is left out in turn. What the fit would leave
of it then follows from its Jacobian without another fit, as for any least squares (PRESS: Allen,
Technometrics 16, 1974; in blocks: Burman, Chow & Nolan, Biometrika 81, 1994). A trial keeps the start of its
own bristle, as in prediction. Where it keeps the start of another memory too, that was fitted to the rows
that it predicts: what such a number takes away of noise is added again (C_p: Mallows, Technometrics 15,
1973).
"""

from __future__ import annotations

import numpy as np

from idtool.fit.covariance import correlation_rows
from idtool.fit.joint import JointFit, kept
from idtool.fit.starts import free_starts
from idtool.model.motion import Array

#: A model without which the error is so many times as large is surely needed.
SURELY = 1.2
#: Standard errors over folds by which a model must be better.
_CLEAR = 1.0
#: What one fold alone tells nearly all of is not judged by the others: its leverage counts as this at most.
_MOST_LEVERAGE = 0.9


@kept
def prediction_errors(fit: JointFit) -> Array:
    """The sum of squares of each fold had it not been seen, shape (folds,)."""
    basis = fit.basis
    stacked = np.concatenate([fit.residual, fit.penalty])
    rows = len(fit.residual)
    # a fit that was cut short is judged by where it was going
    residual = (stacked - basis @ (basis.T @ stacked))[:rows]
    fold = fit.model.recording.filtered_fold
    first = np.flatnonzero(np.diff(fold, prepend=-1))  # the rows of a fold lie together
    ends = np.append(first[1:], rows)
    errors = np.array([_unseen(residual[a:b], basis[a:b]) for a, b in zip(first, ends, strict=True)])
    return errors + _of_starts(fit, residual)[fold[first]]


def _of_starts(fit: JointFit, residual: Array) -> Array:
    """What the fitted starts in each fold take away of its squares and of those of other rows, (folds,)."""
    recording = fit.model.recording
    fold, trial = recording.filtered_fold, recording.filtered_trial
    begun = np.bincount(fold[np.flatnonzero(np.diff(trial, prepend=-1))], minlength=int(fold.max()) + 1)
    each = free_starts(fit.model) / recording.trials
    if not each:
        return np.zeros(len(begun))
    worth = correlation_rows(residual, trial) * float(residual @ residual) / len(residual)
    return np.asarray(2.0 * worth * each * begun)


def _unseen(residual: Array, basis: Array) -> float:
    leverage, axes = np.linalg.eigh(basis.T @ basis)
    raised = 1.0 / (1.0 - np.clip(leverage, 0.0, _MOST_LEVERAGE))
    along = axes.T @ (basis.T @ residual)
    left = residual + basis @ (axes @ (raised * along))
    return float(left @ left)


def left_out_error(fit: JointFit) -> float:
    """Root mean square over the filtered rows had the fit not seen them."""
    return float(np.sqrt(prediction_errors(fit).sum() / len(fit.residual)))


def predicts_better(one: JointFit, other: JointFit) -> bool:
    """Whether the expected errors of one model are below those of another by more than chance over folds."""
    return clearly_less(prediction_errors(one), prediction_errors(other))


def clearly_less(of_one: Array, of_other: Array) -> bool:
    """Whether errors of folds are lower by more than chance, shape (folds,) each."""
    better = of_other - of_one
    chance = float(np.std(better, ddof=1)) * float(np.sqrt(len(better))) if len(better) > 1 else 0.0
    return bool(better.sum() > _CLEAR * chance)
