"""Hands in a tare: which are found, and what those that are not make of it."""

from __future__ import annotations

import math

import numpy as np

from idtool.control import ForceFreeController
from idtool.control.online import OnlineModel
from studies.guided_axis import NO_HAND
from studies.guided_plants import PAYLOAD_KG, Case
from studies.teach import PERIOD, SPEED, set_up

FORCES_N = (0.3, 0.45, 0.6, 1.0, 2.0, 5.0)


def tared(case: Case, newton: float, begin: float, seconds: float) -> ForceFreeController:
    """The controller after a tare into which a hand pushed for a while, N and s from its beginning."""
    axis, law = set_up(case)
    command, begun = 0.0, math.inf
    for k in range(450):
        if not math.isfinite(begun) and law.tare():
            begun = k * PERIOD
        hand = NO_HAND.copy()
        if begin <= k * PERIOD - begun < begin + seconds:
            hand[4] = newton * case.ratio
        _, position, velocity, current = axis.advance(command, hand)
        command = law.step(position, velocity, current, PAYLOAD_KG, time_s=(k + 1) * PERIOD)
    return law


def is_refused(law: ForceFreeController) -> bool:
    """Whether the tare was not used."""
    return any("is not used" in note for note in law.status.notes)


def table(cases: list[Case], rng: np.random.Generator) -> list[str]:
    """How many tares were refused, and the worst torque that a touched one that was not has learned."""
    alone = [tared(case, 0.0, 0.0, 0.0) for case in cases]
    refused = [law for law in alone if is_refused(law)]
    touched = sum("disturbed" in " ".join(law.status.notes) for law in refused)
    lines = [
        "| a hand of | tares | refused | learned wrong by those that were not, worst, N |",
        "|---|---:|---:|---:|",
        f"| nobody | {len(cases)} | {touched} as touched, {len(refused) - touched} as not explained | |",
    ]
    for force in FORCES_N:
        errors = []
        for case, clean in zip(cases, alone, strict=True):
            begin, seconds = float(rng.uniform(0.0, 2.6)), float(rng.uniform(0.3, 1.5))
            law = tared(case, force * float(rng.choice([-1.0, 1.0])), begin, seconds)
            if not is_refused(law):
                errors.append(_apart(case, law, clean) / case.ratio)
        worst = f"{max(errors):.2f}" if errors else ""
        lines.append(f"| {force:g} N, 0.3 to 1.5 s | {len(cases)} | {len(cases) - len(errors)} | {worst} |")
    return lines


def _apart(case: Case, one: ForceFreeController, other: ForceFreeController) -> float:
    """How far apart what two controllers have learned is while the axis is guided or rests, N m."""
    assert one.learned is not None
    assert other.learned is not None
    model, speed = OnlineModel(case.file), SPEED / case.ratio
    for k in range(round(1.0 / PERIOD)):
        load = model.update(
            k * PERIOD, PERIOD, k * PERIOD * speed, speed, 0.0, PAYLOAD_KG, 0.0, 0.0, None, PERIOD * speed
        )
    difference = np.subtract(one.learned, other.learned)
    rows = [[1.0, way * load.elastic, way * load.damping] for way in (-1.0, 0.0, 1.0)]
    return float(np.max(np.abs(np.array(rows) @ difference)))
