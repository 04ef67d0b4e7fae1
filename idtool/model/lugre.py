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
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from idtool.model.jit import jit
from idtool.model.motion import Array

#: Tangents that are propagated at a time.
BLOCK = 4
_SMALL = 1e-5  # below this x, 1 - exp(-x) - x exp(-x) loses its digits and x*x/2 is exact enough


@jit()
def _pace(velocity: float, step: float, rho: float) -> tuple[float, float, float]:
    """x and E of a step, and what a straight bristle is bent by in it."""
    x = rho * abs(velocity) * step
    e = math.exp(-x)
    if x > _SMALL:
        return x, e, math.copysign((1.0 - e) / rho, velocity)
    return x, e, velocity * step * (1.0 - 0.5 * x)


@jit()
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


@jit()
def columns_of_shape(
    velocity: Array,
    way: Array,
    signed_level: Array,
    pace: Array,
    kept: Array,
    rho_speed: Array,
    first: NDArray[np.bool_],
    restart: NDArray[np.bool_],
    start: Array,
    bend: float,
) -> Array:
    """What a search over the shape of friction solves for, of every row, shape (rows, 4): what a start adds
    through sigma0 and through sigma1, the bristle at a level of 1 (z / bend), and its rate.

    As `propagate`, for rho = 1 / (bend g) where g is the level in units of one; without a division, and the
    exponentials are the caller's, since numpy computes several of them at a time.

    Args:
        velocity: of the rows, shape (rows,).
        way: velocity times duration of each step, shape (rows,).
        signed_level: sgn(w) g of each step, shape (rows,).
        pace: |w| h / g of each step, shape (rows,).
        kept: exp(-pace / bend), shape (rows,).
        rho_speed: |w| / g of each row, shape (rows,).
        first, restart, start: see `propagate`.
        bend: deflection at a level of 1, rad (m).
    """
    columns = np.empty((len(velocity), 4))
    per = 1.0 / bend
    forced = 0.0
    fade = 1.0
    stretch = -1
    for k in range(len(velocity)):
        if first[k]:
            forced = 0.0
        else:
            x, e = pace[k] * per, kept[k]
            straight = way[k] * (1.0 - 0.5 * x)
            forced = e * forced + ((1.0 - e) * signed_level[k] * bend if x > _SMALL else straight)
            fade *= e
        if first[k] or restart[k]:
            stretch += 1
            fade = 1.0
        z, rate = forced + fade * start[stretch], rho_speed[k] * per
        columns[k, 0] = fade * per
        columns[k, 1] = rate * fade
        columns[k, 2] = z * per
        columns[k, 3] = velocity[k] - rate * z
    return columns


@jit()
def _propagate_pace(
    velocity: Array,
    step: Array,
    rho: Array,
    first: NDArray[np.bool_],
    restart: NDArray[np.bool_],
    start: Array,
) -> tuple[Array, Array, Array, Array, Array, Array]:
    """As `_propagate`, and of every row what a tangent needs: x, E, the factor of dln(rho), and what is left
    of its start."""
    n = velocity.shape[0]
    z, decay, left = np.empty(n), np.empty(n), np.empty(n)
    pace, kept, sensitivity = np.zeros(n), np.zeros(n), np.zeros(n)
    forced = 0.0
    fade = 1.0
    stretch = -1
    for k in range(n):
        if first[k]:
            forced = 0.0
        else:
            x, e, bent = _pace(velocity[k], step[k], rho[k])
            s = -x * e * forced
            if x > _SMALL:
                s -= math.copysign((1.0 - e - x * e) / rho[k], velocity[k])
            else:
                s -= 0.5 * x * velocity[k] * step[k]
            pace[k], kept[k], sensitivity[k] = x, e, s
            forced = e * forced + bent
            fade *= e
        if first[k] or restart[k]:
            stretch += 1
            fade = 1.0
        left[k] = fade * start[stretch]
        z[k] = forced + left[k]
        decay[k] = fade
    return z, decay, left, pace, kept, sensitivity


@jit()
def _tangents(
    dlog_rho: Array,
    begins: NDArray[np.bool_],
    left: Array,
    pace: Array,
    kept: Array,
    sensitivity: Array,
    factor: Array,
    out: Array,
) -> None:
    """Add dz times a factor to `out`; arguments of `_propagate_pace`, and BLOCK rows of dln(rho) and `out`.

    Each row needs the one before: a processor waits for it, and advances several meanwhile.
    """
    r0 = r1 = r2 = r3 = 0.0  # of the forced state, of which the first row of a trial keeps nothing
    f0 = f1 = f2 = f3 = 0.0  # of -ln(fade)
    for k in range(len(pace)):
        d0, d1, d2, d3 = dlog_rho[0, k], dlog_rho[1, k], dlog_rho[2, k], dlog_rho[3, k]
        e, s = kept[k], sensitivity[k]
        r0, r1, r2, r3 = e * r0 + s * d0, e * r1 + s * d1, e * r2 + s * d2, e * r3 + s * d3
        if begins[k]:
            f0 = f1 = f2 = f3 = 0.0
        else:
            x = pace[k]
            f0, f1, f2, f3 = f0 + x * d0, f1 + x * d1, f2 + x * d2, f3 + x * d3
        start, by = left[k], factor[k]
        out[0, k] += by * (r0 - start * f0)
        out[1, k] += by * (r1 - start * f1)
        out[2, k] += by * (r2 - start * f2)
        out[3, k] += by * (r3 - start * f3)


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


def propagate_blocks(
    velocity: Array,
    step: Array,
    rho: Array,
    first: NDArray[np.bool_],
    start: Array,
    restart: NDArray[np.bool_] | None = None,
) -> tuple[Array, Array, Callable[[Array, Array, Array], None]]:
    """As `propagate`, with derivatives.

    Returns:
        z, decay, and a function of the derivatives of ln(rho) over each step with respect to `BLOCK`
        parameters, shape (BLOCK, rows), a factor, shape (rows,), and sums, shape (BLOCK, rows): it adds dz
        times the factor to the sums.
    """
    at = _nowhere(first, restart)
    z, decay, left, pace, kept, sensitivity = _propagate_pace(velocity, step, rho, first, at, start)
    begins = first | at

    def tangents(dlog_rho: Array, factor: Array, out: Array) -> None:
        _tangents(dlog_rho, begins, left, pace, kept, sensitivity, factor, out)

    return z, decay, tangents


def _nowhere(first: NDArray[np.bool_], restart: NDArray[np.bool_] | None) -> NDArray[np.bool_]:
    return np.zeros(len(first), dtype=bool) if restart is None else restart
