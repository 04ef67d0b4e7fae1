"""Motions as arrays of velocity commands: they start and end at rest and nothing in them is abrupt.

A motion knows how long it takes before any array is made, so that a recipe that asks for too much is
refused without filling the memory. Speeds are rad/s on a rotary axis and m/s on a linear one,
distances rad or m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from idtool.model.motion import Array

#: Fewest samples in a ramp: below it the staircase of commands is a step again.
_FEWEST = 4


class Motion(Protocol):
    """What a trial does."""

    @property
    def duration_s(self) -> float:
        """How long it takes, to within a few samples."""
        ...

    @property
    def highest_frequency_hz(self) -> float:
        """The fastest sine in it, 0 if there is none."""
        ...

    def command(self, period: float) -> Array:
        """Velocity commands `period` seconds apart, shape (samples,)."""
        ...


@dataclass(frozen=True)
class BackAndForth:
    """Constant speed forwards over a travel, then back.

    Attributes:
        speed: rad/s (m/s).
        travel: distance of one way, ramps included, rad (m).
        acceleration: highest acceleration of the ramps, rad/s2 (m/s2).
        repeats: how many times there and back.
        dwell_s: rest before each way and after the last.
    """

    speed: float
    travel: float
    acceleration: float
    repeats: int = 1
    dwell_s: float = 0.0

    highest_frequency_hz: float = 0.0

    @property
    def ramp_s(self) -> float:
        """Time of one ramp: half a cosine over T reaches the acceleration pi/2 * speed / T at its middle."""
        return 0.5 * math.pi * self.speed / self.acceleration

    @property
    def ramp_travel(self) -> float:
        """Distance that the two ramps of one way take, rad (m)."""
        return self.speed * self.ramp_s

    @property
    def duration_s(self) -> float:
        """How long it takes."""
        one_way = self.travel / self.speed + self.ramp_s
        return 2.0 * self.repeats * (one_way + self.dwell_s) + self.dwell_s

    def command(self, period: float) -> Array:
        """Velocity commands, shape (samples,)."""
        rise = max(math.ceil(self.ramp_s / period), _FEWEST)
        cruise = max(round((self.travel / self.speed) / period) - rise, 0)
        up = self.speed * blend(rise)
        one_way = np.concatenate([up, np.full(cruise, self.speed), up[::-1]])
        rest = np.zeros(round(self.dwell_s / period))
        return np.concatenate([np.tile(np.concatenate([rest, one_way, rest, -one_way]), self.repeats), rest])


@dataclass(frozen=True)
class Sines:
    """A sum of velocity sines of equal amplitude, faded in and out.

    Attributes:
        frequencies_hz: one is a plain sine.
        amplitude: largest speed of the sum, rad/s (m/s).
        duration_s: how long it takes.
    """

    frequencies_hz: tuple[float, ...]
    amplitude: float
    duration_s: float

    @property
    def highest_frequency_hz(self) -> float:
        """The fastest sine."""
        return max(self.frequencies_hz)

    def command(self, period: float) -> Array:
        """Velocity commands, shape (samples,)."""
        time = period * np.arange(round(self.duration_s / period))
        several = len(self.frequencies_hz) > 1
        total = np.zeros(len(time))
        for k, frequency in enumerate(self.frequencies_hz):
            # the golden angle spreads the phases, so that the peaks do not fall together
            total += np.sin(2.0 * np.pi * frequency * time + (k * 2.399963 if several else 0.0))
        total *= fade(len(time), min(self.frequencies_hz), period)
        return np.asarray(total * self.amplitude / max(float(np.max(np.abs(total))), 1e-12))


def blend(samples: int) -> Array:
    """A smooth rise from 0 to 1 (half a cosine), shape (samples,)."""
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * (np.arange(samples) + 0.5) / samples))


def fade(samples: int, slowest_hz: float, period: float) -> Array:
    """An envelope that rises and falls within an eighth of the slowest period, shape (samples,)."""
    rise = int(min(max(round(0.125 / slowest_hz / period), _FEWEST), samples // 4))
    envelope = np.ones(samples)
    envelope[:rise] = blend(rise)
    envelope[samples - rise :] = blend(rise)[::-1]
    return envelope


def excursion(command: Array, period: float) -> tuple[float, float]:
    """Lowest and highest position that velocity commands reach, from where they start."""
    position = period * np.cumsum(command)
    return min(0.0, float(position.min())), max(0.0, float(position.max()))
