"""Sessions: runs recorded on one machine, and the truth about them."""

from __future__ import annotations

import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from studies.other_plants.axes import Machine, between, draw
from studies.other_plants.effects import (
    DISTURBANCES,
    EFFECTS,
    REAL_MACHINE,
    WARM_UP_SHARE,
    Extra,
    Plant,
    real_machine,
)
from studies.other_plants.motion import TICK, drive_axis, needed_torque
from studies.other_plants.physics import LUGRE, Array, Axis, Place
from studies.other_plants.runs import Planner, Run, Trial
from studies.other_plants.sensors import instants, noise_of, read_motion

#: Sizes of what is added: times the noise of a reading, and at least this share of the Coulomb level.
SMALLEST, LARGEST, LEAST_SHARE = 1.0, 10.0, 0.05
#: So much of an effect must be left, in noise and of that share, when all else that is there explains the rest.
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


@dataclass(frozen=True)
class Session:
    """Logs and truth.

    Attributes:
        name: of the session.
        logs: text of the log by run; the last is the validation.
        truth: what is in it, see `truth_of`.
    """

    name: str
    logs: dict[str, str]
    truth: dict[str, Any]


def play(machine: Machine, plant: Plant, runs: Sequence[Run], seed: int, *, noisy: bool) -> list[list[Recorded]]:
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
            motion = drive_axis(
                plant.axis,
                plant.lines,
                plant.walk,
                place,
                machine.drive,
                wanted,
                _speed(wanted),
                noise,
                bristle,
                rest,
                1,
            )
            done.append(Recorded(place, trial, rest, bristle, skipped, motion))
            clock = round(clock + trial.seconds + gap, 3)
        recorded.append(done)
    return recorded


def _speed(wanted: Array) -> Array:
    return np.diff(wanted, append=wanted[-1]) / TICK


def torque(plant: Plant, recorded: Recorded) -> Array:
    """What the motion asks for, at the ticks of the trial."""
    needed = needed_torque(
        plant.axis, plant.lines, plant.walk, recorded.place, recorded.motion, recorded.bristle, recorded.rest
    )
    return np.asarray(needed[recorded.rest :])


def torque_of(plant: Plant, extra: Extra, recorded: Recorded) -> Array:
    """The part of one effect in it: with all effects, less the same without this one."""
    if plant.axis.delay > 0.0 and extra is EFFECTS["transport_delay"]:
        whole = needed_torque(
            plant.axis, plant.lines, plant.walk, recorded.place, recorded.motion, recorded.bristle, recorded.rest
        )
        ticks = np.arange(len(whole), dtype=float)
        late = np.interp(ticks - plant.axis.delay / TICK, ticks, whole)
        return np.asarray((whole - late)[recorded.rest :])
    rigid = extra.without(plant)
    if plant.axis.load_inertia > 0.0 and rigid.axis.load_inertia == 0.0:
        rigid = rigid.with_numbers(inertia=plant.axis.inertia + plant.axis.load_inertia)
    return torque(plant, recorded) - torque(rigid, recorded)


def _rows(machine: Machine, recorded: Recorded, column: Array) -> Array:
    """At about the instants of the log."""
    step = max(round(1.0 / machine.rate / TICK), 1)
    return column[int(recorded.skipped / TICK) :: step]


def _everywhere(machine: Machine, sessions: Sequence[Recorded], column: Any) -> Array:
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
    for of in (1, 3):
        columns.append(_everywhere(machine, recorded, lambda r, of=of: r.motion[r.rest :, of]))
    upright = [np.cos(r.place.alpha) * np.cos(r.place.beta) for r in recorded]
    if machine.kind == "slide":
        for weights in (upright, [u * r.place.payload for u, r in zip(upright, recorded, strict=True)]):
            parts = [
                _rows(machine, r, np.full(len(t), x)) for r, t, x in zip(recorded, whole, weights, strict=True)
            ]
            columns.append(np.concatenate(parts))
    if machine.kind == "arm":
        for turn in (np.sin, np.cos):
            columns.append(_everywhere(machine, recorded, lambda r, turn=turn: turn(r.motion[r.rest :, 0])))
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
    return _rms(effect - known @ solved)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def sparse(name: str) -> bool:
    """Whether an effect acts on few rows by its nature, so that its size is told of those."""
    return name in ("breakaway_dwell", "damaged tooth", "grip under high payload")


def size_of(name: str, column: Array) -> float:
    """Root mean square of a torque; of what acts rarely on the rows where it acts."""
    if not sparse(name):
        return _rms(column)
    acting = np.abs(column) > 0.2 * float(np.max(np.abs(column)))
    return _rms(column[acting]) if acting.any() else 0.0


def smallest(machine: Machine) -> float:
    """Least torque that an effect must have."""
    return max(SMALLEST * noise_of(machine), LEAST_SHARE * machine.axis.coulomb)


class NoSuchSession(Exception):
    """The numbers that were drawn cannot make the session that was asked for."""


def _library(names: Sequence[str]) -> dict[str, Extra]:
    return {name: EFFECTS.get(name) or DISTURBANCES[name] for name in names}


