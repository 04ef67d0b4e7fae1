"""The law on the plant, compiled together: what `ForceFreeController` does, without its guard.

A test holds the two together, sample by sample.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np

from idtool.control import ForceFreeController, Limits
from idtool.control.admittance import AdmittanceLaw, hand, kernel, tare
from idtool.control.load import carry
from idtool.model.motion import Array
from idtool.parameters import Parameters
from testbench.guided_machines import plant
from testbench.guided_machines.hands import PERIOD, Script
from testbench.guided_machines.machines import PAYLOAD_KG, STROKE
from testbench.guided_machines.plant import Plant

#: Steps of the plant, and what is kept, per period of the controller.
STEPS = round(PERIOD / plant.STEP_S)
PER = round(1e3 * PERIOD)
LIMITS = Limits(*STROKE, speed=2.0)
#: Columns of `Run.felt`.
COMMAND, RAW, HAND, STATE, DEAD, SPEED = range(6)


@dataclass(frozen=True)
class Run:
    """One script on one axis.

    Attributes:
        script: shape (periods, plant.SCRIPT).
        truth: position, speed, current, force of the hand once per ms, shape (4, ms).
        felt: command, hand's torque before and behind its filter, state, uncertainty, speed asked for; once
            per period, shape (periods, 6).
        ratio: travel of the slide, m per rad.
        outcome: of the tare.
    """

    script: Array
    truth: Array
    felt: Array
    ratio: float
    outcome: int


@numba.njit(cache=True)
def _earlier(signal: Array, k: int, delay: float) -> float:
    """What a signal was so long before period k, its latest; before the first it was as in the first."""
    back = k - max(delay, 0.0) / PERIOD
    if back >= k:
        return float(signal[k])
    before = int(max(back, 0.0))
    share = max(back, 0.0) - before
    return float(signal[before] + share * (signal[before + 1] - signal[before]))


@numba.njit(cache=True)
def _run(
    p: Plant, body: Array, past: Array, script: Array, noise: Array, n: Array, m: Array, c: Any, s: Any,
    payload: float, start: float,
) -> tuple[Array, Array]:  # fmt: skip
    count = len(script)
    carried = np.empty(count)
    truth, felt = np.empty((plant.KEPT, count * PER)), np.empty((count, 6))
    before = command = start
    last = 0.0
    for k in range(count):
        after = script[min(k + 1, count - 1)]
        plant.advance(p, body, past, script[k], after, before, command, False, STEPS, truth, k * PER)
        before = command
        q, w, current = plant.reading(p, body, past, noise[k], PER // 2)
        if k == 0:
            kernel.begin(c, s, q)
            last = q
        if script[k, plant.TARE] > 0.0:
            tare.tare(c, s)
        change = hand.watch(c, s, w)
        gravity, elastic, damping, rest, _, saturation, gain, delay, _, kept, bent = carry(
            n, m, (k + 1) * PERIOD, PERIOD, q, s.seen, change / PERIOD, payload, 0.0, 0.0, math.nan, q - last
        )  # fmt: skip
        last = q
        motor = c.torque_constant * current
        carried[k] = gravity + elastic + damping + rest
        plain = _earlier(carried, k, -delay) - motor * (1.0 + gain - saturation * abs(motor))
        raw = kernel.act(c, s, q, w, current, plain, elastic, damping, kept, bent)
        command = min(max(raw, c.low), c.high)
        felt[k] = np.array([command, s.raw, s.hand, float(s.state), s.dead, s.w])
    return truth, felt


def controller_of(file: Parameters) -> ForceFreeController:
    """The controller of a file, in mode "light"."""
    return ForceFreeController(file, PERIOD, mode="light", limits=LIMITS)


def session(file: Parameters, p: Plant, script: Script, seed: int, start: float = 0.0) -> Run:
    """Run a script; `start`: where the axis stands, rad."""
    law = controller_of(file).law
    assert isinstance(law, AdmittanceLaw)
    rng = np.random.default_rng(seed)
    body, past = plant.at_rest(p, start, float(rng.uniform(-0.9, 0.9)))
    rows = script.table()
    noise = rng.standard_normal((len(rows), 3))
    numbers, memory = law.model._numbers, law.model._memory
    truth, felt = _run(
        p, body, past, rows, noise, numbers, memory, law.constants, law._s, PAYLOAD_KG, start
    )  # fmt: skip
    return Run(rows, truth, felt, p.ratio, int(law._s["outcome"]))
