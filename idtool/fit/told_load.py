"""Whether the load that was told can be the one that moved, and its motor one that exists.

A mass m on a lever l that pulls with m g l = G has m l^2 of the inertia J, so that l <= g J / G in whatever
unit both are told; and the torque constant says what voltage the motor makes of its own, or what current it
takes (`idtool.model.motor`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from idtool.errors import InputError
from idtool.fit.joint import JointFit
from idtool.log import Log
from idtool.model.motor import EXTRA_LOW_V, MOST_CURRENT_A, highest_back_emf
from idtool.model.units import STANDARD_GRAVITY, unit_text

#: A lever so many times as long as the inertia allows is worth a word, and is none: slow motion tells the
#: inertia least well, and units are off by 10 at least.
_LONG, _IMPOSSIBLE = 2.0, 10.0
#: Spikes apart.
_USUAL = 0.99
_REMEDY = "masses are in kg and levers in m: correct the one that is not"


def doubts(
    fit: JointFit, logs: Sequence[Log], *, lever: float, size: float, constant: float, load: float
) -> list[str]:
    """Sentences on a load that is hardly the one that moved.

    Args:
        fit: of the logs in their effort, A or V.
        logs: of the load.
        lever: as told, m.
        size: what the fit found for the load, A or V; per kilogram where the payload changes.
        constant: what makes torque of the effort, N m/A or N m/V (N/A, N/V).
        load: torque of the load at its most, N m (N).

    Raises:
        InputError: no axis has that lever, or no motor that constant.
    """
    recording = fit.model.recording
    file = ", ".join(recording.sources)
    said = []
    if recording.axis.kind == "rotary" and (longest := _longest_lever(fit, size)) < lever / _LONG:
        what = (
            f"a load on a lever of {lever:g} m would have more inertia than all that moves in these logs, "
            f"which allows {longest:.2g} m at most"
        )
        if longest < lever / _IMPOSSIBLE:
            raise InputError(what, file=file, remedy=_REMEDY)
        said.append(f"{what}: look whether it is in m.")
    if recording.axis.effort == "current":
        return said + _of_the_voltage(fit, logs, constant, file)
    drag = _at_most(fit, "viscous") + fit.values.get("bristle_damping", 0.0)
    if 0.0 < drag * MOST_CURRENT_A < load:
        held = f"{load:.3g} {unit_text('torque', recording.axis.kind)}"
        raise InputError(
            f"a motor that holds {held} takes {load / drag:.2g} A or more, by the back-EMF that it can have "
            "in these logs, which no drive of an axis gives",
            file=file,
            remedy=_REMEDY,
        )
    return said


def _of_the_voltage(fit: JointFit, logs: Sequence[Log], constant: float, file: str) -> list[str]:
    recording = fit.model.recording
    speed = float(np.quantile(np.abs(recording.motion.velocity), _USUAL))
    supplies = [column for log in logs if (column := log.column("supply_voltage")) is not None]
    supply = float(np.max(np.concatenate(supplies))) if supplies else None
    volts = constant * speed
    kind = recording.axis.kind
    what = (
        f"a motor of {constant:.3g} {unit_text('torque_constant', kind)} makes {volts:.3g} V of its own at "
        f"the {speed:.2g} {unit_text('velocity', kind)} of these logs"
    )
    if volts > highest_back_emf(supply):
        has = "no drive has" if supply is None else f"its supply of {supply:.3g} V has not"
        raise InputError(f"{what}, which {has}", file=file, remedy=_REMEDY)
    if supply is None and volts > EXTRA_LOW_V:
        return [f"{what}: with a supply of less, the mass is not in kg, or the lever not in m."]
    return []


def _longest_lever(fit: JointFit, size: float) -> float:
    """g J / G, the inertia as large as it can be, m."""
    motion = fit.model.recording.motion
    masses = 1.0
    if motion.payload is not None and np.ptp(motion.payload) > 0.0:  # `size` is per kilogram of it
        weight = motion.acceleration**2
        masses = float(weight @ motion.payload) / max(float(np.sum(weight)), 1e-300)
    inertia = _at_most(fit, "inertia.inertia") + masses * _at_most(fit, "inertia.per_payload")
    return STANDARD_GRAVITY * inertia / max(size * masses, 1e-300)


def _at_most(fit: JointFit, name: str) -> float:
    """Upper end of the 95 % interval; infinite for what these logs do not tell."""
    if name not in fit.values:
        return math.inf if name == "inertia.inertia" else 0.0
    i = fit.model.names.index(name)
    if not fit.covariance[i, i] > 0.0:
        return math.inf
    return max(0.0, fit.values[name]) + float(fit.quantile[i]) * math.sqrt(float(fit.covariance[i, i]))
