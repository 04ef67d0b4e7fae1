"""BAM's parameters (https://github.com/Rhoban/bam), models M1 and M2, as its JSON.

What means the same goes over: Coulomb, stiction and viscous friction, the Stribeck speed and its exponent,
and where they are known armature, torque constant and resistance. BAM's load-dependent terms (M3 to M6) are
of the torque through the gearbox, the motor's and the load's together; ours are of the load alone and do not
go over.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import final

from idtool.errors import InputError
from idtool.export.base import Plan, Target
from idtool.export.joint import BRISTLE, LEVELS_ALIKE, inertia_of
from idtool.log import Log
from idtool.parameters import Parameters


@final
class Bam(Target):
    name = "bam"
    title = "BAM (JSON)"

    def plan(self, parameters: Parameters, logs: Sequence[Log], friction: str) -> Plan:
        if not parameters.static:
            raise InputError(
                "the parameter file holds no friction", place="[friction.static]", remedy="fit it"
            )
        if parameters.axis.effort != "torque" or parameters.axis.kind != "rotary":
            raise InputError(
                "BAM counts in N m of a rotary axis, and the parameter file does not",
                place="[axis]",
                remedy="find its constant with ffc-id calibrate",
            )
        known = ("inertia", "stribeck_shape")
        lost = [entry.name.replace("_", " ") for entry in parameters.effects if entry.name not in known]
        if parameters.dynamic:
            lost.append(BRISTLE)
        notes = []
        if parameters.axis.torque_constant is None or parameters.axis.resistance is None:
            notes.append(
                "torque constant and resistance are not both known: what is not is missing (kt, R), and what "
                "the back-EMF brakes may be in friction_viscous"
            )
        return Plan(parameters, tuple(lost), tuple(notes))

    def render(self, plan: Plan, remarks: Sequence[str], joint: str) -> str:
        model, axis = plan.model, plan.model.axis
        static = {name: one.value for name, one in model.static.items()}
        stribeck = static["static"] - static["coulomb"]
        rises = abs(stribeck) > LEVELS_ALIKE * static["coulomb"]
        document: dict[str, object] = {
            "model": "m2" if rises else "m1",
            "actuator": joint,
            "friction_base": static["coulomb"],
            "friction_viscous": static["viscous"],
        }
        known = {"kt": axis.torque_constant, "R": axis.resistance, "armature": inertia_of(model)}
        document |= {name: value for name, value in known.items() if value is not None}
        if rises:
            shape = model.effect("stribeck_shape")
            document |= {
                "friction_stribeck": stribeck,
                "dtheta_stribeck": static["stribeck_velocity"],
                "alpha": shape.values()["exponent"] if shape else 2.0,
            }
        return json.dumps(document | {"remarks": list(remarks)}, indent=1, ensure_ascii=False) + "\n"
