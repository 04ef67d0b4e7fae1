"""Run what the documentation shows with the real program, and compare what it prints."""

from __future__ import annotations

import math
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from .support import commands_in, fences

PROGRAM = Path(sys.executable).parent / "ffc-id"

_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")
#: How far a number of another machine may be from the printed one.
_CLOSE = 0.03


def finished(words: list[str], folder: Path, code: int = 0) -> str:
    """What `ffc-id WORDS...` prints in a terminal as wide as the pages; it must end with `code`."""
    done = subprocess.run(
        [str(PROGRAM), *words],
        cwd=folder,
        env={**os.environ, "COLUMNS": "118"},
        capture_output=True,
        text=True,
        timeout=900,
        check=False,
    )
    assert done.returncode == code, f"ffc-id {' '.join(words)}: {done.stderr}"
    return done.stdout + done.stderr


def steps(page: Path) -> Iterator[tuple[list[list[str]], list[str]]]:
    """The commands of each block, and the lines that it is said to print."""
    blocks = fences(page)
    for block, following in zip(blocks, [*blocks[1:], None], strict=True):
        if block.language == "sh" and (found := commands_in(block.text)):
            printed = following.text.splitlines() if following and following.language == "text" else []
            yield found, printed


def alike(said: str, printed: str) -> bool:
    """Whether two lines have the same words, and numbers that are about the same."""
    one, other = (_NUMBER.split(" ".join(line.split())) for line in (said, printed))
    numbers = zip(_NUMBER.findall(said), _NUMBER.findall(printed), strict=False)
    return one == other and all(
        math.isclose(float(a), float(b), rel_tol=_CLOSE, abs_tol=_scale(a)) for a, b in numbers
    )


def _scale(number: str) -> float:
    """Two units of the last digit that is printed."""
    mantissa, _, exponent = number.partition("e")
    digits = len(mantissa.partition(".")[2])
    return 2.0 * 10.0 ** (int(exponent or 0) - digits)


def missing(said: list[str], printed: str) -> list[str]:
    """Lines that are said to be printed and were not, in their order; "..." leaves some out."""
    left = iter(printed.splitlines())
    return [line for line in said if line.strip(" .") and not any(alike(line, other) for other in left)]
