"""What the model is evaluated on: the motion of the axis, row by row."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from idtool.model.row import Row

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
    """The kinematics and surroundings of every row, all trials one after another.

    Arrays have shape (rows,) and SI units; `None` where a log does not hold the quantity. "Torque"
    stands for force on a linear axis.

    Attributes:
        time: time of the sample, s.
        trial: index of the trial, 0, 1, 2, ... in order of appearance.
        position, velocity, acceleration: best estimates at the instant of the sample.
        payload: kg.
        gravity_factor: cos(alpha) cos(beta), 1 where the tilt was not logged.
        tilt_alpha, tilt_beta: rad.
        temperature: degrees Celsius.
        load: gravity torque that the axis carries, from the gravity model identified so far.
        load_upright: the same at zero tilt.
        torque_constant: K, N m/A (N/A), or None where no current was logged.
        of_voltage: whether the effort is the voltage at the motor.
        back_emf: what the back-EMF takes of that voltage's torque per speed, N m s/rad (N s/m); None where it
            is not known and in the viscous friction.
        restart: last rows of a rest, after which nobody knows the deflection of the bristle: friction at rest
            is whatever the drive pushes with.
        clocks: which clock `time` is of, 0, 1, 2, ... in order of appearance; None: see `clock`.
    """

    time: Array
    trial: NDArray[np.intp]
    position: Array
    velocity: Array
    acceleration: Array
    payload: Array | None = None
    gravity_factor: Array | None = None
    tilt_alpha: Array | None = None
    tilt_beta: Array | None = None
    temperature: Array | None = None
    load: Array | None = None
    load_upright: Array | None = None
    torque_constant: float | None = None
    of_voltage: bool = False
    back_emf: Array | None = None
    restart: NDArray[np.bool_] | None = None
    clocks: NDArray[np.intp] | None = None

    def __len__(self) -> int:
        return len(self.time)

    def part(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> Motion:
        """These rows of every array; they keep the clocks of the whole."""
        whole = {name: getattr(self, name) for name in self.__dataclass_fields__} | {"clocks": self.clock}
        arrays: dict[str, Any] = {k: v[rows] for k, v in whole.items() if isinstance(v, np.ndarray)}
        return replace(self, **arrays)

    def typical(self, name: str, rows: slice) -> float | None:
        """Median of a quantity over a slice of the rows, computed once; None where it was not logged."""
        values, key = getattr(self, name), (name, rows.start, rows.stop)
        if values is not None and key not in self._medians:
            self._medians[key] = float(np.median(values[rows]))
        return self._medians.get(key)

    @cached_property
    def _medians(self) -> dict[tuple[str, int, int], float]:
        return {}

    @cached_property
    def clock(self) -> NDArray[np.intp]:
        """Clock of every row, shape (rows,)."""
        return clocks_of(self.time, self.trial) if self.clocks is None else self.clocks

    @cached_property
    def starts(self) -> NDArray[np.intp]:
        """Row at which each trial starts, shape (trials,)."""
        return np.flatnonzero(self.first)

    @cached_property
    def ends(self) -> NDArray[np.intp]:
        """Row behind the last of each trial, shape (trials,)."""
        return np.append(self.starts[1:], len(self))

    @cached_property
    def first(self) -> NDArray[np.bool_]:
        """True at the first row of each trial."""
        first = np.ones(len(self), dtype=bool)
        first[1:] = self.trial[1:] != self.trial[:-1]
        return first

    @cached_property
    def begins(self) -> NDArray[np.bool_]:
        """True at the first row of each stretch: of a trial, or from a rest on."""
        return self.first if self.restart is None else self.first | self.restart

    @cached_property
    def stretch(self) -> NDArray[np.intp]:
        """Index of the stretch of each row; the bristle's deflection at its start is unknown."""
        return np.asarray(np.cumsum(self.begins) - 1, dtype=np.intp)

    @cached_property
    def stretches(self) -> int:
        """Number of stretches."""
        return int(np.count_nonzero(self.begins))

    @cached_property
    def travels(self) -> Array:
        """How far the axis moves in each stretch, there and back, rad (m), shape (stretches,)."""
        moved = np.bincount(self.stretch, np.abs(self.step_velocity) * self.step, self.stretches)
        return np.asarray(moved, dtype=float)

    @cached_property
    def step(self) -> Array:
        """Time since the row before, s; 0 at the first row of a trial."""
        step = np.zeros(len(self))
        step[1:] = np.diff(self.time)
        step[self.first] = 0.0
        return step

    @cached_property
    def period(self) -> float:
        """The usual time between two rows of a trial, s."""
        return float(np.median(self.step[~self.first]))

    @cached_property
    def reversals(self) -> int:
        """How often the velocity changes its sign from one row of a trial to the next."""
        turns = np.sign(self.velocity[1:]) * np.sign(self.velocity[:-1]) < 0
        return int(np.count_nonzero(turns & ~self.first[1:]))

    @cached_property
    def rows(self) -> Row:
        """All rows at once; a number where it is one for all of them."""
        return Row(
            first=self.first,
            start=0.0,
            step=self.step,
            time=self.time,
            position=self.position,
            velocity=self.velocity,
            acceleration=self.acceleration,
            payload=_known(self.payload),
            load=_known(self.load),
            load_upright=_known(self.load_upright),
            tilt_alpha=_known(self.tilt_alpha, 0.0),
            tilt_beta=_known(self.tilt_beta, 0.0),
            temperature=_known(self.temperature),
            torque_constant=_known(self.torque_constant),
            clock=self.clock,
        )

    @cached_property
    def each_row(self) -> Row:
        """All rows at once, with an array for everything."""
        return Row(*(v if isinstance(v, np.ndarray) else np.full(len(self), v) for v in self.rows))

    @cached_property
    def braking(self) -> Array:
        """What the known back-EMF takes of the torque, N m (N), shape (rows,)."""
        return np.zeros(len(self)) if self.back_emf is None else self.back_emf * self.velocity

    @cached_property
    def waves(self) -> dict[float, Array]:
        """Sines and cosines of the position that an effect wants again, by cycles per radian (metre)."""
        return {}

    @cached_property
    def step_velocity(self) -> Array:
        """Mean velocity over the step that ends at the row (mid-point rule)."""
        return self.at_step(self.velocity)

    @cached_property
    def speed(self) -> Array:
        """Size of the velocity, shape (rows,)."""
        return np.abs(self.velocity)

    @cached_property
    def step_speed(self) -> Array:
        """Size of the mean velocity over the step that ends at the row."""
        return np.abs(self.step_velocity)

    @cached_property
    def way(self) -> Array:
        """Sign of the mean velocity over the step that ends at the row."""
        return np.sign(self.step_velocity)

    def at_step(self, values: Array) -> Array:
        """Mean of a row quantity over the step that ends at each row."""
        mean = np.empty(len(values))
        np.add(values[1:], values[:-1], out=mean[1:])
        mean *= 0.5
        mean[self.starts] = values[self.starts]
        return mean

    @property
    def trials(self) -> int:
        """Number of trials."""
        return len(self.starts)


