"""Run `ffc-id`: in this process, which saves the imports, or as the real program that a user starts."""

from __future__ import annotations

import contextlib
import io
import subprocess
import sys
from pathlib import Path
from unittest import mock

from idtool.cli.main import main

PROGRAM = Path(sys.executable).parent / "ffc-id"


def ffc_id(*arguments: str | Path, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """The finished run of `ffc-id ARGUMENTS...` in this process, nobody at the keyboard.

    For what only a process has (signals, a terminal, its imports) there is `program`.
    """
    words = [str(word) for word in arguments]
    out, told = io.StringIO(), io.StringIO()
    code: object = None
    with (
        contextlib.chdir(cwd or Path.cwd()),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(told),
        mock.patch.object(sys, "argv", ["ffc-id", *words]),
        mock.patch.object(sys, "stdin", io.StringIO()),
    ):
        try:
            main(words)
        except SystemExit as end:
            code = end.code
    assert isinstance(code, int)
    return subprocess.CompletedProcess(words, code, out.getvalue(), told.getvalue())


def program(
    *arguments: str | Path, cwd: Path | None = None, timeout: float = 240
) -> subprocess.CompletedProcess[str]:
    """The finished run of the real `ffc-id ARGUMENTS...`."""
    return subprocess.run(
        [str(PROGRAM), *map(str, arguments)],
        capture_output=True,
        text=True,
        cwd=cwd,
        timeout=timeout,
        check=False,
    )
