"""Timing that other users of the machine disturb little."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping


def interleaved(tasks: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Shortest processor time of each task, s: waiting for a core that others keep busy is not in it.

    The tasks take turns, so that a spell of load falls on all of them; the shortest time of many rounds is
    that of a round that nobody disturbed. A first round, not counted, compiles and warms up.
    """
    for task in tasks.values():
        task()
    best = dict.fromkeys(tasks, float("inf"))
    for _ in range(rounds):
        for name, task in tasks.items():
            began = time.process_time()
            task()
            best[name] = min(best[name], time.process_time() - began)
    return best


def once(task: Callable[[], object]) -> float:
    """Processor time of one run, s; for what is too long to repeat."""
    began = time.process_time()
    task()
    return time.process_time() - began
