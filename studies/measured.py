"""What `identify` finds on recordings of real machines, beside plain least squares and what was published.

python -m studies.measured [--folder FOLDER] [--only NAME]...        (make study-measured)
python -m studies.measured --text                                     only the page, from docs/measured.json

Every recording is identified twice, on all rows and without the held-out ones, and what came out is kept in
docs/measured.json; one that is there already, made by the same code, is not run again.

The recordings are not shipped; the folder is `$FFC_ID_SHARED/measured`, or `shared/measured` beside the
project.
"""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import click
import numpy as np
import pandas as pd

from idtool.errors import FfcIdError, InputError
from idtool.importing import import_recording
from idtool.io.atomic import atomic_write
from idtool.log import Log
from idtool.model.motion import Array
from idtool.parameters import Parameters
from idtool.verbs.identification import Identification
from idtool.verbs.identify import identify
from idtool.verbs.predict import predict
from pages import markdown
from pages.measured import PAGE, TARGET, parts
from testbench import emps
from testbench.recordings import RECORDINGS, Recording, read
from testbench.regression import OTHER, Rows, held_out, moving, regress, relative, torque_of

FOUND = Path("docs/measured.json")
BY_NAME = {recording.name: recording for recording in RECORDINGS}


def run(recording: Recording, folder: Path) -> dict[str, Any]:
    """Identify a recording; what the page needs of it."""
    log = _read(recording.name, folder)
    start = time.process_time()
    document: dict[str, Any] = {"rows": len(log.frame)}
    try:
        result = identify([log], friction=recording.friction)
        whole = _predicted(log, result.parameters)
    except FfcIdError as error:
        return document | _compared(recording, log, None, None) | {"refused": _plain(error, folder)}
    document["seconds"] = time.process_time() - start
    part, why = _without_held_out(recording, log, folder)
    document |= _said(recording, result) | {"held_out_refused": why}
    document |= _compared(recording, log, whole, part)
    document["sane"] = _sizes(log, whole, result.parameters)
    document["others"] = [
        _other(recording, result.parameters, BY_NAME[name], folder) for name in recording.others
    ]
    if recording.name.startswith("emps"):
        document["authors"] = emps.table(log, whole, part)
    return document


def _said(recording: Recording, result: Identification) -> dict[str, Any]:
    diagnosis = result.diagnosis
    named = {effect["name"] for effect in diagnosis["effects"]}
    return {
        "verdict": diagnosis["verdict"],
        "friction": diagnosis["friction"],
        "gravity": result.parameters.gravity_model,
        "effects": [
            {key: effect.get(key) for key in ("name", "percent_of_torque", "alternatives")}
            for effect in diagnosis["effects"]
        ],
        "of_the_readings": [
            c["name"] for c in diagnosis["candidates"] if c["accepted"] and c["name"] not in named
        ],
        "turned_down": {c["name"]: c["why"] for c in diagnosis["candidates"] if not c["accepted"]},
        "unexplained": (diagnosis["unexplained"] or {}).get("note"),
        "left": diagnosis.get("left"),
        "published": [[name, known, read(result, path)] for name, known, path in recording.published],
    }


def _without_held_out(recording: Recording, log: Log, folder: Path) -> tuple[Array | None, str | None]:
    """What a model that never saw the held-out rows says of every row, or why there is none."""
    held, trial = held_out(log), log.frame["trial"].to_numpy()
    # what the held-out rows part is parted: no trial of the training rows runs across a gap
    parted = np.concatenate([[False], (np.diff(held.astype(int)) != 0) | (trial[1:] != trial[:-1])])
    frame = log.frame.assign(trial=np.cumsum(parted))[~held]
    try:
        result = identify([replace(log, rows=frame)], friction=recording.friction)
        return _predicted(log, result.parameters), None
    except FfcIdError as error:
        return None, _plain(error, folder)


def _compared(recording: Recording, log: Log, whole: Array | None, part: Array | None) -> dict[str, Any]:
    """The errors on moving rows, beside those of the regression."""
    predictions = {name: p for name, p in (("whole", whole), ("part", part)) if p is not None}
    rows = moving(log, predictions)
    found = regress(rows, recording.gravity)
    return {
        "moving": len(rows.time),
        "coulomb": found.coulomb,
        "regression": {
            "in_sample": found.in_sample,
            "held_out": found.held_out,
            "found": [
                {"name": t.name, "said": t.said, "percent_of_coulomb": 100.0 * t.size / found.coulomb}
                for t in found.found
            ],
        },
        "in_sample": relative(rows, rows.others["whole"]) if whole is not None else None,
        "held_out": relative(rows, rows.others["part"], rows.held) if part is not None else None,
    }


