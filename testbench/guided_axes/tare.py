"""Hands in a tare."""

from __future__ import annotations

import math

from idtool.control import ForceFreeController
from testbench.guided_axes.axis import NO_HAND
from testbench.guided_axes.cases import PAYLOAD_KG, Case
from testbench.guided_axes.pushes import PERIOD, set_up


def tared(case: Case, newton: float, begin: float, seconds: float) -> ForceFreeController:
    """The controller after a tare into which a hand pushed for a while, N and s from its beginning."""
    axis, law = set_up(case)
    command, begun = 0.0, math.inf
    for k in range(450):
        if not math.isfinite(begun) and law.tare():
            begun = k * PERIOD
        hand = NO_HAND.copy()
        if begin <= k * PERIOD - begun < begin + seconds:
            hand[4] = newton * case.ratio
        _, position, velocity, current = axis.advance(command, hand)
        command = law.step(position, velocity, current, PAYLOAD_KG, time_s=(k + 1) * PERIOD)
    return law


def is_refused(law: ForceFreeController) -> bool:
    """Whether the tare was not used."""
    return any("is not used" in note for note in law.status.notes)
