"""Whether this computer left a test that runs in real time without a core for too long."""

from __future__ import annotations

import threading
import time

#: A beat this much late, s: half as long as a servo's bus may be silent, as one that loses packets needs the
#: other half.
LATE = 0.025
_BEAT = 0.005


class Pulse(threading.Thread):
    """Beats every few milliseconds and keeps by how much the latest beat came late.

    It shares nothing with what is tested: what it misses is the computer's doing (or that of other work in
    this process, which starves a loop beside it no less).
    """

    def __init__(self) -> None:
        super().__init__(name="pulse", daemon=True)
        self.late = 0.0

    def run(self) -> None:
        """Beat until the process ends."""
        last = time.monotonic()
        while True:
            time.sleep(_BEAT)
            now = time.monotonic()
            self.late = max(self.late, now - last - _BEAT)
            last = now

    def __bool__(self) -> bool:
        """Whether a beat since `late` was last set to zero came too late."""
        return self.late > LATE
