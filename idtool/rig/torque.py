"""A rig whose drive takes a torque: what makes it go to a position is closed here, once a period.

    torque = 3 J b (dr/dt - w) + 3 J b^2 (r - q) + J b^3 (integral of r - q)

puts the three poles of an inertia J at -b; gravity and friction are what the integral finds.

Source: pole placement, Astrom & Murray, Feedback Systems, 2008, chapter 6.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterator

import numpy as np

from idtool.errors import InputError
from idtool.rig.base import Block, Rig, Sample, Trajectory, TrialSetup
from idtool.rig.faults import LimitExceeded, NotFollowing

#: Bandwidth times period up to which the three poles stay real once the loop is closed in periods.
_MOST_PER_PERIOD = 0.4
#: Share of the highest speed that the axis reaches on the way to a start.
_RETURN_SHARE = 0.25
#: The loop has settled after so long, in 1 / bandwidth (three equal poles leave 5e-7 then), and the start is
#: reached within this share of the range of positions.
_SETTLED, _REACHED = 20.0, 0.01
#: How often a block is yielded, and how long the axis is braked at most, s.
_BLOCK_S, _BRAKING_S = 0.25, 0.3


class TorqueRig(Rig):
    """A rig that is told torques.

    Attributes:
        inertia: of what moves, roughly, kg m2 (kg).
        bandwidth: of the loop, 1/s; its product with the period is at most 0.4.
    """

    inertia: float
    bandwidth: float

    def __init__(self) -> None:
        if not 0.0 < self.bandwidth * self.period_s <= _MOST_PER_PERIOD:
            raise InputError(
                f"a loop of {self.bandwidth:g} 1/s is too fast for a period of {self.period_s:g} s",
                remedy=f"lower bandwidth to {_MOST_PER_PERIOD / self.period_s:g} 1/s or less",
            )
        self._integral = self._reference = 0.0
        self._last: Sample | None = None

    @abstractmethod
    def apply(self, torque: float) -> Sample:
        """Apply a torque, N m (N), until the next one; wait for the end of the period, and measure.

        The axis must come to no harm where no next one comes: by the drive's own watchdog, or because
        nothing falls.

        Raises:
            RigFault: the drive failed.
        """

    @abstractmethod
    def let_go(self) -> None:
        """Take the torque away and let go of the device."""

    def prepare(self, setup: TrialSetup) -> None:
        """Bring the axis to the start and let it rest; payload and tilt are a person's work.

        Raises:
            LimitExceeded: the start lies outside the limits.
            NotFollowing: it did not get there.
            RigFault: the drive failed.
        """
        self._open()
        here = self._here().position
        goal = here if setup.start_position is None else setup.start_position
        low, high = self.limits.position
        if not low <= goal <= high:
            raise LimitExceeded(f"the axis cannot start at {goal:g}, outside its limits {low:g} to {high:g}")
        if not self._prepared:
            self._integral, self._reference = 0.0, here
        way = goal - self._reference
        # half a wave of a cosine, whose speed rises from nothing to the share and falls again
        count = math.ceil(0.5 * math.pi * abs(way) / (_RETURN_SHARE * self.limits.speed * self.period_s))
        for left in 0.5 + 0.5 * np.cos(np.pi * np.arange(1, count + 1) / max(count, 1)):
            self._follow(goal - way * float(left))
        for _ in range(math.ceil((_SETTLED / self.bandwidth + setup.rest_s) / self.period_s)):
            here = self._follow(goal).position
        if abs(here - goal) > _REACHED * (high - low):
            self.stop()
            raise NotFollowing(
                f"the axis did not reach the start of the trial: it stands at {here:.3g} instead of "
                f"{goal:.3g}; see what blocks it, and whether its inertia is told right"
            )
        self._prepared = True

    def play(self, trajectory: Trajectory) -> Iterator[Block]:
        """Follow the commands, one sample a period.

        Raises:
            RigFault: the drive failed.
        """
        self._ready()
        commands, by_speed = trajectory.held(self.period_s), trajectory.mode == "velocity"
        per_block = max(1, round(_BLOCK_S / self.period_s))
        for part in np.array_split(commands, max(1, math.ceil(len(commands) / per_block))):
            samples = []
            for command in part.tolist():
                self._ready()
                reference = self._reference + command * self.period_s if by_speed else command
                samples.append(self._follow(reference))
            yield Block.of(samples, part)

    def step(self, position_command: float, external_torque_nm: float = 0.0) -> Sample:
        """As every rig's; its hand is a real one."""
        self._takeable(position_command, external_torque_nm)
        return self._follow(position_command)

    def where(self) -> float:
        """Position, rad (m), under the torque that holds it."""
        self._open()
        return self._here().position

    def stop(self) -> None:
        """Brake where it is; the torque that then holds it stays."""
        if self._closed or not self._prepared:
            return
        self._reference = self._here().position
        for _ in range(math.ceil(_BRAKING_S / self.period_s)):
            self._follow(self._reference)

    def close(self) -> None:
        """Stop, and let go of the device."""
        if not self._closed:
            try:
                self.stop()
            finally:
                self._closed = True
                self.let_go()

    def _here(self) -> Sample:
        """What was measured last; before the first motion without a torque."""
        if self._last is None:
            self._last = self.apply(0.0)
        return self._last

    def _follow(self, reference: float) -> Sample:
        """One period of the loop."""
        most = self.limits.speed
        rate = min(max((reference - self._reference) / self.period_s, -most), most)
        here, b = self._here(), self.bandwidth
        error = reference - here.position
        integral = self._integral + self.inertia * b**3 * error * self.period_s
        torque = 3.0 * self.inertia * b * (rate - here.velocity + b * error) + integral
        strongest = self.limits.current * (self.axis.torque_constant or math.inf)
        if abs(torque) <= strongest:
            self._integral = integral  # what the drive cannot give is not asked for later
        self._reference = reference
        self._last = self.apply(min(max(torque, -strongest), strongest))
        return self._last