def _sizes(log: Log, whole: Array, parameters: Parameters) -> dict[str, float]:
    """Predictions and levels over the largest torque that was measured."""
    most = float(np.max(np.abs(torque_of(log))))
    level = max(parameters.static[name].value for name in ("coulomb", "static"))
    return {"predicted": float(np.max(np.abs(whole))) / most, "level": level / most}


def _other(recording: Recording, parameters: Parameters, other: Recording, folder: Path) -> dict[str, Any]:
    """Another recording of the machine, predicted with the parameter file of this one."""
    log = _read(other.name, folder)
    document: dict[str, Any] = {"name": other.name}
    try:
        predicted = _predicted(log, parameters)
    except FfcIdError as error:
        return document | {"refused": _plain(error, folder)}
    rows = moving(log, {"predicted": predicted})
    document["error"] = relative(rows, rows.others["predicted"])
    both = _joined(moving(_read(recording.name, folder)), replace(rows, others={}))
    document["regression"] = regress(both, recording.gravity).held_out
    if recording.name.startswith("emps"):
        document["authors"] = emps.counted(log, predicted)
    return document


def _joined(first: Rows, second: Rows) -> Rows:
    """The rows of both; those of the second are the held-out ones."""
    fold = np.concatenate([first.fold, np.full(len(second.time), OTHER)])
    signals: dict[str, Any] = {
        name: np.concatenate([getattr(first, name), getattr(second, name)])
        for name in ("trial", "time", "position", "velocity", "acceleration", "jerk", "torque")
    }
    return replace(first, fold=fold, **signals)


def _predicted(log: Log, parameters: Parameters) -> Array:
    """The predicted torque of every row."""
    return np.asarray(predict([log], parameters).frame.iloc[:, -1], dtype=float)


@lru_cache(maxsize=4)
def _read(name: str, folder: Path) -> Log:
    recording = BY_NAME[name]
    logs = [import_recording(path, **recording.options).log for path in sorted(folder.glob(recording.file))]
    if not logs:
        raise InputError("no such recording", file=str(folder / recording.file), remedy="see the provenance")
    trials = (log.frame.assign(trial=number) for number, log in enumerate(logs))
    return logs[0] if len(logs) == 1 else replace(logs[0], rows=pd.concat(trials, ignore_index=True))


def _plain(error: FfcIdError, folder: Path) -> str:
    """What was said, without where the recordings are."""
    return str(error).replace(f"{folder}{os.sep}", "")


def code() -> str:
    """A digest of the tool and of this study: results of other code are run again."""
    digest = hashlib.sha256()
    study = ("studies/measured.py", "testbench/emps.py", "testbench/regression.py", "testbench/recordings.py")
    for path in [*sorted(Path("idtool").rglob("*.py")), *map(Path, study)]:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def default_folder() -> Path:
    """Where the recordings are."""
    shared = os.environ.get("FFC_ID_SHARED")
    return (Path(shared) if shared else Path(__file__).parents[2] / "shared") / "measured"


def recordings(folder: Path | None) -> Path:
    """The folder of the recordings, which must be there."""
    where = folder or default_folder()
    if not where.is_dir():
        raise click.ClickException(f"{where}: no recordings there; give --folder")
    return where


def fill(found: dict[str, Any], names: list[str], folder: Path, tell: Callable[[str], None]) -> None:
    """Run recordings and write what comes out as it comes."""
    now = code()
    for name in names:
        tell(name)
        found[name] = run(BY_NAME[name], folder) | {"code": now}
        with atomic_write(FOUND) as stream:
            json.dump(found, stream, indent=1, default=float)
            stream.write("\n")


@click.command()
@click.option("--folder", type=click.Path(path_type=Path), default=None)
@click.option("--only", multiple=True, type=click.Choice(list(BY_NAME)), help="Run these, done or not.")
@click.option("--text", is_flag=True, help="Run nothing.")
@markdown.out_option(PAGE)
def main(folder: Path | None, only: tuple[str, ...], text: bool, out: Path) -> None:
    """Identify every recording and write the page."""
    found: dict[str, Any] = json.loads(FOUND.read_text()) if FOUND.is_file() else {}
    if not text:
        where = recordings(folder)
        now = code()
        names = list(only) or [name for name in BY_NAME if found.get(name, {}).get("code") != now]
        fill(found, names, where, lambda words: click.echo(words, err=True))
    markdown.write_made(PAGE, parts(found), TARGET, out)
    click.echo(f"written: {out}")


if __name__ == "__main__":
    main()
