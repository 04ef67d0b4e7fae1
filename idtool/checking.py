"""Quality of logs before any fit: what they are like, and what they can and cannot determine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from idtool.effects import registry
from idtool.fit.choose import choose_gravity
from idtool.log import Log, columns_of
from idtool.model import gravity
from idtool.model.motion import Array, Motion
from idtool.parameters import GRAVITY_MODELS
from idtool.signals import Recording, record

SCHEMA = "ffc-id/check/1"
#: A step of time this many times the usual one is a gap; steps that scatter by more than this share jitter.
_GAP = 2.5
_JITTER = 0.1
#: A run of this many equal readings while the axis moves is a stuck sensor.
_STUCK_ROWS = 50
#: This share of rows at the extreme current is a flat top.
_FLAT = 0.01
_STEADY_S = 0.4
_LEAST_PAYLOADS = 3


@dataclass(frozen=True)
class LogCheck:
    """One log: facts by name, and findings as sentences."""

    file: str
    experiment: str
    facts: dict[str, Any]
    findings: list[str]


@dataclass(frozen=True)
class Verdict:
    """What the data can or cannot determine.

    Attributes:
        what: a parameter or an effect.
        why: in words.
        run: the run that would show it; "" where the data do.
    """

    what: str
    why: str
    run: str = ""


@dataclass(frozen=True)
class Check:
    """The outcome: each log, and the session that they make together."""

    logs: list[LogCheck]
    can: list[Verdict]
    cannot: list[Verdict]

    def to_document(self) -> dict[str, Any]:
        """A JSON document."""
        return {
            "schema": SCHEMA,
            "logs": [vars(log) for log in self.logs],
            "session": {"can": [vars(v) for v in self.can], "cannot": [vars(v) for v in self.cannot]},
        }


def check(logs: Sequence[Log]) -> Check:
    """Look at logs one by one and together.

    Raises:
        InputError: they cannot be used at all (see `signals.record`).
    """
    recording = record(logs)
    singles = [_check_log(log, recording, index) for index, log in enumerate(logs)]
    can, cannot = _determine(_with_some_load(recording))
    return Check(singles, can, cannot)


def _with_some_load(recording: Recording) -> Recording:
    """The recording with a load of the right shape: before a fit its size is not known."""
    model, columns = choose_gravity(recording)
    if model is None:
        return recording
    order = tuple(GRAVITY_MODELS[model])
    free = [order.index(name) for name in columns]
    return recording.with_load(
        gravity.columns(model, recording.motion)[:, free].sum(axis=1),
        gravity.upright_columns(model, recording.motion)[:, free].sum(axis=1),
    )


def _check_log(log: Log, recording: Recording, index: int) -> LogCheck:
    motion = recording.motion
    trials = [t for t, source in enumerate(recording.source) if source == index]
    rows = np.isin(motion.trial, trials)
    first = motion.first[rows]
    steps = motion.step[rows][~first]
    usual = float(np.median(steps))
    gaps = int(np.sum(steps > _GAP * usual))
    even = steps[steps <= _GAP * usual]
    jitter = float(np.std(even) / usual)
    windows = _steady_windows(motion, rows)
    facts: dict[str, Any] = {
        "rows": int(rows.sum()),
        "trials": len(trials),
        "seconds": float(steps.sum()),
        "rate_hz": 1.0 / usual,
        "gaps": gaps,
        "jitter_percent": 100.0 * jitter,
        "top_speed": float(np.quantile(np.abs(motion.velocity[rows]), 0.999)),
        "stroke": float(np.ptp(motion.position[rows])),
        "steady_windows": len(windows),
        "unusable_rows": int(np.sum(~recording.usable[rows])),
        "torque_noise": recording.noise,
    }
    findings = []
    if log.incomplete:
        findings.append("was cut short; it is used up to its last whole row")
    if gaps:
        findings.append(f"{gaps} gaps in time of up to {float(steps.max()):.3g} s")
    if jitter > _JITTER:
        findings.append(f"the sampling jitters by {100 * jitter:.0f} % of its period")
    findings += _sensor_findings(log, motion.velocity[rows])
    lost = facts["unusable_rows"]
    if lost > 0.02 * facts["rows"]:
        findings.append(
            f"{lost} rows will not be compared (outliers, or motion faster than its sampling): "
            "move more smoothly"
        )
    return LogCheck(log.source, log.experiment, facts, findings)


def _sensor_findings(log: Log, velocity: Array) -> list[str]:
    findings = []
    names = columns_of(log.axis.kind)
    moving = np.abs(velocity) > 0.1 * float(np.max(np.abs(velocity)))
    for role in ("position", "velocity", "current", "torque"):
        values = log.column(role)
        if values is None:
            continue
        run = _longest_run(np.concatenate([[False], np.diff(values) == 0]) & moving)
        if run >= _STUCK_ROWS and role != "torque":
            findings.append(
                f'column "{names[role]}" stands still for {run} rows while the axis moves: stuck?'
            )
        if role in ("current", "torque"):
            top = float(np.max(np.abs(values)))
            flat = float(np.mean(np.abs(values) >= top * (1.0 - 1e-6)))
            if flat > _FLAT:
                findings.append(
                    f'column "{names[role]}" is at its extreme {top:.3g} on {100 * flat:.0f} % of the '
                    "rows: saturated?"
                )
    return findings


def _longest_run(flags: NDArray[np.bool_]) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return int(np.max(edges[1::2] - edges[::2], initial=0))


def _steady_windows(motion: Motion, rows: NDArray[np.bool_]) -> list[tuple[float, float]]:
    """(speed, travel) of each stretch of constant speed, from the smoothed velocity alone."""
    w, time, trial = motion.velocity[rows], motion.time[rows], motion.trial[rows]
    top = float(np.quantile(np.abs(w), 0.999))
    bins = np.round(w / (0.04 * top)).astype(int)
    edges = np.flatnonzero((np.diff(bins) != 0) | (np.diff(trial) != 0)) + 1
    bounds = np.concatenate([[0], edges, [len(w)]])
    windows = []
    for begin, end in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        seconds = float(time[end - 1] - time[begin])
        speed = float(np.mean(w[begin:end]))
        if seconds >= _STEADY_S and abs(speed) > 0.05 * top:
            windows.append((speed, abs(speed) * seconds))
    return windows


def _determine(recording: Recording) -> tuple[list[Verdict], list[Verdict]]:
    can: list[Verdict] = []
    cannot: list[Verdict] = []

    def judge(what: str, shown: bool, why: str, lack: str, run: str) -> None:
        (can if shown else cannot).append(Verdict(what, why) if shown else Verdict(what, lack, run))

    motion = recording.motion
    everything = np.ones(len(motion), dtype=bool)
    acting = motion.gravity_factor is None or float(np.max(np.abs(motion.gravity_factor))) > 0.1
    payloads = 0 if motion.payload is None else len(np.unique(np.round(motion.payload, 3)))
    if motion.payload is not None or motion.gravity_factor is not None:
        judge(
            "gravity: base", acting, "gravity acts", "gravity never acts in these logs", "ffc-id run-gravity"
        )
        judge(
            "gravity: per payload",
            acting and payloads >= _LEAST_PAYLOADS,
            f"{payloads} payloads",
            f"{payloads} payload{'' if payloads == 1 else 's'} only" if acting else "gravity never acts",
            "ffc-id run-gravity",
        )
    windows = _steady_windows(motion, everything)
    speeds = sorted({round(abs(speed), 3) for speed, _ in windows})
    both = any(speed > 0 for speed, _ in windows) and any(speed < 0 for speed, _ in windows)
    moving = np.abs(motion.velocity) > 1e-3 * float(np.max(np.abs(motion.velocity)))
    reversals = int(np.count_nonzero(np.diff(np.sign(motion.velocity[moving]))))
    judge(
        "friction: Coulomb and viscous",
        (len(speeds) >= 3 and both) or reversals >= 4,
        f"{len(speeds)} constant speeds, {reversals} reversals",
        f"{len(speeds)} constant speeds" + ("" if both else " in one direction only"),
        "ffc-id run-sweep",
    )
    fastest = float(np.quantile(np.abs(motion.velocity), 0.999))
    slow = bool(speeds) and speeds[0] < 0.3 * fastest
    judge(
        "friction: static level and Stribeck velocity",
        slow or reversals >= 8,
        f"slowest constant speed {speeds[0] if speeds else 0:.3g}, {reversals} reversals",
        "no low speeds and few reversals",
        "ffc-id run-sweep with more low speeds",
    )
    judge(
        "friction: sigma0 and sigma1",
        reversals >= 4 and recording.position_resolution > 0,
        f"{reversals} reversals; the fit says whether the presliding travel exceeds 3 steps of "
        f"{recording.position_resolution:.2g}",
        f"{reversals} reversals" if recording.position_resolution > 0 else "no position was logged",
        "ffc-id run-sine",
    )
    for effect in registry.library():
        reason = effect.missing(motion)
        judge(f"effect: {effect.name}", reason is None, "testable", reason or "", effect.reveals)
    return can, cannot
