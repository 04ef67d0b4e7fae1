"""What the tests share: the folder of recordings from real machines, and no clock for hypothesis."""

from __future__ import annotations

import os
import signal
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

from tests.pulse import Pulse

# how long an example takes says how busy the computer is
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

_PROJECT = Path(__file__).resolve().parent.parent
#: Rooms whose single tests last longest; they start first, so that two workers end together.
_LONGEST = ("docs", "diagnosis", "verbs")
#: Before them one file each for two workers, of rooms that have no compiled function in common: what one of
#: them compiles the other then finds in the cache.
_FIRST = ("tests/diagnosis/test_pruning.py", "tests/control/test_admittance.py")
#: Tests that talk to a virtual servo in real time. One that failed while its process was left without a core
#: is run again, after a pause; a computer that does that to every run of it is no judge: it is skipped.
_REAL_TIME = ("tests/rig", "tests/virtual_servo", "tests/cli/test_hardware.py", "tests/cli/test_jog.py")
_RERUNS, _PAUSE_S = 4, 10
_PULSE = Pulse()


def pytest_sessionstart() -> None:
    """Begin to listen how busy the computer is, and hear the signals that a shell has its background jobs
    ignore: what a test starts would ignore them too."""
    for number, usual in ((signal.SIGINT, signal.default_int_handler), (signal.SIGHUP, signal.SIG_DFL)):
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, usual)
    _PULSE.start()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The rooms with the longest tests first; what a busy computer starved is run again."""
    items.sort(key=lambda item: (not item.nodeid.startswith(_FIRST), item.path.parent.name not in _LONGEST))
    for item in items:
        if item.nodeid.startswith(_REAL_TIME):
            item.add_marker(pytest.mark.flaky(reruns=_RERUNS, reruns_delay=_PAUSE_S, condition=_PULSE))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup() -> None:
    """A test answers for its own time only."""
    _PULSE.late = 0.0


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, Any, None]:
    """What was starved in its last run too says nothing."""
    outcome = yield
    report = outcome.get_result()
    last = getattr(item, "execution_count", 0) > _RERUNS
    if report.failed and last and _PULSE:
        report.outcome = "skipped"
        why = f"a beat came {1e3 * _PULSE.late:.0f} ms late: this computer is too busy for a run in real time"
        report.longrepr = (str(item.path), item.location[1], why)


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of shared data: FFC_ID_SHARED, else `shared` next to the project; skips where absent."""
    folder = Path(os.environ.get("FFC_ID_SHARED") or _PROJECT.parent / "shared")
    if not (folder / "measured").is_dir():
        pytest.skip(f"no recordings of real machines: {folder}/measured is absent (set FFC_ID_SHARED)")
    return folder


@pytest.fixture(scope="session")
def measured(shared: Path) -> Path:
    """The folder of recordings from real machines."""
    return shared / "measured"
