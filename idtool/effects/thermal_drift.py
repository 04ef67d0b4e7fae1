"""Thermal drift: friction falls as the axis warms up."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import final

import numpy as np

from idtool.effects.base import CForm, Coordinate, Effect, EffectParameter, Values, both_ways, varies
from idtool.model.contribution import LEVEL_CHANGE, VISCOUS_CHANGE
from idtool.model.jit import jit
from idtool.model.motion import Array, Motion
from idtool.model.row import Row

#: A sensor whose reading spans less than this says nothing about temperature.
LEAST_SPAN_K = 1.0
#: Without a sensor friction is seen often enough where so many parts of the run show it.
_PARTS = 4
_RUNS = "four trials or more or over motion both ways in each quarter of the run"


@jit()
def at(row: Row, n: Array, memory: Array, total: Array) -> None:
    rate, reference, warm_up, time_constant = n[0], n[1], n[2], n[3]
    by_clock = warm_up * np.expm1(-row.time / time_constant)
    change = np.expm1(by_clock - rate * np.nan_to_num(row.temperature - reference))
    total[LEVEL_CHANGE] += change
    total[VISCOUS_CHANGE] += change


@final
class ThermalDrift(Effect):
    """With a temperature column the change follows the temperature; without, a warm-up in run time."""

    name = "thermal_drift"
    title = "Thermal drift"
    follows = ("temperature", "time", "order")
    formula = "g(w) and sigma2 times exp(-b (T - T0)); without a sensor times exp(-d (1 - exp(-t / tau)))"
    reveals = "the same run cold and warm"
    look_alikes = ("load_dependent_friction",)
    citation = "Bittencourt & Gunnarsson 2012"
    parameters = (
        EffectParameter("rate", "per_temperature", "relative fall of friction per kelvin", optional=True),
        EffectParameter("reference", "temperature", "temperature T0 of the base values", optional=True),
        EffectParameter("warm_up", "number", "logarithm of cold over warm friction", optional=True),
        EffectParameter("time_constant", "time", "time constant of the warm-up", 0.0, optional=True),
    )
    coordinates = (
        Coordinate("rate", lower=-0.2, upper=0.2, increment=1e-4),
        Coordinate("warm_up", lower=-2.0, upper=2.0, increment=1e-3),
        # seconds to a day: a bound of so wide a range would be near whatever is short
        Coordinate("log_time_constant", math.log(300.0), math.log(5.0), math.log(1e5), increment=1e-4),
    )

    at = staticmethod(at)

    def numbers(self, values: Values) -> tuple[float, ...]:
        if "rate" in values:
            return values["rate"], values["reference"], 0.0, 1.0
        return 0.0, 0.0, values["warm_up"], math.exp(values["log_time_constant"])

    def in_c(self, values: Values) -> CForm:
        if "rate" in values:
            fall = "row->has_temperature ? rate * (row->temperature - reference) : 0.0f"
        else:
            fall = "warm_up * (1.0f - decay(row->time * (1.0f / time_constant)))"
        code = f"""
            const float fall = {fall};
            const float change = (fall < 0.0f ? 1.0f / decay(-fall) : decay(fall)) - 1.0f;
            sum->level_change += change;
            sum->viscous_change += change;
        """
        absent = {"reference": 0.0, "warm_up": 0.0, "time_constant": 1.0}
        return CForm(code, {**absent, **self.to_parameters(values)}, follows_temperature="rate" in values)

    def active(self, motion: Motion) -> tuple[Coordinate, ...]:
        return self.coordinates[:1] if varies(motion.temperature, LEAST_SPAN_K) else self.coordinates[1:]

    def constants(self, motion: Motion) -> dict[str, float]:
        if not varies(motion.temperature, LEAST_SPAN_K):
            return {}
        assert motion.temperature is not None
        return {"reference": round(float(np.mean(motion.temperature)), 1)}

    def starts(self, motion: Motion) -> list[dict[str, float]]:
        if varies(motion.temperature, LEAST_SPAN_K):
            return [{}]
        span = float(np.ptp(motion.time))
        return [{"log_time_constant": math.log(span * share)} for share in (0.05, 0.15, 0.5, 1.5)]

    def needed(self, parameters: Collection[str]) -> tuple[str, ...]:
        return ("temperature",) if "rate" in parameters else ()

    def untestable(self, motion: Motion) -> str | None:
        if motion.temperature is not None and not varies(motion.temperature, LEAST_SPAN_K):
            return "the temperature never changed by a kelvin: repeat the run cold and warm"
        if motion.temperature is None and (np.any(motion.clock) or not _shown_throughout(motion)):
            return f"needs a temperature column, or a clock that runs on over {_RUNS}"
        return None


def _shown_throughout(motion: Motion) -> bool:
    """Whether the run shows again and again how much friction there is: in trials enough, or in each part of
    it by motion both ways, whose torques differ by twice the friction whatever else changed meanwhile. One
    part may have been held out."""
    if motion.trials >= _PARTS:
        return True
    edges = np.linspace(motion.time.min(), motion.time.max(), _PARTS + 1)[1:-1]
    part = np.searchsorted(edges, motion.time)
    shown = [both_ways(motion.velocity[part == k]) for k in range(_PARTS) if np.any(part == k)]
    return len(shown) >= _PARTS - 1 and all(shown)
