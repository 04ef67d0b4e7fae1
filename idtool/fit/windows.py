"""Steady windows: stretches of constant speed, one point each on the static friction curve."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from idtool.fit.joint import JointFit, kept
from idtool.model.motion import Array, Motion
from idtool.model.running import running_mean
from idtool.model.stribeck import EXPONENT, level

#: The shortest window, in time and in rows.
_LEAST_SECONDS = 0.4
_LEAST_ROWS = 20
#: Of a window's rows at least this share must be usable.
_MOSTLY = 0.5
#: Steady speed: over this long its mean changes by less than this share.
_SETTLING_S = 0.25
_CHANGE = 0.05
#: A window is steady if the bristle is within this share of where it would settle.
_SETTLED = 0.03


@dataclass(frozen=True)
class Window:
    """A stretch of constant speed.

    Attributes:
        trial: its trial.
        velocity: mean velocity.
        friction: friction torque there if the bristle had settled: the mean of the measured torque,
            less gravity, effects and the rest of the bristle's transient.
        stderr: its standard error.
        steady: whether the bristle had settled anyway.
        travel: distance moved in it.
    """

    trial: int
    velocity: float
    friction: float
    stderr: float
    steady: bool
    travel: float


def _change_of_speed(motion: Motion) -> Array:
    """By how much the mean speed changes around each row, noise averaged out, (rows,)."""
    rows = max(round(_SETTLING_S / motion.period) // 2, 2)
    mean = running_mean(motion.velocity, rows)
    row = np.arange(len(mean))
    return np.asarray(np.abs(mean[np.minimum(row + rows, len(mean) - 1)] - mean[np.maximum(row - rows, 0)]))


@kept
def steady_windows(fit: JointFit) -> list[Window]:
    """The windows of a fitted recording, in order of time."""
    model = fit.model
    motion = model.recording.motion
    friction = model.friction(fit.x)
    slow = _change_of_speed(motion) < _CHANGE * np.abs(motion.velocity)
    moving = np.abs(motion.velocity) > 0.5 * model.scales.slowest
    flags = slow & moving
    usable = model.recording.usable
    direction = np.sign(motion.velocity)
    edges = np.flatnonzero(
        (np.diff(flags.astype(int)) != 0) | (np.diff(direction) != 0) | (np.diff(motion.trial) != 0)
    )
    bounds = np.concatenate([[0], edges + 1, [len(motion)]])
    turns = motion.first | (np.diff(direction, prepend=0.0) != 0)
    turned = np.maximum.accumulate(np.where(turns, np.arange(len(motion)), 0))
    curve = (friction.coulomb, friction.static, friction.stribeck_velocity)
    windows = []
    for begin, end in pairwise(bounds.tolist()):
        if not flags[begin] or not _long(motion, usable, begin, end):
            continue
        g = level(float(np.mean(motion.velocity[begin:end])), *curve, EXPONENT)
        # how far the bristle still is from settling: exponential in the travel since the axis turned around
        travel = np.abs(motion.position[begin:end] - motion.position[turned[begin]])
        bends = friction.bristle_stiffness / g * travel
        left = 2.0 * np.exp(-bends)
        steady = bool(np.mean(left) < _SETTLED)
        after = begin + int(np.count_nonzero(left >= _SETTLED))
        if not steady and _long(motion, usable, after, end):
            begin, steady = after, True  # the rest of the way is long enough by itself
        windows.append(_window(fit, begin, end, steady))
    return windows


def _long(motion: Motion, usable: NDArray[np.bool_], begin: int, end: int) -> bool:
    rows = int(np.count_nonzero(usable[begin:end]))
    return (
        rows >= max(_LEAST_ROWS, _MOSTLY * (end - begin))
        and float(motion.time[end - 1] - motion.time[begin]) >= _LEAST_SECONDS
    )


def _window(fit: JointFit, begin: int, end: int, steady: bool) -> Window:
    motion, friction = fit.model.recording.motion, fit.model.friction(fit.x)
    w = float(np.mean(motion.velocity[begin:end]))
    g = level(w, friction.coulomb, friction.static, friction.stribeck_velocity, EXPONENT)
    values = fit.full_residual[begin:end][fit.model.recording.usable[begin:end]]
    pieces = np.array_split(values, min(8, len(values) // 5))
    return Window(
        trial=int(motion.trial[begin]),
        velocity=w,
        friction=float(np.sign(w) * g + friction.viscous * w) + float(values.mean()),
        stderr=float(np.std([piece.mean() for piece in pieces], ddof=1) / np.sqrt(len(pieces))),
        steady=steady,
        travel=abs(float(motion.position[end - 1] - motion.position[begin])),
    )
