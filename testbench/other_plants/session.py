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

from testbench.draws import between
from testbench.other_plants.axes import KINDS, Machine, draw
from testbench.other_plants.effects import (
    DISTURBANCES,
    EFFECTS,
    REAL_MACHINE,
    WARM_UP_SHARE,
    Extra,
    real_machine,
)
from testbench.other_plants.evidence import (
    LARGEST,
    STANDS_OUT,
    Recorded,
    base_columns,
    columns_of,
    play,
    rms,
    size_of,
    smallest,
    speed_of,
    stands_out,
)
from testbench.other_plants.physics import LUGRE, Axis, Plant
from testbench.other_plants.runs import Planner, Run
from testbench.other_plants.sensors import instants, noise_of, read_motion


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


class NoSuchSessionError(Exception):
    """The numbers that were drawn cannot make the session that was asked for."""


def draw_machine(rng: np.random.Generator, extras: dict[str, Extra], composed: bool) -> Machine:
    """A machine on which all of them can be, and be seen."""
    kinds = set(KINDS)
    for extra in extras.values():
        kinds &= set(extra.kinds) or kinds
    if not kinds:
        raise NoSuchSessionError(f"no axis has {', '.join(extras)} at once")
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
    machine: Machine, extras: dict[str, Extra], runs: Sequence[Run], seed: int, least: dict[str, float]
) -> Plant:
    """Strengths with which each has the size that is drawn for it, or `least` where that is more."""
    rng = np.random.default_rng(seed)
    most = LARGEST * noise_of(machine)
    low = smallest(machine)
    high = max(1.5 * low, most)
    wanted = {name: max(between(rng, 1.3 * low, high), least.get(name, 0.0)) for name in extras}
    if any(size > high for size in wanted.values()):
        raise NoSuchSessionError("could be seen only if it were larger")
    shapes = {name: int(rng.integers(1 << 31)) for name in extras}
    strength = {name: extra.start for name, extra in extras.items()}
    sizes: dict[str, float] = {}
    plant = base = Plant(machine.axis)
    for _ in range(5):
        plant = base
        for name, extra in extras.items():
            made = extra.put(machine, np.random.default_rng(shapes[name]), strength[name])
            plant = plant.with_numbers(**made)
        recorded = [r for run in play(machine, plant, runs, seed, noisy=False) for r in run]
        _check_motion(machine, recorded)
        columns = columns_of(machine, plant, extras, recorded)
        sizes = {name: size_of(name, column) for name, column in columns.items()}
        if not all(math.isfinite(size) for size in sizes.values()):
            raise NoSuchSessionError("the axis ran away")
        ratios = {name: wanted[name] / max(sizes[name], 1e-12) for name in extras}
        if all(0.75 < ratio < 1.3 for ratio in ratios.values()):
            break
        before = dict(strength)
        for name, extra in extras.items():
            strength[name] = min(strength[name] * min(max(ratios[name], 0.1), 10.0), extra.most)
        if strength == before:
            break  # none can be stronger
    if any(size < low for size in sizes.values()):
        raise NoSuchSessionError(f"too weak to be fair: {sizes}, least {low:.3g}")
    if any(size > 1.3 * high for size in sizes.values()):
        raise NoSuchSessionError(f"out of range: {sizes}, {low:.3g} to {high:.3g}")
    return plant


def make(name: str, what: Sequence[str], seed: int, *, composed: bool = False) -> Session:
    """Draw, play, record. The same arguments give the same session."""
    for attempt in range(60):
        try:
            return _attempt(
                name, list(what), zlib.crc32(repr((list(what), composed, seed, attempt)).encode()), composed
            )
        except NoSuchSessionError:
            continue
    raise NoSuchSessionError(f"{name}: nothing fitting in 60 draws")


def _attempt(name: str, what: list[str], seed: int, composed: bool) -> Session:
    rng = np.random.default_rng(seed)
    extras = {name: EFFECTS.get(name) or DISTURBANCES[name] for name in what}
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
        plant = choose_plant(machine, extras, runs, seed, {})
    sizes: dict[str, float] = {}
    visible: dict[str, float] = {}
    if extras:
        sizes, visible = _seen(machine, plant, extras, runs, seed)
    short = {n: STANDS_OUT * smallest(machine) / max(visible[n], 1e-12) for n in visible}
    if not composed and max(short.values(), default=0.0) > 1.0:
        least = {n: 1.35 * factor * sizes[n] for n, factor in short.items() if factor > 1.0}
        plant = choose_plant(machine, extras, runs, seed, least)
        sizes, visible = _seen(machine, plant, extras, runs, seed)
        if any(size < STANDS_OUT * smallest(machine) for size in visible.values()):
            raise NoSuchSessionError(f"looks like the base model: {sizes}, {visible}")
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
    columns = columns_of(machine, plant, extras, quiet)
    base = base_columns(machine, plant, quiet)
    sizes, visible = {}, {}
    for n, column in columns.items():
        sizes[n] = size_of(n, column)
        left = stands_out(base, [columns[o] for o in extras if o != n], column)
        visible[n] = left * sizes[n] / max(rms(column), 1e-12)
    return sizes, visible


def _warming(machine: Machine, runs: Sequence[Run], rng: np.random.Generator) -> Machine:
    seconds = sum(trial.seconds + 1.3 for _, trials in runs for trial in trials)
    axis = machine.axis._replace(rise=rng.uniform(8.0, 20.0), warm_up=WARM_UP_SHARE * seconds)
    return replace(machine, axis=axis)


def _check_motion(machine: Machine, recorded: Sequence[Recorded]) -> None:
    """An axis that cannot follow, or is at its limit, is no fair case."""
    off = [float(np.max(np.abs(r.motion[r.rest :, 0] - r.trial.wanted))) for r in recorded]
    if not max(off) < 0.35 * machine.axis.half_stroke:
        raise NoSuchSessionError("does not follow")
    limited = np.concatenate([np.abs(r.motion[:, 2]) >= machine.drive.limit for r in recorded])
    if np.mean(limited) > 1e-3:
        raise NoSuchSessionError("at the limit of its current")


def _log(
    machine: Machine,
    plant: Plant,
    run: str,
    trials: Sequence[Recorded],
    rng: np.random.Generator,
    sensor: bool,
) -> str:
    frames = []
    for number, r in enumerate(trials):
        times = instants(machine, r.trial.seconds, rng)
        times = times[times >= r.skipped]
        wanted = np.concatenate([np.full(r.rest, r.trial.wanted[0]), r.trial.wanted])
        frame = read_motion(machine, plant, r.motion, (wanted, speed_of(wanted)), r.rest, times, rng)
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
    head = [
        "ffc-id-log = 1",
        f'experiment = "{run}"',
        "[axis]",
        f'kind = "{"linear" if machine.linear else "rotary"}"',
    ]
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
