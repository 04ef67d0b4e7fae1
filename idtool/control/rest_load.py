"""What the axis carries at rest, beside what the model says: before a motion, and while the button is up.

    left = K i - tau_gravity - tau_effects

At rest friction holds anything up to its level, so |left| may be that much and what the file and the told
payload may be wrong by, and no more: beyond it the payload, the tilt, the gravity or the sign of the current
is not what was told, and an axis that took the difference for a hand would drive off.

While the button is up and the axis stands, friction does not change: whatever changes and then stays is a
load that was hung on or taken off, and is taken in: it is taken off the current (`offset`). A hand does not
stay; it is not.
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
        self.reset()

    def reset(self) -> None:
        """Nothing is known of the load."""
        self.offset = self.changed = 0.0
        self.missing = False
        self.allowed = self.excess = 0.0
        self.forget()

    def forget(self) -> None:
        """Begin a new window; what is next is compared with nothing."""
        self._sum = 0.0
        self._count = 0
        self._base: float | None = None
        self._last = math.nan
        self._steady = 0

    def listen(self, left: float) -> None:
        """Take in a sample of a listening: what is left, the offset not taken off, N m (N)."""
        self._sum += left
        self._count += 1

    def judge(self, payload: float, weight: float, level: float, *, button: bool) -> bool:
        """The end of a listening: compare its mean with the model.

        Args:
            payload: that was told, kg.
            weight: its gravity torque, N m (N).
            level: the friction level at rest, N m (N).
            button: whether the axis waits for a button, so that it may rise without its payload.

        Returns:
            Whether the offset changed, so that the axis has to be listened to anew.
        """
        mean = self._sum / max(self._count, 1)
        bound = max(self._bound, level)
        self.allowed = bound + SIGMAS * self._uncertainty.of(payload)
        if self._most is not None:
            self.allowed = self._most
        self.forget()
        told = mean - self.changed  # what was hung on later is known
        if abs(told) <= self.allowed:
            self.missing, self.excess, base = False, 0.0, 0.0
        elif button and weight != 0.0 and abs(told + weight) <= self.allowed:
            self.excess, base = 0.0, -weight
            self.missing = abs(self.changed - weight) > 0.5 * abs(weight)  # it was not mounted since
        else:
            self.excess = told
            return False
        offset, before = base + self.changed, self.offset
        self.offset = offset
        return offset != before

    def watch(self, left: float) -> bool:
        """While the button is up and the axis stands: take in what is left beside the bristle, N m (N).

        Returns:
            Whether the load was changed, so that the axis has to be listened to anew.
        """
        self.listen(left)
        if self._count < self._window:
            return False
        mean, self._sum, self._count = self._sum / self._count, 0.0, 0
        if self._base is None:
            self._base = mean
        change = mean - self._base
        same = abs(mean - self._last) <= self.least_change
        self._last = mean
        self._steady = self._steady + 1 if same and abs(change) > self.least_change else 0
        if self._steady < STEADY_WINDOWS:
            return False
        self.changed += change
        self.forget()
        return True
