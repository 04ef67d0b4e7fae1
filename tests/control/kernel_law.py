"""The axis of the tests of the compiled admittance law.

Its 10 ms, 0.01 N m of noise and floor of 0.018 N m let every constant of the law show in a figure.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from idtool.control.admittance import kernel, record
from idtool.control.admittance.constants import constants_of
from idtool.control.admittance.states import RESTING

AXIS = {
    "period": 0.01,
    "torque_constant": 2.0,
    "gain": 8.0,
    "noise": 0.01,
    "servo_time": 0.05,
    "speed": 1.0,
    "rest_speed": 0.05,
    "resolution": 0.0015,
    "grain": 0.001515,
    "low": -1.0,
    "high": 1.0,
    "reports": 1.0,
    "zero_most": 0.1,
    "start_torque": 0.014,
    "stop_torque": 0.02,
    "refuse": 0.03,
    "settle_periods": 20.0,
    "still_periods": 5.0,
    "brake_periods": 4.0,
    "steady_periods": 100.0,
    "tare_turn": 2.0 * math.pi / 80,
    "tare_top": 0.4,
    "tare_cycle": 80.0,
    "tare_part": 10.0,
    "tare_apart": 0.02,
    "tare_middle": 0.0,
    "prior": (0.02, 0.2, 0.25, 0.03),
}


def law(state: int = RESTING, **numbers: float) -> tuple[Any, Any]:
    """Constants, and the state of an axis at 0.2 rad that has learned nothing."""
    c, s = constants_of(AXIS), np.zeros(1, record.STATE)[0]
    kernel.reset(c, s)
    kernel.begin(c, s, 0.2)
    s["state"] = state
    s["dead"] = c["floor"]
    for name, number in numbers.items():
        s[name] = number
    return c, s
