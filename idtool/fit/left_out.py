"""How well a fit will predict what it did not see.

Akaike's final prediction error (Ann. Inst. Statist. Math. 21, 1969): what a model leaves of the rows that it
was fitted to, raised by what its parameters took of the noise. Rows count as the fewer that their memory
makes them worth. It needs no fold to be left out, which a single trial often cannot spare.
"""

from __future__ import annotations

import numpy as np

from idtool.fit.covariance import correlation_rows
from idtool.fit.joint import JointFit
from idtool.model.motion import Array

#: Standard errors over folds by which a model must be better.
_CLEAR = 1.0


def prediction_errors(*fits: JointFit) -> list[Array]:
    """For each model the sum of squares of each fold (trial or block of time) had it not been seen, (folds,).

    All are judged on as many rows as the residual of the one with the most parameters is worth: what a model
    that lacks something quick leaves seems to be worth more of them.
    """
    most = max(len(fit.x) for fit in fits)
    rows = min(_worth(fit) for fit in fits if len(fit.x) == most)
    return [_errors(fit, max(rows, 2.0 * most)) for fit in fits]


def _worth(fit: JointFit) -> float:
    return len(fit.residual) / correlation_rows(fit.residual, fit.model.recording.filtered_trial)


def _errors(fit: JointFit, rows: float) -> Array:
    fold = fit.model.recording.filtered_fold
    first = np.flatnonzero(np.diff(fold, prepend=-1))  # the rows of a fold lie together
    raised = (rows + len(fit.x)) / (rows - len(fit.x))
    return np.asarray(raised * np.add.reduceat(fit.residual**2, first))


def left_out_error(*fits: JointFit) -> list[float]:
    """For each model the root mean square over the filtered rows had it not seen them."""
    errors = prediction_errors(*fits)
    return [float(np.sqrt(own.sum() / len(fit.residual))) for own, fit in zip(errors, fits, strict=True)]


def predicts_better(one: JointFit, other: JointFit) -> bool:
    """Whether the expected errors of one model are below those of another by more than chance over folds."""
    of_one, of_other = prediction_errors(one, other)
    better = of_other - of_one
    chance = float(np.std(better, ddof=1)) * float(np.sqrt(len(better))) if len(better) > 1 else 0.0
    return bool(better.sum() > _CLEAR * chance)
