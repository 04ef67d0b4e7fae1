"""Parameters of BAM (https://github.com/Rhoban/bam) into a parameter file; the way back of `export bam`.

What means the same comes over: models M1 and M2, armature, torque constant and resistance. What M3 to M6 add
is of the torque through the gearbox, the motor's and the load's together, which no effect here is; told.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from idtool.errors import InputError
from idtool.model.stribeck import EXPONENT
from idtool.parameters import Axis, EffectEntry, Parameter, Parameters

#: Where M1 has no Stribeck curve a speed stands in the file all the same, rad/s.
_NO_CURVE = 0.1
_FRICTION = {"friction_base", "friction_viscous", "friction_stribeck", "dtheta_stribeck", "alpha"}
_TAKEN = _FRICTION | {"kt", "R", "armature"}


def bam_parameters(file: Path) -> tuple[Parameters, list[str]] | None:
    """A file of BAM's parameters, and the keys that do not come over; None if it is none.

    Raises:
        InputError: a number that is missing or cannot be.
    """
    if file.suffix.lower() != ".json" or not file.is_file():
        return None
    try:
        content = json.loads(file.read_bytes())
    except (ValueError, RecursionError):
        return None  # whoever reads logs says what is wrong with it
    if not isinstance(content, dict) or not {"friction_base", "friction_viscous"} <= content.keys():
        return None
    coulomb = _number(content, "friction_base", file)
    more = _number(content, "friction_stribeck", file, 0.0)
    static = {
        "coulomb": coulomb,
        "static": coulomb + more,
        "stribeck_velocity": _number(content, "dtheta_stribeck", file, None if more else _NO_CURVE),
        "viscous": _number(content, "friction_viscous", file),
    }
    effects = {"inertia": {"inertia": _number(content, "armature", file, 0.0)}}
    exponent = _number(content, "alpha", file, EXPONENT)
    if more and exponent != EXPONENT:
        effects["stribeck_shape"] = {"exponent": exponent}
    known = {key: _number(content, key, file) for key in ("kt", "R") if key in content}
    found = Parameters(
        axis=Axis("rotary", known.get("kt"), resistance=known.get("R")),
        static={name: Parameter(value) for name, value in static.items()},
        effects=tuple(
            EffectEntry(name, {key: Parameter(value) for key, value in values.items()})
            for name, values in effects.items()
            if any(values.values())
        ),
        provenance={"made_by": "ffc-id import", "from": f"BAM {content.get('model', '')}".strip()},
    )
    lost = [key for key, value in content.items() if key not in _TAKEN and _is_number(value) and value]
    return found, lost


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _number(content: dict[str, Any], key: str, file: Path, default: float | None = None) -> float:
    value: Any = content.get(key, default)
    if not _is_number(value) or not math.isfinite(value) or value < 0.0:
        problem = "is missing" if value is None else f"expected a number >= 0, found {value!r}"
        raise InputError(problem, file=file, place=key, remedy="fit it again with BAM")
    return float(value)
