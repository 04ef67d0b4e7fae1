"""A supervisor around any rig: it stops what leaves its limits and remembers the last second."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, fields
from typing import Self

import numpy as np

from idtool.errors import RigFault
from idtool.io.defer_signals import deferred_signals
from idtool.model.motion import Array
from idtool.model.units import unit_text
from idtool.rig.base import Block, Rig, Sample, Trajectory, TrialSetup
from idtool.rig.faults import BadReading, LimitExceeded, NotFollowing

#: Beyond a limit by this share (of the range of positions, of the highest speed or current) the axis is
#: stopped; noise of the sensors and the small overshoot of a drive stay below it.
TOLERANCE = 0.05
#: How much of the past a fault carries, s.
REMEMBERED_S = 1.0
#: A sample that comes this many periods after the last one is late.
_LATE = 1.5
#: The axis has to move by this share of what is commanded, once so much (share of the range) is.
_FOLLOWS, _WAY = 0.1, 0.04
#: and after a reversal it has this long to turn, s.
_PATIENCE_S = 0.3


@dataclass
class LoopTime:
    """How well the rig kept its period.

    Attributes:
        samples: how many there were.
        overruns: how many came late.
        longest_s: longest time between two samples of a trial.
    """

    samples: int = 0
    overruns: int = 0
    longest_s: float = 0.0


class Supervisor(Rig):
    """A rig that is watched. Every reading passes through here before anything else sees it.

    Readings beyond a limit are handed on, since they are evidence, and the fault follows them; readings
    that are no numbers are not.

    Args:
        rig: any rig; it stays the caller's to close.
        speed_tolerance: share beyond the limit of speed at which the axis is stopped.

    Attributes:
        loop: how well it keeps its period.
    """

    def __init__(self, rig: Rig, *, speed_tolerance: float = TOLERANCE) -> None:
        self._speed_tolerance = speed_tolerance
        self.axis, self.limits, self.period_s = rig.axis, rig.limits, rig.period_s
        self.simulated, self.by_hand, self.description = rig.simulated, rig.by_hand, rig.description
        self.measures, self.measures_bus_current = rig.measures, rig.measures_bus_current
        self.measures_temperature, self.measures_voltage = rig.measures_temperature, rig.measures_voltage
        self.speed_step = rig.speed_step
        self.loop = LoopTime()
        self._rig = rig
        self._past: deque[Block] = deque()
        self._newest: float | None = None
        self._travel = _Travel(rig)

    def prepare(self, setup: TrialSetup) -> None:
        """As the rig's.

        Raises:
            RigFault: with the last second as its history.
        """
        with self._witness():
            self._rig.prepare(setup)
        self._newest = None  # a motion begins: the time before it is no overrun

    def play(self, trajectory: Trajectory) -> Iterator[Block]:
        """As the rig's, supervised.

        Raises:
            LimitExceeded, NotFollowing, BadReading: the axis was stopped.
            RigFault: the rig failed. Each carries the last second as its history.
        """
        blocks = self._rig.play(trajectory)
        moves = trajectory.mode == "velocity"
        self._newest = None
        self._travel.forget()
        while True:
            with self._witness():
                block = next(blocks, None)
            if block is None:
                return
            with self._witness():
                self._take(block)
                fault: RigFault | None = beyond(block, self, self._speed_tolerance)
                if fault is None and moves:
                    fault = self._travel.check(block)
                if fault is not None:
                    with suppress(RigFault):  # its own watchdog stops a rig that does not listen
                        self._rig.stop()
            yield block
            if fault is not None:
                fault.history = self.last_second()
                raise fault

    def step(self, position_command: float, external_torque_nm: float = 0.0) -> Sample:
        """As the rig's, supervised.

        Raises:
            LimitExceeded: the axis was stopped.
            RigFault: the rig failed. Each carries the last second as its history.
        """
        with self._witness():
            sample = self._rig.step(position_command, external_torque_nm)
            block = Block.of([sample], np.array([position_command]))
            if not _finite(block):
                return sample  # a controller judges what it is given itself, and knows what to do
            self._remember(block)
            fault = beyond(block, self, self._speed_tolerance)
            if fault is not None:
                raise fault
        return sample

    def where(self) -> float | None:
        """As the rig's."""
        return self._rig.where()

    def stop(self) -> None:
        """As the rig's."""
        self._rig.stop()

    def close(self) -> None:
        """As the rig's."""
        self._rig.close()

    def last_second(self) -> Block | None:
        """What was measured last; None before the first sample."""
        if not self._past:
            return None
        joined = Block.joined(self._past)
        return joined.rows(joined.time_s >= joined.time_s[-1] - REMEMBERED_S)

    @contextmanager
    def _witness(self) -> Iterator[None]:
        """Stop the axis on a fault and give the fault its history."""
        try:
            yield
        except RigFault as fault:
            with suppress(RigFault):
                self._rig.stop()
            if fault.history is None:
                fault.history = self.last_second()
            raise

    def _take(self, block: Block) -> None:
        if self.measures_temperature and block.temperature is None:
            raise BadReading("the rig stopped measuring its temperature")
        if not _finite(block):
            raise BadReading("a sensor returned something that is no number, so the axis was stopped")
        self._remember(block)

    def _remember(self, block: Block) -> None:
        self._count(block.time_s)
        self._past.append(block)
        while float(self._past[0].time_s[-1]) < float(block.time_s[-1]) - REMEMBERED_S:
            self._past.popleft()

    def _count(self, time: Array) -> None:
        steps = np.diff(time if self._newest is None else np.concatenate([[self._newest], time]))
        self._newest = float(time[-1])
        self.loop.samples += len(time)
        late = steps > _LATE * self.period_s
        self.loop.overruns += int(np.count_nonzero(late))
        self.loop.longest_s = max(self.loop.longest_s, float(steps.max(initial=0.0)))


