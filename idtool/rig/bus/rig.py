"""A real servo on a bus behind the interface of every rig, whoever made it.

While the axis may move, the servo is armed: it comes to rest by itself when it hears nothing more. While it
stands it is not, so that a person may take time to change the payload.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from idtool.errors import InputError, RigFault
from idtool.io.defer_signals import deferred_signals
from idtool.model.motion import Array
from idtool.parameters.axis import Axis
from idtool.rig.base import Block, Limits, Mode, Rig, Sample, Trajectory, TrialSetup
from idtool.rig.bus.servo import ServoKind
from idtool.rig.bus.settings import Settings
from idtool.rig.bus.transactions import BITS_PER_BYTE, Transactions
from idtool.rig.clock import Clock, HostClock
from idtool.rig.faults import LimitExceeded, NotFollowing

#: Sampling periods to choose from, s.
_PERIODS = (0.005, 0.01, 0.02, 0.05, 0.1)
#: Time that computer and adapter take per period besides wire and latency timer, s.
_OVERHEAD_S = 1e-3
#: A servo may take so long to answer while the rig is opened, s: nothing moves yet, and a computer that is
#: busy or an adapter that has just been plugged in is no fault of it.
_OPENING_S = 1.0
#: A block is yielded this often, s: what leaves its limits is seen no later.
_BLOCK_S = 0.05
#: Speed and gain with which the axis is brought to the start of a trial, rad/s and 1/s.
_RETURN_SPEED, _RETURN_GAIN, _RETURN_ACCELERATION = 0.5, 4.0, 2.0
#: A start is reached within this, rad, beyond half a unit of speed at that gain.
_REACHED = 0.003
#: How often the rest is made up for, and how long the axis comes to rest in between, s.
_APPROACHES, _APPROACHED_S = 3, 0.1
#: and from outside its limits, where it lies at a stop, so fast, rad/s.
_INSIDE_SPEED = 0.15
#: Slower than this the axis stands, rad/s: one unit of the servo and its noise.
_STANDS = 0.05
#: The drive's ramps are this much steeper than the trajectory, so that they smooth its steps and no more.
_RAMP_MARGIN = 1.5


class ServoRig(Rig):
    """One servo.

    Args:
        device: serial port.
        settings: see there.
        kind: of which vendor.
        clock: None is the host's, scaled as the settings say.

    Raises:
        InputError: settings that the servo cannot keep.
        RigFault: the servo cannot be reached or is not fit to move.
    """

    by_hand = True
    measures_temperature = True
    measures_voltage = True

    def __init__(
        self, device: str, settings: Settings, kind: ServoKind, *, clock: Clock | None = None
    ) -> None:
        self._clock = clock or HostClock(settings.scale)
        baud = settings.baud or kind.baud
        self._bus: Transactions = kind.open_bus(device, settings.id, baud, self._clock)
        self._bus.patience_s = _OPENING_S
        try:
            self._servo = kind.servo(self._bus, settings.zero)
            try:
                self._configure(device, settings, baud)
            except BaseException:
                with suppress(RigFault):
                    self._servo.release()
                raise
        except BaseException:
            self._bus.close()
            raise
        self._bus.patience_s = 0.0
        self._origin = self._clock.now()
        self._due = 0.0

    def _configure(self, device: str, settings: Settings, baud: int) -> None:
        servo = self._servo
        own = servo.own_limits()
        low, high = own.position
        low = low if settings.low is None else settings.low
        high = high if settings.high is None else settings.high
        if low >= high:
            raise InputError(
                f"the lowest position {low:.3g} rad is not below the highest {high:.3g} rad",
                remedy="give low and high",
            )
        speed = _at_most("speed", settings.speed, own.speed, "rad/s")
        self.measures = servo.measures
        self.speed_step = servo.speed_step
        self._refuse_strangers(settings, math.isfinite(own.current))
        current, duty = own.current, own.duty
        if math.isfinite(current):
            current = _at_most("current", settings.current, current, "A")
        if servo.measures == "voltage":
            duty = _at_most("duty", settings.duty, duty, "of the supply")
        temperature = _at_most("temperature", settings.temperature, own.temperature, "°C")
        servo.limit(speed, current, duty)
        # a current of the supply is not the motor's: it is the servo's own limit, and none of the torque
        motor = current if servo.measures == "current" else math.inf
        self.limits = Limits((low, high), speed, motor, temperature, duty)
        self.axis = self._axis(settings)
        self.description = servo.name
        needed = period_needed(servo.bytes_per_period, baud, servo.return_delay_s, latency_s(device))
        self.period_s = settings.period or next((p for p in _PERIODS if p >= needed), _PERIODS[-1])

    def _refuse_strangers(self, settings: Settings, limits_current: bool) -> None:
        """Words that this servo has no use for."""
        name = self._servo.name
        if self.measures == "current":
            why = f"the {name} measures the current of its motor"
            settings.refuse("duty", why, "give current=")
            settings.refuse("per_volt", why, "give constant=")
            return
        why = f"the {name} measures no current of its motor"
        settings.refuse("constant", why, "give per_volt=, N m/V")
        if not limits_current:
            settings.refuse("current", why, "give duty=, a share of the supply")

    def _axis(self, settings: Settings) -> Axis:
        """The axis with the constant that leads from what is measured to the torque."""
        known = settings.axis.axis if settings.axis else Axis()
        if self.measures == "current":
            constant = settings.constant or self._servo.torque_constant
            return Axis("rotary", constant, dict(known.extra))
        per_volt = settings.per_volt or known.voltage_constant or self._servo.torque_per_volt
        return Axis("rotary", None, dict(known.extra), torque_per_volt=per_volt, resistance=known.resistance)

    # --------------------------------------------------------------------- interface

    def prepare(self, setup: TrialSetup) -> None:
        """Bring the axis to the start and let it rest; payload and tilt are a person's work.

        Raises:
            NotFollowing: it did not get there.
            RigFault: the start lies outside the limits, or the servo failed.
        """
        self._open()
        low, high = self.limits.position
        start = setup.start_position
        if start is not None and not low <= start <= high:
            raise LimitExceeded(
                f"the axis cannot start at {start:g} rad, outside its limits {low:g} to {high:g} rad"
            )
        here = self._servo.read().position
        if start is None and not low <= here <= high:
            raise LimitExceeded(
                f"the axis stands at {here:.3g} rad, outside its limits {low:g} to {high:g} rad; "
                "move it inside"
            )
        if start is not None or self._servo.mode is None:
            self._enter("velocity")
        with self._moving():
            if start is not None:
                self._go_to(start)
            self._rest(setup.rest_s)
        self._prepared = True

    def play(self, trajectory: Trajectory) -> Iterator[Block]:
        """Follow the commands in real time; one that comes while the computer is late is left out.

        Raises:
            RigFault: the servo failed.
        """
        self._ready()
        command = np.asarray(trajectory.command, dtype=float)
        servo = self._servo
        moves = trajectory.mode == "velocity"
        self._enter(trajectory.mode)
        if moves:
            steepest = float(np.max(np.abs(np.diff(command, prepend=0.0)))) / trajectory.period_s
            servo.accelerate_at(_RAMP_MARGIN * steepest)
        with self._moving():
            yield from self._follow(command, trajectory.period_s, moves)

    @contextmanager
    def _moving(self) -> Iterator[None]:
        """The axis may move inside: its watchdog is armed, and on every way out it is stopped."""
        try:
            self._servo.arm()
            yield
        except BaseException:  # also where whoever takes the blocks stops taking them
            with suppress(RigFault):  # where stopping fails too, the first fault is the one to tell
                self.stop()
            raise
        self.stop()

    def _follow(self, command: Array, period: float, moves: bool) -> Iterator[Block]:
        servo = self._servo
        rows: list[tuple[Sample, float]] = []
        per_block = max(1, round(_BLOCK_S / self.period_s))
        for value in self._in_time(command, period):
            sent = servo.move_at(value) if moves else servo.move_to(self._inside(value))
            self._clock.wait_until(self._due)
            rows.append((self._read(), sent))
            if len(rows) == per_block:
                yield _block(rows)
                rows = []
        if rows:
            yield _block(rows)

    def _in_time(self, command: Array, period: float) -> Iterator[float]:
        """The command that is due, sample after sample, until all have had their time."""
        begun = self._clock.now()
        total = len(command) * period
        count = 0
        while count * self.period_s < total - 1e-9:
            self._due = begun + (count + 1) * self.period_s
            yield float(command[min(int(count * self.period_s / period + 1e-9), len(command) - 1)])
            late = self._clock.now() - self._due
            count += 1 + max(0, math.floor(late / self.period_s))

    def step(self, position_command: float, external_torque_nm: float = 0.0) -> Sample:
        """Command a position, wait for the end of the period, and measure.

        Raises:
            RigFault: the servo failed, or the command is no number.
        """
        self._takeable(position_command, external_torque_nm)
        servo = self._servo
        self._enter("position")
        servo.arm()
        servo.move_to(self._inside(position_command))
        now = self._clock.now()
        self._due = self._due + self.period_s if now <= self._due + self.period_s else now
        self._clock.wait_until(self._due)
        return self._read()

    def where(self) -> float:
        """Position, rad; the torque is not switched on for it."""
        self._open()
        return self._servo.read().position

    def stop(self) -> None:
        """Bring the axis to rest where it is and hold it there.

        Raises:
            RigFault: the servo could not be told; its own watchdog then stops it.
        """
        if self._closed or self._servo.mode is None:
            return
        with deferred_signals():
            self._servo.hold()
            until = self._clock.now() + 0.3
            while self._clock.now() < until and abs(self._servo.read(alert=False).velocity) > _STANDS:
                self._clock.wait_until(self._clock.now() + self.period_s)
            self._servo.disarm()

    def close(self) -> None:
        """Stop, switch the torque off, put the servo's settings back and let go of the port.

        Raises:
            RigFault: the torque could not be switched off.
        """
        if self._closed:
            return
        with deferred_signals():
            try:
                with suppress(RigFault):  # what could not be stopped is without torque next
                    self.stop()
                self._servo.release()
            except RigFault as fault:
                raise type(fault)(f"the torque could not be switched off: {fault}") from fault
            finally:
                self._closed = True
                self._bus.close()

    # ------------------------------------------------------------------------- parts

    @property
    def retries(self) -> int:
        """Packets that were lost or damaged and asked for again."""
        return self._bus.retries

    def _enter(self, mode: Mode) -> None:
        self._servo.enter(mode, speed=self.limits.speed, current=self.limits.current)

    def _go_to(self, goal: float) -> None:
        """Move to a position slowly; what a coarse speed leaves is made up for from where it rests."""
        self._servo.accelerate_at(_RETURN_ACCELERATION)
        reached = 0.5 * self.speed_step / _RETURN_GAIN + _REACHED
        here = self._servo.read().position
        for _ in range(_APPROACHES):
            self._approach(goal, here, reached)
            self._servo.move_at(0.0)
            self._rest(_APPROACHED_S)
            here = self._servo.read().position
            if abs(goal - here) <= 2.0 * reached:
                return

    def _approach(self, goal: float, here: float, reached: float) -> None:
        at_stop = not self.limits.position[0] <= here <= self.limits.position[1]
        speed = min(_INSIDE_SPEED if at_stop else _RETURN_SPEED, self.limits.speed)
        error = goal - here
        until = self._clock.now() + 2.0 * abs(error) / speed + 3.0
        while abs(error) > reached:
            self._servo.move_at(min(max(_RETURN_GAIN * error, -speed), speed))
            self._clock.wait_until(self._clock.now() + self.period_s)
            here = self._servo.read().position
            error = goal - here
            if self._clock.now() > until:
                raise NotFollowing(
                    f"the axis did not reach the start of the trial: it stands at {here:.3g} rad "
                    f"instead of {goal:.3g} rad; see what blocks it"
                )

    def _rest(self, seconds: float) -> None:
        until = self._clock.now() + seconds
        while self._clock.now() < until:
            self._servo.read()  # keeps the watchdog quiet and notices a shutdown
            self._clock.wait_until(min(self._clock.now() + 0.02, until))

    def _inside(self, position: float) -> float:
        low, high = self.limits.position
        return min(max(position, low), high)

    def _read(self) -> Sample:
        """What the servo measures, at a time of this rig's clock."""
        sample = self._servo.read()
        return replace(sample, time_s=sample.time_s - self._origin)


