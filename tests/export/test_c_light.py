"""The exported C of the light mode, sample by sample as Python, tares and hands included."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from idtool.control import ForceFreeController, Limits
from idtool.parameters import Controller, Parameters
from idtool.rig.base import TrialSetup
from tests.control.double import BENCH, Double, parameters

from .test_c import CASES, STEPS, assert_alike
from .twin import RECOVER, TARE, Samples, compile_c, run_c, run_python

GAINS = Controller(command_gain=2.05, loop_gain=8.0, period=0.01, mode="light")
RANGE = Limits(-2.3, 2.3, speed=1.2)


def light(values: dict[str, float] = BENCH, **effects: dict[str, float]) -> Parameters:
    """A file with the light mode."""
    return replace(parameters(values, **effects), controller=GAINS)


def guided(file: Parameters, truth: dict[str, float], rows: int, seed: int, *, limits: Limits) -> Samples:
    """Readings of an axis that the Python controller moves and a hand pushes at random, with tares.

    The hand pushes with a steady or a growing force, lets go at once or slowly, sometimes touches a tare.
    """
    period = GAINS.period
    rng = np.random.default_rng(seed)
    axis = Double(values=dict(truth), seed=seed, bristle=0.004, real_payload=0.4 + 0.05 * rng.normal())
    axis.prepare(TrialSetup(payload_kg=0.4, start_position=0.25))
    controller = ForceFreeController(file, limits=limits)
    x = np.zeros((rows, 7), dtype=np.float32)
    request = np.zeros(rows, dtype=int)
    push, begins, ends, slow, pause, command, fault = 0.0, 80, 80, 1, 10, axis.q, 0
    for k in range(rows):
        if k >= ends + pause:
            if rng.random() < 0.4:
                request[k] = TARE
            begins = k + int(rng.integers(1, 160))
            ends = begins + int(rng.integers(20, 200))
            slow, pause = int(rng.choice([1, 2, 8, 30])), int(rng.choice([10, 40]))
            inwards = -np.sign(axis.q) if abs(axis.q) > 1.0 else rng.choice([-1.0, 1.0])
            push = inwards * rng.uniform(0.01, 0.15 if slow < 8 else 0.4)
        hand = push * min(max(min(k - begins, ends - k) / slow, 0.0), 1.0)
        read = axis.step(command, hand)
        x[k] = [read.position, read.velocity, read.current, 0.4, 0.0, 0.0, read.temperature]
        if fault > 20:
            request[k] = RECOVER
            controller.recover()
        elif request[k] == TARE:
            controller.tare()
        command = controller.step(*map(float, x[k]), time_s=period * (k + 1))
        fault = fault + 1 if controller.status.fault else 0
    time_us = np.round(1e6 * period * np.arange(1, rows + 1)).astype(np.int64)
    return Samples(x, time_us, request)


def off(values: dict[str, float], seed: int) -> dict[str, float]:
    """The truth, up to 30 % beside the file."""
    rng = np.random.default_rng(seed)
    friction = ("coulomb", "static", "viscous", "bristle_damping")
    return {k: v * (rng.uniform(0.7, 1.3) if k in friction else 1.0) for k, v in values.items()}


@pytest.mark.parametrize("seed", range(3))
def test_guided_and_tared_as_python(seed: int, tmp_path: Path) -> None:
    file = light()
    samples = guided(file, off(BENCH, seed), STEPS, seed, limits=RANGE)
    c = run_c(compile_c(file, tmp_path, limits=RANGE), samples)
    python = run_python(file, samples, limits=RANGE)
    assert_alike(c, python)
    seen = Counter(python.state)
    assert min(seen[state] for state in ("starting", "resting", "taring", "guiding", "stopping")) > 10
    assert sum(python.taring) >= 2


@pytest.fixture(scope="module")
def recorded() -> Samples:
    """A guided run, from which `recover` every 251 steps starts anew."""
    samples = guided(light(), off(BENCH, 7), STEPS, 7, limits=RANGE)
    samples.request[251::251] = RECOVER
    return samples


@pytest.mark.parametrize("case", CASES)
def test_effects_step_as_python_does(case: str, recorded: Samples, tmp_path: Path) -> None:
    """The law at work with every effect: the torque of one that the axis lacks is to it a hand's."""
    file = light(**CASES[case])
    c = run_c(compile_c(file, tmp_path), recorded)
    python = run_python(file, recorded)
    assert_alike(c, python)
    assert min(Counter(python.state)[state] for state in ("resting", "guiding", "stopping")) > 10
