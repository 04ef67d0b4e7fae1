"""Backlash: while the motor crosses a gap, part of the friction stays behind."""

from __future__ import annotations

import math
from typing import final

import numpy as np

from idtool.effects.base import FEWEST_REVERSALS, CForm, Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import BRISTLE_CHANGE, LEVEL_CHANGE
from idtool.model.jit import jit
from idtool.model.motion import Array, Motion
from idtool.model.row import Row, row_of

#: A gap is looked for between these shares of the stroke.
_GAPS = (0.003, 0.006, 0.012, 0.025, 0.05)
#: Less than this share of the friction behind the gap is no sign of a gap.
_LEAST_SHARE = 0.05
#: A load counts as one above some of this share of the largest.
_LOADED = 0.05
#: Contact sets in over the last part of the half gap, so that the torque has no jump.
_ONSET = 0.1


@jit(inline="always")
def at(row: Row, n: Array, memory: Array, total: Array) -> None:
    """Play operator, half of whose gap lies on either side; memory: where the part behind the gap is."""
    half, share, at_once = n[0], n[1], n[2]
    if row.first:
        memory[0] = row.position - half * row.start
    memory[0] = min(max(memory[0], row.position - half), row.position + half)
    depth = (row.position - memory[0]) / half
    if row.velocity < 0.0:
        depth = -depth  # only the face ahead can be met; the other is being left
    apart = min(max((1.0 - depth) / _ONSET, 0.0), 1.0)  # 1 inside the gap, 0 in contact
    if len(n) > 3 and not math.isnan(row.load):
        share_under_load, load_scale = n[3], n[4]
        unloaded = math.exp(-abs(row.load) / load_scale)
        share = share * unloaded + share_under_load * (1.0 - unloaded)
    total[LEVEL_CHANGE] -= share * apart
    total[BRISTLE_CHANGE] -= at_once * apart


@jit()
def over(rows: Row, n: Array, memory: Array, total: Array) -> None:
    for k in range(len(rows.position)):
        at(row_of(rows, k), n, memory, total[:, k])


@final
class Backlash(Effect):
    """What lies behind the gap rests by its own friction while the motor crosses. A load that outweighs
    that friction can hold one face in contact, so the share that comes free is told with and without."""

    name = "backlash"
    title = "Backlash"
    follows = ("position",)
    formula = "g(w) times 1 - share while the motor crosses the gap after a reversal; play operator"
    reveals = "reversals near zero load"
    is_lag = True
    after_reversal = True
    look_alikes = ("hysteresis", "transport_delay")
    citation = "Nordin & Gutman 2002; play operator: Krasnosel'skii & Pokrovskii 1989"
    parameters = (
        EffectParameter("gap", "position", "full width of the gap", 0.0),
        EffectParameter("share_behind_gap", "number", "share of the friction that lies behind it", 0.0, 1.0),
        EffectParameter("share_under_load", "number", "the same under a load", optional=True),
        EffectParameter("share_at_once", "number", "share of the bristle's torque that vanishes at once"),
        EffectParameter("load_scale", "torque", "load well below which it is no load", 0.0, optional=True),
    )
    coordinates = (
        Coordinate("share_behind_gap", lower=-0.5, upper=0.98, increment=1e-3),
        Coordinate("share_under_load", lower=-0.5, upper=0.98, increment=1e-3),
        Coordinate("share_at_once", lower=-0.5, upper=0.98, increment=1e-3),
        Coordinate("log_gap", null=-3.0, lower=-16.0, upper=4.0, increment=1e-5),
    )
    memory = 1
    free_start = True

    at = staticmethod(at)
    over = staticmethod(over)

    def numbers(self, values: Values) -> tuple[float, ...]:
        always = 0.5 * math.exp(values["log_gap"]), values["share_behind_gap"], values["share_at_once"]
        if "share_under_load" not in values or "load_scale" not in values:
            return always
        return *always, values["share_under_load"], values["load_scale"]

    def acts_on(self, values: Values) -> tuple[int, ...]:
        return LEVEL_CHANGE, BRISTLE_CHANGE

    def in_c(self, values: Values) -> CForm:
        share = "const float share = share_behind_gap;"
        keeps = 0
        if "share_under_load" in values and "load_scale" in values:
            keeps = 2
            share = """if (row->first || differs(row->load, memory[1])) {
                const float unloaded = decay(fabsf(row->load) * (1.0f / load_scale));
                memory[1] = row->load;
                memory[2] = share_under_load + (share_behind_gap - share_under_load) * unloaded;
            }
            const float share = memory[2];"""
        code = f"""
            /* the part behind the gap is dragged along; only the face ahead can be met */
            if (row->first) memory[0] = row->position;
            float depth = row->position - memory[0];
            if (beyond(depth, half_gap)) {{
                depth = within(depth, half_gap);
                memory[0] = row->position - depth;
            }}
            depth *= 1.0f / half_gap;
            if (is_negative(row->velocity)) depth = -depth;
            float apart = (1.0f - depth) * (1.0f / onset);
            apart = above(apart, 0.0f) ? within(apart, 1.0f) : 0.0f;
            {share}
            sum->level_change -= share * apart;
            sum->bristle_change -= share_at_once * apart;
        """
        constants = {**values, "half_gap": 0.5 * math.exp(values["log_gap"]), "onset": _ONSET}
        return CForm(code, constants, keeps=keeps)

    def constants(self, motion: Motion) -> dict[str, float]:
        scale = _load_scale(motion)
        return {} if scale is None else {"load_scale": scale}

    def active(self, motion: Motion) -> tuple[Coordinate, ...]:
        if _load_scale(motion) is not None:
            return self.coordinates
        return tuple(c for c in self.coordinates if c.name != "share_under_load")

    def starts(self, motion: Motion) -> list[dict[str, float]]:
        stroke = float(np.ptp(motion.position))
        return [{"log_gap": math.log(share * stroke)} for share in _GAPS]

    def untestable(self, motion: Motion) -> str | None:
        if motion.reversals < FEWEST_REVERSALS:
            return "the axis hardly ever turned round: log slow moves both ways"
        return None

    def implausible(self, values: Values, model: Values) -> str | None:
        share = 1.0 - (1.0 - values["share_behind_gap"]) * (1.0 - values["share_at_once"])
        if share < _LEAST_SHARE:
            return (
                f"friction inside the gap would be {100.0 * (1.0 - share):.0f} % of that outside it: no gap"
            )
        return None


def _load_scale(motion: Motion) -> float | None:
    """A small part of the largest load; None where there are not both loaded and unloaded rows."""
    if motion.load is None or not len(motion):
        return None
    size = np.abs(motion.load)
    scale = _LOADED * float(np.max(size))
    if scale < 1e-9 or not 0.05 < float(np.mean(size > 2.0 * scale)) < 0.95:
        return None
    return scale
