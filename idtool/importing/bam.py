"""Logs of BAM, Rhoban's "better actuator models" (https://github.com/Rhoban/bam): a pendulum on a servo.

One JSON object a run: what was run (`mass`, `length`, `kp`, `vin`, `motor`, `trajectory`, ...) and
`entries`, a list of samples in rad, rad/s and s. Which current they hold depends on the servo's recorder:
`measured_current` (A), `present_current` (mA), or on an eRob `control` (A) beside `torque_demand`. The
older recorders of DYNAMIXEL and Feetech servos keep the duty cycle (`load`) only, in counts: 885 is full on a
DYNAMIXEL of the X series (Goal PWM, 0.113 % a count), 1000 on a Feetech STS. The 16 bits of it are signed on
the one (two's complement) and hold a sign and a size on the other (bit 10).
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pandas as pd

from idtool.errors import InputError
from idtool.importing.names import Meaning
from idtool.importing.table import Table
from idtool.presentation.text import counted

_MEANINGS: tuple[Meaning, ...] = (
    Meaning("timestamp", "time", "s"),
    Meaning("position", "position", "rad"),
    Meaning("speed", "velocity", "rad/s"),
    Meaning("goal_position", "position", "rad", commanded=True),
    Meaning("temp", "temperature", "degC"),
    Meaning("input_volts", "supply_voltage", "V"),
    Meaning("torque_enable", "drive_on"),
)
#: How the motor's name begins, counts at full duty, and the bit of the sign (16: two's complement).
_FULL_DUTY: tuple[tuple[str, float, int], ...] = (
    ("sts", 1000.0, 10),
    *((series, 885.0, 16) for series in ("xl", "xc", "xm", "xh", "xd", "mx")),
)
#: What a log of BAM says of the load, and how `[axis]` calls it (a rod's own mass, `arm_mass`, is apart).
_PENDULUM = {"mass": "mass_kg", "length": "lever_m"}
#: The measured current first; a recorder has one of them, or sets it and reads it back.
_CURRENTS: tuple[tuple[str, str], ...] = (("measured_current", "A"), ("present_current", "mA"))


def read(raw: bytes) -> Table:
    """The entries of a BAM log, and what was run as facts.

    Raises:
        InputError: not JSON, not BAM's layout, or a log without current and duty.
    """
    try:
        content = json.loads(raw)
    except (ValueError, RecursionError) as error:
        raise InputError(
            "is JSON that cannot be read", remedy="copy it again from where it was recorded"
        ) from error
    entries = content.get("entries") if isinstance(content, dict) else None
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        raise InputError('is JSON without a list of "entries", so no log of BAM', remedy="export it as CSV")
    frame = pd.DataFrame(entries)
    if missing := [name for name in ("timestamp", "position") if len(frame) and name not in frame]:
        raise InputError(
            f'its entries have no "{missing[0]}", so it is no log of BAM', remedy="export it as CSV"
        )
    meanings = {item.source: item for item in _MEANINGS if item.source in frame}
    if current := _current(frame):
        meanings[current.source] = current
    elif "load" in frame:
        frame["load"] = duty_share(frame["load"], str(content.get("motor", "")))
        meanings["load"] = Meaning("load", "duty", "share")
    elif len(frame):
        raise InputError(
            "holds neither a current nor the duty cycle of the motor",
            remedy="record present_current or measured_current with a newer BAM, or log the current",
        )
    notes = []
    if "torque_enable" in frame and (off := int((~frame["torque_enable"].astype(bool)).sum())):
        notes.append(f"the drive was off in {counted(off, 'row')}, which no fit takes for friction")
    plain = str | bool | int | float  # TOML can hold it, and it says something
    facts = {key: value for key, value in content.items() if key != "entries" and isinstance(value, plain)}
    experiment = str(content.get("trajectory", ""))
    kp = content.get("kp")
    facts_of_loop = {"drive": {"gain_setting": kp}} if isinstance(kp, int | float) and kp > 0 else {}
    known = {key: content.get(name) for name, key in _PENDULUM.items()}
    axis = {key: value for key, value in known.items() if isinstance(value, int | float) and value > 0}
    header = {"axis": {"kind": "rotary", **axis}} if axis else {}
    return Table(
        frame,
        header=header,
        notes=notes,
        meanings=meanings,
        experiment=experiment,
        facts=facts_of_loop | {"bam": facts},
    )


def duty_share(counts: pd.Series[Any], motor: str) -> pd.Series[float]:
    """The share of full duty from the counts of a register of 16 bits.

    Args:
        counts: as the servo's register holds them.
        motor: its name, "sts3215".

    Raises:
        InputError: a servo whose full duty is not known here.
    """
    known = next(((full, sign) for name, full, sign in _FULL_DUTY if motor.lower().startswith(name)), None)
    if known is None:
        raise InputError(
            f'holds the duty in counts of "{motor}", whose full duty is not known here',
            remedy="export it as CSV and import it with --unit duty=count:N (N: counts at full duty)",
        )
    full, sign = known
    raw = counts.to_numpy(dtype=float)
    if sign == 16:
        signed = np.where(raw >= 2.0**15, raw - 2.0**16, raw)
    else:
        signed = np.where(raw >= 2.0**sign, -(raw - 2.0**sign), raw)
    return pd.Series(signed / full, index=counts.index)


def _current(frame: pd.DataFrame) -> Meaning | None:
    for name, unit in _CURRENTS:
        if name in frame:
            return Meaning(name, "current", unit)
    # an eRob's recorder writes the current that its drive reports under this name
    return Meaning("control", "current", "A") if {"control", "torque_demand"} <= set(frame) else None
