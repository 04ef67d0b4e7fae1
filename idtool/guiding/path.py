"""A taught path: read from a log or from waypoints, smoothed, kept inside what the axis may do.

A hand trembles at 8 to 12 Hz and an encoder counts; a Gaussian of 0.1 s takes both off a path and leaves what
was meant. The path is slowed down as a whole, and nowhere else, until speed and acceleration are inside the
limits. Waypoints are joined by monotone cubics (Fritsch & Carlson 1980), which do not overshoot.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from idtool.errors import InputError, in_file
from idtool.io.atomic import atomic_write, refuse_existing
from idtool.io.toml import is_finite, load_toml
from idtool.log import Log
from idtool.model.motion import Array
from idtool.parameters.axis import Axis

SCHEMA = "ffc-id/waypoints/1"
#: Width of the smoothing of what a hand taught, of waypoints (standard deviation), and step of a path, s.
SMOOTHING_S, WAYPOINT_SMOOTHING_S, STEP_S = 0.1, 0.03, 0.005
#: Time in which a played axis gets to its limit of speed, s.
SPEED_UP_S = 0.25
#: A path begins and ends where the hand first and last moved it farther than this share of its whole way.
_STILL_SHARE = 0.01
#: Waypoints follow the path to within this share of its whole way.
_WAYPOINT_SHARE = 0.005
#: No path takes longer, s: a shift. A clock that counts something else does.
_LONGEST_S = 8.0 * 3600.0


@dataclass(frozen=True)
class TaughtPath:
    """Where the axis is to be, and when.

    Attributes:
        time: from 0, s, rising; shape (points,).
        position: rad (m), shape (points,).
        kind: of the axis, "rotary" or "linear".
    """

    time: Array
    position: Array
    kind: str

    @property
    def unit(self) -> str:
        """Of the position."""
        return "m" if self.kind == "linear" else "rad"

    @property
    def duration(self) -> float:
        """Whole length, s."""
        return float(self.time[-1])

    def at(self, time: float) -> tuple[float, float]:
        """Position and speed at `time` s; it stands before and after."""
        position = float(np.interp(time, self.time, self.position))
        if not 0.0 < time < self.duration:
            return position, 0.0
        step = 0.5 * STEP_S
        ahead, behind = np.interp((time + step, time - step), self.time, self.position)
        return position, float(ahead - behind) / (2.0 * step)


def read_path(file: Path) -> tuple[TaughtPath, Axis]:
    """A taught log, or a file of waypoints (`.toml`).

    Raises:
        InputError: it is neither, the axis does not move in it, or for longer than a shift.
    """
    with in_file(file):
        return read_waypoints(file) if file.suffix == ".toml" else _taught(Log.read(file))


def _taught(log: Log) -> tuple[TaughtPath, Axis]:
    """The part of a log in which the axis moves.

    Raises:
        InputError: it does not, or for longer than a shift.
    """
    trial = log.trials[0]
    time = trial["time_s"].to_numpy(dtype=float)
    values = log.column("position")
    if values is None:
        raise InputError("holds no position", remedy="record one with `ffc-id teach -o`")
    position = values[: len(time)]
    way = float(np.ptp(position))
    moved = np.flatnonzero(np.abs(position - position[0]) > _STILL_SHARE * way)
    going = np.flatnonzero(np.abs(position - position[-1]) > _STILL_SHARE * way)
    if way == 0.0 or not len(moved) or not len(going):
        raise InputError("the axis does not move in it", remedy="teach it a path first")
    part = slice(max(int(moved[0]) - 1, 0), min(int(going[-1]) + 2, len(time)))
    _refuse_long(time[part])
    return smoothed(time[part] - time[part][0], position[part], log.axis.kind), log.axis


def _refuse_long(time: Array) -> None:
    lasts = float(time[-1]) - float(time[0])
    if lasts > _LONGEST_S:
        raise InputError(
            f"the path lasts {lasts:.3g} s, longer than the {_LONGEST_S:g} s that a path may",
            remedy="its time must count seconds (`ffc-id import --unit time=ms` converts), without a pause",
        )


def smoothed(time: Array, position: Array, kind: str, width: float = SMOOTHING_S) -> TaughtPath:
    """A Gaussian over the path, which stands before its start and after its end; on an even grid."""
    from scipy.ndimage import gaussian_filter1d

    rest = 4.0 * width
    grid = np.arange(-rest, float(time[-1]) + rest + STEP_S, STEP_S)
    even = np.interp(grid, time, position)
    smooth = gaussian_filter1d(even, width / STEP_S, mode="nearest")
    return TaughtPath(grid - grid[0], smooth, kind)


def limited(
    path: TaughtPath,
    *,
    low: float,
    high: float,
    speed: float,
    acceleration: float | None = None,
    scale: float = 1.0,
) -> tuple[TaughtPath, float]:
    """The path inside the limits: position cut, the whole slowed down.

    Args:
        path: as it was taught.
        low, high: of the position, rad (m).
        speed, acceleration: greatest, rad/s and rad/s^2 (m ...); the latter gets to the speed within 0.25 s
            unless it is told.
        scale: of the speed, as asked for.

    Returns:
        The path, and the scale that it got: at most the one that was asked for.
    """
    acceleration = speed / SPEED_UP_S if acceleration is None else acceleration
    position = np.clip(path.position, low, high)
    velocity = np.gradient(position, path.time)
    fastest = float(np.max(np.abs(velocity)))
    sharpest = float(np.max(np.abs(np.gradient(velocity, path.time))))
    got = min(scale, speed / max(fastest, 1e-12), float(np.sqrt(acceleration / max(sharpest, 1e-12))))
    return TaughtPath(path.time / got, position, path.kind), got


def cut_by(path: TaughtPath, low: float, high: float) -> str | None:
    """What `limited` cuts off, as a sentence without its full stop; None where all is inside.

    A hand wanders past an end by a little; in a file that was edited it is a slip of the pen."""
    worst = float(path.position[int(np.argmax(np.maximum(low - path.position, path.position - high)))])
    if low <= worst <= high:
        return None
    unit = path.unit
    return f"the path goes to {worst:.4g} {unit}, beyond {low:.4g} to {high:.4g} {unit}, and is cut there"


def waypoints(path: TaughtPath) -> list[tuple[float, float]]:
    """Points (time, position) that keep the path to within a share of its way (Douglas & Peucker 1973)."""
    tolerance = _WAYPOINT_SHARE * float(np.ptp(path.position))
    kept = {0, len(path.time) - 1}
    open_ = [(0, len(path.time) - 1)]
    while open_:
        first, last = open_.pop()
        if last - first < 2:
            continue
        inner = slice(first + 1, last)
        chord = np.interp(path.time[inner], path.time[[first, last]], path.position[[first, last]])
        away = np.abs(path.position[inner] - chord)
        worst = first + 1 + int(np.argmax(away))
        if away[worst - first - 1] > tolerance:
            kept.add(worst)
            open_ += [(first, worst), (worst, last)]
    return [(float(path.time[k]), float(path.position[k])) for k in sorted(kept)]


def write_waypoints(file: Path, path: TaughtPath, *, force: bool = False) -> int:
    """Write the path as points that a person can edit; how many there are."""
    refuse_existing(file, force)
    points = waypoints(path)
    table: dict[str, Any] = {
        "schema": SCHEMA,
        "axis": {"kind": path.kind},
        "points": [{"time_s": round(t, 4), f"position_{path.unit}": round(q, 6)} for t, q in points],
    }
    with atomic_write(file) as stream:
        stream.write("# When the axis is where. Change, add or take out points; times rise from 0.\n")
        stream.write(tomli_w.dumps(table))
    return len(points)


def read_waypoints(file: Path) -> tuple[TaughtPath, Axis]:
    """A path from a file of waypoints.

    Raises:
        InputError: not such a file, fewer than two points, times that do not rise or last longer than a
            shift, a number that is none.
    """
    from scipy.interpolate import PchipInterpolator

    document = load_toml(file, what="a file of waypoints", made_by="`ffc-id play --waypoints`")
    if document.get("schema") != SCHEMA:
        raise InputError(f'expected "{SCHEMA}"', place="schema", remedy="make it with `play --waypoints`")
    axis = Axis.from_table(document.get("axis", {}))
    key = "position_m" if axis.kind == "linear" else "position_rad"
    rows = document.get("points")
    if not isinstance(rows, list) or len(rows) < 2:
        raise InputError("expected two points at least", place="points")
    numbers = np.zeros((len(rows), 2))
    for index, row in enumerate(rows):
        for column, name in enumerate(("time_s", key)):
            value = row.get(name) if isinstance(row, dict) else None
            if not is_finite(value):
                raise InputError("expected a number", place=f"points[{index}].{name}")
            numbers[index, column] = value
    time, position = numbers.T
    if not np.all(np.diff(time) > 0.0):
        raise InputError("the times do not rise", place="points", remedy="put them in order")
    _refuse_long(time)
    grid = np.arange(0.0, time[-1] - time[0] + STEP_S, STEP_S)
    even = PchipInterpolator(time - time[0], position)(np.minimum(grid, time[-1] - time[0]))
    return smoothed(grid, np.asarray(even, dtype=float), axis.kind, WAYPOINT_SMOOTHING_S), axis
