"""Bounded least squares where rows outnumber parameters by hundreds.

Levenberg-Marquardt on the normal equations, scaled by the columns' sizes (More 1978), damped as by Nielsen
(Madsen, Nielsen & Tingleff, Methods for Non-Linear Least Squares Problems, 2004), with steps cut off at
the bounds and the coordinates that press against one left out of the step. SciPy's bounded solvers decompose
the whole Jacobian at every iteration, which takes longer than computing it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from idtool.fit.outcome import Outcome
from idtool.model.motion import Array

#: Damping of the first step, relative to the diagonal (Marquardt 1963), and beyond which none is tried.
_FIRST_DAMPING = 1e-3
_MOST_DAMPING = 1e12
#: Keeps what no row determines where it is.
_LEAST_DAMPING = 1e-10
#: A search that ends where steps promise more than this share of the sum of squares, and none of them gains
#: anything, found no minimum.
_STALL = 0.01


@dataclass(frozen=True)
class Minimum:
    """Where a search ended.

    Attributes:
        x: the point, inside the bounds.
        cost: the sum of squares there.
        evaluations: how often the residual was computed.
        outcome: how it ended.
    """

    x: Array
    cost: float
    evaluations: int
    outcome: Outcome


def minimise(
    residual: Callable[[Array], Array],
    jacobian: Callable[[Array], Array],
    x: Array,
    low: Array,
    high: Array,
    *,
    most: int,
    tolerance: float = 1e-7,
    reach: Array | float = math.inf,
    secant: bool = False,
) -> Minimum:
    """Minimise the sum of squares of `residual`.

    Args:
        residual: of coordinates, shape (rows,).
        jacobian: its derivative, (rows, coordinates); called at points where `residual` was called.
        x: start, shape (coordinates,).
        low, high: bounds.
        most: evaluations to spend at most.
        tolerance: a step that lowers the sum by less than this share of it, or moves by less than this share
            of the coordinates' scale, is the last.
        reach: how far a step may take each coordinate, shape (coordinates,).
        secant: whether a step that failed corrects the derivative along it (Broyden 1965): for a residual
            with kinks and jumps, of which the derivative at a point says little.
    """
    x = np.clip(x, low, high)
    r = residual(x)
    cost, evaluations, damping, raise_by = float(r @ r), 1, _FIRST_DAMPING, 2.0
    size = np.zeros(len(x))
    while evaluations < most:
        j = jacobian(x)
        gradient, information = j.T @ r, j.T @ j
        size = np.maximum(size, np.sqrt(np.diag(information)))
        scale = np.where(size > 0.0, size, 1.0)
        free = ~((x <= low) & (gradient > 0.0)) & ~((x >= high) & (gradient < 0.0))
        if not free.any():
            return Minimum(x, cost, evaluations, Outcome.AT_BOUND)
        most_promised = 0.0
        while True:
            step = _step(
                information / np.outer(scale, scale),
                gradient / scale,
                damping,
                free,
                np.maximum(low - x, -reach) * scale,
                np.minimum(high - x, reach) * scale,
            )
            tried = np.clip(x + step / scale, low, high)
            step = tried - x
            promised = -float(2.0 * gradient @ step + step @ information @ step)
            r_tried = residual(tried)
            evaluations += 1
            new = float(r_tried @ r_tried)
            if new < cost:
                break
            if secant:
                along = step * scale**2
                j = j + np.outer(r_tried - r - j @ step, along / (along @ step))
                gradient, information = j.T @ r, j.T @ j
            damping, raise_by = damping * raise_by, 2.0 * raise_by
            most_promised = max(most_promised, promised)
            if evaluations >= most or damping > _MOST_DAMPING or abs(promised) < tolerance * cost:
                failed = Outcome.OUT_OF_EVALUATIONS if evaluations >= most else Outcome.STALLED
                ended = failed if most_promised > _STALL * cost else Outcome.CONVERGED
                return Minimum(x, cost, evaluations, ended.at(bound=_touches(x, low, high)))
        ratio = min((cost - new) / max(promised, 1e-300), 2.0)
        damping, raise_by = damping * max(1.0 / 3.0, 1.0 - (2.0 * ratio - 1.0) ** 3), 2.0
        gained = (cost - new) / cost
        moved = float(np.linalg.norm(step * scale)) / max(float(np.linalg.norm(x * scale)), 1e-300)
        # what has only now come to a bound may turn back as soon as the others have followed
        arrived = bool(np.any(((tried <= low) & (x > low)) | ((tried >= high) & (x < high))))
        x, r, cost = tried, r_tried, new
        if cost == 0.0 or (not arrived and (gained < tolerance or moved < tolerance)):
            return Minimum(x, cost, evaluations, Outcome.CONVERGED.at(bound=_touches(x, low, high)))
    return Minimum(x, cost, evaluations, Outcome.OUT_OF_EVALUATIONS)


def _touches(x: Array, low: Array, high: Array) -> bool:
    return bool(np.any((x <= low) | (x >= high)))


def _step(
    information: Array, gradient: Array, damping: float, free: NDArray[np.bool_], low: Array, high: Array
) -> Array:
    """The damped step; a coordinate that would leave its range goes to the end of it, and the others do the
    best that they can beside."""
    step, free = np.zeros(len(gradient)), free.copy()
    while free.any():
        matrix = information[np.ix_(free, free)] + max(damping, _LEAST_DAMPING) * np.eye(int(free.sum()))
        downhill = -gradient[free] - information[np.ix_(free, ~free)] @ step[~free]
        step[free] = np.linalg.solve(matrix, downhill)
        out = free & ((step < low) | (step > high))
        if not out.any():
            break
        step[out] = np.clip(step[out], low[out], high[out])
        free &= ~out
    return step
