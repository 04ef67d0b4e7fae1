"""Pages of documentation: the commands in them, and what these print."""

from __future__ import annotations

import math
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from idtool.io.atomic import atomic_write

PROGRAM = Path(sys.executable).parent / "ffc-id"
#: Columns of the terminal that pages show.
WIDTH = "118"

FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
#: What stands four spaces or more behind a command, as in a help text, says what it does.
_ASIDE = re.compile(r" {4,}(?=[a-z])")
#: Where a command of the shell ends.
_ENDS = {"|", ">", ">>", "2>", "&&", "||", ";", "&"}
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")
#: How far a number of another machine may be from the printed one.
_CLOSE = 0.03
_BEGIN, _END = "<!-- {}: made by `make {}` -->\n", "<!-- end of {} -->\n"


@dataclass(frozen=True)
class Fence:
    """A fenced block: its language, its text, and the line of the page at which it starts."""

    language: str
    text: str
    line: int


def fences(page: Path) -> list[Fence]:
    """Every fenced block of a page."""
    text = page.read_text(encoding="utf-8")
    return [Fence(m[1], m[2], text.count("\n", 0, m.start()) + 1) for m in FENCE.finditer(text)]


def commands_in(block: str) -> list[list[str]]:
    """The words after `ffc-id` of every such command in a block, without prompt, comment and redirection."""
    found = []
    for line in block.replace("\\\n", " ").splitlines():
        words = shell_words(line.strip().removeprefix("$ "))
        if words[:1] == ["ffc-id"]:
            found.append(words[1:])
    return found


def shell_words(line: str) -> list[str]:
    """The words of the first command of a line; none where it is not one."""
    try:
        words = shlex.split(_ASIDE.split(line)[0], comments=True)
    except ValueError:  # an apostrophe in prose
        return []
    end = next((k for k, word in enumerate(words) if word in _ENDS), len(words))
    return words[:end]


def finished(words: list[str], folder: Path, code: int = 0) -> str:
    """What `ffc-id WORDS...` prints in a terminal as wide as the pages; it must end with `code`.

    Raises:
        RuntimeError: it ended otherwise.
    """
    done = subprocess.run(
        [str(PROGRAM), *words],
        cwd=folder,
        env={**os.environ, "COLUMNS": WIDTH},
        capture_output=True,
        text=True,
        timeout=900,
        check=False,
    )
    if done.returncode != code:
        raise RuntimeError(f"ffc-id {' '.join(words)} ended with {done.returncode}: {done.stderr}")
    return done.stdout + done.stderr


def steps(page: Path) -> Iterator[tuple[list[list[str]], str]]:
    """The commands of each block, and what it is said to print."""
    blocks = fences(page)
    for block, following in zip(blocks, [*blocks[1:], None], strict=True):
        if block.language == "sh" and (found := commands_in(block.text)):
            yield found, following.text if following and following.language == "text" else ""


def same_words(one: str, other: str) -> bool:
    """Whether two lines differ in spaces and numbers only."""
    return _words(one) == _words(other)


def _words(line: str) -> list[str]:
    return _NUMBER.split(" ".join(line.split()))


def alike(said: str, printed: str) -> bool:
    """Whether two lines have the same words, and numbers that are about the same."""
    numbers = zip(_NUMBER.findall(said), _NUMBER.findall(printed), strict=False)
    return same_words(said, printed) and all(
        math.isclose(float(a), float(b), rel_tol=_CLOSE, abs_tol=_scale(a)) for a, b in numbers
    )


def _scale(number: str) -> float:
    """Two units of the last digit that is printed."""
    mantissa, _, exponent = number.partition("e")
    digits = len(mantissa.partition(".")[2])
    return 2.0 * 10.0 ** (int(exponent or 0) - digits)


def missing(said: str, printed: str) -> list[str]:
    """Lines that are said to be printed and were not, in their order; "..." leaves some out."""
    left = iter(printed.splitlines())
    return [
        line
        for line in said.splitlines()
        if line.strip(" .") and not any(alike(line, other) for other in left)
    ]


def row(cells: Iterable[object]) -> str:
    """A row of a table."""
    return f"| {' | '.join(map(str, cells))} |".replace("|  |", "| |")


def table(head: Sequence[str], rows: Iterable[Iterable[object]], align: str = "") -> list[str]:
    """The lines of a table; `align` has an l or r for each column, left if it is empty."""
    rules = {"l": "---", "r": "---:"}
    return [row(head), f"|{'|'.join(rules[way] for way in align or 'l' * len(head))}|", *map(row, rows)]


def with_made(page: str, part: str, text: str, target: str = "docs-effects") -> str:
    """A page with what is made put between the markers of that part."""
    begin, end = _BEGIN.format(part, target), _END.format(part)
    head, found, rest = page.partition(begin)
    _, closed, tail = rest.partition(end)
    if not found or not closed:
        raise ValueError(f"no markers of the part {part!r}")
    return head + begin + text + end + tail


def out_option(page: str) -> Callable[[Any], Any]:
    """`--out` of a study: its page, or a copy of it."""
    return click.option("--out", type=click.Path(path_type=Path), default=Path(page), show_default=True)


def write_made(page: str, parts: Mapping[str, Iterable[str]], target: str, out: Path | None = None) -> None:
    """Put the lines that are made into the parts of a page; what is around them is written by hand there.

    Args:
        page: with the markers of all parts.
        parts: name -> lines.
        target: of make.
        out: a copy of the page to write instead, which need not be there yet.
    """
    out = out or Path(page)
    text = (out if out.exists() else Path(page)).read_text(encoding="utf-8")
    for part, lines in parts.items():
        made = "\n".join(lines).strip("\n")
        text = with_made(text, part, f"\n{made}\n\n", target)
    with atomic_write(out) as stream:
        stream.write(text)
