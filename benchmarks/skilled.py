"""The skilled user: least squares over our compiled model from one start that he has to know."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy import optimize

from benchmarks.judge import common_cost, friction_of
from benchmarks.sessions import truth
from benchmarks.table import Section, seconds
from benchmarks.timing import interleaved
from idtool.fit.staged import fit_dynamic
from idtool.model.contribution import Contribution
from idtool.model.motion import Array
from idtool.model.torque import predict
from idtool.parameters import Parameters
from idtool.signals import Recording

_STIFFNESSES = (0.001, 0.01, 0.05, 0.5, 5.0, 50.0, 1000.0)
_DAMPINGS = (0.01, 0.3, 3.0)
#: Ends whose cost is above the lowest by more than this share are elsewhere.
_ELSEWHERE = 0.01


def measure(recording: Recording, known: Parameters, *, rounds: int) -> Section:
    """Where `scipy.optimize.least_squares` ends from a table of starts."""
    static = {name: parameter.value for name, parameter in known.static.items()}
    motion = recording.motion

    def residual(x: Array) -> Array:
        effect = Contribution(torque=x[2] * motion.acceleration)
        friction = friction_of(static, math.exp(x[0]), float(x[1]))
        return recording.torque - predict(motion, friction, effect, x[3:]).torque

    def solve(stiffness: float, damping: float) -> optimize.OptimizeResult:
        x = np.concatenate([[math.log(stiffness), damping, 0.0], np.zeros(motion.trials)])
        with np.errstate(all="ignore"):
            return optimize.least_squares(residual, x, x_scale="jac", max_nfev=200)

    tasks: dict[str, Callable[[], object]] = {
        "ours": lambda: fit_dynamic(replace(recording, motion=replace(motion)), known),
        "skilled": lambda: solve(0.05, 0.3),
    }
    best = interleaved(tasks, rounds)
    fit = fit_dynamic(recording, known).fit
    values = fit.values
    lowest = common_cost(
        recording,
        static,
        values["bristle_stiffness"],
        values["bristle_damping"],
        values.get("inertia.inertia", 0.0),
    )
    section = Section(
        "The skilled user: least_squares over our compiled model",
        [
            "start sigma0",
            "start sigma1",
            "end sigma0",
            "end sigma1",
            "model evaluations",
            "common cost / ours",
        ],
    )
    astray = 0
    for stiffness in _STIFFNESSES:
        for damping in _DAMPINGS:
            found = solve(stiffness, damping)
            end = (math.exp(min(found.x[0], 50.0)), float(found.x[1]), float(found.x[2]))
            ratio = common_cost(recording, static, *end) / lowest
            lost = not ratio < 1.0 + _ELSEWHERE
            astray += lost
            # a numerical derivative costs an evaluation for each unknown
            done = int(found.nfev) + int(found.njev) * len(found.x)
            section.add(
                stiffness, damping, end[0], end[1], done, f"**{ratio:.4g}**" if lost else f"{ratio:.6g}"
            )
    count = len(_STIFFNESSES) * len(_DAMPINGS)
    section.notes.append(
        f"From the good start (0.05, 0.3; the truth is {truth()['bristle_stiffness']:g}, "
        f"{truth()['bristle_damping']:g}) he needs {seconds(best['skilled'])}, "
        f"{best['skilled'] / best['ours']:.2f} times as long as fit-dynamic ({seconds(best['ours'])}), which needs "
        f"no start. From {astray} of {count} starts he ends elsewhere (bold). His unknowns are sigma0, sigma1, "
        "inertia and the start deflections (from 0), over all rows, derivatives by differences."
    )
    return section
