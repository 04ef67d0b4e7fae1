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
#: Each clock has a phase of its own, which takes two numbers.
_MOST_CLOCKS = 6


@jit()
def at(row: Row, n: Array, memory: Array, total: Array) -> None:
    """The frequency, then sine and cosine of each clock; on one that is not known the phase is not either."""
    angle = 2.0 * math.pi * n[0] * row.time
    s, c = np.sin(angle), np.cos(angle)
    for k in range(1, len(n), 2):
        total[TORQUE] += (row.clock == k // 2) * (n[k] * s + n[k + 1] * c)


def _suffix(clock: int) -> str:
    """What the names of a clock's numbers end with; those of the first have none."""
    return f"_{clock + 1}" if clock else ""


def _clocks(values: Values, name: str) -> list[str]:
    """Suffix of every clock that has a number of that name."""
    return [own for own in map(_suffix, range(_MOST_CLOCKS)) if f"{name}{own}" in values]


def _coordinates(clocks: int) -> tuple[Coordinate, ...]:
    strengths = (Coordinate(f"{part}{_suffix(k)}") for k in range(clocks) for part in ("sin", "cos"))
    return (*strengths, Coordinate("frequency", null=1.0, lower=0.0, increment=1e-5))


def _parameters(clock: int) -> tuple[EffectParameter, ...]:
    own, later = _suffix(clock), clock > 0
    of = f", on clock {clock + 1}" if later else ""
    told = f"phi{of}, at time zero of the clock"
    return (
        EffectParameter(f"amplitude{own}", "torque", f"A{of}", 0.0, optional=later),
        EffectParameter(f"phase{own}", "phase", told, -math.pi, math.pi, optional=later),
    )


@final
class ExternalPeriodic(Effect):
    """One frequency, with an amplitude and a phase on each clock: of recordings whose clocks each start at
    zero nothing tells how far apart they were made."""

    name = "external_periodic"
    title = "External periodic torque"
    follows = ("time",)
    formula = "A sin(2 pi f t + phi)"
    reveals = "anything long and slow"
    look_alikes = ("position_ripple",)
    citation = "Ljung 1999, chapter 6 (periodogram)"
    parameters = (
        EffectParameter("frequency", "frequency", "f", 0.0),
        *(parameter for clock in range(_MOST_CLOCKS) for parameter in _parameters(clock)),
    )
    coordinates = _coordinates(_MOST_CLOCKS)

    at = staticmethod(at)

    def numbers(self, values: Values) -> tuple[float, ...]:
        clocks = _clocks(values, "sin")
        return values["frequency"], *(values[part + own] for own in clocks for part in ("sin", "cos"))

    def active(self, motion: Motion) -> tuple[Coordinate, ...]:
        return _coordinates(_count(motion))

    def starts(self, motion: Motion) -> list[dict[str, float]]:
        return [{"frequency": self.wave(motion).lowest}]

    def wave(self, motion: Motion) -> Wave:
        """From two beats in the longest trial upwards."""
        longest = max(float(np.max(motion.time[motion.ends - 1] - motion.time[motion.starts])), 1e-12)
        highest = 0.1 / motion.period
        angle = 2.0 * math.pi * motion.time
        return Wave("frequency", angle, 2.0 / longest, highest, part=motion.clock)

    def untestable(self, motion: Motion) -> str | None:
        if (clocks := _count(motion)) > _MOST_CLOCKS:
            return f"time_s starts anew {clocks - 1} times, with a phase of its own each: let it run on"
        wave = self.wave(motion)
        if wave.highest <= wave.lowest:
            return "no trial is long enough to hold two beats"
        speed = np.abs(motion.velocity)
        moving = speed[speed > _MOVING * np.max(speed)]
        if not len(moving) or both_ways(motion.velocity):
            return None
        slow, fast = np.quantile(moving, [0.1, 0.9])
        told = "at one speed what repeats in time repeats over the position too: move at others, or both ways"
        return told if fast < _AS_FAST * slow else None

    def to_parameters(self, values: Values) -> dict[str, float]:
        result = {"frequency": values["frequency"]}
        for own in _clocks(values, "sin"):
            sine, cosine = values[f"sin{own}"], values[f"cos{own}"]
            result[f"amplitude{own}"] = math.hypot(sine, cosine)
            result[f"phase{own}"] = math.atan2(cosine, sine)
        return result

    def to_values(self, parameters: Values) -> dict[str, float]:
        result = {"frequency": parameters["frequency"]}
        for own in _clocks(parameters, "amplitude"):
            amplitude, phase = parameters[f"amplitude{own}"], parameters[f"phase{own}"]
            result[f"sin{own}"] = amplitude * math.cos(phase)
            result[f"cos{own}"] = amplitude * math.sin(phase)
        return result


def _count(motion: Motion) -> int:
    """How many clocks; trials that are held out do not change it."""
    return int(np.max(motion.clock)) + 1
