"""Steady windows: stretches of constant speed, one point each on the static friction curve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from idtool.fit.joint import JointFit, kept
from idtool.model.stribeck import EXPONENT, level
from idtool.signals.coverage import long_enough, steady_stretches

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


@kept
def steady_windows(fit: JointFit) -> list[Window]:
    """The windows of a fitted recording, in order of time."""
    recording = fit.model.recording
    motion = recording.motion
    friction = fit.model.friction(fit.x)
    direction = np.sign(motion.velocity)
    turns = motion.first | (np.diff(direction, prepend=0.0) != 0)
    turned = np.maximum.accumulate(np.where(turns, np.arange(len(motion)), 0))
    curve = (friction.coulomb, friction.static, friction.stribeck_velocity)
    windows = []
    for begin, end in steady_stretches(recording):
        g = level(float(np.mean(motion.velocity[begin:end])), *curve, EXPONENT)
        # how far the bristle still is from settling: exponential in the travel since the axis turned around
        travel = np.abs(motion.position[begin:end] - motion.position[turned[begin]])
        bends = friction.bristle_stiffness / g * travel
        left = 2.0 * np.exp(-bends)
        steady = bool(np.mean(left) < _SETTLED)
        after = begin + int(np.count_nonzero(left >= _SETTLED))
        if not steady and long_enough(recording, after, end):
            begin, steady = after, True  # the rest of the way is long enough by itself
        windows.append(_window(fit, begin, end, steady))
    return windows


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
