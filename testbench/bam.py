"""BAM's models M1 to M6 of a servo that swings a pendulum, and BAM's simulator, written anew.

    J dw/dt = motor + gravity - friction
    motor   = kt / R (volts - kt w) while the drive is on, volts = vin * duty
    duty    = gain * kp * (goal(t - delay) - q), within +-1
    gravity = -m g l sin(q + offset),  J = m l^2 + armature

Friction is what stops the axis within a step, up to a level that is base and viscous friction (M1), and what
gears take of the torque through them (M3), each with a part that fades with speed (M2, M4), the motor's and
the load's side apart (M5), and a square of the load where the two oppose each other (M6).

As BAM does, logs are brought to a grid of 5 ms, every trial starts from its first row, and a model's error
is the mean over the logs of their mean absolute errors of the position.

Source: Duclusaud, Passault, Padois, Ly, "Extended Friction Models for the Physics Simulation of Servo
Actuators", 2024; https://github.com/Rhoban/bam (formulas, step, ranges; delay of the goal as in its newer
versions).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from idtool.importing import import_recording
from idtool.log import Log
from idtool.model.jit import jit
from idtool.model.motion import Array
from idtool.simulation.stage import Source

STEP_S = 0.005
#: Duty per rad of error and unit of the gain: counts of a turn over counts of duty, and the gain's divisor.
ERROR_GAIN = 4096.0 / (2.0 * math.pi) / (256.0 * 885.0)
_GRAVITY, _FASTEST = 9.80665, 100.0

GAINS = (100, 200, 800)
TRAJECTORIES = ("lift_and_drop", "sin_sin", "up_and_down")
#: What is left out -> the logs (gain, trajectory) that no fit sees.
SPLITS: dict[str, list[tuple[int, str]]] = {
    **{f"gain {gain}": [(gain, kind) for kind in TRAJECTORIES] for gain in GAINS},
    **{f"trajectory {kind}": [(gain, kind) for gain in GAINS] for kind in TRAJECTORIES},
}
EVALUATIONS = 30_000
#: Points of a generation, and the first spread as a share of the ranges.
_POPULATION, _SPREAD = 30, 1.0 / 6.0
#: A search ends where the cost of all points differs by less, rad.
_FINE = 1e-6
#: Two searches that end within this share of each other came to the same end.
_SAME = 0.005
#: Name -> range that is searched. BAM's file for this servo begins `kt` at 0.3, above the 0.29 that BAM
#: published for it.
RANGES: dict[str, tuple[float, float]] = {
    "kt": (0.1, 3.0),
    "R": (0.5, 5.0),
    "armature": (1e-4, 0.05),
    "q_offset": (-0.1, 0.1),
    "command_delay": (0.0, 0.05),
    "friction_base": (0.0, 0.2),
    "friction_viscous": (0.0, 1.0),
    "friction_stribeck": (0.0, 0.2),
    "dtheta_stribeck": (0.1, 1.0),
    "alpha": (1.0, 10.0),
    "load_friction_base": (0.0, 0.5),
    "load_friction_stribeck": (0.0, 1.0),
    "load_friction_motor": (0.0, 0.5),
    "load_friction_external": (0.0, 0.5),
    "load_friction_motor_stribeck": (0.0, 1.0),
    "load_friction_external_stribeck": (0.0, 1.0),
    "load_friction_motor_quad": (0.0, 0.01),
    "load_friction_external_quad": (0.0, 0.01),
}
_PLAIN = ("kt", "R", "armature", "q_offset", "command_delay", "friction_base", "friction_viscous")
_FADING = ("friction_stribeck", "dtheta_stribeck", "alpha")
_SIDES = (
    "load_friction_motor",
    "load_friction_external",
    "load_friction_motor_stribeck",
    "load_friction_external_stribeck",
)
_SQUARES = ("load_friction_motor_quad", "load_friction_external_quad")
#: Model -> its parameters.
MODELS: dict[str, tuple[str, ...]] = {
    "M1": _PLAIN,
    "M2": (*_PLAIN, *_FADING),
    "M3": (*_PLAIN, "load_friction_base"),
    "M4": (*_PLAIN, *_FADING, "load_friction_base", "load_friction_stribeck"),
    "M5": (*_PLAIN, *_FADING, *_SIDES),
    "M6": (*_PLAIN, *_FADING, *_SIDES, *_SQUARES),
}
#: What the kernel takes: what M3 and M4 have on both sides alike is on each of them here.
_NUMBERS = (*_PLAIN, *_FADING, *_SIDES, *_SQUARES)
_ALIKE = {
    "load_friction_base": ("load_friction_motor", "load_friction_external"),
    "load_friction_stribeck": ("load_friction_motor_stribeck", "load_friction_external_stribeck"),
}
_OFF = {"dtheta_stribeck": 1.0, "alpha": 1.0}


def bam_logs(folder: Path) -> dict[tuple[int, str], Log]:
    """The nine logs of the XL330."""
    return {
        (gain, kind): import_recording(folder / "xl330" / f"kp{gain}_{kind}.json.gz").log
        for gain in GAINS
        for kind in TRAJECTORIES
    }


@dataclass(frozen=True)
class Swings:
    """Trials of one pendulum on the grid, one after the other.

    Attributes:
        goal, volts, on, position: at every step; volts is the duty times the supply as they were logged, on
            is 1 or 0, shape (steps,).
        begins: the first step of each trial and the end of the last, shape (trials + 1,).
        velocity: of each trial's first row, shape (trials,).
        told: gain setting, supply voltage, mass and lever of each trial, shape (trials, 4).
        rows: time from its first row on and position of each trial's rows, as they were logged.
    """

    goal: Array
    volts: Array
    on: Array
    position: Array
    begins: NDArray[np.int64]
    velocity: Array
    told: Array
    rows: tuple[tuple[Array, Array], ...]

    @classmethod
    def of(cls, logs: Sequence[Log]) -> Swings:
        """Bring imported logs of BAM to the grid."""
        parts: dict[str, list[Array]] = {name: [] for name in ("goal", "volts", "on", "position")}
        rows, velocity, told = [], [], []
        for log in logs:
            facts, frame = log.header["bam"], log.frame
            time = frame["time_s"].to_numpy() - float(frame["time_s"].iloc[0])
            grid = np.arange(0.0, time[-1], STEP_S)
            columns = {
                "goal": frame["position_command_rad"],
                "volts": frame["duty"] * frame["supply_voltage_v"],
                "on": frame["drive_on"],
                "position": frame["position_rad"],
            }
            for name, column in columns.items():
                parts[name].append(np.interp(grid, time, column.to_numpy(dtype=float)))
            parts["on"][-1] = np.where(parts["on"][-1] > 0.5, 1.0, 0.0)
            rows.append((time, frame["position_rad"].to_numpy(dtype=float)))
            velocity.append(float(frame["velocity_rad_s"].iloc[0]))
            told.append([float(facts[name]) for name in ("kp", "vin", "mass", "length")])
        begins = np.cumsum([0, *(len(one) for one in parts["goal"])])
        joined = {name: np.concatenate(values) for name, values in parts.items()}
        return cls(
            **joined, begins=begins, velocity=np.array(velocity), told=np.array(told), rows=tuple(rows)
        )

    def path(self, values: Mapping[str, float], source: Source = "goal") -> Array:
        """Simulated position at every step, shape (steps,)."""
        given = self.goal if source == "goal" else self.volts
        path = np.empty(len(given))
        trials = (self.on, self.position, self.begins, self.velocity, self.told)
        _simulate(numbers_of(values), given, *trials, source == "goal", path)
        return path

    def cost(self, values: Mapping[str, float]) -> float:
        """What BAM minimises, driven by the goals, rad."""
        off = np.abs(self.path(values) - self.position)
        return float(np.mean(np.add.reduceat(off, self.begins[:-1]) / np.diff(self.begins)))

    def errors(self, values: Mapping[str, float], source: Source) -> list[float]:
        """Mean absolute error over the rows of each trial, rad."""
        path = self.path(values, source)
        found = []
        for trial, (time, position) in enumerate(self.rows):
            own = path[self.begins[trial] : self.begins[trial + 1]]
            there = np.interp(time, STEP_S * np.arange(len(own)), own)
            found.append(float(np.mean(np.abs(there - position))))
        return found


def numbers_of(values: Mapping[str, float]) -> Array:
    """A model's parameters as the kernel takes them."""
    known = {**_OFF, **values}
    for name, sides in _ALIKE.items():
        known |= dict.fromkeys(sides, values[name]) if name in values else {}
    return np.array([known.get(name, 0.0) for name in _NUMBERS])