def _block(rows: list[tuple[Sample, float]]) -> Block:
    samples, sent = zip(*rows, strict=True)
    return Block.of(samples, np.array(sent))


def _at_most(name: str, wanted: float | None, limit: float, unit: str) -> float:
    if wanted is not None and wanted > limit:
        raise InputError(
            f"the servo itself is limited to {limit:.3g} {unit}",
            place=name,
            remedy=f"lower {name}, or raise the limit in the servo",
        )
    return limit if wanted is None else wanted


def period_needed(bytes_per_period: int, baud: int, return_delay_s: float, latency: float) -> float:
    """The shortest period for a goal and a reading, s.

    Args:
        bytes_per_period: of both and their answers.
        baud: bits a second.
        return_delay_s: of the servo, s.
        latency: of the adapter, s.
    """
    wire = bytes_per_period * BITS_PER_BYTE / baud
    return 1.2 * (wire + 2.0 * (return_delay_s + latency) + _OVERHEAD_S)


def latency_s(device: str) -> float:
    """How long a USB adapter keeps bytes back, s; 0 for what is none or does not say."""
    name = Path(device).resolve().name
    with suppress(OSError, ValueError):
        return 1e-3 * float(Path(f"/sys/bus/usb-serial/devices/{name}/latency_timer").read_text())
    return 0.0
