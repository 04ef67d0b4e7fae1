"""Moving an axis to places that somebody wants, watched: rows, contact, and a stop in every case.

What the axis feels meanwhile is the hand's torque of the controller (`idtool.control.sensing`), listened to
at rest before it moves; beyond a limit it is a contact. Without a parameter file a contact shows only as an
axis that stays behind its command.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypedDict, Unpack

from idtool.control.force_free import RESOLUTION
from idtool.control.guard import Measurement
from idtool.control.online import OnlineModel
from idtool.control.sensing import HandSense
from idtool.guiding.recorder import RunLog
from idtool.guiding.session import place_of
from idtool.parameters import Parameters
from idtool.rig.base import Rig, Sample, TrialSetup, Watch
from idtool.rig.supervisor import SupervisedRun, Supervisor

#: How long it stands and listens before it moves, s.
REST_S = 0.5
#: An axis so far behind where it is wanted meets something, share of its range.
BEHIND_SHARE = 0.05
#: Filter of the torque that is a contact, s.
_FILTER_S = 0.03


@dataclass(frozen=True)
class Stop:
    """Where and why the axis was stopped.

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


class Watching(TypedDict, total=False):
    """How a rig is watched while it is moved; nothing is, unless told.

    Attributes:
        parameters: of the axis, for the contact.
        contact: a torque beyond this stops it, N m (N).
        behind: an axis farther from where it is wanted than this stops it, rad (m).
        log: where to write the run.
        force: overwrite it.
        obstacle: simulated: torque that something puts on the axis, N m (N), from the last sample.
        watch: called with every sample, and with what touches the axis where a model tells it.
    """

    parameters: Parameters | None
    contact: float
    behind: float
    log: str | os.PathLike[str] | None
    force: bool
    obstacle: Callable[[Sample], float] | None
    watch: Watch | None


class Player(SupervisedRun):
    """A rig that is moved step by step, watched.

    Args:
        rig: prepared here; not closed.
        setup: payload and tilt; where it starts is where the axis is.
        experiment: name of it in the log.
        watching: see `Watching`.

    Attributes:
        commanded: the last command, rad (m).

    Raises:
        InputError: the log cannot be written.
        RigFault: the rig failed.
    """

    def __init__(self, rig: Rig, setup: TrialSetup, experiment: str, **watching: Unpack[Watching]) -> None:
        super().__init__(Supervisor(rig))
        parameters, log = watching.get("parameters"), watching.get("log")
        self._setup = setup
        self._obstacle, self._watch = watching.get("obstacle"), watching.get("watch")
        self._contact = watching.get("contact", math.inf)
        self._behind = watching.get("behind", math.inf)
        self._sense = _contact_sense(parameters, rig.period_s) if parameters is not None else None
        self._felt = math.nan
        self.commanded = 0.0
        force = watching.get("force", False)
        self._log = RunLog(log, rig.axis, experiment, rig, setup, force=force) if log is not None else None

    def begin(self) -> Sample:
        """The first sample, the axis held where it is."""
        self._rig.prepare(self._setup)
        start = self._setup.start_position
        self._sample: Sample | None = None
        return self.step(place_of(self._rig) if start is None else start)

    def listen(self, sample: Sample) -> Sample:
        """Stand for a moment and read the friction."""
        place = self.commanded
        begun = sample.time_s
        while sample.time_s - begun < REST_S:
            if self._sense is not None:
                self._sense.listen(self._measurement(sample))
            sample = self.step(place)
        if self._sense is not None:
            self._sense.settle()
        return sample

    def step(self, command: float) -> Sample:
        """Command a position, inside the range."""
        low, high = self._rig.limits.position
        command = min(max(command, low), high)
        torque = self._obstacle(self._sample) if self._obstacle and self._sample else 0.0
        self._sample = sample = self._rig.step(command, torque)
        self.commanded = command
        if self._watch is not None:
            # what was felt is a sample old: it is felt after the step
            self._watch(sample.time_s, sample.position, sample.effort, self._felt)
        if self._log is not None:
            self._log.add(sample.time_s, sample, command)
        return sample

    def met(self, sample: Sample, wanted: float) -> Stop | None:
        """Whether something is in the way of an axis that is wanted at `wanted`, rad (m)."""
        torque = self._sense.feel(self._measurement(sample)) if self._sense is not None else None
        self._felt = math.nan if torque is None else torque
        if torque is not None and abs(torque) > self._contact:
            return Stop(sample.time_s, sample.position, torque, "contact")
        if abs(sample.position - wanted) > self._behind:
            return Stop(sample.time_s, sample.position, torque, "behind")
        return None

    def _measurement(self, sample: Sample) -> Measurement:
        setup = self._setup
        return Measurement(
            sample.time_s,
            sample.position,
            sample.velocity,
            sample.effort,
            setup.payload_kg,
            setup.tilt_alpha_rad,
            setup.tilt_beta_rad,
            sample.temperature,
        )

    def _end(self) -> None:
        if self._log is not None:
            self._log.close()


def _contact_sense(parameters: Parameters, period: float) -> HandSense:
    """What feels the torque that something else than the axis itself puts on it."""
    model = OnlineModel(parameters)
    model.drop("external_periodic", "its phase is not known once the clock restarts")
    return HandSense(model, period, _FILTER_S, RESOLUTION[parameters.axis.kind])
