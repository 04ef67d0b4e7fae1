"""An axis whose acceleration is that of a pendulum, whatever drives it.

An arm that swings freely, or is led to and fro at one frequency, accelerates by the sine of its angle.
Inertia and gravity then cancel in the balance of torques, in any size of both, but for what the drive adds;
where that pushes along the motion, as what swings up a pendulum does, it is one with friction too. Least
squares likes none of them best: no inertia, no gravity, and a level of friction that is the drive's push.
"""

from __future__ import annotations

import numpy as np

from idtool.signals import Recording

#: Of the acceleration, beside friction's columns, this share follows sine and cosine of the angle ...
_FOLLOWS = 0.8
#: ... over a stroke of so many radians at least.
LEAST_STROKE = 0.5


def swings_by_itself(recording: Recording) -> bool:
    """Whether the acceleration of a rotary axis is that of a pendulum, to within its own error."""
    found: bool = recording.once("own swing", lambda: _swings_by_itself(recording))
    return found


def _swings_by_itself(recording: Recording) -> bool:
    motion, row = recording.motion, recording.row
    if recording.axis.kind != "rotary" or recording.unsure is None or np.ptp(motion.position) < LEAST_STROKE:
        return False
    friction = [np.ones(len(motion)), np.sign(motion.velocity), motion.velocity]
    columns = recording.operator @ np.column_stack(
        [motion.acceleration, *friction, np.sin(motion.position), np.cos(motion.position)]
    )
    target, known = columns[:, 0], columns[:, 1:]
    beside, left = (
        target - some @ np.linalg.lstsq(some, target, rcond=1e-10)[0] for some in (known[:, :3], known)
    )
    error = float(np.mean((recording.row_weight * recording.unsure[row]) ** 2))
    follows = float(left @ left) < (1.0 - _FOLLOWS) * float(beside @ beside)
    return follows and float(np.mean(left**2)) < error
