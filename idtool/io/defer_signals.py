"""Work that must be finished before Ctrl-C is heard: a row of a log, an axis that is being stopped."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def deferred_signals() -> Iterator[None]:
    """Hold Ctrl-C, and other signals that end a run, back until the end of the block.

    A row must be written and counted, and the axis stopped, also when the key is hit twice. Elsewhere
    than in the main thread Python delivers no signal, and there is nothing to hold.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    held: list[int] = []

    def hold(number: int, _: Any) -> None:
        held.append(number)

    names = ("SIGINT", "SIGTERM", "SIGHUP")
    numbers = [getattr(signal, name) for name in names if hasattr(signal, name)]
    before = {number: had for number in numbers if callable(had := signal.getsignal(number))}
    for number in before:
        signal.signal(number, hold)
    try:
        yield
    finally:
        for number, had in before.items():
            signal.signal(number, had)
        if held:
            signal.raise_signal(held[0])
