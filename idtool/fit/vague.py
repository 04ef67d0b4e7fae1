"""What the errors of a fit say of its parameters: at a bound, carried along by one there, or hardly known."""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np

from idtool.fit.joint import JointFit
from idtool.fit.model import LOGARITHMIC
from idtool.fit.next_sweep import run_command
from idtool.fit.shortcoming import Limits, Shortcoming
from idtool.parameters import DYNAMIC, GRAVITY_MODELS, STATIC
from idtool.presentation.text import quantity

#: A parameter whose relative standard error is above this is not determined by the data.
_TOO_VAGUE = 0.5
#: Where a sample lies in time against a reversal is known to this share of the step: standard error.
_INSTANT = 0.03
#: Parameters whose errors are judged here.
_JUDGED = (*STATIC, *DYNAMIC, "inertia.inertia")


def at_bound(fit: JointFit) -> Shortcoming | None:
    """Parameters that ran to a bound of their range."""
    stuck = [name for name in fit.model.names if fit.at_bound[name] and name not in fit.held]
    if not stuck:
        return None
    named = tuple(in_file(name, fit) for name in stuck)
    if {"coulomb", "static"} & set(stuck) and "stribeck_velocity" in fit.model.names:
        named = tuple(dict.fromkeys((*named, "static.stribeck_velocity")))  # between two levels, or none
    words = ", ".join(map(_said, stuck))
    parts = tuple(dict.fromkeys(name.split(".")[0] for name in named))
    verb = (
        "sits at the bound of its range and is" if len(stuck) == 1 else "sit at bounds of their range and are"
    )
    return Shortcoming(
        "at_bound",
        parts,
        named,
        f"{words} {verb} not found",
        "do not use the number (an effect that the model lacks can do this, or too little that was recorded)",
        by_error=True,
        limits={in_file(name, fit): _from_bound(fit, name) for name in stuck},
    )


def _said(name: str) -> str:
    """A coordinate in words: what it belongs to once where that is called the same."""
    part, _, own = map(quantity, name.partition("."))
    return part if own in ("", part) else f"{part}: {own}"


def carried(fit: JointFit, told: Collection[str] = ()) -> Shortcoming | None:
    """Parameters that would leave their intervals if one that sits at a bound were as far from it as the data
    allow: their errors, which take it for known there, say too little.

    Args:
        fit: any fit.
        told: parameters of which something else was said already.
    """
    stuck = [name for name in fit.model.names if fit.at_bound[name] and name not in fit.held]
    free = [name for name, is_free in zip(fit.model.names, fit.free, strict=True) if is_free]
    found: dict[str, str] = {}
    for name in stuck:
        reach = fit.reach_from_bound(name)
        if not math.isfinite(reach):
            continue
        column = fit.jacobian[:, fit.model.names.index(name)]
        moves = reach * np.abs(np.linalg.lstsq(fit.jacobian[:, fit.free], column, rcond=None)[0])
        for other, moved in zip(free, moves.tolist(), strict=True):
            half = float(fit.quantile[fit.model.names.index(other)]) * standard_error(fit, other)
            if moved > half and other in _JUDGED and in_file(other, fit) not in told:
                found.setdefault(in_file(other, fit), name)
    if not found:
        return None
    words = ", ".join(quantity(name.removeprefix("effects.").rpartition(".")[2]) for name in found)
    them = ", ".join(dict.fromkeys(quantity(name.partition(".")[0]) for name in found.values()))
    run = run_command(fit.model.recording, "sweep")
    return Shortcoming(
        "carried",
        tuple(dict.fromkeys(name.partition(".")[0] for name in found)),
        tuple(found),
        f"{words}: cannot be told from {them}, which is not found",
        f"give runs at several speeds and with reversals too (`{run}`)",
        run,
        by_error=True,
    )


def vague(fit: JointFit, told: Collection[str] = ()) -> list[Shortcoming]:
    """Parameters of friction, and an inertia, whose error is about as large as they are.

    Args:
        fit: any fit.
        told: parameters of which something else was said already.
    """
    found = []
    groups = (
        ("static", STATIC, "sweep"),
        ("dynamic", DYNAMIC, "sine"),
        ("effects", ("inertia.inertia",), "sine"),
    )
    for part, names, experiment in groups:
        lacking = [
            name
            for name in names
            if name in fit.model.names and in_file(name, fit) not in told and is_vague(fit, name)
        ]
        if lacking:
            words = ", ".join(quantity(name.partition(".")[0]) for name in lacking)
            run = run_command(fit.model.recording, experiment)
            found.append(
                Shortcoming(
                    f"vague_{part}",
                    (part,),
                    tuple(in_file(name, fit) for name in lacking),
                    f"{words}: the error is about as large as the value",
                    f"give a longer {experiment} too (`{run}`)",
                    run,
                    by_error=True,
                    limits={in_file(name, fit): (None, _highest(fit, name)) for name in lacking},
                )
            )
    return found


def _highest(fit: JointFit, name: str) -> float | None:
    """The upper end of a parameter's 95 % interval."""
    i = fit.model.names.index(name)
    end = fit.x[i] + fit.quantile[i] * standard_error(fit, name)
    return (
        None
        if end > fit.model.bounds[1][i]
        else fit.model.values(np.where(np.arange(len(fit.x)) == i, end, fit.x))[name]
    )


def is_vague(fit: JointFit, name: str) -> bool:
    """Whether a friction parameter's standard error is a large part of it."""
    if fit.at_bound[name] or name in fit.held:
        return False
    size = 1.0 if name in LOGARITHMIC else abs(fit.values[name])
    return standard_error(fit, name) >= _TOO_VAGUE * size


def in_file(name: str, fit: JointFit) -> str:
    """ "part.name" of a parameter, as the file has it."""
    if name in STATIC:
        return f"static.{name}"
    if name in DYNAMIC:
        return f"dynamic.{name}"
    owner, _, column = name.partition(".")
    model = fit.model.spec.gravity
    if owner == "gravity" and model and column in GRAVITY_MODELS[model]:
        return name
    return f"effects.{owner}"


def standard_error(fit: JointFit, name: str) -> float:
    """Standard error of a coordinate; of a logarithmic one it is relative.

    A stiffness times a time resembles a damping, so that damping which relaxes within one sample is known no
    better than when within it the axis turned round.
    """
    i = fit.model.names.index(name)
    variance = max(float(fit.covariance[i, i]), 0.0)
    if name == "bristle_damping" and name not in fit.held:
        within = fit.values["bristle_stiffness"] * fit.model.recording.motion.period
        variance += (_INSTANT * within) ** 2 if abs(fit.values[name]) < within else 0.0
    return math.sqrt(variance)


def _from_bound(fit: JointFit, name: str) -> Limits:
    """The most of a parameter at the lower end of its range, or the least of one at the upper end."""
    i = fit.model.names.index(name)
    low, high = (float(bound[i]) for bound in fit.model.bounds)
    x, value = float(fit.x[i]), fit.values[name]
    reach = fit.reach_from_bound(name)
    if not reach < high - low:
        return None, None
    if name in LOGARITHMIC:  # near an end a level goes as itself, and a stiffness as its compliance
        ends = value / (1.0 + reach), value * (1.0 + reach)
    else:
        ends = value - reach, value + reach
    return (None, ends[1]) if x - low < high - x else (ends[0], None)
