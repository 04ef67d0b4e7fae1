"""The admittance law, compiled: one sample in, one command out, on two records of numbers.

    tau_hand = tau_model + learned(o, b, v) + zero + bias - K i                          estimate
    f        = tau_hand, less the uncertainty of the model, towards zero                  certain part
    T_v dw/dt = K_c f - w,   w = 0 as soon as f no longer pushes the way of w             virtual mass
    q_d      = x + T w,   dx/dt = w                                                       command

So w f >= 0 at every sample: see docs/teach.md. Some work is spread over samples (`turn`, `SOLVE_SAMPLES`,
`SAMPLES_PER_SUM`) because a small board has no time for it within one; it is so everywhere, so that what is
studied and tuned here is what runs there, sample by sample. `c` holds the constants (`constants`), `s` the
state (`STATE`). The exported C has the same functions and names.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from idtool.control.admittance.constants import SAMPLES_PER_SUM
from idtool.control.admittance.states import (
    GONE,
    GUIDING,
    MAY_HOLD,
    RESTING,
    SEEMS_GONE,
    STARTING,
    STOPPING,
    TARING,
)
from idtool.model.jit import jit

#: Parts of a tare's cycle that are compared with those of the cycle before.
PARTS = 8
#: So many samples above the starting torque start a motion.
START_SAMPLES = 2
#: A torque came of late if it is so many starting torques beyond what is usual.
COMES = 2.0
#: One that was there all the time has to be so much more beyond what a rest may be wrong by.
STEADY = 0.5
#: What is not within a noise of what is usual takes back so many samples that were.
STRAYS = 4
#: A hand that seems to leave has left, unless it pushes as one that starts for so many samples.
LEAVE_SAMPLES = 3
#: Cycles of a tare, and the samples after them, at rest, in which a small board solves for what they taught.
CYCLES = 2
SOLVE_SAMPLES = 9
#: What a tare came to.
USED, TOUCHED, NOT_EXPLAINED, OTHER_LOAD = range(4)
LOAD, LEVEL, DAMPING, BRISTLE = range(4)

#: state; samples in it, and of them when it last moved; samples above the starting torque; what is known of
#: the hand (`MAY_HOLD`, ...); what the last tare came to; whether the speed limit cut; whose turn it is
_COUNTS = ("state", "since", "moved", "pushed", "grip", "outcome", "limited", "part", "turn")
#: torques, N m; the motion; sums of a tare, and of what was heard
_NUMBERS = (
    "raw", "hand", "least", "least_1", "least_2", "dead", "zero", "zero_before", "zero_variance",
    "bias", "unexplained", "usual",
    "elastic", "damping", "plain", "felt", "correction",
    "position", "seen", "nominal", "reported", "w", "x", "way", "lead", "anchor", "fast",
    "fade", "square", "rough", "last_plain", "last_elastic", "weight", "tare_sum", "load",
)  # fmt: skip
_TABLES = {"learned": (4,), "spread": (4, 4), "information": (4, 4), "moment": (4,), "means": (PARTS,)}
#: What the law remembers. A record, so that the numbers have names without the compiler too.
STATE = np.dtype(
    (
        np.record,
        [(name, "i8") for name in _COUNTS]
        + [(name, "f8") for name in _NUMBERS]
        + [(name, "f8", shape) for name, shape in _TABLES.items()],
    )
)


@jit()
def reset(c: Any, s: Any) -> None:
    """Nothing was learned."""
    for j in range(4):
        s.learned[j] = 0.0
        for k in range(4):
            s.spread[j, k] = 1.0 if j == k else 0.0
    s.unexplained = 0.0
    s.lead = c.servo_time
    s.outcome = USED


@jit()
def begin(c: Any, s: Any, position: float) -> None:
    """The first sample: the bristle is unknown, what was learned of load and friction still holds."""
    s.state = STARTING
    s.grip = MAY_HOLD
    s.since = s.pushed = s.limited = s.turn = 0
    s.raw = s.hand = s.dead = s.zero = s.zero_before = s.zero_variance = s.bias = s.correction = 0.0
    s.seen = s.nominal = s.reported = s.w = s.tare_sum = s.usual = 0.0
    forget_push(s)
    s.position = position
    s.x = s.anchor = min(max(position, c.low), c.high)


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
    left = size - push > c.left * size and size - push > c.jump
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


@jit()
def forget_push(s: Any) -> None:
    """No hand has pushed of late."""
    s.least = s.least_1 = s.least_2 = 0.0


@jit()
def open_zero(c: Any, s: Any) -> None:
    """What the motor holds now may be off by what a stop can leave: take the zero anew."""
    most = rest_bound(c, s)
    s.zero_before = s.zero
    s.zero_variance = most * most


@jit()
def rest_bound(c: Any, s: Any) -> float:
    """What a stop may leave beyond the model, N m."""
    left = c.coverage * s.unexplained
    return float(math.sqrt(c.stop_torque**2 + c.stop_noise**2 + left * left))


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
def steady(c: Any, s: Any) -> float:
    """What a rest takes for its zero though no hand was seen to leave: what has stayed as it is for `steady`,
    and no more than what starts no motion should it have been a hand, once a tare told how much that is."""
    if s.grip == GONE or s.outcome != USED:
        return 0.0
    s.since = s.since + 1 if abs(s.hand - s.usual) <= c.noise else max(s.since - STRAYS, 0)
    if s.since < c.steady_periods:
        return 0.0
    s.grip = GONE
    return float(min(max(s.usual, -s.dead), s.dead))


@jit()
def hold(s: Any) -> None:
    """The axis is held from outside: rest, and start on nothing that was felt so far."""
    forget_push(s)
    s.state = RESTING
    s.w = s.hand = s.usual = 0.0
    s.pushed = s.since = 0


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


@jit()
def brake(c: Any, s: Any, velocity: float) -> float:
    """Ask for the place where the axis comes to rest; once it is slow, for one place, until it stands."""
    if s.since == 0:
        s.fast = max(abs(velocity), c.rest_speed)
    if s.since == 0 or abs(s.position - s.anchor) > 1.01 * c.resolution:
        s.anchor = s.position
        s.moved = s.since
    s.since += 1
    if s.since - s.moved > c.still_periods:
        s.state = RESTING
        s.anchor = min(max(s.position, c.low), c.high)
        s.pushed = 0
        s.hand = 0.0
        s.seen = s.nominal = s.reported = 0.0  # what stands has no speed, whatever the observer remembers
        forget_push(s)
        open_zero(c, s)
        return float(s.anchor)
    if s.since <= c.brake_periods or abs(velocity) > 4.0 * c.rest_speed:
        # at an even deceleration what is left of the way goes with the square of the speed
        s.x = s.position + c.coast * velocity * min(abs(velocity) / s.fast, 1.0)
    return float(s.x)


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


@jit()
def tare(c: Any, s: Any) -> bool:
    """Begin to move to and fro; False while it does not rest."""
    if s.state != RESTING or s.zero_variance > 0.0:
        return False
    if abs(s.hand) > c.start_torque:
        s.outcome = TOUCHED  # a hand is there already
        return False
    forget_push(s)
    s.hand = 0.0
    s.state = TARING
    s.since = s.part = 0
    s.way = -1.0 if s.anchor > c.tare_middle else 1.0
    s.w = s.nominal = s.reported = 0.0
    s.x = s.anchor
    s.zero_before = s.zero
    s.zero = s.bias = 0.0
    s.fade = 1.0
    s.last_plain, s.last_elastic = s.plain, s.elastic
    s.square = s.rough = s.weight = s.tare_sum = 0.0
    s.outcome = USED
    for j in range(4):
        s.moment[j] = 0.0
        for k in range(4):
            s.information[j, k] = 1.0 if j == k else 0.0
    return True


@jit()
def sweep(c: Any, s: Any, motor: float) -> float:
    """The tare: least squares for load, level, damping and the bristle's start, and whether to believe it.

    Args:
        c, s: constants and state.
        motor: current of this sample, A.
    """
    s.since += 1
    moving = CYCLES * c.tare_cycle
    if s.since > moving:
        if s.since < moving + SOLVE_SAMPLES:
            return float(s.anchor)
        learn(c, s)
        s.state = RESTING
        s.grip = GONE if s.outcome == USED else MAY_HOLD
        open_zero(c, s)
        return float(s.anchor)
    if s.since % SAMPLES_PER_SUM == 1:
        late = c.tare_late * s.damping
        turns = c.tare_turns * (s.elastic - s.last_elastic)
        s.last_elastic = s.elastic
        weight = SAMPLES_PER_SUM / (c.tare_noise * c.tare_noise + late * late + turns * turns)
        row = (c.prior[0], c.prior[1] * s.elastic, c.prior[2] * s.damping, c.prior[3] * s.fade * s.felt)
        for j in range(4):
            s.moment[j] -= weight * row[j] * s.plain
            for k in range(4):
                s.information[j, k] += weight * row[j] * row[k]
        s.square += weight * s.plain * s.plain
        s.rough += weight * (s.plain - s.last_plain) ** 2
        s.last_plain = s.plain
        s.weight += weight
    # an axis repeats itself, a hand does not: each part is compared with that of the cycle before, but for
    # the first, to which the axis came from rest
    s.tare_sum += motor
    if s.since % c.tare_part == 0:
        mean = s.tare_sum / c.tare_part
        if s.since > c.tare_cycle and s.part > 0 and abs(mean - s.means[s.part]) > c.tare_apart:
            s.outcome = TOUCHED
        s.means[s.part] = mean
        s.tare_sum = 0.0
        s.part = (s.part + 1) % PARTS
    if s.since < moving:
        place = follow(c, s)
        s.w = s.way * c.tare_top * math.sin(c.tare_turn * s.since)
        return float(place)
    s.w = 0.0
    return float(s.anchor)


@jit()
def learn(c: Any, s: Any) -> None:
    """Solve for what the tare taught, and use it if it can be believed."""
    s.turn = 0
    s.dead = 0.0  # to be known anew
    invert(s.information)
    found = np.zeros(4)
    for j in range(4):
        for k in range(4):
            found[j] += s.information[j, k] * s.moment[k]
    left = s.square
    for j in range(4):
        left -= found[j] * (s.moment[j] + found[j])
    left /= s.weight
    s.load = c.prior[LOAD] * found[LOAD]
    if s.outcome == USED and left > c.tare_left * c.tare_left:
        s.outcome = NOT_EXPLAINED
    sure = abs(s.load) - c.coverage * c.prior[LOAD] * math.sqrt(s.information[LOAD, LOAD])
    if s.outcome == USED and sure > c.refuse:
        s.outcome = OTHER_LOAD
    if s.outcome != USED:
        s.zero = s.zero_before
        if s.outcome == OTHER_LOAD:
            s.unexplained = max(s.unexplained, abs(s.load))  # it may carry that, or may not
        return
    for j in range(3):
        s.learned[j] = c.prior[j] * found[j]
    s.zero = s.zero_before = c.prior[BRISTLE] * found[BRISTLE] * s.fade
    # what differs from one sample to the next is noise, of a speed that is read in steps too
    noise = max(c.noise * c.noise, 0.5 * s.rough / s.weight)
    s.unexplained = math.sqrt(max(left - noise, 0.0))
    for j in range(4):
        for k in range(4):
            s.spread[j, k] = s.information[j, k]


@jit()
def invert(a: Any) -> None:
    """A symmetric positive matrix, 4 by 4, in place, by Gauss and Jordan: no pivot is ever below 1."""
    for p in range(4):
        pivot = 1.0 / a[p, p]
        a[p, p] = 1.0
        for k in range(4):
            a[p, k] *= pivot
        for j in range(4):
            if j != p:
                factor = a[j, p]
                a[j, p] = 0.0
                for k in range(4):
                    a[j, k] -= factor * a[p, k]


@jit()
def act(
    c: Any, s: Any, position: float, velocity: float, current: float,
    plain: float, elastic: float, damping: float, kept: float, felt: float,
) -> float:  # fmt: skip
    """One sample: the command before its limits."""
    s.limited = 0
    s.position = position
    sense(c, s, plain, elastic, damping, kept, felt)
    if s.state == GUIDING:
        return guide(c, s, velocity)
    if s.state == STOPPING:
        return brake(c, s, velocity)
    if s.state == TARING:
        return sweep(c, s, current)
    if s.state == STARTING:
        return listen(c, s)
    return rest(c, s)


# From Python: records in arrays of one. An array is handed over within a microsecond, a record takes twenty,
# as numpy writes a description of it every time.


@jit()
def watch_in(c: Any, s: Any, velocity: float) -> tuple[float, float]:
    """As `watch`; its change of the speed, and the speed."""
    change = watch(c[0], s[0], velocity)
    return change, float(s[0].seen)


@jit()
def act_in(
    c: Any, s: Any, position: float, velocity: float, current: float,
    plain: float, elastic: float, damping: float, kept: float, felt: float,
) -> float:  # fmt: skip
    """As `act`."""
    return act(c[0], s[0], position, velocity, current, plain, elastic, damping, kept, felt)


@jit()
def hold_in(s: Any) -> None:
    """As `hold`."""
    hold(s[0])


@jit()
def told(s: Any) -> tuple[int, int, int, float, float, float, float, float, float]:
    """What others read: state, whether the speed limit cut, what the last tare came to; anchor, hand, raw,
    correction, speed asked for, uncertainty."""
    r = s[0]
    return r.state, r.limited, r.outcome, r.anchor, r.hand, r.raw, r.correction, r.w, r.dead
