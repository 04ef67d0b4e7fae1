"""Equations of motion: an axis with one of three friction laws and everything else that it may feel.

Friction: LuGre (Canudas de Wit et al. 1995), elasto-plastic (Dupont, Armstrong & Hayward 2000) or
generalized Maxwell slip (Al-Bender, Lampaert & Swevers 2005), with the Stribeck curve in common. The
extra memory is Bouc-Wen's (Wen 1976), backlash is a part with friction of its own behind a gap,
compliance a second mass on a spring. Torques (or forces) are those that the motor must give.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LUGRE, ELASTO_PLASTIC, MAXWELL_SLIP = 0, 1, 2

#: Share of the level and relative travel of the elements of Maxwell slip.
_SHARES = (0.4, 0.3, 0.2, 0.1)
_TRAVELS = (0.5, 1.0, 1.6, 1.8)

#: Places in the state: position, velocity, four friction elements, Bouc-Wen, second mass, the bristle of
#: the part behind the gap, two more masses.
STATES = 14
_Q, _W, _Z, _H, _QL, _WL, _ZL, _R = 0, 1, 2, 6, 7, 8, 9, 10
#: Places among the modes: which elements slip, the side in contact, where the part behind the gap is, age.
MODES = 7
_SIDE, _PLAY, _AGE = 4, 5, 6


class Axis(NamedTuple):
    """Numbers of one axis in SI units at the motor's shaft; by default what may be absent has no torque."""

    inertia: float
    coulomb: float
    static: float
    stribeck_velocity: float
    viscous: float
    stiffness: float
    damping: float
    law: int = LUGRE
    plastic_from: float = 0.7
    base: float = 0.0
    per_payload: float = 0.0
    sine: float = 0.0
    cosine: float = 0.0
    payload_inertia: float = 0.0
    middle: float = 0.0
    half_stroke: float = 1.0
    # effects
    offset: float = 0.0
    asymmetry: float = 0.0
    quadratic: float = 0.0
    exponent: float = 2.0
    mu: float = 0.0
    mu_raise: float = 0.0
    mu_lower: float = 0.0
    ripple_softness: float = 0.01
    slope: float = 0.0
    bowl: float = 0.0
    spring: float = 0.0
    spring_cubic: float = 0.0
    spring_neutral: float = 0.0
    thermal: float = 0.0
    rise: float = 0.0
    warm_up: float = 300.0
    yield_torque: float = 0.0
    memory_stiffness: float = 0.0
    gap: float = 0.0
    behind: float = 0.0
    load_inertia: float = 0.0
    load_stiffness: float = 0.0
    load_damping: float = 0.0
    saturation: float = 0.0
    periodic: float = 0.0
    periodic_hz: float = 1.0
    periodic_phase: float = 0.0
    tilt_alpha: float = 0.0
    tilt_beta: float = 0.0
    dwell: float = 0.0
    dwell_time: float = 1.0
    dwell_travel: float = 0.01
    delay: float = 0.0
    # in no library
    bump: float = 0.0
    bump_at: float = 0.0
    bump_width: float = 0.1
    tooth: float = 0.0
    tooth_pitch: float = 1.0
    tooth_width: float = 0.02
    wear: float = 0.0
    wear_from: float = 0.0
    grip: float = 0.0
    grip_from: float = 1.0
    speed_bump: float = 0.0
    speed_bump_at: float = 0.2
    speed_bump_width: float = 0.02
    second_inertia: float = 0.0
    second_omega: float = 20.0
    third_omega: float = 50.0


class Plant(NamedTuple):
    """The physics of one session.

    Attributes:
        axis: its numbers.
        lines: of a ripple: radians per unit of travel, torque, phase, turn with the way; shape (lines, 4).
        walk: what friction has more as time goes by, one value every 4 s.
    """

    axis: Axis
    lines: Array = np.zeros((0, 4))
    walk: Array = np.zeros(0)

    def with_numbers(self, **numbers: Any) -> Plant:
        """The same with other numbers of the axis, or other lines or another walk."""
        own = {name: numbers.pop(name) for name in ("lines", "walk") if name in numbers}
        return self._replace(axis=self.axis._replace(**numbers), **own)


#: What has no torque.
NOTHING: dict[str, Any] = {**Axis._field_defaults, **Plant._field_defaults}


