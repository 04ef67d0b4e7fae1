"""Hysteresis: one more elastic element that slips (seals, cables, belts)."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import final

import numba
import numpy as np
from numpy.typing import NDArray

from idtool.effects.base import CForm, Coordinate, Effect, EffectParameter, Past, Values
from idtool.model.contribution import Contribution
from idtool.model.motion import Array, Motion

#: The travel over which the element yields is looked for between these shares of the stroke.
_REACHES = (0.005, 0.015, 0.04, 0.1, 0.25)
#: An element that yields over more of the stroke than this is a spring that hardly ever slips.
_LONGEST = 0.4


@numba.njit(cache=True)
def stretched(stretch: float, travel: float, reach: float) -> float:
    """Stretch after a travel, in units of the stretch `reach` at which the element yields."""
    return min(max(stretch + travel / reach, -1.0), 1.0)


@numba.njit(cache=True)
def _stretch(
    position: Array, first: NDArray[np.bool_], start: Array, reach: float, memory: Array, out: Array
) -> None:
    """Stretch of a Maxwell-slip element in units of the stretch at which it yields."""
    stretch, last = memory[0], memory[1]
    begun = 0
    for k in range(position.shape[0]):
        if first[k]:
            stretch = start[begun]
            begun += 1
        else:
            stretch = stretched(stretch, position[k] - last, reach)
        last = position[k]
        out[k] = stretch
    memory[0], memory[1] = stretch, last


@final
class Hysteresis(Effect):
    name = "hysteresis"
    title = "Hysteresis"
    follows = ("position",)
    formula = "k (q - xi), where xi follows so that the torque never exceeds the yield torque"
    reveals = "nested reversals: small strokes inside large ones"
    is_lag = True
    after_reversal = True
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
    memory = 2
    free_start = True

    def contribute(self, motion: Motion, values: Values) -> Contribution:
        return self.resume(motion, values, Past.none(motion, self.memory))

    def resume(self, motion: Motion, values: Values, past: Past) -> Contribution:
        stretch = np.empty(len(motion))
        reach = math.exp(values["log_reach"])
        _stretch(motion.position, past.first, past.start, reach, past.memory, stretch)
        return Contribution(torque=values["yield"] * stretch)

    def in_c(self, values: Values) -> CForm:
        code = """
            if (row->first) memory[0] = 0.0f;
            else memory[0] = clamp(memory[0] + (row->position - memory[1]) * (1.0f / reach), -1.0f, 1.0f);
            memory[1] = row->position;
            sum->torque += yield * memory[0];
        """
        return CForm(code, {**values, "reach": math.exp(values["log_reach"])})

    def active(self, motion: Motion) -> tuple[Coordinate, ...]:
        longest = math.log(max(_LONGEST * float(np.ptp(motion.position)), 1e-6))
        strength, reach = self.coordinates
        return strength, replace(reach, upper=longest)

    def starts(self, motion: Motion) -> list[dict[str, float]]:
        stroke = float(np.ptp(motion.position))
        return [{"log_reach": math.log(share * stroke)} for share in _REACHES]

    def untestable(self, motion: Motion) -> str | None:
        turns = np.sign(motion.velocity[1:]) * np.sign(motion.velocity[:-1]) < 0
        if int(np.sum(turns & ~motion.first[1:])) < 4:
            return "the axis hardly ever turned round: log small strokes inside large ones"
        return None

    def implausible(self, values: Values, model: Values) -> str | None:
        if values["yield"] > model.get("coulomb", math.inf):
            return "it would carry more than the friction level: it would be the friction, by another name"
        return None

    def to_parameters(self, values: Values) -> dict[str, float]:
        return {"stiffness": values["yield"] * math.exp(-values["log_reach"]), "yield": values["yield"]}

    def to_values(self, parameters: Values) -> dict[str, float]:
        reach = parameters["yield"] / max(parameters["stiffness"], 1e-300)
        return {"yield": parameters["yield"], "log_reach": math.log(max(reach, 1e-300))}
