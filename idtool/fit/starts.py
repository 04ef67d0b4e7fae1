"""Where the memory of an effect starts in each trial: found by trying, one number per trial.

What an axis with backlash did before a trial is not in the log, so the first stretch of
every trial depends on a number that nobody knows, as it does on the bristle's start deflection. The
torque is not linear in it; but given the parameters the trials do not depend on each other, so all of
them are tried at one place of a coarse grid with a single evaluation, and each takes its own best.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from idtool.fit.model import JointModel
from idtool.model.motion import Array

#: Tried first, then these steps about the best.
_COARSE = np.linspace(-1.0, 1.0, 9)
_FINE = np.array([-0.1875, -0.125, -0.0625, 0.0625, 0.125, 0.1875])
_FINEST = np.array([-0.03125, 0.03125])


def free_starts(model: JointModel) -> int:
    """How many starts a fit of that model has to find."""
    return model.recording.trials * sum(effect.free_start for effect in model.spec.effects)


def settled(model: JointModel, x: Array, bend: float) -> JointModel:
    """The model with the starts that fit best at coordinates `x`; `bend` as in `JointModel.evaluate`."""
    if not free_starts(model):
        return model
    starts = dict(model.starts)
    for effect in model.spec.effects:
        if not effect.free_start:
            continue
        best = np.zeros(model.recording.trials)
        least = np.full(model.recording.trials, np.inf)
        for steps in (_COARSE, _FINE, _FINEST):
            centre = best.copy()
            for step in steps:
                tried = np.clip(centre + step, -1.0, 1.0)
                error = _errors(model, x, bend, {**starts, effect.name: tried})
                better = error < least
                best[better], least[better] = tried[better], error[better]
        starts[effect.name] = best
    return replace(model, starts=starts)


def _errors(model: JointModel, x: Array, bend: float, starts: Mapping[str, Array]) -> Array:
    """Sum of squares of each trial, shape (trials,)."""
    found = model.evaluate(x, bend, starts)
    recording, trials = model.recording, model.recording.trials
    rows = np.bincount(recording.filtered_trial, found.residual**2, trials)
    bends = np.bincount(recording.motion.trial[recording.motion.begins], found.penalty**2, trials)
    return np.asarray(rows + bends)
