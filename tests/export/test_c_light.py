"""The exported C of the light mode, sample by sample as Python, tares and hands included."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from idtool.control import ForceFreeController, Limits, Reason
from idtool.parameters import Controller, EffectEntry, Parameter, Parameters
from idtool.rig.base import TrialSetup
from tests.control.double import BENCH, Double, parameters

from .test_c import CASES, EFFECTS, STEPS, _arm, _break, _linear, _rigid, assert_alike
from .twin import RECOVER, STEP, TARE, Samples, compile_c, motion, run_c, run_python

GAINS = Controller(command_gain=2.05, loop_gain=8.0, period=0.01, mode="light")
RANGE = Limits(-2.3, 2.3, speed=1.2)
#: Of the axis of the recordings.
INERTIA = Double().inertia


def light(values: dict[str, float] = BENCH, **effects: dict[str, float]) -> Parameters:
    """A file with the light mode."""
    return replace(parameters(values, **effects), controller=GAINS)


def guided(
    file: Parameters,
    truth: dict[str, float],
    rows: int,
    seed: int,
    *,
    limits: Limits,
    period: float = GAINS.period,
) -> Samples:
    """Readings of an axis that the Python controller moves and a hand pushes at random, with tares.

    The hand pushes with a steady or a growing force, lets go at once or slowly, touches every other tare.
    """
    rng = np.random.default_rng(seed)
    axis = Double(
        values=dict(truth),
        seed=seed,
        bristle=0.004,
        real_payload=0.4 + 0.05 * rng.normal(),
        period_s=period,
    )
    axis.prepare(TrialSetup(payload_kg=0.4, start_position=0.25))
    controller = ForceFreeController(file, period, limits=limits)

    def steps(low: float, high: float) -> int:
        return max(1, round(rng.uniform(low, high) / period))

    x = np.zeros((rows, 7), dtype=np.float32)
    request = np.zeros(rows, dtype=int)
    begins = ends = steps(0.8, 0.8)
    push, slow, pause, command, fault, asked, tares = 0.0, 1, 10, axis.q, 0, False, 0
    for k in range(rows):
        if k >= ends + pause:
            asked = rng.random() < 0.4 or not tares
            begins = k + steps(0.0, 1.6)
            ends = begins + steps(0.2, 2.0)
            fade, rest = rng.choice([0.0, 0.02, 0.08, 0.3]), rng.choice([0.1, 0.4])
            slow, pause = steps(fade, fade), steps(rest, rest)
            inwards = -np.sign(axis.q) if abs(axis.q) > 1.0 else rng.choice([-1.0, 1.0])
            push = inwards * rng.uniform(0.01, 0.15 if fade < 0.08 else 0.4)
        if asked and controller.ready:
            request[k], asked = TARE, False
            tares += 1
            if tares % 2:
                begins, ends = begins + steps(3.3, 3.3), ends + steps(3.3, 3.3)
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


@pytest.mark.parametrize("seed", range(2))
def test_guided_and_tared_as_python(seed: int, tmp_path: Path) -> None:
    file = light()
    samples = guided(file, off(BENCH, seed), STEPS, seed, limits=RANGE)
    c = run_c(compile_c(file, tmp_path, limits=RANGE), samples)
    python = run_python(file, samples, limits=RANGE)
    assert_alike(c, python)
    seen = Counter(python.state)
    assert min(seen[state] for state in ("starting", "resting", "taring", "guiding", "stopping")) > 10
    ends = [k for k in range(1, STEPS) if python.state[k - 1 : k + 1] == ["taring", "resting"]]
    touched = {python.disturbed[k] for k in ends}
    assert ends
    assert seed > 0 or touched == {True, False}


@pytest.fixture(scope="module")
def recorded() -> Samples:
    """A guided run, from which `recover` every 251 steps starts anew."""
    samples = guided(light(), off(BENCH, 7), STEPS, 7, limits=RANGE)
    samples.request[251::251] = RECOVER
    return samples


def first(samples: Samples, rows: int) -> Samples:
    """The first rows."""
    return replace(
        samples, x=samples.x[:rows], time_us=samples.time_us[:rows], request=samples.request[:rows]
    )


@pytest.mark.parametrize(
    "case", [pytest.param(case, marks=[pytest.mark.long] * (case not in ("none", "all"))) for case in CASES]
)
def test_effects_step_as_python_does(case: str, recorded: Samples, tmp_path: Path) -> None:
    """The law at work with every effect: the torque of one that the axis lacks is to it a hand's."""
    file = light(**CASES[case])
    samples = first(recorded, STEPS // 2)
    c = run_c(compile_c(file, tmp_path), samples)
    python = run_python(file, samples)
    assert_alike(c, python)
    assert min(Counter(python.state)[state] for state in ("resting", "guiding", "stopping")) > 10


def _narrow(file: Parameters) -> Parameters:
    """The same axis as a linear one: 0.1 m where the other moves by 1 rad."""
    per_length = {
        "viscous": 10.0,
        "stribeck_velocity": 0.1,
        "bristle_stiffness": 10.0,
        "bristle_damping": 10.0,
    }

    def of(table: dict[str, Parameter]) -> dict[str, Parameter]:
        return {name: Parameter(p.value * per_length.get(name, 1.0)) for name, p in table.items()}

    return replace(
        _linear(file),
        static=of(file.static),
        dynamic=of(file.dynamic),
        effects=(EffectEntry("inertia", {"inertia": Parameter(10.0 * INERTIA)}),),
        controller=replace(GAINS, loop_gain=0.1 * GAINS.loop_gain),
    )


@pytest.mark.parametrize("change", [_narrow, _arm, _rigid], ids=["linear", "arm", "rigid"])
def test_other_axes(change: Callable[[Parameters], Parameters], recorded: Samples, tmp_path: Path) -> None:
    file = change(light(inertia={"inertia": INERTIA}))
    if change is _narrow:
        narrow = recorded.x.copy()
        narrow[:, :2] *= np.float32(0.1)
        recorded = replace(recorded, x=narrow)
    c, python = run_c(compile_c(file, tmp_path), recorded), run_python(file, recorded)
    assert_alike(c, python)
    assert Counter(python.state)["guiding"] > 10


@cache
def recorded_at(period: float) -> Samples:
    """A guided run of another period, 200 s at most."""
    rows = min(STEPS, round(200.0 / period))
    return guided(light(), off(BENCH, 11), rows, 11, limits=RANGE, period=period)


@pytest.mark.parametrize("period", [0.002, 0.0103, 0.05])
@pytest.mark.parametrize("clocked", [True, False], ids=["clock", "counted"])
def test_other_periods(period: float, clocked: bool, tmp_path: Path) -> None:
    """Times of the law are whole periods in C and sums of them in Python."""
    file = light(transport_delay={"delay": 0.02}, inertia={"inertia": INERTIA})
    samples = replace(recorded_at(period), clocked=clocked)
    program = compile_c(file, tmp_path, period_s=period)
    c, python = run_c(program, samples), run_python(file, samples, period_s=period)
    assert_alike(c, python)
    assert min(Counter(python.state)[state] for state in ("resting", "taring", "guiding", "stopping")) > 10


def test_limits_cut_where_python_cuts(tmp_path: Path) -> None:
    limits = Limits(-0.2, 0.6, margin=30.0, speed=0.15, command_step=0.01)
    file = light()
    samples = guided(file, off(BENCH, 4), STEPS, 4, limits=limits)
    c, python = (
        run_c(compile_c(file, tmp_path, limits=limits), samples),
        run_python(file, samples, limits=limits),
    )
    assert_alike(c, python)
    assert frozenset().union(*python.limited) == {"speed", "step", "range"}


def test_faults_are_those_of_python_and_hold_until_recover(recorded: Samples, tmp_path: Path) -> None:
    """Every kind, a payload that is dropped and a blow among them."""
    limits = Limits(torque=1.0)
    samples = _break(replace(recorded, request=np.full(STEPS, STEP)), seed=8)
    rng = np.random.default_rng(8)
    for at in rng.integers(100, STEPS - 40, 40):  # the payload's weight, or a multiple
        samples.x[at : at + 30, 2] -= rng.choice([0.18, 0.53, 1.2]) / 2.67
        samples.request[at + 30] = RECOVER
    seen = set()
    for file in (light(), light(**EFFECTS)):
        c, python = (
            run_c(compile_c(file, tmp_path, limits=limits), samples),
            run_python(file, samples, limits=limits),
        )
        assert_alike(c, python)
        seen |= {fault for fault in c.fault if fault}
        for k in range(1, STEPS):
            if c.fault[k] and c.fault[k - 1] and not samples.request[k]:
                assert c.x[k, 0] == c.x[k - 1, 0], "the command is held"
    # the load at rest is judged in tests of its own; the limits of a session stand in Python alone
    assert seen == {reason.value for reason in Reason} - {"mismatch", "speed_limit", "energy"}


def test_a_limit_on_the_torque_holds_in_the_published_mode_too(tmp_path: Path) -> None:
    limits = Limits(torque=0.4)
    file = parameters(BENCH)
    samples = motion(STEPS, 0.01, seed=12)
    samples.request[50::50] = RECOVER
    c, python = (
        run_c(compile_c(file, tmp_path, limits=limits), samples),
        run_python(file, samples, limits=limits),
    )
    assert_alike(c, python)
    assert {fault for fault in c.fault if fault} == {"torque"}
    assert min(Counter(python.state)[state] for state in ("resting", "guiding", "fault")) > 10


@pytest.mark.parametrize("mode", ["paper", "light"])
def test_nothing_undefined_is_done(mode: str, recorded: Samples, tmp_path: Path) -> None:
    """Broken samples under the sanitizers of gcc: the same answers, and no report."""
    file = light(**EFFECTS) if mode == "light" else parameters(BENCH, **EFFECTS)
    samples = _break(recorded, seed=13)
    plain = run_c(compile_c(file, tmp_path), samples)
    checked = run_c(compile_c(file, tmp_path, sanitized=True), samples)
    assert checked.state == plain.state
    np.testing.assert_allclose(checked.x, plain.x, rtol=1e-5, atol=1e-6)
