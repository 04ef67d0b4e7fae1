"""Hysteresis: an elastic element that slips, beside the bristle or in place of a part of it (seals, cables,
belts; contacts that bend without creep before they slide)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from idtool.effects.base import FEWEST_REVERSALS, CForm, Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import LEVEL_TORQUE, TORQUE
from idtool.model.jit import jit
from idtool.model.motion import Array, Motion
from idtool.model.row import Row, row_of

#: The travel over which the element yields is looked for between these shares of the stroke.
_REACHES = (0.005, 0.015, 0.04, 0.1, 0.25)
#: Share of the friction level that a part of it carries where a refit starts.
_PART = 0.4
#: ... and the most: what a level of sliding that is told a little too low leaves of it.
_MOST = 1.2
#: It is told as an element of its own where the rest of the friction is so many times what it carries.
_OWN = 2.0
#: An element that yields over more of the stroke than this is a spring that hardly ever slips.
_LONGEST = 0.4


@jit()
def at(row: Row, n: Array, memory: Array, total: Array) -> None:
    """A Maxwell-slip element; memory: its stretch over that at which it yields, and where it was."""
    strength, reach, of_friction = n[0], n[1], n[2]
    if row.first:
        memory[0] = row.start
    else:
        memory[0] = min(max(memory[0] + (row.position - memory[1]) / reach, -1.0), 1.0)
    memory[1] = row.position
    total[TORQUE] += strength * memory[0]
    total[LEVEL_TORQUE] -= strength * of_friction


@jit()
def over(rows: Row, n: Array, memory: Array, total: Array) -> None:
    for k in range(len(rows.position)):
        at(row_of(rows, k), n, memory, total[:, k])


@final
@dataclass(frozen=True)
class Hysteresis(Effect):
    """An element of its own, or (`of_friction`) one that carries a part of the friction level, which the
    bristle then does not: the same torque, told otherwise. A contact that does not creep before it slides
    (elasto-plastic, Dupont et al. 2002) is mostly the second, which a search finds from where the bristle
    carries everything.
    """

    of_friction: bool = False

    name = "hysteresis"
    title = "Hysteresis"
    follows = ("position",)
    formula = "k (q - xi), where xi follows so that the torque never exceeds the yield torque"
    reveals = "nested reversals: small strokes inside large ones"
    is_lag = True
    after_reversal = True
    look_alikes = ("position_stiffness", "backlash")
    citation = "Al-Bender et al. 2005 (Maxwell slip); Iwan 1966"
    parameters = (
        EffectParameter("stiffness", "stiffness", "stiffness k of the element", 0.0),
        EffectParameter("yield", "torque", "torque at which it slips", 0.0),
        EffectParameter(
            "of_friction", "number", "1: a part of the friction levels, not beside them", 0.0, 1.0, True
        ),
    )
    coordinates = (
        Coordinate("yield", lower=0.0),
        Coordinate("log_reach", null=-2.0, lower=-16.0, upper=4.0, increment=1e-5),
    )
    memory = 2
    free_start = True

    at = staticmethod(at)
    over = staticmethod(over)

    def numbers(self, values: Values) -> tuple[float, ...]:
        return values["yield"], math.exp(values["log_reach"]), values.get("of_friction", 0.0)

    def acts_on(self, values: Values) -> tuple[int, ...]:
        return (TORQUE, LEVEL_TORQUE) if values.get("of_friction") else (TORQUE,)

    def in_c(self, values: Values) -> CForm:
        code = """
            if (row->first) memory[0] = 0.0f;
            else memory[0] = clamp(memory[0] + (row->position - memory[1]) * (1.0f / reach), -1.0f, 1.0f);
            memory[1] = row->position;
            sum->torque += yield * memory[0];
        """
        if values.get("of_friction"):
            code += "sum->level_torque -= yield;\n"
        return CForm(code, {**values, "reach": math.exp(values["log_reach"])})

    def constants(self, motion: Motion) -> dict[str, float]:
        return {"of_friction": 1.0} if self.of_friction else {}

    def form_of(self, values: Values) -> Effect:
        return Hysteresis(bool(values.get("of_friction")))

    def forms(self, motion: Motion) -> tuple[Effect, ...]:
        return () if self.of_friction else (Hysteresis(of_friction=True),)

    def plainer(self, values: Values, model: Values) -> tuple[Effect, dict[str, float]] | None:
        left = {name: model[name] - values["yield"] for name in ("coulomb", "static") if name in model}
        if not self.of_friction or any(level < _OWN * values["yield"] for level in left.values()):
            return None
        return Hysteresis(), left

    def active(self, motion: Motion) -> tuple[Coordinate, ...]:
        longest = math.log(max(_LONGEST * float(np.ptp(motion.position)), 1e-6))
        strength, reach = self.coordinates
        return strength, replace(reach, upper=longest)

    def starts(self, motion: Motion) -> list[dict[str, float]]:
        stroke = float(np.ptp(motion.position))
        return [{"log_reach": math.log(share * stroke)} for share in _REACHES]

    def untestable(self, motion: Motion) -> str | None:
        if motion.reversals < FEWEST_REVERSALS:
            return "the axis hardly ever turned round: log small strokes inside large ones"
        return None

    def implausible(self, values: Values, model: Values) -> str | None:
        level = model.get("coulomb", math.inf)
        if self.of_friction:
            return "it would be more than the friction" if values["yield"] > _MOST * level else None
        if values["yield"] > level:
            return "it would carry more than the friction level: it would be the friction, by another name"
        return None

    def also_from(self, values: Values, model: Values) -> list[dict[str, float]]:
        return [{**values, "yield": _PART * model["coulomb"]}] if self.of_friction else []

    def to_parameters(self, values: Values) -> dict[str, float]:
        found = {"stiffness": values["yield"] * math.exp(-values["log_reach"]), "yield": values["yield"]}
        return found | ({"of_friction": values["of_friction"]} if values.get("of_friction") else {})

    def to_values(self, parameters: Values) -> dict[str, float]:
        reach = parameters["yield"] / max(parameters["stiffness"], 1e-300)
        kept = {name: value for name, value in parameters.items() if name != "stiffness"}
        return kept | {"log_reach": math.log(max(reach, 1e-300))}
