"""Play a taught path back on a rig: to its start slowly, along it, and stop where something is in the way.

The command leads the path by the lag of the position loop, which is trimmed on the way.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Unpack

import numpy as np

from idtool.guiding.path import TaughtPath
from idtool.guiding.player import REST_S, Player, Stop, Watching
from idtool.model.motion import Array
from idtool.rig.base import Rig, Sample, TrialSetup

#: Way to the start of a path: speed, rad/s (m/s).
APPROACH_SPEED = {"rotary": 0.25, "linear": 0.01}
#: First guess of the position loop's lag and the most that is believed, s; it is trimmed by this share of
#: what is missing at every sample that is faster than this share of the path's greatest speed.
LAG_S, LONGEST_LAG_S = 0.05, 0.2
TRIM, TRIM_SHARE = 0.05, 0.3


@dataclass(frozen=True)
class Played:
    """A run.

    Attributes:
        time, position, wanted: along the path only, s and rad (m), shape (samples,).
        lag_s: of the position loop.
        stopped: None if it came to the end.
        interrupted: stopped by the user.
    """

    time: Array
    position: Array
    wanted: Array
    lag_s: float
    stopped: Stop | None
    interrupted: bool

    @property
    def rms_error(self) -> float:
        """Of the position along the path, rad (m); NaN if it never got there."""
        return float(np.sqrt(np.mean((self.position - self.wanted) ** 2))) if len(self.time) else math.nan


def play(
    path: TaughtPath,
    rig: Rig,
    setup: TrialSetup,
    *,
    loops: int = 1,
    progress: Callable[[float], None] | None = None,
    **watching: Unpack[Watching],
) -> Played:
    """Play a path.

    Args:
        path: inside the rig's limits (`path.limited`).
        rig, setup, watching: as of `Player`, whose errors these are.
        loops: how often; it goes back to the start in between.
        progress: called with the share done, 0 to 1.
    """
    lag = LAG_S
    least = TRIM_SHARE * float(np.max(np.abs(np.gradient(path.position, path.time))))
    rows: list[tuple[float, float, float]] = []
    stopped: Stop | None = None
    with Player(rig, setup, "play", **watching) as player:
        sample = player.listen(player.begin())
        for loop in range(loops):
            sample, stopped = _approach(player, sample, float(path.position[0]), APPROACH_SPEED[path.kind])
            begun = sample.time_s
            while stopped is None and (now := sample.time_s - begun) < path.duration:
                wanted, speed = path.at(now + rig.period_s)
                sample = player.step(wanted + lag * speed)
                rows.append((sample.time_s, sample.position, wanted))
                if abs(speed) > least:
                    late = min(max((wanted - sample.position) / speed, -LAG_S), LAG_S)
                    lag = min(max(lag + TRIM * late, 0.0), LONGEST_LAG_S)
                stopped = player.met(sample, wanted)
                if progress is not None:
                    progress(min((loop + now / path.duration) / loops, 1.0))
            if stopped is not None:
                break
    time, position, where = np.array(rows, dtype=float).reshape(-1, 3).T
    return Played(time, position, where, lag, stopped, player.interrupted)


def _approach(player: Player, sample: Sample, goal: float, speed: float) -> tuple[Sample, Stop | None]:
    """Move to `goal` with a smooth start and end, and stand."""
    start = sample.position
    way = goal - start
    duration = max(1.5 * abs(way) / speed, 0.2)  # a smooth step's middle is half as fast again as its mean
    begun = sample.time_s
    stopped = None
    while stopped is None and (now := sample.time_s - begun) < duration + REST_S:
        share = min(now / duration, 1.0)
        wanted = start + way * share * share * (3.0 - 2.0 * share)
        sample = player.step(wanted)
        stopped = player.met(sample, wanted)
    return sample, stopped
