"""What a low-pass of which the corner is not known exactly can have done to the numbers.

A filter that runs forwards alone delays, as inertia and the damping of a bristle do beside friction: they are
off by as much as its corner may be off, which is one more number of the fit, with an error as any.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from idtool.fit.covariance import correlation_rows
from idtool.fit.joint import JointFit, pulled, refit
from idtool.fit.model import JointModel

#: The corner is moved by this share to either side.
_MOVED = 0.02


def allowing_for_low_pass(fit: JointFit) -> JointFit:
    """The fit with intervals that cover it; the same fit where the torque went through none."""
    recording = fit.model.recording
    own = recording.own_filter
    if own is None:
        return fit

    def behind(way: float) -> JointFit:
        moved = replace(recording, own_filter=replace(own, corner_hz=own.corner_hz * math.exp(way)))
        return refit(fit, JointModel.build(moved, fit.model.spec, fit.model.constants))

    lower, higher = behind(-_MOVED), behind(_MOVED)
    bend = (lower.sse + higher.sse - 2.0 * fit.sse) / _MOVED**2
    if bend <= 0.0:
        return fit
    off = 0.5 * (higher.sse - lower.sse) / _MOVED / bend  # from where the squares are least
    rows = correlation_rows(fit.residual, recording.filtered_trial)
    error = math.hypot(math.sqrt(2.0 * fit.rmse**2 * rows / bend), off)
    return pulled(fit, error * np.asarray(higher.x - lower.x) / (2.0 * _MOVED))
