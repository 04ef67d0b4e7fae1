"""Play a taught path back on a rig: to its start slowly, along it, and stop where something is in the way.

The command leads the path by the lag of the position loop, which is trimmed on the way. What the axis feels
meanwhile is the hand's torque of the controller (`idtool.control.sensing`), listened to at rest before it
moves; beyond a limit it is a contact, and the axis stops there. Without a parameter file a contact shows only
as an axis that stays behind its path.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from idtool.control.guard import Measurement
from idtool.control.online import OnlineModel
from idtool.control.sensing import HandSense
from idtool.errors import RigFault
from idtool.guiding.path import TaughtPath
from idtool.guiding.session import place_of
from idtool.io.defer_signals import deferred_signals
from idtool.log import LogWriter, columns_of
from idtool.model.motion import Array
from idtool.parameters import Parameters
from idtool.rig.base import Rig, Sample, TrialSetup, Watch
from idtool.rig.supervisor import Supervisor

#: Way to the start of a path: speed, rad/s (m/s), and how long it stands there before and after, s.
APPROACH_SPEED = {"rotary": 0.25, "linear": 0.01}
REST_S = 0.5
#: First guess of the position loop's lag and the most that is believed, s; it is trimmed by this share of
#: what is missing at every sample that is faster than this share of the path's greatest speed.
LAG_S, _LONGEST_LAG_S = 0.05, 0.2
_TRIM, _TRIM_SHARE = 0.05, 0.3
#: Filter of the torque that is a contact, s, and the encoder's step that it needs to know, rad (m).
_FILTER_S = 0.03
_RESOLUTION = {"rotary": 2.0 * math.pi / 4096, "linear": 1e-5}


@dataclass(frozen=True)
class Stop:
    """Where and why a path was left.

    Attributes:
        time_s: of the run.
        position: rad (m).
        torque: that was felt, N m (N); None without a parameter file.
        why: "contact" or "behind".
    """

    time_s: float
    position: float
    torque: float | None
    why: str


@dataclass(frozen=True)
class Played:
    """A run.

    Attributes:
        time, position, wanted: along the path only, s and rad (m), shape (samples,).
        lag_s: of the position loop.
        stopped: None if it came to the end.
        interrupted: stopped by the user.
    """

    time: Array
    position: Array
    wanted: Array
    lag_s: float
    stopped: Stop | None
    interrupted: bool

    @property
    def rms_error(self) -> float:
        """Of the position along the path, rad (m); NaN if it never got there."""
        return float(np.sqrt(np.mean((self.position - self.wanted) ** 2))) if len(self.time) else math.nan


class ContactSense:
    """The torque that something else than the axis itself puts on it, N m (N)."""

    def __init__(self, parameters: Parameters, period: float, setup: TrialSetup) -> None:
        model = OnlineModel(parameters)
        model.drop("external_periodic", "its phase is not known once the clock starts anew")
        self._sense = HandSense(model, period, _FILTER_S, _RESOLUTION[parameters.axis.kind])
        self._setup = setup
        self._back_emf = model.back_emf

    def _measurement(self, sample: Sample) -> Measurement:
        setup = self._setup
        return Measurement(
            sample.time_s,
            sample.position,
            sample.velocity,
            sample.effort - self._back_emf * sample.velocity,
            setup.payload_kg,
            setup.tilt_alpha_rad,
            setup.tilt_beta_rad,
            sample.temperature,
        )

    def listen(self, sample: Sample) -> None:
        """Take in a sample at rest, nobody touching."""
        self._sense.listen(self._measurement(sample))

    def settle(self) -> None:
        """The end of it."""
        self._sense.settle()

    def feel(self, sample: Sample) -> float:
        """The torque now."""
        return self._sense.feel(self._measurement(sample))


def play(
    path: TaughtPath,
    rig: Rig,
    setup: TrialSetup,
    *,
    loops: int = 1,
    parameters: Parameters | None = None,
    contact: float = math.inf,
    behind: float = math.inf,
    log: str | os.PathLike[str] | None = None,
    force: bool = False,
    obstacle: Callable[[Sample], float] | None = None,
    progress: Callable[[float], None] | None = None,
    watch: Watch | None = None,
) -> Played:
    """Play a path.

    Args:
        path: inside the rig's limits (`path.limited`).
        rig: prepared here; stopped in every case, not closed.
        setup: payload and tilt; where it starts is where the axis is.
        loops: how often; it goes back to the start in between.
        parameters: of the axis, for the contact.
        contact: a torque beyond this stops it, N m (N).
        behind: an axis farther from its path than this stops it, rad (m).
        log: where to write the run.
        force: overwrite it.
        obstacle: simulated: torque that something puts on the axis, N m (N), from the last sample.
        progress: called with the share done, 0 to 1.
        watch: called with every sample.

    Raises:
        InputError: the log cannot be written.
        RigFault: the rig failed.
    """
    period = rig.period_s
    rig = Supervisor(rig)
    player = _Player(rig, path.kind, setup, log, force, obstacle, watch)
    interrupted = False
    stopped: Stop | None = None
    lag = LAG_S
    least = _TRIM_SHARE * float(np.max(np.abs(np.gradient(path.position, path.time))))
    sense = ContactSense(parameters, period, setup) if parameters is not None else None
    try:
        rig.prepare(setup)
        sample = player.begin()
        for loop in range(loops):
            sample = _approach(player, sample, float(path.position[0]), APPROACH_SPEED[path.kind])
            if loop == 0:
                sample = _listen(player, sample, sense)
            begun = sample.time_s
            while (now := sample.time_s - begun) < path.duration:
                wanted, speed = path.at(now + period)
                sample = player.step(wanted + lag * speed, wanted)
                if abs(speed) > least:
                    late = min(max((wanted - sample.position) / speed, -LAG_S), LAG_S)
                    lag = min(max(lag + _TRIM * late, 0.0), _LONGEST_LAG_S)
                torque = sense.feel(sample) if sense is not None else None
                stopped = _judge(sample, wanted, torque, contact, behind)
                if stopped is not None:
                    break
                if progress is not None:
                    progress(min((loop + now / path.duration) / loops, 1.0))
            if stopped is not None:
                break
    except KeyboardInterrupt:
        interrupted = True
    except BaseException:
        with (
            deferred_signals(),
            suppress(RigFault),
        ):  # where this fails too, the first fault is the one to tell
            rig.stop()
        raise
    finally:
        with deferred_signals():
            player.close()
    with deferred_signals():
        rig.stop()
    rows = np.array(player.path_rows, dtype=float).reshape(-1, 3)
    return Played(rows[:, 0], rows[:, 1], rows[:, 2], lag, stopped, interrupted)


def _judge(sample: Sample, wanted: float, torque: float | None, contact: float, behind: float) -> Stop | None:
    """Whether something is in the way."""
    if torque is not None and abs(torque) > contact:
        return Stop(sample.time_s, sample.position, torque, "contact")
    if abs(sample.position - wanted) > behind:
        return Stop(sample.time_s, sample.position, torque, "behind")
    return None


def _approach(player: _Player, sample: Sample, goal: float, speed: float) -> Sample:
    """Move to `goal` with a smooth start and end, and stand."""
    start = sample.position
    way = goal - start
    duration = max(1.5 * abs(way) / speed, 0.2)  # a smooth step's middle is half as fast again as its mean
    begun = sample.time_s
    while (now := sample.time_s - begun) < duration + REST_S:
        share = min(now / duration, 1.0)
        sample = player.step(start + way * share * share * (3.0 - 2.0 * share))
    return sample


def _listen(player: _Player, sample: Sample, sense: ContactSense | None) -> Sample:
    """Stand for a moment and read the friction."""
    place = player.commanded
    begun = sample.time_s
    while sample.time_s - begun < REST_S:
        if sense is not None:
            sense.listen(sample)
        sample = player.step(place)
    if sense is not None:
        sense.settle()
    return sample


class _Player:
    """Steps the rig and keeps the rows."""

    def __init__(
        self,
        rig: Rig,
        kind: str,
        setup: TrialSetup,
        log: str | os.PathLike[str] | None,
        force: bool,
        obstacle: Callable[[Sample], float] | None,
        watch: Watch | None,
    ) -> None:
        self._rig, self._obstacle, self._watch = rig, obstacle, watch
        self._sample: Sample | None = None
        self.commanded = 0.0
        self.path_rows: list[tuple[float, float, float]] = []
        roles = columns_of(rig.axis.kind)
        names = ("trial", "time", "position", "velocity", *rig.step_readings, "position_command", "payload")
        columns = [roles[name] for name in names] + [roles["tilt_alpha"], roles["tilt_beta"]]
        self._start = setup.start_position
        self._surroundings = (setup.payload_kg, setup.tilt_alpha_rad, setup.tilt_beta_rad)
        self._rows: list[tuple[Any, ...]] = []
        self._writer = LogWriter(log, columns, rig.axis, "play", force=force) if log is not None else None

    def begin(self) -> Sample:
        """The first sample, the axis held where it is."""
        return self.step(place_of(self._rig) if self._start is None else self._start)

    def step(self, command: float, wanted: float | None = None) -> Sample:
        """Command a position; `wanted` is where the path is, None off the path."""
        low, high = self._rig.limits.position
        command = min(max(command, low), high)
        torque = self._obstacle(self._sample) if self._obstacle and self._sample else 0.0
        self._sample = sample = self._rig.step(command, torque)
        self.commanded = command
        if self._watch is not None:
            self._watch(sample.time_s, sample.position, sample.effort, math.nan)
        if wanted is not None:
            self.path_rows.append((sample.time_s, sample.position, wanted))
        if self._writer is not None:
            efforts = (getattr(sample, name) for name in self._rig.step_readings.values())
            row = (0, sample.time_s, sample.position, sample.velocity, *efforts, command)
            self._rows.append((*row, *self._surroundings))
            if len(self._rows) >= 25:
                self._flush(self._writer)
        return sample

    def _flush(self, writer: LogWriter) -> None:
        rows, self._rows = np.array(self._rows, dtype=float), []
        if len(rows):
            writer.append(rows)

    def close(self) -> None:
        """Write what is left."""
        if self._writer is not None:
            try:
                self._flush(self._writer)
            finally:
                self._writer.close()
