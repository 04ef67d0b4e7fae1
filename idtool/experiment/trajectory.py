"""Motions as arrays of velocity commands: they start and end at rest and nothing in them is abrupt."""

from __future__ import annotations

import math

import numpy as np

from idtool.model.motion import Array


def blend(samples: int) -> Array:
    """A smooth rise from 0 to 1 (half a cosine), shape (samples,)."""
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * (np.arange(samples) + 0.5) / samples))


def back_and_forth(speed: float, travel: float, repeats: int, acceleration: float, period: float) -> Array:
    """Constant speed forwards over `travel`, then back, `repeats` times.

    Args:
        speed: rad/s (m/s).
        travel: distance of one way, ramps included, rad (m).
        repeats: how many times there and back.
        acceleration: highest acceleration of the ramps, rad/s2 (m/s2).
        period: of the commands, s.

    Returns:
        Velocity commands, shape (samples,).
    """
    # half a cosine over T reaches the acceleration pi/2 * speed / T at its middle
    rise = max(math.ceil(0.5 * math.pi * speed / acceleration / period), 4)
    cruise = max(round((travel / speed) / period) - rise, 1)
    up = speed * blend(rise)
    one_way = np.concatenate([up, np.full(cruise, speed), up[::-1]])
    return np.tile(np.concatenate([one_way, -one_way]), repeats)


def multisine(frequencies: list[float], amplitude: float, duration: float, period: float) -> Array:
    """A sum of velocity sines of equal amplitude whose peak is `amplitude`, faded in and out.

    Args:
        frequencies: Hz; one is a plain sine.
        amplitude: largest speed, rad/s (m/s).
        duration: s.
        period: of the commands, s.

    Returns:
        Velocity commands, shape (samples,).
    """
    time = period * np.arange(round(duration / period))
    # the golden angle spreads the phases, so that the peaks do not fall together
    total = sum(
        np.sin(2.0 * np.pi * f * time + (k * 2.399963 if len(frequencies) > 1 else 0.0))
        for k, f in enumerate(frequencies)
    )
    command = np.asarray(total) * fade(len(time), min(frequencies), period)
    return np.asarray(command * amplitude / max(float(np.max(np.abs(command))), 1e-12))


def fade(samples: int, slowest: float, period: float) -> Array:
    """An envelope that rises and falls within an eighth of the slowest period."""
    rise = int(min(max(round(0.125 / slowest / period), 4), samples // 4))
    envelope = np.ones(samples)
    envelope[:rise] = blend(rise)
    envelope[samples - rise :] = blend(rise)[::-1]
    return envelope


def excursion(command: Array, period: float) -> tuple[float, float]:
    """Lowest and highest position that velocity commands reach, from where they start."""
    position = period * np.cumsum(command)
    return min(0.0, float(position.min())), max(0.0, float(position.max()))
