"""The folder that `identify` and `diagnose` leave behind: everything that a report is drawn from."""

from __future__ import annotations

import gzip
import hashlib
import io
import json
import platform
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import tomli_w

from idtool.compare.position_errors import position_errors
from idtool.diagnosis.whiteness import cumulative_periodograms
from idtool.errors import InputError
from idtool.fit.joint import JointFit
from idtool.fit.search import cost_over_stiffness
from idtool.fit.staged import gravity_points
from idtool.fit.windows import steady_windows
from idtool.io.atomic import write_whole
from idtool.io.lock import held_folder
from idtool.io.plain import plain
from idtool.model.stribeck import steady
from idtool.verbs.identification import Identification
from idtool.version import __version__

#: The recipe of the next experiment, where there is one.
NEXT_RECIPE = "next_experiment.toml"
#: A smooth correction for what is measured and not explained, where there is one.
CORRECTION = "correction.toml"
FILES = ("params.toml", "diagnosis.json", "evidence.json", "evidence.csv.gz", "report.html")
#: What a result folder may hold besides.
OPTIONAL_FILES = (NEXT_RECIPE, CORRECTION)


@contextmanager
def result_folder(folder: Path, force: bool) -> Iterator[None]:
    """A folder made and kept for one result; gone again if nothing came of it.

    Raises:
        InputError: it is a file, holds a result already and `force` is not given, cannot be made, or
            another program writes a result into it.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError("is a file where a folder should be", file=folder, remedy="name a folder")
    made = not folder.exists()
    if not made:
        _refuse_result(folder, force)
    make_folder(folder)
    try:
        with held_folder(folder):
            _refuse_result(folder, force)  # what another program has finished meanwhile
            yield
    finally:
        if made:
            with suppress(OSError):
                folder.rmdir()


def _refuse_result(folder: Path, force: bool) -> None:
    there = [name for name in FILES if (folder / name).exists()]
    if there and not force:
        raise InputError(f"already holds {there[0]}", file=folder, remedy="pass force=True to overwrite it")


def make_folder(folder: Path) -> None:
    """Make the folder, with its parents.

    Raises:
        InputError: it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"cannot be made ({error.strerror})", file=folder, remedy="pick another place"
        ) from error


def write_results(result: Identification, folder: Path, *, command: str = "", seed: int = 0) -> None:
    """Write params.toml, diagnosis.json, evidence.json and evidence.csv.gz."""
    make_folder(folder)
    result.parameters.write(folder / "params.toml", force=True)
    write_json(folder / "diagnosis.json", result.diagnosis)
    correction = result.evidence.correction
    if correction is None:
        (folder / CORRECTION).unlink(missing_ok=True)
    else:
        correction.write(folder / CORRECTION)
    _write_recipe(folder / NEXT_RECIPE, result.diagnosis["next_experiment"])
    write_json(folder / "evidence.json", evidence_document(result, command, seed))
    write_rows(folder / "evidence.csv.gz", evidence_rows(result))


def _write_recipe(path: Path, proposed: dict[str, Any] | None) -> None:
    """The recipe of the next experiment, with why as its first line; that of an earlier result goes."""
    if proposed is None:
        path.unlink(missing_ok=True)
        return
    write_whole(path, f"# {proposed['why']}\n{tomli_w.dumps(proposed['recipe'])}")


def write_json(path: Path, document: Any) -> None:
    """JSON, whole or not at all; what is not a finite number is null."""
    write_whole(path, json.dumps(plain(document), indent=1, allow_nan=False) + "\n")


def evidence_rows(result: Identification) -> pd.DataFrame:
    """One row per filtered sample: the motion, the torque, both predictions."""
    split = result.evidence.split
    before, after = result.evidence.before, result.evidence.after
    recording = split.recording
    motion, rows = recording.motion, recording.row
    trial = recording.filtered_trial
    measured = after.model.measured
    frame = pd.DataFrame(
        {
            "trial": trial,
            "experiment": np.array(recording.experiment)[trial],
            "time_s": motion.time[rows],
            "position": motion.position[rows],
            "velocity": motion.velocity[rows],
            "acceleration": motion.acceleration[rows],
            "torque": measured,
            "before": measured - before.residual,
            "after": measured - after.residual,
            "held_out": split.held[recording.row].astype(int),
        }
    )
    optional = {"load": motion.load, "payload_kg": motion.payload, "temperature_degc": motion.temperature}
    for name, values in optional.items():
        if values is not None:
            frame[name] = values[rows]
    return frame


