"""A fault of the program itself: one sentence for the user, a file with the details for who repairs it."""

from __future__ import annotations

import os
import platform
import sys
import tempfile
import traceback

#: Letters of an error that the sentence tells; the file has all of it.
_LONGEST = 200


def sentence_of(error: Exception) -> str:
    """What the user reads; the details are in the file that it names (owner only, temporary folder)."""
    said = " ".join(f"{type(error).__name__}: {error}".split())[:_LONGEST]
    try:
        handle, file = tempfile.mkstemp(prefix="ffc-id-fault-", suffix=".txt")
        with os.fdopen(handle, "w", encoding="utf-8", errors="replace") as stream:
            stream.write(_details(error))
    except OSError as refused:
        return f"the program has a fault ({said}), and no file with the details could be written ({refused})."
    return f"the program has a fault ({said}); please report it with the details, which are in {file}."


def _details(error: Exception) -> str:
    from idtool.version import __version__

    trace = "".join(traceback.format_exception(error))
    return (
        f"ffc-id {__version__}, Python {platform.python_version()}, {platform.platform()}\n"
        f"arguments: {sys.argv[1:]}\n\n{trace}"
    )
