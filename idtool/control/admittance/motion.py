"""The admittance law, compiled: in motion, guided or braked."""

from __future__ import annotations

import math
from typing import Any

from idtool.control.admittance.hand import forget_push, open_zero, rest_bound
from idtool.control.admittance.states import MAY_HOLD, RESTING, STOPPING
from idtool.model.jit import jit

#: A hand that seems to leave has left, unless it pushes as one that starts for so many samples.
LEAVE_SAMPLES = 3


@jit()
def certain(torque: float, dead: float) -> float:
    """What is certain of a torque."""
    return math.copysign(max(abs(torque) - dead, 0.0), torque)


@jit()
def follow(c: Any, s: Any) -> float:
    """Advance the law's own place and lead it by the servo's lag, which is trimmed on the way."""
    s.x += s.w * c.period
    most = c.tracking_time * abs(s.w) + 4.0 * c.resolution
    behind = min(max(s.x - s.position, -most), most)
    s.x = s.position + behind
    # a small board has time for the uncertainty or for this
    s.turn = 1 - s.turn
    if s.turn == 0 and abs(s.w) > 2.0 * c.rest_speed:
        late = min(max(behind / (s.w * s.lead), -1.0), 1.0)
        lead = s.lead * (1.0 + 2.0 * c.trim_rate * c.period * late)
        s.lead = min(max(lead, c.servo_time / c.trim_range), c.servo_time * c.trim_range)
    return float(s.x + s.lead * s.w)


@jit()
def stand(c: Any, s: Any, position: float) -> float:
    """It has come to rest here; what the motor holds now may be off by what a stop can leave."""
    s.state = RESTING
    s.anchor = min(max(position, c.low), c.high)
    s.pushed = s.limited = 0
    s.hand = s.w = 0.0
    s.seen = s.nominal = s.reported = 0.0  # what stands has no speed, whatever the observer remembers
    forget_push(s)
    open_zero(c, s)
    return float(s.anchor)


@jit()
def brake(c: Any, s: Any, velocity: float) -> float:
    """Ask for the place where the axis comes to rest; once it is slow, for one place, until it stands."""
    if s.since == 0:
        s.fast = max(abs(velocity), c.rest_speed)
    if s.since == 0 or abs(s.position - s.anchor) > c.grain:
        s.anchor = s.position
        s.moved = s.since
    s.since += 1
    if s.since - s.moved > c.still_periods:
        return stand(c, s, s.position)
    if s.since <= c.brake_periods or abs(velocity) > 4.0 * c.rest_speed:
        # at an even deceleration what is left of the way goes with the square of the speed
        s.x = s.position + c.coast * velocity * min(abs(velocity) / s.fast, 1.0)
    return float(s.x)


@jit()
def guide(c: Any, s: Any, velocity: float) -> float:
    """The admittance."""
    s.bias = min(max(s.bias - c.bias_time * s.raw, -c.bias_most), c.bias_most)
    pushes = s.way * certain(s.hand, s.dead) > 0.0
    if s.grip != MAY_HOLD:
        # what a hand that seems to have left leaves may be the model's error in motion: only one that would
        # start a motion goes on
        pushes = s.way * certain(s.raw, max(s.dead, rest_bound(c, s)) + c.start_torque) > 0.0
        s.pushed += 1
        if s.pushed >= LEAVE_SAMPLES and pushes:
            s.grip = MAY_HOLD
    if not pushes:
        s.state = STOPPING
        s.since = s.moved = s.turn = 0
        s.w = 0.0
        return brake(c, s, velocity)
    goal = c.gain * certain(s.raw, s.dead)
    if abs(goal) > c.speed:
        goal = math.copysign(c.speed, goal)
        s.limited = 1
    s.w += c.virtual * (goal - s.w)
    if s.way * s.w < 0.0:
        s.w = 0.0
    place = follow(c, s)
    if s.way * s.x >= s.way * (c.high if s.way > 0.0 else c.low):
        s.w = 0.0  # at the end of the range nothing moves on, and nothing is wound up
        s.x = min(max(s.x, c.low), c.high)
        place = s.x
    return float(place)
