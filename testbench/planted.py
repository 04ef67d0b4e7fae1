"""Known effects added to the torque of recordings of real machines.

What a machine leaves beside any model is in such a recording, and what is added is known: neither our plants
nor anybody else's flatter what is found then. The forms are plain formulas of the measured motion; where the
axis rests, friction that is added is zero.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from idtool.log import Log
from idtool.log.format import columns_of
from idtool.model.motion import Array
from testbench.regression import torque_of

#: The speed is that of a position smoothed over so long; below this share of the top one the axis turns.
_SMOOTHED_S, _TURNING = 0.03, 0.02
#: Waves of a ripple in half of the stroke.
_FEWEST_WAVES, _MOST_WAVES = 3.0, 7.0
_EFFORT = ("torque", "current")
#: How late a torque may be read: a topic of another computer, s.
LATE_S = 0.05
#: A slipping spring yields after this share of half the stroke.
_YIELD = 0.1
#: Friction warms up within this share of the session.
_WARM = 0.4


@dataclass(frozen=True)
class Moved:
    """How an axis moved, in units of its stroke and speed. Arrays of shape (rows,).

    Attributes:
        place: -1 to 1 over the stroke.
        speed: over the usual top speed.
        way: -1 or 1, and in between where it turns.
        viscous: viscous over Coulomb friction at the usual top speed.
        torque: that was measured, N m (N).
        gravity: the part of it that follows the sine and cosine of the angle, N m.
        elapsed: time since the first row, s; a clock that begins anew with a trial goes on.
    """

    place: Array
    speed: Array
    way: Array
    viscous: float
    torque: Array
    gravity: Array
    elapsed: Array


def moved(log: Log) -> Moved:
    """The motion of a log.

    Raises:
        ValueError: it has no position.
    """
    position = log.column("position")
    if position is None:
        raise ValueError("effects are planted in logs with a position")
    time, trial = log.frame["time_s"].to_numpy(float), log.frame["trial"].to_numpy()
    speed = np.zeros(len(position))
    for number in np.unique(trial):
        rows = np.flatnonzero(trial == number)
        step = float(np.median(np.diff(time[rows])))
        window = max(3, round(_SMOOTHED_S / step) | 1)
        smooth = uniform_filter1d(uniform_filter1d(position[rows], window), window)
        speed[rows] = np.gradient(smooth, step)
    speed /= np.quantile(np.abs(speed), 0.95)
    way = np.tanh(speed / _TURNING)
    middle, half = (position.max() + position.min()) / 2.0, (position.max() - position.min()) / 2.0
    columns = [way, speed, np.gradient(speed), np.ones(len(speed)), np.sin(position), np.cos(position)]
    torque, matrix = torque_of(log), np.column_stack(columns)
    known = np.isfinite(torque)
    coulomb, viscous, *others = np.linalg.lstsq(matrix[known], torque[known], rcond=1e-8)[0]
    return Moved(
        (position - middle) / half,
        speed,
        way,
        max(viscous / abs(coulomb), 0.0),
        torque,
        matrix[:, 4:] @ np.array(others[2:]),
        np.cumsum(np.concatenate([[0.0], np.clip(np.diff(time), 0.0, None)])),
    )


def _slips(m: Moved) -> Array:
    """A spring that slips once it is bent by `_YIELD` of half the stroke, over what it holds then."""
    bent, steps = np.zeros(len(m.place)), np.diff(m.place)
    for k, step in enumerate(steps):
        bent[k + 1] = min(max(bent[k] + step, -_YIELD), _YIELD)
    return bent / _YIELD


#: effect -> what it adds, of any size.
SHAPES: dict[str, Callable[[Moved, np.random.Generator], Array]] = {
    "torque_offset": lambda m, rng: np.ones(len(m.place)),
    "direction_asymmetry": lambda m, rng: np.abs(m.way) * (1.0 + m.viscous * np.abs(m.speed)),
    "position_stiffness": lambda m, rng: m.place,
    "position_ripple": lambda m, rng: np.sin(
        np.pi * rng.uniform(_FEWEST_WAVES, _MOST_WAVES) * m.place + rng.uniform(0.0, 2.0 * np.pi)
    ),
    "position_dependent_friction": lambda m, rng: m.place * m.way,
    "nonlinear_viscous": lambda m, rng: m.way * m.speed**2,
    "load_dependent_friction": lambda m, rng: m.way * np.abs(m.gravity),
    "torque_constant_saturation": lambda m, rng: m.torque * np.abs(m.torque),
    "hysteresis": lambda m, rng: _slips(m),
    "thermal_drift": lambda m, rng: m.way * np.exp(-m.elapsed / (_WARM * m.elapsed[-1])),
}


#: What can be planted.
EFFECTS = (*SHAPES, "transport_delay")


def planted(log: Log, effect: str, size: float, rng: np.random.Generator) -> Log:
    """A log with an effect added to its torque.

    Args:
        log: with a position.
        effect: of `EFFECTS`; a delay is of `LATE_S`, whatever the size.
        size: rms of what is added, N m (N).
        rng: draws what its shape leaves open.
    """
    if effect == "transport_delay":
        return late(log, LATE_S)
    shape = np.nan_to_num(SHAPES[effect](moved(log), rng))
    added = size / float(np.sqrt(np.mean(shape**2))) * shape
    frame, constant = log.frame.copy(), log.axis.torque_constant
    for role in _EFFORT:
        if (values := log.column(role)) is not None:
            scale = 1.0 if role == "torque" else constant
            assert scale is not None
            frame[columns_of(log.axis.kind)[role]] = values + added / scale
    return replace(log, rows=frame)


def late(log: Log, seconds: float) -> Log:
    """A log whose torque was read so much later than its time says."""
    frame = log.frame.copy()
    time, trial = frame["time_s"].to_numpy(float), frame["trial"].to_numpy()
    for role in _EFFORT:
        if (values := log.column(role)) is not None:
            column = columns_of(log.axis.kind)[role]
            for number in np.unique(trial):
                rows = np.flatnonzero((trial == number) & np.isfinite(values))
                frame.loc[frame.index[rows], column] = np.interp(
                    time[rows] - seconds, time[rows], values[rows]
                )
    return replace(log, rows=frame)