def clocks_of(time: Array, trial: NDArray[np.intp]) -> NDArray[np.intp]:
    """Which clock each row was recorded on, shapes (rows,): trials of which no two overlap in time may share
    one; where some do, each that does not follow on the one before begins another."""
    begins = np.flatnonzero(np.diff(trial, prepend=trial[:1] - 1))
    first, last = time[begins], time[np.append(begins[1:], len(time)) - 1]
    order = np.argsort(first)
    if np.all(first[order][1:] > last[order][:-1]):
        return np.zeros(len(time), dtype=np.intp)
    anew = np.concatenate([[0], np.cumsum(first[1:] <= last[:-1])])
    return np.asarray(np.repeat(anew, np.diff(np.append(begins, len(time)))), dtype=np.intp)


def since_reversal(position: Array, velocity: Array, trial: NDArray[np.intp]) -> Array:
    """Travel since the axis last turned round, or the trial began; shapes (rows,), rad (m)."""
    way = np.sign(velocity)
    travelled = np.cumsum(np.abs(np.diff(position, prepend=position[0])))
    anew = (np.diff(way, prepend=way[0]) != 0) | (np.diff(trial, prepend=trial[0] - 1) != 0)
    last = np.maximum.accumulate(np.where(anew, np.arange(len(way)), 0))
    return np.asarray(travelled - travelled[last])


def _known(values: Array | float | None, unknown: float = math.nan) -> Array | float:
    return unknown if values is None else values
