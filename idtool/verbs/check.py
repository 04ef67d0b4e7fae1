"""Quality of logs before any fit: what they are like, and what they can and cannot determine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from idtool.diagnosis.remainder import remainder
from idtool.effects import registry
from idtool.errors import InputError
from idtool.fit.choose import choose_gravity, first_fits
from idtool.fit.identifiability import shortcomings
from idtool.fit.next_sweep import run_command
from idtool.fit.shortcoming import PARTS, Shortcoming
from idtool.fit.spec import Spec
from idtool.log import Log, columns_of
from idtool.log.clock import GAP, missing_rows
from idtool.model import gravity
from idtool.parameters import GRAVITY_MODELS
from idtool.presentation.text import counted, listed
from idtool.signals import Recording, record
from idtool.signals.coverage import constant_speeds, moves_one_way, steady_stretches

SCHEMA = "ffc-id/check/1"
#: Steps of time that scatter by more than this share jitter.
_JITTER = 0.1
#: Code of a session that no model can be fitted to.
NO_FIT = "no_fit"
#: A run of this many equal readings while the axis is told to move may be a stuck sensor.
_STUCK_ROWS = 50
#: So many impossible readings are listed for a person.
_LISTED = 10
#: Travel that sensors must tell of, commanded but not read, as a share of the whole commanded travel.
_UNREAD = 0.05


@dataclass(frozen=True)
class LogCheck:
    """One log.

    Attributes:
        file, experiment: which it is.
        facts: by name.
        findings: sentences.
        impossible: readings that cannot be: `line` (of the file, from 1), `row` (of the data, from 0),
            `column`, `value`, `expected`.
    """

    file: str
    experiment: str
    facts: dict[str, Any]
    findings: list[str]
    impossible: list[dict[str, Any]]


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
    """The outcome: each log, and the session that they make together.

    Attributes:
        logs: each log by itself.
        can, cannot: what the session determines, and what not.
        open: what only `identify` tells, because the bare model leaves more than noise of these logs.
        findings: what the session lacks, as a fit of it will say.
        notes: rows that will not be compared, and what was repaired.
        odd: the logs whose columns contradict each other.
    """

    logs: list[LogCheck]
    can: list[Verdict]
    cannot: list[Verdict]
    open: list[Verdict]
    findings: list[Shortcoming]
    notes: list[str]
    odd: tuple[str, ...] = ()

    def to_document(self) -> dict[str, Any]:
        """A JSON document."""
        return {
            "schema": SCHEMA,
            "logs": [vars(log) for log in self.logs],
            "session": {
                "can": [vars(v) for v in self.can],
                "cannot": [vars(v) for v in self.cannot],
                "open": [vars(v) for v in self.open],
                "findings": [one.to_document() for one in self.findings],
                "notes": self.notes,
            },
        }


def check(logs: Sequence[Log]) -> Check:
    """Look at logs one by one and together.

    What a session lacks follows from a trial fit of the base model, by the same rules that the fits use;
    its parameters are not handed out.

    Raises:
        InputError: they cannot be used at all (see `signals.record`).
    """
    recording = record(logs)
    _ = recording.operator  # refuses a session of which no row can be compared
    singles = [_check_log(log, recording, index) for index, log in enumerate(logs)]
    lacking, left = _lacking(recording)
    can, cannot, rest = _determine(_with_some_load(recording), lacking, left)
    known = [one for one in lacking if not (left and one.by_error)]
    return Check(singles, can, cannot, rest, known, recording.told_of_rows(), tuple(recording.odd))


def _lacking(recording: Recording) -> tuple[list[Shortcoming], str]:
    """What a fit of the base model to all logs lacks, and what follows what it leaves; "" if noise."""
    model, columns = choose_gravity(recording)
    try:
        fit = first_fits(recording, Spec("lugre", model, columns))[-1]
    except InputError as error:  # too few rows for any of it
        return [Shortcoming(NO_FIT, PARTS, (), error.problem, error.remedy)], ""
    left = remainder(fit)
    what = (
        ""
        if left is None
        else f"follows the {listed(list(left.depends_on))}"
        if left.depends_on
        else "is no noise"
    )
    return shortcomings(fit), what


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
    missing = missing_rows(motion.time[rows], first)
    even = steps[steps <= GAP * usual]
    jitter = float(np.std(even) / usual)
    facts: dict[str, Any] = {
        "rows": log.row_count,
        "trials": int(log.trial_of_rows[-1]) + 1,
        "seconds": float(steps.sum()),
        "rate_hz": 1.0 / usual,
        "gaps": int(np.sum(steps > GAP * usual)),
        "missing_rows": missing,
        "jitter_percent": 100.0 * jitter,
        "top_speed": float(np.quantile(np.abs(motion.velocity[rows]), 0.999)),
        "stroke": float(np.ptp(motion.position[rows])),
        "steady_windows": sum(bool(rows[begin]) for begin, _ in steady_stretches(recording)),
        "unusable_rows": int(np.sum(~recording.usable[rows])) + log.row_count - int(rows.sum()),
        "torque_noise": recording.noise,
    }
    findings = [one.removeprefix(f"{log.source}: ") for one in recording.wiring[index]]
    if log.incomplete:
        findings.append("was cut short; it is used up to its last whole row")
    if missing:
        findings.append(f"{counted(facts['gaps'], 'gap')} in time of up to {float(steps.max()):.3g} s")
    if jitter > _JITTER:
        findings.append(f"the sampling jitters by {100 * jitter:.0f} % of its period")
    findings += _not_following(log)
    lost = facts["unusable_rows"]
    if lost > 0.02 * facts["rows"]:
        findings.append(f"{lost} of {counted(facts['rows'], 'row')} will not be compared")
    impossible = [
        {
            "line": log.first_line + one.row if log.first_line else None,
            "row": one.row,
            "column": one.column,
            "value": one.value,
            "expected": one.expected,
        }
        for one in recording.impossible[index]
    ]
    findings += [
        f"{log.place(one.row)}: {one.column} {one.value:.6g} cannot be, the rows around it say "
        f"{one.expected:.4g}"
        for one in recording.impossible[index][:_LISTED]
    ]
    if len(impossible) > _LISTED:
        findings.append(
            f"{counted(len(impossible) - _LISTED, 'more reading')} that cannot be (--json lists them)"
        )
    return LogCheck(log.source, log.experiment, facts, findings, impossible)


def _not_following(log: Log) -> list[str]:
    """Position and velocity that stand still while the axis is told to move.

    With one of the two a stuck sensor cannot be told from an axis that is held, so this is only said.
    """
    command = log.column("velocity_command")
    if command is None:
        return []
    findings = []
    time = log.values_of("time_s")
    step = np.clip(np.diff(time, prepend=time[0]), 0.0, None)
    told = np.abs(command) * step
    for role in ("position", "velocity"):
        values = log.column(role)
        if values is None:
            continue
        still = np.concatenate([[False], np.diff(values) == 0])
        edges = np.flatnonzero(np.diff(still.astype(int), prepend=0, append=0))
        for begin, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            steady = role == "velocity" and np.ptp(command[begin:end]) < 1e-9
            if end - begin >= _STUCK_ROWS and told[begin:end].sum() > _UNREAD * told.sum() and not steady:
                name = columns_of(log.axis.kind)[role]
                findings.append(
                    f'column "{name}" stands still for {end - begin} rows from row {begin + 1} while the '
                    "axis is told to move: the sensor is stuck, or the axis is held"
                )
                break
    return findings


def _determine(
    recording: Recording, lacking: Sequence[Shortcoming], left: str
) -> tuple[list[Verdict], list[Verdict], list[Verdict]]:
    """What the data can, cannot and may determine; the last where the bare model leaves what `left` says."""
    can: list[Verdict] = []
    cannot: list[Verdict] = []
    rest: list[Verdict] = []

    def judge(what: str, names: Sequence[str], why: str, lack: str = "", run: str = "") -> None:
        """Not determined if `lack` says so, or if a shortcoming does of one of the named parameters."""
        short = next((one for one in lacking if one.code == NO_FIT or set(names) & set(one.parameters)), None)
        if lack:
            cannot.append(Verdict(what, lack, run))
        elif short is not None and short.by_error and left:
            rest.append(Verdict(what, f"what the bare model leaves {left}", "ffc-id identify"))
        elif short is not None and short.code in ("at_bound", NO_FIT):  # no run is known to correct that
            cannot.append(Verdict(what, f"{short.why}; {short.remedy}"))
        elif short is not None:
            cannot.append(Verdict(what, short.why, short.run or short.remedy))
        else:
            can.append(Verdict(what, why))

    motion = recording.motion
    acting = motion.gravity_factor is None or float(np.max(np.abs(motion.gravity_factor))) > 0.1
    payloads = 0 if motion.payload is None else len(np.unique(np.round(motion.payload, 3)))
    if motion.payload is not None or motion.gravity_factor is not None:
        never = "" if acting else "gravity never acts in these logs"
        run = run_command(recording, "gravity")
        judge("gravity: base", ["gravity.base"], "gravity acts", never, run)
        never = never or ("" if payloads > 1 else "one payload only")
        judge("gravity: per payload", ["gravity.per_payload"], counted(payloads, "payload"), never, run)
    speeds = sorted({round(abs(speed), 3) for speed in constant_speeds(recording)})
    moving = np.abs(motion.velocity) > 1e-3 * float(np.max(np.abs(motion.velocity)))
    reversals = int(np.count_nonzero(np.diff(np.sign(motion.velocity[moving]))))
    turns = counted(reversals, "reversal")
    judge(
        "friction: Coulomb and viscous",
        ["static.coulomb", "static.viscous"],
        f"{counted(len(speeds), 'constant speed')}, {turns}",
        ""
        if len(speeds) >= 3 or reversals >= 4 or moves_one_way(recording)
        else f"{counted(len(speeds), 'constant speed')} and {turns} only",
        run_command(recording, "sweep"),
    )
    judge(
        "friction: stiction and Stribeck velocity",
        ["static.static", "static.stribeck_velocity"],
        f"{f'slowest constant speed {speeds[0]:.3g}' if speeds else 'no constant speed'}, {turns}",
    )
    judge(
        "friction: sigma0 and sigma1",
        ["dynamic.bristle_stiffness", "dynamic.bristle_damping"],
        f"{turns}; position steps of {recording.position_resolution:.2g}",
        "" if recording.position_resolution > 0 else "no position was logged",
        run_command(recording, "sine"),
    )
    for effect in registry.library():
        reason = effect.missing(motion)
        what = effect.name if effect.name == "inertia" else f"effect: {effect.name}"
        judge(what, [f"effects.{effect.name}"], "testable", reason or "", effect.reveals)
    return can, cannot, rest
