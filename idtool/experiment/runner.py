"""Run a recipe on a rig: checked before it moves, supervised while it moves, logged as it goes."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from idtool.errors import InputError, RigFault
from idtool.experiment.recipe import SINE_SHARE, Recipe, RecipeTrial
from idtool.experiment.trajectory import excursion
from idtool.log import LogWriter, columns_of
from idtool.model.motion import Array
from idtool.rig.base import Block, Limits, Rig, Trajectory, TrialSetup
from idtool.uninterrupted import uninterrupted
from idtool.units import Kind, unit_text

#: Beyond a limit by this share (of the range of positions, of the highest speed or current) the axis is
#: stopped; noise of the sensors and the small overshoot of a drive stay below it.
_TOLERANCE = 0.05


@dataclass(frozen=True)
class Progress:
    """How far a run is.

    Attributes:
        share: of the time in motion, 0 to 1.
        rig_s_left: time in motion still to come.
        wall_s_left: the same for the person who waits; a simulation is faster than its own clock.
        trial, trials: which trial, from 1, of how many.
    """

    share: float
    rig_s_left: float
    wall_s_left: float
    trial: int
    trials: int


@dataclass(frozen=True)
class RunSummary:
    """What a run left behind.

    Attributes:
        file: the log; there is none when no row was measured.
        rows: rows in it.
        trials: trials that were finished.
        duration_s: rig time from the first row to the last.
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
    progress: Callable[[Progress], None] | None = None,
) -> RunSummary:
    """Run every trial and log it.

    The rig is commanded and measured at its own period; the log keeps one sample per `recipe.period_s`.
    On Ctrl-C the axis is stopped and the log closed; what was measured stays in it.

    Args:
        recipe: what to do.
        rig: on what; it is stopped on every way out.
        path: the log.
        force: overwrite an existing log.
        progress: called after every block.

    Raises:
        InputError: the recipe would leave the rig's limits (nothing has moved), or the log cannot be
            written.
        RigFault: the axis left its limits or the drive failed; the log holds everything up to then.
    """
    plan = _plan(recipe, rig)
    with LogWriter(
        path,
        _columns(rig),
        rig.axis,
        recipe.experiment,
        {"recipe": recipe.name, "rig": rig.description},
        force=force,
    ) as writer:
        session = _Session(recipe, rig, writer, progress)
        interrupted = False
        try:
            for trial, start in plan:
                session.trial(trial, start)
        except KeyboardInterrupt:
            interrupted = True
        except RigFault as error:
            # the kind of fault is kept for programs that tell them apart
            raise type(error)(f"{str(error).removesuffix('.')}; {session.kept()}.") from error
        finally:
            with uninterrupted():
                try:
                    rig.stop()
                finally:
                    session.drop_if_empty()
    return session.summary(interrupted)


class _Session:
    """One run: where it is and what it has written."""

    def __init__(
        self, recipe: Recipe, rig: Rig, writer: LogWriter, progress: Callable[[Progress], None] | None
    ) -> None:
        self._recipe, self._rig, self._writer, self._progress = recipe, rig, writer, progress
        self._every = _every(recipe, rig)
        self._total = recipe.duration_s
        self._began = time.monotonic()
        self._played = 0.0
        self._rows = self._finished = 0
        self._first: float | None = None
        self._last = 0.0

    def trial(self, trial: RecipeTrial, start: float) -> None:
        """Prepare, play, supervise and log one trial."""
        rig = self._rig
        setup = replace(trial.setup, start_position=start)
        rig.prepare(setup)
        seen = 0
        for block in rig.play(Trajectory(rig.period_s, "velocity", trial.motion.command(rig.period_s))):
            self._check_readings(block)
            # Every n-th sample of the trial, not of the block. Nothing is averaged: a row is a reading.
            rows = _rows(block, self._finished, setup)[-seen % self._every :: self._every]
            seen += len(block.time_s)
            with uninterrupted():
                self._writer.append(rows)
                self._rows += len(rows)
                if len(rows):
                    self._first = float(rows[0, 1]) if self._first is None else self._first
                    self._last = float(rows[-1, 1])
            _supervise(block, rig.limits, rig.axis.kind)
            self._played += rig.period_s * len(block.time_s)
            self._tell()
        if seen == 0:
            raise RigFault("the rig measured nothing")
        self._finished += 1

    def kept(self) -> str:
        """What became of the log, for a sentence."""
        if self._rows == 0:
            return "no row was measured and no log is left"
        return f"the {self._rows} rows up to there are in {self._writer.path}"

    def drop_if_empty(self) -> None:
        """Remove a log without a row, which nothing could read."""
        if self._rows == 0:
            Path(self._writer.path).unlink(missing_ok=True)

    def summary(self, interrupted: bool) -> RunSummary:
        seconds = self._last - self._first if self._first is not None else 0.0
        return RunSummary(str(self._writer.path), self._rows, self._finished, seconds, interrupted)

    def _check_readings(self, block: Block) -> None:
        readings = [block.time_s, block.position, block.velocity, block.current]
        if self._rig.measures_temperature:
            if block.temperature is None:
                raise RigFault("the rig stopped measuring its temperature")
            readings.append(block.temperature)
        if not all(np.isfinite(values).all() for values in readings):
            raise RigFault("a sensor returned something that is no number, so the axis was stopped")

    def _tell(self) -> None:
        if self._progress is None:
            return
        share = min(self._played / self._total, 1.0)
        waited = time.monotonic() - self._began
        left = waited * (1.0 - share) / share if share > 0.0 else 0.0
        rig_left = max(self._total - self._played, 0.0)
        trials = len(self._recipe.trials)
        self._progress(Progress(share, rig_left, left, self._finished + 1, trials))


