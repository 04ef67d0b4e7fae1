"""What contradicts itself between the columns of a log: units that do not fit, a current the wrong way round.

The way that the position goes and the way that the speed adds up to are one way; where they are not, a unit
or a sign is wrong. Friction takes power: over a recording the part of the torque that depends on the speed
alone (gravity and inertia give back what they take) puts power into the axis, and where it takes some out for
certain, the current is inverted, or something else moved the axis. Where friction takes too little to tell,
inertia does: what speeds the axis up is a torque that way.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from idtool.log.clock import GAP
from idtool.log.format import columns_of
from idtool.log.sensor_faults import resolution
from idtool.model.motion import Array
from idtool.model.motor import MOST_CURRENT_A, highest_back_emf

#: What an option calls the role of a column.
_ROLE_OF = {
    column: role for one in (columns_of("rotary"), columns_of("linear")) for role, column in one.items()
}
#: Rows of a stretch over which ways are compared: more than a speed reading is late.
_STRETCH = 20
#: Position and speed speak of one motion if they go together so well, and of one unit to within this factor
#: (0.95 to 1.09 over the recordings of machines that are right).
_TOGETHER = 0.9
_UNIT = 1.25
_FACTORS = {
    60.0: "the time is in minutes, or one of them per minute",
    180.0 / math.pi: "one is in degrees, the other in radians",
    1000.0: "one is in thousandths, or the time in milliseconds",
    30.0 / math.pi: "one is in turns a minute",
    2.0 * math.pi: "one is in turns",
}
#: ... a factor is this near, as a logarithm.
_NEAR = 0.05
#: Power is certain if so many of its standard errors from zero, over so many blocks, and no rounding if it is
#: this share of all the power that went to and fro.
_CERTAIN = 5.0
_BLOCKS = 10
_SHARE = 0.1
#: A torque is of one sign if it is on this share of the moving rows; that of gravity alone is too, but then
#: friction takes more than this share of the power, unless the load is twenty times the friction.
_ONE_SIGN = 0.995
_NO_POWER = 0.05
#: A torque of one sign on every row turns round at zero if it comes within this share of its range of zero on
#: so many rows each way: the noise of one that goes on beyond zero would have shown that.
_ZERO = 0.03
_TURNS = 5
#: Less of its variance than this is chance in any torque that was measured.
_FOLLOWS = 0.01
#: A way made of less than this share of all the ways to and fro is a dither.
_PURPOSE = 0.8
#: Spikes apart.
_USUAL = 0.99
#: Digits in which an effort and a column agree tell something if it varies by so many of them.
_DIGITS = 20.0
#: An effort adds up to the position to within this share of its spread if it is a speed; that of no measured
#: torque or current is nearer than 0.05.
_ADDS_UP = 0.01
#: Rows slower than this share of the top speed say nothing on friction in motion.
_MOVING = 0.1


def contradictions(
    time: Array,
    first: NDArray[np.bool_],
    position: Array | None,
    velocity: Array | None,
    effort: Array,
    read_from: str,
    current: Array | None = None,
    told: Mapping[str, tuple[Array, bool]] | None = None,
    constant: float | None = None,
    supply: Array | None = None,
) -> list[str]:
    """Sentences, without the log's name; none where all fits.

    Args:
        time: s, shape (rows,).
        first: True at the first row of each trial.
        position, velocity: readings, shape (rows,), or None.
        effort: torque, NaN where the drive was off or at its limit, shape (rows,).
        read_from: the column that says it.
        current: of the motor, A, shape (rows,), or None.
        told: columns of the log by name that the motion follows and a torque is never in proportion to,
            shape (rows,), and whether it is a speed.
        constant: N m/A (N/A) of that current, or None.
        supply: of the drive, V, shape (rows,), or None.
    """
    steps = np.diff(time)
    together = ~first[1:] & (steps < GAP * float(np.median(steps[~first[1:]])))
    said = []
    if current is not None and (most := float(np.nanquantile(np.abs(current), _USUAL))) > MOST_CURRENT_A:
        said.append(f"the current goes up to {most:.3g} A, which no drive of an axis gives: it may be in mA")
    if current is not None and constant is not None:
        said += _back_emf(constant, _speed(time, together, position, velocity), supply)
    ways = _Ways(steps, together)
    gone = ways.of(velocity, speed=True) if position is None else ways.of(position, speed=False)
    columns = told or {}
    doubts = [_commanded(gone, ways.of(c, speed=speed), name) for name, (c, speed) in columns.items()]
    if position is not None and velocity is not None:
        doubts.insert(0, _units(gone, ways.of(velocity, speed=True)))
    said += next(filter(None, doubts), [])  # one says it
    if position is not None:
        said += _power(steps, together, position, effort, read_from)
    return said + _computed(effort, {name: column for name, (column, _) in columns.items()})


def changed_in_motion(
    told: Array, position: Array, time: Array, first: NDArray[np.bool_], least: float = 0.0
) -> NDArray[np.intp]:
    """Rows at which another load is told while the axis is on its way, shape (changes,).

    Args:
        told: payload, kg, or tilt, rad, shape (rows,).
        position: rad (m), shape (rows,).
        time: s.
        first: True at the first row of each trial.
        least: a change from row to row up to this may be.
    """
    way = np.where(first[1:], 0.0, np.abs(np.diff(position)) / np.diff(time))
    moving = way > _MOVING * float(np.quantile(way, 0.999))
    around = moving & np.append(moving[1:], False) & np.insert(moving[:-1], 0, False)
    return np.flatnonzero(~first[1:] & (np.abs(np.diff(told)) > least) & around) + 1


def _speed(time: Array, together: NDArray[np.bool_], position: Array | None, velocity: Array | None) -> float:
    """The highest that is usual."""
    if velocity is None:
        assert position is not None
        whole = np.lib.stride_tricks.sliding_window_view(together, _STRETCH).all(axis=1)
        way = np.abs(position[_STRETCH:] - position[:-_STRETCH])[whole]
        velocity = way / (time[_STRETCH:] - time[:-_STRETCH])[whole]
    return float(np.nanquantile(np.abs(velocity), _USUAL)) if len(velocity) else 0.0


def _back_emf(constant: float, speed: float, supply: Array | None) -> list[str]:
    """A motor of this constant would make more than what feeds it."""
    most = None if supply is None else float(np.nanmax(supply))
    volts = constant * speed
    if volts <= highest_back_emf(most):
        return []
    has = "no drive is fed with" if most is None else f"its supply of {most:.3g} V does not give"
    return [
        f"a motor with a torque constant of {constant:.4g} makes {volts:.0f} V of its own at a speed of "
        f"{speed:.3g}, which {has}: the constant is per mA or in N mm, or the speed in degrees (on a linear "
        "axis in mm)"
    ]


def _computed(effort: Array, told: Mapping[str, Array]) -> list[str]:
    """No friction, load or noise of its own is in an effort that follows one column to its last digit."""
    for name, column in told.items():
        rows = np.isfinite(column) & np.isfinite(effort)
        if not rows.any() or np.ptp(column[rows]) == 0.0:
            continue
        gain, offset = np.polyfit(column[rows], effort[rows], 1)
        left = float(np.std(effort[rows] - gain * column[rows] - offset))
        digits = resolution(effort) + abs(gain) * resolution(column)
        if left <= digits and _DIGITS * digits < np.std(effort[rows]):
            return [
                f"the torque is {name} times a number, to its last digit: it was commanded or computed from "
                "it, not measured"
            ]
    return []


def adds_up(time: Array, first: NDArray[np.bool_], position: Array, effort: Array) -> bool:
    """Whether an effort is how fast the position changes, times a number: the columns are swapped, or it was
    made of the speed. Friction alone keeps a torque from that, however viscous an axis is.

    Args:
        time: s, shape (rows,).
        first: True at the first row of each trial.
        position, effort: readings, shape (rows,).
    """
    ways = np.insert(0.5 * (effort[1:] + effort[:-1]) * np.diff(time), 0, 0.0)
    ways[first | ~np.isfinite(ways)] = 0.0
    trial = np.cumsum(first) - 1
    sums, places = (
        each - (np.bincount(trial, each) / np.bincount(trial))[trial] for each in (np.cumsum(ways), position)
    )
    if not sums.any() or not places.any():
        return False
    alike = float(sums @ places) ** 2 / (float(sums @ sums) * float(places @ places))
    return 1.0 - alike < _ADDS_UP**2


def _turns_at_zero(forwards: Array, backwards: Array) -> bool:
    """Whether a torque is of one sign on every row, and near zero whichever way the axis moves."""
    both = np.concatenate([forwards, backwards])
    if not both.any() or np.any(both > 0.0) == np.any(both < 0.0):
        return False
    near = _ZERO * float(np.quantile(np.abs(both), _USUAL))
    return all(np.count_nonzero(np.abs(way) < near) >= _TURNS for way in (forwards, backwards))


class _Ways:
    """Stretches of rows, and how far the axis goes in each by any column."""

    def __init__(self, steps: Array, together: NDArray[np.bool_]) -> None:
        self.steps, self.count = steps, len(steps) // _STRETCH * _STRETCH
        self.whole = together[: self.count].reshape(-1, _STRETCH).all(axis=1)

    def of(self, column: Array | None, *, speed: bool) -> Array:
        """By a speed or a position, shape (stretches,)."""
        assert column is not None
        step = 0.5 * (column[1:] + column[:-1]) * self.steps if speed else np.diff(column)
        return np.asarray(step[: self.count].reshape(-1, _STRETCH).sum(axis=1)[self.whole])


def _factor(gone: Array, told: Array) -> float:
    """How many times as far the axis goes as it is told, below zero the other way; 0 if they do not go
    together."""
    rows = np.isfinite(gone) & np.isfinite(told)
    gone, told = gone[rows], told[rows]
    if len(gone) < _BLOCKS or not gone.any() or not told.any():
        return 0.0
    alike = float(gone @ told) / math.sqrt(float(gone @ gone) * float(told @ told))
    if abs(alike) < _TOGETHER:
        return 0.0
    return math.copysign(math.sqrt(float(gone @ gone) / float(told @ told)), alike)


def _named(factor: float) -> str | None:
    """The units that are a factor apart."""
    off = {why: abs(math.log(max(factor, 1.0 / factor) / known)) for known, why in _FACTORS.items()}
    nearest = min(off, key=lambda why: off[why])
    return nearest if off[nearest] < _NEAR else None


def _units(gone: Array, told: Array) -> list[str]:
    factor = _factor(gone, told)
    if factor < 0.0:
        return ["position and speed have opposite signs: one of them is inverted"]
    if factor == 0.0 or 1.0 / _UNIT < factor < _UNIT:
        return []
    guess = _named(factor) or "one of them is in another unit, or behind another gear"
    return [f"the position moves {factor:.4g} times as far as the speed says: {guess}"]


def _commanded(gone: Array, told: Array, name: str) -> list[str]:
    """A drive may fall short of its command by any factor, but not by just that of two units."""
    factor = abs(_factor(gone, told))
    guess = _named(factor) if factor else None
    return [f"the axis moves {factor:.4g} times as far as {name} says: {guess}"] if guess else []


def _sure_sign(found: Sequence[float], size: float) -> int:
    """The sign of a number that was found without each of some stretches of time, if it is certain and the
    number as large as `size`; else 0."""
    mean = float(np.mean(found))
    error = math.sqrt((len(found) - 1) * float(np.mean((np.array(found) - mean) ** 2)))
    return int(math.copysign(1.0, mean)) if abs(mean) > max(_CERTAIN * error, size) else 0


def _power(
    steps: Array, together: NDArray[np.bool_], position: Array, effort: Array, read_from: str
) -> list[str]:
    if not together.any():
        return []
    # of the row itself: a speed that is half a row early makes friction that gives power of any inertia
    inside = np.append(together, False) & np.insert(together, 0, False)
    ahead, ago = np.append(steps, 1.0), np.insert(steps, 0, 1.0)
    step = np.where(together, np.diff(position), 0.0)
    speed = np.where(inside, (np.append(step, 0.0) + np.insert(step, 0, 0.0)) / (ahead + ago), 0.0)
    kernel = np.full(min(5, len(speed)), 1.0 / min(5, len(speed)))
    speed = np.convolve(speed, kernel, mode="same")  # a counter's rates are too rough to be differentiated
    faster = np.gradient(speed) / float(np.median(steps))
    top = float(np.quantile(np.abs(speed), 0.999))
    rows = inside & (np.abs(speed) > _MOVING * top) & np.isfinite(effort)
    ways = rows & (speed > 0.0), rows & (speed < 0.0)
    # one that takes away what the load gives may have one sign too, but then it does not turn round at zero
    if _turns_at_zero(*(effort[way] for way in ways)):
        return [
            "the torque has one sign whichever way the axis moves, and turns round at zero: "
            f'"{read_from}" was recorded without its sign'
        ]
    if min(map(np.count_nonzero, ways)) < _BLOCKS * _STRETCH:
        return []  # moved one way, friction and gravity are one
    count = len(steps) // _STRETCH * _STRETCH
    way = step[:count].reshape(-1, _STRETCH)
    if np.abs(way.sum(axis=1)).sum() < _PURPOSE * np.abs(way).sum():
        return []  # held in place by its controller, whose gains are what the torque shows
    w, q, torque = speed[rows], position[rows], effort[rows]
    centred = (q - q.mean()) / max(float(np.ptp(q)), 1e-300)
    columns = np.column_stack(
        [np.sign(w), w, np.ones(len(w)), centred, centred**2, np.sin(q), np.cos(q), faster[rows]]
    )
    columns /= np.maximum(np.abs(columns).max(axis=0), 1e-300)
    # without one stretch of time each (a jackknife), from sums over the stretches: rows are many, columns few
    begins = np.arange(_BLOCKS) * len(w) // _BLOCKS
    ends = np.append(begins[1:], len(w))
    parts = [slice(begin, end) for begin, end in zip(begins, ends, strict=True)]
    squares = np.array([columns[part].T @ columns[part] for part in parts])
    products = np.array([columns[part].T @ torque[part] for part in parts])
    work = np.array([columns[part, :2].T @ w[part] for part in parts]).sum(axis=0) / len(w)
    found = [
        np.linalg.lstsq(squares.sum(axis=0) - less, products.sum(axis=0) - least, rcond=1e-12)[0]
        for less, least in zip(squares, products, strict=True)
    ]
    powers = [float(work @ one[:2]) for one in found]
    left = torque - columns @ (np.sum(found, axis=0) / _BLOCKS)
    if np.var(left) > (1.0 - _FOLLOWS) * np.var(torque):
        return [
            "the torque has nothing to do with the motion: what was recorded is noise, or of another axis or "
            "time"
        ]
    takes = _sure_sign(powers, _SHARE * float(np.mean(np.abs(torque * w))))
    size = _SHARE * float(np.std(torque)) / max(float(np.std(columns[:, -1])), 1e-300)
    heavy = _sure_sign([float(one[-1]) for one in found], size)  # the last column is that of inertia
    if (takes < 0 and heavy <= 0) or (heavy < 0 and takes <= 0):
        how = (
            "pushes along with the motion, so that friction would drive the axis"
            if takes < 0
            else "brakes the axis as that gains speed, so that its inertia would be below zero"
        )
        return [
            f'the torque {how}: "{read_from}" or the position is inverted (`ffc-id import --unit '
            f"{_ROLE_OF[read_from]}=-` turns it round; the minus goes before its unit where you gave one), "
            "or something else moved the axis"
        ]
    mean = float(np.mean(powers))
    one_way = max(float(np.mean(torque > 0)), float(np.mean(torque < 0))) > _ONE_SIGN
    if one_way and abs(mean) < _NO_POWER * float(np.mean(np.abs(torque * w))):
        return [
            "the torque has one sign whichever way the axis moves, and friction takes no power: "
            f'"{read_from}" was recorded without its sign'
        ]
    return []
