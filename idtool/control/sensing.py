"""The hand's torque, from the motor current and the identified model.

    tau_ext = LP[ tau_gravity + tau_friction + tau_effects - K i ]

filtered once, inertia included, which makes it a momentum observer (De Luca & Mattone, ICRA 2003) where
the file knows the inertia.

At rest an encoder cannot see how far the bristle is deflected, to within a few counts times the bristle
stiffness. Within that band, and never beyond what friction can hold, friction is taken to be what
leaves no hand. A soft bristle so keeps its tracked value and a light hand is felt before anything
slides; a stiff one must break away first; neither creeps after a stop.
"""

from __future__ import annotations

import math
from collections import deque

from idtool.control.guard import Measurement
from idtool.control.load import Instant
from idtool.control.online import OnlineModel

#: An axis that stayed within one count for so long rests, s.
_REST_WINDOW_S = 0.05
#: Encoder counts by which the bristle's deflection is uncertain after a stop.
_BRISTLE_COUNTS = 3.0


class HandSense:
    """Estimates the hand's torque.

    Attributes:
        torque: the estimate, N m (N); positive pushes +q.
        raw: the same before the filter.
        slack: friction at rest beyond the tracked bristle, N m (N).
    """

    def __init__(self, model: OnlineModel, period: float, filter_time: float, resolution: float) -> None:
        self._model = model
        self._filter_time = filter_time
        self._resolution = resolution
        self._recent: deque[float] = deque(maxlen=max(2, round(_REST_WINDOW_S / period) + 1))
        self._remainder = Remainder(model, period)
        self.reset()

    def reset(self) -> None:
        """Forget everything measured; the bristle is unknown again."""
        self._model.reset()
        self._recent.clear()
        self._remainder.clear()
        self._mean = 0.0
        self._samples = 0
        self._band = self._model.friction_bound
        self._zero = 0.0
        self.torque = self.raw = 0.0
        self.slack = 0.0

    def listen(self, sample: Measurement) -> None:
        """Take in a sample while no hand touches: the mean of what the model leaves is friction."""
        self._samples += 1
        # a mean, because noise of the current would otherwise be frozen into the bristle
        self._mean += (self._left(sample) - self._mean) / self._samples

    def resume(self) -> None:
        """Go on after an interruption, in which the bristle stayed bent as it was."""
        self._remainder.clear()

    def settle(self) -> None:
        """End of listening: deflect the bristle to what was heard, as far as friction allows; what is left
        is a load that nobody told of and moves the zero."""
        bound = self._model.friction_bound
        held = self._model.bristle_stiffness * self._model.bristle - self._mean
        bent = min(max(held, -bound), bound)
        self._zero = bent - held
        self._model.bristle = bent / self._model.bristle_stiffness
        self._band = 0.0

    def feel(self, sample: Measurement) -> float:
        """Take in a sample and return the hand's torque."""
        torque = self._left(sample)
        torque += self._rest_friction(torque)
        self.raw = torque
        self.torque += (1.0 - math.exp(-self._remainder.step / self._filter_time)) * (torque - self.torque)
        return self.torque

    def _left(self, sample: Measurement) -> float:
        """What the motor does not carry of the model's torque, beyond the zero, N m (N)."""
        self._recent.append(sample.position)
        before = self._remainder.take(sample)
        change = (sample.velocity - before.velocity) / self._remainder.step
        return self._remainder.torque(sample, sample.velocity, change) - self._zero

    def _rest_friction(self, torque: float) -> float:
        """Friction that rests in the bristle unseen: what leaves no hand, within what is possible."""
        model = self._model
        if not self._rests():
            if self.slack:
                model.bristle += self.slack / model.bristle_stiffness
                self.slack = 0.0
            unseen = _BRISTLE_COUNTS * self._resolution * model.bristle_stiffness
            self._band = min(model.friction_bound, unseen)
            return 0.0
        held = model.bristle_stiffness * model.bristle
        low = max(-self._band, -model.friction_bound - held)
        high = min(self._band, model.friction_bound - held)
        self.slack = min(max(-torque, low), high) if low <= high else 0.0
        return self.slack

    def _rests(self) -> bool:
        recent = self._recent
        return len(recent) == recent.maxlen and max(recent) - min(recent) <= 1.01 * self._resolution


class Remainder:
    """What the motor does not carry of the model's torque, sample by sample.

    Attributes:
        step: time since the sample before, s.
    """

    def __init__(self, model: OnlineModel, period: float, in_time: bool = False) -> None:
        """`in_time`: the speed is that of now, however late it is read, and no current waits for it."""
        self._model, self._period, self._in_time = model, period, in_time
        self._line = DelayLine()
        self.clear()

    def clear(self) -> None:
        """Forget what was measured."""
        self._line.clear()
        self._last: Measurement | None = None
        self._travel, self.step = 0.0, self._period

    def take(self, sample: Measurement) -> Measurement:
        """Go on to this sample; the one before, or itself where it is the first."""
        before = self._last or sample
        self._last = sample
        step = sample.time - before.time
        self.step = step if step > 0.0 else self._period
        self._travel = sample.position - before.position
        return before

    def torque(self, sample: Measurement, velocity: float, acceleration: float) -> float:
        """At that sample and this motion, N m (N); `OnlineModel.load` is of it."""
        load = self._model.update(
            Instant(
                sample.time,
                self.step,
                sample.position,
                velocity,
                acceleration,
                sample.payload,
                sample.tilt_alpha,
                sample.tilt_beta,
                math.nan if sample.temperature is None else sample.temperature,
                self._travel,
            )
        )
        motor = load.arriving(self._model.torque_constant * sample.current)
        carried = load.total
        if (
            load.delay > 0.0 and not self._in_time
        ):  # the motion is reported late: compare it with the current of then
            motor = self._line.delayed(sample.time, motor, load.delay)
        elif load.delay < 0.0:
            carried = self._line.delayed(sample.time, carried, -load.delay)
        left = carried - motor
        # only a file edited into absurdity gets past the finite numbers that the guard lets through
        return left if math.isfinite(left) else 0.0


class DelayLine:
    """What a signal was a short while ago, read between its samples."""

    def __init__(self) -> None:
        self._samples: deque[tuple[float, float]] = deque(maxlen=64)

    def clear(self) -> None:
        self._samples.clear()

    def delayed(self, time: float, value: float, delay: float) -> float:
        """Take in `value` of `time` and return the signal at `time - delay` (held at its oldest)."""
        self._samples.append((time, value))
        wanted = time - delay
        later_time, later = time, value
        for earlier_time, earlier in reversed(self._samples):
            if earlier_time <= wanted:
                span = later_time - earlier_time
                share = (wanted - earlier_time) / span if span > 0 else 0.0
                return earlier + share * (later - earlier)
            later_time, later = earlier_time, earlier
        return later
