"""Where the memory of an effect starts in each trial: found by trying, one number per trial.

What an axis with backlash did before a trial is not in the log, so the first stretch of
every trial depends on a number that nobody knows, as it does on the bristle's start deflection. The
torque is not linear in it; but given the parameters the trials do not depend on each other, so all of
them are tried at one place of a coarse grid with a single evaluation, and each takes its own best.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from idtool.fit.model import JointModel
from idtool.model.motion import Array

#: Tried first, then these steps about the best.
_COARSE = np.linspace(-1.0, 1.0, 9)
_FINE = np.array([-0.1875, -0.125, -0.0625, 0.0625, 0.125, 0.1875])
_FINEST = np.array([-0.03125, 0.03125])
#: What depends on the recording and the spec only.
_KEPT = ("names", "scales", "bounds", "measured", "gravity_columns", "filtered_noise", "friction_sizes")


def free_starts(model: JointModel) -> int:
    """How many starts a fit of that model has to find."""
    return model.recording.trials * sum(effect.free_start for effect in model.spec.effects)


def with_starts(model: JointModel, starts: dict[str, Array]) -> JointModel:
    """The same model with other starts, each shape (trials,)."""
    new = replace(model, starts=starts)
    for name in _KEPT:  # a cached property is not a field, which `replace` would copy
        if name in model.__dict__:
            new.__dict__[name] = model.__dict__[name]
    return new


def settled(model: JointModel, x: Array, bend: float) -> JointModel:
    """The model with the starts that fit best at coordinates `x`; `bend` as in `JointModel.evaluate`."""
    for effect in model.spec.effects:
        if not effect.free_start:
            continue
        best = np.zeros(model.recording.trials)
        least = np.full(model.recording.trials, np.inf)
        for steps in (_COARSE, _FINE, _FINEST):
            centre = best.copy()
            for step in steps:
                tried = np.clip(centre + step, -1.0, 1.0)
                error = _errors(with_starts(model, {**model.starts, effect.name: tried}), x, bend)
                better = error < least
                best[better], least[better] = tried[better], error[better]
        model = with_starts(model, {**model.starts, effect.name: best})
    return model


def _errors(model: JointModel, x: Array, bend: float) -> Array:
    """Sum of squares of each trial, shape (trials,)."""
    found = model.evaluate(x, bend)
    recording, trials = model.recording, model.recording.trials
    rows = np.bincount(recording.filtered_trial, found.residual**2, trials)
    starts = np.bincount(recording.motion.trial[recording.motion.begins], found.penalty**2, trials)
    return np.asarray(rows + starts)
