"""TOML files: read with one sentence when that fails, written with each identified parameter on one line."""

from __future__ import annotations

import math
import re
import tomllib
from os import PathLike
from pathlib import Path
from typing import Any

from idtool.errors import InputError
from idtool.io.read_file import read_bytes

#: Beyond this it is no file that a person would look into, whatever it is.
MOST_BYTES = 8 << 20
#: What no bare key goes beyond, and the most dots of a key.
_KEY_ENDS = re.compile(r"[=\n{},]")
_MOST_PARTS = 100


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


def read_document(content: bytes | str, file: str | PathLike[str], *, what: str) -> dict[str, Any]:
    """The document of TOML; `file`, and `what` it is, are for messages.

    Raises:
        InputError: not text, not TOML.
    """
    try:
        return parse_toml(content.decode("utf-8-sig") if isinstance(content, bytes) else content)
    except UnicodeDecodeError as error:
        raise InputError("is not a text file", file=file, remedy=f"name {what} (TOML)") from error
    except RecursionError as error:
        raise InputError("is not TOML (nested too deeply)", file=file, remedy="correct that place") from error
    except ValueError as error:  # tomllib lets int() complain of huge numbers as ValueError
        raise InputError(f"is not TOML ({error})", file=file, remedy="correct that place") from error


def load_toml(
    file: Path, *, what: str = "a parameter file", made_by: str = "`ffc-id identify` or a fit"
) -> dict[str, Any]:
    """The document of a file of at most `MOST_BYTES`; `what` it is and is `made_by`, for messages.

    Raises:
        InputError: not readable, empty, not text, not TOML.
    """
    raw, cut = read_bytes(file, what=what, limit=MOST_BYTES)
    if cut:
        raise InputError("is gzipped and cut short", file=file, remedy="copy it again")
    if not raw.strip():
        raise InputError("the file is empty", file=file, remedy=f"make it with {made_by}")
    return read_document(raw, file, what=what)
