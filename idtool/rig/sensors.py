"""What the sensors of a simulated rig make of the truth: noise, then steps.

All readings of a sample belong to the same instant. Noise is white and independent per sample.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from idtool.model.motion import Array

#: Of the supply's voltage, V.
VOLTAGE_STEP = 0.1


@dataclass(frozen=True)
class Motor:
    """The winding and its supply.

    Attributes:
        supply: V.
        resistance: of the winding, ohm.
        supply_resistance: of cable and source, by which the voltage sags, ohm.
    """

    supply: float
    resistance: float
    supply_resistance: float = 0.0


@dataclass(frozen=True)
class Sensors:
    """Resolution and noise; a step of 0 is none.

    Attributes:
        position_step: rad.
        velocity_step: rad/s.
        current_step: A.
        temperature_step: °C.
        velocity_noise: standard deviation, rad/s.
        current_noise: standard deviation, A.
        duty_step, duty_noise: shares of the supply's voltage; a step above 0 where the duty is read and the
            motor's current is not.
    """

    position_step: float
    velocity_step: float
    current_step: float
    temperature_step: float
    velocity_noise: float
    current_noise: float
    duty_step: float = 0.0
    duty_noise: float = 0.0

    def read(self, truth: Array, rng: np.random.Generator) -> Array:
        """Readings of position, velocity, current, temperature (rows 1 to 4; row 0 is time).

        Args:
            truth: as `plant.run` notes it, shape (READINGS, samples).
            rng: the rig's.

        Returns:
            The same shape, a new array.
        """
        reading = truth.copy()
        noise = rng.standard_normal((2, truth.shape[1]))
        reading[2] += self.velocity_noise * noise[0]
        reading[3] += self.current_noise * noise[1]
        steps = (self.position_step, self.velocity_step, self.current_step, self.temperature_step)
        for row, step in enumerate(steps, start=1):
            if step > 0.0:
                reading[row] = np.rint(reading[row] / step) * step
        return reading

    def electrical(
        self, truth: Array, motor: Motor, constant: float, rng: np.random.Generator
    ) -> tuple[Array, Array]:
        """Readings of the supply's voltage, V, and of the duty, shape (samples,) each.

        Args:
            truth: as above.
            motor: the winding and its supply.
            constant: N m/A, which is the back-EMF's V s/rad too.
            rng: the rig's.
        """
        # the back-EMF is that of now, however late the speed is read
        current, velocity = truth[3], truth[5]
        wanted = motor.resistance * current + constant * velocity
        supply = motor.supply - motor.supply_resistance * np.abs(current * wanted) / motor.supply
        duty = wanted / supply
        if self.duty_noise > 0.0:
            duty = duty + self.duty_noise * rng.standard_normal(len(duty))
        if self.duty_step > 0.0:
            duty = np.rint(duty / self.duty_step) * self.duty_step
        return np.rint(supply / VOLTAGE_STEP) * VOLTAGE_STEP, np.clip(duty, -1.0, 1.0)


_RPM = 2.0 * math.pi / 60.0

#: By name. "dynamixel": the units of the X series' control table (position 4096 per turn, velocity 0.229 rpm,
#: current 2.69 mA, temperature 1 °C; ROBOTIS e-Manual); noise is an assumption, one step of current and 0.3
#: steps of velocity. "lab": a fine encoder and a current probe. "ideal": the truth. "feetech": the units of
#: the STS series: position 4096 per turn, speed in 50 counts a second, duty 0.1 %, and no current; noise of
#: the duty is an assumption, three steps.
SENSORS = {
    "dynamixel": Sensors(2.0 * math.pi / 4096, 0.229 * _RPM, 2.69e-3, 1.0, 0.3 * 0.229 * _RPM, 2.69e-3),
    "lab": Sensors(1e-4, 5e-4, 5e-4, 0.1, 1e-3, 2e-3),
    "feetech": Sensors(2.0 * math.pi / 4096, 100.0 * math.pi / 4096, 0.0, 1.0, 0.0, 0.0, 1e-3, 3e-3),
    "ideal": Sensors(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
}
