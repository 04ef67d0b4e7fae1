"""Forward simulation: the position that an effort makes of the identified axis.

    J dw/dt = T(t) - gravity(q) - effects(q, w, t) - friction(w, z)

One implicit step for the friction (Moreau's time stepping): the velocity at the end of a step is the one
at which the friction of that velocity balances the rest. Where that is zero the axis stands, exactly, for as
long as the rest stays below break-away: there is no chattering and no threshold of speed. A LuGre bristle
is stepped implicitly too, so that no stiffness is too stiff.

Everything that depends on position or speed is looked up in tables that the effects' own formulas filled.

Derivatives of the motion along numbers of the plant are propagated beside it, exact for the steps taken: what
stands has none, and a motion that starts or ends elsewhere is no jump that they see.

Source: Moreau, "Unilateral contact and dry friction in finite freedom dynamics", 1988; Acary & Brogliato,
Numerical Methods for Nonsmooth Dynamical Systems, 2008, chapter 10.
"""

from __future__ import annotations

import math

import numpy as np

from idtool.model.jit import jit
from idtool.model.motion import Array
from idtool.model.stribeck import least_level
from idtool.model.tabulated import (
    BEND,
    COULOMB,
    DEAD_BAND,
    EXPONENT,
    FIELDS,
    FIRST_POSITION,
    FIRST_VELOCITY,
    GAIN_CHANGE,
    INERTIA,
    LEVEL_CHANGE,
    LEVEL_TORQUE,
    LIMIT,
    NUMBERS,
    POSITION_GAIN,
    POSITION_STEP,
    SATURATION,
    SIGMA0,
    SIGMA1,
    STATIC,
    STATIC_CHANGE,
    STRIBECK,
    TIME_STEP,
    TORQUE,
    VELOCITY_GAIN,
    VELOCITY_STEP,
    VISCOUS,
    VISCOUS_CHANGE,
    VISCOUS_OFF,
    Places,
    Plant,
    Slopes,
)

#: The longest step, s, and that of a fit, which asks for less.
LONGEST_STEP, COARSE_STEP = 5e-4, 2e-3


def simulate(
    plant: Plant,
    time: Array,
    given: Array,
    scale: Array,
    driven: Array,
    added: Array,
    begins: Places,
    start: Array,
    *,
    by_goal: bool,
    slopes: Slopes | None = None,
    along: Array | None = None,
) -> Array:
    """The motion of stretches of time, each from a state of its own.

    Args:
        plant: the axis.
        time: s, rising, shape (rows,).
        given: what the drive is commanded (a duty, or the effort itself), or the goal of the position
            loop, shape (rows,); straight between the rows.
        scale: effort over what is commanded (the supply times its constant, for a duty), (rows,).
        driven: 1 where the drive is on, 0 where it is off and the motor turns freely, (rows,).
        added: torque that depends on time alone, (rows,).
        begins: first row of each stretch, the first of them 0, shape (stretches,).
        start: position, velocity and bristle deflection there, shape (stretches, 3).
        by_goal: whether `given` is the goal.
        slopes: derivatives of the plant along coordinates, which leave the starts where they are; None: of
            none.
        along: where derivatives of the position go, rad (m), shape (rows, coordinates).

    Returns:
        Position and velocity, shape (rows, 2).
    """
    if slopes is None:
        slopes = Slopes.between(plant, [], [])
    if along is None:
        along = np.empty((len(time), slopes.count))
    path = np.empty((len(time), 2))
    _simulate(
        plant.numbers,
        plant.over_position,
        plant.over_velocity,
        time,
        given,
        scale,
        driven,
        added,
        np.append(begins, len(time)),
        start,
        by_goal,
        slopes.number_of,
        slopes.numbers,
        slopes.field_of,
        slopes.over_position,
        slopes.torque_of,
        slopes.over_velocity,
        path,
        along,
    )
    return path


