"""Position ripple: torque that repeats with the angle (gear mesh, pulley run-out, cogging)."""

from __future__ import annotations

import math
from typing import final

import numpy as np

from idtool.effects.base import CForm, Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import Contribution
from idtool.model.motion import Array, Motion

_HARMONICS = (1, 2)
#: Fewer periods than this over the stroke look like a stiffness, an offset or a friction slope.
_LEAST_PERIODS = 2.0
_MOST_STARTS = 1200


@final
class PositionRipple(Effect):
    name = "position_ripple"
    title = "Position ripple"
    formula = "sum over k = 1, 2 of A_k sin(k n q + phi_k)"
    reveals = "a slow sweep over the whole stroke; its spectrum over the angle"
    look_alikes = ("position_stiffness", "position_dependent_friction", "external_periodic")
    citation = "Armstrong-Helouvry 1991; Villagran et al. 2009 (cogging)"
    parameters = (
        EffectParameter(
            "cycles", "per_position", "spatial frequency n, radians of ripple per unit of travel", 0.0
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
        torque: Array | float = 0.0
        for k in _HARMONICS:
            angle = k * values["cycles"] * motion.position
            torque = torque + values[f"sin_{k}"] * np.sin(angle) + values[f"cos_{k}"] * np.cos(angle)
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
        """Spatial frequencies half a resolution cell apart, up to what the sampling shows."""
        stroke = float(np.ptp(motion.position))
        lowest = _LEAST_PERIODS * 2.0 * math.pi / stroke
        moving = np.abs(np.diff(motion.position))[~motion.first[1:]]
        # at the slowest tenth of the moving rows a period must hold at least six samples
        step = float(np.quantile(moving[moving > 0], 0.1)) if np.any(moving > 0) else stroke
        highest = 2.0 * math.pi / (6.0 * step)
        spacing = math.pi / stroke
        count = int(min(max((highest - lowest) / spacing, 0), _MOST_STARTS))
        return [{"cycles": lowest + k * spacing} for k in range(count)]

    def wave(self, motion: Motion) -> Array:
        return motion.position

    def untestable(self, motion: Motion) -> str | None:
        return None if self.starts(motion) else "the sampling is too coarse over the angle: move slower"

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
