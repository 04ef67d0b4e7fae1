"""What gravity per kilogram of payload says of the axis: a length, or a ratio, that a machine has."""

from __future__ import annotations

import math

from idtool.fit.joint import JointFit
from idtool.fit.shortcoming import Shortcoming
from idtool.model.units import STANDARD_GRAVITY

#: On what a payload hangs: m of a rotary axis (of a screw of 1 mm a turn 0.16 mm), a ratio of a linear one.
_LEVERS = {"rotary": (1e-4, 5.0), "linear": (1e-2, 20.0)}
#: A slope of fewer standard errors may be any.
_CLEAR = 5.0


def odd_lever(fit: JointFit) -> Shortcoming | None:
    """A payload on a lever that no machine has: a unit is wrong by a thousand."""
    recording, name = fit.model.recording, "gravity.per_payload"
    if name not in fit.model.names or recording.axis.effort != "torque":
        return None
    i = fit.model.names.index(name)
    lever = abs(float(fit.x[i])) / STANDARD_GRAVITY
    shortest, longest = _LEVERS[recording.axis.kind]
    spread = math.sqrt(float(fit.covariance[i, i])) / STANDARD_GRAVITY
    if shortest < lever < longest or lever < _CLEAR * spread:
        return None
    what = f"lever of {lever:.2g} m" if recording.axis.kind == "rotary" else f"ratio of {lever:.2g}"
    return Shortcoming(
        "odd_lever",
        ("gravity",),
        (),
        f"gravity per kilogram of payload means a {what}, which no axis has: torque or payload is not in the "
        "unit that its column names",
        "look for N mm, mA, N mm per A or grams, and correct the column or the torque constant",
    )
