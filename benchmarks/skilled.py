"""The skilled user: least squares over our compiled model from one start that he has to know."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from scipy import optimize

from benchmarks.judge import common_cost, friction_of
from benchmarks.sessions import truth
from benchmarks.table import Section, seconds
from benchmarks.timing import interleaved, once
from idtool.fit.choose import choose_gravity, first_fits
from idtool.fit.spec import Spec
from idtool.fit.staged import fit_dynamic
from idtool.model.contribution import Contribution
from idtool.model.motion import Array
from idtool.model.torque import Friction, predict
from idtool.parameters import Parameters
from idtool.signals import Recording

_STIFFNESSES = (0.001, 0.01, 0.05, 0.5, 5.0, 50.0, 1000.0)
_DAMPINGS = (0.01, 0.3, 3.0)
#: Ends whose cost is above the lowest by more than this share are elsewhere.
_ELSEWHERE = 0.01


#: Starts of all friction parameters: coulomb, static, stribeck_velocity, viscous, sigma0, sigma1.
_ALL = {
    "the truth, rounded": (0.07, 0.03, 0.1, 0.15, 0.05, 0.3),
    "falling curve": (0.05, 0.08, 0.05, 0.1, 0.05, 0.3),
    "falling and narrow curve": (0.05, 0.08, 0.005, 0.1, 0.05, 0.3),
    "falling curve, stiff": (0.05, 0.08, 0.05, 0.1, 100.0, 1.0),
    "rising curve, stiff": (0.08, 0.05, 0.05, 0.1, 100.0, 1.0),
    "everything 0.1": (0.1, 0.1, 0.1, 0.1, 0.1, 0.1),
    "everything 1": (1.0, 1.0, 1.0, 1.0, 1.0, 1.0),
    "numbers of Canudas de Wit et al. 1995": (1.0, 1.5, 0.001, 0.4, 1e5, 316.0),
}


def measure(recording: Recording, known: Parameters, *, rounds: int) -> Section:
    """Where `scipy.optimize.least_squares` ends from a table of starts."""
    static = {name: parameter.value for name, parameter in known.static.items()}
    motion = recording.motion

    def residual(x: Array) -> Array:
        effect = Contribution(torque=x[2] * motion.acceleration)
        friction = friction_of(static, math.exp(x[0]), float(x[1]))
        return recording.torque - predict(motion, friction, effect, x[3:]).torque

    def solve(stiffness: float, damping: float) -> optimize.OptimizeResult:
        x = np.concatenate([[math.log(stiffness), damping, 0.0], np.zeros(motion.stretches)])
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
        f"{best['skilled'] / best['ours']:.2f} times as long as fit-dynamic ({seconds(best['ours'])}), which "
        f"needs no start. From {astray} of {count} starts he ends elsewhere (bold). His unknowns are sigma0, "
        "sigma1, inertia and the start deflections (from 0), over all rows, derivatives by differences."
    )
    return section


def everything_free(recording: Recording, most: int = 200) -> Section:
    """The same user with all friction parameters unknown, sweep and sines together."""
    motion = recording.motion
    gravity, columns = choose_gravity(recording)
    fits, took = once(lambda: first_fits(recording, Spec("lugre", gravity, columns)))
    fit = min(fits, key=lambda fit: fit.sse)  # of those that the diagnosis goes on from
    lowest = float(fit.full_residual @ fit.full_residual)

    def residual(x: Array) -> Array:
        friction = Friction(*np.exp(np.clip(x[:6], -50.0, 50.0)).tolist())
        effect = Contribution(torque=x[6] * motion.acceleration)
        return recording.torque - predict(motion, friction, effect, x[7:]).torque

    section = Section(
        "The skilled user with all friction parameters free",
        ["start", "time / ours", "cost / ours", "coulomb", "static", "stribeck velocity", "sigma0", "sigma1"],
    )
    astray = 0
    for name, values in _ALL.items():
        x = np.concatenate([np.log(values), [0.0], np.zeros(motion.stretches)])
        with np.errstate(all="ignore"):
            found, spent = once(partial(optimize.least_squares, residual, x, x_scale="jac", max_nfev=most))
        ratio = 2.0 * float(found.cost) / lowest
        lost = not ratio < 1.0 + _ELSEWHERE
        astray += lost
        end = np.exp(np.clip(found.x[[0, 1, 2, 4, 5]], -50.0, 50.0))
        section.add(name, spent / took, f"**{ratio:.4g}**" if lost else f"{ratio:.4g}", *end.tolist())
    friction = fit.model.friction(fit.x)
    ours = (friction.coulomb, friction.static, friction.stribeck_velocity)
    section.add("ours, no start", 1, "1", *ours, friction.bristle_stiffness, friction.bristle_damping)
    section.notes.append(
        f"Sweep and sines, {len(motion):,} rows, unknowns the six friction parameters (their logarithms), "
        "inertia and the start deflections; cost is the sum of squared torque errors of all rows. Ours are "
        f"the first fits of `identify` ({seconds(took)}). From {astray} of {len(_ALL)} starts he ends "
        f"elsewhere (bold) or is not there after {most} steps."
    )
    return section
