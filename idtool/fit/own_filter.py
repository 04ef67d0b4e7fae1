"""Which low-pass a log went through before it was written (`idtool.signals.own_filter`)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from idtool.fit.joint import JointFit, refit
from idtool.fit.model import JointModel
from idtool.signals import Recording
from idtool.signals.bounded import bounded_minimum
from idtool.signals.own_filter import CAUSAL_ORDERS, OwnFilter, falls

#: Noise that falls like this power of the frequency, or faster, was filtered: white noise makes 0.3 at most,
#: a drive's own low-pass of first order 1, of second order 2; forwards and backwards it is twice that.
_FALLS = 2.5
#: Filters of second, first and fourth order, forwards and backwards, and as a drive runs them; the first of
#: each serves to find where.
_KINDS = ((False, (4.0, 2.0, 8.0)), *((True, (order,)) for order in CAUSAL_ORDERS))
#: The corner is looked for downwards from the highest frequency, first in steps of this many octaves, and at
#: the end to within so many. A filter of which a period is more than this share of the usual stretch sees
#: what was before and after it; nor is one looked for beyond the first that leaves so many times the least
#: squares.
_LONGEST = 0.25
_STEP = 0.75
_WITHIN = 0.01
_LOST = 2.0


def filtered_before(recording: Recording) -> bool:
    """Whether the torque went through a low-pass before it was logged."""
    return falls(recording.torque, recording.motion) > _FALLS


def behind_own_filter(fit: JointFit) -> tuple[OwnFilter, JointFit]:
    """The low-pass behind which the model fits best, and the fit behind it.

    All numbers are fitted anew behind each that is tried: a bristle that bends far, or damps, smooths too. So
    does a delay, which is left free though nobody has found one yet.
    """
    recording, spec = fit.model.recording, fit.model.spec
    motion = recording.motion
    highest = 0.5 / motion.period

    @cache
    def behind(own: OwnFilter) -> JointFit:
        return refit(fit, JointModel.build(recording.through(own), spec, fit.model.constants))

    def left(own: OwnFilter) -> float:
        found = behind(own)
        earlier = np.where(motion.begins, 0.0, np.diff(found.unfiltered, prepend=found.unfiltered[0]))
        shift = found.model.recording.filtered(earlier)
        return float(found.sse - (found.residual @ shift) ** 2 / (shift @ shift))

    begins = np.flatnonzero(motion.begins)
    usual = float(np.median(np.diff(motion.time[np.append(begins, len(motion) - 1)])))
    most = max(math.log2(highest * _LONGEST * usual), _STEP)
    found = [_of_kind(highest, most, causal, orders, left) for causal, orders in _KINDS]
    own = min(found, key=left)
    return own, behind(own)


def _of_kind(
    highest: float, most: float, causal: bool, orders: Sequence[float], left: Callable[[OwnFilter], float]
) -> OwnFilter:
    """The filter of one kind that leaves least.

    Args:
        highest: frequency that the log shows, Hz.
        most: octaves below it at most.
        causal, orders: the kind.
        left: squares that a model leaves behind a filter.
    """

    def at(octaves: float) -> OwnFilter:
        return OwnFilter(highest * 2.0**-octaves, orders[0], causal)

    def leaves(octaves: float) -> float:
        return left(at(octaves))

    coarse = 0.0
    for octaves in np.arange(_STEP, most, _STEP).tolist():
        if leaves(octaves) > _LOST * leaves(coarse):
            break
        coarse = min(coarse, octaves, key=leaves)
    fine = bounded_minimum(leaves, max(coarse - _STEP, 0.0), min(coarse + _STEP, most), within=_WITHIN)
    return min((replace(at(fine), order=order) for order in orders), key=left)
