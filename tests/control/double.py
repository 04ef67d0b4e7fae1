"""A small axis for the controller's tests: LuGre, gravity, inertia, and a servo around it.

It is written apart from the package's model (explicit Euler in microseconds, its own formulas), so
that agreement of the two is a finding and not a tautology.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numba
import numpy as np

from idtool.parameters import EffectEntry, Parameter, Parameters
from idtool.parameters.axis import Axis
from idtool.rig.base import Block, Limits, Rig, Sample, Trajectory, TrialSetup

PAPER = {
    "base": 2 * 0.0265 * (6 / 7) * 9.80665 * (0.427 + 0.176 / 2),
    "per_payload": 2 * 0.0265 * (6 / 7) * 9.80665,
    "coulomb": 0.070,
    "static": 0.030,
    "stribeck_velocity": 0.090,
    "viscous": 0.155,
    "bristle_stiffness": 0.051,
    "bristle_damping": 0.297,
}
#: an ordinary gearbox: static above Coulomb, a stiffer bristle
BENCH = PAPER | {
    "coulomb": 0.05,
    "static": 0.075,
    "viscous": 0.08,
    "bristle_stiffness": 8.0,
    "bristle_damping": 0.1,
}


def parameters(values: dict[str, float] = PAPER, **effects: dict[str, float]) -> Parameters:
    """A parameter file with these numbers."""

    def pick(*names: str) -> dict[str, Parameter]:
        return {name: Parameter(values[name]) for name in names}

    return Parameters(
        axis=Axis("rotary", 2.67),
        gravity_model="slide",
        gravity=pick("base", "per_payload"),
        static=pick("coulomb", "static", "stribeck_velocity", "viscous"),
        dynamic=pick("bristle_stiffness", "bristle_damping"),
        effects=tuple(
            EffectEntry(name, {k: Parameter(v) for k, v in numbers.items()})
            for name, numbers in effects.items()
        ),
    )


_STEP_S = 1e-4


def _advance(
    state: Any, friction: Any, bristle: Any, steps: int, command: float, gain: float,
    outside: float, inertia: float, extra: Any,
) -> Any:  # fmt: skip
    """Explicit Euler; `outside` is the torque of hand and gravity."""
    q, w, z, integral, motor = state
    coulomb, static, stribeck = friction
    stiffness, damping, viscous = bristle
    for _ in range(steps):
        wanted = min(max(gain * (command - q), -3.0), 3.0)
        error = wanted - w
        integral += 30.0 * error * _STEP_S
        motor = min(max(1.0 * error + integral, -6.0), 6.0)
        level = coulomb + (static - coulomb) * math.exp(-((w / stribeck) ** 2))
        rate = w - stiffness * abs(w) / level * z
        torque = motor + outside - stiffness * z - damping * rate - viscous * w
        if extra is not None:
            torque -= extra(q, w)
        w += _STEP_S * torque / inertia
        z += _STEP_S * rate
        q += _STEP_S * w
    return q, w, z, integral, motor


_advance_compiled = numba.njit(cache=True)(_advance)


@dataclass
class Double(Rig):
    """A rig.

    Attributes:
        values: the truth.
        position_gain: position loop, 1/s.
        extra: further torque the motor must carry, of (position, velocity), N m.
        real_payload: kg on the slide; None: the payload of the set-up.
        noisy: quantised and noisy sensors, as a servo reports them.
    """

    values: dict[str, float] = field(default_factory=lambda: dict(PAPER))
    position_gain: float = 8.0
    inertia: float = 0.02
    extra: Callable[[float, float], float] | None = None
    real_payload: float | None = None
    noisy: bool = True
    seed: int = 0
    bristle: float = 0.3
    period_s: float = 0.01
    axis: Axis = field(default_factory=lambda: Axis("rotary", 2.67))
    limits: Limits = field(default_factory=lambda: Limits(position=(-2.6, 2.6), speed=3.0, current=4.0))
    simulated: bool = True
    description: str = "a small axis for tests"

    def prepare(self, setup: TrialSetup) -> None:
        self.payload = setup.payload_kg if self.real_payload is None else self.real_payload
        self.factor = math.cos(setup.tilt_alpha_rad) * math.cos(setup.tilt_beta_rad)
        self.q = setup.start_position if setup.start_position is not None else 0.25
        self.w = self.time = 0.0
        self.rng = np.random.default_rng(self.seed)
        v = self.values
        self.gravity = (v["base"] + v["per_payload"] * self.payload) * self.factor
        most = max(v["coulomb"], v["static"]) / v["bristle_stiffness"]  # no bristle is bent further
        self.z = min(max(self.bristle, -most), most)
        self.integral = self.gravity + v["bristle_stiffness"] * self.z
        self.motor = self.integral

    def step(self, position_command: float, external_torque_nm: float = 0.0) -> Sample:
        v = self.values
        friction = (v["coulomb"], v["static"], v["stribeck_velocity"])
        bristle = (v["bristle_stiffness"], v["bristle_damping"], v["viscous"])
        state = (self.q, self.w, self.z, self.integral, self.motor)
        advance = _advance_compiled if self.extra is None else _advance
        self.q, self.w, self.z, self.integral, self.motor = advance(
            state, friction, bristle, round(self.period_s / _STEP_S), position_command, self.position_gain,
            external_torque_nm - self.gravity, self.inertia, self.extra,
        )  # fmt: skip
        self.time += self.period_s
        q, w, i = self.q, self.w, self.motor / 2.67
        if self.noisy:
            count, lsb = 2 * math.pi / 4096, 0.229 * 2 * math.pi / 60
            q, w = round(q / count) * count, round(w / lsb) * lsb
            i = round((i + self.rng.normal(0, 0.002)) / 0.00269) * 0.00269
        return Sample(self.time, q, w, i, 25.0)

    def play(self, trajectory: Trajectory) -> Iterator[Block]:
        """Only what hand guiding plays: standing still."""
        assert trajectory.mode == "velocity"
        assert not trajectory.command.any()
        rows = [self.step(self.q) for _ in trajectory.command]
        columns = np.array([[s.time_s, s.position, s.velocity, s.current, s.temperature] for s in rows]).T
        yield Block(*columns[:4], trajectory.command, columns[4])

    def stop(self) -> None: ...

    def close(self) -> None: ...
