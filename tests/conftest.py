"""What the tests share: the folder of recordings from real machines, and no clock for hypothesis."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

# how long an example takes says how busy the computer is
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

_PROJECT = Path(__file__).resolve().parent.parent
#: Rooms whose single tests last longest; they start first, so that two workers end together.
_LONGEST = ("docs", "diagnosis", "verbs")
#: Tests that talk to a virtual servo in real time, and what a rig says when a busy computer kept one of both
#: from running for longer than a bus may be silent.
_REAL_TIME = ("tests/rig/dynamixel", "tests/rig/feetech", "tests/cli/test_hardware.py")
_STARVED = ("does not answer", "the computer was busy", "clock jumped")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The rooms with the longest tests first; what a busy computer starved is run again."""
    items.sort(key=lambda item: item.path.parent.name not in _LONGEST)
    for item in items:
        if item.nodeid.startswith(_REAL_TIME):
            item.add_marker(pytest.mark.flaky(reruns=4, reruns_delay=10, only_rerun=list(_STARVED)))


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
