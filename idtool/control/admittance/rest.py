"""The admittance law, compiled: at rest, where the zero is taken and a hand is waited for."""

from __future__ import annotations

import math
from typing import Any

from idtool.control.admittance.hand import forget_push, rest_bound
from idtool.control.admittance.record import TOUCHED, USED
from idtool.control.admittance.states import GONE, GUIDING, MAY_HOLD, RESTING
from idtool.model.jit import jit

#: So many samples above the starting torque start a motion.
START_SAMPLES = 2
#: A torque came of late if it is so many starting torques beyond what is usual.
COMES = 2.0
#: One that was there all the time has to be so much more beyond what a rest may be wrong by.
STEADY = 0.5
#: What is not within a noise of what is usual takes back so many samples that were.
STRAYS = 4


@jit()
def steady(c: Any, s: Any) -> float:
    """What a rest takes for its zero though no hand was seen to leave: what has stayed as it is for `steady`,
    no more than what starts no motion should it have been a hand; nothing where a tare met the unknown."""
    if s.grip == GONE or (s.outcome != USED and s.outcome != TOUCHED):
        return 0.0
    s.since = s.since + 1 if abs(s.hand - s.usual) <= c.noise else max(s.since - STRAYS, 0)
    if s.since < c.steady_periods:
        return 0.0
    s.grip = GONE
    return float(min(max(s.usual, -s.dead), s.dead))


@jit()
def rest(c: Any, s: Any) -> float:
    """Hold the anchor, take the zero if the hand was seen to leave, wait for a hand.

    A torque that came of late starts a motion beyond twice the standard deviation of what a rest may be wrong
    by, one that was there all the time beyond three times. A hand that is known to be gone leaves no doubt.
    """
    most = rest_bound(c, s)
    taken = 0.0
    if s.zero_variance > 0.0:
        noise = c.noise * c.noise
        gain = s.zero_variance / (s.zero_variance + noise)
        s.zero_variance -= gain * s.zero_variance
        if s.zero_variance * c.zero_samples < noise:
            s.zero_variance = 0.0
        share = gain
        s.since = 0
        if s.grip != GONE:
            gain = 0.0
    else:
        gain, share = c.zero_time, c.usual_time
        taken = steady(c, s)
    change = s.zero - s.zero_before - gain * s.raw - taken
    change = s.zero_before + min(max(change, -most), most) - s.zero
    s.zero += change
    s.hand += change
    s.usual += change + share * (s.raw - s.usual)
    sure = s.dead if s.grip == GONE and s.zero_variance == 0.0 else max(s.dead, most)
    least = sure + c.start_torque + c.coverage * math.sqrt(s.zero_variance)
    # an error of the model is there all the time, a hand comes
    if math.copysign(1.0, s.hand) * (s.hand - s.usual) <= COMES * c.start_torque:
        least += STEADY * sure
    s.pushed = s.pushed + 1 if abs(s.hand) > least else 0
    if s.pushed >= (START_SAMPLES if s.zero_variance == 0.0 else 2 * START_SAMPLES):
        s.state = GUIDING
        s.grip = MAY_HOLD
        s.x = s.anchor
        s.w = 0.0
        s.way = math.copysign(1.0, s.hand)
    return float(s.anchor)


@jit()
def hold(s: Any) -> None:
    """The axis is held from outside: rest, and start on nothing that was felt so far."""
    forget_push(s)
    s.state = RESTING
    s.w = s.hand = s.usual = 0.0
    s.pushed = s.since = 0


@jit()
def listen(c: Any, s: Any) -> float:
    """The first moment, hands off: what the model leaves is a deflection of the bristle that nobody saw."""
    s.since += 1
    s.tare_sum += s.raw
    s.hand = 0.0
    if s.since >= c.settle_periods:
        s.zero = min(max(-s.tare_sum / s.since, -c.zero_most), c.zero_most)
        s.zero_before = s.zero
        s.state = RESTING
        s.since = 0
    return float(s.anchor)