class SupervisedRun:
    """A run on a supervised rig: as a context it stops the axis whatever happens.

    Attributes:
        interrupted: Ctrl-C ended the block, without an error.
    """

    interrupted = False

    def __init__(self, rig: Supervisor) -> None:
        self._rig = rig

    def _end(self) -> None:
        """The last thing that is done, however the run ends."""

    def _told(self, fault: RigFault) -> RigFault:
        """The fault as whoever started the run hears it, once the axis stands."""
        return fault

    def __enter__(self) -> Self:
        return self

    def __exit__(self, _: object, error: BaseException | None, __: object) -> bool:
        self.interrupted = isinstance(error, KeyboardInterrupt)
        failed = error is not None and not self.interrupted
        with deferred_signals():
            try:
                # where stopping fails too, the first fault is the one to tell
                with suppress(RigFault) if failed else nullcontext():
                    self._rig.stop()
                if isinstance(error, RigFault) and (told := self._told(error)) is not error:
                    raise told from error
            finally:
                self._end()
        return self.interrupted


class _Travel:
    """Notices an axis that does not move although it is told to: blocked, or a dead encoder."""

    def __init__(self, rig: Rig) -> None:
        self._way = _WAY * (rig.limits.position[1] - rig.limits.position[0])
        self._period = rig.period_s
        self.forget()

    def forget(self) -> None:
        """A motion begins."""
        self._last: float | None = None
        self._still = 0.0  # way commanded since the position last changed at all
        self._turn(0.0)

    def _turn(self, sign: float) -> None:
        """Begin a new account in one direction."""
        self._sign = sign
        self._commanded = self._moved = self._elapsed = 0.0

    def check(self, block: Block) -> NotFollowing | None:
        for command, position in zip(block.command.tolist(), block.position.tolist(), strict=True):
            if self._stuck(command, position):
                return NotFollowing(
                    "the axis was stopped because its position does not follow the commands; "
                    "see whether it is blocked, or its encoder broken"
                )
        return None

    def _stuck(self, command: float, position: float) -> bool:
        last, self._last = self._last, position
        if last is None:
            return False
        way = abs(command) * self._period
        self._still = self._still + way if position == last else 0.0
        if command * self._sign <= 0.0:
            self._turn(float(np.sign(command)))
        self._commanded += way
        self._moved += (position - last) * self._sign
        self._elapsed += self._period
        if self._commanded >= self._way and self._elapsed >= _PATIENCE_S:
            if self._moved < _FOLLOWS * self._commanded:
                return True
            self._turn(self._sign)
        return self._still >= self._way


def beyond(block: Block, rig: Rig, speed_tolerance: float = TOLERANCE) -> LimitExceeded | None:
    """The fault of a block that leaves the limits of its rig."""
    limits, kind = rig.limits, rig.axis.kind
    low, high = limits.position
    margin = TOLERANCE * (high - low)
    fast, most = (1.0 + speed_tolerance) * limits.speed, (1.0 + TOLERANCE) * limits.current
    checks = [
        ("position", block.position, low - margin, high + margin, unit_text("position", kind)),
        ("velocity", block.velocity, -fast, fast, unit_text("velocity", kind)),
    ]
    if block.current is not None:
        checks.append(("current", block.current, -most, most, "A"))
    elif block.duty is not None:
        most = limits.duty + TOLERANCE
        checks.append(("duty", block.duty, -most, most, "of the supply"))
    if block.temperature is not None:
        checks.append(("temperature", block.temperature, -np.inf, limits.temperature, "°C"))
    remedies = {"temperature": "let it cool down", "position": "lower the travel"}
    for what, values, least, highest, unit in checks:
        outside = np.flatnonzero((values < least) | (values > highest))
        if len(outside):
            return LimitExceeded(
                f"the axis was stopped because its {what} of {values[outside[0]]:.3g} {unit} at "
                f"{block.time_s[outside[0]]:.2f} s is beyond the limit; "
                f"{remedies.get(what, 'lower the speed or the payload')}"
            )
    return None


def _finite(block: Block) -> bool:
    readings = (getattr(block, field.name) for field in fields(Block) if field.name != "command")
    return all(np.isfinite(values).all() for values in readings if values is not None)
