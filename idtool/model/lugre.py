"""The LuGre bristle, integrated exactly for a velocity that is constant over each step.

    dz/dt = w - rho |w| z,      rho = sigma0 / g(w)

Over a step h with constant w: with x = rho |w| h and E = exp(-x),

    z+ = E z + sgn(w) (1 - E) / rho

which is stable for every h (explicit Euler needs h < 2 / (rho |w|)). The state is linear in its
unknown start, z = z_forced + z_start * decay, and `decay` comes out as well.

Tangents are propagated alongside: every parameter of the friction level or the stiffness acts through
the logarithm of rho, so one formula serves them all,

    dz+ = E dz + [ sgn(w) (x E - (1 - E)) / rho - x E z ] dln(rho)

Source: Canudas de Wit et al., IEEE TAC 40(3), 1995 (the model); the step is the closed solution of a
linear equation.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from idtool.model.motion import Array

_SMALL = 1e-5  # below this x, 1 - exp(-x) - x exp(-x) loses its digits and x*x/2 is exact enough


@numba.njit(cache=True, fastmath=False)
def _pace(velocity: float, step: float, rho: float) -> tuple[float, float, float]:
    """x and E of a step, and what a straight bristle is bent by in it."""
    x = rho * abs(velocity) * step
    e = math.exp(-x)
    if x > _SMALL:
        return x, e, math.copysign((1.0 - e) / rho, velocity)
    return x, e, velocity * step * (1.0 - 0.5 * x)


@numba.njit(cache=True, fastmath=False)
def _propagate(
    velocity: Array,
    step: Array,
    rho: Array,
    first: NDArray[np.bool_],
    restart: NDArray[np.bool_],
    start: Array,
) -> tuple[Array, Array]:
    n = velocity.shape[0]
    z = np.empty(n)
    decay = np.empty(n)
    forced = 0.0  # the state from the trial's start on, had every start been zero
    fade = 1.0
    stretch = -1
    for k in range(n):
        if first[k]:
            forced = 0.0
        else:
            _, e, bent = _pace(velocity[k], step[k], rho[k])
            forced = e * forced + bent
            fade *= e
        if first[k] or restart[k]:
            stretch += 1
            fade = 1.0
        z[k] = forced + fade * start[stretch]
        decay[k] = fade
    return z, decay


@numba.njit(cache=True, fastmath=False)
def _propagate_tangents(
    velocity: Array,
    step: Array,
    rho: Array,
    first: NDArray[np.bool_],
    restart: NDArray[np.bool_],
    start: Array,
    dlog_rho: Array,
) -> tuple[Array, Array, Array]:
    n = velocity.shape[0]
    m = dlog_rho.shape[1]
    z = np.empty(n)
    decay = np.empty(n)
    tangents = np.empty((n, m))
    running = np.zeros(m)  # of the forced state
    fading = np.zeros(m)  # of -ln(fade)
    forced = 0.0
    fade = 1.0
    stretch = -1
    for k in range(n):
        if first[k]:
            forced = 0.0
            for j in range(m):
                running[j] = 0.0
        else:
            x, e, bent = _pace(velocity[k], step[k], rho[k])
            sensitivity = -x * e * forced
            if x > _SMALL:
                sensitivity -= math.copysign((1.0 - e - x * e) / rho[k], velocity[k])
            else:
                sensitivity -= 0.5 * x * velocity[k] * step[k]
            forced = e * forced + bent
            for j in range(m):
                running[j] = e * running[j] + sensitivity * dlog_rho[k, j]
                fading[j] += x * dlog_rho[k, j]
            fade *= e
        if first[k] or restart[k]:
            stretch += 1
            fade = 1.0
            for j in range(m):
                fading[j] = 0.0
        left = fade * start[stretch]
        z[k] = forced + left
        decay[k] = fade
        for j in range(m):
            tangents[k, j] = running[j] - left * fading[j]
    return z, decay, tangents


def propagate(
    velocity: Array,
    step: Array,
    rho: Array,
    first: NDArray[np.bool_],
    start: Array,
    restart: NDArray[np.bool_] | None = None,
) -> tuple[Array, Array]:
    """Bristle deflection of every row.

    Args:
        velocity: mean velocity over the step that ends at each row, shape (rows,).
        step: duration of that step, s, shape (rows,).
        rho: sigma0 / g over that step, 1/rad (1/m), above zero, shape (rows,).
        first: True at the first row of each trial, shape (rows,).
        start: deflection at the start of each stretch: that of a trial, and from each restart on the
            deflection beside that of a trial that started at zero, shape (stretches,).
        restart: True where a rest ends, shape (rows,); None: nowhere.

    Returns:
        Deflection z, rad (m), and the factor by which the stretch's start has decayed; (rows,) each.
    """
    z, decay = _propagate(velocity, step, rho, first, _nowhere(first, restart), start)
    return z, decay


def propagate_tangents(
    velocity: Array,
    step: Array,
    rho: Array,
    first: NDArray[np.bool_],
    start: Array,
    dlog_rho: Array,
    restart: NDArray[np.bool_] | None = None,
) -> tuple[Array, Array, Array]:
    """As `propagate`, with derivatives.

    Args:
        dlog_rho: derivative of ln(rho) over each step with respect to each parameter,
            shape (rows, parameters).

    Returns:
        z, decay, and dz with shape (rows, parameters).
    """
    at = _nowhere(first, restart)
    z, decay, tangents = _propagate_tangents(velocity, step, rho, first, at, start, dlog_rho)
    return z, decay, tangents


def _nowhere(first: NDArray[np.bool_], restart: NDArray[np.bool_] | None) -> NDArray[np.bool_]:
    return np.zeros(len(first), dtype=bool) if restart is None else restart
