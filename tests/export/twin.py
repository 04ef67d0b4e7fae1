"""The exported C beside the Python controller: the same samples into both."""

from __future__ import annotations

import math
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from idtool.control import ForceFreeController, Limits, State
from idtool.control.guard import Reason
from idtool.export.c_controller import export_c
from idtool.parameters import Parameters

FLAGS = (
    "-std=c99",
    "-Wall",
    "-Wextra",
    "-Wshadow",
    "-Wconversion",
    "-Wdouble-promotion",
    "-pedantic",
    "-Werror",
)
DRIVER = Path(__file__).parent / "driver.c"
#: Random motion agrees with no model; what is judged of a load at rest is in test_c_button.py.
UNJUDGED = Limits(mismatch=math.inf)
STEP, RECOVER, RESET, TARE = range(4)
LEARNED = ("load", "level", "damping")
NUMBERS = (
    "returned",
    "command",
    "torque",
    "wanted",
    "gravity",
    "friction",
    "effects",
    "uncertainty",
    *LEARNED,
)
_REQUEST = np.dtype(
    [("request", "u4"), ("clocked", "u4"), ("warm", "u4"), ("time_us", "u4"), ("up", "u4"), ("x", "f4", 7)]
)
_WORDS = ("state", "fault", "limited", "valid", "ready", "taring", "disturbed", "held")
_ANSWER = np.dtype([*((word, "u4") for word in _WORDS), ("x", "f4", len(NUMBERS))])
_STATES = [State.STARTING, State.RESTING, State.TARING, State.GUIDING, State.STOPPING, State.FAULT]
_LIMITED = {1: "speed", 2: "step", 4: "range"}


@dataclass
class Samples:
    """What both are fed, one row a step; numbers in single precision, so that both see the same.

    Attributes:
        x: position, velocity, current, payload, two tilts, temperature; shape (rows, 7).
        time_us: of the clock, shape (rows,).
        request: STEP, RECOVER, RESET or TARE before the step, shape (rows,).
        up: whether the teach button is up, shape (rows,) or one for all.
        clocked, warm: whether the clock and the temperature are given.
    """

    x: np.ndarray
    time_us: np.ndarray
    request: np.ndarray
    up: np.ndarray | int = 0
    clocked: bool = True
    warm: bool = True


@dataclass
class Answers:
    """What came out, one row a step: `x` holds NUMBERS, shape (rows, 11)."""

    state: list[str] = field(default_factory=list)
    fault: list[str | None] = field(default_factory=list)
    limited: list[frozenset[str]] = field(default_factory=list)
    valid: list[bool] = field(default_factory=list)
    ready: list[bool] = field(default_factory=list)
    taring: list[bool] = field(default_factory=list)
    disturbed: list[bool] = field(default_factory=list)
    x: np.ndarray = field(default_factory=lambda: np.empty((0, len(NUMBERS))))


def compile_c(
    parameters: Parameters,
    folder: Path,
    *,
    period_s: float | None = None,
    limits: Limits = UNJUDGED,
    without: Sequence[str] = (),
    sanitized: bool = False,
) -> Path:
    """Export, compile with every warning an error, and return the program."""
    export_c(parameters, folder, period_s=period_s, limits=limits, without=without, force=True)
    program = folder / "driver"
    checks = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g"] if sanitized else []
    command = ["gcc", *FLAGS, *checks, "-O1", "-I", folder, DRIVER, folder / "ffc.c", "-lm", "-o", program]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return program


