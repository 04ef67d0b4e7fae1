"""The simulated axis and its drive, in steps of 100 µs, compiled.

Written apart from the package's model and effects (its own formulas and its own integration), so that
agreement of a fit with it is a finding and not a tautology. SI at the shaft where K holds:

    K i (1 - kappa |i|) + hand = J a + gravity + friction + effects

Each effect is thus a torque that the motor must add. One step: the drive computes a current from the
state, then the bristle is advanced by its closed solution for a speed held over the step while the new
speed is solved from an equation linear in it (linearly implicit), which is stable for stiff bristles.

The drive sees the true state every step (its own loop is faster than the bus and filters its encoder),
so sensor noise enters the readings only, never the motion.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from idtool.model.jit import jit
from idtool.model.motion import Array
from idtool.rig.plant_file import STEP_S

#: What `run` notes of a sample.
READINGS = 6
#: Steps of history that a delayed reading may reach back (0.2 s).
HISTORY = 2048

# Entries of the state vector.
POSITION, VELOCITY, BRISTLE, CURRENT, INTEGRAL, REFERENCE, REFERENCE_RATE = range(7)
HYSTERESIS, PLAY, LOAD_POSITION, LOAD_VELOCITY, DWELL, TIME, SINCE_START = range(7, 14)
STATE_SIZE = 14

VELOCITY_MODE, POSITION_MODE = 0, 1


class PlantNumbers(NamedTuple):
    """Everything the compiled plant needs; an effect that is absent has numbers that do nothing.

    Units as in the plant file (`plant_file`): N m, rad, s, A, kg m², °C.
    """

    torque_constant: float
    inertia: float
    # gravity: constant + sine sin(q) + cosine cos(q), tilt and payload already applied
    gravity: float
    gravity_sine: float
    gravity_cosine: float
    # friction
    coulomb: float
    static: float
    stribeck_velocity: float
    viscous: float
    bristle_stiffness: float
    bristle_damping: float
    # drive
    position_gain: float
    velocity_gain: float
    integral_gain: float
    feedforward: float
    velocity_profile_acceleration: float
    position_profile_acceleration: float
    speed_limit: float
    current_limit: float
    lowest: float
    highest: float
    # temperature
    ambient: float
    rise: float
    warm_up: float
    # effects
    offset: float = 0.0
    asymmetry: float = 0.0
    mu: float = 0.0
    mu_drive: float = 0.0
    mu_backdrive: float = 0.0
    ripple_cycles: float = 0.0
    ripple_1: float = 0.0
    ripple_phase_1: float = 0.0
    ripple_2: float = 0.0
    ripple_phase_2: float = 0.0
    slope_1: float = 0.0
    slope_2: float = 0.0
    stroke_center: float = 0.0
    half_stroke: float = 1.0
    spring: float = 0.0
    spring_neutral: float = 0.0
    thermal_rate: float = 0.0
    thermal_reference: float = 25.0
    quadratic: float = 0.0
    exponent: float = 2.0
    gap: float = 0.0
    gap_share: float = 0.0
    hysteresis_stiffness: float = 0.0
    hysteresis_yield: float = 0.0
    compliance: float = 0.0
    compliance_damping: float = 0.0
    load_inertia: float = 0.0
    delay: float = 0.0
    kappa: float = 0.0
    periodic_frequency: float = 0.0
    periodic_amplitude: float = 0.0
    periodic_phase: float = 0.0
    dwell_gain: float = 0.0
    dwell_time: float = 1.0


@jit()
def temperature(p: PlantNumbers, time: float) -> float:
    """Temperature of the axis, °C, a time (s) after the rig was switched on."""
    if p.rise == 0.0:
        return p.ambient
    return p.ambient + p.rise * (1.0 - math.exp(-time / p.warm_up))


@jit()
def thermal_factor(p: PlantNumbers, time: float) -> float:
    """Factor on the friction level and on viscous friction."""
    if p.thermal_rate == 0.0:
        return 1.0
    return math.exp(-p.thermal_rate * (temperature(p, time) - p.thermal_reference))


@jit()
def gravity_torque(p: PlantNumbers, position: float) -> float:
    """Torque that holds the load against gravity, N m."""
    load = p.gravity
    if p.gravity_sine != 0.0 or p.gravity_cosine != 0.0:
        load += p.gravity_sine * math.sin(position) + p.gravity_cosine * math.cos(position)
    return load


@jit()
def friction_level(
    p: PlantNumbers, position: float, velocity: float, load: float, dwell: float, factor: float
) -> float:
    """Steady friction without its viscous part, g, N m, above zero."""
    ratio = abs(velocity / p.stribeck_velocity)
    fade = math.exp(-ratio * ratio) if p.exponent == 2.0 else math.exp(-(ratio**p.exponent))
    static = p.static * (1.0 + p.dwell_gain * dwell)
    level = p.coulomb + (static - p.coulomb) * fade
    if p.slope_1 != 0.0 or p.slope_2 != 0.0:
        x = min(max((position - p.stroke_center) / p.half_stroke, -1.0), 1.0)
        level *= 1.0 + p.slope_1 * x + p.slope_2 * (2.0 * x * x - 1.0)
    level += p.mu * abs(load)
    if velocity * load > 0.0:
        level += p.mu_drive * abs(load)
    elif velocity * load < 0.0:
        level += p.mu_backdrive * abs(load)
    else:  # at rest neither way is taken; the mean keeps the bristle's limit defined
        level += 0.5 * (p.mu_drive + p.mu_backdrive) * abs(load)
    return max(level * factor, 1e-6)


@jit()
def effect_torque(p: PlantNumbers, q: float, w: float, time: float) -> float:
    """Sum of the effects that are a plain torque of position, speed and time, N m."""
    torque = p.offset + p.asymmetry * abs(w) + p.quadratic * abs(w) * w
    if p.ripple_cycles != 0.0:
        torque += p.ripple_1 * math.sin(p.ripple_cycles * q + p.ripple_phase_1)
        if p.ripple_2 != 0.0:
            torque += p.ripple_2 * math.sin(2.0 * p.ripple_cycles * q + p.ripple_phase_2)
    if p.spring != 0.0:
        torque += p.spring * (q - p.spring_neutral)
    if p.periodic_amplitude != 0.0:
        torque += p.periodic_amplitude * math.sin(
            2.0 * math.pi * p.periodic_frequency * time + p.periodic_phase
        )
    return torque


@jit()
def engagement(p: PlantNumbers, state: Array, load: float, level: float) -> float:
    """Share of the load torque that is in contact: 1, or 1 - share while inside the gap.

    The part behind the gap stays where its friction leaves it (a play operator), unless gravity
    overcomes its friction: then it rests on one face and no gap opens. Contact sets in over the last
    twentieth of the gap.
    """
    half = 0.5 * p.gap
    if half == 0.0:
        return 1.0
    q = state[POSITION]
    if abs(load) >= level:
        state[PLAY] = q - math.copysign(half, load)
        return 1.0
    state[PLAY] = min(max(state[PLAY], q - half), q + half)
    # against the motion's own face only: the other face is being left
    depth = (q - state[PLAY]) * (1.0 if state[VELOCITY] >= 0.0 else -1.0)
    contact = min(max((depth - 0.9 * half) / (0.1 * half), 0.0), 1.0)
    share: float = 1.0 - p.gap_share * (1.0 - contact)
    return share


@jit()
def drive_current(p: PlantNumbers, state: Array, command: float, mode: int) -> float:
    """One step of the drive: profile, position loop, velocity loop, saturation. Returns the current, A.

    The profile is a second-order filter with a double pole that also limits acceleration, so that
    commands held for a period reach the motor as a smooth velocity. In position mode it is fast (a double
    pole at 300 1/s against 40 1/s) and leaves the shaping to whoever commands.
    """
    if mode == POSITION_MODE:
        goal = min(max(command, p.lowest), p.highest)
        wanted = p.position_gain * (goal - state[POSITION])
        pole, limit = 600.0, p.position_profile_acceleration
    else:
        wanted = command
        pole, limit = 80.0, p.velocity_profile_acceleration
    wanted = min(max(wanted, -p.speed_limit), p.speed_limit)
    rate = min(max(0.25 * pole * (wanted - state[REFERENCE]), -limit), limit)
    state[REFERENCE_RATE] += STEP_S * pole * (rate - state[REFERENCE_RATE])
    state[REFERENCE] += STEP_S * state[REFERENCE_RATE]

    error = state[REFERENCE] - state[VELOCITY]
    torque = p.velocity_gain * error + state[INTEGRAL] + p.feedforward * state[REFERENCE_RATE]
    limit = p.torque_constant * p.current_limit
    if abs(torque) < limit or torque * error < 0.0:  # no wind-up in saturation
        state[INTEGRAL] += STEP_S * p.integral_gain * error
    current: float = min(max(torque, -limit), limit) / p.torque_constant
    return current


@jit()
def advance(p: PlantNumbers, state: Array, command: float, mode: int, hand: float, factor: float) -> None:
    """One step of drive and axis."""
    h = STEP_S
    current = drive_current(p, state, command, mode)
    state[CURRENT] = current
    q, w, z = state[POSITION], state[VELOCITY], state[BRISTLE]
    motor = p.torque_constant * current * (1.0 - p.kappa * abs(current))

    elastic = p.compliance > 0.0
    load = gravity_torque(p, state[LOAD_POSITION] if elastic else q)
    level = friction_level(p, q, w, load, state[DWELL], factor)
    share = engagement(p, state, load, level)

    rest = effect_torque(p, q, w, state[TIME]) + state[HYSTERESIS]
    if elastic:
        through = p.compliance * (q - state[LOAD_POSITION]) + p.compliance_damping * (
            w - state[LOAD_VELOCITY]
        )
        rest += through
        state[LOAD_VELOCITY] += h * (through + hand - load) / p.load_inertia
        state[LOAD_POSITION] += h * state[LOAD_VELOCITY]
    else:
        rest += share * load - hand

    # z+ = keep z + gain w+; the mean of dz/dt over the step is (z+ - z) / h. The bristle slips at the new
    # speed, found in two rounds: with the old one sigma1 would act a step late, which looks like inertia
    new = w
    for _ in range(2):
        x = p.bristle_stiffness * abs(new) / (share * level) * h
        keep = math.exp(-x)
        gain = h * (1.0 - keep) / x if x > 1e-6 else h * (1.0 - 0.5 * x)
        push = motor - rest - p.bristle_stiffness * keep * z + p.bristle_damping * (1.0 - keep) * z / h
        drag = p.bristle_stiffness * gain + p.bristle_damping * gain / h + p.viscous * factor
        new = (w + h * push / p.inertia) / (1.0 + h * drag / p.inertia)
        level = friction_level(p, q, new, load, state[DWELL], factor)

    state[BRISTLE] = keep * z + gain * new
    state[VELOCITY] = new
    state[POSITION] = q + h * new
    if p.hysteresis_yield > 0.0:
        element = state[HYSTERESIS] + p.hysteresis_stiffness * h * new
        state[HYSTERESIS] = min(max(element, -p.hysteresis_yield), p.hysteresis_yield)
    if p.dwell_gain != 0.0:
        # rest builds the memory up; a travel of a few break-away distances wears it off
        if abs(new) < 0.02 * p.stribeck_velocity:
            state[DWELL] += h * (1.0 - state[DWELL]) / p.dwell_time
        else:
            wear = h * abs(new) * p.bristle_stiffness / (3.0 * p.static)
            state[DWELL] *= math.exp(-wear)
    state[TIME] += h


@jit()
def run(
    p: PlantNumbers,
    state: Array,
    history: Array,
    commands: Array,
    mode: int,
    hand: float,
    steps: int,
    out: Array,
) -> None:
    """Advance by one sample period per command and note the true readings.

    Args:
        p: the plant.
        state: changed in place, shape (STATE_SIZE,).
        history: position and velocity of the last steps, a ring, shape (2, HISTORY); in place.
        commands: in force during each period, shape (samples,).
        mode: VELOCITY_MODE or POSITION_MODE.
        hand: torque of a hand, towards +q, N m.
        steps: steps per period.
        out: time, position, velocity, current, temperature and the winding's own velocity at the end of each
            period, shape (READINGS, samples). Position and velocity are older than the rest by the delay.
    """
    back = p.delay / STEP_S
    whole = int(back)
    part = back - whole
    for k in range(commands.shape[0]):
        factor = thermal_factor(p, state[TIME])
        for _ in range(steps):
            advance(p, state, commands[k], mode, hand, factor)
            at = int(state[SINCE_START])
            history[0, at] = state[POSITION]
            history[1, at] = state[VELOCITY]
            state[SINCE_START] = float((at + 1) % HISTORY)
        newest = int(state[SINCE_START]) - 1 + HISTORY
        one, two = (newest - whole) % HISTORY, (newest - whole - 1) % HISTORY
        out[0, k] = state[TIME]
        out[1, k] = (1.0 - part) * history[0, one] + part * history[0, two]
        out[2, k] = (1.0 - part) * history[1, one] + part * history[1, two]
        out[3, k] = state[CURRENT]
        out[4, k] = temperature(p, state[TIME])
        out[5, k] = state[VELOCITY]


def blank_state() -> tuple[Array, Array]:
    """State and history of an axis at position zero, at rest."""
    return np.zeros(STATE_SIZE), np.zeros((2, HISTORY))
