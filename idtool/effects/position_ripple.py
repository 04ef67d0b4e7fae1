"""Position ripple: torque that repeats with the angle (gear mesh, pulley run-out, cogging)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import final

import numpy as np

from idtool.effects.base import CForm, Coordinate, Effect, EffectParameter, Values, Wave, both_ways
from idtool.model.contribution import LEVEL_TORQUE, TORQUE, Contribution, Term, combine
from idtool.model.jit import jit
from idtool.model.motion import Array, Motion
from idtool.model.row import Row

#: Of each family: cogging and gear mesh are no pure sine, and what is higher is a family of its own.
_HARMONICS = (1, 2)
_STRENGTHS = ("sin_1", "cos_1", "sin_2", "cos_2", "turned_sin_1", "turned_cos_1")
#: Poles, slots and the stages of a gear bring a family each.
_MOST_FAMILIES = 6
#: A fit asks for a family's waves once for every strength, and for a frequency that it tries.
_KEPT = _MOST_FAMILIES + 2
#: Fewer periods than this over the stroke look like a stiffness, an offset or a friction slope.
_LEAST_PERIODS = 2.0
#: ... and a fit that drifts below these follows one of them, or gravity.
_FEWEST_PERIODS = 1.5
#: The shortest period holds this many rows at the speed below which this share of the travel is made.
_LEAST_SAMPLES, _SLOWEST = 6.0, 0.05


@jit()
def _sines(position: Array, cycles: float) -> Array:
    """Sine and cosine of an angle and of its double, shape (4, rows)."""
    out = np.empty((4, position.shape[0]))
    for k in range(position.shape[0]):
        angle = cycles * position[k]
        s, c = math.sin(angle), math.cos(angle)
        out[0, k], out[1, k], out[2, k], out[3, k] = s, c, 2.0 * s * c, 1.0 - 2.0 * s * s
    return out


def _waves(motion: Motion, cycles: float) -> Array:
    """`_sines` of the position; those asked for last are kept, since a fit asks for them once a strength."""
    if len(motion) == 1:  # the row of a controller, which writes each sample over the last
        return _sines(motion.position, cycles)
    known = motion.waves
    if cycles not in known:
        while len(known) >= _KEPT:
            del known[next(iter(known))]
        known[cycles] = _sines(motion.position, cycles)
    return known[cycles]


@jit()
def at(row: Row, n: Array, memory: Array, total: Array) -> None:
    """Of each family the cycles, then the strengths in the order of `_STRENGTHS`."""
    for k in range(0, len(n), 1 + len(_STRENGTHS)):
        s, c = math.sin(n[k] * row.position), math.cos(n[k] * row.position)
        total[TORQUE] += n[k + 1] * s + n[k + 2] * c + 2.0 * n[k + 3] * s * c + n[k + 4] * (1.0 - 2.0 * s * s)
        total[LEVEL_TORQUE] += n[k + 5] * s + n[k + 6] * c


def _prefix(family: int) -> str:
    """What the names of a family's numbers begin with; those of the first have none."""
    return f"family_{family}_" if family > 1 else ""


def _coordinates(family: int, directed: bool, pure: bool) -> tuple[Coordinate, ...]:
    names = [f"{part}_{k}" for k in _HARMONICS[: 1 if pure else None] for part in ("sin", "cos")]
    names += ["turned_sin_1", "turned_cos_1"] if directed else []
    cycles = Coordinate(f"{_prefix(family)}cycles", null=1.0, lower=0.0, increment=1e-3)
    return (*(Coordinate(_prefix(family) + name) for name in names), cycles)


def _parameters(family: int) -> tuple[EffectParameter, ...]:
    def one(
        name: str, dimension: str, meaning: str, lower: float, upper: float = math.inf, optional: bool = False
    ) -> EffectParameter:
        return EffectParameter(
            _prefix(family) + name, dimension, meaning, lower, upper, optional or family > 1
        )

    which = f"of family {family}: " if family > 1 else ""
    told = "n, waves per turn: sin(n q); on a linear axis per metre: sin(2 pi n x)"
    found = [one("cycles", "spatial_frequency", which + told, 0.0)]
    for k, called in zip(_HARMONICS, ("fundamental", "second harmonic"), strict=True):
        absent = k > 1
        found.append(
            one(f"amplitude_{k}", "torque", f"{which}amplitude of the {called}", 0.0, optional=absent)
        )
        found.append(one(f"phase_{k}", "phase", f"{which}phase of the {called}", -math.pi, math.pi, absent))
    told = f"{which}of the friction, which turns with the motion, "
    found.append(one("turned_amplitude_1", "torque", f"{told}amplitude", 0.0, optional=True))
    found.append(one("turned_phase_1", "phase", f"{told}phase", -math.pi, math.pi, True))
    return tuple(found)


