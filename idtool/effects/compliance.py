"""Compliance: part of the inertia hangs on a spring and damper and swings behind the motor."""

from __future__ import annotations

import math
from typing import final

import numpy as np

from idtool.effects.base import CForm, Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import TORQUE
from idtool.model.jit import jit
from idtool.model.motion import Array, Motion
from idtool.model.row import Row, row_of

#: A lightly damped resonance is narrow: a search that starts beside it does not find it.
_FREQUENCIES_HZ = (1.2, 1.7, 2.3, 3.1, 4.0, 5.0, 6.2, 7.7, 9.5, 12.0, 15.0, 20.0)
_START_RATIOS = (0.03, 0.15)
#: A step longer than this part of a period is done in several; one that is as long but for rounding is not,
#: or the last digit of the clock would decide.
_SUBSTEP_RAD = 0.2
_ROUNDING = 1e-3


@jit()
def swing(
    twist: float, rate: float, mean: float, step: float, omega: float, ratio: float
) -> tuple[float, float]:
    """Twist e = load - motor and its rate after a step at a mean acceleration of the motor.

    e'' + 2 ratio omega e' + omega^2 e = -mean, by the mid-point rule, which neither damps nor excites.
    """
    parts = math.ceil(omega * step / _SUBSTEP_RAD - _ROUNDING)
    h = step / max(parts, 1)
    for _ in range(parts):
        pull = 2.0 * ratio * omega + 0.5 * h * omega * omega
        drive = -mean - omega * omega * twist
        middle = (rate + 0.5 * h * drive) / (1.0 + 0.5 * h * pull)
        twist += h * middle
        rate = 2.0 * middle - rate
    return twist, rate


@jit()
def at(row: Row, n: Array, memory: Array, total: Array) -> None:
    """Memory: twist and its rate, and the acceleration before, which is held at its mean over a step."""
    load_inertia, omega, ratio = n[0], n[1], n[2]
    if row.first:
        # it was pulled along before the first row: the twist that this acceleration would hold
        memory[0], memory[1] = -row.acceleration / (omega * omega), 0.0
    else:
        mean = 0.5 * (row.acceleration + memory[2])
        memory[0], memory[1] = swing(memory[0], memory[1], mean, row.step, omega, ratio)
    memory[2] = row.acceleration
    pull = -omega * omega * memory[0] - 2.0 * ratio * omega * memory[1]
    total[TORQUE] += load_inertia * (pull - row.acceleration)


@jit()
def over(rows: Row, n: Array, memory: Array, total: Array) -> None:
    for k in range(len(rows.position)):
        at(row_of(rows, k), n, memory, total[:, k])


@final
class Compliance(Effect):
    """Comes on top of the inertia, which carries the whole of what moves slowly."""

    name = "compliance"
    title = "Compliance"
    follows = ("acceleration",)
    formula = "J_load (a_load - a), J_load a_load = k (q - q_load) + c (w - w_load)"
    reveals = "sines of rising frequency, beyond the resonance; the same with another payload"
    is_lag = True
    look_alikes = ("inertia", "transport_delay")
    citation = "Spong 1987"
    parameters = (
        EffectParameter("stiffness", "stiffness", "stiffness k of the transmission", 0.0),
        EffectParameter("damping", "damping", "damping c of the transmission", 0.0),
        EffectParameter("load_inertia", "inertia", "inertia behind the spring", 0.0),
    )
    coordinates = (
        Coordinate("load_inertia", lower=0.0),
        Coordinate("log_omega", null=3.0, lower=0.0, upper=7.0, increment=1e-3),
        Coordinate("damping_ratio", null=_START_RATIOS[-1], lower=0.002, upper=3.0, increment=1e-3),
    )
    memory = 3

    at = staticmethod(at)
    over = staticmethod(over)

    def numbers(self, values: Values) -> tuple[float, ...]:
        return values["load_inertia"], math.exp(values["log_omega"]), values["damping_ratio"]

    def acts_on(self, values: Values) -> tuple[int, ...]:
        return (TORQUE,)

    def in_c(self, values: Values) -> CForm:
        code = """
            /* memory: twist of the spring times omega^2, its rate, the last acceleration; mid-point rule */
            const float a = row->acceleration;
            if (row->first) {
                memory[0] = -a;
                memory[1] = 0.0f;
            } else {
                const float mean = half(a + memory[2]);
                const float parts = omega * (1.0f / substep) * row->step - rounding;
                uint16_t count = is_negative(parts) ? 0 : (uint16_t)(1u + (uint16_t)parts);
                float h = row->step;
                if (count == 2) h = half(h);
                else if (count > 2) h *= inverse((float)count);
                const float half_h = half(h);
                const float stiff = omega_2 * h;
                const float share = inverse(1.0f + half_h * (drag + half(stiff)));
                for (; count > 0; count--) {
                    const float middle = (memory[1] - half_h * (mean + memory[0])) * share;
                    memory[0] += stiff * middle;
                    memory[1] = middle + middle - memory[1];
                }
            }
            memory[2] = a;
            sum->torque -= load_inertia * (memory[0] + drag * memory[1] + a);
        """
        omega = math.exp(values["log_omega"])
        constants = {
            "omega": omega,
            "omega_2": omega * omega,
            "drag": 2.0 * values["damping_ratio"] * omega,
            "load_inertia": values["load_inertia"],
            "substep": _SUBSTEP_RAD,
            "rounding": _ROUNDING,
        }
        return CForm(code, constants)

    def starts(self, motion: Motion) -> list[dict[str, float]]:
        return [
            {"log_omega": math.log(2.0 * math.pi * frequency), "damping_ratio": ratio}
            for frequency in _FREQUENCIES_HZ
            for ratio in _START_RATIOS
        ]

    def untestable(self, motion: Motion) -> str | None:
        longest = float(np.max(np.bincount(motion.trial, motion.step))) if len(motion) else 0.0
        if longest < 1.0:
            return "every trial is shorter than a second: log sines of rising frequency"
        return None

    def implausible(self, values: Values, model: Values) -> str | None:
        whole = model.get("inertia.inertia")
        if whole is not None and values["load_inertia"] > whole:
            return "more inertia would hang on the spring than the axis has"
        return None

    def to_parameters(self, values: Values) -> dict[str, float]:
        omega, inertia = math.exp(values["log_omega"]), values["load_inertia"]
        return {
            "stiffness": inertia * omega**2,
            "damping": 2.0 * values["damping_ratio"] * omega * inertia,
            "load_inertia": inertia,
        }

    def to_values(self, parameters: Values) -> dict[str, float]:
        inertia = max(parameters["load_inertia"], 1e-300)
        omega = math.sqrt(max(parameters["stiffness"] / inertia, 1e-300))
        return {
            "load_inertia": parameters["load_inertia"],
            "log_omega": math.log(omega),
            "damping_ratio": parameters["damping"] / (2.0 * omega * inertia),
        }
