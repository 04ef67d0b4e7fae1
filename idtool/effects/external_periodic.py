"""External periodic torque: something that beats in time (breathing, a pump, mains)."""

from __future__ import annotations

import math
from typing import final

import numpy as np

from idtool.effects.base import Coordinate, Effect, EffectParameter, Values, Wave, both_ways
from idtool.model.contribution import TORQUE
from idtool.model.jit import jit
from idtool.model.motion import Array, Motion
from idtool.model.row import Row

#: An axis moves above this share of its top speed, and at one speed where nine in ten of those rows are no
#: faster than so many times the slowest tenth.
_MOVING, _AS_FAST = 0.05, 1.3


@jit()
def at(row: Row, n: Array, memory: Array, total: Array) -> None:
    frequency, sine, cosine = n[0], n[1], n[2]
    angle = 2.0 * math.pi * frequency * row.time
    total[TORQUE] += sine * np.sin(angle) + cosine * np.cos(angle)


@final
class ExternalPeriodic(Effect):
    name = "external_periodic"
    title = "External periodic torque"
    follows = ("time",)
    formula = "A sin(2 pi f t + phi)"
    reveals = "anything long and slow, on a clock that runs on"
    look_alikes = ("position_ripple",)
    citation = "Ljung 1999, chapter 6 (periodogram)"
    parameters = (
        EffectParameter("frequency", "frequency", "f", 0.0),
        EffectParameter("amplitude", "torque", "A", 0.0),
        EffectParameter("phase", "phase", "phi, at time zero of the clock", -math.pi, math.pi),
    )
    coordinates = (
        Coordinate("sin"),
        Coordinate("cos"),
        Coordinate("frequency", null=1.0, lower=0.0, increment=1e-5),
    )

    at = staticmethod(at)

    def numbers(self, values: Values) -> tuple[float, ...]:
        return values["frequency"], values["sin"], values["cos"]

    def starts(self, motion: Motion) -> list[dict[str, float]]:
        return [{"frequency": self.wave(motion).lowest}]

    def wave(self, motion: Motion) -> Wave:
        """From two beats in the longest trial upwards."""
        ends = np.append(motion.starts[1:], len(motion)) - 1
        longest = max(float(np.max(motion.time[ends] - motion.time[motion.starts])), 1e-12)
        highest = 0.1 / float(np.median(motion.step[~motion.first]))
        return Wave("frequency", 2.0 * math.pi * motion.time, 2.0 / longest, highest)

    def untestable(self, motion: Motion) -> str | None:
        wave = self.wave(motion)
        if wave.highest <= wave.lowest:
            return "no trial is long enough to hold two beats"
        speed = np.abs(motion.velocity)
        moving = speed[speed > _MOVING * np.max(speed)]
        if not len(moving) or both_ways(motion):
            return None
        slow, fast = np.quantile(moving, [0.1, 0.9])
        told = "at one speed what repeats in time repeats over the position too: move at others, or both ways"
        return told if fast < _AS_FAST * slow else None

    def to_parameters(self, values: Values) -> dict[str, float]:
        return {
            "frequency": values["frequency"],
            "amplitude": math.hypot(values["sin"], values["cos"]),
            "phase": math.atan2(values["cos"], values["sin"]),
        }

    def to_values(self, parameters: Values) -> dict[str, float]:
        amplitude, phase = parameters["amplitude"], parameters["phase"]
        return {
            "frequency": parameters["frequency"],
            "sin": amplitude * math.cos(phase),
            "cos": amplitude * math.sin(phase),
        }
