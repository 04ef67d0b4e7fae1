"""What the axis carries at rest, beside what the model says: before a motion, and while the button is up.

    left = K i - tau_gravity - tau_effects

At rest friction holds anything up to its level, so |left| may be that much and what the file and the told
payload may be wrong by, and no more: beyond it the payload, the tilt, the gravity or the sign of the current
is not what was told, and an axis that took the difference for a hand would drive off.

While the button is up and the axis stands, friction does not change: whatever changes and then stays, as
quietly as the current is with hands off, is a load that was hung on or taken off, and is taken in: it is
taken off the current (`offset`). A hand trembles, and is not. One that is as quiet as a load cannot be told
from one until it leaves: what is felt then is all that was taken in (`has_left`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from idtool.parameters import Parameter

#: Of the uncertainties, so many standard deviations are no disagreement.
SIGMAS = 2.0
#: A change of the load is one of so many noises of the current at least, and stays for so many windows.
CHANGE_NOISES, STEADY_WINDOWS = 3.0, 3
#: ... each of a variance of at most so many times that with hands off: of 20 samples beside 20 one in forty
#: is above it by chance. A reading in steps has a twelfth of a step squared at least.
QUIET, STEP_VARIANCE = 2.5, 1.0 / 12.0
#: What is felt within this of a load that was taken in, of less than so many times that variance, is that
#: load, gone: friction keeps some of it, and the drive has hardly settled. Such a hand trembles by more.
ALIKE, LOUD = 0.3, 6.0


@dataclass(frozen=True)
class Uncertainty:
    """Standard deviations of what the axis carries at rest, N m (N).

    Attributes:
        gravity: standard error of the gravity terms that no payload has a share in.
        payload: by how much the payload may differ from what was told, as a torque.
        per_payload: standard error of the gravity torque of a kilogram, N m/kg.
        friction: of the friction level.
        noise: of one reading of the current.
    """

    gravity: float
    payload: float
    per_payload: float
    friction: float
    noise: float

    @property
    def most(self) -> float:
        """All of them where the file hardly knows its gravity, N m (N).

        Such a file explains any load, and an axis that took what it does not know for a hand would drive off:
        the file's errors explain no more than friction, which keeps the axis where it is, and the noise may.
        """
        return math.sqrt(self.payload**2 + 2.0 * self.friction**2 + self.noise**2)

    def of(self, payload: float) -> float:
        """All of them, the payload being so many kg, N m (N)."""
        file = self.gravity**2 + (self.per_payload * payload) ** 2
        return min(math.sqrt(file + self.payload**2 + self.friction**2), self.most)


def gravity_error(gravity: Mapping[str, Parameter]) -> float:
    """Standard error of the gravity terms that do not multiply a payload, N m (N)."""
    return math.hypot(*(p.stderr or 0.0 for name, p in gravity.items() if name != "per_payload"))


class RestLoad:
    """Means of what is left over windows of one listening each.

    Attributes:
        offset: load that nobody told of, N m (N); it is taken off what the motor carries.
        missing: the payload that was told is not there, as at an end effector that waits for its camera.
        excess: what is beyond the allowance, N m (N); 0 where the axis agrees with its model.
        allowed: the allowance.
        changed: load that was hung on or taken off since the start, N m (N).
        taken: the last of that, N m (N), as long as it may have been a hand; minus that if it seems to have
            left.
        away: whether it seems so.
    """

    def __init__(self, window: int, bound: float, uncertainty: Uncertainty, most: float | None) -> None:
        """What is judged by.

        Args:
            window: samples of a mean.
            bound: the most that friction can hold at rest, N m (N).
            uncertainty: see there.
            most: allowance in place of that of friction and uncertainties; inf: nothing is judged.
        """
        self._window = window
        self._bound = bound
        self._uncertainty = uncertainty
        self._most = most
        self.least_change = CHANGE_NOISES * uncertainty.noise
        self._least_variance = STEP_VARIANCE * uncertainty.noise**2
        self.reset()

    def reset(self) -> None:
        """Nothing is known of the load."""
        self.offset = self.changed = self.taken = 0.0
        self.away = self.missing = False
        self.allowed = self.excess = 0.0
        self._calm = self._least_variance
        self.forget()

    def forget(self) -> None:
        """Begin a new window; what is next is compared with nothing."""
        self._begin_window()
        self._base: float | None = None
        self._last = math.inf
        self._steady = 0

    def _begin_window(self) -> None:
        self._sum = self._squares = 0.0
        self._count = 0

    def listen(self, left: float) -> None:
        """Take in a sample of a listening: what is left, the offset not taken off, N m (N)."""
        self._sum += left
        self._squares += left * left
        self._count += 1

    def _heard(self) -> tuple[float, float]:
        """Mean and variance of the window."""
        mean = self._sum / max(self._count, 1)
        return mean, (self._squares - self._sum * mean) / self._window

    def judge(self, payload: float, weight: float, level: float, bent: float, *, button: bool) -> bool:
        """The end of a listening: compare its mean with the model.

        Args:
            payload: that was told, kg.
            weight: its gravity torque, N m (N).
            level: the friction level at rest, N m (N).
            bent: what of it the law takes for a bristle that is bent, N m (N).
            button: whether the axis waits for a button, so that it may rise without its payload.

        Returns:
            Whether the offset changed, so that the axis has to be listened to anew.
        """
        mean, variance = self._heard()
        before = self.offset
        bound = max(self._bound, level)
        self.allowed = bound + SIGMAS * self._uncertainty.of(payload)
        if self._most is not None:
            self.allowed = self._most
        self.forget()
        told = mean - self.changed  # what was hung on later is known
        if self.away and abs(told) > self.allowed >= abs(told + self.taken):
            self.undo()  # it is there still
            told = mean - self.changed
        if abs(told) <= self.allowed:
            self.missing, self.excess, base = False, 0.0, 0.0
        elif button and weight != 0.0 and abs(told + weight) <= self.allowed:
            self.excess, base = 0.0, -weight
            self.missing = abs(self.changed - weight) > 0.5 * abs(weight)  # it was not mounted since
        else:
            self.excess = told
            return False
        self._calm = max(variance, self._least_variance)
        self._base = mean - bent  # a load may be hung on before a window is over
        self.offset = base + self.changed
        return self.offset != before

    def watch(self, left: float, bent: float, *, stale: bool = False) -> bool:
        """While the button is up and the axis stands: take in what is left beside the bristle, N m (N).

        Args:
            left: what the motor carries beside the model's gravity and effects.
            bent: what the bristle holds of it.
            stale: the law's zero is of before the axis moved: once hands are off, it has to be taken anew.

        Returns:
            Whether the axis has to be listened to anew: the load was changed, or the zero is to be taken.
        """
        self.listen(left - bent)
        if self._count < self._window:
            return False
        mean, variance = self._heard()
        self._begin_window()
        quiet = variance <= QUIET * self._calm
        if self._base is None and quiet and not stale:
            self._base = mean
        stays = quiet and abs(mean - self._last) <= self.least_change
        other = stale if self._base is None else abs(mean - self._base) > self.least_change
        self._last = mean
        self._steady = self._steady + 1 if stays and other else 0
        if self._steady < STEADY_WINDOWS:
            return False
        if self._base is not None:
            self.taken, self.away = mean - self._base, False
            self.changed += self.taken
        self.forget()
        return True

    def has_left(self) -> bool:
        """Whether what was listened to is the load that was taken in last, gone again."""
        mean, variance = self._heard()
        return abs(mean - self.taken) <= ALIKE * abs(self.taken) and variance <= LOUD * self._calm

    def undo(self) -> None:
        """What was taken in last has left, be it a hand or a load; or it is back, and was a load."""
        self.changed -= self.taken
        self.offset -= self.taken
        self.taken = 0.0 if self.away else -self.taken
        self.away = not self.away

    def settle(self) -> None:
        """A hand has moved the axis since: what was taken in is a load."""
        self.taken, self.away = 0.0, False
