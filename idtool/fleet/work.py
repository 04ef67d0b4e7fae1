"""Identify one session: what runs in a process of its own, on this machine or on another."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, field, replace
from pathlib import Path

from idtool.errors import FfcIdError
from idtool.fleet.session import Task, identity
from idtool.log import Log
from idtool.parameters.axis import Axis
from idtool.report.result_folder import write_results
from idtool.verbs.identify import identify
from idtool.version import __version__


@dataclass(frozen=True)
class SessionRow:
    """What became of a session.

    Attributes:
        session: its name.
        error: why it failed, one sentence; "" if it did not.
        unit, date: whose session it is and when it was recorded (ISO; "" if nobody knows).
        verdict: of the diagnosis.
        before, after, noise: error of the base and of the extended model on held-out trials, and the noise
            of the sensor; None where the diagnosis has none.
    """

    session: str
    error: str = ""
    unit: str = ""
    date: str = ""
    verdict: str = ""
    before: float | None = None
    after: float | None = None
    noise: float | None = None


@dataclass(frozen=True)
class Outcome:
    """That, and its result folder: name -> content of each file."""

    row: SessionRow
    files: dict[str, bytes] = field(default_factory=dict)


def identify_session(task: Task) -> Outcome:
    """Identify a session. Never raises: whatever goes wrong is that session's own failure."""
    try:
        return _identify(task)
    except FfcIdError as error:
        return Outcome(SessionRow(task.name, " ".join(str(error).split())))
    except Exception as error:
        told = " ".join(f"{type(error).__name__}: {error}".split())[:300]
        return Outcome(SessionRow(task.name, f"{task.name}: stopped by a fault of the program ({told})."))


def version() -> str:
    """The version that identifies."""
    return __version__


def _identify(task: Task) -> Outcome:
    options = dict(task.options)
    constant, axis = options.pop("torque_constant", None), options.pop("axis", None)
    with tempfile.TemporaryDirectory(prefix="ffc-id-") as place:
        # folders named as the user's are, so that messages name the user's files
        folder = Path(place) / task.name
        folder.mkdir()
        logs = []
        for name, content in task.logs.items():
            (folder / name).write_bytes(content)
            try:
                log = Log.read(folder / name, torque_constant=constant, axis=Axis(**axis) if axis else None)
            except FfcIdError as error:
                return Outcome(SessionRow(task.name, str(error).replace(f"{place}/", "")))
            logs.append(replace(log, source=f"{task.name}/{name}"))
        unit, date = identity(task, logs)
        result = identify(logs, **options)
        write_results(result, Path(place) / "result", command="ffc-id fleet", seed=options.get("seed", 0))
        files = {path.name: path.read_bytes() for path in (Path(place) / "result").iterdir()}
    errors = result.diagnosis["error"]
    row = SessionRow(
        session=task.name,
        unit=unit,
        date=date.isoformat() if date else "",
        verdict=result.diagnosis["verdict"],
        before=errors["held_out"]["before"],
        after=errors["held_out"]["after"],
        noise=errors["noise_floor"],
    )
    return Outcome(row, files)
