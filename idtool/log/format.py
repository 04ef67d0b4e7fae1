"""What a log is made of: the names of its columns and the TOML lines on top."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import tomli_w

from idtool.errors import InputError, misspelt
from idtool.io.toml import parse_toml, short
from idtool.model.units import Kind, torque_name
from idtool.parameters.axis import Axis

LOG_VERSION = 1

#: Keys of the TOML lines that have a meaning; every other key is kept in `Log.header`.
TOP_KEYS = ("ffc-id-log", "experiment", "axis")


def columns_of(kind: Kind) -> dict[str, str]:
    """Role -> column name of every column with a meaning, per kind of axis."""
    position, velocity = ("m", "m_s") if kind == "linear" else ("rad", "rad_s")
    torque = "n" if kind == "linear" else "nm"
    return {
        "trial": "trial",
        "time": "time_s",
        "position": f"position_{position}",
        "velocity": f"velocity_{velocity}",
        "current": "current_a",
        "torque": f"{torque_name(kind)}_{torque}",
        "bus_current": "bus_current_a",
        "duty": "duty",
        "velocity_command": f"velocity_command_{velocity}",
        "position_command": f"position_command_{position}",
        "payload": "payload_kg",
        "tilt_alpha": "tilt_alpha_rad",
        "tilt_beta": "tilt_beta_rad",
        "temperature": "temperature_degc",
        "supply_voltage": "supply_voltage_v",
        "drive_on": "drive_on",
    }


def header_text(axis: Axis, experiment: str, extra: Mapping[str, Any]) -> str:
    """The TOML lines on top of a log, each with `# ` in front."""
    document: dict[str, Any] = {"ffc-id-log": LOG_VERSION}
    if experiment:
        document["experiment"] = experiment
    document |= {key: value for key, value in extra.items() if key not in TOP_KEYS}
    document["axis"] = axis.to_table()
    # Not splitlines(): it also splits at characters that TOML strings may hold.
    lines = tomli_w.dumps(document).removesuffix("\n").split("\n")
    return "".join(f"# {line}\n" if line else "#\n" for line in lines)


def parse_header(lines: list[str]) -> dict[str, Any]:
    """The TOML document of the leading lines, which come without their `# `.

    Comment lines of another program are no error; they give an empty document.

    Raises:
        InputError: a log's header that is no TOML, or is of an unknown version.
    """
    ours = any(line.startswith("ffc-id-log") for line in lines)
    try:
        header = parse_toml("\n".join(lines))
    except (ValueError, RecursionError) as error:  # tomllib lets int() complain of huge numbers as ValueError
        if not ours:
            return {}
        raise InputError(
            f"the `# ` lines on top are not TOML ({error})", remedy="correct or remove them"
        ) from error
    if not ours:
        return header if isinstance(header.get("axis"), dict) else {}
    version = header.get("ffc-id-log")
    if type(version) is not int or version != LOG_VERSION:
        raise InputError(
            f"log version {short(version)} is not known",
            place="ffc-id-log",
            remedy=f"this program reads version {LOG_VERSION}",
        )
    return header


def header_axis(header: Mapping[str, Any], columns: list[str]) -> tuple[Axis, str]:
    """The axis (of the header, else as the columns tell) and the experiment.

    Raises:
        InputError: an experiment that is no text, or a bad `[axis]` table.
    """
    if wrong := misspelt(("axis",), header):
        raise InputError("unknown key", place=wrong[0], remedy=f'did you mean "{wrong[1]}"')
    experiment = header.get("experiment", "")
    if not isinstance(experiment, str):
        raise InputError(
            f"must be a word in quotes, not {short(experiment)}",
            place="experiment",
            remedy='write it as experiment = "sweep"',
        )
    if "axis" in header:
        return Axis.from_table(header["axis"]), experiment
    linear = columns_of("linear")
    is_linear = any(linear[role] in columns for role in ("position", "velocity", "torque"))
    return Axis("linear" if is_linear else "rotary"), experiment
