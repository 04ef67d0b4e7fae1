"""The clock that paces a rig: the host's own, or one that runs faster for a rehearsal."""

from __future__ import annotations

import threading
import time
from typing import Protocol


class Clock(Protocol):
    """Seconds since some instant, and a way to wait."""

    def now(self) -> float:
        """Seconds since some fixed instant."""
        ...

    def wait_until(self, instant: float) -> None:
        """Return when it is that late, at once if it is already."""
        ...


class HostClock:
    """The monotonic clock of this computer.

    Args:
        scale: seconds of this clock per second of the host.
    """

    def __init__(self, scale: float = 1.0) -> None:
        self._scale = scale

    def now(self) -> float:
        return time.monotonic() * self._scale

    def wait_until(self, instant: float) -> None:
        left = (instant - self.now()) / self._scale
        if left > 0.0:
            time.sleep(left)


class SkippingClock:
    """A clock that jumps over every wait, so that a rehearsal in one process takes only its computing.

    All other time passes as on the host. Safe to share between threads.
    """

    def __init__(self) -> None:
        self._skipped = 0.0
        self._lock = threading.Lock()

    def now(self) -> float:
        return time.monotonic() + self._skipped

    def wait_until(self, instant: float) -> None:
        with self._lock:
            self._skipped += max(instant - self.now(), 0.0)
