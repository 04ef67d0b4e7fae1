"""Names of quantities in files: a base name and the unit that the kind of axis gives it.

Inside the package a quantity has a base name ("coulomb") and a dimension ("torque"); in a file the
unit ends the name, "coulomb_nm" on a rotary axis and "coulomb_n" on a linear one. "Torque" is used
in the code for both torque and force, "position" for both angle and travel.

Where nobody knows the torque constant, torque is counted in what stands for it: the motor's current in A or
its voltage in V (`Units`), and every quantity made of torque likewise: "coulomb_v", "viscous_v_s_per_rad".
"""

from __future__ import annotations

import math
from typing import Literal

#: m/s^2 (CGPM 1901).
STANDARD_GRAVITY = 9.80665

Kind = Literal["rotary", "linear"]
#: What the effort of an axis is counted in: N m (or N), A of the motor, or V at it.
EffortUnit = Literal["torque", "current", "voltage"]
#: The kind of axis, and `_a` or `_v` behind it where torque is counted in ampere or volt.
Units = Literal["rotary", "linear", "rotary_a", "linear_a", "rotary_v", "linear_v"]

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
    "inertia_per_payload": ("m2", ""),
    "spatial_frequency": ("per_turn", "per_m"),
    "torque_per_payload": ("nm_per_kg", "n_per_kg"),
    "torque_constant": ("nm_per_a", "n_per_a"),
    "angle": ("rad", "rad"),
    "phase": ("rad", "rad"),
    "time": ("s", "s"),
    "frequency": ("hz", "hz"),
    "current": ("a", "a"),
    "per_current": ("per_a", "per_a"),
    "per_torque": ("per_nm", "per_n"),
    "temperature": ("degc", "degc"),
    "per_temperature": ("per_k", "per_k"),
    "mass": ("kg", "kg"),
    "per_position": ("per_rad", "per_m"),
    "per_velocity": ("s_per_rad", "s_per_m"),
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
    "m2": "m²",
    "per_turn": "1/turn",
    "per_m": "1/m",
    "per_rad": "1/rad",
    "s_per_rad": "s/rad",
    "s_per_m": "s/m",
    "nm_per_kg": "N m/kg",
    "n_per_kg": "N/kg",
    "nm_per_a": "N m/A",
    "n_per_a": "N/A",
    "s": "s",
    "hz": "Hz",
    "a": "A",
    "per_a": "1/A",
    "per_nm": "1/(N m)",
    "per_n": "1/N",
    "degc": "°C",
    "per_k": "1/K",
    "": "",
}
for _end, _unit in (("a", "A"), ("v", "V")):
    _PRETTY |= {
        _end: _unit,
        f"{_end}_s_per_rad": f"{_unit} s/rad",
        f"{_end}_s_per_m": f"{_unit} s/m",
        f"{_end}_s2_per_rad": f"{_unit} s²/rad",
        f"{_end}_s2_per_m": f"{_unit} s²/m",
        f"{_end}_s2_per_rad_kg": f"{_unit} s²/(rad kg)",
        f"{_end}_s2_per_m_kg": f"{_unit} s²/(m kg)",
        f"{_end}_s2_per_rad2": f"{_unit} s²/rad²",
        f"{_end}_s2_per_m2": f"{_unit} s²/m²",
        f"{_end}_per_rad": f"{_unit}/rad",
        f"{_end}_per_m": f"{_unit}/m",
        f"{_end}_per_kg": f"{_unit}/kg",
        f"{_end}_per_a": f"{_unit}/A",
    }


def units_of(kind: Kind, effort: EffortUnit) -> Units:
    """The units of an axis of this kind whose effort is counted so."""
    ends = {"torque": "", "current": "_a", "voltage": "_v"}
    return f"{kind}{ends[effort]}"  # type: ignore[return-value]


def is_linear(units: Units) -> bool:
    """Whether the axis is a linear one."""
    return units.startswith("linear")


def file_key(name: str, dimension: str, units: Units) -> str:
    """The key of a quantity in a file.

    >>> file_key("coulomb", "torque", "linear"), file_key("viscous", "damping", "rotary_v")
    ('coulomb_n', 'viscous_v_s_per_rad')
    """
    suffix = unit_suffix(dimension, units)
    return f"{name}_{suffix}" if suffix else name


def unit_suffix(dimension: str, units: Units) -> str:
    """The unit that ends a key in a file; "" for a pure number."""
    linear = is_linear(units)
    suffix = SUFFIXES[dimension][linear]
    end = units.partition("_")[2]
    if not end:
        return suffix
    if dimension.startswith("inertia"):
        per_kg = "_kg" if dimension == "inertia_per_payload" else ""
        return f"{end}_s2_per_{'m' if linear else 'rad'}{per_kg}"
    if dimension == "torque_constant":
        return "a_per_a" if end == "a" else "v_per_a"
    torque = SUFFIXES["torque"][linear]
    is_made_of_torque = suffix == torque or suffix.startswith(f"{torque}_")
    return end + suffix.removeprefix(torque) if is_made_of_torque else suffix


def unit_text(dimension: str, units: Units) -> str:
    """The unit as a person reads it, for tables and figure axes ("N m/rad")."""
    suffix = unit_suffix(dimension, units)
    return _PRETTY[suffix]


def torque_name(units: Units) -> str:
    """What the effort of the axis is called: "torque" or "force", "current" or "voltage"."""
    end = units.partition("_")[2]
    if end:
        return "current" if end == "a" else "voltage"
    return "force" if units == "linear" else "torque"


def radians_per_unit(dimension: str, units: Units) -> float:
    """What a number of a file is worth in radians (of phase, per rad or m of the axis), 1 where it is none.

    n waves per turn of a rotary axis are sin(n q), n waves per metre of a linear one are sin(2 pi n x).
    """
    return 2.0 * math.pi if dimension == "spatial_frequency" and is_linear(units) else 1.0