class Place(NamedTuple):
    """What the operator sets for one trial."""

    payload: float
    alpha: float
    beta: float
    start: float


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def gravity(p: Axis, place: Place, q: float) -> float:
    """Torque of the load, with the tilt as it really is."""
    upright = math.cos(place.alpha + p.tilt_alpha) * math.cos(place.beta + p.tilt_beta)
    return (p.base + p.per_payload * place.payload) * upright + p.sine * math.sin(q) + p.cosine * math.cos(q)


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def _interpolate(values: Array, x: float) -> float:
    k = min(max(int(x), 0), len(values) - 2)
    return float(values[k] + (values[k + 1] - values[k]) * min(max(x - k, 0.0), 1.0))


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def warmth(p: Axis, t: float) -> float:
    """Factor of friction after a session has run for t seconds."""
    if p.thermal == 0.0:
        return 1.0
    return math.exp(-p.thermal * p.rise * (1.0 - math.exp(-t / p.warm_up)))


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def level(plant: Plant, place: Place, q: float, w: float, t: float, load: float, age: float) -> float:
    """Steady friction without its viscous part, always positive."""
    p, walk = plant.axis, plant.walk
    static = p.static + p.dwell * p.coulomb * age
    if p.exponent == 2.0:
        bell = math.exp(-((w / p.stribeck_velocity) ** 2))
    else:
        bell = math.exp(-(abs(w / p.stribeck_velocity) ** p.exponent))
    g = p.coulomb + (static - p.coulomb) * bell
    if p.slope != 0.0 or p.bowl != 0.0:
        x = min(max((q - p.middle) / p.half_stroke, -1.2), 1.2)
        g *= 1.0 + p.slope * x + p.bowl * (x * x - 1.0 / 3.0)
    g *= warmth(p, t)
    g += p.mu * abs(load)
    if p.mu_raise != 0.0 or p.mu_lower != 0.0:
        g += (p.mu_raise if w * load > 0.0 else p.mu_lower) * abs(load)
    if len(walk) > 1:
        g += _interpolate(walk, t / 4.0)
    if t > p.wear_from:
        g += p.wear
    g += p.grip * max(place.payload - p.grip_from, 0.0)
    if p.speed_bump != 0.0:
        g += p.speed_bump * math.exp(-(((abs(w) - p.speed_bump_at) / p.speed_bump_width) ** 2))
    return max(g, 0.05 * p.coulomb)


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def _bristle_rate(p: Axis, z: float, w: float, g: float) -> float:
    steady = g / p.stiffness
    if p.law == ELASTO_PLASTIC:
        if z * w < 0.0:
            return w
        elastic = p.plastic_from * steady
        depth = (abs(z) - elastic) / (steady - elastic)
        share = 0.0 if depth <= 0.0 else 0.5 - 0.5 * math.cos(math.pi * min(depth, 1.0))
        return w - share * abs(w) * z / steady
    return w - abs(w) * z / steady


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def friction(p: Axis, y: Array, dy: Array, modes: Array, w: float, g: float) -> float:
    """Dry friction of the law; fills the rates of its elements."""
    if p.law == MAXWELL_SLIP:
        total = 0.0
        travel = max(p.coulomb, p.static) / p.stiffness
        for k in range(4):
            most = _SHARES[k] * g
            stiff = _SHARES[k] * p.stiffness * travel / (_TRAVELS[k] * travel)
            if modes[k] > 0.0:
                dy[_Z + k] = stiff * (w - abs(w) * y[_Z + k] / most)
            else:
                dy[_Z + k] = stiff * w
            total += y[_Z + k]
        return total + p.damping * w
    rate = _bristle_rate(p, y[_Z], w, g)
    dy[_Z] = rate
    return float(p.stiffness * y[_Z] + p.damping * rate)


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def resistance(
    plant: Plant, place: Place, y: Array, dy: Array, modes: Array, q: float, w: float, t: float
) -> float:
    """Everything but inertia that the motor works against; fills the rates of the memories."""
    p, lines = plant.axis, plant.lines
    load = gravity(p, place, q)
    g = level(plant, place, q, w, t, load, modes[_AGE])
    warm = warmth(p, t)
    sliding = friction(p, y, dy, modes, w, g) + p.viscous * warm * w
    total = load + sliding
    if p.behind > 0.0:
        total -= p.behind * sliding
        if modes[_SIDE] != 0.0:
            dy[_ZL] = _bristle_rate(p, y[_ZL], w, g)
            total += p.behind * (p.stiffness * y[_ZL] + p.damping * dy[_ZL] + p.viscous * warm * w)
        else:
            dy[_ZL] = 0.0
    total += p.offset + p.asymmetry * abs(w) + p.quadratic * abs(w) * w
    for k in range(lines.shape[0]):
        turn = lines[k, 3] * math.tanh(w / p.ripple_softness)
        total += lines[k, 1] * math.sin(lines[k, 0] * q + lines[k, 2] + turn)
    x = q - p.spring_neutral
    total += p.spring * x + p.spring_cubic * x * x * x
    if p.periodic != 0.0:
        total += p.periodic * math.sin(2.0 * math.pi * p.periodic_hz * t + p.periodic_phase)
    if p.yield_torque > 0.0:
        h = y[_H] / p.yield_torque
        dy[_H] = p.memory_stiffness * (w - abs(w) * h * abs(h))
        total += y[_H]
    if p.load_inertia > 0.0:
        spring = p.load_stiffness * (q - y[_QL]) + p.load_damping * (w - y[_WL])
        dy[_QL], dy[_WL] = y[_WL], spring / p.load_inertia
        total += spring
    if p.second_inertia > 0.0:
        for k in range(2):
            omega = p.second_omega if k == 0 else p.third_omega
            at = _R + 2 * k
            pull = omega * omega * (q - y[at]) + 0.08 * omega * (w - y[at + 1])
            dy[at], dy[at + 1] = y[at + 1], pull
            total += p.second_inertia * pull
    if p.bump != 0.0:
        total += p.bump * math.exp(-(((q - p.bump_at) / p.bump_width) ** 2))
    if p.tooth != 0.0:
        away = (q - p.bump_at) - p.tooth_pitch * round((q - p.bump_at) / p.tooth_pitch)
        total += p.tooth * math.exp(-((away / p.tooth_width) ** 2))
    return total


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def settle_modes(
    plant: Plant, place: Place, y: Array, modes: Array, q: float, w: float, t: float, h: float
) -> None:
    """What sticks, slips, touches and ages after a step of h seconds."""
    p = plant.axis
    load = gravity(p, place, q)
    g = level(plant, place, q, w, t, load, modes[_AGE])
    if p.law == MAXWELL_SLIP:
        for k in range(4):
            most = _SHARES[k] * g
            if modes[k] > 0.0:
                if w * y[_Z + k] < 0.0:
                    modes[k] = 0.0
            elif abs(y[_Z + k]) >= most and w * y[_Z + k] > 0.0:
                modes[k] = 1.0
    if p.behind > 0.0:
        side, half = modes[_SIDE], 0.5 * p.gap
        held = 0.0
        if abs(load) > p.behind * g:  # the load presses one face against the motor's
            held = -1.0 if load < 0.0 else 1.0
        push = p.stiffness * y[_ZL] + p.damping * _bristle_rate(p, y[_ZL], w, g) + p.viscous * w
        if held != 0.0:
            modes[_SIDE] = held
        elif side * push < 0.0:
            modes[_SIDE], y[_ZL] = 0.0, 0.0
        if modes[_SIDE] != 0.0:
            modes[_PLAY] = q - modes[_SIDE] * half
        elif q - modes[_PLAY] >= half:
            modes[_SIDE] = 1.0
        elif q - modes[_PLAY] <= -half:
            modes[_SIDE] = -1.0
    if p.dwell > 0.0:
        if abs(w) < 0.1 * p.stribeck_velocity:
            modes[_AGE] += (1.0 - modes[_AGE]) * (1.0 - math.exp(-h / p.dwell_time))
        modes[_AGE] *= math.exp(-abs(w) * h / p.dwell_travel)


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def substeps(p: Axis, w: float, h: float, forward: bool) -> int:
    """Into how many parts a step must be cut for the fourth-order rule to be accurate."""
    lowest = 0.3 * min(p.coulomb, p.static)
    fastest = p.stiffness * abs(w) / lowest * (3.0 if p.law != LUGRE else 1.0)
    if forward:
        fastest += (p.damping + p.viscous) / p.inertia + math.sqrt(p.stiffness / p.inertia)
    if p.load_inertia > 0.0:
        fastest += math.sqrt(p.load_stiffness / p.load_inertia)
    least = 2 if p.law == MAXWELL_SLIP else 1  # elements begin and cease to slip at the end of a part
    return min(max(1 + int(h * fastest / 0.9), least), 100)
