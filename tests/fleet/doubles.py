"""Sessions that fail, and a worker that dies."""

from __future__ import annotations

import os
import signal
from pathlib import Path

from idtool.fleet.session import Task
from idtool.fleet.work import Outcome, SessionRow, identify_session


def broken(folder: Path) -> Path:
    """A folder whose log lacks a column."""
    folder.mkdir(parents=True)
    (folder / "sine.csv").write_text("time_s,position_rad\n0,1\n1,2\n")
    return folder


def dies_of(task: Task) -> Outcome:
    """As `identify_session`, but the session named "dies" takes its process with it."""
    if task.name == "dies":
        os.kill(os.getpid(), signal.SIGKILL)
    return identify_session(task)


def pid_of(task: Task) -> Outcome:
    """Fails with the number of its process; dies of a session that says so."""
    if task.name.endswith("dies"):
        os.kill(os.getpid(), signal.SIGKILL)
    return Outcome(SessionRow(task.name, f"{os.getpid()}"))
