"""A rig that does what it is told and remembers it: fast, exact, and faulty on demand."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from idtool.parameters.axis import Axis
from idtool.rig.base import Block, Limits, Rig, Sample, Trajectory, TrialSetup

#: A block is handed through this before it is yielded; its index counts from 0 over the whole run.
Change = Callable[[int, Block], Block]


class RigDouble(Rig):
    """Follows velocity commands exactly; the current is 0.1 A."""

    def __init__(
        self,
        *,
        kind: str = "rotary",
        limits: Limits | None = None,
        change: Change | None = None,
        period_s: float = 0.005,
        temperature: bool = False,
    ) -> None:
        self.axis = Axis("linear" if kind == "linear" else "rotary", 2.0)
        self.limits = limits or Limits((-2.3, 2.3), 1.2, 1.5)
        self.period_s = period_s
        self.measures_temperature = temperature
        self.description = "a double"
        self.calls: list[str] = []
        self.setups: list[TrialSetup] = []
        self.position = 0.0
        self.time = 0.0
        self._change = change
        self._blocks = 0

    def prepare(self, setup: TrialSetup) -> None:
        self.calls.append("prepare")
        self.setups.append(setup)
        if setup.start_position is not None:
            self.position = setup.start_position

    def play(self, trajectory: Trajectory) -> Iterator[Block]:
        self.calls.append("play")
        assert trajectory.period_s == self.period_s
        # a length that no decimation divides
        for begin in range(0, len(trajectory.command), 47):
            command = trajectory.command[begin : begin + 47]
            time = self.time + self.period_s * np.arange(1.0, len(command) + 1.0)
            position = np.asarray(self.position + self.period_s * np.cumsum(command), dtype=float)
            self.time, self.position = float(time[-1]), float(position[-1])
            warm = np.full(len(command), 30.0) if self.measures_temperature else None
            block = Block(time, position, command.copy(), np.full(len(command), 0.1), command, warm)
            yield self._change(self._blocks, block) if self._change else block
            self._blocks += 1

    def step(self, position_command: float, external_torque_nm: float = 0.0) -> Sample:
        raise NotImplementedError

    def stop(self) -> None:
        self.calls.append("stop")

    def close(self) -> None:
        self.calls.append("close")


def spoil(at: int, **columns: float) -> Change:
    """From block `at` on, every reading named holds this value."""

    def change(index: int, block: Block) -> Block:
        if index < at:
            return block
        return replace(block, **{k: np.full(len(block.time_s), v) for k, v in columns.items()})

    return change
