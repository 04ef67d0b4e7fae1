"""What a hand-guiding run recorded, and the figures taken from it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from idtool.guiding.hand import Hand
from idtool.model.motion import Array

#: A stop is over once the axis stays this close to where it comes to rest, in encoder counts.
STOP_COUNTS = 1.0
#: The share of a push that is left out of force and speed: its start.
_START_SHARE = 0.5
#: The last share of a rest, over which its place, drift and ripple are taken.
_STILL_SHARE = 0.5


@dataclass(frozen=True)
class Record:
    """One row per sample; shape (rows,) each, SI, rad or m by the kind of axis.

    Attributes:
        time, position, velocity, current, temperature: the measurement.
        command: position command sent after it.
        hand: torque of the hand over the period that follows; zero where no hand is known.
        estimated: the controller's estimate of it.
        motor: K i.
        compensated: gravity, friction and effects that the controller takes off.
        state: the controller's state, as a word.
    """

    time: Array
    position: Array
    velocity: Array
    current: Array
    temperature: Array
    command: Array
    hand: Array
    estimated: Array
    motor: Array
    compensated: Array
    state: tuple[str, ...]


@dataclass(frozen=True)
class PushFigures:
    """One push; torque in N m (N), speed in rad/s (m/s); `None` in mm and N where unknown.

    Attributes:
        direction: +1 or -1.
        torque, force_n: mean of the hand over the second half of the push, when the start is over.
        uneven_torque: how much it varies meanwhile, standard deviation.
        peak_torque: its greatest magnitude.
        speed, speed_mm_s: mean speed over the same time, positive along the push.
        stop_ms: from letting go until the axis stays within `STOP_COUNTS` encoder counts of where it
            comes to rest. A hand that holds still first lets go of an axis that stands already.
        travel_after_counts: how far it still went after letting go, encoder counts.
        overshoot_counts: how far it went beyond where it came to rest, encoder counts.
        drift_counts_per_s: creep over the second half of the rest, encoder counts a second.
        ripple_counts: peak to peak over the second half of the rest, encoder counts.
        energy_to_hand: energy that the axis gave to the hand over the push, J; negative: the hand worked.
        from_motion: whether it let go while moving.
    """

    direction: int
    torque: float
    force_n: float | None
    uneven_torque: float
    peak_torque: float
    speed: float
    speed_mm_s: float | None
    stop_ms: float
    travel_after_counts: float
    overshoot_counts: float
    drift_counts_per_s: float
    ripple_counts: float
    energy_to_hand: float
    from_motion: bool


@dataclass(frozen=True)
class TeachFigures:
    """A whole run: means over the pushes, and the worst of what should be small.

    Attributes are those of `PushFigures`; `yielding_mm_s_per_n` is the mean speed over the mean force, and
    `uneven_n` how far the hand strays from its mean force over and between the pushes, N rms.
    """

    torque: float
    force_n: float | None
    speed: float
    speed_mm_s: float | None
    yielding_mm_s_per_n: float | None
    uneven_n: float | None
    stop_ms: float
    overshoot_counts: float
    drift_counts_per_s: float
    ripple_counts: float
    energy_to_hand: float
    estimate_rmse: float
    resolution: float
    pushes: tuple[PushFigures, ...] = field(default=())

    def to_document(self) -> dict[str, Any]:
        """A JSON document."""
        return asdict(self)


def measure(
    record: Record, hand: Hand, *, resolution: float, travel_ratio: float | None
) -> TeachFigures | None:
    """Take the figures of a run with a simulated hand.

    Args:
        record: the run.
        hand: whose sequence it followed.
        resolution: encoder count, rad (m).
        travel_ratio: m of travel per rad; None where the file does not say.

    Returns:
        None where the run ended before one push and its rest were over.
    """
    pushes = []
    for index, start in enumerate(hand.starts):
        push = hand.sequence[index]
        if record.time[-1] >= start + push.duration - 0.05:
            pushes.append(_push(record, hand, index, resolution, travel_ratio))
    if not pushes:
        return None
    touched = record.hand != 0.0
    error = (record.estimated - record.hand)[touched]
    torque, speed = _mean([p.torque for p in pushes]), _mean([p.speed for p in pushes])
    force = _force(torque, travel_ratio)
    mm_s = None if travel_ratio is None else speed * travel_ratio * 1e3
    uneven = math.sqrt(_mean([p.uneven_torque**2 + (p.torque - torque) ** 2 for p in pushes]))
    moving = [p.stop_ms for p in pushes if p.from_motion]
    return TeachFigures(
        torque=torque,
        force_n=force,
        speed=speed,
        speed_mm_s=mm_s,
        yielding_mm_s_per_n=mm_s / force if mm_s is not None and force else None,
        uneven_n=_force(uneven, travel_ratio),
        stop_ms=max(moving) if moving else math.nan,
        overshoot_counts=max(p.overshoot_counts for p in pushes),
        drift_counts_per_s=max((p.drift_counts_per_s for p in pushes), key=abs),
        ripple_counts=max(p.ripple_counts for p in pushes),
        energy_to_hand=max(p.energy_to_hand for p in pushes),
        estimate_rmse=math.sqrt(float(np.mean(error**2))) if len(error) else math.nan,
        resolution=resolution,
        pushes=tuple(pushes),
    )


def _push(record: Record, hand: Hand, index: int, resolution: float, ratio: float | None) -> PushFigures:
    push, start = hand.sequence[index], hand.starts[index]
    time, position = record.time, record.position
    release = start + push.push_s + push.hold_s
    half = 1e-6
    steady = start + _START_SHARE * push.push_s
    during = (time >= steady - half) & (time < start + push.push_s - half)
    touching = (time >= start - half) & (time < release - half)
    after = (time >= release - half) & (time < release + push.rest_s - half)
    torque = push.direction * float(np.mean(record.hand[during]))
    rows = np.flatnonzero(during)
    last = min(int(rows[-1]) + 1, len(time) - 1)
    travelled = position[last] - position[rows[0]]
    speed = push.direction * float(travelled / (time[last] - time[rows[0]]))
    # a torque is held over the period that follows its row: its work is torque times that travel
    step = np.diff(position, append=position[-1])
    energy = -float(np.sum(record.hand[touching] * step[touching]))
    rest = position[after]
    still = rest[int(len(rest) * _STILL_SHARE) :]
    place = float(np.median(still))
    away = np.flatnonzero(np.abs(rest - place) > 1.01 * STOP_COUNTS * resolution)
    since = time[after] - release
    stop = float(since[min(away[-1] + 1, len(since) - 1)]) if len(away) else 0.0
    beyond = push.direction * (rest - place)
    still_time = time[after][-len(still) :]
    drift = float(np.polyfit(still_time - still_time[0], still, 1)[0]) if len(still) > 2 else 0.0
    return PushFigures(
        direction=push.direction,
        torque=torque,
        force_n=_force(torque, ratio),
        uneven_torque=float(np.std(record.hand[during])),
        peak_torque=float(np.max(np.abs(record.hand[touching]))),
        speed=speed,
        speed_mm_s=None if ratio is None else speed * ratio * 1e3,
        stop_ms=1e3 * stop,
        travel_after_counts=push.direction * (place - float(rest[0])) / resolution,
        overshoot_counts=max(0.0, float(np.max(beyond))) / resolution,
        drift_counts_per_s=drift / resolution,
        ripple_counts=float(np.ptp(still)) / resolution,
        energy_to_hand=energy,
        from_motion=push.hold_s == 0.0,
    )


def _force(torque: float, ratio: float | None) -> float | None:
    return None if ratio is None else torque / ratio


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values)