def run_c(program: Path, samples: Samples) -> Answers:
    """The C's answers."""
    rows = np.zeros(len(samples.x), dtype=_REQUEST)
    rows["request"], rows["time_us"], rows["x"] = samples.request, samples.time_us, samples.x
    rows["up"] = samples.up
    rows["clocked"], rows["warm"] = samples.clocked, samples.warm
    done = subprocess.run([program], input=rows.tobytes(), capture_output=True, check=True)
    out = np.frombuffer(done.stdout, dtype=_ANSWER)
    reasons = [None, *(reason.value for reason in Reason)]
    return Answers(
        [
            "held" if held and state != State.FAULT else state.value
            for state, held in zip((_STATES[k] for k in out["state"]), out["held"], strict=True)
        ],
        [reasons[k] for k in out["fault"]],
        [frozenset(word for bit, word in _LIMITED.items() if k & bit) for k in out["limited"]],
        [bool(k) for k in out["valid"]],
        [bool(k) for k in out["ready"]],
        [bool(k) for k in out["taring"]],
        [bool(k) for k in out["disturbed"]],
        out["x"].astype(float),
    )


def run_python(
    parameters: Parameters, samples: Samples, *, period_s: float | None = None, limits: Limits = UNJUDGED
) -> Answers:
    """The Python controller's answers."""
    controller = ForceFreeController(parameters, period_s, limits=limits)
    answers, rows = Answers(), []
    ups = np.broadcast_to(samples.up, len(samples.x))
    for x, time_us, request, up in zip(samples.x, samples.time_us, samples.request, ups, strict=True):
        if request == RECOVER:
            controller.recover()
        elif request == RESET:
            controller.reset()
        answers.taring.append(request == TARE and controller.tare())
        *numbers, temperature = map(float, x)
        returned = controller.step(
            *numbers,
            temperature_degc=temperature if samples.warm else None,
            time_s=1e-6 * int(time_us) if samples.clocked else None,
            enabled=not up,
        )
        s = controller.status
        answers.state.append(s.state.value)
        answers.fault.append(s.fault.reason.value if s.fault else None)
        answers.limited.append(frozenset(s.limited))
        answers.valid.append(s.command_valid)
        answers.ready.append(controller.ready)
        answers.disturbed.append(any("is not used" in note for note in s.notes))
        load, level, damping = controller.learned or (0.0, 1.0, 1.0)
        rows.append(
            (
                returned,
                s.position_command,
                s.external_torque,
                s.velocity_wanted,
                s.gravity,
                s.friction,
                s.effects,
                s.uncertainty,
                load,
                level,
                damping,
            )
        )
    answers.x = np.array(rows)
    return answers


def motion(rows: int, period: float, seed: int, *, stroke: float = 1.0, hand: float = 0.3) -> Samples:
    """A random axis that moves, rests and is pushed, read by an encoder, with a clock that jitters.

    The numbers are no rig's: they only have to visit every state of the controller often.
    """
    rng = np.random.default_rng(seed)
    time_us = 1000 + np.cumsum(np.round(period * 1e6 * rng.uniform(0.8, 1.2, rows))).astype(np.int64)
    smooth = _smooth(rng, rows, 40)
    moving = _smooth(rng, rows, 150) > -0.3
    velocity = stroke * smooth * moving
    count = 2 * math.pi / 4096 * stroke
    position = np.round(np.cumsum(velocity * period) / count) * count
    push = hand * np.round(_smooth(rng, rows, 60)) * _smooth(rng, rows, 15)
    load = 0.23 + 0.4455 * 0.4
    current = (load + 0.09 * velocity + 0.05 * np.sign(velocity) - push) / 2.67
    current += rng.normal(0.0, 0.002, rows)
    payload = np.full(rows, 0.4)
    alpha = np.repeat(rng.uniform(-0.1, 0.1, rows // 500 + 1), 500)[:rows]
    temperature = 25.0 + 5.0 * _smooth(rng, rows, 800)
    columns = [position, velocity, current, payload, alpha, -0.05 + 0.0 * alpha, temperature]
    return Samples(np.column_stack(columns).astype(np.float32), time_us, np.zeros(rows, dtype=int))


def _smooth(rng: np.random.Generator, rows: int, width: int) -> np.ndarray:
    """Noise of unit variance that changes over about `width` rows."""
    noise = rng.normal(size=rows + 4 * width)
    kernel = np.hanning(4 * width + 1)
    return np.convolve(noise, kernel / np.sqrt(np.sum(kernel**2)), "valid")[:rows]