def draw_machine(rng: np.random.Generator, extras: dict[str, Extra], composed: bool) -> Machine:
    """A machine on which all of them can be, and be seen."""
    kinds = set(("slide", "arm", "shaft", "stage"))
    for extra in extras.values():
        kinds &= set(extra.kinds) or kinds
    if not kinds:
        raise NoSuchSession(f"no axis has {', '.join(extras)} at once")
    machine = draw(
        rng,
        kinds=tuple(sorted(kinds)),
        law=LUGRE if {"backlash", "breakaway_dwell", "stribeck_shape"} & set(extras) else None,
        stiff=composed or any(extra.stiff for extra in extras.values()),
        least_rate=max([100 if composed else 50, *(extra.least_rate for extra in extras.values())]),
    )
    if any(extra.current for extra in extras.values()):
        machine = replace(machine, logs_current=True)
    return machine


def choose_plant(
    machine: Machine, extras: dict[str, Extra], runs: Sequence[Run], seed: int
) -> Plant:
    """Strengths with which each has the size that is drawn for it."""
    rng = np.random.default_rng(seed)
    most = LARGEST * noise_of(machine)
    low = smallest(machine)
    wanted = {name: between(rng, low, max(1.5 * low, most)) for name in extras}
    shapes = {name: int(rng.integers(1 << 31)) for name in extras}
    strength = {name: extra.start for name, extra in extras.items()}
    sizes: dict[str, float] = {}
    plant = base = Plant(machine.axis)
    for _ in range(5):
        plant = base
        for name, extra in extras.items():
            plant = extra.put(machine, plant, np.random.default_rng(shapes[name]), strength[name])
        recorded = [r for run in play(machine, plant, runs, seed, noisy=False) for r in run]
        _check_motion(machine, recorded)
        sizes = {}
        for name, extra in extras.items():
            column = _everywhere(machine, recorded, lambda r, e=extra: torque_of(plant, e, r))
            sizes[name] = size_of(name, column)
        if not all(math.isfinite(size) for size in sizes.values()):
            raise NoSuchSession("the axis ran away")
        ratios = {name: wanted[name] / max(sizes[name], 1e-12) for name in extras}
        if all(0.75 < ratio < 1.3 for ratio in ratios.values()):
            break
        for name, extra in extras.items():
            strength[name] = min(strength[name] * min(max(ratios[name], 0.1), 10.0), extra.most)
    if any(size < low for size in sizes.values()):
        raise NoSuchSession(f"too weak to be fair: {sizes}, least {low:.3g}")
    if any(size > 1.3 * max(1.5 * low, most) for size in sizes.values()):
        raise NoSuchSession(f"out of range: {sizes}, {low:.3g} to {most:.3g}")
    return plant


def make(name: str, what: Sequence[str], seed: int, *, composed: bool = False) -> Session:
    """Draw, play, record. The same arguments give the same session."""
    for attempt in range(60):
        try:
            return _attempt(name, list(what), zlib.crc32(repr((list(what), composed, seed, attempt)).encode()), composed)
        except NoSuchSession:
            continue
    raise NoSuchSession(f"{name}: nothing fitting in 60 draws")


def _attempt(name: str, what: list[str], seed: int, composed: bool) -> Session:
    rng = np.random.default_rng(seed)
    extras = _library(what)
    machine = draw_machine(rng, extras, composed)
    planner = Planner(machine, rng)
    needs: frozenset[str] = frozenset().union(*(extra.needs for extra in extras.values()))
    runs = planner.session(needs)
    machine = _warming(machine, runs, rng)
    if composed:
        plant = real_machine(machine, Plant(machine.axis), rng, rng.uniform(0.12, 0.35))
        extras = {n: EFFECTS[n] for n in REAL_MACHINE}
        if machine.kind not in (EFFECTS["load_dependent_friction"].kinds):
            del extras["load_dependent_friction"]
    else:
        plant = choose_plant(machine, extras, runs, seed)
    sizes: dict[str, float] = {}
    visible: dict[str, float] = {}
    if extras:
        sizes, visible = _seen(machine, plant, extras, runs, seed)
        if not composed and any(size < STANDS_OUT * smallest(machine) for size in visible.values()):
            raise NoSuchSession(f"looks like the base model: {sizes}, {visible}, {smallest(machine):.3g}")
    validation = planner.validation()
    played = play(machine, plant, [*runs, validation], seed, noisy=True)
    _check_motion(machine, [r for run in played for r in run])
    sensor = bool(rng.random() < 0.5)
    logs = {
        run: _log(machine, plant, run, trials, rng, sensor)
        for (run, _), trials in zip([*runs, validation], played, strict=True)
    }
    return Session(name, logs, truth_of(machine, plant, what, composed, sizes, visible))


def _seen(
    machine: Machine, plant: Plant, extras: dict[str, Extra], runs: Sequence[Run], seed: int
) -> tuple[dict[str, float], dict[str, float]]:
    """Size of each effect, and of what nothing else can stand for."""
    quiet = [r for run in play(machine, plant, runs, seed, noisy=False) for r in run]
    columns = {n: _everywhere(machine, quiet, lambda r, e=e: torque_of(plant, e, r)) for n, e in extras.items()}
    base = base_columns(machine, plant, quiet)
    sizes, visible = {}, {}
    for n, column in columns.items():
        sizes[n] = size_of(n, column)
        left = stands_out(base, [columns[o] for o in extras if o != n], column)
        visible[n] = left * sizes[n] / max(_rms(column), 1e-12)
    return sizes, visible


