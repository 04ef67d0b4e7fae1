"""What every rig can do: the interface that recipes and the controller rely on.

A rig is one axis with its drive: simulated, or a servo on a bus. Units are SI at the shaft where the
torque constant holds; on a linear axis read m for rad and N for N m. The clock of a rig runs on from
trial to trial.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import NDArray

from idtool.errors import InputError, RigFault
from idtool.model.motion import Array
from idtool.parameters.axis import Axis

Mode = Literal["velocity", "position"]
#: What a rig measures that stands for the motor's torque: its current, A, or the voltage at it, V.
Measured = Literal["current", "voltage"]
#: Shows a sample to a person and neither waits nor raises: time, position, effort (A or V), torque of the
#: hand (NaN if nobody knows it).
Watch = Callable[[float, float, float, float], None]


@dataclass(frozen=True)
class Limits:
    """What the axis must not exceed.

    Attributes:
        position: lowest and highest position, rad (m).
        speed: rad/s (m/s).
        current: A; inf on a rig that measures no current of its motor.
        temperature: degrees Celsius.
        duty: share of the supply's voltage, on a rig that measures it.
    """

    position: tuple[float, float]
    speed: float
    current: float = math.inf
    temperature: float = 80.0
    duty: float = 1.0


@dataclass(frozen=True)
class TrialSetup:
    """How the axis stands before a trial.

    Attributes:
        payload_kg: what it carries.
        tilt_alpha_rad, tilt_beta_rad: how it is tilted; gravity does not act at alpha = pi/2.
        start_position: where the trial starts, rad (m); None is where the axis is.
        temperature_degc: temperature of the surroundings; None is as it is.
        rest_s: how long the axis stands still before the trial starts.
    """

    payload_kg: float = 0.0
    tilt_alpha_rad: float = 0.0
    tilt_beta_rad: float = 0.0
    start_position: float | None = None
    temperature_degc: float | None = None
    rest_s: float = 0.5

    @property
    def logged(self) -> dict[str, float]:
        """What a log says of it in every row: role of the column -> value."""
        return {
            "payload": self.payload_kg,
            "tilt_alpha": self.tilt_alpha_rad,
            "tilt_beta": self.tilt_beta_rad,
        }


@dataclass(frozen=True)
class Trajectory:
    """Commands at a fixed period.

    Attributes:
        period_s: time between commands.
        mode: what is commanded.
        command: velocities, rad/s (m/s), or positions, rad (m), shape (commands,).
    """

    period_s: float
    mode: Mode
    command: Array

    def __post_init__(self) -> None:
        if not np.all(np.isfinite(self.command)) or self.period_s <= 0.0:
            raise InputError("a trajectory needs finite commands and a period above zero")

    def held(self, period_s: float) -> Array:
        """The command in force in each period of this length, s; shape (periods,)."""
        count = round(len(self.command) * self.period_s / period_s)
        at = np.floor(np.arange(count) * (period_s / self.period_s) + 1e-9).astype(int)
        return np.asarray(self.command[np.minimum(at, len(self.command) - 1)], dtype=float)


@dataclass(frozen=True)
class Block:
    """Consecutive samples of one trial, shape (samples,) each; a reading that the rig lacks is None.

    Attributes:
        time_s: s.
        position, velocity: rad (m) and rad/s (m/s).
        current: of the motor, A.
        command: in force when the sample was taken.
        temperature: degrees Celsius.
        voltage: of the supply, V.
        duty: share of it that is at the motor, -1 to 1.
        bus_current: of the supply, A.
    """

    time_s: Array
    position: Array
    velocity: Array
    current: Array | None
    command: Array
    temperature: Array | None = None
    voltage: Array | None = None
    duty: Array | None = None
    bus_current: Array | None = None

    @classmethod
    def of(cls, samples: Sequence[Sample], command: Array) -> Block:
        """Samples in order, and what was in force at each, shape (samples,)."""
        columns: dict[str, Any] = {}
        for field in fields(Sample):
            readings = [getattr(sample, field.name) for sample in samples]
            columns[field.name] = None if readings[0] is None else np.array(readings)
        return cls(command=command, **columns)

    @classmethod
    def joined(cls, blocks: Sequence[Block]) -> Block:
        """Blocks that follow on each other, as one; a reading that one of them lacks is None."""
        columns: dict[str, Any] = {}
        for field in fields(cls):
            parts = [getattr(block, field.name) for block in blocks]
            columns[field.name] = None if any(part is None for part in parts) else np.concatenate(parts)
        return cls(**columns)

    def rows(self, chosen: NDArray[np.bool_]) -> Block:
        """Some of its samples."""
        columns: dict[str, Any] = {}
        for field in fields(self):
            readings = getattr(self, field.name)
            columns[field.name] = None if readings is None else readings[chosen]
        return Block(**columns)

    @property
    def effort(self) -> Array:
        """What stands for the motor's torque: its current, A, else the voltage at it, V."""
        if self.current is not None:
            return self.current
        assert self.duty is not None
        assert self.voltage is not None
        return self.duty * self.voltage


