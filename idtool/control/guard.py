"""What keeps the controller safe: limits, the check of every measurement, and the status it reports."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

from idtool.errors import InputError

#: No axis is farther from its zero than this, rad or m, whatever its limits say.
_FARTHEST = 1e6


class State(StrEnum):
    """What the controller is doing."""

    STARTING = "starting"  # reads the bristle from the current; hands off
    RESTING = "resting"  # holds its place until a hand pushes
    TARING = "taring"  # moves by itself to learn its load; hands off
    GUIDING = "guiding"  # follows a hand
    STOPPING = "stopping"  # brakes after a hand that let go
    HELD = "held"  # the teach button is up: braked, then held
    FAULT = "fault"  # holds the last safe position until `recover`


class Reason(StrEnum):
    """Why the controller stopped following."""

    NOT_FINITE = "not_finite"
    STALE = "stale"
    TIME_JUMP = "time_jump"
    POSITION_JUMP = "position_jump"
    VELOCITY = "velocity"
    CURRENT = "current"
    OUT_OF_RANGE = "out_of_range"
    SURROUNDINGS = "surroundings"
    TORQUE = "torque"
    MISMATCH = "mismatch"
    SPEED_LIMIT = "speed_limit"
    ENERGY = "energy"


@dataclass(frozen=True)
class Measurement:
    """One sample as the controller got it; SI, rad or m by the kind of axis."""

    time: float
    position: float
    velocity: float
    current: float
    payload: float = 0.0
    tilt_alpha: float = 0.0
    tilt_beta: float = 0.0
    temperature: float | None = None


@dataclass(frozen=True)
class Fault:
    """Why the controller holds.

    Attributes:
        reason: the kind.
        message: one sentence with the numbers.
        history: the last samples before it, oldest first, the offending one last.
    """

    reason: Reason
    message: str
    history: tuple[Measurement, ...] = ()


@dataclass(frozen=True)
class Status:
    """What the controller knows after a step.

    Attributes:
        state: what it is doing.
        message: the same in words.
        command_valid: False only while no usable position was ever measured; do not send it then.
        position_command: what `step` returned, rad (m).
        external_torque: estimate of the hand's torque, filtered, N m (N), positive pushes +q.
        uncertainty: by how much the model may be wrong at this motion (mode "light"), N m (N); so much of the
            hand's torque does not move the axis.
        velocity_wanted: speed at which the axis is asked to yield, rad/s (m/s).
        gravity, friction, effects: what is compensated, N m (N).
        limited: which limits cut the command in this step ("speed", "step", "range").
        fault: set in state FAULT.
        notes: what the file asks for and cannot be compensated here.
    """

    state: State
    message: str
    command_valid: bool
    position_command: float
    external_torque: float
    velocity_wanted: float
    gravity: float
    friction: float
    effects: float
    limited: tuple[str, ...] = ()
    fault: Fault | None = None
    notes: tuple[str, ...] = ()
    uncertainty: float = 0.0


@dataclass(frozen=True)
class Limits:
    """Bounds of what is commanded and of what a measurement may say. SI; rad or m by the kind of axis.

    Attributes:
        position_min, position_max: range of the command; a position outside by more than `margin`
            is a fault.
        margin: how far outside the range an axis may be measured, rad (m).
        speed: greatest speed asked of the axis, rad/s (m/s).
        command_step: greatest change of the command per period, rad (m); None: no limit.
        measured_speed: a velocity, or a change of position, faster than this is impossible.
        current: a current above this is impossible, A.
        torque: nothing that a hand may do is above this, N m (N).
        mismatch: what the axis may carry at rest beside its model, N m (N); None: what friction can hold and
            the uncertainties say (`idtool.control.rest_load`); inf: nothing is judged.
        guided_speed: a guided axis that is faster than this is stopped, rad/s (m/s).
        energy: most energy that a guided axis may give to the hand that it has not from it, J.
        idle_s: an axis that rests for so long with its button down is held until the button was up, s.
        stale_samples: so many samples alike, while the axis is said to move, are stale.
        gap_periods: a gap in time longer than this many periods is a fault.
    """

    position_min: float = -math.inf
    position_max: float = math.inf
    margin: float = 0.05
    speed: float = 3.0
    command_step: float | None = None
    measured_speed: float = 12.0
    current: float = 10.0
    torque: float = math.inf
    mismatch: float | None = None
    guided_speed: float = math.inf
    energy: float = math.inf
    idle_s: float = math.inf
    stale_samples: int = 5
    gap_periods: float = 5.0

    def __post_init__(self) -> None:
        """Check them.

        Raises:
            InputError: a bound that is NaN, not positive, or a range that is empty.
        """
        if not self.position_min < self.position_max:
            raise InputError("the position range is empty", place="Limits.position_min")
        for name in (
            "speed",
            "measured_speed",
            "current",
            "torque",
            "gap_periods",
            "guided_speed",
            "energy",
            "idle_s",
        ):
            if not getattr(self, name) > 0:
                raise InputError("expected a number > 0", place=f"Limits.{name}")
        if self.mismatch is not None and not self.mismatch > 0:
            raise InputError("expected a number > 0", place="Limits.mismatch")
        if self.command_step is not None and not 0 < self.command_step < math.inf:
            raise InputError("expected a finite number > 0", place="Limits.command_step")
        if not self.margin >= 0 or self.stale_samples < 2:
            raise InputError("expected margin >= 0 and stale_samples >= 2", place="Limits")

    def clip(self, position: float) -> float:
        """The nearest position inside the range."""
        return min(max(position, self.position_min), self.position_max)


class Guard:
    """Checks each measurement against the one before. It never raises; it names what is wrong."""

    def __init__(self, limits: Limits, period: float, resolution: float, unit: str) -> None:
        self._limits = limits
        self._period = period
        self._resolution = resolution
        self._unit = unit
        self.reset()

    def reset(self) -> None:
        """Forget the measurements seen."""
        self._last: Measurement | None = None
        self._alike = 0

    def check(self, sample: Measurement, *, clocked: bool) -> tuple[Reason, str] | None:
        """The fault of a sample, or None; a good one is remembered.

        Args:
            sample: the measurement.
            clocked: its time was measured, not counted.
        """
        wrong = self._impossible(sample) or self._against_last(sample, clocked=clocked)
        if wrong is None:
            self._last = sample
        return wrong

    def _impossible(self, sample: Measurement) -> tuple[Reason, str] | None:
        limits = self._limits
        for name in ("time", "position", "velocity", "current"):
            if not math.isfinite(getattr(sample, name)):
                return Reason.NOT_FINITE, f"{name} is {getattr(sample, name)}"
        for name in ("payload", "tilt_alpha", "tilt_beta", "temperature"):
            value = getattr(sample, name)
            if value is not None and not math.isfinite(value):
                return Reason.SURROUNDINGS, f"{name} is {value}"
        if not 0.0 <= sample.payload <= 1e4 or max(abs(sample.tilt_alpha), abs(sample.tilt_beta)) > 10.0:
            return Reason.SURROUNDINGS, (
                f"payload {sample.payload:g} kg, tilt {sample.tilt_alpha:g} and {sample.tilt_beta:g} rad"
                " are impossible"
            )
        if sample.temperature is not None and not -90.0 <= sample.temperature <= 400.0:
            return Reason.SURROUNDINGS, f"temperature of {sample.temperature:g} degrees Celsius is impossible"
        if abs(sample.position) > _FARTHEST:
            return Reason.OUT_OF_RANGE, f"position {sample.position:.4g} {self._unit} is impossible"
        if abs(sample.velocity) > limits.measured_speed:
            return Reason.VELOCITY, f"velocity of {sample.velocity:.4g} {self._unit}/s is impossible"
        if abs(sample.current) > limits.current:
            return Reason.CURRENT, f"current of {sample.current:.4g} A is impossible"
        low, high = limits.position_min - limits.margin, limits.position_max + limits.margin
        if not low <= sample.position <= high:
            return Reason.OUT_OF_RANGE, (
                f"position {sample.position:.4g} {self._unit} is outside"
                f" {limits.position_min:.4g} to {limits.position_max:.4g}"
            )
        return None

    def _against_last(self, sample: Measurement, *, clocked: bool) -> tuple[Reason, str] | None:
        last = self._last
        if last is None:
            return None
        step = sample.time - last.time
        if clocked:
            if step == 0.0:
                return Reason.STALE, f"the sample of {sample.time:.4f} s came twice"
            if not 0.0 < step <= self._limits.gap_periods * self._period:
                return Reason.TIME_JUMP, f"time went from {last.time:.4f} s to {sample.time:.4f} s"
        moved = abs(sample.position - last.position)
        # one period of grace: an encoder and a clock are not read at the same instant
        if moved > self._limits.measured_speed * (step + self._period):
            return Reason.POSITION_JUMP, (
                f"position went from {last.position:.4g} to {sample.position:.4g} {self._unit}"
                f" in {step:.3g} s"
            )
        return self._frozen(sample, last)

    def _frozen(self, sample: Measurement, last: Measurement) -> tuple[Reason, str] | None:
        """An axis that says it moves and shows the same position, velocity and current is not being read."""
        same = (sample.position, sample.velocity, sample.current) == (
            last.position,
            last.velocity,
            last.current,
        )
        self._alike = self._alike + 1 if same else 0
        moving = abs(sample.velocity) * self._period * self._alike > 3.0 * self._resolution
        if self._alike >= self._limits.stale_samples and moving:
            return Reason.STALE, (
                f"{self._alike + 1} samples alike while the velocity says"
                f" {sample.velocity:.4g} {self._unit}/s"
            )
        return None


def check_torque(limits: Limits, torque: float, unit: str) -> tuple[Reason, str] | None:
    """The fault of what is taken for the hand's torque, N m (N), or None."""
    if abs(torque) <= limits.torque:
        return None
    return Reason.TORQUE, f"{torque:.3g} {unit} on the axis is beyond {limits.torque:.3g} {unit}"