#: Coordinates that are advanced at a time.
_BLOCK = 4
# What is kept of a step for the derivatives: of its velocity, or of its friction level, along each entry of
# `numbers`, then along each field, and then:
_FIELDS = NUMBERS
_STEP, _PART, _SPEED_PART, _ALONG_Q, _ALONG_W, _BY_LEVEL = range(NUMBERS + FIELDS, NUMBERS + FIELDS + 6)
_BY_BRISTLE, _KEEPS, _BEND_BY_LEVEL, _BEND_Q, _BEND_W = range(NUMBERS + FIELDS + 6, NUMBERS + FIELDS + 11)
_KEPT = NUMBERS + FIELDS + 11
#: Whether such an entry is of the friction level.
_OF_LEVEL = np.isin(
    np.arange(NUMBERS + FIELDS),
    [COULOMB, STATIC, STRIBECK, *(_FIELDS + one for one in (LEVEL_CHANGE, LEVEL_TORQUE, STATIC_CHANGE))],
).astype(np.intp)


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
    edges: Places,
    start: Array,
    by_goal: bool,
    number_of: Places,
    number_slopes: Array,
    field_of: Places,
    position_slopes: Array,
    torque_of: Places,
    velocity_slopes: Array,
    path: Array,
    along: Array,
) -> None:
    inertia, coulomb, static, sigma0, sigma1 = n[INERTIA], n[COULOMB], n[STATIC], n[SIGMA0], n[SIGMA1]
    longest = n[TIME_STEP] if n[TIME_STEP] > 0.0 else LONGEST_STEP
    floor = least_level(coulomb, static)
    per_stribeck, per_position = 1.0 / n[STRIBECK], 1.0 / n[POSITION_STEP]
    per_velocity = 1.0 / n[VELOCITY_STEP]
    last_q, last_w = over_position.shape[0] - 2, over_velocity.shape[0] - 2
    counts = np.ones(len(time), dtype=np.intp)
    for k in range(1, len(time)):
        counts[k] = max(math.ceil((time[k] - time[k - 1]) / longest - 1e-9), 1)
    differentiate, most = along.shape[1] > 0, 0
    if differentiate:
        for stretch in range(len(edges) - 1):
            most = max(most, counts[edges[stretch] + 1 : edges[stretch + 1]].sum())
    kept, cells = np.zeros((_KEPT, most)), np.zeros((3, most), dtype=np.intp)
    for stretch in range(edges.shape[0] - 1):
        first, last = edges[stretch], edges[stretch + 1]
        q, w, z = start[stretch, 0], start[stretch, 1], start[stretch, 2]
        path[first, 0], path[first, 1] = q, w
        along[first, :] = 0.0
        s = -1
        for k in range(first + 1, last):
            count = counts[k]
            h = (time[k] - time[k - 1]) / count
            on = driven[k - 1] > 0.0
            viscous = n[VISCOUS] if on else n[VISCOUS_OFF]
            for i in range(count):
                share = (i + 0.5) / count
                effort = bare = slope = full = follows = 0.0
                if on:
                    command = given[k - 1] + share * (given[k] - given[k - 1])
                    if by_goal:
                        command = n[POSITION_GAIN] * (command - q) - n[VELOCITY_GAIN] * w
                        follows = 1.0 if abs(command) < n[LIMIT] else 0.0
                        command = min(max(command, -n[LIMIT]), n[LIMIT])
                    bare = max(abs(command) - n[DEAD_BAND], 0.0)
                    slope = 1.0 / (1.0 + n[BEND] * bare)
                    full = math.copysign(scale[k - 1] + share * (scale[k] - scale[k - 1]), command)
                    effort = bare * slope * full
                place = (q - n[FIRST_POSITION]) * per_position
                cell = min(max(int(place), 0), last_q)
                part = min(max(place - cell, 0.0), 1.0)
                others, speed_cell, speed_part, tilt = -added[k - 1], 0, 0.0, 0.0
                if last_w > 0:
                    speed_place = (w - n[FIRST_VELOCITY]) * per_velocity
                    speed_cell = min(max(int(speed_place), 0), last_w)
                    speed_part = speed_place - speed_cell
                    tilt = over_velocity[speed_cell + 1] - over_velocity[speed_cell]
                    others -= over_velocity[speed_cell] + speed_part * tilt
                side = FIELDS if w > 0.0 else 0
                if w == 0.0 and effort + others > _between(over_position, cell, TORQUE, part):
                    side = FIELDS  # at rest the way that it would go
                gain = 1.0 + _between(over_position, cell, side + GAIN_CHANGE, part)
                torque = effort * (gain - n[SATURATION] * abs(effort)) + others
                torque -= _between(over_position, cell, side + TORQUE, part)
                level_change = 1.0 + _between(over_position, cell, side + LEVEL_CHANGE, part)
                level_torque = _between(over_position, cell, side + LEVEL_TORQUE, part)
                static_change = 1.0 + _between(over_position, cell, side + STATIC_CHANGE, part)
                viscous_change = 1.0 + _between(over_position, cell, side + VISCOUS_CHANGE, part)
                damping = viscous * viscous_change
                speed = abs(w)
                ratio = speed * per_stribeck
                power = min(ratio * ratio if n[EXPONENT] == 2.0 else ratio ** n[EXPONENT], 700.0)
                fading = math.exp(-power)
                more = static * static_change - coulomb
                curve = coulomb + more * fading
                level = max(curve * level_change + level_torque, floor)
                before, fade = w, 1.0
                if sigma0 > 0.0:
                    # w at the end of the step from the bristle at its end, both linear in w
                    fade = 1.0 + h * sigma0 / level * speed
                    held = sigma0 * z / fade + sigma1 * (z / fade - z) / h
                    mass = inertia + h * (damping + (sigma0 * h + sigma1) / fade)
                    w = (inertia * w + h * (torque - held)) / mass
                else:
                    free = inertia * w + h * torque
                    mass = inertia + h * damping
                    left = max(abs(free) - h * level, 0.0) / mass
                    w = left if free > 0.0 else -left
                after = (z + h * w) / fade
                if differentiate:
                    s += 1
                    kept[_STEP, s], kept[_PART, s], kept[_SPEED_PART, s] = h, part, speed_part
                    cells[0, s], cells[1, s], cells[2, s] = cell, (1 if side > 0 else 0), speed_cell
                    stands = w == 0.0 and sigma0 == 0.0
                    by_torque = 0.0 if stands else h / mass
                    by_bristle = by_level = of_speed = bend_by_level = bend_by_speed = 0.0
                    way = 1.0 if before > 0.0 else (-1.0 if before < 0.0 else 0.0)
                    if sigma0 > 0.0:
                        by_fade = by_torque * ((sigma0 + sigma1 / h) * z + (sigma0 * h + sigma1) * w)
                        by_fade /= fade * fade
                        fade_by_level, fade_by_speed = (1.0 - fade) / level, way * h * sigma0 / level
                        by_level, of_speed = by_fade * fade_by_level, by_fade * fade_by_speed
                        by_bristle = by_torque * (sigma1 / h - (sigma0 + sigma1 / h) / fade)
                        bend_by_level, bend_by_speed = (
                            -after / fade * fade_by_level,
                            -after / fade * fade_by_speed,
                        )
                    elif not stands:
                        by_level = -math.copysign(by_torque, w)
                    kept[_BY_LEVEL, s] = by_level
                    by_bare = by_torque * (gain - 2.0 * n[SATURATION] * abs(effort)) * full * slope * slope
                    by_bare = by_bare if bare > 0.0 else 0.0
                    kept[INERTIA, s] = by_torque * (before - w) / h
                    kept[VISCOUS, s] = -by_torque * w * viscous_change if on else 0.0
                    kept[VISCOUS_OFF, s] = 0.0 if on else -by_torque * w * viscous_change
                    kept[DEAD_BAND, s] = -by_bare
                    kept[BEND, s] = -by_bare * bare * bare
                    kept[_FIELDS + TORQUE, s] = -by_torque
                    kept[_FIELDS + VISCOUS_CHANGE, s] = -by_torque * w * viscous
                    kept[_FIELDS + GAIN_CHANGE, s] = by_torque * effort
                    follow = level_change if level > floor else 0.0
                    fall = follow * more * fading * power * n[EXPONENT]
                    kept[COULOMB, s] = follow * (1.0 - fading)
                    kept[STATIC, s] = follow * static_change * fading
                    kept[STRIBECK, s] = fall * per_stribeck
                    kept[_FIELDS + LEVEL_CHANGE, s] = curve if level > floor else 0.0
                    kept[_FIELDS + LEVEL_TORQUE, s] = 1.0 if level > floor else 0.0
                    kept[_FIELDS + STATIC_CHANGE, s] = follow * static * fading
                    pull = follows * by_bare * math.copysign(1.0, full)  # of what the loop commands
                    along_q, rise_q = -pull * n[POSITION_GAIN], 0.0
                    inside = per_position if 0.0 <= place - cell <= 1.0 else 0.0
                    for field in range(FIELDS):
                        change = over_position[cell + 1, side + field] - over_position[cell, side + field]
                        change *= kept[_FIELDS + field, s] * inside
                        if _OF_LEVEL[_FIELDS + field]:
                            rise_q += change
                        else:
                            along_q += change
                    rise_w = -fall * way / speed if speed > 0.0 else 0.0
                    along_w = by_torque * (inertia / h - tilt * per_velocity) - pull * n[VELOCITY_GAIN]
                    kept[_ALONG_Q, s] = along_q + by_level * rise_q
                    kept[_ALONG_W, s] = along_w + by_level * rise_w + of_speed
                    if sigma0 > 0.0:
                        kept[_BY_BRISTLE, s], kept[_KEEPS, s] = by_bristle, 1.0 / fade
                        kept[_BEND_BY_LEVEL, s], kept[_BEND_Q, s] = bend_by_level, bend_by_level * rise_q
                        kept[_BEND_W, s] = bend_by_level * rise_w + bend_by_speed
                z = after
                q += 0.5 * h * (before + w)
            path[k, 0], path[k, 1] = q, w
        if differentiate:
            _differentiate(
                kept,
                cells,
                counts[first + 1 : last],
                number_of,
                number_slopes,
                field_of,
                position_slopes,
                torque_of,
                velocity_slopes,
                sigma0 > 0.0,
                along[first:last],
            )


