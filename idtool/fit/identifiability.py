"""What data cannot determine, in words: one implementation for `check` and for every fit.

`shortcomings(fit)` lists what the data behind a fit lack: which parameters that leaves undetermined, why,
and the run that would show them. The flags of the parameter file follow from the same list
(`undetermined`), so that the words and the flags cannot disagree.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from idtool.effects.base import usual_speed
from idtool.fit.joint import JointFit, kept
from idtool.fit.levels import contradicted_at_rest, rising
from idtool.fit.lever import odd_lever
from idtool.fit.next_sweep import long_sweep, run_command, slow_sweep
from idtool.fit.own_swing import swings_by_itself
from idtool.fit.shortcoming import PARTS, Limits, Shortcoming
from idtool.fit.vague import at_bound, carried, in_file, is_vague, vague
from idtool.fit.windows import Window, steady_windows
from idtool.log.repair import SATURATED
from idtool.model.units import unit_text
from idtool.parameters import DYNAMIC
from idtool.presentation.text import counted
from idtool.signals import Recording
from idtool.signals.coverage import (
    constant_speeds,
    constant_tilt,
    fastest_speed,
    moves_one_way,
    stretches,
    turning_points,
)

__all__ = [
    "is_vague",
    "low_speeds",
    "no_reversal",
    "presliding",
    "shortcomings",
    "stribeck_seen",
    "undetermined",
]

#: A difference of the two friction levels below this many standard errors is no Stribeck effect.
_NO_STRIBECK = 2.0
#: Presliding travel below this many steps of the position reading gives sigma0 a lower bound only.
_COUNTS = 3.0
#: ... and so does presliding that is over within this many samples after a reversal.
_ROWS = 4.0
#: Low speeds are those between these multiples of the Stribeck velocity (at rest the torque is any below the
#: static level and shows neither); the axis must pass through them more slowly than the filter's window is
#: long, and for this many windows in all.
_REST = 0.1
_LOW = 1.5
_LOW_WINDOWS = 5.0
#: Effects that look like friction in one direction.
_ONE_WAY_EFFECTS = ("torque_offset", "direction_asymmetry")
#: A torque over the position, which in one direction may as well be friction there.
_OVER_THE_STROKE = ("position_stiffness", "position_ripple")
#: A weight is plain that is so many times as large as its 95 % interval is wide to one side.
_PLAIN = 5.0
#: An axis whose speed falls below this share of the top speed of its trial starts, stops or turns there.
_TURNS = 0.2


def shortcomings(fit: JointFit, parts: Sequence[str] = PARTS) -> list[Shortcoming]:
    """Everything that the data behind a fit lack.

    Args:
        fit: of any friction law; what a law leaves out is not judged.
        parts: parts of the parameter file to speak about.
    """
    found = [
        not_converged(fit),
        odd_lever(fit),
        *_about_parameters(fit),
        unsteady(fit, steady_windows(fit)),
        saturated(fit.model.recording),
    ]
    return [one for one in found if one is not None and set(one.parts) & set(parts)]


def undetermined(fit: JointFit) -> dict[str, Limits]:
    """ "part.name" of every parameter that the data do not determine, and what bounds they give."""
    found: dict[str, Limits] = {}
    for one in _about_parameters(fit):
        for name in one.parameters:
            limits = one.limits.get(name, (None, None))
            known = found.get(name, (None, None))
            found[name] = (known[0] or limits[0], known[1] or limits[1])
    return found


def not_converged(fit: JointFit) -> Shortcoming | None:
    """A fit that ended before it found the least squares."""
    outcome = fit.outcome
    if outcome.converged:
        return None
    code = outcome.value.replace(" ", "_")
    return Shortcoming(
        code, PARTS, (), f"{outcome.value}: {outcome.meaning}, so its numbers may be off", outcome.advice
    )


@kept
def _about_parameters(fit: JointFit) -> list[Shortcoming]:
    if (all_of_it := own_swing(fit)) is not None:
        return [all_of_it]  # where its numbers end, and their errors, say nothing
    levels = [one_direction, one_speed, low_speeds, rising, contradicted_at_rest]
    judged = [one_payload, *levels, no_reversal, presliding, brief, at_bound]
    found = [one for judge in judged if (one := judge(fit)) is not None]
    told = {name for one in found for name in one.parameters}
    found += [one for one in [carried(fit, told)] if one is not None]
    told |= {name for one in found for name in one.parameters}
    return [*found, *vague(fit, told)]


def one_payload(fit: JointFit) -> Shortcoming | None:
    """One payload only: no payload slope, and a base that includes that payload."""
    spec, motion = fit.model.spec, fit.model.recording.motion
    if spec.gravity != "slide" or "per_payload" in spec.gravity_columns:
        return None
    payload = 0.0
    if motion.payload is not None:
        factor = np.ones(len(motion)) if motion.gravity_factor is None else motion.gravity_factor
        payload = float(np.median(motion.payload[np.abs(factor) > 0.0]))
    lacking = ("gravity.per_payload", "gravity.base") if payload else ("gravity.per_payload",)
    also = ", and the base found includes it" if payload else ""
    run = run_command(fit.model.recording, "gravity")
    return Shortcoming(
        "one_payload",
        ("gravity",),
        lacking,
        f"one payload only ({payload:g} kg): gravity per payload is not determined{also}",
        f"run payload steps with two payloads or more (`{run}`)",
        run,
    )


def own_swing(fit: JointFit) -> Shortcoming | None:
    """An acceleration of which a pendulum of any weight has as much: inertia, gravity and, with them, the
    level of friction may be of any size."""
    recording = fit.model.recording
    if fit.model.spec.gravity != "arm" or not swings_by_itself(recording):
        return None
    pull = [name for name in fit.model.names if name.startswith("gravity.")]
    error = [fit.quantile[k] * np.sqrt(fit.covariance[k, k]) for k in map(fit.model.names.index, pull)]
    if any(abs(fit.values[name]) > _PLAIN * most for name, most in zip(pull, error, strict=True)):
        return None
    run = run_command(recording, "sweep")
    return Shortcoming(
        "own_swing",
        PARTS,
        tuple(dict.fromkeys(in_file(name, fit) for name in fit.model.names)),
        "the axis accelerates by the sine of its angle, as by its own weight or at one frequency: inertia, "
        "gravity and the friction beside them may be of any size",
        f"move it slowly, and at several speeds (`{run}`)",
        run,
    )


def one_direction(fit: JointFit) -> Shortcoming | None:
    """Motion in one direction: a level of friction and a constant torque look the same."""
    spec, recording = fit.model.spec, fit.model.recording
    if not moves_one_way(recording):
        return None
    lacking = [f"static.{name}" for name in ("coulomb", "static") if name in fit.model.names]
    # an arm's gravity changes along the way, and a tilted slide's from run to run
    constant = spec.gravity == "slide" and constant_tilt(recording.motion)
    lacking += ["gravity.base"] if constant and "base" in spec.gravity_columns else []
    lacking += [f"effects.{e.name}" for e in spec.effects if e.name in _ONE_WAY_EFFECTS]
    # the bristle bends the same way all the time, and as far as those levels say
    lacking += [f"dynamic.{name}" for name in DYNAMIC if name in fit.model.names]
    other = "gravity" if constant else "an offset"
    along = [e.title.lower() for e in spec.effects if e.name in _OVER_THE_STROKE]
    nor = f", nor {' and '.join(along)} from friction along the stroke" if along else ""
    run = run_command(recording, "sweep")
    return Shortcoming(
        "one_direction",
        ("gravity", "static", "dynamic"),
        tuple(lacking),
        f"one direction only: Coulomb friction and {other} cannot be told apart{nor}",
        f"move both ways through the same stretch (`{run}`)",
        run,
    )


def one_speed(fit: JointFit) -> Shortcoming | None:
    """Hardly any motion but at one speed: a level of friction and viscous friction look the same."""
    recording = fit.model.recording
    usual = usual_speed(recording.motion.velocity[recording.usable])
    if usual is None:
        return None
    run = run_command(recording, "sweep")
    return Shortcoming(
        "one_speed",
        ("static",),
        tuple(f"static.{name}" for name in ("coulomb", "static", "viscous") if name in fit.model.names),
        f"hardly another speed than {usual:.2g} {unit_text('velocity', recording.axis.kind)}: Coulomb and "
        "viscous friction cannot be told apart",
        f"move at several speeds (`{run}`)",
        run,
    )


def low_speeds(fit: JointFit) -> Shortcoming | None:
    """No low speeds, or no static level apart from the Coulomb level at them."""
    if "static" not in fit.model.names or "static" in fit.held:
        return None
    seen, passed = stribeck_seen(fit), _passes_low_speeds(fit)
    unknown = is_vague(fit, "stribeck_velocity") or fit.at_bound["stribeck_velocity"]
    if seen and passed and not unknown:
        return None
    recording = fit.model.recording
    fastest, constant = fastest_speed(recording), [abs(speed) for speed in constant_speeds(recording)]
    slowest = min(constant, default=fastest)
    unit = unit_text("velocity", recording.axis.kind)
    fall = "the Stribeck velocity and the stiction are not determined"
    if not passed or slowest > 0.3 * fastest:
        one = f"the slowest constant speed is {slowest:.2g} {unit}" if constant else "no speed is constant"
        why = f"no low speeds ({one}): {fall}"
    elif not seen:
        why = f"no stiction shows apart from the Coulomb level down to {slowest:.2g} {unit}: {fall}"
    else:
        why = f"too few rows at low speeds: {fall}"
    run = slow_sweep(fit, slowest)
    lacking = ("static.static", "static.stribeck_velocity")
    return Shortcoming(
        "no_low_speeds", ("static",), lacking, why, f"run slower ones (`{run}`)", run, by_error=passed
    )


def stribeck_seen(fit: JointFit) -> bool:
    """Whether the static and the Coulomb level differ by more than their uncertainty."""
    if "static" not in fit.model.names:
        return False
    i, j = fit.model.names.index("coulomb"), fit.model.names.index("static")
    # one way only, the levels may be off by the same torque: their difference is known, not their ratio
    one_way = moves_one_way(fit.model.recording)
    levels = np.exp(fit.x[[i, j]])
    weight = levels if one_way else np.ones(2)
    apart = levels[0] - levels[1] if one_way else fit.x[i] - fit.x[j]
    direction = weight * np.array([1.0, -1.0])
    spread = math.sqrt(max(float(direction @ fit.covariance[np.ix_([i, j], [i, j])] @ direction), 0.0))
    return abs(float(apart)) > _NO_STRIBECK * spread


def _passes_low_speeds(fit: JointFit) -> bool:
    """Whether the axis stays at low speeds for longer than the filter blurs."""
    recording = fit.model.recording
    motion = recording.motion
    speed = np.abs(motion.velocity) / fit.values["stribeck_velocity"]
    low = (speed < _LOW) & (speed > _REST) & recording.usable
    window = recording.filter.taps * motion.period
    stays = [float(motion.time[end - 1] - motion.time[begin]) for begin, end in stretches(low, motion)]
    return float(sum(stay for stay in stays if stay > window)) > _LOW_WINDOWS * window


def presliding(fit: JointFit) -> Shortcoming | None:
    """Presliding travel shorter than a few steps of the position reading."""
    if fit.model.spec.friction != "lugre":
        return None
    resolution = fit.model.scales.resolution
    counts = fit.presliding_scale / resolution if resolution > 0 else math.inf
    if counts >= _COUNTS and not fit.rigid:
        return None
    kind = fit.model.recording.axis.units
    friction = fit.model.friction(fit.x)
    least = max(friction.coulomb, friction.static) / max(_COUNTS * resolution, 1e-300)
    bound = f" ({least:.2g} {unit_text('stiffness', kind)})" if resolution > 0 else ""
    return Shortcoming(
        "short_presliding",
        ("dynamic",),
        ("dynamic.bristle_stiffness", "dynamic.bristle_damping"),
        f"the presliding travel is {max(counts, 0.1):.1g} steps of the position reading, so the data give "
        f"sigma0 a lower bound only{bound}",
        "a finer encoder, or one on the motor side, would show more",
        by_error=True,
        limits={"dynamic.bristle_stiffness": (least, None)} if resolution > 0 else {},
    )


def brief(fit: JointFit) -> Shortcoming | None:
    """Presliding that is over within a few samples after a reversal."""
    if fit.model.spec.friction != "lugre":
        return None
    rows, travel = rows_in_presliding(fit)
    if rows >= _ROWS:
        return None
    friction = fit.model.friction(fit.x)
    least = max(friction.coulomb, friction.static) / max(travel, fit.presliding_scale)
    bound = f"{least:.2g} {unit_text('stiffness', fit.model.recording.axis.units)}"
    return Shortcoming(
        "brief_presliding",
        ("dynamic",),
        ("dynamic.bristle_stiffness", "dynamic.bristle_damping"),
        f"the presliding travel is over within {max(rows, 1):.0f} samples of a reversal, so the data give "
        f"sigma0 a lower bound only ({bound})",
        "turn round more slowly, or log at a higher rate",
        by_error=True,
        limits={"dynamic.bristle_stiffness": (least, None)},
    )


@kept
def rows_in_presliding(fit: JointFit) -> tuple[float, float]:
    """Rows after a reversal while the bristle is on its way from one side to the other, and the deflection at
    which there would be as many as are needed, rad (m); medians over the reversals, inf and 0 without any."""
    motion, scale = fit.model.recording.motion, fit.presliding_scale
    counts, reaches = [], []
    for begin, end in zip(motion.starts, np.append(motion.starts[1:], len(motion)), strict=True):
        position = motion.position[begin:end]
        for turn in turning_points(position, 4.0 * scale):
            way = np.abs(position[turn:] - position[turn])
            begins, there = int(np.argmax(way > 0.1 * scale)), int(np.argmax(way > 2.0 * scale))
            counts.append(int(np.sum(way[:there] > 0.1 * scale)))
            reaches.append(0.5 * float(way[min(begins + round(_ROWS), len(way) - 1)]))
    if not counts:
        return math.inf, 0.0
    return float(np.median(counts)), float(np.median(reaches))


def no_reversal(fit: JointFit) -> Shortcoming | None:
    """No trial in which the axis starts, stops or turns round: its bristle bends alike all the time."""
    if fit.model.spec.friction != "lugre":
        return None
    motion = fit.model.recording.motion
    # of rows that are left out nothing shows
    speed = np.where(fit.model.recording.usable, np.abs(motion.velocity), np.nan)
    top = np.fmax.reduceat(speed, motion.starts)
    if np.any(np.fmin.reduceat(speed, motion.starts) < _TURNS * top):
        return None
    run = run_command(fit.model.recording, "sine")
    return Shortcoming(
        "no_reversal",
        ("dynamic",),
        ("dynamic.bristle_stiffness", "dynamic.bristle_damping"),
        "the axis neither starts nor turns round within a trial, so sigma0 and sigma1 do not show",
        f"give sines too (`{run}`)",
        run,
    )


def unsteady(fit: JointFit, windows: Sequence[Window]) -> Shortcoming | None:
    """Windows of constant speed in which a soft bristle has not settled."""
    loose = sum(not window.steady for window in windows)
    if not loose or fit.model.spec.friction != "lugre":
        return None
    unit = unit_text("position", fit.model.recording.axis.kind)
    travel, run = long_sweep(fit, windows)
    return Shortcoming(
        "unsteady_windows",
        ("static",),
        (),
        f"{loose} of {len(windows)} windows are not steady, because the bristle had not settled; the rest of "
        "its transient was taken off",
        f"ways of {travel:.2g} {unit} in one direction would be steady, if the stroke allows (`{run}`)",
        run,
    )


def saturated(recording: Recording) -> Shortcoming | None:
    """Rows with the current at the end of its range."""
    rows = recording.lost.get(SATURATED, 0)
    if not rows:
        return None
    what = "voltage" if recording.by_voltage else "current"
    return Shortcoming(
        "saturated_current",
        PARTS,
        (),
        f"the {what} is saturated, or within its noise of that, on {counted(rows, 'row')}, left out",
        "move more slowly or with less payload, or widen the current's range",
    )
