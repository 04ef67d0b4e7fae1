"""Every constant of the admittance law: its value, what it means, and where it is from.

The law reads them from a record made by `constants_of`; the exported C has them as macros of the same names.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Constant:
    """One constant.

    Attributes:
        value: the number.
        unit: of it; "noises" are standard deviations of one sample's torque, "counts" steps of the position
            sensor times the bristle's stiffness.
        meaning: what it does.
        source: why this value: a data sheet, a bound, or the study that set it.
    """

    value: float
    unit: str
    meaning: str
    source: str


#: A tare learns from one sample in so many, which counts for all of them: a small board has no time for more.
SAMPLES_PER_SUM = 2

_SCAN = "scan over the margins of `tuning` on identified axes: the greatest gain at both margins"
_STUDY = "docs/teach.md"

_C = Constant
CONSTANTS: dict[str, Constant] = {
    "virtual": _C(0.15, "s", "time constant of the virtual mass", _SCAN),
    "follows": _C(0.025, "s", "lag of the axis' speed behind what the law asked for", _SCAN),
    "velocity_gain": _C(0.15, "1", "share of the speed's innovation that the observer takes", _SCAN),
    "hand_filter": _C(0.02, "s", "filter of the torque by which a motion starts and stops", _STUDY),
    "least_time": _C(0.15, "s", "the least push of late is forgotten so slowly", "a tremble of 8 Hz"),
    "left": _C(0.65, "1", "a hand whose torque falls by this share within a sample has left", _STUDY),
    "seems": _C(0.55, "1", "one whose least torque of late falls by this within two seems to leave", _STUDY),
    "jump": _C(5.5, "noises", "and by so much at least", "more than the 0.5 N of a trembling hand"),
    "coverage": _C(2.0, "1", "standard deviations of the model that are left to the hand", "95 %"),
    "floor": _C(1.8, "noises", "and so much at least: the bias estimate and the noise", _STUDY),
    "start": _C(1.4, "noises", "so far beyond what a rest may be wrong by a motion starts", _STUDY),
    "stop_counts": _C(1.5, "counts", "what a stop may leave in the bristle unseen", _STUDY),
    "stop_noise": _C(1.0, "noises", "and so much at least", _STUDY),
    "zero_samples": _C(12.0, "1", "samples of a rest that the zero is the mean of", "noise / 3.5"),
    "zero_time": _C(30.0, "s", "the zero then follows so slowly", "a servo warms within minutes"),
    "steady": _C(1.0, "s", "what stays within a noise for so long is the model's", _STUDY),
    "usual_time": _C(2.0, "s", "what is felt at rest is usual after so long", _STUDY),
    "bias_time": _C(2.5, "s", "a steady torque in motion is taken for bias so slowly", _STUDY),
    "bias_most": _C(1.0, "noises", "and up to so much, less than `floor`", _STUDY),
    "still": _C(0.05, "s", "an axis that kept its place for so long stands", "6 Hz at one count"),
    "coast": _C(
        0.006, "s", "a braked axis rests where it is so much later, at first", "40 rad/s^2 from 19 mm/s"
    ),
    "brake": _C(0.04, "s", "and is held at one place after so long", _STUDY),
    "trim_rate": _C(3.0, "1/s", "how fast the servo's lag is trimmed", "a tenth of the bandwidth"),
    "trim_range": _C(4.0, "1", "and by what factor at most", "position gains of 5 to 80 1/s"),
    "tracking_time": _C(0.15, "s", "tracking-error limit, over the speed", "three lags of the servo"),
    "tare_noise": _C(3.0, "noises", "errors of a tare are alike: each sample counts as this", _STUDY),
    "tare_late": _C(0.5, "1", "and what comes late, as a share of the damping", "20 ms of 40 ms"),
    "tare_turns": _C(0.02, "s", "and what a turn of the friction may be late by", "readings of 20 ms"),
    "tare_left": _C(4.0, "noises", "a tare that leaves more than this is not used", _STUDY),
}

#: What an axis brings beside; see `constants_of`.
_AXIS = (
    "period", "torque_constant", "gain", "noise", "servo_time", "speed", "rest_speed", "resolution", "grain",
    "low", "high", "reports", "zero_most", "start_torque", "stop_torque", "refuse",
    "settle_periods", "still_periods", "brake_periods", "steady_periods",
    "tare_turn", "tare_top", "tare_cycle", "tare_part", "tare_apart", "tare_middle",
)  # fmt: skip

#: The record of the compiled law; `prior` is the standard deviation of load, level, damping and bristle.
#: Its numbers have names without the compiler too.
RECORD = np.dtype((np.record, [(name, "f8") for name in (*CONSTANTS, *_AXIS)] + [("prior", "f8", (4,))]))


def share(time: float, period: float) -> float:
    """Of a first-order filter, per period."""
    return 1.0 - math.exp(-period / time) if time > 0.0 else 1.0


def constants_of(axis: dict[str, Any]) -> Any:
    """The record, filled; times as shares of a filter per period, noises as torques.

    Args:
        axis: a number for each name of the axis, and `prior`.
    """
    record = np.zeros(1, RECORD)[0]
    for name, value in axis.items():
        record[name] = value
    period, noise = axis["period"], axis["noise"]
    for name, constant in CONSTANTS.items():
        record[name] = constant.value * (noise if constant.unit == "noises" else 1.0)
    for name in ("virtual", "follows", "hand_filter", "least_time", "usual_time"):
        record[name] = share(CONSTANTS[name].value, period)
    for name in ("zero_time", "bias_time"):
        record[name] = period / CONSTANTS[name].value
    record["tare_turns"] = CONSTANTS["tare_turns"].value / (SAMPLES_PER_SUM * period)
    return record
