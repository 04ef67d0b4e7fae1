"""What is going on, on one line of a notebook or a terminal."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from idtool.errors import InputError
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

    Raises:
        InputError: it is none of these.
    """
    if callable(progress):
        yield progress
        return
    if progress is not None and not isinstance(progress, bool):
        raise InputError(
            f"{type(progress).__name__} is no function", argument="progress", remedy="give one, or True"
        )
    if not (in_notebook() if progress is None else progress):
        yield lambda _: None
        return
    began, expected = time.monotonic(), Expected()

    def show(sentence: str) -> None:
        expected.hear(sentence)
        share = "" if expected.share is None else f"{100.0 * expected.share:.0f} %"
        known = [f"{time.monotonic() - began:4.0f} s", share, expected.words]
        _line(f"{', '.join(filter(None, known))}: {sentence}")

    try:
        yield show
    finally:
        _line("")


def by_count(tell: Callable[[str], None], what: str) -> Callable[[int, int], None]:
    """What is called with how much is done, and of how much, and says so with the time that is left."""
    pace = Pace()

    def at(done: int, of: int) -> None:
        pace.at(done / of)
        tell(", ".join(filter(None, (f"{what}: {done} of {of}", f"{100.0 * pace.share:.0f} %", pace.words))))

    return at


def in_notebook() -> bool:
    """Whether a Jupyter kernel runs this."""
    shell = sys.modules.get("IPython")
    return shell is not None and getattr(shell.get_ipython(), "kernel", None) is not None


def _line(text: str) -> None:
    """The text in place of the one before."""
    sys.stderr.write(f"\r{text[:_WIDTH]:<{_WIDTH}}" + ("" if text else "\r"))
    sys.stderr.flush()
