"""Names of quantities in files: a base name and the unit that the kind of axis gives it.

Inside the package a quantity has a base name ("coulomb") and a dimension ("torque"); in a file the
unit ends the name, "coulomb_nm" on a rotary axis and "coulomb_n" on a linear one. "Torque" is used
in the code for both torque and force, "position" for both angle and travel.
"""

from __future__ import annotations

import math
from typing import Literal

Kind = Literal["rotary", "linear"]

#: dimension -> (suffix on a rotary axis, suffix on a linear axis); "" is a pure number
SUFFIXES: dict[str, tuple[str, str]] = {
    "number": ("", ""),
    "torque": ("nm", "n"),
    "position": ("rad", "m"),
    "velocity": ("rad_s", "m_s"),
    "acceleration": ("rad_s2", "m_s2"),
    "damping": ("nm_s_per_rad", "n_s_per_m"),
    "quadratic_damping": ("nm_s2_per_rad2", "n_s2_per_m2"),
    "stiffness": ("nm_per_rad", "n_per_m"),
    "inertia": ("kg_m2", "kg"),
    "spatial_frequency": ("per_turn", "per_m"),
    "torque_per_payload": ("nm_per_kg", "n_per_kg"),
    "torque_constant": ("nm_per_a", "n_per_a"),
    "angle": ("rad", "rad"),
    "phase": ("rad", "rad"),
    "time": ("s", "s"),
    "frequency": ("hz", "hz"),
    "current": ("a", "a"),
    "per_current": ("per_a", "per_a"),
    "temperature": ("degc", "degc"),
    "per_temperature": ("per_k", "per_k"),
    "mass": ("kg", "kg"),
}

_PRETTY = {
    "nm": "N m",
    "n": "N",
    "rad": "rad",
    "m": "m",
    "rad_s": "rad/s",
    "m_s": "m/s",
    "rad_s2": "rad/s²",
    "m_s2": "m/s²",
    "nm_s_per_rad": "N m s/rad",
    "n_s_per_m": "N s/m",
    "nm_s2_per_rad2": "N m s²/rad²",
    "n_s2_per_m2": "N s²/m²",
    "nm_per_rad": "N m/rad",
    "n_per_m": "N/m",
    "kg_m2": "kg m²",
    "kg": "kg",
    "per_turn": "1/turn",
    "per_m": "1/m",
    "nm_per_kg": "N m/kg",
    "n_per_kg": "N/kg",
    "nm_per_a": "N m/A",
    "n_per_a": "N/A",
    "s": "s",
    "hz": "Hz",
    "a": "A",
    "per_a": "1/A",
    "degc": "°C",
    "per_k": "1/K",
    "": "",
}


def file_key(name: str, dimension: str, kind: Kind) -> str:
    """The key of a quantity in a file.

    >>> file_key("coulomb", "torque", "linear")
    'coulomb_n'
    """
    suffix = SUFFIXES[dimension][kind == "linear"]
    return f"{name}_{suffix}" if suffix else name


def unit_text(dimension: str, kind: Kind) -> str:
    """The unit as a person reads it, for tables and figure axes ("N m/rad")."""
    return _PRETTY[SUFFIXES[dimension][kind == "linear"]]


def torque_name(kind: Kind) -> str:
    """What the effort of the axis is called: "torque" or "force"."""
    return "force" if kind == "linear" else "torque"


def radians_per_unit(dimension: str, kind: Kind) -> float:
    """What a number of a file is worth in radians (of phase, per rad or m of the axis), 1 where it is none.

    n waves per turn of a rotary axis are sin(n q), n waves per metre of a linear one are sin(2 pi n x).
    """
    return 2.0 * math.pi if dimension == "spatial_frequency" and kind == "linear" else 1.0