def write_rows(path: Path, frame: pd.DataFrame) -> None:
    """A gzipped CSV, whole or not at all, the same bytes for the same rows."""
    text = frame.to_csv(index=False, float_format="%.8g", lineterminator="\n").encode()
    packed = io.BytesIO()
    with gzip.GzipFile(fileobj=packed, mode="wb", mtime=0) as stream:
        stream.write(text)
    write_whole(path, packed.getvalue())


def evidence_document(result: Identification, command: str, seed: int) -> dict[str, Any]:
    """The document of evidence.json."""
    fit = result.fit
    recording = result.recording
    evidence = result.evidence
    return {
        "kind": recording.axis.kind,
        "friction": fit.model.spec.friction,
        "filter": {"bandwidth_hz": recording.filter.bandwidth_hz, "rate_hz": recording.filter.rate_hz},
        "logs": [_log_facts(result, index) for index in range(len(recording.sources))],
        "notes": result.diagnosis["notes"],
        "stribeck_points": stribeck_points(fit),
        "stribeck_curve": stribeck_curve(fit),
        "gravity_points": [
            {"torque": one.torque, "stderr": one.stderr}
            | ({"position": one.position} if one.payload is None else {"payload_kg": one.payload})
            for one in gravity_points(fit)
        ],
        "position": position_errors(result.logs, result.parameters),
        "cost_over_sigma0": _stiffness_cost(fit),
        "correlation": {"names": fit.model.names, "matrix": fit.correlation},
        "residual_tests": {
            name: [{"variable": t.variable, "p_value": t.p_value, "share": t.share} for t in tests]
            for name, tests in (("before", evidence.tests_before), ("after", evidence.tests_after))
        },
        "cumulative_periodograms": {
            name: [curve.to_document() for curve in cumulative_periodograms(one)]
            for name, one in (("before", evidence.base), ("after", fit))
        },
        "command": command,
        "versions": versions(),
        "seed": seed,
    }


def stribeck_points(fit: JointFit) -> list[dict[str, Any]]:
    """One point per steady window."""
    return [
        {"velocity": w.velocity, "torque": w.friction, "stderr": w.stderr, "steady": w.steady}
        for w in steady_windows(fit)
    ]


def stribeck_curve(fit: JointFit) -> dict[str, Any]:
    """The static curve in both directions with its 95 % band, by linearisation."""
    model = fit.model
    top = model.scales.speed
    speed = np.concatenate([-np.geomspace(top, 0.01 * top, 60), np.geomspace(0.01 * top, top, 60)])

    def torque(x: Any) -> Any:
        f = model.friction(x)
        return steady(speed, f.coulomb, f.static, f.stribeck_velocity, f.viscous)

    centre = torque(fit.x)
    gradient = np.zeros((len(speed), len(fit.x)))
    quantile = 0.0
    for i, name in enumerate(model.names):
        if name in ("coulomb", "static", "stribeck_velocity", "viscous"):
            quantile = max(quantile, float(fit.quantile[i]))
            moved = fit.x.copy()
            increment = 1e-5 * max(1.0, abs(moved[i]))
            moved[i] += increment
            gradient[:, i] = (torque(moved) - centre) / increment
    spread = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", gradient, fit.covariance, gradient), 0.0))
    half = quantile * spread
    return {"velocity": speed, "torque": centre, "low": centre - half, "high": centre + half}


def versions() -> dict[str, str]:
    """Versions of what computed the result."""
    names = ("numpy", "scipy", "nlopt", "numba", "pandas", "matplotlib")
    return {"ffc-id": __version__, "python": platform.python_version()} | {
        n: metadata.version(n) for n in names
    }


def _stiffness_cost(fit: JointFit) -> dict[str, Any] | None:
    if fit.model.spec.friction != "lugre":
        return None
    values = {name: fit.values[name] for name in ("coulomb", "static", "stribeck_velocity")}
    stiffness, rmse = cost_over_stiffness(fit.model, values)
    return {"sigma0": stiffness, "rmse": rmse, "best": fit.values["bristle_stiffness"]}


def _log_facts(result: Identification, index: int) -> dict[str, Any]:
    recording = result.recording
    trials = [t for t, source in enumerate(recording.source) if source == index]
    path = Path(recording.sources[index])
    return {
        "file": path.name,
        "sha256": hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else "",
        "rows": int(np.isin(recording.motion.trial, trials).sum()),
        "trials": len(trials),
        "experiment": recording.experiment[trials[0]] if trials else "",
        "wiring": recording.wiring[index],
    }
