"""Load-dependent friction: the friction level grows with the load that the axis carries."""

from __future__ import annotations

from typing import final

import numpy as np

from idtool.effects.base import CForm, Coordinate, Effect, EffectParameter, Values, of_one_load
from idtool.model.contribution import LEVEL_TORQUE, STATIC_CHANGE
from idtool.model.jit import jit
from idtool.model.motion import Array, Motion
from idtool.model.row import Row


@jit()
def at(row: Row, n: Array, memory: Array, total: Array) -> None:
    size = np.abs(row.load)
    total[LEVEL_TORQUE] += n[0] * size
    if len(n) > 1:
        total[STATIC_CHANGE] += size / n[1]


@final
class LoadDependentFriction(Effect):
    name = "load_dependent_friction"
    title = "Load-dependent friction"
    follows = ("load",)
    formula = "g(w) + mu |tau_load|, and stiction that doubles at some load"
    reveals = "three or more payloads, both directions"
    look_alikes = ("drive_backdrive", "torque_constant_saturation")
    citation = "Bittencourt & Gunnarsson 2012; Duclusaud et al. 2025 (BAM, models M3 and M4)"
    needs = ("load",)
    parameters = (
        EffectParameter("mu", "number", "friction per load torque", 0.0, 1.0),
        # BAM's M4: what a load adds fades with the speed; found from the motion (`idtool.verbs.fit_motion`)
        EffectParameter("doubling_load", "torque", "load that doubles the stiction", 0.0, optional=True),
    )
    coordinates = (Coordinate("mu", upper=1.0, lower=-0.5, increment=1e-3),)

    at = staticmethod(at)

    def numbers(self, values: Values) -> tuple[float, ...]:
        return tuple(values[name] for name in ("mu", "doubling_load") if name in values)

    def in_c(self, values: Values) -> CForm:
        code = "sum->level_torque += mu * fabsf(row->load);"
        if "doubling_load" not in values:
            return CForm(code, values)
        code += "\nsum->static_change += per_load * fabsf(row->load);"
        return CForm(code, {"mu": values["mu"], "per_load": 1.0 / values["doubling_load"]})

    def untestable(self, motion: Motion) -> str | None:
        return of_one_load(motion)
