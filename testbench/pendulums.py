"""Logs of a pendulum on a servo, by inverse dynamics: its motion is chosen, its torque follows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from idtool import Axis, Log, Parameters
from idtool.model.units import STANDARD_GRAVITY
from idtool.parameters import EffectEntry, Parameter


@dataclass(frozen=True)
class Pendulum:
    """A mass on a lever behind friction; SI. `inertia` is with the mass on it."""

    inertia: float = 0.02
    mass: float = 0.5
    lever: float = 0.1
    own: float = 0.0
    coulomb: float = 0.06
    viscous: float = 0.05
    torque_constant: float = 1.2

    def parameters(self) -> Parameters:
        """The file that describes it."""
        pull = self.mass * STANDARD_GRAVITY * self.lever + self.own
        return Parameters(
            axis=Axis("rotary", self.torque_constant),
            gravity_model="arm",
            gravity={"sin": Parameter(pull), "cos": Parameter(0.0)},
            static={
                "coulomb": Parameter(self.coulomb),
                "static": Parameter(self.coulomb),
                "stribeck_velocity": Parameter(0.1),
                "viscous": Parameter(self.viscous),
            },
            effects=(EffectEntry("inertia", {"inertia": Parameter(self.inertia)}),),
        )

    def log(
        self,
        *,
        seed: int = 0,
        seconds: float = 20.0,
        rate: float = 200.0,
        payload: float | None = None,
        noise: float = 0.005,
        axis: Axis | None = None,
    ) -> Log:
        """A swing with current; `payload` scales the mass and is logged, None is the mass unlogged."""
        random = np.random.default_rng(seed)
        time = np.arange(0.0, seconds, 1.0 / rate)
        position, velocity, acceleration = np.zeros((3, len(time)))
        ramp = np.clip(time / 1.0, 0.0, 1.0)
        ramp = ramp**3 * (10.0 - 15.0 * ramp + 6.0 * ramp**2)
        for amplitude, frequency in ((0.9, 0.13), (0.25, 0.61), (0.06, 1.7)):
            position += amplitude * np.sin(2 * np.pi * frequency * time + random.uniform(0, 6.28))
        position *= ramp
        velocity, acceleration = np.gradient(position, time), np.gradient(np.gradient(position, time), time)
        mass = self.mass if payload is None else payload
        inertia = self.inertia + (mass - self.mass) * self.lever**2
        torque = inertia * acceleration + self.coulomb * np.sign(velocity) + self.viscous * velocity
        torque += (mass * STANDARD_GRAVITY * self.lever + self.own) * np.sin(position)
        count = 2 * np.pi / 65536
        frame = pd.DataFrame(
            {
                "trial": 0,
                "time_s": time,
                "position_rad": np.round(position / count) * count,
                "current_a": torque / self.torque_constant + noise * random.standard_normal(len(time)),
            }
        )
        if payload is not None:
            frame["payload_kg"] = payload
        return Log(frame, axis or Axis(), source=f"swing_{seed}.csv")
