"""The teach button, around any law: while it is up the axis is braked, then held where it came to rest.

A hand that lets go of the button in motion finds the axis stopping as if it had let go of the axis: the
command asks for the opposite speed for a moment, then for the place where the axis comes to rest.
"""

from __future__ import annotations

from idtool.control.guard import Limits, Measurement

#: So long the brake asks for the opposite speed, by this share of the servo's lag.
KICK_S, KICK_SHARE = 0.015, 0.7
#: A braked axis comes to rest where it would be after so long at the speed that is read, s.
COAST_S = 0.008
#: An axis brakes so long at least before it is said to stand, s.
BRAKE_S = 0.03


class Hold:
    """Brakes and holds.

    Attributes:
        stopping: whether the axis still moves.
        anchor: where it is held, rad (m).
    """

    def __init__(self, limits: Limits, period: float, servo_time: float, rest_speed: float) -> None:
        """`servo_time`: of the position loop, s; slower than `rest_speed` is standing, rad/s (m/s)."""
        self._limits = limits
        self._period = period
        self._kick = KICK_SHARE * servo_time
        self._rest_speed = rest_speed
        self.hold(0.0)

    def hold(self, anchor: float) -> None:
        """It stands: hold it there."""
        self.anchor = self._limits.clip(anchor)
        self.stopping = False
        self._since = 0.0

    def begin(self) -> None:
        """It may move: brake."""
        self._since = self._since if self.stopping else 0.0
        self.stopping = True

    def command(self, sample: Measurement) -> float:
        """The command before its limits, rad (m)."""
        if not self.stopping:
            return self.anchor
        self._since += self._period
        if abs(sample.velocity) <= self._rest_speed and self._since >= BRAKE_S:
            self.hold(sample.position)
            return self.anchor
        if self._since < KICK_S:
            return sample.position - self._kick * sample.velocity
        return sample.position + COAST_S * sample.velocity
