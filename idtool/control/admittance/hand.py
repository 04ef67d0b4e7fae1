"""The admittance law, compiled: the estimate of the hand, and what it may be wrong by.

`c` holds the constants (`constants`), `s` the state (`record.STATE`).
"""

from __future__ import annotations

import math
from typing import Any

from idtool.control.admittance.record import DAMPING, LEVEL, LOAD
from idtool.control.admittance.states import GONE, GUIDING, RESTING, SEEMS_GONE, TARING
from idtool.model.jit import jit


@jit()
def watch(c: Any, s: Any, velocity: float) -> float:
    """Update the observer of the speed; its change. What the axis was told to do is smooth and in time, what
    it is measured to do is neither: a reading is as late as the file says, and is compared with what was told
    then. How a brake brings the axis to rest is the drive's."""
    nominal = c.follows * (s.w - s.nominal)
    s.nominal += nominal
    s.reported += c.reports * (s.nominal - s.reported)
    if s.state != GUIDING and s.state != TARING:
        s.reported = s.nominal
    change = nominal + c.velocity_gain * ((velocity - s.seen) + (s.nominal - nominal - s.reported))
    s.seen += change
    return float(change)


@jit()
def uncertainty(c: Any, s: Any) -> float:
    """What the model may be wrong by at this motion, N m: `coverage` standard deviations of what was learned
    and of what a tare left, `floor` at least."""
    row = (c.prior[LOAD], c.prior[LEVEL] * s.elastic, c.prior[DAMPING] * s.damping)
    variance = s.unexplained * s.unexplained
    for j in range(3):
        for k in range(3):
            variance += row[j] * row[k] * s.spread[j, k]
    return float(max(c.floor, c.coverage * math.sqrt(max(variance, 0.0))))


@jit()
def forget_push(s: Any) -> None:
    """No hand has pushed of late."""
    s.least = s.least_1 = s.least_2 = 0.0


@jit()
def rest_bound(c: Any, s: Any) -> float:
    """What a stop may leave beyond the model, N m."""
    left = c.coverage * s.unexplained
    return float(math.sqrt(c.stop_torque**2 + c.stop_noise**2 + left * left))


@jit()
def open_zero(c: Any, s: Any) -> None:
    """What the motor holds now may be off by what a stop can leave: take the zero anew."""
    most = rest_bound(c, s)
    s.zero_before = s.zero
    s.zero_variance = most * most


@jit()
def sense(c: Any, s: Any, plain: float, elastic: float, damping: float, kept: float, felt: float) -> None:
    """Update the estimate of the hand.

    Args:
        c, s: constants and state.
        plain: torque of the model less that of the motor.
        elastic, damping: the model's friction torques.
        kept: share of the bristle's deflection that outlived the travel since the last sample.
        felt: torque of one that nobody saw, over what it is at rest.
    """
    s.elastic, s.damping, s.plain = elastic, damping, plain
    # a slow change: a small board has time for the uncertainty or for it
    if s.state != GUIDING or s.turn != 0:
        s.felt = felt
    if s.state == TARING:  # hands are off, and what was learned is learned anew
        s.fade *= kept
        s.zero_before *= kept
        s.raw = plain
        s.correction = 0.0
        return
    s.zero *= kept
    if s.state == RESTING:
        s.zero_before *= kept
    s.correction = (
        s.learned[LOAD] + s.learned[LEVEL] * elastic + s.learned[DAMPING] * damping + s.zero * s.felt
    )
    if s.state == GUIDING:
        s.correction += s.bias
    s.raw = plain + s.correction
    if s.dead == 0.0 or (s.state != RESTING and s.turn == 0):  # at rest friction stays what it was
        s.dead = uncertainty(c, s)
    size = abs(s.hand)
    push = s.raw if s.hand > 0.0 else -s.raw
    # where nobody was felt nobody leaves
    left = size > 0.0 and size - push > c.left * size and size - push > c.jump
    fell = s.least_2 - push
    seems = left or (fell > c.seems * s.least_2 and fell > c.jump)
    s.hand += (1.0 if seems else c.hand_filter) * (s.raw - s.hand)
    if seems:
        forget_push(s)
    else:
        # a hand that leaves takes two samples of a current that is the mean of a period
        s.least_2, s.least_1 = s.least_1, s.least
        s.least = max(min(s.least + c.least_time * (abs(s.hand) - s.least), push), 0.0)
    if seems and s.state == GUIDING:
        s.grip = max(s.grip, GONE if left else SEEMS_GONE)
        s.pushed = 0
    elif left and s.state == RESTING and s.zero_variance == 0.0:
        s.grip = GONE
        open_zero(c, s)
