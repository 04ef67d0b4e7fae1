"""Datasets of LeRobot (https://github.com/huggingface/lerobot): Parquet of lists, one entry a joint.

`observation.state` holds what was measured, `action` the goals, further observations whatever else was
recorded (`observation.load`, `observation.velocity`, ...); the names of the joints stand in `meta/info.json`
beside the data. A name may end in its quantity (`elbow_flex.pos`). Positions are degrees only where the robot
was set to `use_degrees`; else they are shares of each joint's range, which nothing in the dataset leads back
to an angle.

A load is the duty of a Feetech servo in its raw counts: sign above the magnitude, 1000 at full. Whose current
a `current` is no dataset says, so that it is kept and taken for nothing.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from idtool.errors import InputError, in_file
from idtool.importing.bam import duty_share
from idtool.importing.names import Meaning
from idtool.importing.table import Table

_INFO = Path("meta", "info.json")
#: Folders between a data file and the dataset: data/chunk-000/file-000.parquet.
_DEPTH = 3
_STATE, _GOAL = "observation.state", "action"
#: What a feature or the end of a name calls a quantity -> column of the table.
_QUANTITIES = {
    "state": "position",
    "pos": "position",
    "position": "position",
    "vel": "velocity",
    "velocity": "velocity",
    "load": "load",
    "pwm": "load",
    "current": "reported_current",
    "voltage": "voltage",
    "temperature": "temperature",
    "effort": "effort",
    "torque": "effort",
}
_MEANINGS = (
    Meaning("timestamp", "time", "s"),
    Meaning("episode", "trial"),
    Meaning("position", "position"),
    Meaning("goal_position", "position", commanded=True),
    Meaning("velocity", "velocity"),
    Meaning("load", "duty", "share"),
    Meaning("effort", "torque"),
    Meaning("voltage", "supply_voltage", "V"),
    Meaning("temperature", "temperature", "degC"),
)
_DEGREES = {"position": "deg", "goal_position": "deg", "velocity": "deg/s"}


def is_dataset(path: Path) -> bool:
    """Whether a folder is a dataset."""
    return (path / _INFO).is_file()


def is_frame(frame: pd.DataFrame) -> bool:
    """Whether a table is of a dataset, by its columns."""
    return {"timestamp", "episode_index", _STATE} <= set(frame.columns)


def read_folder(path: Path, parquet: Callable[[bytes], pd.DataFrame]) -> Table:
    """All the rows of a dataset.

    Args:
        path: its folder.
        parquet: reads the bytes of a file.

    Raises:
        InputError: no data, or none that tells of the motor.
    """
    files = sorted((path / "data").glob("**/*.parquet"))
    if not files:
        raise InputError("is a dataset without data/*.parquet", remedy="download its data too")
    try:
        frames = [_within(file, parquet) for file in files]
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", remedy="copy it again") from error
    return interpret(pd.concat(frames, ignore_index=True), path, _info(path, 0))


def _within(file: Path, parquet: Callable[[bytes], pd.DataFrame]) -> pd.DataFrame:
    with in_file(file):
        return parquet(file.read_bytes())


def interpret(frame: pd.DataFrame, file: Path, info: Mapping[str, Any] | None = None) -> Table:
    """A table with one row a joint and sample.

    Args:
        frame: as in the file.
        file: where the names of the joints are looked for.
        info: `meta/info.json`; None looks for it.

    Raises:
        InputError: nothing in it tells of the torque of a motor, or it is no dataset after all.
    """
    info = _info(file, _DEPTH) if info is None else info
    notes: list[str] = []
    joints: dict[str, dict[str, Any]] = {}
    for feature in frame.columns:
        quantity = "goal_position" if feature == _GOAL else _quantity(feature)
        if quantity is None or not isinstance(frame[feature].iloc[0], list | np.ndarray):
            continue
        values = _matrix(frame[feature], feature)
        for column, name in zip(values.T, _names(info, feature, values.shape[1]), strict=True):
            joint, _, end = name.rpartition(".")
            said = _QUANTITIES.get(end) if joint else None
            of = said if said is not None and feature == _STATE else quantity
            joints.setdefault(joint if said else name, {})[of] = column
    joints = {name: columns for name, columns in joints.items() if "position" in columns}
    if not any({"load", "effort", "reported_current"} & columns.keys() for columns in joints.values()):
        raise InputError(
            "holds positions and goals only, and nothing that tells of a motor's torque",
            remedy="record the load with the supply's voltage, or a current, as further observations",
        )
    long = [_of_joint(frame, name, columns) for name, columns in joints.items()]
    table = pd.concat(long, ignore_index=True)
    notes.append(
        "positions are taken for degrees, which they are only where the robot was set to use_degrees; else "
        "they are shares of each joint's range"
    )
    if "reported_current" in table:
        notes.append(
            'whose current "reported_current" is no dataset says; if you know, pass '
            "--map current_a=reported_current (the motor's) or bus_current_a=reported_current (the supply's)"
        )
    meanings = {item.source: item for item in _MEANINGS if item.source in table}
    presumed = {name: unit for name, unit in _DEGREES.items() if name in table}
    robot = str(info.get("robot_type") or "")
    facts = {"lerobot": {"robot_type": robot}} if robot else {}
    return Table(
        table, notes=notes, meanings=meanings, presumed=presumed, single=("joint",), facts=dict(facts)
    )


def _of_joint(frame: pd.DataFrame, name: str, columns: dict[str, Any]) -> pd.DataFrame:
    start = {"timestamp": frame["timestamp"].to_numpy(dtype=float), "joint": name}
    rows = pd.DataFrame(start | {"episode": frame["episode_index"].to_numpy()} | columns)
    if "load" in rows and float(rows["load"].abs().max()) > 1.0:  # counts; a share stays one
        rows["load"] = duty_share(rows["load"], "sts")
    return rows


def _quantity(feature: str) -> str | None:
    head, _, end = feature.partition(".")
    return _QUANTITIES.get(end) if head == "observation" else None


def _matrix(column: pd.Series[Any], feature: str) -> np.ndarray:
    try:
        values = np.array(column.to_list(), dtype=float)
    except (TypeError, ValueError):
        values = np.zeros(0)
    if values.ndim != 2:
        raise InputError(
            f'column "{feature}" is no list of numbers of one length', remedy="copy the dataset again"
        )
    return values


def _names(info: Mapping[str, Any], feature: str, count: int) -> list[str]:
    """Of the joints; numbers where nobody names them."""
    try:
        names = info["features"][feature]["names"]
    except (KeyError, TypeError):
        names = None
    if isinstance(names, dict):  # {"motors": [...]}, of older datasets
        names = next(iter(names.values()), None)
    if isinstance(names, list) and len(names) == count:
        return [str(name) for name in names]
    return [f"joint{index}" for index in range(count)]


def _info(file: Path, depth: int) -> dict[str, Any]:
    """`meta/info.json` of the dataset that a file is in; empty where there is none that can be read."""
    for folder in (file, *file.resolve().parents[: depth + 1])[: depth + 1]:
        try:
            content = json.loads((folder / _INFO).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            continue
        return content if isinstance(content, dict) else {}
    return {}
