"""An axis as the compiled simulation takes it: numbers, tables, and the derivatives of both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from idtool.model.motion import Array

Places = NDArray[np.intp]

# Entries of `numbers`.
INERTIA, COULOMB, STATIC, STRIBECK, EXPONENT, VISCOUS, VISCOUS_OFF, SIGMA0, SIGMA1, SATURATION = range(10)
POSITION_GAIN, VELOCITY_GAIN, LIMIT, DEAD_BAND, BEND = range(10, 15)
FIRST_POSITION, POSITION_STEP, FIRST_VELOCITY, VELOCITY_STEP = range(15, 19)
TIME_STEP = 19
NUMBERS = 20

# Columns of `over_position`, for motion backwards and, that many further on, forwards.
TORQUE, LEVEL_CHANGE, LEVEL_TORQUE, STATIC_CHANGE, VISCOUS_CHANGE, GAIN_CHANGE = range(6)
FIELDS = 6


@dataclass(frozen=True)
class Plant:
    """An axis as the kernel takes it.

    Attributes:
        numbers: see the entries above, shape (NUMBERS,).
        over_position: what gravity and effects add at each position, shape (positions, 2 * FIELDS).
        over_velocity: torque that effects add at each velocity, shape (velocities,).
    """

    numbers: Array
    over_position: Array
    over_velocity: Array


@dataclass(frozen=True)
class Slopes:
    """Derivatives of a plant along coordinates, those that are not zero.

    Attributes:
        count: how many coordinates.
        number_of: coordinate and entry of `numbers` of each, shape (n, 2).
        numbers: its derivative, shape (n,).
        field_of: coordinate and field of each, shape (m, 2).
        over_position: its derivative backwards and forwards at each position, shape (m, 2, positions).
        torque_of: coordinate of each torque over velocity, shape (k,).
        over_velocity: its derivative at each velocity, shape (k, velocities).
    """

    count: int
    number_of: Places
    numbers: Array
    field_of: Places
    over_position: Array
    torque_of: Places
    over_velocity: Array

    @classmethod
    def between(cls, plant: Plant, others: Sequence[Plant], steps: Sequence[float]) -> Slopes:
        """By differences.

        Args:
            plant: the axis.
            others: plants a small step further on along each coordinate; tables that are the same object do
                not change.
            steps: sizes of these steps.
        """
        numbers = np.zeros((len(others), NUMBERS))
        fields, tables, coordinates, torques = [], [], [], []
        for k, (other, step) in enumerate(zip(others, steps, strict=True)):
            numbers[k] = (other.numbers - plant.numbers) / step
            if other.over_position is not plant.over_position:
                table = ((other.over_position - plant.over_position) / step).reshape(-1, 2, FIELDS)
                for field in np.flatnonzero(table.any(axis=(0, 1))):
                    fields.append((k, int(field)))
                    tables.append(table[:, :, field].T)
            if np.any(other.over_velocity != plant.over_velocity):
                coordinates.append(k)
                torques.append((other.over_velocity - plant.over_velocity) / step)
        places = np.argwhere(numbers)
        return cls(
            len(others),
            places,
            numbers[tuple(places.T)],
            np.array(fields, dtype=np.intp).reshape(-1, 2),
            np.array(tables).reshape(-1, 2, len(plant.over_position)),
            np.array(coordinates, dtype=np.intp),
            np.array(torques).reshape(-1, len(plant.over_velocity)),
        )
