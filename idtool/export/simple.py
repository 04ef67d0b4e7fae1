"""A model that lacks something of the whole one, fitted anew to logs, and what it costs in torque.

The values that stand in a parameter file are those of the whole curve: its Coulomb level is what
friction tends to at high speed, without the rise at low speed and without the bristle. Copied into a law
that has nothing else they are seldom the best. Where logs are given the two numbers are fitted anew, by
linear least squares over the speeds of these logs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import lsq_linear

from idtool.effects import registry
from idtool.fit.joint import solve
from idtool.fit.model import JointModel
from idtool.fit.results import dynamic_parameters, effect_entries, static_parameters
from idtool.fit.spec import Scales, Spec
from idtool.log import Log
from idtool.model.contribution import Contribution
from idtool.model.torque import Friction
from idtool.model.torque import predict as predict_torque
from idtool.parameters import GRAVITY_MODELS, EffectEntry, Parameter, Parameters
from idtool.verbs.predict import explained, loaded, predict
from idtool.verbs.simulate import simulate

#: Keeps what is divided by from nothing, N m (N).
_SMALLEST = 1e-9


def copied(parameters: Parameters) -> Parameters:
    """Coulomb and viscous friction with the values of the file."""
    return _with(parameters, parameters.static["coulomb"], parameters.static["viscous"])


def fitted(parameters: Parameters, logs: Sequence[Log]) -> tuple[Parameters, float]:
    """Coulomb and viscous friction that fits the logs best, beside gravity and effects as they stand.

    A constant torque among the effects is fitted too: it is what is left of effects that the target lacks.

    Args:
        parameters: gravity and effects of the model to be completed; its friction is not used.
        logs: logs of the axis.

    Returns:
        The model, and the highest speed of the logs, rad/s (m/s), beyond which it is a guess.

    Raises:
        InputError: logs of another axis, or without a column that an effect needs.
    """
    recording, rest = explained(logs, replace(parameters, static={}, dynamic={}))
    motion, scales = recording.motion, Scales.of(recording)
    # the sign of the speed, with the start of each reversal no sharper than the position shows
    unit = Friction(1.0, 1.0, scales.slowest, 0.0, 1.0 / scales.shortest_bend, 0.0)
    sign = predict_torque(motion, unit, Contribution(), np.zeros(motion.stretches)).torque
    offset = parameters.effect("torque_offset")
    constant = [np.ones(len(motion))] if offset else []
    columns = recording.filtered(np.column_stack([sign, motion.velocity, *constant]))
    measured = recording.filtered_torque - recording.filtered(rest)
    scale = np.linalg.norm(columns, axis=0) + _SMALLEST
    lowest = np.array([0.0, 0.0, *(-math.inf for _ in constant)])
    found = (lsq_linear(columns / scale, measured, bounds=(lowest, math.inf)).x / scale).tolist()
    if offset:
        value = Parameter(offset.values()["offset"] + found[2])
        anew = EffectEntry(offset.name, offset.parameters | {"offset": value})
        effects = tuple(anew if entry is offset else entry for entry in parameters.effects)
        parameters = replace(parameters, effects=effects)
    return _with(parameters, Parameter(found[0]), Parameter(found[1])), scales.speed


def refitted(parameters: Parameters, logs: Sequence[Log]) -> Parameters:
    """LuGre friction and effects fitted anew, by the joint least squares of `identify` from where they stand.

    For a model that lacks effects of the one whose values it has: what these took up must go elsewhere.

    Args:
        parameters: the model; its gravity is kept, and so are the period of a ripple and what is zero but a
            constant torque.
        logs: logs of the axis.

    Raises:
        InputError: logs of another axis, or without a column that an effect needs.
    """
    recording = loaded(logs, parameters)
    effects = []
    for entry in parameters.effects:
        effect = registry.get(entry.name)
        effects.append(effect.form_of(effect.from_file(entry.values(), parameters.axis.kind)))
    columns = tuple(GRAVITY_MODELS[parameters.gravity_model]) if parameters.gravity_model else ()
    model = JointModel.build(recording, Spec("lugre", parameters.gravity_model, columns, tuple(effects)))
    values = {name: one.value for name, one in (parameters.static | parameters.dynamic).items()}
    values |= {f"gravity.{name}": one.value for name, one in parameters.gravity.items()}
    for effect, entry in zip(effects, parameters.effects, strict=True):
        found = effect.from_file(entry.values(), parameters.axis.kind)
        values |= {f"{effect.name}.{name}": value for name, value in found.items()}
    kept = {name for name in model.names if name.startswith("gravity.") or name.endswith("cycles")}
    stays = {name for name, value in values.items() if value == 0.0} - {"torque_offset.offset"}
    held = kept | {name for name in model.names if name in stays}
    fit = solve(model, model.coordinates(values), held=frozenset(held))
    return replace(
        parameters,
        static=static_parameters(fit),
        dynamic=dynamic_parameters(fit),
        effects=effect_entries(fit),
    )


def _with(parameters: Parameters, coulomb: Parameter, viscous: Parameter) -> Parameters:
    coulomb = replace(coulomb, value=max(coulomb.value, _SMALLEST))
    speed = parameters.static.get("stribeck_velocity", Parameter(1.0))
    static = {
        "coulomb": coulomb,
        "static": coulomb,
        "stribeck_velocity": Parameter(speed.value),
        "viscous": viscous,
    }
    return replace(parameters, static=static, dynamic={})


def nearer(first: Parameters, second: Parameters, logs: Sequence[Log]) -> bool:
    """Whether the first is, in the position that the logged effort makes, by which simulators are judged, or
    in torque where no inertia is known.
    """

    def distance(model: Parameters) -> float:
        if model.effect("inertia"):
            return simulate(logs, model).rms_windows
        return total(predict(logs, model).errors)

    return distance(first) < distance(second)


def total(found: dict[str, dict[str, Any]]) -> float:
    """Root-mean-square error over all experiments together."""
    rows = sum(int(error["rows"]) for error in found.values())
    return math.sqrt(sum(float(error["rmse"]) ** 2 * int(error["rows"]) for error in found.values()) / rows)
