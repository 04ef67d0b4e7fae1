"""The compiled LuGre step against the same loop in C."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import machine
from benchmarks.compiled import FAST, LANES, PLAIN, Library, compiler
from benchmarks.sessions import log_of, truth
from benchmarks.table import Goal, Section
from benchmarks.timing import interleaved
from idtool.model import lugre
from idtool.model.motion import Array
from idtool.model.stribeck import level
from idtool.signals import record

_DIRECTIONS = 4  # as many parameters bend the bristle: three of the curve, and the stiffness
_GOAL = 0.8


def measure(trials: tuple[int, ...] = (), rounds: int = 300) -> Section:
    """Rows per second of every version, on the four sines."""
    motion = record([log_of("sine", trials=trials)]).motion
    friction = truth()
    velocity, step, first = motion.step_velocity, motion.step, motion.first
    height = level(velocity, friction["coulomb"], friction["static"], friction["stribeck_velocity"])
    rho = friction["bristle_stiffness"] / height
    start = np.full(motion.stretches, 0.1)
    columns = np.random.default_rng(0).normal(size=(_DIRECTIONS, len(motion)))
    stiffness = np.geomspace(0.01, 10.0, LANES)
    plain = (velocity, step, rho, first, start)
    tasks: dict[str, Callable[[], object]] = {
        "numba": lambda: lugre.propagate(*plain),
        "numba, tangents": lambda: tangents(plain, columns),
    }
    section = Section(
        "The compiled LuGre step",
        ["version", "million rows per second", "times `cc -O3`, the same loop"],
        notes=[
            f"{len(motion):,} rows; deflection and decay of the start, and with tangents the derivatives "
            f"along {_DIRECTIONS} parameters too. Allocation of the results is in the time of every version."
        ],
    )
    worst = 0.0
    if compiler() is None:
        section.notes.append(
            "There is no C compiler here (`cc`, or what CC names), so nothing to compare with."
        )
    else:
        with tempfile.TemporaryDirectory() as folder:
            usual, fast = Library(Path(folder), PLAIN), Library(Path(folder), FAST)
        tasks |= {
            "C -O3": lambda: usual.propagate(*plain, split=False),
            "C -O3, tangents": lambda: usual.propagate_tangents(*plain, columns),
            "C fast": lambda: fast.propagate(*plain, split=False),
            "C fast, tangents": lambda: fast.propagate_tangents(*plain, columns),
            "C fast, exponentials first": lambda: fast.propagate(*plain, split=True),
            f"C fast, {LANES} stiffnesses at once": lambda: fast.many(
                velocity, step, height, first, stiffness
            ),
        }
        worst = max(
            float(np.max(np.abs(ours - theirs)))
            for ours, theirs in zip(
                tangents(plain, columns), usual.propagate_tangents(*plain, columns), strict=True
            )
        )
        section.notes.append(
            f"C fast is `{' '.join(FAST)}`, {machine.compiler(compiler() or 'cc')}. The largest difference "
            f"between numba and `cc -O3` over deflection, decay and derivatives: {worst:.1e}."
        )
    best = interleaved(tasks, rounds)
    rates = {name: len(motion) / took / 1e6 for name, took in best.items()}
    lanes = f"C fast, {LANES} stiffnesses at once"
    if lanes in rates:
        rates[lanes] *= LANES
    for name, rate in rates.items():
        reference = rates.get("C -O3, tangents" if "tangents" in name else "C -O3")
        section.add(name, rate, rate / reference if reference else "")
    _judge(section, rates, lanes)
    return section


def _judge(section: Section, rates: dict[str, float], lanes: str) -> None:
    for kind in ("", ", tangents"):
        what = f"LuGre step{kind or ', plain'}: at least {_GOAL} of `cc -O3`"
        if f"C -O3{kind}" not in rates:
            section.goals.append(Goal(what, "no compiler", None))
            continue
        ratio = rates[f"numba{kind}"] / rates[f"C -O3{kind}"]
        section.goals.append(Goal(what, f"{ratio:.2f}", ratio >= _GOAL))
    if lanes in rates:
        split = rates["C fast, exponentials first"] / rates["numba"]
        many = rates[lanes] / rates["numba"]
        section.notes.append(
            f"What vector units could still give: {split:.1f} times with the exponentials in a loop of their "
            f"own, {many:.1f} times where {LANES} candidates are advanced together (deflection only). Both "
            "need a vector exponential, which numba does not have without Intel's SVML, and round otherwise "
            "(`-ffast-math`)."
        )


def tangents(plain: tuple[Any, ...], columns: Array) -> tuple[Array, Array, Array]:
    """Deflection, decay and, of derivatives of ln(rho) over each step with respect to up to `lugre.BLOCK`
    parameters, those of the deflection, shape (parameters, rows) both."""
    z, decay, add = lugre.propagate_blocks(*plain)
    given, found = np.zeros((2, lugre.BLOCK, len(z)))
    given[: len(columns)] = columns
    add(given, np.ones(len(z)), found)
    return z, decay, found[: len(columns)]
