"""A full disk, a folder that may not be written, a log that vanishes: the axis stops, the data stay."""

from __future__ import annotations

import os
import resource
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from idtool.errors import InputError
from idtool.experiment.runner import Progress, run
from idtool.log import Log

from .double import RigDouble
from .test_runner import recipe


@contextmanager
def files_no_larger_than(size: int) -> Iterator[None]:
    """The system refuses to let a file grow further, as it does on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)


def test_a_full_disk_stops_the_axis_and_keeps_whole_rows(tmp_path: Path) -> None:
    rig, log = RigDouble(), tmp_path / "log.csv"
    with files_no_larger_than(20_000), pytest.raises(InputError) as caught:
        run(recipe(), rig, log)
    kept = Log.read(log)
    assert not kept.incomplete
    assert len(kept.frame) > 100
    assert log.stat().st_size <= 20_000
    assert f"{log}: can no longer be written (File too large); its {len(kept.frame)} rows" in str(
        caught.value
    )
    assert rig.calls[-1] == "stop"


def test_a_disk_that_is_full_from_the_start(tmp_path: Path) -> None:
    rig, log = RigDouble(), tmp_path / "log.csv"
    with files_no_larger_than(10), pytest.raises(InputError, match=r"cannot be written .File too large."):
        run(recipe(), rig, log)
    assert rig.calls == []
    assert not log.exists()


def test_a_folder_that_may_not_be_written() -> None:
    rig = RigDouble()
    with pytest.raises(InputError, match=r"/proc/log.csv: cannot be written .*; free space or pick another"):
        run(recipe(), rig, "/proc/log.csv")  # not even root may
    assert rig.calls == []


@pytest.mark.parametrize("what", ["removed", "moved", "replaced", "its folder removed"])
def test_a_log_that_vanishes_is_written_elsewhere(
    tmp_path: Path, what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, other = tmp_path / "logs", tmp_path / "temporary"
    folder.mkdir()
    other.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(other))
    log, rows = folder / "log.csv", 0

    def vanish(now: Progress) -> None:
        nonlocal rows
        if now.share < 0.3 or rows:
            return
        rows = len(Log.read(log).frame)
        if what == "removed":
            log.unlink()
        elif what == "moved":
            log.rename(folder / "moved.csv")
        elif what == "replaced":
            (folder / "new.csv").write_text("mine")
            os.replace(folder / "new.csv", log)
        else:
            log.unlink()
            folder.rmdir()

    rig = RigDouble()
    with pytest.raises(InputError, match=r"was removed or replaced while it was written; what it held is in"):
        run(recipe(), rig, log, progress=vanish)
    assert rig.calls[-1] == "stop"
    (saved,) = (other if what == "its folder removed" else folder).glob("log-*.csv")
    kept = Log.read(saved)
    assert not kept.incomplete
    assert rows <= len(kept.frame) <= rows + 300  # a second of samples, until it is noticed
    if what == "replaced":
        assert log.read_text() == "mine"
