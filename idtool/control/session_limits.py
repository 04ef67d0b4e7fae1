"""What ends a guiding that no hand wants: too fast, too much energy to whoever is there, nobody for too long.

Hand guiding in ISO 10218-1 asks for an enabling device near the hand and a monitored speed whose limit comes
from the risk assessment; 250 mm/s is what the same standard calls reduced speed, and is the default where a
session knows how far its axis moves per radian (`Limits.guided_speed`).

The energy is that of a passivity observer (Hannaford & Ryu 2002): what the hand gives less what it gets. What
was given long ago is no credit: the account is never above `Limits.energy`, and below minus that the axis
pushes the hand and not the hand the axis.
"""

from __future__ import annotations

from idtool.control.guard import Limits, Measurement, Reason, State


class SessionLimits:
    """Watches a guided axis.

    Attributes:
        expired: nobody guided it for too long: it is held until the button was up.
    """

    def __init__(self, limits: Limits, period: float, unit: str) -> None:
        """`unit`: of positions."""
        self._limits = limits
        self._period = period
        self._speed_unit = f"{unit}/s"
        self.reset()

    def reset(self) -> None:
        """Nobody has guided it yet."""
        self._account = self._idle = 0.0
        self.expired = False

    def enabled(self, button: bool) -> bool:
        """Whether the axis may follow: a button that is down, and somebody who uses it."""
        if not button:
            self.reset()
        return button and not self.expired

    def check(self, sample: Measurement, torque: float, state: State) -> tuple[Reason, str] | None:
        """The fault, or None.

        Args:
            sample: the measurement.
            torque: of the hand, N m (N).
            state: of the controller.
        """
        limits = self._limits
        if state is not State.GUIDING:
            self._account = 0.0
            self._idle = self._idle + self._period if state is State.RESTING else 0.0
            self.expired = self.expired or self._idle > limits.idle_s
            return None
        self._idle = 0.0
        if abs(sample.velocity) > limits.guided_speed:
            return Reason.SPEED_LIMIT, (
                f"guided at {abs(sample.velocity):.3g} {self._speed_unit}, faster than the session's"
                f" {limits.guided_speed:.3g} {self._speed_unit}"
            )
        self._account = min(self._account + torque * sample.velocity * self._period, limits.energy)
        if self._account < -limits.energy:
            return Reason.ENERGY, (
                f"the axis gave {-self._account:.2g} J to the hand, which gave none: it pushes or vibrates"
            )
        return None
