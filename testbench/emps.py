"""The error of EMPS as its authors count it, and their models by that count.

Positions through a 4th-order low-pass of 100 Hz without phase, forces and model decimated from 1 kHz to
50 Hz, ||e|| / ||F||. Not every step of theirs is told (which rows of the ends are left out, what is done
at a reversal), so that their own model is counted here as well, beside the number that they printed.

A. Janot, M. Gautier, M. Brunot, Data Set and Reference Models of EMPS, 2019.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.signal import butter, decimate, filtfilt

from idtool.log import Log
from idtool.model.motion import Array
from testbench.regression import Flags, held_out, torque_of

_RATE_HZ, _CORNER_HZ, _DECIMATION = 1000.0, 100.0, 20
#: Rows at either end that the decimation filter spoils, at 50 Hz.
_EDGE = 25


def models(log: Log) -> dict[str, tuple[Array, str, str]]:
    """The authors' models: force of every row, and the printed errors on both recordings, per cent."""
    position = log.column("position")
    assert position is not None
    smooth = filtfilt(*butter(4, 2.0 * _CORNER_HZ / _RATE_HZ), position)
    velocity = np.gradient(smooth, 1.0 / _RATE_HZ)
    acceleration = np.gradient(velocity, 1.0 / _RATE_HZ)
    forwards, backwards = 166.7061 * velocity + 20.1440, 240.4236 * velocity - 20.6277
    return {
        "symmetric": (
            95.1089 * acceleration + 203.5034 * velocity + 20.3935 * np.sign(velocity) - 3.1648,
            "4.0834",
            "5.9824",
        ),
        "asymmetric": (
            95.1540 * acceleration + np.where(velocity > 0.0, forwards, backwards) * (velocity != 0.0),
            "3.1117",
            "",
        ),
    }


def counted(log: Log, predicted: Array, which: Flags | None = None) -> float:
    """The relative error of a prediction, per cent, on all rows or on some."""
    measured = torque_of(log)
    kept = slice(_EDGE, -_EDGE)
    of, left = (
        decimate(values, _DECIMATION, zero_phase=True)[kept] for values in (measured, measured - predicted)
    )
    chosen = slice(None) if which is None else which[::_DECIMATION][kept]
    return 100.0 * float(np.linalg.norm(left[chosen]) / np.linalg.norm(of[chosen]))


def table(log: Log, whole: Array, part: Array | None) -> dict[str, Any]:
    """What the page says of a recording.

    Args:
        log: of EMPS.
        whole: prediction of a model fitted to all rows.
        part: that of one fitted without the held-out rows, if there is one.
    """
    held = held_out(log)
    document: dict[str, Any] = {"in_sample": counted(log, whole)}
    if part is not None:
        document["held_out"] = counted(log, part, held)
    document["models"] = {
        name: {"all": counted(log, force), "held_out": counted(log, force, held), "printed": printed}
        for name, (force, *printed) in models(log).items()
    }
    return document
