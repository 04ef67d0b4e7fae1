"""Tests of what judges whether a test in real time had the computer that it needs."""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import Any

import pytest

from tests import conftest
from tests.pulse import LATE, Pulse


def outcome_of(monkeypatch: pytest.MonkeyPatch, late: float, run: int) -> Any:
    """The report of a failed test, after that many runs on a computer with beats that late."""
    pulse = Pulse()
    pulse.late = late
    monkeypatch.setattr(conftest, "_PULSE", pulse)
    report = SimpleNamespace(failed=True, outcome="failed", longrepr="what failed")
    item = SimpleNamespace(execution_count=run, path="tests/rig/test_x.py", location=("", 7, ""))
    hook = conftest.pytest_runtest_makereport(item)  # type: ignore[arg-type]
    next(hook)
    with pytest.raises(StopIteration):
        hook.send(SimpleNamespace(get_result=lambda: report))
    return report


@pytest.mark.parametrize(
    ("late", "run", "outcome"), [(0.3, 5, "skipped"), (0.3, 4, "failed"), (0.02, 5, "failed")]
)
def test_only_what_was_starved_to_the_end_is_skipped(
    monkeypatch: pytest.MonkeyPatch, late: float, run: int, outcome: str
) -> None:
    report = outcome_of(monkeypatch, late, run)
    assert report.outcome == outcome
    assert ("too busy" in report.longrepr[2]) == (outcome == "skipped")


def test_a_beat_that_does_not_come_is_seen() -> None:
    pulse = Pulse()
    pulse.start()
    time.sleep(0.05)
    pulse.late = 0.0
    until = time.monotonic() + 4.0 * LATE
    # one call that keeps the interpreter's lock starves every thread of the process
    while not pulse and time.monotonic() < until + 5.0:
        sum(range(20_000_000))
    assert pulse.late > LATE
