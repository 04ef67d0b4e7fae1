"""What the residual depends on: tests that respect autocorrelation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from idtool.diagnosis.evidence import Background, background_of
from idtool.diagnosis.lines import strongest_line
from idtool.fit.basis import beyond
from idtool.fit.chance import gamma_tail
from idtool.fit.covariance import correlation_rows
from idtool.fit.joint import JointFit
from idtool.model.motion import Array
from idtool.model.running import running_median
from idtool.signals.fast_length import fast_length

#: A residual depends on a variable if a smooth function of it takes away this share of the variance ...
DEPENDS = 0.10
#: ... and chance would do so less often than this.
_CHANCE = 1e-4
#: Enough where it is certain that something is left.
_HARDLY_CHANCE = 0.01
_SMOOTH = 8
#: Friction can have a narrow bump over the velocity, and wander in time.
_SMOOTH_FINER = 16
#: Friction changes sign with the motion: what changes friction shows only with the direction taken out.
_SMOOTH_WITH_DIRECTION = 5


@dataclass(frozen=True)
class ResidualTest:
    """One variable.

    Attributes:
        variable: "position", "velocity", ...
        share: share of the residual's variance that a smooth function of the variable explains.
        p_value: of no relation; autocorrelated rows count as the fewer they are worth.
    """

    variable: str
    share: float
    p_value: float

    @property
    def depends(self) -> bool:
        """Whether the relation is both real and large enough to matter."""
        return self.share > DEPENDS and self.p_value < _CHANCE

    @property
    def may_depend(self) -> bool:
        """Whether the relation is large enough to matter and hardly chance."""
        return self.share > DEPENDS and self.p_value < _HARDLY_CHANCE


def test_residual(fit: JointFit, least: float) -> list[ResidualTest]:
    """Test the residual of a fit against everything that was measured.

    Args:
        fit: any fit.
        least: share of the variance that is of interest; the chance of a smaller one is left at 1, which
            saves most of the time.
    """
    background = background_of(fit)
    tests = []
    for name, columns in generic_columns(fit).items():
        found = [_test(background, name, columns, least)]
        # a residual can also beat in time or ripple over the angle, which no smooth function shows
        if name == "position":
            found.append(_line_test(background, name, fit.model.recording.motion.position, least))
        if name == "time":
            found.append(_frequency_test(background))
        tests.append(max(found, key=lambda test: test.share))
    return sorted(tests, key=lambda test: -test.share)


test_residual.__test__ = False  # type: ignore[attr-defined]


def autocorrelation(fit: JointFit) -> float:
    """Integrated autocorrelation time of the residual in filtered rows; 1 is white."""
    return correlation_rows(fit.residual, fit.model.recording.filtered_trial)


def generic_columns(fit: JointFit) -> dict[str, Array]:
    """For each variable that was measured, columns (filtered rows, n) that span smooth functions of it.

    Friction changes sign with the motion, so what changes friction shows in a function of the variable times
    the direction.
    """
    recording = fit.model.recording
    motion, rows = recording.motion, recording.row
    direction = np.sign(motion.velocity[rows])
    variables: dict[str, Array | None] = {
        "position": motion.position,
        "velocity": motion.velocity,
        "acceleration": motion.acceleration,
        "load": motion.load,
        "temperature": motion.temperature,
        "time": motion.time,
    }
    columns = {}
    for name, values in variables.items():
        if values is None or np.ptp(values[rows]) <= 1e-9 * (1.0 + np.max(np.abs(values))):
            continue
        rank = _ranks(values[rows]) / len(rows)  # equal numbers of rows under each bend
        bends = _SMOOTH_FINER if name in ("velocity", "time") else _SMOOTH
        smooth = _bends(rank, bends)
        if name not in ("velocity", "acceleration"):
            smooth = np.hstack([smooth, direction[:, None] * smooth[:, :_SMOOTH_WITH_DIRECTION]])
        columns[name] = smooth
    columns["direction"] = direction[:, None]
    order = (recording.filtered_trial[:, None] == np.arange(recording.trials)).astype(float)
    columns["order"] = np.hstack([order, direction[:, None] * order])
    if recording.weight is None:
        return columns
    return {name: recording.row_weight[:, None] * values for name, values in columns.items()}


def _bends(rank: Array, bends: int) -> Array:
    """Cosines of half a wave, one wave, ... over ranks from 0 to 1, (n, bends); each from the two before."""
    first = np.cos(np.pi * rank)
    waves = [np.ones(len(rank)), first]
    while len(waves) <= bends:
        waves.append(2.0 * first * waves[-1] - waves[-2])
    return np.column_stack(waves[1:])


def _ranks(values: Array) -> Array:
    """Rank of each value from 1, equal ones sharing their mean, shape (n,)."""
    _, place, count = np.unique(values, return_inverse=True, return_counts=True)
    return np.asarray((np.cumsum(count) - 0.5 * (count - 1))[place])


def columns_followed(fit: JointFit, names: Sequence[str]) -> list[Array]:
    """Columns (filtered rows, n) that follow each of these variables as `test_residual` looks for it."""
    columns = generic_columns(fit) if names else {}
    return [_with_wave(fit, columns[name]) if name == "position" else columns[name] for name in names]


def _with_wave(fit: JointFit, columns: Array) -> Array:
    """With the strongest wave over the position beside them."""
    recording = fit.model.recording
    values = recording.motion.position[recording.row]
    angle = _line(background_of(fit), values)[0] * values
    wave = np.column_stack([np.sin(angle), np.cos(angle)])
    return np.hstack([columns, recording.row_weight[:, None] * wave])


def motion_columns(fit: JointFit) -> Array:
    """Smooth functions of position, velocity and acceleration side by side, (filtered rows, n)."""
    known = fit.model.recording.of_rows
    if motion_columns not in known:
        generic, names = generic_columns(fit), ("position", "velocity", "acceleration")
        known[motion_columns] = np.hstack([generic[name] for name in names if name in generic])
    return np.asarray(known[motion_columns])


def _line_test(background: Background, name: str, values: Array, least: float) -> ResidualTest:
    """The strongest sine of a variable, from one period over its range to what the rows resolve."""
    recording = background.recording
    values = values[recording.row]
    if np.ptp(values) <= 0.0:
        return ResidualTest(name, 0.0, 1.0)
    frequency, looked_at = _line(background, values)
    angle = frequency * values
    wave = np.column_stack([np.sin(angle), np.cos(angle)])
    test = _test(background, name, recording.row_weight[:, None] * wave, least)
    return ResidualTest(name, test.share, min(1.0, test.p_value * looked_at))


def _line(background: Background, values: Array) -> tuple[float, int]:
    """Frequency of the strongest sine of a variable, and how many were looked at."""
    span = float(np.ptp(values))
    highest = 2.0 * np.pi * min(400, max(len(values) // 20, 8)) / span
    return strongest_line(background, values, 2.0 * np.pi / span, highest)


def _frequency_test(background: Background) -> ResidualTest:
    """The strongest line of the spectrum in time, each trial with its own phase.

    A ringing that every trial starts anew has no common phase, but the power of all trials together
    stands out at its frequency.
    """
    recording = background.recording
    n = len(recording.row)
    residual, trial = background.residual[:n], recording.filtered_trial
    size = fast_length(int(np.max(np.bincount(trial))))
    power = np.zeros(size // 2 + 1)
    windows = 0
    for t in range(recording.trials):
        piece = residual[trial == t]
        if len(piece) < 16:
            continue
        # all trials on one axis of frequencies; a longer one has the finer lines
        power += np.abs(np.fft.rfft(piece - piece.mean(), size)) ** 2 / len(piece)
        windows += 1
    if windows == 0:
        return ResidualTest("time", 0.0, 1.0)
    power = power[1:] / windows
    wide = max(len(power) // 12, 8)
    level = running_median(power, wide) / math.log(2.0)
    stands_out = np.maximum(power - 3.0 * level, 0.0)
    share = float(stands_out.sum() / power.sum())
    peak = float(np.max(power / np.maximum(level, 1e-300)))
    # the mean of `windows` exponential ordinates over their level
    single = gamma_tail(windows, peak * windows)
    return ResidualTest("time", share, min(1.0, single * len(power)))


def _test(background: Background, name: str, columns: Array, least: float) -> ResidualTest:
    n = len(columns)
    residual = background.residual[:n]
    span = beyond(background.basis[:n], columns)
    if span.shape[1] == 0:
        return ResidualTest(name, 0.0, 1.0)
    left = residual - span @ (span.T @ residual)
    share = max(float(1.0 - left @ left / (residual @ residual)), 0.0)
    return ResidualTest(name, share, background.chance(left, span) if share >= least else 1.0)