@final
@dataclass(frozen=True)
class PositionRipple(Effect):
    """One or several families of lines, each with a spatial frequency of its own and its second harmonic.

    A real gearbox has several at once: motor poles, gear mesh or wave generator, once per turn. Where the
    data ask for it the friction has the fundamental too: the line has another phase in the other direction.

    Attributes:
        directed: for each family, whether the friction has it.
        pure: which of them, 1, 2, ..., have no second harmonic: another family is there.
    """

    directed: tuple[bool, ...] = (False,)
    pure: tuple[int, ...] = ()

    name = "position_ripple"
    title = "Position ripple"
    follows = ("position",)
    formula = "sum over families n and k = 1, 2 of A_k sin(k n q + phi_k)"
    reveals = "a slow sweep over the whole stroke; its spectrum over the angle"
    look_alikes = ("position_stiffness", "position_dependent_friction", "external_periodic")
    citation = "Armstrong-Helouvry 1991; Villagran et al. 2009 (cogging)"
    parameters = tuple(p for family in range(1, _MOST_FAMILIES + 1) for p in _parameters(family))
    coordinates = tuple(
        c for family in range(1, _MOST_FAMILIES + 1) for c in _coordinates(family, True, False)
    )

    at = staticmethod(at)

    def numbers(self, values: Values) -> tuple[float, ...]:
        return tuple(
            values.get(prefix + name, 0.0) for prefix in _families(values) for name in ("cycles", *_STRENGTHS)
        )

    def contribute(self, motion: Motion, values: Values) -> Contribution:
        """As `at`, over waves that are kept: a fit asks for the same ones once for every strength."""
        parts = []
        for prefix in _families(values):
            waves = _waves(motion, values[f"{prefix}cycles"])
            torque = _sum([values.get(f"{prefix}{name}", 0.0) for name in _STRENGTHS[:4]], waves)
            friction = _sum([values.get(f"{prefix}{name}", 0.0) for name in _STRENGTHS[4:]], waves[:2])
            parts.append(Contribution(torque=torque, level_torque=friction))
        return combine(parts)

    def slope(self, motion: Motion, values: Values, coordinate: str) -> Contribution:
        prefix = coordinate.removesuffix("cycles")
        waves = _waves(motion, values[coordinate])
        turned = values.get(f"{prefix}turned_sin_1"), values.get(f"{prefix}turned_cos_1")
        along = [
            number
            for k in _HARMONICS
            for number in (-k * values.get(f"{prefix}cos_{k}", 0.0), k * values.get(f"{prefix}sin_{k}", 0.0))
        ]
        torque = motion.position * (np.array(along) @ waves)
        if turned[0] is None or turned[1] is None:
            return Contribution(torque=torque)
        friction = motion.position * (np.array([-turned[1], turned[0]]) @ waves[:2])
        return Contribution(torque=torque, level_torque=friction)

    def in_c(self, values: Values) -> CForm:
        lines = ["float s, c;"]
        for prefix in _families(values):
            sin_1, cos_1, sin_2, cos_2 = (
                f"{prefix}{part}_{k}" for k in _HARMONICS for part in ("sin", "cos")
            )
            lines.append(f"sine_and_cosine({prefix}cycles * row->position, &s, &c);")
            if sin_2 in values:
                lines += [
                    "/* the double angle by s and c: sin 2x = 2 s c, cos 2x = 1 - 2 s s */",
                    f"sum->torque += s * ({sin_1} + 2.0f * {sin_2} * c - 2.0f * {cos_2} * s);",
                    f"sum->torque += {cos_1} * c + {cos_2};",
                ]
            else:
                lines.append(f"sum->torque += {sin_1} * s + {cos_1} * c;")
            if f"{prefix}turned_sin_1" in values:
                lines.append(f"sum->level_torque += {prefix}turned_sin_1 * s + {prefix}turned_cos_1 * c;")
        return CForm("\n".join(lines), values)

    def around(self, values: Values, coordinate: str) -> Values:
        return {name: values[name] for name in _of_one_family(tuple(values), coordinate)}

    def active(self, motion: Motion) -> tuple[Coordinate, ...]:
        stroke = max(float(np.ptp(motion.position)), 1e-12)
        fewest = _FEWEST_PERIODS * 2.0 * math.pi / stroke
        found = (c for k, own in enumerate(self.directed, 1) for c in _coordinates(k, own, k in self.pure))
        return tuple(replace(c, lower=fewest) if c.name.endswith("cycles") else c for c in found)

    def form_of(self, values: Values) -> Effect:
        families = _families(values)
        return PositionRipple(
            tuple(f"{family}turned_sin_1" in values for family in families),
            tuple(k for k, family in enumerate(families, 1) if f"{family}sin_2" not in values),
        )

    def plainer(
        self, values: Values, model: Values, motion: Motion
    ) -> tuple[Effect, dict[str, float]] | None:
        """Without a second harmonic that is another family's line: the two would cancel each other, however
        large they are."""
        apart = 2.0 * math.pi / max(float(np.ptp(motion.position)), 1e-12)
        families = _families(values)
        pure, moved = set(self.pure), dict[str, float]()
        for k, one in enumerate(families, 1):
            for other in families:
                if k in pure or other == one:
                    continue
                if abs(2.0 * values[f"{one}cycles"] - values[f"{other}cycles"]) < apart:
                    pure.add(k)
                    for part in ("sin", "cos"):
                        name = f"{other}{part}_1"
                        moved[name] = moved.get(name, values[name]) + values[f"{one}{part}_2"]
        if pure == set(self.pure):
            return None
        return replace(self, pure=tuple(sorted(pure))), {f"{self.name}.{k}": v for k, v in moved.items()}

    def larger(self, motion: Motion) -> tuple[Effect, ...]:
        both = both_ways(motion.velocity)
        more: list[Effect] = []
        if len(self.directed) < _MOST_FAMILIES:
            more += [
                replace(self, directed=(*self.directed, of_friction))
                for of_friction in (False, True)[: 1 + both]
            ]
        if both:
            for k, own in enumerate(self.directed):
                if not own:
                    more.append(replace(self, directed=(*self.directed[:k], True, *self.directed[k + 1 :])))
        return tuple(more)

    def starts(self, motion: Motion) -> list[dict[str, float]]:
        wave = self.wave(motion)
        return [{wave.coordinate: wave.lowest}]

    def wave(self, motion: Motion) -> Wave:
        """Of the last family."""
        stroke = max(float(np.ptp(motion.position)), 1e-12)
        lowest = _LEAST_PERIODS * 2.0 * math.pi / stroke
        name = f"{_prefix(len(self.directed))}cycles"
        highest = 2.0 * math.pi / (_LEAST_SAMPLES * _slowest_step(motion))
        return Wave(name, motion.position, lowest, highest, self.directed[-1])

    def untestable(self, motion: Motion) -> str | None:
        wave = self.wave(motion)
        return (
            None if wave.highest > wave.lowest else "the sampling is too coarse over the angle: move slower"
        )

    def to_parameters(self, values: Values) -> dict[str, float]:
        result: dict[str, float] = {}
        for prefix in _families(values):
            result[f"{prefix}cycles"] = values[f"{prefix}cycles"]
            for part in _parts(prefix, values):
                sine, cosine = values[f"{prefix}{part[0]}"], values[f"{prefix}{part[1]}"]
                result[f"{prefix}{part[2]}"] = math.hypot(sine, cosine)
                result[f"{prefix}{part[3]}"] = math.atan2(cosine, sine)
        return result

    def to_values(self, parameters: Values) -> dict[str, float]:
        result: dict[str, float] = {}
        for prefix in _families(parameters):
            result[f"{prefix}cycles"] = parameters[f"{prefix}cycles"]
            for part in _parts(prefix, parameters):
                amplitude, phase = parameters[f"{prefix}{part[2]}"], parameters[f"{prefix}{part[3]}"]
                result[f"{prefix}{part[0]}"] = amplitude * math.cos(phase)
                result[f"{prefix}{part[1]}"] = amplitude * math.sin(phase)
        return result


