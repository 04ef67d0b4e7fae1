"""What is going on, on one line of a notebook or a terminal."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from idtool.presentation.pace import Pace
from idtool.verbs.expected import Expected

#: A terminal of 80 columns, and the cursor's place.
_WIDTH = 78


@contextmanager
def told(progress: Callable[[str], None] | bool | None) -> Iterator[Callable[[str], None]]:
    """Where sentences on what is going on are to go.

    Args:
        progress: a function of yours; True for one line on standard error; None for that line in a
            notebook only; False for nowhere.
    """
    if callable(progress):
        yield progress
        return
    if not (in_notebook() if progress is None else progress):
        yield lambda _: None
        return
    began, expected = time.monotonic(), Expected()

    def show(sentence: str) -> None:
        expected.hear(sentence)
        left = "" if expected.left_s is None else f" ({expected.left_s:.0f} s left or more)"
        _line(f"{time.monotonic() - began:4.0f} s  {sentence}{left}")

    try:
        yield show
    finally:
        _line("")


def by_count(tell: Callable[[str], None], what: str) -> Callable[[int, int], None]:
    """What is called with how much is done, and of how much, and says so with the time that is left."""
    pace = Pace()

    def at(done: int, of: int) -> None:
        pace.at(done / of)
        left = "" if pace.left_s is None else f", {pace.left_s:.0f} s left"
        tell(f"{what}: {done} of {of}, {100.0 * pace.share:.0f} %{left}")

    return at


def in_notebook() -> bool:
    """Whether a Jupyter kernel runs this."""
    shell = sys.modules.get("IPython")
    return shell is not None and getattr(shell.get_ipython(), "kernel", None) is not None


def _line(text: str) -> None:
    """The text in place of the one before."""
    sys.stderr.write(f"\r{text[:_WIDTH]:<{_WIDTH}}" + ("" if text else "\r"))
    sys.stderr.flush()
