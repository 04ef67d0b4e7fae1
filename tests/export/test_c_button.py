"""The button and the load at rest in the exported C: step by step as Python."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from idtool.control import ForceFreeController, Limits, Reason
from idtool.parameters import Parameter, Parameters
from idtool.rig.base import TrialSetup
from tests.control.double import BENCH, PAPER, Double
from tests.control.test_button import file

from .test_c import assert_alike
from .twin import RECOVER, Samples, compile_c, run_c, run_python

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")

LIMITS = Limits(-2.3, 2.3, speed=1.2)
#: Runs in which no comparison of two measured numbers is a tie to the sixth digit, where the two may part
#: (docs/board.md). One with the payload and one without.
SEEDS = (2, 3)


def pressed(parameters: Parameters, values: dict[str, float], seed: int, rows: int = 6000) -> Samples:
    """Readings of an axis whose button is pressed, hand pushes and load changes at random."""
    rng = np.random.default_rng(seed)
    rig = Double(dict(values), seed=seed, bristle=0.004)
    rig.prepare(TrialSetup(0.0 if seed % 2 else 0.4, start_position=0.0))
    controller = ForceFreeController(parameters, 0.01, limits=LIMITS)
    x = np.zeros((rows, 7), dtype=np.float32)
    up, request = np.zeros(rows, dtype=bool), np.zeros(rows, dtype=int)
    payload, push, command, button, until, fault_for = rig.payload, 0.0, 0.0, True, 0, 0
    for k in range(rows):
        if k >= until:
            until = k + int(rng.uniform(20, 300))
            button = not button
            if button and rng.random() < 0.5:
                payload = float(rng.choice([0.0, 0.4, 0.5, 0.8, 2.5]))
            push = 0.0 if rng.random() < 0.4 else float(rng.uniform(-0.4, 0.4))
        rig.gravity = values["base"] + values["per_payload"] * payload
        sample = rig.step(command, push)
        x[k] = [sample.position, sample.velocity, sample.current, 0.4, 0.0, 0.0, 25.0]
        up[k] = button
        fault_for = fault_for + 1 if controller.status.fault else 0
        if fault_for > 30:
            request[k] = RECOVER
            controller.recover()
        command = controller.step(*map(float, x[k, :6]), time_s=0.01 * (k + 1), enabled=not button)
    # a clock that jitters: whether 0.2 s are over must not hang on a rounding
    return Samples(x, 10_000 * (1 + np.arange(rows)) + rng.integers(-200, 200, rows), request, up)


@pytest.mark.parametrize(
    "values", [pytest.param(PAPER, marks=pytest.mark.long), BENCH], ids=["paper", "bench"]
)
@pytest.mark.parametrize("mode", ["paper", "light"])
@pytest.mark.parametrize("errors", [0.0, 0.02, 5.0], ids=["typed", "identified", "vague"])
def test_presses_and_loads_as_python_does(
    mode: str, values: dict[str, float], errors: float, tmp_path: Path
) -> None:
    parameters = file(mode, values)
    if errors:
        gravity = {name: replace(p, stderr=errors) for name, p in parameters.gravity.items()}
        parameters = replace(parameters, gravity=gravity)
    program = compile_c(parameters, tmp_path, limits=LIMITS)
    seen: set[str] = set()
    for seed in SEEDS:
        samples = pressed(parameters, values, seed)
        c, python = run_c(program, samples), run_python(parameters, samples, limits=LIMITS)
        assert_alike(c, python)
        seen |= set(python.state) | {fault for fault in python.fault if fault}
    assert {"held", "guiding", "resting", "starting", Reason.MISMATCH.value} <= seen


def test_an_arm_and_a_friction_that_an_effect_raises(tmp_path: Path) -> None:
    parameters = file("paper", BENCH, load_dependent_friction={"mu": 0.2})
    arm = replace(parameters, gravity_model="arm", gravity={"sin": Parameter(0.3), "cos": Parameter(0.1)})
    for k, one in enumerate((parameters, arm)):
        samples = pressed(one, BENCH, 3 + k, rows=3000)
        folder = tmp_path / str(k)
        folder.mkdir()
        c = run_c(compile_c(one, folder, limits=LIMITS), samples)
        assert_alike(c, run_python(one, samples, limits=LIMITS))


@pytest.mark.parametrize("mode", ["paper", "light"])
def test_a_session_s_limits(mode: str, tmp_path: Path) -> None:
    limits = replace(LIMITS, guided_speed=0.8, energy=2e-4, idle_s=0.7)
    parameters = file(mode, BENCH)
    program = compile_c(parameters, tmp_path, limits=limits)
    faults: set[str | None] = set()
    expired = False
    for seed in (8, 9):
        samples = pressed(parameters, BENCH, seed, rows=4000)
        c = run_c(program, samples)
        assert_alike(c, run_python(parameters, samples, limits=limits))
        faults |= set(c.fault)
        down = ~np.asarray(samples.up)
        waited = down & np.roll(down, 80) & (np.array(c.state) == "held")
        expired = expired or bool(np.any(waited[100:]))
    assert {Reason.SPEED_LIMIT.value, Reason.ENERGY.value} & faults
    assert expired


def test_a_line_that_the_user_draws(tmp_path: Path) -> None:
    limits = replace(LIMITS, mismatch=0.05)
    parameters = file("paper", PAPER)
    samples = pressed(parameters, PAPER, 6, rows=2000)
    c = run_c(compile_c(parameters, tmp_path, limits=limits), samples)
    assert_alike(c, run_python(parameters, samples, limits=limits))
    assert Reason.MISMATCH.value in c.fault
