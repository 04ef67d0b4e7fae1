"""Units that recordings come in, and what makes SI of them."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from idtool.errors import UsageError
from idtool.model.units import STANDARD_GRAVITY, Kind

_TURN = 2 * math.pi
#: N, N and m; by definition.
_KGF, _LBF, _INCH = STANDARD_GRAVITY, 4.4482216152605, 0.0254

#: dimension -> unit, as `canonical` spells it -> factor to SI
_FACTORS: dict[str, dict[str, float]] = {
    "time": {"s": 1, "sec": 1, "seconds": 1, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60},
    "angle": {
        "rad": 1, "mrad": 1e-3, "urad": 1e-6, "deg": _TURN / 360, "degree": _TURN / 360,
        "degrees": _TURN / 360, "rev": _TURN, "turn": _TURN, "turns": _TURN, "arcmin": _TURN / 21600,
    },
    "length": {"m": 1, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": _INCH, "inch": _INCH},
    "angular velocity": {
        "rads": 1, "radsec": 1, "mrads": 1e-3, "degs": _TURN / 360, "degsec": _TURN / 360, "dps": _TURN / 360,
        "rpm": _TURN / 60, "revmin": _TURN / 60, "revs": _TURN, "rps": _TURN, "turns": _TURN, "turnss": _TURN,
    },
    "speed": {"ms": 1, "cms": 1e-2, "mms": 1e-3, "ums": 1e-6, "mmin": 1 / 60, "mmmin": 1e-3 / 60},
    "current": {"a": 1, "amp": 1, "amps": 1, "ma": 1e-3, "ua": 1e-6},
    "torque": {
        "nm": 1, "mnm": 1e-3, "ncm": 1e-2, "nmm": 1e-3, "kgcm": _KGF * 1e-2, "kgfcm": _KGF * 1e-2,
        "kgfm": _KGF, "ozin": _LBF / 16 * _INCH, "lbin": _LBF * _INCH, "lbft": _LBF * _INCH * 12,
    },
    "force": {"n": 1, "mn": 1e-3, "kn": 1e3, "kgf": _KGF, "lbf": _LBF},
    "mass": {"kg": 1, "g": 1e-3, "lb": 0.45359237},
    "temperature": {"degc": 1, "c": 1, "celsius": 1, "k": 1, "kelvin": 1, "degf": 5 / 9, "f": 5 / 9},
    "voltage": {"v": 1, "volt": 1, "volts": 1, "mv": 1e-3},
    "duty": {"1": 1, "share": 1, "percent": 1e-2, "%": 1e-2, "permille": 1e-3},
}  # fmt: skip
_FACTORS["duty"] |= _FACTORS["voltage"]  # at the motor: a share of the supply's
_OFFSETS = {"k": -273.15, "kelvin": -273.15, "degf": -160 / 9, "f": -160 / 9}

#: role -> dimension on a rotary and on a linear axis; a role that is missing is a plain number
_DIMENSIONS: dict[str, tuple[str, str]] = {
    "time": ("time", "time"),
    "position": ("angle", "length"),
    "position_command": ("angle", "length"),
    "velocity": ("angular velocity", "speed"),
    "velocity_command": ("angular velocity", "speed"),
    "current": ("current", "current"),
    "torque": ("torque", "force"),
    "payload": ("mass", "mass"),
    "tilt_alpha": ("angle", "angle"),
    "tilt_beta": ("angle", "angle"),
    "temperature": ("temperature", "temperature"),
    "supply_voltage": ("voltage", "voltage"),
    "bus_current": ("current", "current"),
    "duty": ("duty", "duty"),
}

#: Where a format itself says that its numbers are SI, whatever the kind of axis.
SI_UNITS = "SI"

#: A unit of `--unit` that turns a column round and leaves it the unit that it has.
TURNED_ROUND = "-"

_SCALED = re.compile(r"^([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)$")
_COUNTS = re.compile(r"^(?:count|counts|tick|ticks)(?:/s)?:(\d+(?:\.\d+)?)$")


@dataclass(frozen=True)
class Unit:
    """A unit of a source column.

    Attributes:
        text: as the user or the column's name spells it.
        factor: SI = factor * x + offset.
        offset: see there; only temperatures have one.
    """

    text: str
    factor: float
    offset: float = 0.0


def canonical(text: str) -> str:
    """A unit without its marks, so that rad/s, rad_s and rad_per_s are one.

    >>> canonical("N·m"), canonical("rad_per_s"), canonical("µs"), canonical("percent")
    ('nm', 'rads', 'us', 'percent')
    """
    text = text.strip().lower().replace("°", "deg").replace("µ", "u").replace("μ", "u")
    return re.sub(r"per(?!cent|mille)|[\s_/*·^.\-]", "", text)


def dimension(role: str, kind: Kind) -> str | None:
    """The dimension of a role's column, or None for a plain number."""
    pair = _DIMENSIONS.get(role)
    return pair[kind == "linear"] if pair else None


