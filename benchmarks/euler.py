"""LuGre as a user writes it first: explicit Euler in a plain Python loop.

    dz/dt = w - sigma0 |w| / g(w) z,      z += h dz/dt

One step a row, no substeps. With the axis of the paper that is stable below sigma0 of about 2 g / (|w| h);
above, the sum of squares runs away and counts as infinite, which costs a search nothing but the evaluation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from idtool.model.stribeck import level
from idtool.signals import Recording

#: Bounds of ln(sigma0), sigma1 and the inertia, wide for this axis; and of each start deflection, rad.
BOUNDS = ((math.log(1e-3), math.log(1e3)), (0.0, 3.0), (0.0, 0.1))
START_BOUND = (-2.0, 2.0)

Cost = Callable[[Sequence[float]], float]


def bounds(trials: int, *, starts: bool) -> list[tuple[float, float]]:
    """Bounds of every unknown."""
    return [*BOUNDS, *([START_BOUND] * trials if starts else [])]


def usual(recording: Recording, static: Mapping[str, float]) -> Cost:
    """Sum of squares over all rows as a function of ln(sigma0), sigma1, inertia and, where given, the start
    deflection of each trial (else 0). The formula is written down in the loop as it stands in a paper."""
    trials = _trials(recording)
    coulomb, static_level = static["coulomb"], static["static"]
    stribeck_velocity, viscous = static["stribeck_velocity"], static["viscous"]

    def cost(x: Sequence[float]) -> float:
        sigma0, sigma1, inertia = math.exp(x[0]), float(x[1]), float(x[2])
        starts = [float(z) for z in x[3:]] or [0.0] * len(trials)
        total = 0.0
        for rows, z in zip(trials, starts, strict=True):
            for velocity, acceleration, step, torque, _ in rows:
                g = coulomb + (static_level - coulomb) * math.exp(-((velocity / stribeck_velocity) ** 2))
                rate = velocity - sigma0 * abs(velocity) / g * z
                friction = sigma0 * z + sigma1 * rate + viscous * velocity
                error = torque - friction - inertia * acceleration
                total += error * error
                z += step * rate
        return total if total < math.inf else math.inf

    return cost


def careful(recording: Recording, static: Mapping[str, float]) -> Cost:
    """The same by a user who computes |w| / g(w) once, before the search."""
    trials = _trials(recording, static)
    viscous = static["viscous"]

    def cost(x: Sequence[float]) -> float:
        sigma0, sigma1, inertia = math.exp(x[0]), float(x[1]), float(x[2])
        starts = [float(z) for z in x[3:]] or [0.0] * len(trials)
        total = 0.0
        for rows, z in zip(trials, starts, strict=True):
            for velocity, acceleration, step, torque, pull in rows:
                rate = velocity - sigma0 * pull * z
                error = torque - sigma0 * z - sigma1 * rate - viscous * velocity - inertia * acceleration
                total += error * error
                z += step * rate
        return total if total < math.inf else math.inf

    return cost


def _trials(
    recording: Recording, static: Mapping[str, float] | None = None
) -> list[list[tuple[float, float, float, float, float]]]:
    """Rows of each trial: velocity, acceleration, step to the next row, torque, |w| / g(w)."""
    motion = recording.motion
    pull = np.zeros(len(motion))
    if static is not None:
        curve = (static["coulomb"], static["static"], static["stribeck_velocity"])
        pull = np.abs(motion.velocity) / level(motion.velocity, *curve)
    step = np.append(motion.step[1:], 0.0)
    table = np.column_stack([motion.velocity, motion.acceleration, step, recording.torque, pull])
    ends = np.append(motion.starts[1:], len(motion))
    return [
        [tuple(row) for row in table[begin:end].tolist()]
        for begin, end in zip(motion.starts, ends, strict=True)
    ]
