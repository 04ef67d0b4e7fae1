"""What the log holds of a motion: sampling instants, noise, steps and delays of three grades of sensors."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from scipy.signal import lfilter

from testbench.other_plants.axes import COUNT, CURRENT_STEP, SPEED_STEP, Machine
from testbench.other_plants.motion import TICK
from testbench.other_plants.physics import Array, Plant


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


def sample(machine: Machine, values: Array, times: Array, rest: int, *, held: bool = False) -> Array:
    """A quantity of the ticks at instants; a drive's recording was resampled, every channel alike, so it
    has the mean over a period around them.

    Args:
        values: of each tick.
        times: s from the start of the trial.
        rest: ticks before that.
        held: whether it is held for a tick (the torque) or runs on between them.
    """
    grid = (np.arange(len(values)) - rest) * TICK
    if machine.grade == "drive":
        between = values[:-1] if held else 0.5 * (values[1:] + values[:-1])
        total = np.concatenate([[0.0], np.cumsum(between) * TICK])
        half = 0.5 / machine.rate
        low, high = np.maximum(times - half, grid[0]), np.minimum(times + half, grid[-1])
        return np.asarray((np.interp(high, grid, total) - np.interp(low, grid, total)) / (high - low))
    if held:
        # where the torque steps it counts half before and half after, else readings in step with the drive
        # would be half a tick ahead of the motion
        return np.asarray(np.interp(times, grid + 0.5 * TICK, values))
    return np.asarray(np.interp(times, grid, values))


def _speed_reading(
    machine: Machine, motion: Array, times: Array, rest: int, rng: np.random.Generator
) -> Array:
    if machine.grade == "dynamixel":  # the mean over the last 10 ms, in steps
        window = 0.010
        way = sample(machine, motion[:, 0], times, rest) - sample(machine, motion[:, 0], times - window, rest)
        return np.asarray(SPEED_STEP * np.round(way / window / SPEED_STEP))
    speed, noise = motion[:, 1], 0.004 * machine.speed
    if machine.grade == "drive":  # filtered: first order, 60 Hz
        share = 1.0 - math.exp(-2.0 * math.pi * 60.0 * TICK)
        speed, noise = lfilter([share], [1.0, share - 1.0], speed), 0.001 * machine.speed
    return np.asarray(sample(machine, speed, times, rest) + noise * rng.standard_normal(len(times)))


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
    seen = times - plant.axis.delay  # position and speed are of a while ago
    position = sample(machine, motion[:, 0], seen, rest)
    count = COUNT if machine.grade == "dynamixel" else 2e-5 * machine.axis.half_stroke
    torque = sample(machine, motion[:, 2], times, rest, held=True)
    torque = torque + machine.reading_noise * rng.standard_normal(len(times))
    columns = {
        f"position_{unit}": count * np.round(position / count),
        f"velocity_{unit}_s": _speed_reading(machine, motion, seen, rest, rng),
    }
    if machine.logs_current:
        step = (
            CURRENT_STEP if machine.grade == "dynamixel" else 1e-5 * machine.axis.coulomb / machine.constant
        )
        columns["current_a"] = step * np.round(torque / machine.constant / step)
    else:
        columns[effort] = torque
    positions, speeds = command
    if machine.drive.position_gain > 0.0:
        columns[f"position_command_{unit}"] = sample(machine, positions, times, rest)
    else:
        columns[f"velocity_command_{unit}_s"] = sample(machine, speeds, times, rest)
    return pd.DataFrame(columns)
