"""The lowest place of a function of one number between two bounds.

The steps are those of Brent's `fminbound` (parabolas, and golden sections where they do not help), which is
`scipy.optimize.minimize_scalar(method="bounded")` too: the same cost ends at the same place. Importing
scipy.optimize for it takes longer than reading a log does.

Reference: Brent, Algorithms for Minimization without Derivatives (1973), chapter 5.
"""

from __future__ import annotations

import math
from collections.abc import Callable

#: Share of a golden section, and how near two places may be: a parabola is flat to rounding within the root
#: of what a float rounds to. Both as in `fminbound`.
_GOLDEN = 0.5 * (3.0 - math.sqrt(5.0))
_SMALL = math.sqrt(2.2e-16)


def bounded_minimum(cost: Callable[[float], float], low: float, high: float, *, within: float) -> float:
    """Where `cost` is lowest between `low` and `high`, to about `within`; one of its minima, if several."""
    # best, second and third place so far, and the last two steps
    best = second = third = low + _GOLDEN * (high - low)
    at_best = at_second = at_third = cost(best)
    step = before = 0.0
    while True:
        middle = 0.5 * (low + high)
        least = _SMALL * abs(best) + within / 3.0
        if abs(best - middle) <= 2.0 * least - 0.5 * (high - low):
            return best
        golden = True
        if abs(before) > least:
            r = (best - second) * (at_best - at_third)
            q = (best - third) * (at_best - at_second)
            p = (best - third) * q - (best - second) * r
            q = 2.0 * (q - r)
            p, q = (-p if q > 0.0 else p), abs(q)
            last, before = before, step
            if abs(p) < abs(0.5 * q * last) and q * (low - best) < p < q * (high - best):
                golden = False
                step = p / q
                if best + step - low < 2.0 * least or high - best - step < 2.0 * least:
                    step = least if middle >= best else -least
        if golden:
            before = low - best if best >= middle else high - best
            step = _GOLDEN * before
        place = best + (max(step, least) if step >= 0.0 else min(step, -least))
        value = cost(place)
        if value <= at_best:
            low, high = (best, high) if place >= best else (low, best)
            third, at_third, second, at_second = second, at_second, best, at_best
            best, at_best = place, value
            continue
        low, high = (place, high) if place < best else (low, place)
        if value <= at_second or second == best:
            third, at_third, second, at_second = second, at_second, place, value
        elif value <= at_third or third in (best, second):
            third, at_third = place, value
