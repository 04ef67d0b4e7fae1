"""Fit a parameter file to the motion itself: the position that the logged effort makes, not the torque.

A servo that reports duty and no current tells its torque badly: what bends the line from duty to torque, the
friction that its gears take of a load, and rows at rest under a changing duty all look alike there, row by
row. The motion tells them apart. The logs are simulated over windows of one second, each from the
measured state (Bock's multiple shooting with the states that were measured, and what MuJoCo's own
identification does), and bounded least squares with a soft loss bring the simulated position to the measured
one. Windows, since over a whole trial one slip at a wrong moment outweighs all the rest.

Source: Bock, "Recent advances in parameter identification techniques for ODE", 1983; for friction under load
Duclusaud et al. 2025 (BAM, model M4).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from idtool.errors import InputError
from idtool.fit.drive import fit_drive
from idtool.fit.outcome import Outcome
from idtool.log import Log
from idtool.parameters import Parameter, Parameters
from idtool.parameters.drive import with_loop
from idtool.signals import Recording, record
from idtool.signals.lateness import without_late_velocity
from idtool.simulation.in_step import in_step, lateness, lateness_in, less, with_lateness
from idtool.simulation.plant import PlantFile
from idtool.simulation.search import MOST, TRIED, MotionSearch, Tried
from idtool.simulation.stage import measured_position
from idtool.simulation.starts import regress, scales_of, starts_of_a_gearbox

#: Of the tries so many are followed to their end: after a few steps the best one is not always ahead.
_FOLLOWED = 3
_FROM_REGRESSION = (
    "it began with a regression, so that friction along the stroke, ripple and the like are not in it and "
    "pull at what is; `ffc-id identify` names them, and its file is where to start (--start)."
)


@dataclass(frozen=True)
class MotionFit:
    """A file fitted to the motion.

    Attributes:
        parameters: the file.
        before, after: rms error over windows of one second from the effort, rad (m); `before` is that of the
            start.
        evaluations: how often the logs were simulated.
        outcome: how the last fit ended.
        notes: sentences that qualify it.
    """

    parameters: Parameters
    before: float
    after: float
    evaluations: int
    outcome: Outcome
    notes: tuple[str, ...]


def fit_motion(
    logs: Sequence[Log],
    known: Parameters | None = None,
    *,
    tell: Callable[[str], None] = lambda _: None,
    progress: Callable[[float], None] | None = None,
) -> MotionFit:
    """Fit.

    Args:
        logs: of one axis, with its position (or speed).
        known: a file to start from, whose gravity model, friction law and effects are kept; a regression
            on the moving rows if None.
        tell: called with a sentence on what is going on.
        progress: called with the share done, 0 to 1.

    Raises:
        InputError: logs that cannot be used or tell no inertia, or a file without inertia or friction.
    """
    logs, notes = without_late_velocity(logs)
    recording = record(logs, every_row=True)
    measured = measured_position(logs, recording)
    first = regress(recording) if known is None else known
    if known is not None and not known.static:
        raise InputError(
            "the parameter file has no [friction.static]",
            remedy="make it with ffc-id identify, or leave it out: a regression starts the fit then",
        )
    first, scales = _with_drive(_without_bristle(first), logs), scales_of(recording)
    search = MotionSearch(logs, recording, measured, first.drive)
    starts = [first, *starts_of_a_gearbox(first, recording, scales, drive_was_off=search.drive_was_off)]
    tell("fitting the motion")
    before = search.rms(first)
    last = [TRIED, MOST] if known is not None else [TRIED, MOST, MOST]
    search.plan((*[TRIED] * len(starts), *[MOST] * min(_FOLLOWED, len(starts)), *last), progress)
    tries = [search.fit(one, search.coordinates(one, scales), TRIED) for one in starts]
    nearest = search.apart(tries)[:_FOLLOWED]
    ends = [search.fit(one.parameters, one.coordinates, MOST) for one in nearest]
    best = search.pruned(min(ends, key=lambda one: one.cost))
    if known is None:
        best = search.without_sides(best, scales)
    if not lateness_in(first):
        tell("looking how late the motion is read")
        search, best = _in_step(search, best, logs)
    best = search.finished(best)
    after = search.rms(best.parameters)
    ended = best.outcome
    fitted = search.with_intervals(best)
    _check_that_effort_moves(fitted, recording)
    if not search.drive_was_off:
        fitted = _with_unseen_back_emf(fitted)
    if known is None and not recording.by_voltage:
        notes += [_FROM_REGRESSION]
    if lateness_in(fitted) and not lateness_in(first):
        notes += [f"the motion is read {1e3 * lateness_in(fitted):.1f} ms later than the effort beside it."]
    return MotionFit(
        replace(fitted, provenance={**fitted.provenance, "fit_motion": ended.value}),
        before,
        after,
        search.evaluations,
        ended,
        (
            *recording.contradictions,
            *notes,
            *ended.notes,
            *PlantFile.of(best.parameters, recording.motion.torque_constant).notes,
        ),
    )


def _check_that_effort_moves(fitted: Parameters, recording: Recording) -> None:
    """Constant speeds are matched best by an inertia so large that no torque matters, and nothing is fitted.

    Raises:
        InputError: an inertia that these logs do not tell, and that would have asked for more torque than was
            ever measured.
    """
    inertia = next(one.parameters["inertia"] for one in fitted.effects if one.name == "inertia")
    asked = inertia.value * np.max(np.abs(recording.motion.acceleration))
    if not inertia.identified and asked > np.max(np.abs(recording.torque)):
        raise InputError(
            "these logs tell no inertia, so that nothing says how far a torque moves the axis",
            remedy="add logs that speed up and slow down (ffc-id run-sine makes one)",
        )


def _in_step(search: MotionSearch, best: Tried, logs: Sequence[Log]) -> tuple[MotionSearch, Tried]:
    """The fit with how much later than the effort the motion is read, where that brings it closer."""
    late = lateness(search.driven_by(None), best)
    if late is None:
        return search, best
    first = _with_drive(with_lateness(best.parameters, late), logs)
    other = search.driven_by(first.drive, logs)
    found = other.pruned(other.fit(first, best.coordinates, MOST))
    if not search.is_worse(best, found):
        return search, best
    other.goes_on_for(search)
    return other, found


def _with_drive(parameters: Parameters, logs: Sequence[Log]) -> Parameters:
    """The file with the position loop where the logs have a goal: its gains act on a position of the same
    instant as the duty, and its delay is beside that of the readings."""
    if any(log.column("position_command") is None for log in logs):
        return parameters
    late = lateness_in(parameters)
    try:
        loop = fit_drive([in_step(log, late) for log in logs] if late else logs)
    except InputError:  # the goal is not what drives the motor
        return parameters
    assert loop.delay is not None
    return replace(parameters, drive=with_loop(parameters.drive, replace(loop, delay=less(loop.delay, late))))


def _with_unseen_back_emf(parameters: Parameters) -> Parameters:
    """Of a voltage's viscous coefficient all may be back-EMF, and of a geared motor most is: where no log had
    the drive off that is what a simulation takes off there, as a bound and not as a number that was found."""
    drive = parameters.drive
    told = drive is not None and drive.back_emf is not None and drive.back_emf.identified
    if drive is None or drive.command != "duty" or told or parameters.axis.back_emf_damping:
        return parameters
    viscous = parameters.static["viscous"].value
    unseen = Parameter(viscous).undetermined(at_most=viscous)
    return replace(parameters, drive=replace(drive, back_emf=unseen))


def _without_bristle(parameters: Parameters) -> Parameters:
    """Over a window of a second presliding shows in little but its damping; that is kept if it is sure."""
    known = parameters.dynamic
    sure = known and all(one.known for one in known.values())
    return parameters if sure else replace(parameters, dynamic={})