def _warming(machine: Machine, runs: Sequence[Run], rng: np.random.Generator) -> Machine:
    seconds = sum(trial.seconds + 1.3 for _, trials in runs for trial in trials)
    axis = machine.axis._replace(rise=rng.uniform(8.0, 20.0), warm_up=WARM_UP_SHARE * seconds)
    return replace(machine, axis=axis)


def _check_motion(machine: Machine, recorded: Sequence[Recorded]) -> None:
    """An axis that cannot follow, or is at its limit, is no fair case."""
    off = [float(np.max(np.abs(r.motion[r.rest :, 0] - r.trial.wanted))) for r in recorded]
    if not max(off) < 0.35 * machine.axis.half_stroke:
        raise NoSuchSession("does not follow")
    limited = np.concatenate([np.abs(r.motion[:, 2]) >= machine.drive.limit for r in recorded])
    if np.mean(limited) > 1e-3:
        raise NoSuchSession("at the limit of its current")


def _log(
    machine: Machine, plant: Plant, run: str, trials: Sequence[Recorded], rng: np.random.Generator, sensor: bool
) -> str:
    frames = []
    for number, r in enumerate(trials):
        times = instants(machine, r.trial.seconds, rng)
        times = times[times >= r.skipped]
        wanted = np.concatenate([np.full(r.rest, r.trial.wanted[0]), r.trial.wanted])
        frame = read_motion(machine, plant, r.motion, (wanted, _speed(wanted)), r.rest, times, rng)
        frame.insert(0, "time_s", np.round(r.place.start + times, 5))
        frame.insert(0, "trial", number)
        if machine.kind == "slide":
            frame["payload_kg"] = r.place.payload
            frame["tilt_alpha_rad"] = r.place.alpha
            frame["tilt_beta_rad"] = r.place.beta
        if sensor:
            axis = plant.axis
            warm = 25.0 + axis.rise * (1.0 - np.exp(-(r.place.start + times) / axis.warm_up))
            frame["temperature_degc"] = np.round(warm + 0.1 * rng.standard_normal(len(warm)), 1)
        frames.append(frame)
    head = ["ffc-id-log = 1", f'experiment = "{run}"', "[axis]", f'kind = "{"linear" if machine.linear else "rotary"}"']
    if machine.logs_current:
        constant = "force_constant_n_per_a" if machine.linear else "torque_constant_nm_per_a"
        head.append(f"{constant} = {machine.constant!r}")
    table = pd.concat(frames).to_csv(index=False, float_format="%.7g")
    return "".join(f"# {line}\n" for line in head) + table


def truth_of(
    machine: Machine,
    plant: Plant,
    what: Sequence[str],
    composed: bool,
    sizes: dict[str, float],
    visible: dict[str, float],
) -> dict[str, Any]:
    """What is in a session, in SI units.

    `rms` is the torque of each effect over the rows of training, `distinct` what of it nothing else that is
    there can stand for, `noise` that of a reading. `tolerated` may be named and need not be: presliding of
    another law than LuGre is a memory of its own.
    """
    axis: Axis = plant.axis
    neutral = Axis(*axis[:7])
    numbers = {
        key: value
        for key, value in axis._asdict().items()
        if key in Axis._fields[:7] or value != getattr(neutral, key)
    }
    unknown = [n for n in what if n in DISTURBANCES]
    kind = "composition" if composed else "unknown" if unknown else ("clean", "single")[min(len(what), 1)]
    if len(what) > 1:
        kind = {2: "pair", 3: "triple"}[len(what)]
    tolerated = [] if axis.law == LUGRE else ["hysteresis"]
    return {
        "kind": kind,
        "effects": [n for n in sizes if n in EFFECTS],
        "disturbance": unknown[0] if unknown else None,
        "depends_on": list(DISTURBANCES[unknown[0]].depends_on) if unknown else [],
        "tolerated": tolerated + (list(DISTURBANCES[unknown[0]].partly) if unknown else []),
        "axis": machine.kind,
        "friction_law": ("LuGre", "elasto-plastic", "generalized Maxwell slip")[axis.law],
        "sensors": machine.grade,
        "rate_hz": machine.rate,
        "commands": "smooth" if machine.soft else "hard",
        "coulomb": axis.coulomb,
        "noise": noise_of(machine),
        "rms": sizes,
        "distinct": visible,
        "numbers": numbers,
        "lines": plant.lines.tolist(),
    }


def save(session: Session, folder: Path) -> None:
    """Write the logs and the truth into a folder of that name."""
    import json

    to = folder / session.name
    to.mkdir(parents=True, exist_ok=True)
    for run, text in session.logs.items():
        (to / f"{run}.csv").write_text(text)
    (to / "truth.json").write_text(json.dumps(session.truth, indent=1) + "\n")
