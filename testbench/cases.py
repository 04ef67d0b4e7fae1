"""What the axes of the study of the diagnosis have besides the base model.

Effects of the library go into the simulated plant. Disturbances that are NOT in the library are added to
the current of the log as functions of the true motion, as if the drive had rejected them perfectly.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from idtool.errors import FfcIdError
from idtool.log import Log
from idtool.rig.plant_file import EFFECT_KEYS
from idtool.rig.sensors import SENSORS
from testbench.draws import between, sign
from testbench.plants import TORQUE_CONSTANT, Plant, record_session

Draw = Callable[[np.random.Generator, float], dict[str, float]]


#: Effect -> how its numbers are drawn, the range of its strength, in the keys of a plant file. Inertia is
#: in every axis.
EFFECTS: dict[str, tuple[float, float, Draw]] = {
    "torque_offset": (0.005, 0.08, lambda r, s: {"offset_nm": s * sign(r)}),
    "direction_asymmetry": (0.01, 0.2, lambda r, s: {"asymmetry_nm_s_per_rad": s * sign(r)}),
    "load_dependent_friction": (0.01, 0.15, lambda r, s: {"mu": s}),
    "drive_backdrive": (0.02, 0.2, lambda r, s: {"mu_drive": s, "mu_backdrive": s * r.uniform(0.0, 0.4)}),
    "position_ripple": (
        0.005,
        0.08,
        lambda r, s: {
            "cycles_per_turn": between(r, 3.0, 40.0),
            "amplitude_1_nm": s,
            "phase_1_rad": r.uniform(-math.pi, math.pi),
            "amplitude_2_nm": s * r.choice((0.0, 0.4)),
            "phase_2_rad": r.uniform(-math.pi, math.pi),
        },
    ),
    "position_dependent_friction": (
        0.05,
        0.6,
        lambda r, s: {"slope_1": s * sign(r), "slope_2": s * r.uniform(-0.5, 0.5), "half_stroke_rad": 2.5},
    ),
    "position_stiffness": (
        0.003,
        0.06,
        lambda r, s: {"stiffness_nm_per_rad": s * sign(r), "neutral_rad": r.uniform(-0.5, 0.5)},
    ),
    "thermal_drift": (0.01, 0.06, lambda r, s: {"rate_per_k": s}),
    "nonlinear_viscous": (0.02, 0.4, lambda r, s: {"quadratic_nm_s2_per_rad2": s * sign(r)}),
    "stribeck_shape": (0.5, 1.3, lambda r, s: {"exponent": s}),
    "backlash": (0.2, 0.8, lambda r, s: {"share_behind_gap": s, "gap_rad": between(r, 0.01, 0.1)}),
    "hysteresis": (
        0.005,
        0.05,
        lambda r, s: {"yield_nm": s, "stiffness_nm_per_rad": s / between(r, 0.02, 0.5)},
    ),
    "compliance": (
        0.003,
        0.02,
        lambda r, s: {
            "load_inertia_kg_m2": s,
            "stiffness_nm_per_rad": s * (2.0 * math.pi * between(r, 2.0, 12.0)) ** 2,
            "damping_nm_s_per_rad": 2.0 * 0.05 * s * 2.0 * math.pi * 5.0,
        },
    ),
    "transport_delay": (0.003, 0.04, lambda r, s: {"delay_s": s}),
    "torque_constant_saturation": (0.02, 0.3, lambda r, s: {"kappa_per_a": s}),
    "external_periodic": (
        0.005,
        0.08,
        lambda r, s: {
            "frequency_hz": between(r, 0.15, 5.0),
            "amplitude_nm": s,
            "phase_rad": r.uniform(-math.pi, math.pi),
        },
    ),
    "tilt_misalignment": (0.02, 0.15, lambda r, s: {"alpha_rad": s * sign(r)}),
    "breakaway_dwell": (0.3, 2.0, lambda r, s: {"gain": s, "time_constant_s": between(r, 0.3, 3.0)}),
}


@dataclass(frozen=True)
class Truth:
    """What an axis has.

    Attributes:
        plant: the axis with its effects.
        effects: their names.
        size: root mean square of the torque that they add, over the sensor noise of a reading.
    """

    plant: Plant
    effects: tuple[str, ...]
    size: tuple[float, ...]


def noise_of(sensors: str) -> float:
    """Standard deviation of a torque reading, N m."""
    grade = SENSORS[sensors]
    return TORQUE_CONSTANT * math.sqrt(grade.current_noise**2 + grade.current_step**2 / 12.0)


def draw_effects(
    plant: Plant, names: tuple[str, ...], rng: np.random.Generator, sensors: str, recipes: tuple[str, ...]
) -> Truth:
    """Give an axis effects, each of 1 to 10 times the sensor noise; the rare one that cannot be so strong
    or weak on that axis has the size that is noted."""
    chosen: dict[str, dict[str, float]] = {}
    sizes = []
    for name in names:
        numbers, size = _draw(plant, name, rng, sensors, recipes)
        chosen[name] = numbers
        sizes.append(size)
    return Truth(replace(plant, effects=chosen), names, tuple(sizes))


def _draw(
    plant: Plant, name: str, rng: np.random.Generator, sensors: str, recipes: tuple[str, ...]
) -> tuple[dict[str, float], float]:
    low, high, make = EFFECTS[name]
    found: tuple[dict[str, float], float] | None = None
    quiet = _torque(plant, recipes)
    for _ in range(12):
        optional = {key: value for key, value in EFFECT_KEYS[name].items() if value is not None}
        numbers = optional | make(rng, between(rng, low, high))
        if name == "transport_delay":  # the torque is the same, its motion is read late
            loud = _late(plant, recipes, numbers["delay_s"])
        else:
            try:
                loud = _torque(replace(plant, effects={name: numbers}), recipes)
            except FfcIdError:  # too strong for that axis to move
                continue
        size = float(np.sqrt(np.mean((loud - quiet) ** 2))) / noise_of(sensors)
        if found is None or _outside(size) < _outside(found[1]):
            found = numbers, size
        if _outside(size) == 0.0:
            break
    assert found is not None
    return found


def _outside(size: float) -> float:
    """How far a size is from the range of 1 to 10."""
    return max(-math.log(size), math.log(size / 10.0), 0.0) if size > 0 else math.inf


def _late(plant: Plant, recipes: tuple[str, ...], delay: float) -> np.ndarray:
    """The torque as it was so long before, s."""
    parts = []
    for log in record_session(plant, "ideal", 0, recipes):
        for _, trial in log.frame.groupby("trial", sort=False):
            time = trial["time_s"].to_numpy()
            parts.append(np.interp(time - delay, time, TORQUE_CONSTANT * trial["current_a"].to_numpy()))
    return np.concatenate(parts)


def _torque(plant: Plant, recipes: tuple[str, ...]) -> np.ndarray:
    logs = record_session(plant, "ideal", 0, recipes)
    return np.concatenate([TORQUE_CONSTANT * log.frame["current_a"].to_numpy() for log in logs])


@dataclass(frozen=True)
class Disturbance:
    """Something that no effect of the library is.

    Attributes:
        variables: what it is a function of; the diagnosis should name one of them.
        partly: effects of the library that are a true part of it.
        torque: from a generator and the columns of a log, before it is scaled.
    """

    variables: tuple[str, ...]
    torque: Callable[[np.random.Generator, Log], np.ndarray]
    partly: tuple[str, ...] = ()


def _speed_bump(rng: np.random.Generator, log: Log) -> np.ndarray:
    w = log.frame["velocity_command_rad_s"].to_numpy()
    at, width = rng.uniform(0.15, 0.35), rng.uniform(0.02, 0.04)
    return np.asarray(np.sign(w) * np.exp(-(((np.abs(w) - at) / width) ** 2)))


def _damaged_tooth(rng: np.random.Generator, log: Log) -> np.ndarray:
    q = log.frame["position_rad"].to_numpy()
    at, width = rng.uniform(-0.3, 0.3), rng.uniform(0.02, 0.06)
    return np.asarray(np.exp(-(((q - at) / width) ** 2)))


def _random_walk(rng: np.random.Generator, log: Log) -> np.ndarray:
    t = log.frame["time_s"].to_numpy()
    knots = np.arange(0.0, 4000.0, 8.0)
    walk = np.cumsum(rng.standard_normal(len(knots)))
    return np.asarray(np.interp(t, knots, walk) - float(np.mean(np.interp(t, knots, walk))))


def _sudden_wear(rng: np.random.Generator, log: Log) -> np.ndarray:
    t, w = log.frame["time_s"].to_numpy(), log.frame["velocity_command_rad_s"].to_numpy()
    return np.asarray(np.sign(w) * (t > rng.uniform(200.0, 320.0)))


def _overload(rng: np.random.Generator, log: Log) -> np.ndarray:
    """A bearing that grips above some payload."""
    m, w = log.frame["payload_kg"].to_numpy(), log.frame["velocity_command_rad_s"].to_numpy()
    return np.asarray(np.sign(w) * np.maximum(m - rng.uniform(0.8, 1.2), 0.0))


def _end_stop(rng: np.random.Generator, log: Log) -> np.ndarray:
    """A cable that tightens towards one end."""
    q = log.frame["position_rad"].to_numpy()
    return np.asarray(np.maximum(q - rng.uniform(0.1, 0.25), 0.0) ** 2)


def _second_resonance(rng: np.random.Generator, log: Log) -> np.ndarray:
    """Two masses on springs along for the ride, where the library knows of one: each trial from rest."""
    first = rng.uniform(2.0, 4.0)
    return np.asarray(_ringing(log, first, 0.04) + _ringing(log, 2.3 * first, 0.04))


def _ringing(log: Log, frequency: float, damping: float) -> np.ndarray:
    omega = 2.0 * math.pi * frequency
    out = np.zeros(len(log.frame))
    for rows in log.frame.groupby("trial", sort=False).indices.values():
        t = log.frame["time_s"].to_numpy()[rows]
        w = log.frame["velocity_command_rad_s"].to_numpy()[rows]
        x = v = 0.0
        for k in range(1, len(rows)):
            h = t[k] - t[k - 1]
            force = omega**2 * -x - 2.0 * damping * omega * v - (w[k] - w[k - 1]) / h
            v += h * force
            x += h * v
            out[rows[k]] = omega**2 * x
    return out


DISTURBANCES = {
    "bump at one speed": Disturbance(("velocity",), _speed_bump),
    "damaged tooth": Disturbance(("position",), _damaged_tooth),
    "random walk": Disturbance(("time", "order"), _random_walk),
    "sudden wear": Disturbance(("time", "order", "velocity", "direction"), _sudden_wear),
    "grip under high payload": Disturbance(("load",), _overload),
    # smooth along the stroke, as the library's spring is
    "cable at one end": Disturbance(("position",), _end_stop, ("position_stiffness",)),
    "second resonance": Disturbance(
        ("time", "order", "acceleration", "velocity"), _second_resonance, ("compliance",)
    ),
}


def disturb(logs: list[Log], kind: str, seed: int, rms: float) -> list[Log]:
    """Add a disturbance of `rms` N m over all rows to the current."""
    torques = [DISTURBANCES[kind].torque(np.random.default_rng(seed), log) for log in logs]
    scale = rms / float(np.sqrt(np.mean(np.concatenate(torques) ** 2)))
    return [
        replace(
            log, rows=log.frame.assign(current_a=log.frame["current_a"] + scale * torque / TORQUE_CONSTANT)
        )
        for log, torque in zip(logs, torques, strict=True)
    ]
