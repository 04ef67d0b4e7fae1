"""Identify every session of a folder, keep what was done, and sum it up.

    OUT/sessions/NAME/    params.toml, diagnosis.json, evidence.* and session.json, written last
    OUT/summary.csv       one row per session; summary.parquet likewise, where pyarrow is installed
    OUT/summary.json      the same, and the statistics
    OUT/fleet.html        one page

A session whose logs and options have not changed since it was done is not done again.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path

import pandas as pd

from idtool.effects import registry
from idtool.errors import InputError
from idtool.fleet.engine import Engine, open_engine
from idtool.fleet.page import page
from idtool.fleet.scheduler import Greeted
from idtool.fleet.session import find_sessions, load
from idtool.fleet.summary import Fleet, document, summarise, table
from idtool.fleet.work import Outcome, SessionRow
from idtool.io.atomic import atomic_write, write_table, write_whole
from idtool.parameters.axis import Axis
from idtool.presentation.text import counted
from idtool.report.result_folder import FILES, OPTIONAL_FILES, make_folder, write_json
from idtool.version import __version__

__all__ = ["Fleet", "Options", "run_fleet"]

SESSIONS = "sessions"
RECORD = "session.json"
PAGE = "fleet.html"
RECORD_SCHEMA = "ffc-id/fleet-session/1"
_KILLED = "its process was killed, perhaps for lack of memory; run the command again to retry it."


@dataclass(frozen=True)
class Options:
    """How each session is identified; see `idtool.identify`."""

    friction: str = "lugre"
    gravity: str = "auto"
    optimizer: str = "direct"
    seed: int = 0
    torque_constant: float | None = None
    without: tuple[str, ...] = ()
    tolerance: float | None = None
    axis: Axis | None = None


def run_fleet(
    folder: Path,
    out: Path,
    options: Options | None = None,
    *,
    workers: int | None = None,
    scheduler: str | Greeted | None = None,
    again: bool = False,
    tell: Callable[[str], None] = lambda _: None,
    progress: Callable[[int, int], None] = lambda _done, _of: None,
) -> Fleet:
    """Identify every session in `folder` and sum them up in `out`.

    Args:
        folder: holds one folder per session.
        out: made if missing; what it holds of unchanged sessions is used.
        options: of the identification.
        workers: processes on this machine; all processors if None.
        scheduler: address of a Dask scheduler, or one that answered, whose workers do it instead.
        again: do every session again.
        tell: called with a sentence as each session ends.
        progress: called with how many of the sessions that are to be done are done, and how many they are.

    Raises:
        InputError: an unknown effect, no sessions, `out` cannot be written, or no cluster answers. A session
            that fails raises nothing: it is in the summary with its sentence.
    """
    options = options or Options()
    registry.refuse_unknown(options.without)
    sessions = find_sessions(folder)
    if out.resolve() == folder.resolve():
        raise InputError("is the folder of sessions itself", file=out, remedy="name another with -o")
    make_folder(out / SESSIONS)
    rows: dict[str, SessionRow] = {}
    pending = list(_unfinished(sessions, out, options, again, rows))
    if rows:
        tell(f"{len(rows)} of {len(sessions)} sessions were done before")
    if pending:
        with open_engine(scheduler, workers) as engine:
            tell(f"{counted(len(pending), 'session')} on {engine.name}")
            for done, (fingerprint, outcome) in enumerate(_work(engine, pending, options), start=1):
                _keep(out, fingerprint, outcome)
                row = rows[outcome.row.session] = outcome.row
                said = f"failed: {row.error}" if row.error else row.verdict
                tell(f"[{len(rows)}/{len(sessions)}] {row.session}: {said}")
                progress(done, len(pending))
    fleet = summarise([rows[path.name] for path in sessions], out / SESSIONS)
    rows_of_all = table(fleet)
    write_table(out / "summary.csv", rows_of_all)
    _write_parquet(rows_of_all, out / "summary.parquet", tell)
    write_json(out / "summary.json", document(fleet))
    write_whole(out / PAGE, page(fleet, out.resolve().name))
    return fleet


def _write_parquet(rows: pd.DataFrame, file: Path, tell: Callable[[str], None]) -> None:
    """The same table for programs that read many; an old one goes where pyarrow is not installed."""
    if find_spec("pyarrow") is None:
        file.unlink(missing_ok=True)
        tell(f"{file.name} is left out: it needs pyarrow (pip install 'ffc-id[parquet]')")
        return
    with atomic_write(file, "wb") as stream:
        rows.to_parquet(stream, index=False)


def _unfinished(
    sessions: list[Path], out: Path, options: Options, again: bool, rows: dict[str, SessionRow]
) -> Iterator[Path]:
    """The sessions to be done; those that are done already go into `rows`."""
    for path in sessions:
        row = None if again else _kept(path, out, options)
        if row is None:
            yield path
        else:
            rows[path.name] = row


def _kept(path: Path, out: Path, options: Options) -> SessionRow | None:
    """The row of a session that was done before, if nothing has changed since."""
    try:
        record = json.loads((out / SESSIONS / path.name / RECORD).read_text("utf-8"))
        if record["schema"] != RECORD_SCHEMA or record["error"]:
            return None
        if record["fingerprint"] != load(path, asdict(options)).fingerprint(__version__):
            return None
        return SessionRow(**{key: record[key] for key in SessionRow.__dataclass_fields__})
    except (OSError, ValueError, KeyError, TypeError, InputError):
        return None  # missing or half of another version: to be done


def _work(engine: Engine, sessions: list[Path], options: Options) -> Iterator[tuple[str, Outcome]]:
    """Fingerprint and outcome of each session, as they end; at most `width` are loaded at a time."""
    waiting = iter(sessions)
    running: dict[Future[Outcome], tuple[str, str]] = {}
    while True:
        while len(running) < engine.width and (path := next(waiting, None)):
            try:
                task = load(path, asdict(options))
            except InputError as error:
                yield "", Outcome(SessionRow(path.name, str(error)))
                continue
            running[engine.submit(task)] = task.name, task.fingerprint(__version__)
        if not running:
            return
        for future in wait(running, return_when=FIRST_COMPLETED).done:
            name, fingerprint = running.pop(future)
            yield fingerprint, _outcome(future, name)


def _outcome(future: Future[Outcome], name: str) -> Outcome:
    try:
        return future.result()
    except CancelledError as error:
        raise InputError(
            "the cluster went away",
            place="--scheduler",
            remedy="start it and run the command again; finished sessions are kept",
        ) from error
    except Exception:  # of either engine: the process died, or Dask gave up after several workers did
        return Outcome(SessionRow(name, f"{name}: {_KILLED}"))


def _keep(out: Path, fingerprint: str, outcome: Outcome) -> None:
    """Write what became of a session; the record last, so that half a session is none."""
    folder = out / SESSIONS / outcome.row.session
    make_folder(folder)
    for file in (RECORD, *FILES, *OPTIONAL_FILES):  # of an earlier run
        (folder / file).unlink(missing_ok=True)
    for file, content in outcome.files.items():
        write_whole(folder / file, content)
    write_json(
        folder / RECORD,
        {
            "schema": RECORD_SCHEMA,
            "fingerprint": fingerprint,
            "finished": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
            **asdict(outcome.row),
        },
    )
