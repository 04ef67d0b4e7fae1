"""Run a recipe on a rig: checked before it moves, supervised while it moves, logged as it goes."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from idtool.errors import RigFault
from idtool.experiment.black_box import with_remains
from idtool.experiment.plan import plan_of, rows_every
from idtool.experiment.recipe import Recipe, RecipeTrial
from idtool.experiment.resume import Done, done_in
from idtool.io.defer_signals import deferred_signals
from idtool.log import LogWriter, columns_of
from idtool.model.motion import Array
from idtool.rig.base import Block, Rig, Trajectory, TrialSetup, Watch
from idtool.rig.supervisor import LoopTime, SupervisedRun, Supervisor

#: Asks a person to set the axis up: trial (from 1), of how many, its set-up, and the one before.
Confirm = Callable[[int, int, TrialSetup, TrialSetup | None], None]
#: Pause that stands in the log between an interrupted run and its continuation, s.
_PAUSE_S = 1.0


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
        loop: how well the rig kept its period, in this run.
        resumed: how many of the trials an earlier run had finished.
    """

    file: str
    rows: int
    trials: int
    duration_s: float
    interrupted: bool
    loop: LoopTime = field(default_factory=LoopTime)
    resumed: int = 0


def run(
    recipe: Recipe,
    rig: Rig,
    path: str | os.PathLike[str],
    *,
    force: bool = False,
    resume: bool = False,
    confirm: Confirm | None = None,
    progress: Callable[[Progress], None] | None = None,
    watch: Watch | None = None,
    spec: str = "",
) -> RunSummary:
    """Run every trial and log it.

    The rig is commanded and measured at its own period; the log keeps one sample per `recipe.period_s`.
    On Ctrl-C the axis is stopped and the log closed; what was measured stays in it.

    Args:
        recipe: what to do.
        rig: on what; it is stopped on every way out.
        path: the log.
        force: overwrite an existing log.
        resume: go on with an existing log at the first trial that is not whole in it.
        confirm: called before every trial whose payload or tilt is another than that of the trial before
            (and before the first), while the axis stands.
        progress: called after every block.
        watch: called with every sample, while the axis moves.
        spec: the word that opened the rig, which the log keeps for whoever is to run the next one.

    Raises:
        InputError: the recipe would leave the rig's limits, or the log is none to go on with (nothing has
            moved), or the log can no longer be written.
        RigFault: the axis left its limits or the drive failed. The log holds everything up to then, and
            the last second is in a file beside it.
    """
    plan = plan_of(recipe, rig)
    done = done_in(path, recipe, rig, rows_every(recipe, rig)) if resume else Done()
    log = LogWriter(
        path,
        _columns(rig),
        rig.axis,
        recipe.experiment,
        {"recipe": recipe.name, "rig": rig.description} | ({"rig_spec": spec} if spec else {}),
        force=force,
        keep_rows=done.rows if resume and Path(path).exists() else None,
    )
    before: TrialSetup | None = None
    with log as writer, _Session(recipe, Supervisor(rig), writer, done, progress, watch) as session:
        for index, (trial, start) in enumerate(plan[done.trials :], start=done.trials + 1):
            if confirm is not None and _differs(trial.setup, before):
                confirm(index, len(plan), trial.setup, before)
            before = trial.setup
            session.trial(trial, start)
    return session.summary()


def _differs(setup: TrialSetup, before: TrialSetup | None) -> bool:
    """Whether a person has to do something between these two."""
    if before is None:
        return True
    by_hand = ("payload_kg", "tilt_alpha_rad", "tilt_beta_rad", "temperature_degc")
    return any(getattr(setup, name) != getattr(before, name) for name in by_hand)


