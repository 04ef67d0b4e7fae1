"""One writer at a time on a log and on a result folder; a killed one leaves nothing locked."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from idtool.errors import InputError
from idtool.io.atomic import refuse_existing
from idtool.io.lock import held_folder
from idtool.log import Log, LogWriter
from idtool.parameters import Axis, Parameters
from idtool.report.result_folder import result_folder

COLUMNS = ["time_s", "velocity_rad_s", "torque_nm"]
ROWS = np.array([[0.0, 0.1, 0.2], [0.01, 0.1, 0.3]])
LATER = np.array([[0.02, 0.1, 0.2], [0.03, 0.1, 0.3]])
_BUSY = "is being written by another program"
_HOLDER = """
import sys, time
from pathlib import Path
from idtool.log import LogWriter
from idtool.parameters import Axis
from idtool.report.result_folder import result_folder
import numpy as np
path = Path(sys.argv[2])
if sys.argv[1] == "log":
    writer = LogWriter(path, ["time_s", "velocity_rad_s", "torque_nm"], Axis(), "sweep")
    writer.append(np.array([[0.0, 0.1, 0.2], [0.01, 0.1, 0.3]]))
    print("held", flush=True)
    time.sleep(60)
else:
    with result_folder(path, False):
        print("held", flush=True)
        time.sleep(60)
"""


def held_by_another(what: str, path: Path) -> subprocess.Popen[str]:
    """A process that writes there, once it does."""
    process = subprocess.Popen(
        [sys.executable, "-c", _HOLDER, what, str(path)], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "held\n"
    return process


@pytest.mark.parametrize("force", [False, True])
def test_a_second_writer_of_a_log_is_refused(tmp_path: Path, force: bool) -> None:
    path = tmp_path / "log.csv"
    with LogWriter(path, COLUMNS, Axis(), "sweep") as writer:
        writer.append(ROWS)
        with pytest.raises(InputError, match=_BUSY):
            LogWriter(path, COLUMNS, Axis(), "sweep", force=force)
        with pytest.raises(InputError, match=_BUSY):
            LogWriter(path, COLUMNS, Axis(), "sweep", keep_rows=1)
        with pytest.raises(InputError, match=_BUSY):
            refuse_existing(path, force)
        writer.append(LATER)
    log = Log.read(path)
    assert len(log.frame) == 4
    log.write(path, force=True)  # closed: free again


def test_a_killed_writer_leaves_no_lock(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    process = held_by_another("log", path)
    try:
        with pytest.raises(InputError, match=_BUSY):
            LogWriter(path, COLUMNS, Axis(), "sweep", force=True)
        assert len(Log.read(path).frame) == 2  # readers are not kept out, and nothing was emptied
    finally:
        process.kill()
        process.wait()
    with LogWriter(path, COLUMNS, Axis(), "sweep", keep_rows=2) as writer:
        writer.append(LATER)
    assert len(Log.read(path).frame) == 4


@pytest.mark.parametrize("force", [False, True])
def test_a_second_result_into_a_folder_is_refused(tmp_path: Path, force: bool) -> None:
    folder = tmp_path / "result"
    process = held_by_another("folder", folder)
    try:
        with pytest.raises(InputError, match=_BUSY), result_folder(folder, force):
            raise AssertionError
        assert folder.is_dir()
    finally:
        process.kill()
        process.wait()
    with result_folder(folder, force):
        (folder / "params.toml").write_text("")
    with pytest.raises(InputError, match=r"already holds params\.toml"), result_folder(folder, False):
        raise AssertionError


def test_nobody_writes_a_parameter_file_between_the_look_and_the_writing(tmp_path: Path) -> None:
    file = tmp_path / "params.toml"
    known = Parameters(provenance={"by": "me"})
    known.write(file)
    with held_folder(tmp_path), pytest.raises(InputError, match=_BUSY):
        replace(known, provenance={"by": "another"}).write_over(file, known)
    assert Parameters.read(file) == known
    replace(known, provenance={"by": "another"}).write_over(file, known)
    with pytest.raises(InputError, match="was written by somebody else meanwhile"):
        known.write_over(file, known)


def test_a_folder_of_which_nothing_came_is_not_left_behind(tmp_path: Path) -> None:
    folder = tmp_path / "result"
    with pytest.raises(KeyboardInterrupt), result_folder(folder, False):
        raise KeyboardInterrupt
    assert not folder.exists()
    folder.mkdir()
    with pytest.raises(KeyboardInterrupt), result_folder(folder, False):
        raise KeyboardInterrupt
    assert folder.is_dir()  # it was there before