@jit()
def _differentiate(
    kept: Array,
    cells: Places,
    counts: Places,
    number_of: Places,
    number_slopes: Array,
    field_of: Places,
    position_slopes: Array,
    torque_of: Places,
    velocity_slopes: Array,
    bristle: bool,
    along: Array,
) -> None:
    """Derivatives of the positions of a stretch, by what was kept of its steps."""
    steps = counts.sum()
    direct = np.empty((2, _BLOCK, steps))  # of the velocity at the end of a step, and of its friction level
    for begin in range(0, along.shape[1], _BLOCK):
        direct[:] = 0.0
        for t in range(len(number_of)):
            p, entry = number_of[t, 0] - begin, number_of[t, 1]
            if 0 <= p < _BLOCK:
                for s in range(steps):
                    direct[_OF_LEVEL[entry], p, s] += kept[entry, s] * number_slopes[t]
        for t in range(len(field_of)):
            p, entry = field_of[t, 0] - begin, _FIELDS + field_of[t, 1]
            if 0 <= p < _BLOCK:
                for s in range(steps):
                    low = position_slopes[t, cells[1, s], cells[0, s]]
                    high = position_slopes[t, cells[1, s], cells[0, s] + 1]
                    direct[_OF_LEVEL[entry], p, s] += kept[entry, s] * (low + kept[_PART, s] * (high - low))
        for t in range(len(torque_of)):
            p = torque_of[t] - begin
            if 0 <= p < _BLOCK:
                for s in range(steps):
                    low, high = velocity_slopes[t, cells[2, s]], velocity_slopes[t, cells[2, s] + 1]
                    direct[0, p, s] += kept[_FIELDS + TORQUE, s] * (low + kept[_SPEED_PART, s] * (high - low))
        for p in range(_BLOCK):
            for s in range(steps):
                direct[0, p, s] += kept[_BY_LEVEL, s] * direct[1, p, s]
        _advance(kept, counts, direct, bristle, along[:, begin : begin + _BLOCK])


