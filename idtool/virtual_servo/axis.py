"""The axis behind the virtual servo: the compiled plant, with a motor that can be switched off.

What a simulated rig has no need of: without current the load falls, and at the ends of the stroke the
axis meets a stop.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from idtool.rig import plant
from idtool.rig.base import TrialSetup
from idtool.rig.numbers import plant_numbers
from idtool.rig.plant_file import STEP_S, PlantFile
from idtool.rig.sensors import SENSORS

#: How far past the limits of the plant file the mechanical stops are, rad.
_STOP_BEYOND = 0.1
#: Slower than this it stands still, rad/s.
_STILL = 0.02
#: The stops are looked at this often, s.
_CHUNK_S = 0.005


@dataclass(frozen=True)
class Drive:
    """What the servo's registers tell the drive.

    Attributes:
        mode: plant.VELOCITY_MODE or plant.POSITION_MODE, None is torque off.
        goal: rad/s or rad.
        speed_limit: of position commands, rad/s; inf is the plant file's.
        current_limit: A; inf is the plant file's.
        acceleration: of the profile, rad/s2; inf is the plant file's.
    """

    mode: int | None = None
    goal: float = 0.0
    speed_limit: float = math.inf
    current_limit: float = math.inf
    acceleration: float = math.inf


@dataclass(frozen=True)
class Reading:
    """What the sensors say: rad, rad/s, A, degrees Celsius.

    Attributes:
        duty: share of the supply's voltage at the motor.
        voltage: of the supply, V.
        bus_current: of the supply, A.
    """

    position: float
    velocity: float
    current: float
    temperature: float
    duty: float
    voltage: float
    bus_current: float


class VirtualAxis:
    """A plant that moves as time passes.

    Args:
        file: the truth.
        seed: of the sensors' noise.
        sensors: name of the sensors.
        setup: payload and tilt at the start.

    Attributes:
        hand_nm: torque of a hand, towards +q, N m.
        still_s: how long it has stood still, s.
    """

    def __init__(
        self, file: PlantFile, *, seed: int = 0, setup: TrialSetup | None = None, sensors: str = "dynamixel"
    ) -> None:
        self.file = file
        self._rng = np.random.default_rng(seed)
        self._sensors = SENSORS[sensors]
        self._state, self._history = plant.blank_state()
        self._out = np.zeros((plant.READINGS, 1))
        self._drive = Drive()
        self._steps_owed = 0.0
        self.hand_nm = 0.0
        self.still_s = 0.0
        self.load(setup or TrialSetup())
        self.advance(STEP_S)

    def load(self, setup: TrialSetup) -> None:
        """Change payload, tilt and ambient temperature, as a person in the laboratory does."""
        self._loaded = plant_numbers(self.file, setup)
        self._apply()

    def command(self, drive: Drive) -> None:
        """Put a drive into force."""
        if drive.mode != self._drive.mode:
            # loops start afresh, from the speed that the axis has
            self._state[plant.INTEGRAL] = 0.0
            self._state[plant.REFERENCE] = self._state[plant.VELOCITY]
            self._state[plant.REFERENCE_RATE] = 0.0
        self._drive = drive
        self._apply()

    def _apply(self) -> None:
        p, drive = self._loaded, self._drive
        limit = 0.0 if drive.mode is None else min(p.current_limit, drive.current_limit)
        self._numbers = p._replace(
            current_limit=limit,
            speed_limit=min(p.speed_limit, drive.speed_limit),
            velocity_profile_acceleration=min(p.velocity_profile_acceleration, drive.acceleration),
            position_profile_acceleration=min(p.position_profile_acceleration, drive.acceleration),
        )

    def advance(self, seconds: float) -> None:
        """Let time pass; what is less than a step is kept for the next call."""
        self._steps_owed += seconds / STEP_S
        chunk = round(_CHUNK_S / STEP_S)
        goal = np.array([self._drive.goal if self._drive.mode is not None else 0.0])
        mode = plant.VELOCITY_MODE if self._drive.mode is None else self._drive.mode
        while self._steps_owed >= 1.0:
            steps = min(int(self._steps_owed), chunk)
            self._steps_owed -= steps
            plant.run(self._numbers, self._state, self._history, goal, mode, self.hand_nm, steps, self._out)
            self._stop_at_the_ends()
            moves = abs(self.velocity) > _STILL
            self.still_s = 0.0 if moves else self.still_s + steps * STEP_S

    def _stop_at_the_ends(self) -> None:
        low, high = self._loaded.lowest - _STOP_BEYOND, self._loaded.highest + _STOP_BEYOND
        position = self._state[plant.POSITION]
        if not low <= position <= high:
            self._state[plant.POSITION] = min(max(position, low), high)
            self._state[plant.VELOCITY] = 0.0

    @property
    def position(self) -> float:
        """The true position, rad."""
        return float(self._state[plant.POSITION])

    @property
    def velocity(self) -> float:
        """The true velocity, rad/s."""
        return float(self._state[plant.VELOCITY])

    def read(self) -> Reading:
        """The sensors, now."""
        voltage, duty = (
            values[0]
            for values in self._sensors.electrical(
                self._out, self.file.motor, self._loaded.torque_constant, self._rng
            )
        )
        position, velocity, current, warm = self._sensors.read(self._out, self._rng)[1:5, 0].tolist()
        # a bridge that is on for a share of the time passes the motor's current to the supply for that share
        bus = float(self._out[3, 0]) * duty
        return Reading(position, velocity, current, warm, float(duty), float(voltage), float(bus))
