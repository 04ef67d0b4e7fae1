"""What no result may say, whatever the recording: levels beyond what was measured, bad intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from idtool.log import Log
from idtool.log.effort import effort_of
from idtool.parameters import Parameters

#: A model may say this much more than was ever measured before it is absurd.
_MARGIN = 1.5


def most_torque(logs: Sequence[Log]) -> float:
    """Largest torque (force) that was measured."""
    return max(float(np.nanmax(np.abs(effort_of(log).values))) for log in logs)


def absurdities(parameters: Parameters, logs: Sequence[Log], predicted: float) -> list[str]:
    """What is absurd about identified parameters, in a few words each; nothing is what should come back.

    Args:
        parameters: to judge.
        logs: that they came from.
        predicted: largest torque that they predict for another run of the same axis.
    """
    most = _MARGIN * most_torque(logs)
    found = []
    for name in ("coulomb", "static"):
        level = parameters.static[name]
        if level.identified and abs(level.value) > most:
            found.append(f"{name} above the torque measured")
    if not predicted <= 2.0 * most:
        found.append("prediction beyond the torque measured")
    inertia = parameters.effect("inertia")
    if inertia is not None and inertia.values()["inertia"] < 0.0:
        found.append("negative inertia")
    for name, parameter in parameters.static.items():
        if not math.isfinite(parameter.value):
            found.append(f"{name} not finite")
        interval = parameter.ci95
        if interval is not None and not interval[0] <= parameter.value <= interval[1]:
            found.append(f"{name} outside its interval")
    return found
