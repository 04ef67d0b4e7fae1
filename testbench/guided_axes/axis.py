"""A guided axis: the plant of the simulated rig, a hand that acts every 0.1 ms, coarse sensors.

The hand is a spring and a damper between the grip and where it wants to be (or a given force), evaluated
at the true motion in every step of the plant. The controller sees what a servo on a bus reports once per
period: counts, noisy, and late.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from idtool.model.motion import Array
from idtool.rig import plant
from idtool.rig.plant import PlantNumbers
from idtool.rig.plant_file import STEP_S
from idtool.rig.sensors import SENSORS

#: Truth is kept once per so many steps of the plant: every millisecond.
STRIDE = 10
#: Readings of the current per period of the controller, which takes their mean, as `ffc-id teach` does.
READINGS = 2


@numba.njit(cache=True)
def _period(p: PlantNumbers, state: Array, command: float, hand: Array, steps: int, out: Array) -> float:
    """Advance by one period of the controller.

    Args:
        p, state: the plant; `state` is changed.
        command: position command, rad.
        hand: stiffness, damping, target, speed of the target, force now, its rate, share of the grip now and
            its rate; N m, rad, s. The spring acts with the grip's share, the force as it is.
        steps: of the plant.
        out: position, velocity, current, hand's torque once per STRIDE steps, shape (4, steps // STRIDE).

    Returns:
        Work of the hand, J.
    """
    factor = plant.thermal_factor(p, state[plant.TIME])
    elastic = p.compliance > 0.0
    at = plant.LOAD_POSITION if elastic else plant.POSITION
    rate = plant.LOAD_VELOCITY if elastic else plant.VELOCITY
    work = 0.0
    for k in range(steps):
        t = k * STEP_S
        spring = hand[0] * (hand[2] + hand[3] * t - state[at]) + hand[1] * (hand[3] - state[rate])
        grip = min(max(hand[6] + hand[7] * t, 0.0), 1.0)
        torque = grip * spring + hand[4] + hand[5] * t
        before = state[at]
        plant.advance(p, state, command, plant.POSITION_MODE, torque, factor)
        work += torque * (state[at] - before)
        if (k + 1) % STRIDE == 0:
            row = k // STRIDE
            out[0, row] = state[plant.POSITION]
            out[1, row] = state[plant.VELOCITY]
            out[2, row] = state[plant.CURRENT]
            out[3, row] = torque
    return work


@dataclass
class GuidedAxis:
    """A plant in one trial, with sensors and delays.

    Args:
        numbers: the plant.
        state: its state at the start; changed.
        period: of the controller, s.
        motion_delay, current_delay: how late position and velocity, and the current, are read, s.
        seed: of the sensors' noise.
        sensors: name of the sensors.
    """

    numbers: PlantNumbers
    state: Array
    period: float = 0.01
    motion_delay: float = 0.0
    current_delay: float = 0.0
    seed: int = 0
    sensors: str = "dynamixel"

    def __post_init__(self) -> None:
        """Start with a past in which it stood."""
        self._rng = np.random.default_rng(self.seed)
        self._steps = round(self.period / STEP_S)
        self._rows = self._steps // STRIDE
        self._sensors = SENSORS[self.sensors]
        start = [
            self.state[plant.POSITION],
            0.0,
            self.state[plant.INTEGRAL] / self.numbers.torque_constant,
            0.0,
        ]
        self._past = np.tile(np.array(start)[:, None], (1, 64))
        self._late = [round(1e3 * d) for d in (self.motion_delay, self.current_delay)]
        self.work = 0.0
        self.truth: list[Array] = []

    @property
    def place(self) -> float:
        """Where the hand's end of the axis is, rad."""
        elastic = self.numbers.compliance > 0.0
        return float(self.state[plant.LOAD_POSITION if elastic else plant.POSITION])

    def advance(self, command: float, hand: Array) -> tuple[float, float, float, float]:
        """One period. Returns time, position, velocity, current as read at its end."""
        out = np.empty((4, self._rows))
        self.work += _period(self.numbers, self.state, command, hand, self._steps, out)
        self._past = np.concatenate([self._past[:, self._rows :], out], axis=1)
        self.truth.append(out)
        motion, late = self._late
        s, noise = self._sensors, self._rng.standard_normal(1 + READINGS)
        position = _counted(self._past[0, -1 - motion], s.position_step)
        velocity = _counted(self._past[1, -1 - motion] + s.velocity_noise * noise[0], s.velocity_step)
        # staircase commands make the drive's current ripple in time with them: readings at the same phase
        # of every period would all be off the same way, two half a period apart cancel it
        current = 0.0
        for k in range(READINGS):
            row = -1 - late - k * self._rows // READINGS
            reading = self._past[2, row] + s.current_noise * noise[1 + k]
            current += _counted(reading, s.current_step) / READINGS
        return float(self.state[plant.TIME]), position, velocity, current


NO_HAND = np.zeros(8)


def _counted(value: float, step: float) -> float:
    return round(value / step) * step if step > 0.0 else float(value)


def speed_profile(elapsed: float, rise: float, speed: float) -> tuple[float, float]:
    """Travel and speed of a start that reaches `speed` smoothly after `rise`."""
    s = min(elapsed / rise, 1.0)
    travel = speed * rise * s**3 * (1.0 - 0.5 * s)
    return travel + speed * max(elapsed - rise, 0.0), speed * s * s * (3.0 - 2.0 * s)
