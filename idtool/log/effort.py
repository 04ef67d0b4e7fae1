"""What stands for the motor's torque in a log: torque, its current, the supply's current, or its voltage.

In this order, the first whose constant is known: `torque_nm`; K times `current_a`; K times
`bus_current_a` / `duty` (a bridge that is on for a share of the time passes the motor's current to the
supply for that share); K / R times `duty` times `supply_voltage_v`. Where no constant is known, the first
that is there, in A or V.

The voltage is not the torque alone: the back-EMF K w is in it. Where R is known the model holds it
(`Axis.back_emf_damping`) beside viscous friction; else the two, which look exactly alike, are one. It is
never taken off the voltage: the speed that is read is late and noisy, the back-EMF is of the true one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from idtool.errors import InputError
from idtool.log import Log, columns_of, sensor_faults
from idtool.model.motion import Array
from idtool.model.units import EffortUnit

#: Below this duty the supply's current over it is mostly the noise of both.
_LEAST_DUTY = 0.05
#: A duty above this share of full is full.
_FULL = 0.995
#: Of the variance that the sag leaves, a share between neighbouring rows above which it is no sag.
_RIPPLE = 0.2
DRIVE_OFF = "drive switched off"
DUTY_FULL = "duty saturated"
DUTY_SMALL = "duty too small to divide the supply's current by"


@dataclass(frozen=True)
class Effort:
    """The effort of every row of a log.

    Attributes:
        values: shape (rows,), in `unit`.
        unit: "torque" (N m or N), "current" (A) or "voltage" (V).
        column: the column that it is read from.
        scale: values over that column, as a rule.
        back_emf: by how much of the speed the back-EMF makes `values` larger than the motor's torque,
            N m s/rad, shape (rows,); 0 where that is not known or there is none.
        unfit: reason -> rows that say nothing of friction, shape (rows,).
    """

    values: Array
    unit: EffortUnit
    column: str
    scale: float
    back_emf: Array
    unfit: dict[str, NDArray[np.bool_]]

    @property
    def untold(self) -> NDArray[np.bool_]:
        """Rows that say nothing, for whatever reason, shape (rows,)."""
        none = np.zeros(len(self.values), dtype=bool)
        return np.asarray(np.any([none, *self.unfit.values()], axis=0))


def effort_of(log: Log) -> Effort:
    """The effort of a log.

    Raises:
        InputError: it is the same on every row on which the drive is on.
    """
    names, axis = columns_of(log.axis.kind), log.axis
    current, duty, voltage = log.column("current"), log.column("duty"), log.column("supply_voltage")
    bus, torque = log.column("bus_current"), log.column("torque")
    constant, per_volt = axis.torque_constant, axis.voltage_constant
    unfit: dict[str, NDArray[np.bool_]] = {}
    back_emf = np.zeros(log.row_count)
    unit: EffortUnit = "torque"
    by_bus = bus is not None and duty is not None
    by_voltage = duty is not None and voltage is not None
    if torque is not None:
        values, column = torque, names["torque"]
    elif current is not None and (constant or not (by_voltage and per_volt)):
        values, column = current * (constant or 1.0), names["current"]
        unit = "torque" if constant else "current"
    elif by_bus and (constant or not (by_voltage and per_volt)):
        assert bus is not None
        assert duty is not None
        values, unfit[DUTY_SMALL] = _phase_current(bus, duty)
        values, column = values * (constant or 1.0), names["bus_current"]
        unit = "torque" if constant else "current"
    else:
        assert duty is not None
        assert voltage is not None
        voltage = supply_of(log, duty, voltage)
        values, column = duty * voltage * (per_volt or 1.0), names["duty"]
        unit = "torque" if per_volt else "voltage"
        back_emf += axis.back_emf_damping
    if duty is not None and torque is None:
        unfit[DUTY_FULL] = (np.abs(duty) >= _FULL) | sensor_faults.clipped(duty)
    on = log.column("drive_on")
    if on is not None and not on.all():
        unfit[DRIVE_OFF] = _around(on == 0.0)
        values = np.where(on == 0.0, 0.0, values)
        back_emf = np.where(on == 0.0, 0.0, back_emf)
    if on is not None and not on.any():
        raise InputError(
            'column "drive_on" is 0 on every row: nothing drove the axis',
            file=log.source,
            remedy="switch the drive on and record again",
        )
    driven = values if on is None else values[on > 0.0]
    raw = log.values_of(column)
    if driven.max() == driven.min():
        if column == names["duty"] and np.ptp(raw if on is None else raw[on > 0.0]) > 0.0:
            raise InputError(
                f'column "{names["supply_voltage"]}" is 0, so that no duty makes a torque',
                file=log.source,
                remedy="write the voltage of the supply",
            )
        raise InputError(
            f'column "{column}" is the same on every row',
            file=log.source,
            remedy="check the sensor and the motor's mode, then record again",
        )
    read = (raw != 0.0) & (values != 0.0)
    scale = float(np.median(values[read] / raw[read])) if read.any() else 1.0
    unfit = {why: rows for why, rows in unfit.items() if rows.any()}
    return Effort(values, unit, column, scale, back_emf, unfit)


def supply_of(log: Log, duty: Array, voltage: Array) -> Array:
    """The supply of every row, V, as it is over a cycle of the bridge.

    A servo reads its supply at some instant of the cycle: low while the bridge draws, high while the cable
    gives back. Where neighbouring rows differ as much as distant ones, that is most of what the column
    says, and the sag takes its place: the voltage over time and over the duty's square, to which the
    supply's current goes in proportion.
    """
    time = log.column("time")
    assert time is not None
    regressors = np.column_stack([np.ones(len(duty)), time - time.mean(), duty**2])
    found = np.linalg.lstsq(regressors, voltage, rcond=1e-10)[0]
    if found[2] > 0.0:  # no load lifts a supply
        regressors = regressors[:, :2]
        found = np.linalg.lstsq(regressors, voltage, rcond=1e-10)[0]
    sag = regressors @ found
    left = voltage - sag
    same = np.diff(log.trial_of_rows) == 0
    if not same.any() or not left.any():
        return voltage
    neighbours = 0.5 * float(np.mean(np.diff(left)[same] ** 2))
    return sag if neighbours > _RIPPLE * float(np.mean(left**2)) else voltage


def _phase_current(bus: Array, duty: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Current of the motor, and the rows whose duty is too small for it, which lie between others."""
    small = np.abs(duty) < _LEAST_DUTY
    if small.all():
        return np.zeros(len(duty)), small
    rows = np.arange(len(duty), dtype=float)
    current = np.interp(rows, rows[~small], bus[~small] / duty[~small])
    return current, small


def _around(rows: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The rows and their neighbours: a drive that is being switched is neither on nor off."""
    return np.asarray(np.convolve(rows, np.ones(3), mode="same") > 0.5)