@dataclass(frozen=True)
class Sample:
    """One sample, as `step` returns it; the fields are those of `Block`."""

    time_s: float
    position: float
    velocity: float
    current: float | None
    temperature: float | None = None
    voltage: float | None = None
    duty: float | None = None
    bus_current: float | None = None

    @property
    def effort(self) -> float:
        """What stands for the motor's torque: its current, A, else the voltage at it, V."""
        if self.current is not None:
            return self.current
        assert self.duty is not None
        assert self.voltage is not None
        return self.duty * self.voltage


class Rig(ABC):
    """One axis. Use it as a context manager: every way out stops it.

    Attributes:
        axis: kind of axis and torque constant.
        limits: what it must not exceed.
        period_s: sampling and control period.
        speed_step: the drive rounds commanded speeds to multiples of it, rad/s (m/s); 0 is not at all.
        simulated: whether `step` takes the torque of a hand.
        by_hand: whether a person changes payload and tilt.
        measures: the motor's current, or where there is no such reading the voltage at it.
        measures_temperature, measures_voltage, measures_bus_current: whether its blocks hold a temperature,
            a supply voltage, a current of the supply.
        description: one line for a person; it goes into logs and holds no secret of a simulation.
    """

    axis: Axis
    limits: Limits
    period_s: float
    speed_step: float = 0.0
    simulated: bool = False
    by_hand: bool = False
    measures: Measured = "current"
    measures_temperature: bool = False
    measures_voltage: bool = False
    measures_bus_current: bool = False
    description: str

    #: What every rig remembers: whether `close` was called, and `prepare` since it last had to be.
    _closed = _prepared = False

    def _open(self) -> None:
        """Refuse what is asked of a closed rig."""
        if self._closed:
            raise RigFault("the rig is closed")

    def _ready(self) -> None:
        """Refuse a motion that was not prepared."""
        self._open()
        if not self._prepared:
            raise RigFault("the rig was not prepared for a trial")

    def _takeable(self, position_command: float, external_torque_nm: float) -> None:
        """Refuse what a real axis cannot take: a simulated hand, or a command that is no number."""
        self._ready()
        if external_torque_nm != 0.0:
            raise RigFault("a simulated hand cannot push a real axis")
        if not math.isfinite(position_command):
            raise RigFault("the drive refused a command that is not a finite number")

    @property
    def effort_readings(self) -> dict[str, str]:
        """Role of a log's column -> field of `Block` and `Sample`, for what stands for the motor's torque."""
        readings = {"current": "current"} if self.measures == "current" else {"duty": "duty"}
        return readings | ({"bus_current": "bus_current"} if self.measures_bus_current else {})

    @property
    def step_readings(self) -> dict[str, str]:
        """As `effort_readings`, with the supply's voltage where it takes part: for a log of samples."""
        return self.effort_readings | ({} if self.measures == "current" else {"supply_voltage": "voltage"})

    @abstractmethod
    def prepare(self, setup: TrialSetup) -> None:
        """Bring the axis to rest as `setup` says, holding its position.

        Raises:
            RigFault: it did not get there.
        """

    @abstractmethod
    def play(self, trajectory: Trajectory) -> Iterator[Block]:
        """Follow the commands and yield what was measured, about a quarter of a second at a time.

        Raises:
            RigFault: the drive reported a fault.
        """

    @abstractmethod
    def step(self, position_command: float, external_torque_nm: float = 0.0) -> Sample:
        """Command a position, wait one period, and measure.

        Args:
            position_command: rad (m).
            external_torque_nm: torque (N m; N) with which a hand pushes towards +q; a rig that is not
                simulated has a real hand and takes 0 only.
        """

    def where(self) -> float | None:
        """Position, rad (m), read without a motion; None where the rig cannot say."""
        return None

    @abstractmethod
    def stop(self) -> None:
        """Stop the axis where it is; safe at any time, any number of times."""

    @abstractmethod
    def close(self) -> None:
        """Stop and let go of the device; safe to call twice."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, _: object, error: BaseException | None, __: object) -> None:
        try:
            self.close()
        except RigFault:
            if not isinstance(error, RigFault):  # else the first fault is the one to tell
                raise
