"""What models leave on the rows that were held out, by plain prediction."""

from __future__ import annotations

import numpy as np

from idtool.diagnosis.candidates import LEAST_GAIN
from idtool.diagnosis.split import Split
from idtool.fit.joint import JointFit, on_recording
from idtool.fit.model import JointModel
from idtool.model.motion import Array
from idtool.model.running import deviation
from idtool.signals import Recording

#: A row stands out of the others by so many standard deviations of them.
_STANDS_OUT = 3.0
#: Blocks into which the held-out rows are parted, to tell what is chance.
_BLOCKS = 30


def held_out_squares(fit: JointFit, parts: Split, beside: JointFit | None = None) -> Array:
    """Mean square of what plain prediction leaves on held-out rows, one bristle start per trial, by blocks.

    Rows that stand out (an axis that creeps before it slides follows no friction law) count by Huber's loss
    (Annals of Mathematical Statistics 35, 1964), so that they do not decide alone.

    Args:
        fit: the model.
        parts: which rows were held out.
        beside: the model that tells which rows stand out, the same for all that are compared; None is `fit`.
    """
    left = _held_out(fit, parts)
    limit = _STANDS_OUT * deviation(_held_out(beside or fit, parts))
    squares = np.where(left > limit, limit * (2.0 * left - limit), left**2)
    return np.array([float(block.mean()) for block in np.array_split(squares, min(_BLOCKS, len(squares)))])


def predicts_worse(one: JointFit, other: JointFit, parts: Split) -> bool:
    """Whether one model predicts held-out rows worse than another by enough to matter."""
    lost = held_out_squares(one, parts, other) - held_out_squares(other, parts, other)
    shown = everywhere(other, parts.recording)
    return float(lost.mean()) > 2.0 * LEAST_GAIN * shown.rmse**2


def between(one: JointFit, other: JointFit, parts: Split) -> float:
    """Mean square by which the predictions of two models differ on held-out rows."""
    return float(np.mean((_left(one, parts) - _left(other, parts)) ** 2))


def _held_out(fit: JointFit, parts: Split) -> Array:
    """Size of what a model leaves on each held-out row."""
    return np.abs(_left(fit, parts))


def _left(fit: JointFit, parts: Split) -> Array:
    """What a model leaves on each held-out row, by what the row counts."""
    recording = parts.recording
    rows = recording.usable & parts.held
    weight = 1.0 if recording.weight is None else recording.weight[rows]
    return np.asarray(weight * everywhere(fit, recording).full_residual[rows])


def everywhere(fit: JointFit, recording: Recording) -> JointFit:
    """A fit on every trial of a recording; those that it did not see get a start deflection only."""
    return on_recording(fit, JointModel.build(recording, fit.model.spec, fit.model.constants))
