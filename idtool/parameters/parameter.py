"""One identified number of the parameter file, and how its inline table is read."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from idtool.errors import InputError
from idtool.io.tables import finite, no_strangers, table_at
from idtool.io.toml import short
from idtool.model.units import Units, file_key

#: No coefficient of a machine, in SI, comes near (the stiffness of a ball screw is 1e8 N/m).
MOST = 1e12
#: A fit may be more unsure of a number than that, but what it says must have a square.
_UNSURE = 1e100
#: Keys of what is known of a parameter that is not determined.
_LIMITS = ("at_least", "at_most")
#: What rounding may leave between a value and its bound.
ROUNDING = 1e-6


@dataclass(frozen=True)
class Parameter:
    """One identified number.

    Attributes:
        value: the estimate, SI.
        stderr: its standard error; None where it was declared, or is not determined.
        ci95: its 95 % interval; None likewise.
        at_bound: the estimate sits at a bound of its range and is not to be trusted.
        identified: whether the data determine it.
        at_least, at_most: what the data say of one that they do not determine; None: nothing on that side.
    """

    value: float
    stderr: float | None = None
    ci95: tuple[float, float] | None = None
    at_bound: bool = False
    identified: bool = True
    at_least: float | None = None
    at_most: float | None = None

    @property
    def known(self) -> bool:
        """Whether the number is one to use: determined, and not at a bound."""
        return self.identified and not self.at_bound

    @property
    def in_short(self) -> str:
        """The number with its standard error, or with why it is not one to use."""
        number = f"{self.value:.4g}"
        if self.at_bound:
            return f"{number} (at its bound)"
        if not self.identified:
            return f"{number} ({self.limits('{:.4g}'.format) or 'not determined'})"
        return number if self.stderr is None else f"{number} ± {self.stderr:.2g}"

    def undetermined(self, at_least: float | None = None, at_most: float | None = None) -> Parameter:
        """The same number as one that the data do not determine: a bound in place of error and interval."""
        return Parameter(self.value, None, None, self.at_bound, False, at_least, at_most)

    def limits(self, number: Callable[[float], str]) -> str:
        """What bound there is of a number that is not determined, in words; empty if none."""
        said = (("at least", self.at_least), ("at most", self.at_most))
        return ", ".join(f"{side} {number(end)}" for side, end in said if end is not None)

    def to_table(self) -> dict[str, Any]:
        """The inline table of the file.

        A standard error or an interval that is not finite says no more than a missing one; it is left out.
        """
        table: dict[str, Any] = {"value": float(self.value)}
        if self.stderr is not None and math.isfinite(self.stderr):
            table["stderr"] = float(self.stderr)
        if self.ci95 is not None and all(map(math.isfinite, self.ci95)):
            table["ci95"] = [float(bound) for bound in self.ci95]
        table |= {"at_bound": bool(self.at_bound), "identified": bool(self.identified)}
        for key in _LIMITS:
            if (limit := getattr(self, key)) is not None and math.isfinite(limit):
                table[key] = float(limit)
        return table


def read_parameters(
    table: Any, dimensions: Mapping[str, str], place: str, kind: Units, optional: frozenset[str] = frozenset()
) -> dict[str, Parameter]:
    table = table_at(table, place)
    keys = {file_key(name, dimension, kind): name for name, dimension in dimensions.items()}
    no_strangers(table, tuple(keys), f"{place}.")
    for key, name in keys.items():
        if key not in table and name not in optional:
            raise InputError("is missing", place=f"{place}.{key}", remedy=f"add {key} = {{value = ...}}")
    return {name: _parameter(table[key], f"{place}.{key}") for key, name in keys.items() if key in table}


def _parameter(value: Any, place: str) -> Parameter:
    if not isinstance(value, dict):
        raise InputError(
            f"expected a table, found {short(value)}", place=place, remedy="write {value = ..., stderr = ...}"
        )
    no_strangers(value, ("value", "stderr", "ci95", "at_bound", "identified", *_LIMITS), f"{place}.")
    if "value" not in value:
        raise InputError("is missing", place=f"{place}.value", remedy="expected a finite number")
    number = _number(value["value"], f"{place}.value", MOST)
    stderr = _number(value["stderr"], f"{place}.stderr", _UNSURE) if "stderr" in value else None
    if stderr is not None and stderr < 0:
        raise InputError("is negative", place=f"{place}.stderr", remedy="expected a number >= 0")
    interval = _interval(value["ci95"], number, f"{place}.ci95") if "ci95" in value else None
    at_bound = _flag(value.get("at_bound", False), f"{place}.at_bound")
    identified = _flag(value.get("identified", True), f"{place}.identified")
    found = Parameter(number, stderr, interval, at_bound, identified)
    if found.known:
        return found
    # an error beside what is not determined would be believed; files of earlier versions hold some
    low, high = (_number(value[key], f"{place}.{key}", _UNSURE) if key in value else None for key in _LIMITS)
    if low is not None and high is not None and low > high:
        raise InputError("at_least is above at_most", place=place, remedy="expected the lower first")
    return found.undetermined(low, high)


def _number(value: Any, place: str, most: float) -> float:
    """A finite number of such a size."""
    number = finite(value, place)
    if abs(number) > most:
        raise InputError(
            f"expected a number of a machine, below {most:g}, found {number:g}",
            place=place,
            remedy="correct it, or fit it again",
        )
    return number


def _interval(bounds: Any, number: float, place: str) -> tuple[float, float]:
    """The 95 % interval of a number."""
    if not isinstance(bounds, list) or len(bounds) != 2:
        raise InputError(
            f"expected [low, high], found {short(bounds)}",
            place=place,
            remedy="write the two ends of the interval, or remove the key",
        )
    low, high = (_number(bound, place, _UNSURE) for bound in bounds)
    if low > high:
        raise InputError("low is above high", place=place, remedy="expected [low, high]")
    slack = ROUNDING * (1.0 + abs(number))
    if not low - slack <= number <= high + slack:
        raise InputError(
            f"[{low:g}, {high:g}] does not hold the value {number:g}",
            place=place,
            remedy="expected the interval of this value; correct it, or remove the key",
        )
    return low, high


def _flag(value: Any, place: str) -> bool:
    if not isinstance(value, bool):
        raise InputError(
            f"expected true or false, found {short(value)}",
            place=place,
            remedy="write true or false without quotes",
        )
    return value