def _slowest_step(motion: Motion) -> float:
    """How far the axis goes from row to row where it makes the slowest of its travel.

    By its speed, and by travel: the counts of an encoder at rest are many small steps, which lead nowhere.
    """
    step = np.sort((np.abs(motion.velocity) * motion.step)[~motion.first])
    travel = np.cumsum(step)
    if not len(step) or travel[-1] == 0.0:
        return math.inf
    return float(step[np.searchsorted(travel, _SLOWEST * travel[-1])])


def _sum(strengths: list[float], waves: Array) -> Term:
    """Of waves; of one alone a fit asks for most."""
    there = [k for k, strength in enumerate(strengths) if strength]
    if not there:
        return 0.0
    if len(there) == 1 and strengths[there[0]] == 1.0:
        return np.asarray(waves[there[0]])
    return np.asarray(np.array(strengths) @ waves)


@lru_cache(maxsize=256)
def _of_one_family(names: tuple[str, ...], coordinate: str) -> tuple[str, ...]:
    """Those of the family of a coordinate."""
    families = [_prefix(k) for k in range(1, _MOST_FAMILIES + 1)]
    prefix = next((p for p in reversed(families) if p and coordinate.startswith(p)), "")
    own = (name for name in names if name.startswith("family_") == bool(prefix))
    return tuple(name for name in own if name.startswith(prefix))


def _families(values: Values) -> list[str]:
    """Prefix of every family whose numbers are there."""
    return [_prefix(k) for k in range(1, _MOST_FAMILIES + 1) if f"{_prefix(k)}cycles" in values]


def _parts(prefix: str, values: Values) -> list[tuple[str, str, str, str]]:
    """Names of sine and cosine strength, amplitude and phase of every line of a family."""
    parts = [
        (f"sin_{k}", f"cos_{k}", f"amplitude_{k}", f"phase_{k}")
        for k in _HARMONICS
        if f"{prefix}sin_{k}" in values or f"{prefix}amplitude_{k}" in values
    ]
    if f"{prefix}turned_sin_1" in values or f"{prefix}turned_amplitude_1" in values:
        parts.append(("turned_sin_1", "turned_cos_1", "turned_amplitude_1", "turned_phase_1"))
    return parts
