"""The lowest point of a function of one number between two bounds: Brent's method.

A parabola through the three best points where it can be trusted, else the golden section.

Source: Brent, Algorithms for Minimization without Derivatives, 1973, chapter 5; the same points as
`scipy.optimize.minimize_scalar(method="bounded")`, whose import takes longer than most fits.
"""

from __future__ import annotations

import math
from collections.abc import Callable

_GOLDEN = 0.5 * (3.0 - math.sqrt(5.0))
#: Two points closer than this share of their size differ by rounding alone.
_ROUNDING = math.sqrt(2.2e-16)
_MOST = 500


def lowest(cost: Callable[[float], float], low: float, high: float, tolerance: float) -> float:
    """Where `cost` is lowest, to within `tolerance`; one of its valleys where it has several.

    Args:
        cost: of a number between the bounds, which themselves are never tried.
        low, high: the bounds.
        tolerance: above zero, in the unit of the bounds.
    """
    best = second = third = low + _GOLDEN * (high - low)
    at_best = at_second = at_third = cost(best)
    step = before = 0.0
    for _ in range(_MOST - 1):
        middle = 0.5 * (low + high)
        least = _ROUNDING * abs(best) + tolerance / 3.0
        if abs(best - middle) <= 2.0 * least - 0.5 * (high - low):
            break
        parabolic = False
        if abs(before) > least:
            # the parabola through the three points is lowest at best + p / q
            r = (best - second) * (at_best - at_third)
            q = (best - third) * (at_best - at_second)
            p = (best - third) * q - (best - second) * r
            q = 2.0 * (q - r)
            p, q = (-p if q > 0.0 else p), abs(q)
            parabolic = abs(p) < abs(0.5 * q * before) and q * (low - best) < p < q * (high - best)
            before = step
        if parabolic:
            step = p / q
            if min(best + step - low, high - best - step) < 2.0 * least:
                step = math.copysign(least, middle - best)
        else:
            before = low - best if best >= middle else high - best
            step = _GOLDEN * before
        tried = best + math.copysign(max(abs(step), least), step)
        at_tried = cost(tried)
        if at_tried <= at_best:
            low, high = (best, high) if tried >= best else (low, best)
            third, at_third, second, at_second = second, at_second, best, at_best
            best, at_best = tried, at_tried
            continue
        low, high = (tried, high) if tried < best else (low, tried)
        if at_tried <= at_second or second == best:
            third, at_third, second, at_second = second, at_second, tried, at_tried
        elif at_tried <= at_third or third in (best, second):
            third, at_third = tried, at_tried
    return best
