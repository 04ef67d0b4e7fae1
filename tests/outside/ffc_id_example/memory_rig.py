"""A rig that moves in memory only."""

from collections.abc import Iterator

import numpy as np

from idtool.errors import RigFault
from idtool.parameters.axis import Axis
from idtool.rig import RigKind
from idtool.rig.base import Block, Limits, Rig, Sample, Trajectory, TrialSetup


class MemoryRig(Rig):
    axis = Axis("rotary", 2.67)
    limits = Limits(position=(-2.5, 2.5), speed=2.0, current=1.5)
    period_s = 0.005
    description = "an axis in memory"

    def __init__(self) -> None:
        self._time = self._position = 0.0

    def prepare(self, setup: TrialSetup) -> None:
        self._open()
        if setup.start_position is not None:
            self._position = setup.start_position  # a real one drives there, and raises RigFault if it cannot
        self._time += setup.rest_s
        self._prepared = True

    def play(self, trajectory: Trajectory) -> Iterator[Block]:
        for command in np.array_split(trajectory.command, max(len(trajectory.command) // 50, 1)):
            self._ready()
            if trajectory.mode == "velocity":
                position = self._position + np.cumsum(command) * trajectory.period_s
            else:
                position = command
            velocity = np.gradient(position, trajectory.period_s)
            time = self._time + trajectory.period_s * np.arange(1, len(command) + 1)
            self._position, self._time = float(position[-1]), float(time[-1])
            yield Block(time, position, velocity, self._current(velocity), command)

    def step(self, position_command: float, external_torque_nm: float = 0.0) -> Sample:
        self._ready()
        if external_torque_nm:
            raise RigFault("a simulated hand cannot push this rig")
        velocity = (position_command - self._position) / self.period_s
        self._position, self._time = position_command, self._time + self.period_s
        return Sample(self._time, position_command, velocity, float(self._current(np.array(velocity))))

    def stop(self) -> None:
        """Nothing moves by itself."""

    def close(self) -> None:
        self._closed = True

    def _current(self, velocity: np.ndarray) -> np.ndarray:
        return (0.08 * np.tanh(velocity / 0.01) + 0.12 * velocity) / 2.67


MEMORY = RigKind("memory:NAME", "an axis in memory", lambda name, options, seed: MemoryRig())
