"""Break-away after rest: the stiction rises with the time at rest."""

from __future__ import annotations

import math
from typing import final

import numpy as np

from idtool.effects.base import CForm, Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import STATIC_CHANGE
from idtool.model.jit import jit
from idtool.model.motion import Array, Motion
from idtool.model.row import Row, row_of

#: The axis rests where it is slower than this share of its speed while it moves.
_REST = 0.02
#: Sliding wears the memory off over a travel that is looked for between these shares of the stroke.
_WEARS = (0.002, 0.01, 0.05)
#: A turn of the motion is no rest; and what builds up at rest needs a rest of this long to show.
_SHORTEST_S, _LONG_S = 0.1, 1.0
_TIME_CONSTANTS = (0.4, 1.5, 6.0)


@jit(inline="always")
def at(row: Row, n: Array, memory: Array, total: Array) -> None:
    """Memory: how far the contact has aged, towards 1 at rest, towards 0 when sliding."""
    gain, time_constant, wear, rest_speed = n[0], n[1], n[2], n[3]
    speed = abs(row.velocity)
    if row.first:
        memory[0] = 0.5 * (1.0 + row.start)
    elif speed < rest_speed:
        memory[0] -= (1.0 - memory[0]) * math.expm1(-row.step / time_constant)
    else:
        memory[0] *= math.exp(-row.step * speed / wear)
    total[STATIC_CHANGE] += gain * memory[0]


@jit()
def over(rows: Row, n: Array, memory: Array, total: Array) -> None:
    for k in range(len(rows.position)):
        at(row_of(rows, k), n, memory, total[:, k])


@final
class BreakawayDwell(Effect):
    name = "breakaway_dwell"
    title = "Break-away after rest"
    follows = ("time",)
    formula = "stiction times 1 + gain (1 - exp(-rest / time constant))"
    reveals = "starts after pauses of different length"
    look_alikes = ("stribeck_shape", "thermal_drift")
    citation = "Rabinowicz 1958; Armstrong-Helouvry et al. 1994"
    parameters = (
        EffectParameter("gain", "number", "relative rise of the stiction after a long rest", 0.0),
        EffectParameter("time_constant", "time", "time constant of the rise", 0.0),
        EffectParameter("rest_speed", "velocity", "below this speed the axis rests", 0.0),
        EffectParameter("wear", "position", "travel that wears the rise off", 0.0),
    )
    coordinates = (
        Coordinate("gain", lower=0.0, upper=20.0, increment=1e-3),
        Coordinate("log_time_constant", null=1.0, lower=-4.0, upper=4.0, increment=1e-3),
        Coordinate("log_wear", null=-3.0, lower=-10.0, upper=2.0, increment=1e-3),
    )
    memory = 1
    free_start = True

    at = staticmethod(at)
    over = staticmethod(over)

    def numbers(self, values: Values) -> tuple[float, ...]:
        times = math.exp(values["log_time_constant"]), math.exp(values["log_wear"])
        return values["gain"], *times, values["rest_speed"]

    def acts_on(self, values: Values) -> tuple[int, ...]:
        return (STATIC_CHANGE,)

    def in_c(self, values: Values) -> CForm:
        code = """
            const float speed = fabsf(row->velocity);
            if (row->first) memory[0] = 0.5f;
            else if (speed < rest_speed)
                memory[0] += (1.0f - memory[0]) * (1.0f - decay(row->step * (1.0f / time_constant)));
            else memory[0] *= decay(row->step * speed * (1.0f / wear));
            sum->static_change += gain * memory[0];
        """
        return CForm(code, {**values, **self.to_parameters(values)})

    def constants(self, motion: Motion) -> dict[str, float]:
        speed = np.abs(motion.velocity)
        moving = speed[speed > 0.1 * float(np.max(speed))]
        return {"rest_speed": _REST * float(np.median(moving)) if len(moving) else 0.0}

    def starts(self, motion: Motion) -> list[dict[str, float]]:
        stroke = float(np.ptp(motion.position))
        return [
            {"log_time_constant": math.log(constant), "log_wear": math.log(share * stroke)}
            for constant in _TIME_CONSTANTS
            for share in _WEARS
        ]

    def untestable(self, motion: Motion) -> str | None:
        rests = self._rests(motion)
        rests = rests[rests >= _SHORTEST_S]
        if len(rests) < 4 or float(np.max(rests)) < max(4.0 * float(np.min(rests)), _LONG_S):
            return 'no trial holds short and long pauses, as the recipe "pauses" makes them'
        return None

    def _rests(self, motion: Motion) -> Array:
        """Length of every rest between two motions of a trial, s."""
        resting = np.abs(motion.velocity) < self.constants(motion)["rest_speed"]
        clock = np.cumsum(motion.step)
        begins = resting & ~np.concatenate([[False], resting[:-1]])
        last = np.concatenate([motion.first[1:], [True]])
        ends = resting & ~last & ~np.concatenate([resting[1:], [False]])
        stops = np.flatnonzero(ends)
        starts = np.flatnonzero(begins)
        if not len(stops):
            return np.empty(0)
        before = starts[np.searchsorted(starts, stops, side="right") - 1]
        return np.asarray((clock[stops] - clock[before])[~motion.first[before]])
