"""Tails of distributions; as scipy.special, whose import takes longer than a fit.

Source: Press et al., Numerical Recipes, 3rd ed. 2007, sections 6.2, 6.4 and 6.14.
"""

from __future__ import annotations

import math

import numpy as np

from idtool.model.jit import jit
from idtool.model.motion import Array

#: Steps of the continued fraction and of Newton's method at most, and where both end.
_STEPS, _EXACT = 20_000, 1e-15
#: Distances from which on the alternating series is short.
_FAR = 1.0
#: Distance that one of 20 samples of noise reaches (Kolmogorov's distribution).
KOLMOGOROV_95 = 1.3580986393225507


def student_quantile(degrees: Array, share: float) -> Array:
    """Quantile of Student's distribution at degrees of freedom of 1 or more; the share is above a half."""
    start = {0.95: 1.6448536269514722, 0.975: 1.959963984540054}[share]
    return _student_quantiles(np.asarray(degrees, dtype=float), share, start)


def f_tail(first: float, second: float, value: float) -> float:
    """Chance that an F-distributed number is larger."""
    return float(_beta_share(0.5 * second, 0.5 * first, second / (second + first * value)))


def gamma_tail(count: int, value: float) -> float:
    """Chance that the sum of so many exponential numbers of mean 1 is larger (Erlang)."""
    if value <= 0.0:
        return 1.0
    fewer = np.arange(1, count)
    logs = np.append(0.0, np.cumsum(math.log(value) - np.log(fewer)))
    most = float(logs.max())
    return min(1.0, math.exp(most - value) * float(np.exp(logs - most).sum()))


def kolmogorov_tail(distance: float) -> float:
    """Chance that noise is further from its distribution, in units of the root of the number of samples."""
    if distance <= 0.0:
        return 1.0
    if distance < _FAR:
        odd = np.arange(1, 20, 2)
        terms = np.exp(-((odd * math.pi / distance) ** 2) / 8.0)
        return 1.0 - math.sqrt(2.0 * math.pi) / distance * float(terms.sum())
    k = np.arange(1, 11)
    return 2.0 * float(np.sum((-1.0) ** (k - 1) * np.exp(-2.0 * (k * distance) ** 2)))


@jit()
def _student_quantiles(degrees: Array, share: float, start: float) -> Array:
    """By Newton's method from the quantile of the normal distribution, which lies before it."""
    result = np.empty(len(degrees))
    for i in range(len(degrees)):
        n, t = degrees[i], start
        size = math.exp(math.lgamma(0.5 * (n + 1.0)) - math.lgamma(0.5 * n)) / math.sqrt(n * math.pi)
        for _ in range(_STEPS):
            missing = 0.5 * _beta_share(0.5 * n, 0.5, n / (n + t * t)) - (1.0 - share)
            step = missing / (size * (1.0 + t * t / n) ** (-0.5 * (n + 1.0)))
            t += step
            if abs(step) <= 1e-12 * t:
                break
        result[i] = t
    return result


@jit()
def _beta_share(a: float, b: float, x: float) -> float:
    """The regularised incomplete beta function I_x(a, b)."""
    if x <= 0.0 or x >= 1.0:
        return 0.0 if x <= 0.0 else 1.0
    front = math.exp(
        math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b) + a * math.log(x) + b * math.log1p(-x)
    )
    if x < (a + 1.0) / (a + b + 2.0):
        return front * _fraction(a, b, x) / a
    return 1.0 - front * _fraction(b, a, 1.0 - x) / b


@jit()
def _fraction(a: float, b: float, x: float) -> float:
    """The continued fraction of the incomplete beta function, by Lentz's method."""
    c, d = 1.0, 1.0 / (1.0 - (a + b) * x / (a + 1.0))
    value = d
    for m in range(1, _STEPS):
        before = value
        for term in (
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m)),
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0)),
        ):
            c, d = 1.0 + term / c, 1.0 / (1.0 + term * d)
            value *= c * d
        if abs(value - before) <= _EXACT * abs(value):
            break
    return value
