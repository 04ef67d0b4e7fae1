"""What is to be seen of an effect: its torque, and the part that nothing else can stand for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from testbench.other_plants.axes import Machine
from testbench.other_plants.effects import EFFECTS, Extra
from testbench.other_plants.motion import TICK, drive_axis, needed_torque
from testbench.other_plants.physics import Array, Place, Plant
from testbench.other_plants.runs import Run, Trial
from testbench.other_plants.sensors import noise_of

#: Sizes of what is added: times the noise of a reading, and at least this share of the Coulomb level.
SMALLEST, LARGEST, LEAST_SHARE = 1.0, 10.0, 0.05
#: So much of the least size must be left when all else that is there has taken what it can.
STANDS_OUT = 0.5


@dataclass(frozen=True)
class Recorded:
    """One trial as it went: when, how, and the motion at every tick."""

    place: Place
    trial: Trial
    rest: int
    bristle: float
    skipped: float
    motion: Array


def play(
    machine: Machine, plant: Plant, runs: Sequence[Run], seed: int, *, noisy: bool
) -> list[list[Recorded]]:
    """All trials of all runs one after another; starts, rests and gaps depend on the seed alone."""
    rng = np.random.default_rng(seed)
    clock = 0.0
    recorded = []
    for _, trials in runs:
        done = []
        for trial in trials:
            bristle, gap = rng.uniform(-0.7, 0.7), rng.uniform(0.5, 2.0)
            rest = int(rng.integers(200, 900))
            skipped = rng.uniform(0.05, 0.4) if rng.random() < 0.2 else 0.0
            wanted = np.concatenate([np.full(rest, trial.wanted[0]), trial.wanted])
            noise = machine.drive_noise * rng.standard_normal(len(wanted)) * noisy
            place = Place(trial.payload, trial.alpha, trial.beta, clock)
            speed = speed_of(wanted)
            motion = drive_axis(plant, place, machine.drive, wanted, speed, noise, bristle, rest, 1)
            done.append(Recorded(place, trial, rest, bristle, skipped, motion))
            clock = round(clock + trial.seconds + gap, 3)
        recorded.append(done)
    return recorded


def speed_of(wanted: Array) -> Array:
    return np.diff(wanted, append=wanted[-1]) / TICK


def torque(plant: Plant, recorded: Recorded) -> Array:
    """What the motion asks for, at the ticks of the trial."""
    needed = needed_torque(plant, recorded.place, recorded.motion, recorded.bristle, recorded.rest)
    return np.asarray(needed[recorded.rest :])


def torque_of(machine: Machine, plant: Plant, extra: Extra, recorded: Recorded) -> Array:
    """The part of one effect in it: with all effects, less the same without this one."""
    if plant.axis.delay > 0.0 and extra is EFFECTS["transport_delay"]:
        whole = needed_torque(plant, recorded.place, recorded.motion, recorded.bristle, recorded.rest)
        ticks = np.arange(len(whole), dtype=float)
        late = np.interp(ticks - plant.axis.delay / TICK, ticks, whole)
        return np.asarray((whole - late)[recorded.rest :])
    rigid = extra.without(machine, plant)
    if plant.axis.load_inertia > 0.0 and rigid.axis.load_inertia == 0.0:
        rigid = rigid.with_numbers(inertia=plant.axis.inertia + plant.axis.load_inertia)
    return torque(plant, recorded) - torque(rigid, recorded)


def _rows(machine: Machine, recorded: Recorded, column: Array) -> Array:
    """At about the instants of the log."""
    step = max(round(1.0 / machine.rate / TICK), 1)
    return column[int(recorded.skipped / TICK) :: step]


def everywhere(machine: Machine, sessions: Sequence[Recorded], column: Callable[[Recorded], Array]) -> Array:
    return np.concatenate([_rows(machine, r, column(r)) for r in sessions])


#: Numbers of the base model and the relative change that shows their effect.
_BASE = ("coulomb", "static", "stribeck_velocity", "stiffness", "damping")


def base_columns(machine: Machine, plant: Plant, recorded: Sequence[Recorded]) -> Array:
    """What the base model's own numbers change: the columns of its Jacobian, shape (rows, columns)."""
    axis = plant.axis
    whole = [torque(plant, r) for r in recorded]
    columns = []
    for name in _BASE:
        changed = plant.with_numbers(**{name: 1.02 * getattr(axis, name)})
        parts = [_rows(machine, r, torque(changed, r) - t) for r, t in zip(recorded, whole, strict=True)]
        columns.append(np.concatenate(parts))
    columns.append(everywhere(machine, recorded, lambda r: r.motion[r.rest :, 1]))
    columns.append(everywhere(machine, recorded, lambda r: r.motion[r.rest :, 3]))
    upright = [np.cos(r.place.alpha) * np.cos(r.place.beta) for r in recorded]
    if machine.kind == "slide":
        for weights in (upright, [u * r.place.payload for u, r in zip(upright, recorded, strict=True)]):
            parts = [
                _rows(machine, r, np.full(len(t), x))
                for r, t, x in zip(recorded, whole, weights, strict=True)
            ]
            columns.append(np.concatenate(parts))
    if machine.kind == "arm":
        columns.append(everywhere(machine, recorded, lambda r: np.sin(r.motion[r.rest :, 0])))
        columns.append(everywhere(machine, recorded, lambda r: np.cos(r.motion[r.rest :, 0])))
    lengths = [len(_rows(machine, r, t)) for r, t in zip(recorded, whole, strict=True)]
    ends = np.cumsum([0, *lengths])
    for k, (r, t) in enumerate(zip(recorded, whole, strict=True)):  # the bristle's start
        column = np.zeros(ends[-1])
        started = replace(r, bristle=r.bristle + 0.05)
        column[ends[k] : ends[k + 1]] = _rows(machine, r, torque(plant, started) - t)
        columns.append(column)
    return np.stack(columns, axis=1)


def stands_out(columns: Array, others: Sequence[Array], effect: Array) -> float:
    """Root mean square of an effect's torque that nothing else can stand for."""
    known = np.column_stack([columns, *others])
    size = np.sqrt(np.mean(known**2, axis=0))
    known = known[:, size > 1e-9 * np.max(size)] / size[size > 1e-9 * np.max(size)]
    solved, *_ = np.linalg.lstsq(known, effect, rcond=1e-6)
    return rms(effect - known @ solved)


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


#: Effects that act on few rows by their nature, so that their size is told of those.
_SPARSE = ("breakaway_dwell", "damaged tooth", "grip under high payload")


def size_of(name: str, column: Array) -> float:
    """Root mean square of a torque; of what acts rarely on the rows where it acts."""
    if name not in _SPARSE:
        return rms(column)
    acting = np.abs(column) > 0.2 * float(np.max(np.abs(column)))
    return rms(column[acting]) if acting.any() else 0.0


def smallest(machine: Machine) -> float:
    """Least torque that an effect must have."""
    return max(SMALLEST * noise_of(machine), LEAST_SHARE * machine.axis.coulomb)


def columns_of(
    machine: Machine, plant: Plant, extras: dict[str, Extra], recorded: Sequence[Recorded]
) -> dict[str, Array]:
    """Torque of each effect on the rows of the log."""

    return {
        name: everywhere(machine, recorded, partial(torque_of, machine, plant, extra))
        for name, extra in extras.items()
    }
