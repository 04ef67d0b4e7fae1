"""Run a recipe on a rig: checked before it moves, supervised while it moves, logged as it goes."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from idtool.errors import InputError, RigFault
from idtool.experiment.recipe import Recipe, RecipeTrial
from idtool.log import LogWriter, columns_of
from idtool.model.motion import Array
from idtool.rig.base import Block, Limits, Rig, Trajectory, TrialSetup

#: Beyond a limit by this share of the range (or of the limit) a supervisor stops the axis; the sensors'
#: noise and the drive's small overshoot stay below it.
_TOLERANCE = 0.05

Progress = Callable[[float, float], None]


@dataclass(frozen=True)
class RunSummary:
    """What a run left behind.

    Attributes:
        file: the log.
        rows: rows in it.
        trials: trials that were finished.
        duration_s: rig time.
        interrupted: Ctrl-C ended it.
    """

    file: str
    rows: int
    trials: int
    duration_s: float
    interrupted: bool


def run(
    recipe: Recipe,
    rig: Rig,
    path: str | os.PathLike[str],
    *,
    force: bool = False,
    progress: Progress | None = None,
) -> RunSummary:
    """Run every trial and log it.

    Args:
        recipe: what to do.
        rig: on what; it is stopped on every way out.
        path: the log.
        force: overwrite an existing log.
        progress: called with (share done, seconds of rig time left).

    Raises:
        InputError: the recipe would leave the rig's limits (nothing has moved), or the log cannot be
            written.
        RigFault: the axis left its limits or the drive failed; the log holds everything up to then.
    """
    starts = [_check(recipe, trial, rig.limits) for trial in recipe.trials]
    columns, with_temperature = _columns(rig)
    header = {"recipe": recipe.name, "rig": rig.description}
    rows = finished = 0
    span: list[float] = []
    interrupted = False
    with LogWriter(path, columns, rig.axis, recipe.experiment, header, force=force) as writer:
        try:
            done = 0.0
            for number, (trial, start) in enumerate(zip(recipe.trials, starts, strict=True)):
                setup = replace(trial.setup, start_position=start)
                rig.prepare(setup)
                for block in rig.play(Trajectory(recipe.period_s, "velocity", trial.command)):
                    writer.append(_rows(block, number, setup, with_temperature))
                    rows += len(block.time_s)
                    span += [float(block.time_s[0]), float(block.time_s[-1])]
                    span = [span[0], span[-1]]
                    _supervise(block, rig.limits)
                    done += recipe.period_s * len(block.time_s)
                    if progress is not None:
                        progress(min(done / recipe.duration_s, 1.0), max(recipe.duration_s - done, 0.0))
                finished += 1
        except KeyboardInterrupt:
            interrupted = True
        finally:
            rig.stop()
    return RunSummary(str(path), rows, finished, span[1] - span[0] if span else 0.0, interrupted)


def _check(recipe: Recipe, trial: RecipeTrial, limits: Limits) -> float:
    """The start position from which a trial stays in the middle of the range.

    Raises:
        InputError: it is too long or too fast for the rig.
    """
    low, high = trial.excursion(recipe.period_s)
    room = limits.position[1] - limits.position[0]
    if high - low > room:
        raise InputError(
            f"moves over {high - low:.3g} rad, the rig has {room:.3g}",
            file=recipe.source,
            place=trial.place,
            remedy="shorten the travel (or raise the frequency)",
        )
    fastest = float(np.max(np.abs(trial.command)))
    if fastest > limits.speed:
        raise InputError(
            f"moves at {fastest:.3g} rad/s, the rig's limit is {limits.speed:.3g}",
            file=recipe.source,
            place=trial.place,
            remedy="lower the speed",
        )
    return 0.5 * (limits.position[0] + limits.position[1]) - 0.5 * (low + high)


def _columns(rig: Rig) -> tuple[list[str], bool]:
    roles = columns_of(rig.axis.kind)
    with_temperature = rig.measures_temperature
    names = ["trial", "time", "position", "velocity", "current", "velocity_command", "payload"]
    names += ["tilt_alpha", "tilt_beta"] + (["temperature"] if with_temperature else [])
    return [roles[name] for name in names], with_temperature


def _rows(block: Block, trial: int, setup: TrialSetup, with_temperature: bool) -> Array:
    n = len(block.time_s)
    columns = [
        np.full(n, float(trial)),
        block.time_s,
        block.position,
        block.velocity,
        block.current,
        block.command,
        np.full(n, setup.payload_kg),
        np.full(n, setup.tilt_alpha_rad),
        np.full(n, setup.tilt_beta_rad),
    ]
    if with_temperature:
        assert block.temperature is not None
        columns.append(block.temperature)
    # nine digits after the point keep every reading and leave the noise of arithmetic out of the file
    return np.round(np.column_stack(columns), 9)


def _supervise(block: Block, limits: Limits) -> None:
    """Raise if the axis left its limits."""
    low, high = limits.position
    margin = _TOLERANCE * (high - low)
    checks = (
        ("position", block.position, low - margin, high + margin, "rad"),
        ("speed", np.abs(block.velocity), 0.0, (1.0 + _TOLERANCE) * limits.speed, "rad/s"),
        ("current", np.abs(block.current), 0.0, (1.0 + _TOLERANCE) * limits.current, "A"),
    )
    for what, values, least, most, unit in checks:
        beyond = np.flatnonzero((values < least) | (values > most))
        if len(beyond):
            raise RigFault(
                f"{what} {values[beyond[0]]:.3g} {unit} at {block.time_s[beyond[0]]:.2f} s is beyond its "
                "limit: "
                "the axis was stopped and the log kept; lower the speed or the payload."
            )
    if block.temperature is not None and float(np.max(block.temperature)) > limits.temperature:
        raise RigFault(
            f"temperature {float(np.max(block.temperature)):.0f} degC is beyond its limit of "
            f"{limits.temperature:.0f}: the axis was stopped and the log kept; let it cool down."
        )
