"""The tare: an axis moves to and fro by itself, hands off, so that the law learns its load and friction.

    place = reach (1 - cos turn k),   speed = speed_max sin turn k        k-th sample, whole cycles

Was it hands off? An axis repeats itself: whatever moves it so takes the same torque of the motor in every
cycle, with the model or without; a hand does not. So a cycle is cut in parts, and the mean torque of every
part is compared with that of the cycle before. (A hand that leans on it from beginning to end is a load.)
"""

from __future__ import annotations

import math
from typing import final

#: A tare moves to and fro so often.
CYCLES = 2
#: A cycle is cut in so many parts. The first tells nothing: the axis was at rest before it.
PARTS = 8
#: Two parts further apart than this, in torque noises, did not both come from the axis: where nothing touched
#: they were below 1.7 on 150 axes (20 samples a part) of the study of hand guiding, effects or not; and what
#: the noise of few samples adds, over the root of their number.
_APART, _NOISE_APART = 2.0, 2.2


@final
class Tare:
    """One tare.

    Attributes:
        cycle: samples of a cycle.
        turn: rad of the cycle per sample.
        top: greatest speed, rad/s (m/s).
        apart: two parts further apart than this were disturbed, N m (N).
        part: samples of a part.
        touched: whether that was found.
    """

    def __init__(self, travel: float, speed: float, period: float, noise: float) -> None:
        """A travel in rad (m), at this speed at most, rad/s (m/s), `Tare.next` once per period, s; standard
        deviation of one sample's torque, N m (N)."""
        reach = 0.5 * travel
        self.part = max(math.ceil(2.0 * math.pi * reach / (speed * period * PARTS)), 1)
        self.cycle = PARTS * self.part
        self.turn = 2.0 * math.pi / self.cycle
        self.top = reach * self.turn / period
        self.apart = (_APART + _NOISE_APART / math.sqrt(self.part)) * noise
        self.begin(1.0)

    @property
    def samples(self) -> int:
        """Of the whole tare."""
        return CYCLES * self.cycle

    def begin(self, way: float) -> None:
        """Begin anew, first to this side."""
        self._way = way
        self._k = 0
        self._sum = self._square = 0.0
        self._means = [0.0] * PARTS
        self.touched = False

    def next(self, torque: float, left: float) -> bool:
        """Take a sample in.

        Args:
            torque: of the motor, N m (N).
            left: what of it neither the model nor what was learned explains.

        Returns:
            Whether that was the last.
        """
        self._sum += torque
        number, place = divmod(self._k, self.part)
        part = number % PARTS
        if place == self.part - 1:
            mean = self._sum / self.part
            if number >= PARTS and part > 0 and abs(mean - self._means[part]) > self.apart:
                self.touched = True
            self._means[part] = mean
            self._sum = 0.0
        if self._k >= self.samples - self.cycle:
            self._square += left * left
        self._k += 1
        return self._k >= self.samples

    @property
    def remains(self) -> float:
        """Mean square of what was left in the last cycle, N^2 m^2 (N^2)."""
        return self._square / self.cycle

    @property
    def speed(self) -> float:
        """At which to go on, rad/s (m/s)."""
        return self._way * self.top * math.sin(self.turn * self._k)