@jit(error_model="numpy")
def _simulate(
    numbers: Array,
    given: Array,
    on: Array,
    position: Array,
    begins: NDArray[np.int64],
    velocity: Array,
    told: Array,
    by_goal: bool,
    path: Array,
) -> None:
    kt, resistance, armature, offset, delay, base, viscous = numbers[:7]
    fading, fades_at, exponent = numbers[7:10]
    by_motor, by_load, by_motor_fading, by_load_fading = numbers[10:14]
    squared_motor, squared_load = numbers[14:16]
    curved = fading > 0.0 or np.any(numbers[12:16] > 0.0)
    per_volt = kt / resistance
    whole = int(delay / STEP_S)
    part = delay / STEP_S - whole
    trials = len(velocity)
    q = position[begins[:-1]].copy()
    w = velocity.copy()
    # trials side by side: what one waits for, another computes
    for step in range(np.max(np.diff(begins))):
        for trial in range(trials):
            begin = begins[trial]
            k = begin + step
            if k >= begins[trial + 1]:
                continue
            path[k] = q[trial]
            if by_goal:
                near, far = max(k - whole, begin), max(k - whole - 1, begin)
                goal = (1.0 - part) * given[near] + part * given[far]
                duty = told[trial, 0] * ERROR_GAIN * (goal - q[trial])
                volts = told[trial, 1] * min(max(duty, -1.0), 1.0)
            else:
                volts = given[k]
            mass, lever = told[trial, 2], told[trial, 3]
            speed = abs(w[trial])
            motor = on[k] * per_volt * (volts - kt * w[trial])
            load = -mass * _GRAVITY * lever * math.sin(q[trial] + offset)
            level = base + abs(by_load * load - by_motor * motor)
            if curved:
                stuck = fading + abs(by_load_fading * load - by_motor_fading * motor)
                if np.sign(load) != np.sign(motor):
                    if abs(load) < abs(motor):
                        stuck += squared_load * load * load
                    elif abs(load) > abs(motor):
                        stuck += squared_motor * motor * motor
                if speed > 0.0:
                    stuck *= math.exp(-math.exp(min(exponent * math.log(speed / fades_at), 6.0)))
                level += stuck
            per_step = STEP_S / (mass * lever * lever + armature)
            free = w[trial] + per_step * (motor + load)
            left = max(abs(free) - per_step * (level + viscous * speed), 0.0)
            w[trial] = math.copysign(min(left, _FASTEST), free)
            q[trial] += w[trial] * STEP_S


