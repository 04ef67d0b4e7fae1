"""Hysteresis: elastic elements that slip, beside the bristle or in place of a part of it (seals, cables,
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


@jit(inline="always")
def at(row: Row, n: Array, memory: Array, total: Array) -> None:
    """Maxwell-slip elements; memory: where they were, and each one's stretch over that at which it yields."""
    for k in range(1, len(n), 2):
        strength, reach, stretch = n[k], n[k + 1], 1 + k // 2
        if row.first:
            memory[stretch] = row.start
        else:
            memory[stretch] = min(max(memory[stretch] + (row.position - memory[0]) / reach, -1.0), 1.0)
        total[TORQUE] += strength * memory[stretch]
        total[LEVEL_TORQUE] -= strength * n[0]
    memory[0] = row.position


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
    carries everything. Two elements follow a presliding that bends smoothly (Dahl's), which one does not.
    """

    of_friction: bool = False
    elements: int = 1

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
        EffectParameter("stiffness_2", "stiffness", "stiffness of a second element", 0.0, optional=True),
        EffectParameter("yield_2", "torque", "torque at which it slips", 0.0, optional=True),
    )
    coordinates = (
        Coordinate("yield", lower=0.0),
        Coordinate("log_reach", null=-2.0, lower=-16.0, upper=4.0, increment=1e-5),
        Coordinate("yield_2", lower=0.0),
        Coordinate("log_reach_2", null=-2.0, lower=-16.0, upper=4.0, increment=1e-5),
    )
    memory = 3
    free_start = True

    at = staticmethod(at)
    over = staticmethod(over)

    def numbers(self, values: Values) -> tuple[float, ...]:
        elements = zip(_yields(values), reaches(values), strict=True)
        return values.get("of_friction", 0.0), *(number for element in elements for number in element)

    def holds(self, values: Values) -> tuple[float, float]:
        share, slips = values.get("of_friction", 0.0), _yields(values)
        per_travel = (level / reach for level, reach in zip(slips, reaches(values), strict=True))
        return share * sum(slips), share * sum(per_travel)

    def grips(self, values: Values) -> float:
        return 0.0 if values.get("of_friction") else sum(_yields(values))

    def acts_on(self, values: Values) -> tuple[int, ...]:
        return (TORQUE, LEVEL_TORQUE) if values.get("of_friction") else (TORQUE,)

    def in_c(self, values: Values) -> CForm:
        lines, numbers = list[str](), {"of_friction": values.get("of_friction", 0.0)}
        for k, (slips, reach) in enumerate(zip(_yields(values), reaches(values), strict=True), start=1):
            numbers |= {f"yield_{k}": slips, f"reach_{k}": reach}
            lines += [
                f"if (row->first) memory[{k}] = 0.0f;",
                f"else memory[{k}] = clamp(memory[{k}] + (row->position - memory[0]) * (1.0f / reach_{k}), "
                "-1.0f, 1.0f);",
                f"sum->torque += yield_{k} * memory[{k}];",
            ]
            lines += [f"sum->level_torque -= yield_{k};"] if values.get("of_friction") else []
        return CForm("\n".join([*lines, "memory[0] = row->position;"]), numbers)

    def constants(self, motion: Motion) -> dict[str, float]:
        return {"of_friction": 1.0} if self.of_friction else {}

    def form_of(self, values: Values) -> Effect:
        return Hysteresis(bool(values.get("of_friction")), len(_yields(values)))

    def forms(self, motion: Motion) -> tuple[Effect, ...]:
        return () if self.of_friction else (Hysteresis(of_friction=True),)

    def larger(self, motion: Motion) -> tuple[Effect, ...]:
        return (replace(self, elements=2),) if self.elements == 1 else ()

    def plainer(
        self, values: Values, model: Values, motion: Motion
    ) -> tuple[Effect, dict[str, float]] | None:
        carried = sum(_yields(values))
        left = {name: model[name] - carried for name in ("coulomb", "static") if name in model}
        if not self.of_friction or any(level < _OWN * carried for level in left.values()):
            return None
        return replace(self, of_friction=False), left

    def active(self, motion: Motion) -> tuple[Coordinate, ...]:
        longest = math.log(max(_LONGEST * float(np.ptp(motion.position)), 1e-6))
        used = self.coordinates[: 2 * self.elements]
        return tuple(c if c.increment == 1.0 else replace(c, upper=longest) for c in used)

    def starts(self, motion: Motion) -> list[dict[str, float]]:
        stroke, last = float(np.ptp(motion.position)), self.coordinates[2 * self.elements - 1].name
        return [{last: math.log(share * stroke)} for share in _REACHES]

    def untestable(self, motion: Motion) -> str | None:
        if motion.reversals < FEWEST_REVERSALS:
            return "the axis hardly ever turned round: log small strokes inside large ones"
        return None

    def implausible(self, values: Values, model: Values) -> str | None:
        level, carried = model.get("coulomb", math.inf), sum(_yields(values))
        if self.of_friction:
            return "it would be more than the friction" if carried > _MOST * level else None
        if carried > level:
            return "it would carry more than the friction level: it would be the friction, by another name"
        return None

    def also_from(self, values: Values, model: Values) -> list[dict[str, float]]:
        if self.elements == 2:  # halves of the one that is in, one stiffer, one softer
            half, reach = 0.5 * model["hysteresis.yield"], model["hysteresis.log_reach"]
            apart = {"log_reach": reach - math.log(2.0), "log_reach_2": reach + math.log(2.0)}
            return [{"yield": half, "yield_2": half, **apart}]
        if not self.of_friction:
            return []
        part = _PART * model["coulomb"]
        # ... from that reach, and from where the bristle bends, which a contact without creep makes it do
        bend = model["coulomb"] / model.get("bristle_stiffness", math.inf)
        return [{**values, "yield": part}, *([{"yield": part, "log_reach": math.log(bend)}] if bend else [])]

    def to_parameters(self, values: Values) -> dict[str, float]:
        found: dict[str, float] = {}
        for end, slips, reach in zip(("", "_2"), _yields(values), reaches(values), strict=False):
            found |= {f"stiffness{end}": slips / reach, f"yield{end}": slips}
        return found | ({"of_friction": values["of_friction"]} if values.get("of_friction") else {})

    def to_values(self, parameters: Values) -> dict[str, float]:
        kept = {name: value for name, value in parameters.items() if not name.startswith("stiffness")}
        for end in ("", "_2") if "yield_2" in parameters else ("",):
            reach = parameters[f"yield{end}"] / max(parameters[f"stiffness{end}"], 1e-300)
            kept[f"log_reach{end}"] = math.log(max(reach, 1e-300))
        return kept


def _yields(values: Values) -> list[float]:
    """Torque at which each element slips."""
    return [values[name] for name in ("yield", "yield_2") if name in values]


def reaches(values: Values) -> list[float]:
    """Travel over which each element yields, rad (m)."""
    return [math.exp(values[name]) for name in ("log_reach", "log_reach_2") if name in values]
