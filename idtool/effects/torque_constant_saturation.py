"""Torque-constant saturation: the motor gives less torque per ampere at high current."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import final

from idtool.effects.base import CForm, Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import SATURATION
from idtool.model.jit import jit
from idtool.model.motion import Array, Motion
from idtool.model.row import Row


@jit()
def at(row: Row, n: Array, memory: Array, total: Array) -> None:
    if n[1] > 0.0:
        total[SATURATION] += n[0]
    else:
        total[SATURATION] += n[0] / row.torque_constant


@final
class TorqueConstantSaturation(Effect):
    """By the current where that and the torque constant are known; where a log holds a torque alone, which a
    drive computes from its current, by that torque."""

    name = "torque_constant_saturation"
    title = "Torque-constant saturation"
    follows = ("load",)
    formula = "torque = K i (1 - kappa |i|), or tau (1 - l |tau|) of a logged torque tau"
    reveals = "high payloads"
    look_alikes = ("load_dependent_friction", "drive_backdrive")
    citation = "Hendershot & Miller 2010, Design of Brushless Permanent-Magnet Machines"
    parameters = (
        EffectParameter("kappa", "per_current", "relative loss of torque per ampere", 0.0, optional=True),
        EffectParameter(
            "loss", "per_torque", "relative loss l per torque, of logs without a current", 0.0, optional=True
        ),
    )
    coordinates = (
        Coordinate("kappa", lower=-0.5, upper=0.5, increment=1e-4),
        Coordinate("loss", increment=1e-4),
    )

    at = staticmethod(at)

    def numbers(self, values: Values) -> tuple[float, ...]:
        return (values["loss"], 1.0) if "loss" in values else (values["kappa"], 0.0)

    def in_c(self, values: Values) -> CForm:
        per_torque = "loss" if "loss" in values else "kappa / row->torque_constant"
        return CForm(f"sum->saturation += {per_torque};", values)

    def active(self, motion: Motion) -> tuple[Coordinate, ...]:
        return self.coordinates[1:] if motion.torque_constant is None else self.coordinates[:1]

    def needed(self, parameters: Collection[str]) -> tuple[str, ...]:
        return ("torque_constant",) if "kappa" in parameters else ()

    def untestable(self, motion: Motion) -> str | None:
        if motion.of_voltage:
            return "needs the motor's current or torque, and these logs hold the voltage at it"
        return None


def per_torque(values: Values, torque_constant: float | None) -> float:
    """Relative loss of torque per torque, at values of the effect; 0 where that takes a constant that nobody
    knows."""
    if "loss" in values:
        return values["loss"]
    return values["kappa"] / (math.inf if torque_constant is None else torque_constant)
