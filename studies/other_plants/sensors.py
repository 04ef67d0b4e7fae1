"""What the log holds of a motion: sampling instants, noise, steps and delays of three grades of sensors."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from scipy.signal import lfilter

from studies.other_plants.axes import COUNT, CURRENT_STEP, SPEED_STEP, Machine
from studies.other_plants.effects import Plant
from studies.other_plants.motion import TICK
from studies.other_plants.physics import Array


def instants(machine: Machine, seconds: float, rng: np.random.Generator) -> Array:
    """True sampling instants of a trial, s from its start."""
    step = 1.0 / machine.rate
    t = np.arange(0.0, seconds - 2.0 * step, step)
    shaken = t + machine.jitter * step * np.clip(rng.standard_normal(len(t)), -3.0, 3.0)
    shaken[0] = 0.0
    return np.asarray(np.maximum(shaken, 0.0))


def noise_of(machine: Machine) -> float:
    """Standard deviation of a torque reading where everything else is known."""
    ticks = 1.0 / (machine.rate * TICK) if machine.grade == "drive" else 1.0
    step = machine.constant * CURRENT_STEP if machine.grade == "dynamixel" else 0.0
    return math.sqrt(machine.reading_noise**2 + machine.drive_noise**2 / ticks + step**2 / 12.0)


def sample_torque(machine: Machine, torque: Array, times: Array, rest: int) -> Array:
    """Torque (held for a tick) at instants: the value there, or the mean over a period around it."""
    if machine.grade != "drive":
        return np.asarray(torque[np.minimum((times / TICK + 1e-6).astype(int) + rest, len(torque) - 1)])
    total = np.concatenate([[0.0], np.cumsum(torque) * TICK])
    grid = (np.arange(len(total)) - rest) * TICK
    half = 0.5 / machine.rate
    low, high = np.maximum(times - half, grid[0]), np.minimum(times + half, grid[-1])
    return np.asarray((np.interp(high, grid, total) - np.interp(low, grid, total)) / (high - low))


def _speed_reading(machine: Machine, motion: Array, grid: Array, times: Array, rng: np.random.Generator) -> Array:
    if machine.grade == "lab":
        readings = np.interp(times, grid, motion[:, 1])
        return np.asarray(readings + 0.004 * machine.speed * rng.standard_normal(len(times)))
    if machine.grade == "dynamixel":  # the mean over the last 10 ms, in steps
        window = 0.010
        now = np.interp(times, grid, motion[:, 0])
        before = np.interp(times - window, grid, motion[:, 0])
        return np.asarray(SPEED_STEP * np.round((now - before) / window / SPEED_STEP))
    share = 1.0 - math.exp(-2.0 * math.pi * 60.0 * TICK)  # first order, 60 Hz
    filtered = lfilter([share], [1.0, share - 1.0], motion[:, 1])
    return np.asarray(np.interp(times, grid, filtered) + 0.001 * machine.speed * rng.standard_normal(len(times)))


def read_motion(
    machine: Machine,
    plant: Plant,
    motion: Array,
    command: tuple[Array, Array],
    rest: int,
    times: Array,
    rng: np.random.Generator,
) -> pd.DataFrame:
    """Columns of the log but for time, trial and what the operator set.

    Args:
        motion: rows of `drive_axis`.
        command: position and speed command at the same ticks.
        rest: ticks before the trial begins.
        times: sampling instants, s from the start of the trial.
    """
    unit, effort = ("m", "force_n") if machine.linear else ("rad", "torque_nm")
    grid = (np.arange(len(motion)) - rest) * TICK
    seen = times - plant.axis.delay  # position and speed are of a while ago
    position = np.interp(seen, grid, motion[:, 0])
    count = COUNT if machine.grade == "dynamixel" else 2e-5 * machine.axis.half_stroke
    torque = sample_torque(machine, motion[:, 2], times, rest)
    torque = torque + machine.reading_noise * rng.standard_normal(len(times))
    columns = {
        f"position_{unit}": count * np.round(position / count),
        f"velocity_{unit}_s": _speed_reading(machine, motion, grid, seen, rng),
    }
    if machine.logs_current:
        step = CURRENT_STEP if machine.grade == "dynamixel" else 1e-5 * machine.axis.coulomb / machine.constant
        columns["current_a"] = step * np.round(torque / machine.constant / step)
    else:
        columns[effort] = torque
    positions, speeds = command
    if machine.drive.position_gain > 0.0:
        columns[f"position_command_{unit}"] = np.interp(times, grid, positions)
    else:
        columns[f"velocity_command_{unit}_s"] = np.interp(times, grid, speeds)
    return pd.DataFrame(columns)
