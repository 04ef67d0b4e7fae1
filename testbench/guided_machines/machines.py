"""Machines, the sessions recorded on them, and the files identified from these."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from idtool import Log, Parameters
from idtool.experiment.recipe import read_recipe
from idtool.model.motion import Array
from idtool.parameters.axis import Axis
from idtool.rig.base import Block, Limits, Rig, Sample, Trajectory, TrialSetup
from idtool.verbs.identify import identify
from testbench.guided_machines import plant
from testbench.guided_machines.plant import ELASTO_PLASTIC, LUGRE, MAXWELL, Plant
from testbench.plants import SESSION, TORQUE_CONSTANT, recorded

PAYLOAD_KG = 0.4
STROKE = (-2.3, 2.3)
#: How far beyond the limits of the command the slide meets its stops, rad.
_STOPS = 0.04


@dataclass(frozen=True)
class Machine:
    """What does not change from day to day; `plant` carries nothing and stands upright."""

    name: str
    base: float
    per_payload: float
    plant: Plant

    def on(self, payload: float, tilt: float = 1.0) -> Plant:
        """With a payload, kg; `tilt`: share of gravity that acts."""
        return self.plant._replace(weight=(self.base + self.per_payload * payload) * tilt)


def random_machine(rng: np.random.Generator, number: int) -> Machine:
    """A soft one around the published axis, or a stiff one, by turns."""
    soft = number % 2 == 0
    inertia = 0.006 * _about(rng, 1.3) if soft else 0.008 * _about(rng, 1.3)
    per_payload = 0.4457 if soft else 0.42
    bandwidth = 2.0 * math.pi * rng.uniform(14.0, 26.0)
    coulomb = 0.070 * _about(rng, 1.25) if soft else 0.080 * _about(rng, 1.25)
    static = coulomb * (0.43 if soft else rng.uniform(1.05, 1.45)) * _about(rng, 1.1)
    # readings of one packet are equally old; on other drives the current alone is fresh
    delay = float(rng.uniform(0.0, 0.02))
    name = f"{'soft' if soft else 'stiff'}-{number}"
    return Machine(
        name,
        0.2295 if soft else 0.20,
        per_payload,
        Plant(
            torque_constant=TORQUE_CONSTANT,
            inertia=inertia,
            weight=0.0,
            ratio=per_payload / plant.GRAVITY,
            friction=LUGRE if soft else (LUGRE, ELASTO_PLASTIC, MAXWELL)[number // 2 % 3],
            coulomb=coulomb,
            static=static,
            stribeck_velocity=0.09 * _about(rng, 1.3),
            viscous=(0.155 if soft else 0.12) * _about(rng, 1.25),
            presliding=1.37 * _about(rng, 1.3) if soft else 0.014 * _about(rng, 1.7),
            bristle_damping=(0.297 if soft else 0.2) * _about(rng, 1.3),
            uneven=float(rng.uniform(-0.08, 0.08)),
            along=float(rng.uniform(-0.08, 0.08)),
            ripple=float(rng.uniform(0.0, 0.010)),
            ripple_cycles=float(rng.integers(6, 40)),
            ripple_phase=float(rng.uniform(-3.1, 3.1)),
            position_gain=float(rng.uniform(15.0, 25.0)),
            velocity_gain=inertia * bandwidth,
            integral_gain=inertia * bandwidth**2 / 6.0,
            acceleration=40.0,
            speed_limit=2.0,
            current_limit=1.5,
            command_delay=float(rng.uniform(0.0005, 0.003)),
            motion_delay=delay,
            current_delay=delay if rng.random() < 0.6 else 0.0,
            stop_low=STROKE[0] - _STOPS,
            stop_high=STROKE[1] + _STOPS,
        ),
    )


def _about(rng: np.random.Generator, factor: float) -> float:
    return float(factor ** rng.uniform(-1.0, 1.0))


class StudyRig(Rig):
    """The plant as a rig, so that the packaged recipes run on it."""

    simulated = True

    def __init__(self, machine: Machine, seed: int) -> None:
        self.axis = Axis("rotary", TORQUE_CONSTANT)
        self.limits = Limits((STROKE[0] - 0.2, STROKE[1] + 0.2), 2.0, 1.5)
        self.period_s = 0.005
        self.description = "study of hand guiding"
        self._machine, self._rng = machine, np.random.default_rng(seed)
        self._time = self._place = 0.0

    def prepare(self, setup: TrialSetup) -> None:
        """Stand at the start, the bristle bent by nobody knows how much."""
        tilt = math.cos(setup.tilt_alpha_rad) * math.cos(setup.tilt_beta_rad)
        wide = self._machine.plant.stop_high + 1.0
        on = self._machine.on(setup.payload_kg, tilt)
        self._plant = on._replace(stop_low=-wide, stop_high=wide)
        start = self._place if setup.start_position is None else setup.start_position
        bent = float(self._rng.uniform(-0.9, 0.9))
        self._state, self._past = plant.at_rest(self._plant, start, bent)
        self._before = start
        self._time += 2.0

    def play(self, trajectory: Trajectory) -> Iterator[Block]:
        """Follow the commands."""
        command = trajectory.held(self.period_s)
        for part in np.array_split(command, max(1, len(command) // 50)):
            rows = self._follow(part, trajectory.mode == "velocity")
            time = self._time + self.period_s * np.arange(1.0, len(part) + 1)
            self._time = float(time[-1])
            yield Block(time, rows[:, 0], rows[:, 1], rows[:, 2], part)

    def _follow(self, commands: Array, speed_mode: bool) -> Array:
        noise = self._rng.standard_normal((len(commands), 3))
        rows = plant.follow(self._plant, self._state, self._past, self._before, commands, speed_mode, noise)
        self._before, self._place = float(commands[-1]), float(self._state[plant.Q])
        return rows

    def step(self, position_command: float, external_torque_nm: float = 0.0) -> Sample:
        """One period in position mode, without a hand."""
        self._time += self.period_s
        return Sample(self._time, *self._follow(np.array([position_command]), False)[0].tolist())

    def stop(self) -> None:
        """Nothing moves between trials."""

    def close(self) -> None:
        """Nothing to close."""


def session_of(machine: Machine, seed: int) -> list[Log]:
    """The packaged experiments, one after another."""
    return recorded(StudyRig(machine, seed), map(read_recipe, SESSION))


def file_of(machine: Machine, seed: int, cache: Path) -> Parameters:
    """The parameter file that `identify` makes of a session of the machine; kept in `cache`.

    Args:
        machine: on which the session is recorded.
        seed: of its noise.
        cache: folder of the files.
    """
    path = cache / f"{machine.name}-{seed}.toml"
    if not path.exists():
        cache.mkdir(parents=True, exist_ok=True)
        identify(session_of(machine, seed)).parameters.write(path)
    return Parameters.read(path)


def on_a_day(rng: np.random.Generator, machine: Machine, payload_off: float) -> Plant:
    """The machine on another day: friction off by up to 30 %, payload by so much, kg."""
    p = machine.on(PAYLOAD_KG + float(rng.uniform(-payload_off, payload_off)))
    level, viscous = rng.uniform(0.7, 1.3, 2)
    return replace_friction(p, float(level), float(viscous))


def replace_friction(p: Plant, level: float, viscous: float) -> Plant:
    """Friction level and what goes with speed, times these."""
    return p._replace(
        coulomb=p.coulomb * level,
        static=p.static * level,
        viscous=p.viscous * viscous,
        bristle_damping=p.bristle_damping * viscous,
    )
