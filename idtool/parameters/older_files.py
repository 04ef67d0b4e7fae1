"""Keys and units that files of an earlier version of this tool hold."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from idtool.io.toml import is_finite
from idtool.model.units import Units, radians_per_unit

#: A key that has another name now and means the same.
_RENAMED = {"cycles_per_rad": "cycles_per_turn"}


def renamed(table: Mapping[str, Any]) -> dict[str, Any]:
    """A table with its keys under their names of today."""
    return {_RENAMED.get(key, key): value for key, value in table.items()}


def effects_of_today(document: Mapping[str, Any], kind: Units) -> Any:
    """The effects of a parameter file in keys and units of today, not checked.

    Files of ffc-id 0.1.0 gave the waves of a ripple on a linear axis as n of sin(n x), under today's key.
    """
    entries = document.get("effects", [])
    provenance = document.get("provenance")
    first = isinstance(provenance, dict) and provenance.get("tool") == "ffc-id 0.1.0"
    per_unit = radians_per_unit("spatial_frequency", kind) if first else 1.0

    def of_today(entry: Any) -> Any:
        if not isinstance(entry, dict) or not isinstance(entry.get("parameters"), dict):
            return entry
        table = renamed(entry["parameters"])
        waves = table.get("cycles_per_m")
        if isinstance(waves, dict):
            table["cycles_per_m"] = {key: _divided(value, per_unit) for key, value in waves.items()}
        return {**entry, "parameters": table}

    return [of_today(entry) for entry in entries] if isinstance(entries, list) else entries


def _divided(value: Any, by: float) -> Any:
    """A number or an interval in another unit; what is neither stays for the checks to refuse."""
    if isinstance(value, list):
        return [_divided(bound, by) for bound in value]
    return value / by if is_finite(value) else value