@jit()
def _advance(kept: Array, counts: Places, direct: Array, bristle: bool, along: Array) -> None:
    """Position, velocity and bristle along `_BLOCK` coordinates.

    Each step needs the one before: a processor waits for it, and advances several coordinates meanwhile.
    """
    q0 = q1 = q2 = q3 = w0 = w1 = w2 = w3 = z0 = z1 = z2 = z3 = 0.0
    s, width = 0, along.shape[1]
    for k in range(len(counts)):
        for _ in range(counts[k]):
            along_q, along_w, half = kept[_ALONG_Q, s], kept[_ALONG_W, s], 0.5 * kept[_STEP, s]
            n0 = direct[0, 0, s] + along_q * q0 + along_w * w0
            n1 = direct[0, 1, s] + along_q * q1 + along_w * w1
            n2 = direct[0, 2, s] + along_q * q2 + along_w * w2
            n3 = direct[0, 3, s] + along_q * q3 + along_w * w3
            if bristle:
                by_bristle, keeps, by_level = kept[_BY_BRISTLE, s], kept[_KEEPS, s], kept[_BEND_BY_LEVEL, s]
                bend_q, bend_w = kept[_BEND_Q, s], kept[_BEND_W, s]
                n0, n1, n2, n3 = (
                    n0 + by_bristle * z0,
                    n1 + by_bristle * z1,
                    n2 + by_bristle * z2,
                    n3 + by_bristle * z3,
                )
                z0 = (z0 + 2.0 * half * n0) * keeps + by_level * direct[1, 0, s] + bend_q * q0 + bend_w * w0
                z1 = (z1 + 2.0 * half * n1) * keeps + by_level * direct[1, 1, s] + bend_q * q1 + bend_w * w1
                z2 = (z2 + 2.0 * half * n2) * keeps + by_level * direct[1, 2, s] + bend_q * q2 + bend_w * w2
                z3 = (z3 + 2.0 * half * n3) * keeps + by_level * direct[1, 3, s] + bend_q * q3 + bend_w * w3
            q0, q1, q2, q3 = (
                q0 + half * (w0 + n0),
                q1 + half * (w1 + n1),
                q2 + half * (w2 + n2),
                q3 + half * (w3 + n3),
            )
            w0, w1, w2, w3 = n0, n1, n2, n3
            s += 1
        along[k + 1, 0] = q0
        if width > 1:
            along[k + 1, 1] = q1
        if width > 2:
            along[k + 1, 2] = q2
        if width > 3:
            along[k + 1, 3] = q3


@jit(inline="always")
def _between(table: Array, cell: int, column: int, part: float) -> float:
    low: float = table[cell, column]
    high: float = table[cell + 1, column]
    return low + part * (high - low)
