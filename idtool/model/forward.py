"""Forward simulation: the position that an effort makes of the identified axis.

    J dw/dt = T(t) - gravity(q) - effects(q, w, t) - friction(w, z)

One implicit step for the friction (Moreau's time stepping): the velocity at the end of a step is the one
at which the friction of that velocity balances the rest. Where that is zero the axis stands, exactly, for as
long as the rest stays below break-away: there is no chattering and no threshold of speed. A LuGre bristle
is stepped implicitly too, so that no stiffness is too stiff.

Everything that depends on position or speed is looked up in tables that the effects' own formulas filled.

Source: Moreau, "Unilateral contact and dry friction in finite freedom dynamics", 1988; Acary & Brogliato,
Numerical Methods for Nonsmooth Dynamical Systems, 2008, chapter 10.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from idtool.model.jit import jit
from idtool.model.motion import Array
from idtool.model.stribeck import least_level

#: The longest step, s, and that of a fit, which asks for less.
LONGEST_STEP, COARSE_STEP = 5e-4, 1e-3

# Entries of `numbers`.
INERTIA, COULOMB, STATIC, STRIBECK, EXPONENT, VISCOUS, VISCOUS_OFF, SIGMA0, SIGMA1, SATURATION = range(10)
POSITION_GAIN, VELOCITY_GAIN, LIMIT, DEAD_BAND, BEND = range(10, 15)
FIRST_POSITION, POSITION_STEP, FIRST_VELOCITY, VELOCITY_STEP = range(15, 19)
TIME_STEP = 19
NUMBERS = 20

# Rows of `over_position`, for motion backwards and, that many further on, forwards.
TORQUE, LEVEL_CHANGE, LEVEL_TORQUE, STATIC_CHANGE, VISCOUS_CHANGE, GAIN_CHANGE = range(6)
FIELDS = 6


@dataclass(frozen=True)
class Plant:
    """An axis as the kernel takes it.

    Attributes:
        numbers: see the entries above, shape (NUMBERS,).
        over_position: what gravity and effects add at each position, shape (2 * FIELDS, positions).
        over_velocity: torque that effects add at each velocity, shape (velocities,).
    """

    numbers: Array
    over_position: Array
    over_velocity: Array


def simulate(
    plant: Plant,
    time: Array,
    given: Array,
    scale: Array,
    driven: Array,
    added: Array,
    start: tuple[float, float, float],
    *,
    by_goal: bool,
) -> Array:
    """The motion of one stretch of time.

    Args:
        plant: the axis.
        time: s, rising, shape (rows,).
        given: what the drive is commanded (a duty, or the effort itself), or the goal of the position
            loop, shape (rows,); straight between the rows.
        scale: effort over what is commanded (the supply times its constant, for a duty), (rows,).
        driven: 1 where the drive is on, 0 where it is off and the motor turns freely, (rows,).
        added: torque that depends on time alone, (rows,).
        start: position, velocity and bristle deflection at the first row.
        by_goal: whether `given` is the goal.

    Returns:
        Position and velocity, shape (rows, 2).
    """
    return np.asarray(
        _simulate(
            plant.numbers,
            plant.over_position,
            plant.over_velocity,
            time,
            given,
            scale,
            driven,
            added,
            start[0],
            start[1],
            start[2],
            by_goal,
        )
    )


@jit(error_model="numpy")
def _simulate(
    n: Array,
    over_position: Array,
    over_velocity: Array,
    time: Array,
    given: Array,
    scale: Array,
    driven: Array,
    added: Array,
    position: float,
    velocity: float,
    bristle: float,
    by_goal: bool,
) -> Array:
    rows = time.shape[0]
    path = np.empty((rows, 2))
    path[0, 0], path[0, 1] = position, velocity
    q, w, z = position, velocity, bristle
    inertia, coulomb, static, sigma0, sigma1 = n[INERTIA], n[COULOMB], n[STATIC], n[SIGMA0], n[SIGMA1]
    step = n[TIME_STEP] if n[TIME_STEP] > 0.0 else LONGEST_STEP
    floor = least_level(coulomb, static)
    last_q, last_w = over_position.shape[1] - 2, over_velocity.shape[0] - 2
    for k in range(1, rows):
        span = time[k] - time[k - 1]
        count = max(math.ceil(span / step - 1e-9), 1)
        h = span / count
        on = driven[k - 1] > 0.0
        viscous = n[VISCOUS] if on else n[VISCOUS_OFF]
        for i in range(count):
            share = (i + 0.5) / count
            effort = 0.0
            if on:
                effort = given[k - 1] + share * (given[k] - given[k - 1])
                if by_goal:
                    effort = n[POSITION_GAIN] * (effort - q) - n[VELOCITY_GAIN] * w
                    effort = min(max(effort, -n[LIMIT]), n[LIMIT])
                size = max(abs(effort) - n[DEAD_BAND], 0.0)
                size /= 1.0 + n[BEND] * size
                effort = math.copysign(size, effort) * (scale[k - 1] + share * (scale[k] - scale[k - 1]))
            place = (q - n[FIRST_POSITION]) / n[POSITION_STEP]
            cell = min(max(int(place), 0), last_q)
            part = min(max(place - cell, 0.0), 1.0)
            gain = 1.0 + _between(over_position, (FIELDS if w > 0.0 else 0) + GAIN_CHANGE, cell, part)
            torque = effort * (gain - n[SATURATION] * abs(effort)) - added[k - 1]
            if last_w > 0:
                place = (w - n[FIRST_VELOCITY]) / n[VELOCITY_STEP]
                speed_cell = min(max(int(place), 0), last_w)
                low, high = over_velocity[speed_cell], over_velocity[speed_cell + 1]
                torque -= low + (place - speed_cell) * (high - low)
            side = FIELDS if w > 0.0 else 0
            if w == 0.0:  # at rest the way that it would go
                low, high = over_position[TORQUE, cell], over_position[TORQUE, cell + 1]
                side = FIELDS if torque - low - part * (high - low) > 0.0 else 0
            low, high = over_position[side + TORQUE, cell], over_position[side + TORQUE, cell + 1]
            torque -= low + part * (high - low)
            level_change = _between(over_position, side + LEVEL_CHANGE, cell, part)
            level_torque = _between(over_position, side + LEVEL_TORQUE, cell, part)
            static_change = _between(over_position, side + STATIC_CHANGE, cell, part)
            damping = viscous * (1.0 + _between(over_position, side + VISCOUS_CHANGE, cell, part))
            speed = abs(w)
            ratio = speed / n[STRIBECK]
            power = ratio * ratio if n[EXPONENT] == 2.0 else ratio ** n[EXPONENT]
            level = coulomb + (static * (1.0 + static_change) - coulomb) * math.exp(-min(power, 700.0))
            level = max(level * (1.0 + level_change) + level_torque, floor)
            before = w
            if sigma0 > 0.0:
                # w at the end of the step from the bristle at its end, both linear in w
                fade = 1.0 + h * sigma0 / level * speed
                held = sigma0 * z / fade + sigma1 * (z / fade - z) / h
                w = (inertia * w + h * (torque - held)) / (
                    inertia + h * (damping + (sigma0 * h + sigma1) / fade)
                )
                z = (z + h * w) / fade
            else:
                free = inertia * w + h * torque
                left = max(abs(free) - h * level, 0.0) / (inertia + h * damping)
                w = left if free > 0.0 else -left
            q += 0.5 * h * (before + w)
        path[k, 0], path[k, 1] = q, w
    return path


@jit(inline="always")
def _between(table: Array, row: int, cell: int, part: float) -> float:
    low: float = table[row, cell]
    high: float = table[row, cell + 1]
    return low + part * (high - low)
