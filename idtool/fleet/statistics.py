"""Spread between units, units and sessions that stand out, and drift over dates, all robust.

Sources: median absolute deviation with its factors for small samples, Croux & Rousseeuw 1992; the
modified z-score, Iglewicz & Hoaglin 1993, with limits from simulation instead of their 3.5; Sen's slope
and Kendall's test within blocks (here: units), Hirsch, Slack & Smith 1982.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy import special

from idtool.model.motion import Array

#: Chance that any of so many normal values is called an outlier.
FALSE_ALARM = 0.01
#: With fewer values nothing can be said to stand out.
LEAST_VALUES = 5
#: Of the Julian calendar.
DAYS_PER_YEAR = 365.25
#: Factor of the median absolute deviation of so few values (Croux & Rousseeuw 1992).
_SMALL_SAMPLE = {2: 1.196, 3: 1.495, 4: 1.363, 5: 1.206, 6: 1.200, 7: 1.140, 8: 1.129, 9: 1.107}
#: Samples whose `FALSE_ALARM` quantile is looked up: 200 lie beyond it.
_SIMULATED = 20_000
#: Half of normal values lie within so many standard deviations.
_HALF = 0.6744897501960817


@dataclass(frozen=True)
class Drift:
    """How a parameter changes with time, units apart.

    Attributes:
        per_year: median of the slopes between any two sessions of one unit, per year.
        p_value: of no trend in any unit (Kendall's test within units).
        sessions: that took part.
    """

    per_year: float
    p_value: float
    sessions: int


def spread(values: Array) -> float:
    """Standard deviation of normal values, from their median absolute deviation; NaN below two values."""
    return float(_deviation(values)) if len(values) > 1 else float("nan")


def _deviation(values: Array) -> Array:
    """Median absolute deviation along the last axis, as the standard deviation of so many normal values."""
    count = values.shape[-1]
    factor = _SMALL_SAMPLE.get(count, count / (count - 0.8))
    away = np.abs(values - np.median(values, axis=-1, keepdims=True))
    return np.asarray(factor * (np.median(away, axis=-1) / _HALF))


@cache
def limit(count: int) -> float:
    """Beyond how many spreads from the median a value stands out among `count` values."""
    rng = np.random.default_rng(count)
    repeats = max(200, min(_SIMULATED, 4_000_000 // count))
    values = rng.standard_normal((repeats, count))
    away = np.abs(values - np.median(values, axis=1, keepdims=True))
    return float(np.quantile(away.max(axis=1) / _deviation(values), 1.0 - FALSE_ALARM))


def outliers(values: Array, stderr: Array) -> np.ndarray:
    """Which values stand out, shape of `values`.

    Args:
        values: one per unit or session.
        stderr: their standard errors; values are never taken to lie closer together than these allow.
    """
    if len(values) < LEAST_VALUES:
        return np.zeros(len(values), dtype=bool)
    known = stderr[np.isfinite(stderr)]
    scale = max(spread(values), float(np.median(known)) if len(known) else 0.0)
    if scale <= 0.0:
        return np.zeros(len(values), dtype=bool)
    return np.asarray(np.abs(values - np.median(values)) > limit(len(values)) * scale)


def repeatability(blocks: Sequence[Array]) -> float:
    """Standard deviation of a session about its unit, robust against single units; NaN without any.

    Args:
        blocks: values of each unit that has two sessions or more.
    """
    found = [_block_spread(values[None, :])[0] for values in blocks]
    return float(np.median(found)) if found else float("nan")


def odd_sessions(blocks: Sequence[Array]) -> list[np.ndarray]:
    """Which sessions stand out from the others of their unit, a mask per unit.

    Args:
        blocks: values of each unit that has three sessions or more; of two nobody knows which is the odd one.
    """
    scale = repeatability(blocks)
    if sum(map(len, blocks)) < LEAST_VALUES or not scale > 0.0:
        return [np.zeros(len(values), dtype=bool) for values in blocks]
    far = _block_limit(tuple(sorted(map(len, blocks)))) * scale
    return [np.abs(values - np.median(values)) > far for values in blocks]


def _block_spread(values: Array) -> Array:
    """Standard deviations along the last axis, scaled so that their median is right for normal values."""
    free = values.shape[-1] - 1
    median = 2.0 * special.gammaincinv(0.5 * free, 0.5)  # of chi squared
    return np.asarray(values.std(axis=-1, ddof=1) / np.sqrt(median / free))


@cache
def _block_limit(sizes: tuple[int, ...]) -> float:
    """As `limit`, for sessions of units with so many each."""
    rng = np.random.default_rng(len(sizes))
    repeats = max(200, min(_SIMULATED, 2_000_000 // sum(sizes)))
    draws = [rng.standard_normal((repeats, size)) for size in sizes]
    away = [np.abs(one - np.median(one, axis=1, keepdims=True)).max(axis=1) for one in draws]
    scale = np.median([_block_spread(one) for one in draws], axis=0)
    return float(np.quantile(np.max(away, axis=0) / scale, 1.0 - FALSE_ALARM))


def drift(blocks: Sequence[tuple[Array, Array]]) -> Drift | None:
    """Trend over time that units have in common, whatever their levels.

    Args:
        blocks: (days, values) of each unit.

    Returns:
        The trend, or None where no unit has two sessions on different days.
    """
    score, variance, sessions = 0.0, 0.0, 0
    slopes: list[Array] = []
    for days, values in blocks:
        first, second = np.triu_indices(len(days), 1)
        apart = days[second] - days[first]
        if not np.any(apart):
            continue
        change = (values[second] - values[first])[apart != 0]
        slopes.append(change / apart[apart != 0] * DAYS_PER_YEAR)
        score += float(np.sum(np.sign(change) * np.sign(apart[apart != 0])))
        n = len(days)
        variance += n * (n - 1) * (2 * n + 5) / 18.0
        sessions += n
    if not slopes:
        return None
    # with the correction for continuity
    z = (abs(score) - 1.0) / variance**0.5 if score else 0.0
    p_value = float(2.0 * special.ndtr(-max(z, 0.0)))
    return Drift(float(np.median(np.concatenate(slopes))), min(p_value, 1.0), sessions)
