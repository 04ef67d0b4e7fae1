"""TOML files: read with one sentence when that fails, written with each identified parameter on one line."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomli_w

from idtool.errors import InputError
from idtool.io.read_file import read_bytes

#: What no bare key goes beyond, and the most dots of a key.
_KEY_ENDS = re.compile(r"[=\n{},]")
_MOST_PARTS = 100


def dumps_inline(document: Mapping[str, Any]) -> str:
    """TOML text in which every identified parameter is one inline table on one line."""
    lines: list[str] = []
    _emit(document, (), lines)
    return "\n".join(lines).lstrip("\n") + "\n"


def is_finite(value: Any) -> bool:
    """Whether a value read from a file is a number that a float can hold; true and false are none."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number beyond every float
        return False


def short(value: Any) -> str:
    """A value for a message, cut to a length that fits a sentence."""
    try:
        text = repr(value)
    except ValueError:  # a whole number too long to print
        text = "a huge number"
    return text if len(text) <= 60 else f"{text[:57]}..."


def _emit(table: Mapping[str, Any], path: tuple[str, ...], lines: list[str]) -> None:
    nested: list[tuple[str, Any]] = []
    for key, value in table.items():
        if (isinstance(value, dict) and not is_finite(value.get("value"))) or _is_table_list(value):
            nested.append((key, value))
        else:
            lines.append(f"{_key(key)} = {_inline(value)}")
    for key, value in nested:
        here = (*path, key)
        name = ".".join(_key(part) for part in here)
        for item in value if isinstance(value, list) else [value]:
            if isinstance(value, list):
                lines += ["", f"[[{name}]]"]
            elif not item or not all(
                isinstance(part, dict) and not is_finite(part.get("value")) for part in item.values()
            ):
                lines += ["", f"[{name}]"]  # a table of nothing but tables needs no line of its own
            _emit(item, here, lines)


def _is_table_list(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(item, dict) for item in value)


def _key(key: str) -> str:
    return tomli_w.dumps({key: 0}).removesuffix(" = 0\n")


def _inline(value: Any) -> str:
    """A value as TOML on one line, tables and lists too."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_key(key)} = {_inline(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_inline(item) for item in value) + "]"
    return tomli_w.dumps({"v": value}).removeprefix("v = ").removesuffix("\n")


def parse_toml(text: str) -> dict[str, Any]:
    """The document of a TOML text.

    Raises:
        ValueError: not TOML, or with a key of so many parts that the parser would take minutes (its time
            grows with their square).
        RecursionError: nested too deeply.
    """
    if max(piece.count(".") for piece in _KEY_ENDS.split(text)) > _MOST_PARTS:
        raise ValueError(f"a key of over {_MOST_PARTS} parts")
    return tomllib.loads(text)


def load_toml(
    file: Path, limit: int, *, what: str = "a parameter file", made_by: str = "`ffc-id identify` or a fit"
) -> dict[str, Any]:
    """The document of a file of at most `limit` bytes; `what` it is and is `made_by`, for messages.

    Raises:
        InputError: not readable, empty, not text, not TOML.
    """
    raw, cut = read_bytes(file, what=what, limit=limit)
    try:
        if cut:
            raise InputError("is gzipped and cut short", file=file, remedy="copy it again")
        if not raw.strip():
            raise InputError("the file is empty", file=file, remedy=f"make it with {made_by}")
        return parse_toml(raw.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise InputError("is not a text file", file=file, remedy=f"name {what} (TOML)") from error
    except RecursionError as error:
        raise InputError("is not TOML (nested too deeply)", file=file, remedy="mend that place") from error
    except ValueError as error:  # tomllib lets int() complain of huge numbers as ValueError
        raise InputError(f"is not TOML ({error})", file=file, remedy="mend that place") from error
