"""Position ripple: torque that repeats with the angle (gear mesh, pulley run-out, cogging)."""

from __future__ import annotations

import math
from typing import final

import numba
import numpy as np

from idtool.effects.base import CForm, Coordinate, Effect, EffectParameter, Values, Wave
from idtool.model.contribution import Contribution
from idtool.model.motion import Array, Motion

_HARMONICS = (1, 2)
#: Fewer periods than this over the stroke look like a stiffness, an offset or a friction slope.
_LEAST_PERIODS = 2.0


@numba.njit(cache=True)
def _harmonics(position: Array, cycles: float, strengths: Array, out: Array) -> None:
    """Sum of sines and cosines of multiples of an angle; the multiples follow from the first two."""
    for k in range(position.shape[0]):
        angle = cycles * position[k]
        sine, cosine = math.sin(angle), math.cos(angle)
        s, c = 0.0, 1.0
        total = 0.0
        for n in range(strengths.shape[0]):
            s, c = s * cosine + c * sine, c * cosine - s * sine
            total += strengths[n, 0] * s + strengths[n, 1] * c
        out[k] = total


@final
class PositionRipple(Effect):
    name = "position_ripple"
    title = "Position ripple"
    follows = ("position",)
    formula = "sum over k = 1, 2 of A_k sin(k n q + phi_k)"
    reveals = "a slow sweep over the whole stroke; its spectrum over the angle"
    look_alikes = ("position_stiffness", "position_dependent_friction", "external_periodic")
    citation = "Armstrong-Helouvry 1991; Villagran et al. 2009 (cogging)"
    parameters = (
        EffectParameter(
            "cycles",
            "spatial_frequency",
            "n, waves per turn: sin(n q); on a linear axis per metre: sin(2 pi n x)",
            0.0,
        ),
        EffectParameter("amplitude_1", "torque", "amplitude of the fundamental", 0.0),
        EffectParameter("phase_1", "phase", "phase of the fundamental", -math.pi, math.pi),
        EffectParameter("amplitude_2", "torque", "amplitude of the second harmonic", 0.0),
        EffectParameter("phase_2", "phase", "phase of the second harmonic", -math.pi, math.pi),
    )
    coordinates = (
        Coordinate("sin_1"),
        Coordinate("cos_1"),
        Coordinate("sin_2"),
        Coordinate("cos_2"),
        Coordinate("cycles", null=1.0, lower=0.0, increment=1e-3),
    )

    def contribute(self, motion: Motion, values: Values) -> Contribution:
        torque = np.empty(len(motion))
        strengths = np.array([[values[f"sin_{k}"], values[f"cos_{k}"]] for k in _HARMONICS])
        _harmonics(motion.position, values["cycles"], strengths, torque)
        return Contribution(torque=torque)

    def in_c(self, values: Values) -> CForm:
        code = """
            float s, c;
            sine_and_cosine(cycles * row->position, &s, &c);
            /* the double angle by s and c: sin 2x = 2 s c, cos 2x = 1 - 2 s s */
            sum->torque += s * (sin_1 + 2.0f * sin_2 * c - 2.0f * cos_2 * s) + cos_1 * c + cos_2;
        """
        return CForm(code, values)

    def starts(self, motion: Motion) -> list[dict[str, float]]:
        return [{"cycles": self.wave(motion).lowest}]

    def wave(self, motion: Motion) -> Wave:
        stroke = max(float(np.ptp(motion.position)), 1e-12)
        moving = np.abs(np.diff(motion.position))[~motion.first[1:]]
        # at the slowest tenth of the moving rows a period must hold at least six samples
        step = float(np.quantile(moving[moving > 0], 0.1)) if np.any(moving > 0) else stroke
        lowest = _LEAST_PERIODS * 2.0 * math.pi / stroke
        return Wave("cycles", motion.position, lowest, 2.0 * math.pi / (6.0 * step))

    def untestable(self, motion: Motion) -> str | None:
        wave = self.wave(motion)
        return (
            None if wave.highest > wave.lowest else "the sampling is too coarse over the angle: move slower"
        )

    def to_parameters(self, values: Values) -> dict[str, float]:
        result = {"cycles": values["cycles"]}
        for k in _HARMONICS:
            result[f"amplitude_{k}"] = math.hypot(values[f"sin_{k}"], values[f"cos_{k}"])
            result[f"phase_{k}"] = math.atan2(values[f"cos_{k}"], values[f"sin_{k}"])
        return result

    def to_values(self, parameters: Values) -> dict[str, float]:
        result = {"cycles": parameters["cycles"]}
        for k in _HARMONICS:
            amplitude, phase = parameters[f"amplitude_{k}"], parameters[f"phase_{k}"]
            result[f"sin_{k}"] = amplitude * math.cos(phase)
            result[f"cos_{k}"] = amplitude * math.sin(phase)
        return result
