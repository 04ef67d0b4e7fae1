"""Transport delay: position and velocity are reported later than the current."""

from __future__ import annotations

from typing import final

import numpy as np

from idtool.effects.base import CForm, Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import DELAY
from idtool.model.jit import jit
from idtool.model.motion import Array, Motion
from idtool.model.row import Row

#: The latest that a motion is reported, s: five turns of a slow bus, or a topic of another computer.
_MOST_S = 0.1
#: Delays from which a search starts, s: the torque is far from linear in a long one.
_TRIED_S = (0.002, 0.006, 0.015, 0.035, 0.07)

#: Share of the steps between samples that are of the fastest log.
_FASTEST = 0.05


@jit()
def at(row: Row, n: Array, memory: Array, total: Array) -> None:
    total[DELAY] += n[0]


@final
class TransportDelay(Effect):
    name = "transport_delay"
    title = "Transport delay"
    follows = ("acceleration",)
    formula = "torque of time t computed from the position and velocity reported at t + d"
    reveals = "sines of rising frequency"
    is_lag = True
    look_alikes = ("inertia", "compliance")
    citation = "Ljung 1999, chapter 4"
    parameters = (
        EffectParameter("delay", "time", "how much later the motion is reported", -_MOST_S, _MOST_S),
    )
    coordinates = (Coordinate("delay", lower=-_MOST_S, upper=_MOST_S, increment=1e-4),)

    at = staticmethod(at)

    def numbers(self, values: Values) -> tuple[float, ...]:
        return (values["delay"],)

    def sizes(self, motion: Motion) -> list[dict[str, float]]:
        return [{"delay": sign * size} for size in _TRIED_S for sign in (-1.0, 1.0)]

    def of_the_readings(self, values: Values, motion: Motion) -> str | None:
        # logs may be of different rates; the fastest tells
        delay, period = abs(values["delay"]), float(np.quantile(motion.step[~motion.first], _FASTEST))
        if delay >= period:
            return None
        return (
            f"torque and motion are {1e3 * delay:.2g} ms apart, less than the {1e3 * period:.3g} ms between "
            "samples: that is when they were read, not a delay of the axis."
        )

    def in_c(self, values: Values) -> CForm:
        return CForm("sum->delay += delay;", values, looks_back_s=abs(values["delay"]))
