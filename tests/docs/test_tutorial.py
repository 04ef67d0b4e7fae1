"""The tutorial runs as it is printed, and prints what it says."""

from __future__ import annotations

import math
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from .running import finished
from .support import PROJECT, commands_in, fences

TUTORIAL = PROJECT / "docs" / "tutorial.md"
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")
#: How far a number of another machine may be from the printed one.
_CLOSE = 0.03


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


def test_the_tutorial_runs_and_prints_what_it_says(tmp_path: Path) -> None:
    shutil.copy(PROJECT / "docs" / "tutorial.toml", tmp_path / "axis.toml")
    done = 0
    for found, said in steps(TUTORIAL):
        printed = "".join(finished(command, tmp_path) for command in found)
        done += len(found)
        assert missing(said, printed) == [], printed
    assert done == 10
    assert (tmp_path / "guided.png").exists()


@pytest.mark.parametrize(
    ("said", "printed", "same"),
    [
        ("5.93 N moves it", "5.95 N  moves it", True),
        ("5.93 N moves it", "7.93 N moves it", False),
        ("effect: inertia", "effect: backlash", False),
        ("std error 6.5e-05", "std error 6.6e-05", True),
    ],
)
def test_lines_are_compared_by_words_and_numbers(said: str, printed: str, same: bool) -> None:
    assert alike(said, printed) == same


def test_a_line_that_is_not_printed_shows() -> None:
    assert missing(["a 1", "...", "c 3"], "a 1\nb 2\nc 3\n") == []
    assert missing(["a 1", "d 4"], "a 1\nb 2\n") == ["d 4"]