def search(
    swings: Swings, model: str, seed: int, evaluations: int = EVALUATIONS
) -> tuple[dict[str, float], int]:
    """A model's parameters by CMA-ES, and how often the logs were simulated.

    From the middle of the ranges and then from points drawn in them, until as many evaluations are spent or a
    search comes to the same end as the best one before it.

    Source: Hansen, "The CMA Evolution Strategy: A Tutorial", 2016, by his own package.
    """
    import cma

    names = MODELS[model]
    low, high = np.array([RANGES[name] for name in names]).T

    def values_at(share: Array) -> dict[str, float]:
        return dict(zip(names, (low + share * (high - low)).tolist(), strict=True))

    random = np.random.default_rng(seed)
    start, best, least, spent = np.full(len(names), 0.5), {}, np.inf, 0
    while evaluations - spent >= _POPULATION:
        options = {
            "bounds": [0.0, 1.0],
            "popsize": _POPULATION,
            "maxfevals": evaluations - spent,
            "tolfun": _FINE,
            "tolfunhist": 0.1 * _FINE,
            "seed": int(random.integers(1, 2**31)),
            "verbose": -9,
        }
        strategy = cma.CMAEvolutionStrategy(start, _SPREAD, options)
        found = strategy.optimize(lambda share: swings.cost(values_at(share))).result
        spent += int(found.evaluations)
        again = abs(found.fbest - least) < _SAME * least
        if found.fbest < least:
            least, best = found.fbest, values_at(found.xbest)
        if again:
            break
        start = random.uniform(size=len(names))
    return best, spent
