"""Drive and backdrive: load-dependent friction that differs between raising and lowering."""

from __future__ import annotations

from typing import final

import numpy as np

from idtool.effects.base import CForm, Coordinate, Effect, EffectParameter, Values, of_one_load
from idtool.model.contribution import LEVEL_TORQUE
from idtool.model.jit import jit
from idtool.model.motion import Array, Motion
from idtool.model.row import Row


@jit()
def at(row: Row, n: Array, memory: Array, total: Array) -> None:
    mu_drive, mu_backdrive = n[0], n[1]
    mu = mu_backdrive + (mu_drive - mu_backdrive) * (row.velocity * row.load > 0.0)
    total[LEVEL_TORQUE] += mu * np.abs(row.load)


@final
class DriveBackdrive(Effect):
    name = "drive_backdrive"
    title = "Drive and backdrive"
    follows = ("load",)
    formula = "g(w) + mu |tau_load|, with one mu raising the load and another lowering it"
    reveals = "raise against lower at three or more payloads"
    look_alikes = ("load_dependent_friction", "torque_constant_saturation")
    absorbs = ("load_dependent_friction",)
    told_by_turns = True  # sliding either way is as well that of friction under load and of another gravity
    citation = "Duclusaud et al. 2025 (BAM, model M5); Giberti et al. 2018 on worm and harmonic gears"
    needs = ("load",)
    parameters = (
        EffectParameter("mu_drive", "number", "friction per load torque while raising", 0.0, 1.0),
        EffectParameter("mu_backdrive", "number", "friction per load torque while lowering", 0.0, 1.0),
    )
    coordinates = (
        Coordinate("mu_drive", lower=-0.5, upper=1.0, increment=1e-3),
        Coordinate("mu_backdrive", lower=-0.5, upper=1.0, increment=1e-3),
    )

    at = staticmethod(at)

    def numbers(self, values: Values) -> tuple[float, ...]:
        return values["mu_drive"], values["mu_backdrive"]

    def in_c(self, values: Values) -> CForm:
        code = """
            const float mu = above(row->velocity * row->load, 0.0f) ? mu_drive : mu_backdrive;
            sum->level_torque += mu * fabsf(row->load);
        """
        return CForm(code, values)

    def untestable(self, motion: Motion) -> str | None:
        return of_one_load(motion)
