"""Commands as positions at the drive's period: moves with soft and hard ramps, sines, swings."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from testbench.other_plants.motion import TICK
from testbench.other_plants.physics import Array

#: How a move gets to its speed: raised cosine, minimum jerk, constant acceleration, at once.
SMOOTH = ("s-curve", "minimum jerk")
HARD = ("trapezoid", "step")


def hold(at: float, seconds: float) -> Array:
    """Standing still."""
    return np.full(max(round(seconds / TICK), 1), at)


def move(start: float, end: float, speed: float, style: str, ramp: float) -> Array:
    """From one place to another at a speed; `ramp` is the time to get there, s."""
    way = end - start
    if style == "minimum jerk":
        x = np.linspace(0.0, 1.0, max(round(1.875 * abs(way) / speed / TICK), 2))
        return start + way * x**3 * (10.0 - 15.0 * x + 6.0 * x * x)
    ramp = 0.0 if style == "step" else min(ramp, 0.9 * abs(way) / speed)
    duration = abs(way) / speed + ramp
    t = np.arange(0.0, duration, TICK)
    if ramp == 0.0:
        return np.asarray(start + math.copysign(speed, way) * t)
    rise = np.clip(np.minimum(t, duration - t) / ramp, 0.0, 1.0)
    if style == "s-curve":
        rise = 0.5 - 0.5 * np.cos(math.pi * rise)
    travelled = np.cumsum(rise)
    return np.asarray(start + way * travelled / travelled[-1])


def back_and_forth(
    middle: float, travel: float, speed: float, times: int, style: str, ramp: float, dwell: float = 0.2
) -> Array:
    """Both ways, with a rest at each end."""
    low, high = middle - 0.5 * travel, middle + 0.5 * travel
    parts = [hold(low, dwell)]
    for _ in range(times):
        parts += [move(low, high, speed, style, ramp), hold(high, dwell)]
        parts += [move(high, low, speed, style, ramp), hold(low, dwell)]
    return np.concatenate(parts)


def multisine(
    rng: np.random.Generator,
    middle: float,
    reach: float,
    speed: float,
    frequencies: Sequence[float],
    seconds: float,
    soft: bool,
) -> Array:
    """Sum of sines with random phases inside a reach and a speed; a soft one fades in."""
    t = np.arange(0.0, seconds, TICK)
    total = np.zeros_like(t)
    for f in frequencies:
        total += np.sin(2.0 * math.pi * f * t + rng.uniform(-math.pi, math.pi)) / f
    total -= total[0]
    if soft:
        total *= 0.5 - 0.5 * np.cos(math.pi * np.clip(t / 1.0, 0.0, 1.0))
    fastest = float(np.max(np.abs(np.diff(total)))) / TICK
    scale = min(reach / float(np.max(np.abs(total))), speed / fastest)
    return np.asarray(middle + scale * total)


def swing_up(middle: float, reach: float, frequency: float, seconds: float) -> Array:
    """Swings that grow to the full reach."""
    t = np.arange(0.0, seconds, TICK)
    growth = np.clip(t / (0.7 * seconds), 0.0, 1.0)
    return np.asarray(middle + reach * growth * np.sin(2.0 * math.pi * frequency * t))


def staircase(
    rng: np.random.Generator, middle: float, reach: float, speed: float, moves: int, style: str
) -> Array:
    """Random point-to-point moves with rests of random length."""
    at = middle + reach * rng.uniform(-1.0, 1.0)
    parts = [hold(at, 0.3)]
    for _ in range(moves):
        to = middle + reach * rng.uniform(-1.0, 1.0)
        if abs(to - at) > 0.1 * reach:
            parts += [
                move(at, to, speed * rng.uniform(0.3, 1.0), style, 0.15),
                hold(to, rng.uniform(0.05, 0.5)),
            ]
            at = to
    return np.concatenate(parts)
