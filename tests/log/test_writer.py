"""Logs that are written: nothing that is there is lost, nor in a crash, nor on a full or slow disk."""

from __future__ import annotations

import gzip
import os
import random
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool.errors import InputError
from idtool.log import Log, LogWriter
from idtool.parameters.axis import Axis

TEXT = """# ffc-id-log = 1
# experiment = "sweep"
# [axis]
# kind = "rotary"
# torque_constant_nm_per_a = 2.67
trial,time_s,velocity_rad_s,current_a
0,0,0.1,1
0,0.01,0.1,1
1,0.02,0.2,1.5
"""


def log_in(folder: Path) -> Path:
    """A log that is there already."""
    path = folder / "log.csv"
    path.write_text(TEXT)
    return path


def test_writing_keeps_what_is_there(tmp_path: Path) -> None:
    path = log_in(tmp_path)
    log = Log.read(path)
    with pytest.raises(InputError, match="already exists; pass force=True"):
        log.write(path)
    with pytest.raises(InputError, match="is a folder where a file should be"):
        log.write(tmp_path, force=True)
    with pytest.raises(InputError, match="make the folder"):
        log.write(tmp_path / "no" / "log.csv")
    with pytest.raises(InputError, match="not an ordinary file"):
        log.write("/dev/null", force=True)
    broken = Log(log.frame.assign(time_s=0.0), log.axis)
    with pytest.raises(InputError, match="row 2: time stands still"):
        broken.write(path, force=True)
    assert path.read_text() == TEXT
    assert [file.name for file in tmp_path.iterdir()] == ["log.csv"]


def test_a_name_that_ends_in_gz_is_gzipped(tmp_path: Path) -> None:
    log = Log.read(log_in(tmp_path))
    log.write(tmp_path / "a.csv.gz")
    log.write(tmp_path / "b.csv.gz")
    assert (tmp_path / "a.csv.gz").read_bytes() == (tmp_path / "b.csv.gz").read_bytes()
    assert gzip.decompress((tmp_path / "a.csv.gz").read_bytes()).startswith(b"# ffc-id-log = 1\n")
    pd.testing.assert_frame_equal(Log.read(tmp_path / "a.csv.gz").frame, log.frame)


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    path = log_in(tmp_path)
    link = tmp_path / "link.csv"
    link.symlink_to(path)
    Log.read(link).write(link, force=True)
    assert link.is_symlink()
    assert Log.read(path).experiment == "sweep"


def test_writer_refuses_numbers_that_are_none(tmp_path: Path) -> None:
    columns = ["time_s", "velocity_rad_s", "torque_nm", "spare"]
    with LogWriter(tmp_path / "log.csv", columns, Axis(), "sweep") as writer:
        writer.append(np.array([[0.0, 1, 2, np.nan]]))
        with pytest.raises(InputError, match='column "velocity_rad_s" was given'):
            writer.append(np.array([[0.1, 1, 2, 0], [0.2, np.nan, 2, 0]]))
        writer.append(np.array([[0.3, 1, 2, 0]]))
    assert Log.read(tmp_path / "log.csv").frame["time_s"].tolist() == [0, 0.3]


def test_writer_leaves_whole_rows_when_the_disk_is_full(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "log.csv"
    writer = LogWriter(path, ["time_s", "velocity_rad_s", "torque_nm"], Axis(), "sweep")
    writer.append(np.array([[0.0, 1, 2]]))
    real = writer._stream

    class Full:
        def __init__(self) -> None:
            self.calls = 0

        def write(self, data: memoryview) -> int:
            self.calls += 1
            if self.calls > 1:
                raise OSError(28, "No space left on device")
            return real.write(data[:4]) or 0

        def __getattr__(self, name: str) -> object:
            return getattr(real, name)

    monkeypatch.setattr(writer, "_stream", Full())
    with pytest.raises(InputError, match="No space left on device"):
        writer.append(np.array([[0.1, 1, 2]]))
    writer.close()
    log = Log.read(path)
    assert not log.incomplete
    assert len(log.frame) == 1


def test_writer_keeps_an_existing_log(tmp_path: Path) -> None:
    path = log_in(tmp_path)
    with pytest.raises(InputError, match="already exists"):
        LogWriter(path, ["time_s"], Axis(), "sweep")
    assert path.read_text() == TEXT


APPENDER = """
import sys, numpy as np
from idtool.parameters.axis import Axis
from idtool.log import LogWriter
writer = LogWriter(sys.argv[1], ["trial", "time_s", "velocity_rad_s", "torque_nm"], Axis(), "sweep")
print("ready", flush=True)
k = 0
while True:
    times = np.arange(k, k + 7)
    writer.append(np.column_stack([times * 0, times / 100, np.sin(times), np.cos(times)]))
    k += 7
    print(k, flush=True)
"""


def test_a_killed_writer_loses_nothing_it_appended(tmp_path: Path) -> None:
    rng = random.Random(1)
    for attempt in range(5):
        path = tmp_path / f"{attempt}.csv"
        with subprocess.Popen(
            [sys.executable, "-c", APPENDER, str(path)], stdout=subprocess.PIPE, text=True
        ) as child:
            assert child.stdout is not None
            assert child.stdout.readline() == "ready\n"
            begun = child.stdout.readline()  # a busy computer may take long to come so far
            time.sleep(rng.uniform(0.01, 0.15))
            child.send_signal(signal.SIGKILL)
            told = (begun + child.stdout.read()).split("\n")[:-1]
        rows = Log.read(path).frame
        assert len(rows) >= int(told[-1])
        np.testing.assert_array_equal(rows["velocity_rad_s"], np.sin(np.arange(len(rows))))


def test_a_slow_disk_does_not_hold_the_axis_up_and_its_error_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, go_on = threading.Event(), threading.Event()
    real = os.fsync

    def slow(handle: int) -> None:
        if threading.current_thread() is not threading.main_thread():
            begun.set()
            go_on.wait(20)
            raise OSError(5, "Input/output error")
        real(handle)

    monkeypatch.setattr("os.fsync", slow)
    writer = LogWriter(tmp_path / "log.csv", ["time_s", "velocity_rad_s", "torque_nm"], Axis(), "sweep")
    for second in range(5):  # none of these waits for the disk
        writer.append(np.array([[float(second), 1, 2]]))
    assert begun.wait(20)
    go_on.set()
    with pytest.raises(InputError, match="Input/output error"):
        writer.close()
    assert len(Log.read(tmp_path / "log.csv").frame) == 5
