"""Torque-constant saturation: the motor gives less torque per ampere at high current."""

from __future__ import annotations

from typing import final

from idtool.effects.base import CForm, Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import SATURATION
from idtool.model.jit import jit
from idtool.model.motion import Array
from idtool.model.row import Row


@jit()
def at(row: Row, n: Array, memory: Array, total: Array) -> None:
    total[SATURATION] += n[0] / row.torque_constant


@final
class TorqueConstantSaturation(Effect):
    name = "torque_constant_saturation"
    title = "Torque-constant saturation"
    follows = ("load",)
    formula = "torque = K i (1 - kappa |i|)"
    reveals = "high payloads"
    look_alikes = ("load_dependent_friction", "drive_backdrive")
    citation = "Hendershot & Miller 2010, Design of Brushless Permanent-Magnet Machines"
    needs = ("torque_constant",)
    parameters = (EffectParameter("kappa", "per_current", "relative loss of torque per ampere", lower=0.0),)
    coordinates = (Coordinate("kappa", lower=-0.5, upper=0.5, increment=1e-4),)

    at = staticmethod(at)

    def numbers(self, values: Values) -> tuple[float, ...]:
        return (values["kappa"],)

    def in_c(self, values: Values) -> CForm:
        return CForm("sum->saturation += kappa / row->torque_constant;", values)
