"""The tables of a TOML file, checked: the same words for the same mistake in every file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from os import PathLike
from typing import Any

from idtool.errors import InputError, nearest
from idtool.io.toml import is_finite, short

File = str | PathLike[str]


def check_schema(document: Mapping[str, Any], schema: str, remedy: str = "") -> None:
    """Refuse a document of another kind, or of another version.

    Raises:
        InputError: `schema` is missing, or another.
    """
    found = document.get("schema")
    if found != schema:
        raise InputError(
            f"unknown schema {short(found)}" if "schema" in document else "is missing",
            place="schema",
            remedy=remedy or f'expected schema = "{schema}"',
        )


def no_strangers(table: Iterable[str], known: Iterable[str], prefix: str) -> None:
    """Refuse a key that has no meaning; `prefix` is where the table stands, with its dot.

    Raises:
        InputError: it names the key that is nearest.
    """
    names = tuple(known)
    for key in table:
        if key not in names:
            shown = key if len(key) <= 60 and key.isprintable() else short(key)
            raise InputError("unknown key", place=f"{prefix}{shown}", remedy=nearest(key[:60], names))


def table_at(value: Any, place: str, remedy: str = "") -> Mapping[str, Any]:
    """The value, if it is a table.

    Raises:
        InputError: it is none.
    """
    if not isinstance(value, dict):
        raise InputError("expected a table", place=place, remedy=remedy or f"write it as [{place}]")
    return value


def finite(value: Any, place: str) -> float:
    """The value, if it is a number that a float can hold.

    Raises:
        InputError: it is none.
    """
    if not is_finite(value):
        raise InputError(
            f"expected a finite number, found {short(value)}", place=place, remedy="write a number there"
        )
    return float(value)
