"""How long something still takes, from how far it is and how long that took."""

from __future__ import annotations

import time
from collections.abc import Callable

#: Less is left than is worth telling, or it takes longer than it looked, s.
LEAST_TOLD_S = 0.5
#: First news of less than this tells how long the start took (what is loaded, processes), not the pace.
_START = 0.1


def spoken(seconds: float) -> str:
    """A time as a person counts it.

    >>> spoken(0.6), spoken(119.0), spoken(565.0), spoken(19_800.0)
    ('1 s', '119 s', '9 min', '5.5 h')
    """
    if seconds < 120.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 7200.0 else f"{seconds / 3600.0:.1f} h"


class Pace:
    """The time that is left, counted down while no news comes.

    Attributes:
        share: how much is done, from 0 to 1; never less than it was.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._began = self._told = clock()
        self._left: float | None = None
        self._from = self.share = 0.0
        self._first = True

    def at(self, share: float) -> None:
        """How much is done now, from 0 to 1."""
        if share <= self.share:
            return
        self.share, self._told = min(share, 1.0), self._clock()
        first, self._first = self._first, False
        if first and share < _START:
            self._began, self._from = self._told, share
            return
        self._left = (self._told - self._began) * (1.0 - self.share) / (self.share - self._from)

    @property
    def words(self) -> str:
        """The time that is left, for a person; nothing before the pace is known, and when that is overdue."""
        left = self.left_s
        return "" if left is None or left < LEAST_TOLD_S else f"{spoken(left)} left"

    @property
    def left_s(self) -> float | None:
        """Seconds; None before the pace is known."""
        return None if self._left is None else max(self._left - (self._clock() - self._told), 0.0)
