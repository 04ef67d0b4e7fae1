"""Tilt misalignment: the recorded tilt is off by constant angles."""

from __future__ import annotations

from typing import final

import numpy as np

from idtool.effects.base import CForm, Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import TORQUE
from idtool.model.jit import jit
from idtool.model.motion import Array, Motion
from idtool.model.row import Row


@jit()
def at(row: Row, n: Array, memory: Array, total: Array) -> None:
    alpha, beta = n[0], n[1]
    true = np.cos(row.tilt_alpha + alpha) * np.cos(row.tilt_beta + beta)
    recorded = np.cos(row.tilt_alpha) * np.cos(row.tilt_beta)
    total[TORQUE] += row.load_upright * (true - recorded)


@final
class TiltMisalignment(Effect):
    name = "tilt_misalignment"
    title = "Tilt misalignment"
    follows = ("load",)
    formula = "tau_load at (alpha + d_alpha, beta + d_beta) instead of (alpha, beta)"
    reveals = "several tilts with a payload"
    look_alikes = ("torque_offset",)
    citation = "the paper's Eq. 5 (gravity over the tilt angles)"
    needs = ("load_upright", "tilt_alpha")
    parameters = (
        EffectParameter("alpha", "angle", "d_alpha", -0.2, 0.2),
        EffectParameter("beta", "angle", "d_beta", -0.2, 0.2),
    )
    coordinates = (
        Coordinate("alpha", lower=-0.2, upper=0.2, increment=1e-3),
        Coordinate("beta", lower=-0.2, upper=0.2, increment=1e-3),
    )

    at = staticmethod(at)

    def numbers(self, values: Values) -> tuple[float, ...]:
        return values["alpha"], values["beta"]

    def in_c(self, values: Values) -> CForm:
        code = """
            if (row->tilted) {
                float cosine_alpha, cosine_beta;
                sine_and_cosine(row->tilt_alpha + alpha, 0, &cosine_alpha);
                sine_and_cosine(row->tilt_beta + beta, 0, &cosine_beta);
                memory[0] = cosine_alpha * cosine_beta - row->gravity_factor;
            }
            sum->torque += row->load_upright * memory[0];
        """
        return CForm(code, values, keeps=1)

    def active(self, motion: Motion) -> tuple[Coordinate, ...]:
        """A tilt that stays at zero shows an error only in second order: leave that angle at zero."""
        moved = [motion.tilt_alpha, motion.tilt_beta]
        return tuple(
            coordinate
            for coordinate, angle in zip(self.coordinates, moved, strict=True)
            if angle is not None and float(np.max(np.abs(np.sin(angle)))) > 0.05
        )

    def constants(self, motion: Motion) -> dict[str, float]:
        varied = {coordinate.name for coordinate in self.active(motion)}
        return {c.name: 0.0 for c in self.coordinates if c.name not in varied}

    def untestable(self, motion: Motion) -> str | None:
        return None if self.active(motion) else "the axis was never tilted"
