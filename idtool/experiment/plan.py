"""A recipe on a certain rig: refused before anything moves, or a start for every trial."""

from __future__ import annotations

import math

import numpy as np

from idtool.errors import InputError
from idtool.experiment.recipe import SINE_SHARE, Recipe, RecipeTrial
from idtool.experiment.trajectory import excursion
from idtool.model.units import STANDARD_GRAVITY, unit_text
from idtool.rig.base import Rig

#: A pinion or a drum of less than 5 mm carries little, m; so does a drive whose load hangs 1 in 20.
_LEAST_LEVER = {"rotary": 0.005, "linear": 0.05}


def rows_every(recipe: Recipe, rig: Rig) -> int:
    """How many samples of the rig there are per row of the log."""
    return max(1, round(recipe.period_s / rig.period_s))


def plan_of(recipe: Recipe, rig: Rig) -> list[tuple[RecipeTrial, float]]:
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
    period = rig.period_s * rows_every(recipe, rig)
    return [(trial, _check(recipe, trial, rig, period)) for trial in recipe.trials]


def doubted_payload(recipe: Recipe, rig: Rig) -> str | None:
    """A sentence on a payload that the drive holds on next to no lever only; None where all are likely."""
    heaviest = max(trial.setup.payload_kg for trial in recipe.trials)
    weight, most = STANDARD_GRAVITY * heaviest, rig.limits.current * (rig.axis.torque_constant or math.inf)
    if not most < _LEAST_LEVER[rig.axis.kind] * weight:
        return None
    on = {"rotary": f"a lever of {1e3 * most / weight:.2g} mm", "linear": f"a slope of {most / weight:.2g}"}
    return (
        f"the drive gives {most:.3g} {unit_text('torque', rig.axis.kind)}, which holds {heaviest:g} kg on "
        f"{on[rig.axis.kind]} at most: payloads are in kg."
    )


def _check(recipe: Recipe, trial: RecipeTrial, rig: Rig, period: float) -> float:
    def misfit(problem: str, key: str, remedy: str) -> InputError:
        return InputError(problem, file=recipe.source, place=f"{trial.place}{key}", remedy=remedy)

    limits, velocity = rig.limits, unit_text("velocity", rig.axis.kind)
    speed_key, travel_key = (f".{key}" for key in trial.keys)
    command = trial.motion.command(rig.period_s)
    fastest = float(np.max(np.abs(command)))
    moves = f"moves at {fastest:.3g} {velocity}, the"
    if fastest > limits.speed * (1.0 + 1e-9):
        raise misfit(f"{moves} rig's limit is {limits.speed:.3g}", speed_key, "lower it")
    if fastest < (1.0 - 1e-2) * rig.speed_step:
        problem = f"{moves} drive of this rig at no less than {rig.speed_step:.3g}"
        raise misfit(problem, speed_key, "raise it")
    low, high = excursion(command, rig.period_s)
    room = limits.position[1] - limits.position[0]
    if high - low > room:
        problem = (
            f"moves over {high - low:.3g} {unit_text('position', rig.axis.kind)}, the rig has {room:.3g}"
        )
        remedy = "lower it" if travel_key != speed_key else "lower it or raise the frequency"
        raise misfit(problem, travel_key, remedy)
    if trial.motion.highest_frequency_hz > SINE_SHARE / period * (1.0 + 1e-9):
        raise misfit(
            f"has a sine of {trial.motion.highest_frequency_hz:g} Hz, more than a tenth of this rig's "
            f"{1.0 / period:g} samples per second",
            "",
            f"stay below {SINE_SHARE / period:g} Hz",
        )
    return 0.5 * (limits.position[0] + limits.position[1]) - 0.5 * (low + high)