def named_unit(text: str, role: str, kind: Kind) -> Unit | None:
    """The unit that a column's name ends in, if it is one of the role's."""
    what = dimension(role, kind)
    if text == SI_UNITS:
        return Unit(si_unit(role, kind), 1.0) if what else None
    factors = _FACTORS.get(what or "", {})
    name = canonical(text)
    return Unit(text, factors[name], _OFFSETS.get(name, 0.0)) if name in factors else None


def is_unit(text: str, role: str) -> bool:
    """Whether it is a unit of the role on either kind of axis."""
    return any(named_unit(text, role, kind) for kind in ("rotary", "linear"))


def given_unit(text: str, role: str, kind: Kind) -> Unit:
    """The unit of `--unit ROLE=TEXT`: a name, a number of SI units, `0.229rpm` or `count:4096`; with a minus
    the column is turned round.

    Raises:
        UsageError: no such unit; the sentence lists those that fit.
    """
    what = dimension(role, kind)
    if text.strip().startswith("-"):
        turned = given_unit(text.strip()[1:], role, kind)
        if turned.offset == 0.0:
            return Unit(text, -turned.factor)
    counts = _COUNTS.match(text.strip().lower())
    if counts and what in ("angle", "angular velocity", "duty") and float(counts[1]) > 0:
        return Unit(text, (1.0 if what == "duty" else _TURN) / float(counts[1]))
    if unit := named_unit(text, role, kind):
        return unit
    scaled = _SCALED.match(text.strip())
    if scaled and what and float(scaled[1]) != 0 and math.isfinite(float(scaled[1])):
        inner = named_unit(scaled[2], role, kind) if scaled[2] else Unit(text, 1.0)
        if inner and inner.offset == 0:
            return Unit(text, float(scaled[1]) * inner.factor)
    known = sorted(_FACTORS.get(what or "", {}))
    more = ", count:N (counts a turn)" if what in ("angle", "angular velocity") else ""
    more = ", count:N (counts at full duty)" if what == "duty" else more
    advice = f"; use one of {', '.join(known)}{more}, or a factor to SI such as 0.001" if known else ""
    raise UsageError(f'--unit {role}={text}: "{text}" is no unit of {what or "that column"}{advice}.')


def in_volts(unit: Unit) -> bool:
    """Whether a duty was read as what it makes of the supply: the voltage at the motor."""
    return canonical(unit.text.lstrip("-")) in _FACTORS["voltage"]


def si_unit(role: str, kind: Kind) -> str:
    """The SI unit of a role as people write it ("rad/s"), "" for a plain number."""
    return _SI.get(dimension(role, kind) or "", "")


_SI = {
    "time": "s",
    "angle": "rad",
    "length": "m",
    "angular velocity": "rad/s",
    "speed": "m/s",
    "current": "A",
    "torque": "N m",
    "force": "N",
    "mass": "kg",
    "temperature": "°C",
    "voltage": "V",
    "duty": "",
}
