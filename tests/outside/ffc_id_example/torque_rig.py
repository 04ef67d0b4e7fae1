"""A motor that takes a torque; here the axis behind it is three lines of arithmetic."""

import numpy as np

from idtool.parameters.axis import Axis
from idtool.rig import RigKind
from idtool.rig.base import Limits, Sample
from idtool.rig.torque import TorqueRig


class Motor(TorqueRig):
    axis = Axis("rotary", 0.9)
    limits = Limits(position=(-2.5, 2.5), speed=3.0, current=1.5)
    period_s = 0.005
    description = "a motor that takes a torque"
    inertia = 0.01
    bandwidth = 40.0

    def __init__(self) -> None:
        super().__init__()
        self._time = self._position = self._velocity = 0.0

    def apply(self, torque: float) -> Sample:
        # a real one sends the torque, waits for the end of the period and asks what was measured
        pushed = self._velocity + self.period_s * (torque - 0.1 * self._velocity) / self.inertia
        held = self.period_s * 0.08 / self.inertia
        self._velocity = float(np.sign(pushed) * max(abs(pushed) - held, 0.0))
        self._position += self.period_s * self._velocity
        self._time += self.period_s
        return Sample(self._time, self._position, self._velocity, torque / 0.9)

    def let_go(self) -> None:
        """No torque any more."""


MOTOR = RigKind("motor:NAME", "a motor that takes a torque", lambda name, options, seed: Motor())
