"""A parameter file as a simulated rig: what was identified runs experiments, is taught and plays.

The plant keeps its own formulas; this says in its numbers what the file says. What it cannot take is refused
(a file in A or V, a linear axis) or left out and told in the rig's description (forms of an effect that the
plant does not have).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from idtool.errors import InputError
from idtool.parameters import Axis, Parameters
from idtool.rig.plant_file import EFFECT_KEYS, PlantFile, parse_plant

#: A bristle that the file does not have is this stiff: it gives way over so many radians, damped so well.
_PRESLIDING, _DAMPING_RATIO = 2e-3, 0.7
#: Limits where the file tells none: a turn each way, and so many times what friction and gravity take.
_TURN, _SPEED, _REACH = 2.0 * math.pi, 6.0, 4.0
#: Inertia where the file has none, kg m^2 for each N m of friction: it stops within 0.1 s at 1 rad/s.
_INERTIA_PER_FRICTION = 0.1


def plant_of(parameters: Parameters, file: Path) -> PlantFile:
    """The plant of a parameter file.

    Raises:
        InputError: a linear axis, one counted in A or V, or no static friction in the file.
    """
    axis = parameters.axis
    if axis.kind != "rotary":
        raise InputError(
            "is of a linear axis, and simulated rigs turn",
            place="axis.kind",
            remedy="simulate its logs with ffc-id simulate",
        )
    if axis.effort != "torque":
        raise InputError(
            f"counts in {axis.effort}, and a simulated rig in N m",
            place="axis.effort",
            remedy="put it into N m from a known load: ffc-id calibrate LOG --mass KG --lever M -p FILE",
        )
    if not parameters.static:
        raise InputError(
            "has no [friction.static]", remedy="make it with ffc-id identify, or ffc-id fit-static"
        )
    document = parameters.to_document()
    effects, left_out = _effects(document.get("effects", []))
    of_inertia = next((one for one in effects if one["name"] == "inertia"), {"inertia_kg_m2": 0.0})
    inertia = of_inertia["inertia_kg_m2"]
    friction = _values(document["friction"]["static"])
    levels = max(friction["coulomb_nm"], friction["static_nm"], 1e-6)
    carried = sum(one["yield_nm"] for one in effects if one.pop("of_friction", 0.0))
    for key in ("coulomb_nm", "static_nm"):  # a plant has the element beside its friction
        friction[key] = max(friction[key] - carried, 1e-3 * levels)
    inertia = inertia if inertia > 0.0 else _INERTIA_PER_FRICTION * levels
    if parameters.has_bristle:
        friction |= _values(document["friction"]["dynamic"])
    else:
        friction |= _usual_bristle(levels, inertia)
    gravity, load = _gravity(parameters)
    constant = axis.torque_constant or 1.0
    without = f", without {', '.join(left_out)}" if left_out else ""
    table: dict[str, Any] = {
        "description": f"the axis of {file.name}{without}",
        "axis": {"kind": "rotary", "torque_constant_nm_per_a": constant},
        "plant": {"inertia_kg_m2": inertia},
        "gravity": gravity,
        "friction": friction,
        "limits": {
            "lowest_rad": -_TURN,
            "highest_rad": _TURN,
            "speed_rad_s": _SPEED,
            "current_a": _REACH * (levels + load + _SPEED * friction["viscous_nm_s_per_rad"]) / constant,
        },
        "effects": [
            *(one for one in effects if one is not of_inertia),
            *([of_inertia | {"inertia_kg_m2": 0.0}] if "per_payload_m2" in of_inertia else []),
        ],
    }
    found = parse_plant(table, file)
    # the constant's interval and what else the file says of the axis go into the logs
    return replace(found, axis=Axis("rotary", constant))


def _values(table: Mapping[str, Mapping[str, Any]]) -> dict[str, float]:
    """Key -> value of a table of the file."""
    return {key: one["value"] for key, one in table.items()}


def _usual_bristle(levels: float, inertia: float) -> dict[str, float]:
    stiffness = levels / _PRESLIDING
    return {
        "bristle_stiffness_nm_per_rad": stiffness,
        "bristle_damping_nm_s_per_rad": 2.0 * _DAMPING_RATIO * math.sqrt(stiffness * inertia),
    }


def _gravity(parameters: Parameters) -> tuple[dict[str, Any], float]:
    """The table, and what the axis carries at its most without a payload."""
    values = {name: one.value for name, one in parameters.gravity.items()}
    if parameters.gravity_model == "arm":
        table = {"kind": "arm", "sine_nm": values["sin"], "cosine_nm": values["cos"]}
        return table, math.hypot(values["sin"], values["cos"])
    base, more = values.get("base", 0.0), values.get("per_payload", 0.0)
    return {"kind": "slide", "base_nm": base, "per_payload_nm_per_kg": more}, abs(base) + abs(more)


def _effects(entries: list[dict[str, Any]]) -> tuple[list[dict[str, Any]], list[str]]:
    """Tables of the effects, and names of what the plant does not have."""
    found, left_out = [], []
    for entry in entries:
        name, values = entry["name"], _values(entry["parameters"])
        known = EFFECT_KEYS.get(name)
        if known is None:
            left_out.append(name)
            continue
        told = {key: value for key, value in values.items() if key in known or key == "of_friction"}
        if any(default is None and key not in told for key, default in known.items()):
            left_out.append(name)
            continue
        if len(told) < len(values):
            left_out.append(f"a part of {name}")
        found.append({"name": name, **told})
    return found, left_out
