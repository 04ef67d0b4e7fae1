"""The admittance law, compiled: the tare, two cycles to and fro with hands off, and what they teach."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from idtool.control.admittance.constants import SAMPLES_PER_SUM
from idtool.control.admittance.hand import forget_push, open_zero
from idtool.control.admittance.motion import follow
from idtool.control.admittance.record import (
    BRISTLE,
    LOAD,
    NOT_EXPLAINED,
    OTHER_LOAD,
    PARTS,
    TOUCHED,
    USED,
)
from idtool.control.admittance.states import GONE, MAY_HOLD, RESTING, TARING
from idtool.model.jit import jit

#: Cycles, and the samples after them, at rest, in which a small board solves for what they taught.
CYCLES = 2
SOLVE_SAMPLES = 9


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