def _every(recipe: Recipe, rig: Rig) -> int:
    """How many samples of the rig there are per row of the log."""
    return max(1, round(recipe.period_s / rig.period_s))


def _plan(recipe: Recipe, rig: Rig) -> list[tuple[RecipeTrial, float]]:
    """Every trial with the start from which it stays in the middle of the range, rad (m).

    Raises:
        InputError: a trial does not fit the rig.
    """
    if recipe.kind != rig.axis.kind:
        raise InputError(
            f"is for a {recipe.kind} axis and the rig is {rig.axis.kind}",
            file=recipe.source,
            place="axis",
            remedy=f'write axis = "{rig.axis.kind}" and the keys of that axis',
        )
    period = rig.period_s * _every(recipe, rig)
    return [(trial, _check(recipe, trial, rig, period)) for trial in recipe.trials]


def _check(recipe: Recipe, trial: RecipeTrial, rig: Rig, period: float) -> float:
    limits, kind = rig.limits, rig.axis.kind
    speed_key, travel_key = trial.keys
    command = trial.motion.command(rig.period_s)
    fastest = float(np.max(np.abs(command)))
    if fastest > limits.speed * (1.0 + 1e-9):
        raise InputError(
            f"moves at {fastest:.3g} {unit_text('velocity', kind)}, the rig's limit is {limits.speed:.3g}",
            file=recipe.source,
            place=f"{trial.place}.{speed_key}",
            remedy="lower it",
        )
    low, high = excursion(command, rig.period_s)
    room = limits.position[1] - limits.position[0]
    if high - low > room:
        raise InputError(
            f"moves over {high - low:.3g} {unit_text('position', kind)}, the rig has {room:.3g}",
            file=recipe.source,
            place=f"{trial.place}.{travel_key}",
            remedy="lower it" if travel_key != speed_key else "lower it or raise the frequency",
        )
    if trial.motion.highest_frequency_hz > SINE_SHARE / period * (1.0 + 1e-9):
        raise InputError(
            f"has a sine of {trial.motion.highest_frequency_hz:g} Hz, more than a tenth of this rig's "
            f"{1.0 / period:g} samples per second",
            file=recipe.source,
            place=trial.place,
            remedy=f"stay below {SINE_SHARE / period:g} Hz",
        )
    return 0.5 * (limits.position[0] + limits.position[1]) - 0.5 * (low + high)


def _columns(rig: Rig) -> list[str]:
    names = ["trial", "time", "position", "velocity", "current", "velocity_command", "payload"]
    names += ["tilt_alpha", "tilt_beta"] + (["temperature"] if rig.measures_temperature else [])
    roles = columns_of(rig.axis.kind)
    return [roles[name] for name in names]


def _rows(block: Block, trial: int, setup: TrialSetup) -> Array:
    """Rows of the log, shape (samples, columns), in the order of `_columns`."""
    n = len(block.time_s)
    columns = [np.full(n, float(trial)), block.time_s, block.position, block.velocity, block.current]
    columns += [block.command, np.full(n, setup.payload_kg)]
    columns += [np.full(n, setup.tilt_alpha_rad), np.full(n, setup.tilt_beta_rad)]
    if block.temperature is not None:
        columns.append(block.temperature)
    # nine digits after the point keep every reading and leave the noise of arithmetic out of the file
    return np.asarray(np.round(np.column_stack(columns), 9))


def _supervise(block: Block, limits: Limits, kind: Kind) -> None:
    """Raise if the axis left its limits."""
    low, high = limits.position
    margin = _TOLERANCE * (high - low)
    most = 1.0 + _TOLERANCE
    checks = [
        ("position", block.position, low - margin, high + margin, unit_text("position", kind)),
        ("velocity", block.velocity, -most * limits.speed, most * limits.speed, unit_text("velocity", kind)),
        ("current", block.current, -most * limits.current, most * limits.current, "A"),
    ]
    if block.temperature is not None:
        checks.append(("temperature", block.temperature, -np.inf, limits.temperature, "°C"))
    remedies = {"temperature": "let it cool down", "position": "lower the travel"}
    for what, values, least, highest, unit in checks:
        beyond = np.flatnonzero((values < least) | (values > highest))
        if len(beyond):
            raise RigFault(
                f"the axis was stopped because its {what} of {values[beyond[0]]:.3g} {unit} at "
                f"{block.time_s[beyond[0]]:.2f} s is beyond the limit; "
                f"{remedies.get(what, 'lower the speed or the payload')}"
            )
