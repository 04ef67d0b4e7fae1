"""Logs of a pendulum on a servo that reports duty: simulated step by step, with formulas of its own.

Regularised Karnopp: below a small speed the axis stands while the rest of the torque stays under break-away.
The duty bends on its way to torque, the gears take a share of the load, and the speed is read late.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from idtool import Axis, Log

_STEP_S = 2.5e-4
_STANDS = 2e-3
_FULL = 1.0


@dataclass(frozen=True)
class DutyServo:
    """The axis, torque in volts of the motor.

    Attributes:
        inertia, gravity, coulomb, viscous: V s^2/rad, V, V, V s/rad; the back-EMF apart.
        back_emf: V s/rad, while the drive is on.
        share: of the load that the gears take as friction at rest; it fades with the speed.
        fading: speed over which it fades, rad/s.
        bend: b in d / (1 + b d).
        dead_band: duty that makes no torque yet.
        gain: duty per rad.
        late: by how much the reported speed is late, s.
    """

    inertia: float = 0.05
    gravity: float = 4.0
    coulomb: float = 0.1
    viscous: float = 0.1
    back_emf: float = 0.4
    share: float = 0.25
    fading: float = 0.5
    bend: float = 0.6
    dead_band: float = 0.0
    gain: float = 0.8
    late: float = 0.02
    supply: float = 7.4

    def log(self, amplitude: float, frequency: float, *, seconds: float = 6.0, off_after: float = 9e9) -> Log:
        """A goal that swings, through the servo's own position loop; the drive is off after a while."""
        clock = np.arange(0.0, seconds, _STEP_S)
        goal = amplitude * np.sin(2.0 * math.pi * frequency * clock) ** 3
        q, w = 0.0, 0.0
        rows = np.empty((len(clock), 4))
        for k, t in enumerate(clock):
            on = t < off_after
            duty = min(max(self.gain * (goal[k] - q), -_FULL), _FULL) if on else 0.0
            size = max(abs(duty) - self.dead_band, 0.0)
            drive = math.copysign(self.supply * size / (1.0 + self.bend * size), duty)
            load = self.gravity * math.sin(q)
            level = self.coulomb + self.share * abs(load) * math.exp(-((w / self.fading) ** 2))
            rest = drive - load
            if abs(w) < _STANDS and abs(rest) <= level:
                w = 0.0
            else:
                way = math.copysign(1.0, w if abs(w) >= _STANDS else rest)
                damping = self.viscous + (self.back_emf if on else 0.0)
                after = w + _STEP_S * (rest - level * way - damping * w) / self.inertia
                w = 0.0 if after * w < 0.0 else after
            q += _STEP_S * w
            rows[k] = q, w, duty, on
        every = slice(0, None, 20)
        late = np.interp(clock - self.late, clock, rows[:, 1])
        frame = pd.DataFrame(
            {
                "trial": 0,
                "time_s": clock[every],
                "position_rad": np.round(rows[every, 0] / 1.5e-3) * 1.5e-3,
                "velocity_rad_s": np.round(late[every] / 0.024) * 0.024,
                "duty": np.round(rows[every, 2] * 885.0) / 885.0,
                "position_command_rad": goal[every],
                "supply_voltage_v": self.supply,
                "drive_on": rows[every, 3],
            }
        )
        return Log(frame, Axis(), source=f"servo_{amplitude:g}_{frequency:g}.csv")
