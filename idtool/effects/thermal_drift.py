"""Thermal drift: friction falls as the axis warms up."""

from __future__ import annotations

from typing import final

import numpy as np

from idtool.effects.base import Coordinate, Effect, EffectParameter, Values, varies
from idtool.model.contribution import Contribution
from idtool.model.motion import Array, Motion

#: A sensor whose reading spans less than this says nothing about temperature.
LEAST_SPAN_K = 1.0


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
        Coordinate("time_constant", null=300.0, lower=5.0, upper=1e5, increment=1e-2),
    )

    def contribute(self, motion: Motion, values: Values) -> Contribution:
        exponent: Array | float = 0.0
        if "rate" in values and motion.temperature is not None:
            exponent = -values["rate"] * (motion.temperature - values["reference"])
        elif "warm_up" in values:
            exponent = -values["warm_up"] * -np.expm1(-motion.time / values["time_constant"])
        change = np.expm1(exponent) * np.ones(len(motion))
        return Contribution(level_change=change, viscous_change=change)

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
        return [{"time_constant": span * share} for share in (0.05, 0.15, 0.5, 1.5)]

    def untestable(self, motion: Motion) -> str | None:
        if motion.temperature is not None and not varies(motion.temperature, LEAST_SPAN_K):
            return "the temperature never changed by a kelvin: repeat the run cold and warm"
        run_on = motion.time[motion.starts]
        if motion.temperature is None and (motion.trials < 4 or np.any(np.diff(run_on) <= 0)):
            return "needs a temperature column, or a clock that runs on over four trials or more"
        return None