class _Session(SupervisedRun):
    """One run: where it is and what it has written."""

    def __init__(
        self,
        recipe: Recipe,
        rig: Supervisor,
        writer: LogWriter,
        done: Done,
        progress: Callable[[Progress], None] | None,
        watch: Watch | None,
    ) -> None:
        super().__init__(rig)
        self._watch = watch
        self._recipe, self._writer, self._progress = recipe, writer, progress
        self._every = rows_every(recipe, rig)
        self._total = recipe.duration_s
        self._began = time.monotonic()
        self._resumed = self._finished = done.trials
        self._before = sum(trial.motion.duration_s for trial in recipe.trials[: done.trials])
        self._played = 0.0
        self._rows, self._first, self._last = done.rows, done.first_s, done.last_s
        self._shift: float | None = None if done.rows else 0.0

    def trial(self, trial: RecipeTrial, start: float) -> None:
        """Prepare, play and log one trial."""
        rig = self._rig
        setup = replace(trial.setup, start_position=start)
        rig.prepare(setup)
        seen, before, first = 0, self._played, 0.0
        for block in rig.play(Trajectory(rig.period_s, "velocity", trial.motion.command(rig.period_s))):
            # Every n-th sample of the trial, not of the block. Nothing is averaged: a row is a reading.
            self._log(_rows(block, rig, self._finished, setup)[-seen % self._every :: self._every])
            if len(block.time_s):
                # by the clock: a rig that is late leaves samples out
                first = first if seen else float(block.time_s[0]) - rig.period_s
                passed = float(block.time_s[-1]) - first
                self._played = before + min(passed, trial.motion.duration_s)
            if self._watch is not None:
                for time_s, position, effort in zip(
                    block.time_s.tolist(), block.position.tolist(), block.effort.tolist(), strict=True
                ):
                    self._watch(time_s, position, effort, math.nan)
            seen += len(block.time_s)
            self._tell()
        if seen == 0:
            raise RigFault("the rig measured nothing")
        self._played = before + trial.motion.duration_s
        self._finished += 1

    def _log(self, rows: Array) -> None:
        if not len(rows):
            return
        if self._shift is None:  # the rig's clock began anew; the log's goes on
            self._shift = self._last + _PAUSE_S - float(rows[0, 1])
        rows[:, 1] = np.round(rows[:, 1] + self._shift, 9)
        with deferred_signals():
            self._writer.append(rows)
            self._rows += len(rows)
            self._first = float(rows[0, 1]) if self._first is None else self._first
            self._last = float(rows[-1, 1])

    def _told(self, fault: RigFault) -> RigFault:
        kept = f"the {self._rows} rows up to there are in {self._writer.path}"
        remains = kept if self._rows else "no row was measured and no log is left"
        return with_remains(fault, self._writer.path, self._rig.axis, remains)

    def _end(self) -> None:
        """Remove a log without a row, which nothing could read."""
        if self._rows == 0:
            self._writer.discard()

    def summary(self) -> RunSummary:
        seconds = self._last - self._first if self._first is not None else 0.0
        file, loop = str(self._writer.path), self._rig.loop
        return RunSummary(file, self._rows, self._finished, seconds, self.interrupted, loop, self._resumed)

    def _tell(self) -> None:
        if self._progress is None:
            return
        rig_left = max(self._total - self._before - self._played, 0.0)
        waited = time.monotonic() - self._began
        left = waited * rig_left / self._played
        share = 1.0 - rig_left / self._total
        trials = len(self._recipe.trials)
        self._progress(Progress(share, rig_left, left, self._finished + 1, trials))


def _columns(rig: Rig) -> list[str]:
    names = ["trial", "time", "position", "velocity", *rig.effort_readings, "velocity_command"]
    names += [*TrialSetup().logged, *(["temperature"] if rig.measures_temperature else [])]
    names += ["supply_voltage"] if rig.measures_voltage else []
    roles = columns_of(rig.axis.kind)
    return [roles[name] for name in names]


def _rows(block: Block, rig: Rig, trial: int, setup: TrialSetup) -> Array:
    """Rows of the log, shape (samples, columns), in the order of `_columns`."""
    n = len(block.time_s)
    columns = [np.full(n, float(trial)), block.time_s, block.position, block.velocity]
    columns += [getattr(block, name) for name in rig.effort_readings.values()]
    columns += [block.command, *(np.full(n, value) for value in setup.logged.values())]
    columns += [reading for reading in (block.temperature, block.voltage) if reading is not None]
    # nine digits after the point keep every reading and leave the noise of arithmetic out of the file
    return np.asarray(np.round(np.column_stack(columns), 9))
