"""A taught path as a table of a board's flash: even steps in time, 16 bits a place, joined by cubics."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from idtool.control.guard import Limits
from idtool.errors import InputError
from idtool.export.c_literals import c_float
from idtool.guiding.path import TaughtPath, cut_by, limited
from idtool.guiding.playback import APPROACH_SPEED, LAG_S, LONGEST_LAG_S, TRIM, TRIM_SHARE
from idtool.guiding.player import BEHIND_SHARE, REST_S
from idtool.model.motion import Array

#: The table follows the path to within this share of its whole way; a step is one of these at most, ms.
_SHARE = 5e-4
_STEPS_MS = (160, 80, 40, 20, 10)
#: Places of a table (two bytes of flash each), and the longest path, s: a clock of microseconds has 4294 s in
#: 32 bits, half of which tell earlier from later.
_LONGEST, _LONGEST_S = 16_000, 2000.0
#: Steps of a place, which takes two bytes.
_COUNTS = 65_534


@dataclass(frozen=True)
class PathTable:
    """A path in even steps.

    Attributes:
        step_s: between two places, s.
        counts: places, -32767 to 32767, shape (places,).
        middle, per_count: rad (m).
    """

    step_s: float
    counts: Array
    middle: float
    per_count: float

    @property
    def bytes(self) -> int:
        """Of flash."""
        return 2 * len(self.counts)

    def at(self, time: Array) -> Array:
        """Positions at these times, s, as the board reads them: Catmull and Rom's cubics."""
        places = self.middle + self.per_count * self.counts
        last = len(places) - 1
        u = np.clip(time / self.step_s, 0.0, last)
        k = np.minimum(u.astype(int), last - 1)
        u = u - k
        a, b, c, d = (places[np.clip(k + j, 0, last)] for j in (-1, 0, 1, 2))
        begin, end, way = 0.5 * (c - a), 0.5 * (d - b), c - b
        result: Array = b + u * (begin + u * (3 * way - 2 * begin - end + u * (begin + end - 2 * way)))
        return result


def path_table(path: TaughtPath) -> PathTable:
    """The fewest places that keep the path.

    Raises:
        InputError: it is too long for a board.
    """
    if path.duration > _LONGEST_S:
        raise InputError(f"lasts {path.duration:.0f} s, and a board plays {_LONGEST_S:.0f} s", place="--path")
    low, high = float(np.min(path.position)), float(np.max(path.position))
    for step_ms in _STEPS_MS:
        time = np.linspace(0.0, path.duration, math.ceil(1e3 * path.duration / step_ms) + 1)
        places = np.interp(time, path.time, path.position)
        per_count = max(high - low, 1e-9) / _COUNTS
        middle = 0.5 * (low + high)
        table = PathTable(
            path.duration / (len(time) - 1), np.round((places - middle) / per_count), middle, per_count
        )
        if np.max(np.abs(table.at(path.time) - path.position)) <= _SHARE * (high - low):
            break
    if len(table.counts) > _LONGEST:
        raise InputError(
            f"needs {len(table.counts)} places, and a table holds {_LONGEST}",
            place="--path",
            remedy="cut it into parts",
        )
    return table


def in_c(path: TaughtPath, limits: Limits, units: str, speed: float = 1.0) -> tuple[dict[str, object], str]:
    """What the template reads, and a note on it.

    Args:
        path: as it was taught.
        limits: position and speed that the path is kept inside.
        units: of a position, as text.
        speed: relative to how it was taught.

    Raises:
        InputError: there is no range, or the path is too long for a board.
    """
    low, high = limits.position_min, limits.position_max
    if not (math.isfinite(low) and math.isfinite(high)):
        raise InputError(
            "a path is played inside a range, and none was told", place="--path", remedy="add --range"
        )
    cut = cut_by(path, low, high)
    path, scale = limited(path, low=low, high=high, speed=limits.speed, scale=speed)
    table = path_table(path)
    least = TRIM_SHARE * float(np.max(np.abs(np.gradient(path.position, path.time))))
    behind = BEHIND_SHARE * (high - low)
    numbers = {
        "middle": table.middle,
        "per_count": table.per_count,
        "low": low,
        "high": high,
        "behind": behind,
        "least": least,
        "per_approach": 1.5 / APPROACH_SPEED[path.kind],
        "lag": LAG_S,
        "longest_lag": LONGEST_LAG_S,
        "trim": TRIM,
    }
    note = (
        f"the path lasts {path.duration:.1f} s at {scale:.2g} of the taught speed and takes {table.bytes}"
        f" bytes of flash, a place every {1e3 * table.step_s:.0f} ms"
        f"{'; ' + cut if cut else ''}"
    )
    return {
        "path_rows": [str(int(count)) for count in table.counts],
        "path_step_us": round(1e6 * table.step_s),
        "path_rest_us": round(1e6 * REST_S),
        "path_behind_words": f"{behind:.3g} {units}",
        **{f"path_{name}": c_float(value, f"path, {name}") for name, value in numbers.items()},
    }, note
