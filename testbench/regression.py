"""What plain least squares finds in a recording: the least that the toolkit should find there too.

Moving rows only; the same zero-phase low-pass on both sides; columns join one after another, the one that
lowers the error on rows held out in turn most, until none lowers it to `_WORTH`. Among these rows are those
on which its error is told, which flatters it a little: it is a bar to reach, not a model.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from idtool.log import Log
from idtool.log.effort import effort_of
from idtool.model.motion import Array

Flags = NDArray[np.bool_]

_ALL = slice(None)
#: Corner of the low-pass, Hz, or this share of the sampling rate where that is lower; rows kept per corner.
_CORNER_HZ, _OF_RATE, _ROWS_PER_CORNER = 10.0, 0.2, 3.0
#: A row moves above this share of the usual top speed.
_MOVING = 0.05
#: A speed column that is zero on more rows than all but this share says nothing.
_ALIVE = 0.01
#: A column stays if the error on held-out rows falls to this share; no more columns than this.
_WORTH, _MOST = 0.985, 9
#: From this many trials on they make four folds, in turn; else sixteen blocks of time make five.
_TRIALS, _BLOCKS, _BLOCK_FOLDS = 4, 16, 5
#: The fold whose rows are held out, and the rows of another recording, which choose no column.
_HELD, OTHER = 2, -1
#: Lines over the position; below this many waves in the stroke they are slow.
_LINES, _SLOW = ("line", "line s", "slow line"), 2.0
#: Bins over the stroke, and how much finer than the stroke tells the spectrum is read.
_BINS, _FINER = 1 << 14, 8

_SIGNALS = ("time", "position", "velocity", "acceleration", "jerk", "torque")

#: column -> what of the tool stands for it: names of effects, "friction" (a Stribeck curve), "gravity"
STANDS_FOR: dict[str, tuple[str, ...]] = {
    "inertia": ("inertia",),
    "offset": ("torque_offset", "direction_asymmetry"),
    "abs w": ("torque_offset", "direction_asymmetry"),
    "w abs w": ("nonlinear_viscous",),
    "s abs w^1/3": ("friction", "stribeck_shape", "nonlinear_viscous"),
    "Stribeck 3 %": ("friction", "stribeck_shape"),
    "Stribeck 10 %": ("friction", "stribeck_shape"),
    "Stribeck 30 %": ("friction", "stribeck_shape"),
    "q": ("position_stiffness",),
    "q^2": ("position_stiffness",),
    "q^3": ("position_stiffness",),
    "sin q": ("gravity", "position_stiffness"),
    "cos q": ("gravity", "position_stiffness"),
    "s q": ("position_dependent_friction",),
    "s q^2": ("position_dependent_friction",),
    "t": ("thermal_drift", "external_periodic"),
    "s t": ("thermal_drift",),
    "s abs gravity": ("load_dependent_friction", "drive_backdrive"),
    "jerk": ("transport_delay", "compliance"),
    "line": ("position_ripple",),
    "slow line": ("position_ripple", "position_stiffness"),
    "line s": ("position_ripple", "position_dependent_friction"),
}


@dataclass(frozen=True)
class Rows:
    """Moving rows, low-passed and thinned. Arrays of shape (rows,); SI.

    Attributes:
        trial: number of the trial.
        time, position, velocity, acceleration, jerk, torque: of the row.
        fold: to which a row belongs, `OTHER` for none.
        others: further signals, through the same low-pass.
        rate: rows per second.
    """

    trial: NDArray[np.intp]
    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    jerk: Array
    torque: Array
    fold: NDArray[np.intp]
    others: dict[str, Array]
    rate: float

    @property
    def held(self) -> Flags:
        """Which rows are held out."""
        return np.asarray((self.fold == _HELD) if np.all(self.fold >= 0) else (self.fold == OTHER))


@dataclass(frozen=True)
class Term:
    """One column, or the two of a sine, that joined.

    Attributes:
        name: as in `STANDS_FOR`.
        said: for a person.
        columns: shape (rows, 1 or 2).
        size: what it explains that those before it do not, rms, N m (N); 0 for the base but inertia.
    """

    name: str
    said: str
    columns: Array
    size: float


@dataclass(frozen=True)
class Regression:
    """The outcome.

    Attributes:
        terms: those of the base, then in the order in which they joined.
        coulomb: the base's level, N m (N).
        in_sample, held_out: relative error, per cent.
    """

    terms: tuple[Term, ...]
    coulomb: float
    in_sample: float
    held_out: float

    @property
    def found(self) -> tuple[Term, ...]:
        """What is no Coulomb, viscous friction or gravity."""
        return tuple(term for term in self.terms if term.size > 0.0)


def torque_of(log: Log) -> Array:
    """The measured torque of every row, N m (N); V of the motor where there is but a duty."""
    return effort_of(log).values


def held_out(log: Log) -> Flags:
    """Which rows are held out: every fourth trial, or where there are few trials three blocks of sixteen."""
    return np.asarray(folds(log) == _HELD)


def folds(log: Log) -> NDArray[np.intp]:
    """The fold of every row."""
    trial = np.unique(log.frame["trial"].to_numpy(), return_inverse=True)[1]
    if trial.max() + 1 >= _TRIALS:
        return np.asarray(trial % _TRIALS)
    return np.asarray(np.arange(len(trial)) * _BLOCKS // len(trial) % _BLOCK_FOLDS)


def moving(log: Log, others: Mapping[str, Array] | None = None) -> Rows:
    """The rows of a log on which its axis moves.

    Args:
        log: of one axis.
        others: signals of every row (a prediction).
    """
    effort = effort_of(log)
    fold, torque, untold = folds(log), effort.values, effort.untold
    time, position, velocity = (log.column(role) for role in ("time", "position", "velocity"))
    assert time is not None
    trial = log.frame["trial"].to_numpy()
    parted = (trial[1:] != trial[:-1]) | (untold[1:] != untold[:-1])
    part = np.cumsum(np.concatenate([[False], parted]))
    signals = {"torque": torque} | dict(others or {})
    pieces: list[dict[str, Array]] = []
    rate = 0.0
    for number in np.unique(part[~untold]):
        rows = np.flatnonzero(part == number)
        rows = rows[np.isfinite(time[rows]) & np.isfinite(torque[rows])]
        piece, rate = _piece(rows, time, position, velocity, signals) if len(rows) > 60 else ({}, rate)
        if piece:
            nearest = np.searchsorted(time[rows], piece["time"], side="right") - 1
            piece["fold"] = fold[rows[nearest]]
            pieces.append(piece | {"trial": np.full(len(piece["time"]), float(number))})
    joined = {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}
    speed = np.abs(joined["velocity"])
    keep = speed > _MOVING * np.quantile(speed, 0.98)
    joined = {name: values[keep] for name, values in joined.items()}
    known = {name: joined.pop(name) for name in _SIGNALS}
    trial, fold = (joined.pop(name).astype(np.intp) for name in ("trial", "fold"))
    return Rows(trial=trial, fold=fold, **known, others=joined, rate=rate)


def _piece(
    rows: NDArray[np.intp],
    time: Array,
    position: Array | None,
    velocity: Array | None,
    signals: Mapping[str, Array],
) -> tuple[dict[str, Array], float]:
    """The low-passed signals of one trial, on an even and thinned grid, and its rows per second."""
    step = float(np.median(np.diff(time[rows])))
    grid = np.arange(time[rows[0]], time[rows[-1]], step)
    corner = min(_CORNER_HZ, _OF_RATE / step)
    section = butter(3, 2.0 * corner * step, output="sos")

    def even(values: Array) -> Array:
        good = rows[np.isfinite(values[rows])]
        return np.asarray(np.interp(grid, time[good], values[good]))

    def smooth(values: Array) -> Array:
        return np.asarray(sosfiltfilt(section, values))

    # a speed column that stands still while the axis is moved from place to place is none
    if velocity is not None and (position is None or np.mean(velocity[rows] != 0.0) > _ALIVE):
        speed = even(velocity)
        place = even(position) if position is not None else np.cumsum(speed) * step
    else:
        assert position is not None
        place = even(position)
        speed = np.gradient(place, step)
    filtered = smooth(speed)
    acceleration = np.gradient(filtered, step)
    found = {
        "time": grid,
        "position": smooth(place),
        "velocity": filtered,
        "acceleration": acceleration,
        "jerk": np.gradient(acceleration, step),
    } | {name: smooth(even(values)) for name, values in signals.items()}
    every = max(1, int(1.0 / (_ROWS_PER_CORNER * corner * step)))
    edge = int(0.1 / step)
    kept = slice(edge, len(grid) - edge, every)
    return {name: values[kept] for name, values in found.items()}, 1.0 / (every * step)


def relative(rows: Rows, predicted: Array, which: Flags | slice = _ALL) -> float:
    """Relative error of a prediction on these rows, per cent."""
    left = (rows.torque - predicted)[which]
    return 100.0 * float(np.linalg.norm(left) / np.linalg.norm(rows.torque[which]))


def regress(rows: Rows, gravity: bool) -> Regression:
    """Choose columns for the torque of these rows.

    Args:
        rows: of `moving`.
        gravity: whether the axis is an arm under gravity; its sine and cosine are then in the base.
    """
    candidates = _columns(rows)
    base = _base(gravity)
    terms = [Term(name, name, candidates.pop(name)[:, None], 0.0) for name in base]
    matrix = np.hstack([term.columns for term in terms])
    terms[2] = replace(terms[2], size=_gain(rows, np.delete(matrix, 2, axis=1), matrix))
    coulomb = abs(float(_fit(rows, matrix)[0]))
    while len(terms) < len(base) + _MOST:
        offered = _offered(rows, candidates, matrix, gravity)
        errors = [
            _line_error(rows, matrix, name) if name in _LINES else _error(rows, np.hstack([matrix, columns]))
            for name, _, columns in offered
        ]
        best = int(np.argmin(errors))
        if errors[best] > _WORTH * _error(rows, matrix):
            break
        name, said, columns = offered[best]
        wider = np.hstack([matrix, columns])
        terms.append(Term(name, said, columns, _gain(rows, matrix, wider)))
        candidates.pop(name, None)
        matrix = wider
    fitted = matrix @ _fit(rows, matrix, ~rows.held)
    everything = matrix @ _fit(rows, matrix)
    return Regression(tuple(terms), coulomb, relative(rows, everything), relative(rows, fitted, rows.held))


def _base(gravity: bool) -> tuple[str, ...]:
    return ("coulomb", "viscous", "inertia", *(("sin q", "cos q") if gravity else ()))


def _columns(rows: Rows) -> dict[str, Array]:
    """Every column that does not depend on what was found before."""
    q, w = _unit(rows.position), rows.velocity
    sign, top = np.sign(w), float(np.quantile(np.abs(w), 0.98))
    t = _unit(rows.time)
    found = {
        "coulomb": sign,
        "viscous": w,
        "inertia": rows.acceleration,
        "sin q": np.sin(rows.position),
        "cos q": np.cos(rows.position),
        "offset": np.ones(len(q)),
        "abs w": np.abs(w),
        "w abs w": w * np.abs(w),
        "s abs w^1/3": sign * np.cbrt(np.abs(w)),
        "q": q,
        "q^2": q**2,
        "q^3": q**3,
        "s q": sign * q,
        "s q^2": sign * q**2,
        "t": t,
        "s t": sign * t,
        "jerk": rows.jerk,
    }
    return found | {
        f"Stribeck {100 * share:.0f} %": sign * np.exp(-((w / (share * top)) ** 2))
        for share in (0.03, 0.1, 0.3)
    }


def _unit(values: Array) -> Array:
    return np.asarray((values - values.mean()) / (values.std() or 1.0))


def _offered(
    rows: Rows, candidates: Mapping[str, Array], matrix: Array, gravity: bool
) -> list[tuple[str, str, Array]]:
    """Name, words and columns of everything that might join."""
    base = _base(gravity)
    turns = np.ptp(rows.position) > 1.0
    offered = [
        (name, name, column[:, None])
        for name, column in candidates.items()
        if name not in base and (turns or name not in ("sin q", "cos q"))
    ]
    found = _fit(rows, matrix)
    if gravity:
        load = found[3] * np.sin(rows.position) + found[4] * np.cos(rows.position)
        offered.append(("s abs gravity", "s abs gravity", (np.sign(rows.velocity) * np.abs(load))[:, None]))
    left = rows.torque - matrix @ found
    for kind in ("line", "line s"):
        way = _way(rows, kind)
        waves = _strongest_line(rows, way * left)
        if waves is not None:
            slow = kind == "line" and waves * np.ptp(rows.position) < _SLOW
            said = f"{kind} of {waves:.4g} waves a unit"
            offered.append(("slow line" if slow else kind, said, _sine(rows, way, waves)))
    return offered


def _way(rows: Rows, kind: str) -> Array:
    """1, or the direction for a line that changes sign with it."""
    return np.sign(rows.velocity) if kind == "line s" else np.ones(len(rows.time))


def _sine(rows: Rows, way: Array, waves: float) -> Array:
    angle = 2.0 * np.pi * waves * rows.position
    return np.asarray(way[:, None] * np.column_stack([np.sin(angle), np.cos(angle)]))


def _line_error(rows: Rows, matrix: Array, kind: str) -> float:
    """As `_error`, where the rows of a fold have no say in how many waves the line has either."""
    way, total = _way(rows, kind), 0.0
    for fold in range(rows.fold.max() + 1):
        train, test = (rows.fold != fold) & (rows.fold >= 0), rows.fold == fold
        left = rows.torque - matrix @ _fit(rows, matrix, train)
        waves = _strongest_line(rows, way * left, train)
        wider = matrix if waves is None else np.hstack([matrix, _sine(rows, way, waves)])
        total += float(np.sum((rows.torque - wider @ _fit(rows, wider, train))[test] ** 2))
    return float(np.sqrt(total))


def _strongest_line(rows: Rows, values: Array, which: Flags | slice = _ALL) -> float | None:
    """The waves per unit of travel of the strongest sine over the position; None if there is no room."""
    place, signal = rows.position[which], values[which]
    stroke = float(np.ptp(place))
    steps = np.abs(np.diff(place))
    if stroke <= 0.0 or not np.any(steps > 0.0):
        return None
    # four rows a wave at the usual speed: beyond, a line can be read into anything
    highest = 0.25 / float(np.median(steps[steps > 0.0]))
    sums = np.histogram(place, bins=_BINS, weights=signal - signal.mean())[0]
    power = np.abs(np.fft.rfft(sums, _FINER * _BINS))
    waves = np.fft.rfftfreq(_FINER * _BINS, stroke / _BINS)
    power[(waves < 1.5 / stroke) | (waves > highest)] = 0.0
    return float(waves[np.argmax(power)]) if power.any() else None


def _fit(rows: Rows, matrix: Array, which: Flags | slice = _ALL) -> Array:
    scale = np.linalg.norm(matrix[which], axis=0) + 1e-300
    return np.asarray(np.linalg.lstsq(matrix[which] / scale, rows.torque[which], rcond=1e-10)[0] / scale)


def _error(rows: Rows, matrix: Array) -> float:
    """Root of the summed squared errors on every fold, of the fit to the others."""
    scaled = matrix / (np.linalg.norm(matrix, axis=0) + 1e-300)
    folds = [rows.fold == fold for fold in range(rows.fold.max() + 1)]
    parts = [(scaled[here], rows.torque[here]) for here in folds]
    square, product = sum(x.T @ x for x, _ in parts), sum(x.T @ y for x, y in parts)
    total = 0.0
    for x, y in parts:
        others = np.linalg.lstsq(square - x.T @ x, product - x.T @ y, rcond=1e-12)[0]
        total += float(np.sum((y - x @ others) ** 2))
    return float(np.sqrt(total))


def _gain(rows: Rows, matrix: Array, wider: Array) -> float:
    """What the wider matrix explains that the other does not, rms."""
    before, after = (float(np.mean((rows.torque - x @ _fit(rows, x)) ** 2)) for x in (matrix, wider))
    return float(np.sqrt(max(before - after, 0.0)))
