"""Every target of the model itself, and how a parameter file becomes one.

exported = export("mujoco", Parameters.read("params.toml"), [Log.read("sine.csv")])
exported.text, exported.plan.lost, exported.errors
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from idtool.errors import InputError, UsageError, nearest
from idtool.export.bam import Bam
from idtool.export.base import Exported, Plan, Target
from idtool.export.cogging import CoggingMap
from idtool.export.isaac import Isaac
from idtool.export.mujoco import Mujoco
from idtool.export.plain_json import PlainJson
from idtool.export.ros2 import Ros2
from idtool.export.urdf import Urdf
from idtool.io.entry_points import load, outside
from idtool.log import Log
from idtool.model.units import Units, unit_text
from idtool.parameters import Parameters
from idtool.presentation.text import quantity
from idtool.verbs.predict import predict

_ALL: tuple[Target, ...] = (Mujoco(), Isaac(), Urdf(), Ros2(), PlainJson(), Bam(), CoggingMap())
TARGETS: dict[str, Target] = {target.name: target for target in _ALL}

#: The entry points by which other packages add targets.
GROUP = "ffc_id.exports"

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")


def export(
    target: str,
    parameters: Parameters,
    logs: Sequence[Log] = (),
    *,
    joint: str = "axis",
    friction: str = "auto",
) -> Exported:
    """A parameter file for another program.

    Args:
        target: a key of `TARGETS`, or a name that another package adds.
        parameters: the whole model.
        logs: logs of the axis: a simplified friction law is fitted to them, and the torque errors of the
            whole and the exported model are stated.
        joint: name of the joint in the file.
        friction: "auto" for the richest law that the file can hold, "coulomb" for Coulomb and viscous.

    Raises:
        InputError: an unknown target, a parameter file without friction, logs of another axis.
        UsageError: a name that the target cannot hold.
    """
    writer = find(target)
    if not _NAME.match(joint):
        raise UsageError(f"{joint!r} is no name for a joint; use letters, digits and underscores.")
    plan = writer.plan(parameters, logs, friction)
    unexplained = (parameters.unexplained,) if parameters.unexplained else ()
    plan = replace(plan, notes=(*unexplained, *plan.notes, *_doubts(plan.model)))
    errors = _errors(parameters, plan, logs) if logs else {}
    remarks = _remarks(writer, parameters, plan, logs, errors)
    return Exported(target, writer.render(plan, remarks, joint), plan, errors)


def find(name: str) -> Target:
    """A target of the tool or of another package.

    Raises:
        InputError: there is none of that name, or its package cannot be loaded.
    """
    others = outside(GROUP, TARGETS)
    if name in TARGETS:
        return TARGETS[name]
    if name not in others:
        raise InputError(f"unknown target {name!r}", remedy=nearest(name, (*TARGETS, *others)))
    return load(GROUP, name, Target)  # type: ignore[type-abstract]


def _doubts(model: Parameters) -> list[str]:
    """What of the model the data did not determine."""
    entries = {
        f"{entry.name} {name}": one for entry in model.effects for name, one in entry.parameters.items()
    }
    values = model.gravity | model.static | model.dynamic | entries
    doubted = [quantity(name) for name, one in values.items() if not one.known]
    return [f"the data did not determine: {', '.join(doubted)}"] if doubted else []


def _errors(parameters: Parameters, plan: Plan, logs: Sequence[Log]) -> dict[str, dict[str, dict[str, Any]]]:
    """Torque errors of each model, per experiment, as `ffc-id predict` computes them."""
    models = {"full": parameters}
    if plan.model is not parameters:
        models["exported"] = plan.model
    if plan.copied:
        models["copied"] = plan.copied
    return {name: predict(logs, model).errors for name, model in models.items()}


_MODELS = {
    "full": "the whole model",
    "exported": "the model of this file",
    "copied": "the same with copied values",
}


def error_lines(errors: dict[str, dict[str, dict[str, Any]]], kind: Units) -> list[str]:
    """One line per model: its error on each experiment."""
    unit = unit_text("torque", kind)
    return [
        f"{_MODELS[model]}: "
        + ", ".join(
            f"{name or 'log'} {error['rmse']:.4g} {unit} ({error['relative_percent']:.3g} %)"
            for name, error in found.items()
        )
        for model, found in errors.items()
    ]


def _remarks(
    target: Target,
    parameters: Parameters,
    plan: Plan,
    logs: Sequence[Log],
    errors: dict[str, dict[str, dict[str, Any]]],
) -> list[str]:
    """What a reader of the file must know, one line each."""
    kind = parameters.axis.units
    lines = [f"Exported by ffc-id for {target.title}. Units are SI."]
    if constant := parameters.axis.torque_constant:
        unit = unit_text("torque_constant", kind)
        lines.append(f"Torque is the torque constant, {constant:.6g} {unit}, times the current.")
    lines += [f"Note: {note}." for note in plan.notes]
    lines += [f"Not carried: {sentence}." for sentence in plan.lost]
    if errors:
        names = ", ".join(Path(log.source).name for log in logs if log.source)
        lines.append(f"Torque error (root mean square, share of the torque) on {names or 'the logs'}:")
        lines += [f"  {line}" for line in error_lines(errors, kind)]
    return lines
