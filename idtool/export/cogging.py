"""A cogging map: what a motor controller adds at each angle against the ripple, as a table over one turn.

Controllers with an anticogging table (moteus, ODrive, SimpleFOC) take such a map in counts of their own; the
angle here is that of the output, from 0 to a turn.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import final

import numpy as np

from idtool.effects import registry
from idtool.errors import InputError
from idtool.export.base import Plan, Target
from idtool.log import Log
from idtool.model.motion import Array, Motion
from idtool.model.units import file_key, unit_text
from idtool.parameters import Parameters

#: Rows of the table.
ROWS = 1024


@final
class CoggingMap(Target):
    name = "cogging"
    title = "a cogging map (CSV)"

    def plan(self, parameters: Parameters, logs: Sequence[Log], friction: str) -> Plan:
        ripple = parameters.effect("position_ripple")
        if ripple is None or parameters.axis.kind != "rotary":
            raise InputError(
                "the parameter file holds no position ripple of a rotary axis",
                place="[[effects]]",
                remedy="identify one with a slow sweep over the whole stroke (ffc-id run-sweep)",
            )
        lost = ("everything but the position ripple",)
        notes = (
            "angle 0 is that of the axis' own encoder; a ripple whose waves do not come whole in a turn "
            "holds over the first turn only",
        )
        return Plan(replace(parameters, effects=(ripple,), gravity={}, gravity_model=None), lost, notes)

    def render(self, plan: Plan, remarks: Sequence[str], joint: str) -> str:
        axis = plan.model.axis
        angle: Array = np.arange(ROWS, dtype=float) * (2.0 * math.pi / ROWS)
        (entry,) = plan.model.effects
        effect = registry.get(entry.name)
        still = np.zeros(ROWS)
        motion = Motion(still, np.zeros(ROWS, dtype=np.intp), angle, still, still)
        torque = effect.contribute(motion, effect.from_file(entry.values(), axis.kind)).torque
        columns, table = ["angle_rad", file_key("compensation", "torque", axis.units)], [angle, torque]
        if axis.effort == "torque" and axis.torque_constant:
            columns.append("compensation_a")
            table.append(torque / axis.torque_constant)
        rows = [",".join(f"{value:.7g}" for value in row) for row in zip(*table, strict=True)]
        unit = unit_text("torque", axis.units)
        head = [f"# {line}" for line in (*remarks, f"compensation is what the motor adds, {unit}")]
        return "\n".join([*head, ",".join(columns), *rows, ""])
