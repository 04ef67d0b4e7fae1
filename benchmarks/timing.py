"""Timing that other users of the machine disturb little."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import TypeVar

T = TypeVar("T")


def interleaved(tasks: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Shortest processor time of each task, s: waiting for a core that others keep busy is not in it.

    A first round, not counted, compiles and warms up.
    """
    for task in tasks.values():
        task()
    return shortest({name: lambda task=task: once(task)[1] for name, task in tasks.items()}, rounds)  # type: ignore[misc]


def shortest(times: Mapping[str, Callable[[], float]], rounds: int) -> dict[str, float]:
    """The shortest of the times that each of these tells.

    They take turns, so that a spell of load falls on all of them; the shortest of many rounds is that of a
    round that nobody disturbed.
    """
    best = dict.fromkeys(times, float("inf"))
    for _ in range(rounds):
        for name, measured in times.items():
            best[name] = min(best[name], measured())
    return best


def once(task: Callable[[], T]) -> tuple[T, float]:
    """What a task returns, and its processor time, s."""
    began = time.process_time()
    result = task()
    return result, time.process_time() - began
