"""Hysteresis: one more elastic element that slips (seals, cables, belts)."""

from __future__ import annotations

import math
from typing import final

import numba
import numpy as np
from numpy.typing import NDArray

from idtool.effects.base import Coordinate, Effect, EffectParameter, Past, Values
from idtool.model.contribution import Contribution
from idtool.model.motion import Array, Motion

#: The stretch at the start of a trial is unknown: the mean over these, until slipping has levelled them.
_UNKNOWN = (-0.8, -0.4, 0.0, 0.4, 0.8)
#: The travel over which the element yields is looked for between these shares of the stroke.
_REACHES = (0.02, 0.06, 0.15, 0.35)


@numba.njit(cache=True)
def _stretch(position: Array, first: NDArray[np.bool_], reach: float, memory: Array, out: Array) -> None:
    """Expected stretch of a Maxwell-slip element in units of the stretch at which it yields.

    The memory holds the stretches that different starts would have led to, and last the position.
    """
    count = memory.shape[0] - 1
    last = memory[count]
    for k in range(position.shape[0]):
        total = 0.0
        for j in range(count):
            if first[k]:
                memory[j] = _UNKNOWN[j]
            else:
                memory[j] = min(max(memory[j] + (position[k] - last) / reach, -1.0), 1.0)
            total += memory[j]
        last = position[k]
        out[k] = total / count
    memory[count] = last


@final
class Hysteresis(Effect):
    name = "hysteresis"
    title = "Hysteresis"
    formula = "k (q - xi), where xi follows so that the torque never exceeds the yield torque"
    reveals = "nested reversals: small strokes inside large ones"
    look_alikes = ("position_stiffness", "backlash")
    citation = "Al-Bender et al. 2005 (Maxwell slip); Iwan 1966"
    parameters = (
        EffectParameter("stiffness", "stiffness", "stiffness k of the element", 0.0),
        EffectParameter("yield", "torque", "torque at which it slips", 0.0),
    )
    coordinates = (
        Coordinate("yield", lower=0.0),
        Coordinate("log_reach", null=-2.0, lower=-16.0, upper=4.0, increment=1e-5),
    )
    memory = len(_UNKNOWN) + 1

    def contribute(self, motion: Motion, values: Values) -> Contribution:
        return self.resume(motion, values, Past.none(motion, self.memory))

    def resume(self, motion: Motion, values: Values, past: Past) -> Contribution:
        stretch = np.empty(len(motion))
        _stretch(motion.position, past.first, math.exp(values["log_reach"]), past.memory, stretch)
        return Contribution(torque=values["yield"] * stretch)

    def starts(self, motion: Motion) -> list[dict[str, float]]:
        stroke = float(np.ptp(motion.position))
        return [{"log_reach": math.log(share * stroke)} for share in _REACHES]

    def untestable(self, motion: Motion) -> str | None:
        turns = np.sign(motion.velocity[1:]) * np.sign(motion.velocity[:-1]) < 0
        if int(np.sum(turns & ~motion.first[1:])) < 4:
            return "the axis hardly ever turned round: log small strokes inside large ones"
        return None

    def to_parameters(self, values: Values) -> dict[str, float]:
        return {"stiffness": values["yield"] * math.exp(-values["log_reach"]), "yield": values["yield"]}

    def to_values(self, parameters: Values) -> dict[str, float]:
        reach = parameters["yield"] / max(parameters["stiffness"], 1e-300)
        return {"yield": parameters["yield"], "log_reach": math.log(max(reach, 1e-300))}
