"""The clock that paces a rig: the host's own, or one that runs faster for a rehearsal."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Protocol


class Clock(Protocol):
    """Seconds since some instant, and a way to wait.

    Attributes:
        scale: its seconds per second of the computer.
    """

    scale: float

    def now(self) -> float:
        """Seconds since some fixed instant."""
        ...

    def wait_until(self, instant: float) -> None:
        """Return when it is that late, at once if it is already."""
        ...

    def sleep(self, seconds: float) -> None:
        """Sleep, seconds of the computer, while somebody else works: this wait is not to be skipped."""
        ...


class HostClock:
    """The monotonic clock of this computer.

    Args:
        scale: seconds of this clock per second of the host.
    """

    def __init__(self, scale: float = 1.0) -> None:
        self.scale = scale

    def now(self) -> float:
        return time.monotonic() * self.scale

    def wait_until(self, instant: float) -> None:
        left = (instant - self.now()) / self.scale
        if left > 0.0:
            time.sleep(left)

    def sleep(self, seconds: float) -> None:
        time.sleep(seconds)


class SkippingClock:
    """A clock that jumps over every wait, so that a rehearsal in one process takes only its computing.

    It counts the computing time of this process and not the time in which the computer was busy with
    others, so that a rehearsal comes out the same on a busy one. Safe to share between threads.

    Attributes:
        others: returns when whoever is waited for in `sleep` had its turn; if not set, a moment later.
            Without it a computer that leaves their thread without a core makes them seem silent.
    """

    scale = 1.0

    def __init__(self) -> None:
        self._skipped = 0.0
        self._lock = threading.Lock()
        self.others: Callable[[], None] | None = None

    def now(self) -> float:
        return time.process_time() + self._skipped

    def wait_until(self, instant: float) -> None:
        with self._lock:
            self._skipped += max(instant - self.now(), 0.0)

    def sleep(self, seconds: float) -> None:
        if self.others is None:
            time.sleep(seconds)
        else:
            self.others()
        with self._lock:
            self._skipped += seconds
