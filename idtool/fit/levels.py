"""Whether the friction levels that a fit found are levels that its rows show."""

from __future__ import annotations

import math

import numpy as np

from idtool.fit.joint import JointFit, kept
from idtool.fit.next_sweep import run_command
from idtool.fit.restart import rises_all_along
from idtool.fit.shortcoming import Shortcoming
from idtool.model.units import unit_text
from idtool.signals.coverage import fastest_speed, stretches

#: What a rest holds is sure beyond so many standard errors of its mean.
_SURELY = 3.0
#: Where a rest begins and ends the axis may move already, its motion being read late, s.
_EDGE_S = 0.2


def rising(fit: JointFit) -> Shortcoming | None:
    """A curve that rises over all speeds: which part of it is viscous its shape decides, not the data."""
    if "static" not in fit.model.names or "static" in fit.held or not rises_all_along(fit):
        return None
    recording = fit.model.recording
    fastest = fastest_speed(recording)
    lacking = [f"static.{name}" for name in ("coulomb", "stribeck_velocity", "viscous")]
    run = run_command(recording, "sweep")
    return Shortcoming(
        "rises_all_along",
        ("static",),
        tuple(lacking),
        f"friction rises over all speeds up to {fastest:.2g} {unit_text('velocity', recording.axis.kind)}: "
        "the curve as a whole holds there, but Coulomb and viscous friction cannot be told apart",
        f"give steady speeds too (`{run}`)",
        run,
    )


def contradicted_at_rest(fit: JointFit) -> Shortcoming | None:
    """Rests that hold more than the static level: the axis would have slid."""
    if "static" not in fit.model.names or "static" in fit.held:
        return None
    held = held_at_rest(fit)
    i = fit.model.names.index("static")
    error = math.sqrt(max(float(fit.covariance[i, i]), 0.0))
    if held <= fit.values["static"] * math.exp(min(float(fit.quantile[i]) * error, 1.0)):
        return None
    kind = fit.model.recording.axis.units
    return Shortcoming(
        "holds_more_at_rest",
        ("static",),
        ("static.static", "static.stribeck_velocity"),
        f"half of its rests hold {held:.2g} {unit_text('torque', kind)} or more, above the stiction that was "
        f"found ({fit.values['static']:.2g}): the stiction and the Stribeck velocity are not determined",
        "a model that lacks an effect of turns (play, late readings) makes friction seem to fade there",
        limits={"static.static": (held, None)},
    )


@kept
def held_at_rest(fit: JointFit) -> float:
    """Friction that half of the rests hold at least, N m (N), as some lie at a stop; 0 without rests."""
    model, recording = fit.model, fit.model.recording
    motion = recording.motion
    left = recording.torque - model.contribution(fit.x).torque
    held = []
    for begin, end in stretches(recording.at_rest, motion):
        time = motion.time[begin:end]
        inside = left[begin:end][(time > time[0] + _EDGE_S) & (time < time[-1] - _EDGE_S)]
        if len(inside):
            held.append(abs(float(np.mean(inside))) - _SURELY * recording.noise / math.sqrt(len(inside)))
    return max(float(np.median(held)), 0.0) if held else 0.0
