"""Keys of the terminal on standard input, as they come."""

from __future__ import annotations

import os
import select
import sys
from contextlib import suppress
from typing import Any, Self, final

from idtool.errors import InputError


@final
class TerminalKeys:
    """What is typed, without waiting for Enter. As a context it gives the terminal back as it was.

    Args:
        place: the option that wants keys.
        remedy: what to do where there is no terminal.

    Attributes:
        gone: the terminal was closed: no key comes any more.

    Raises:
        InputError: standard input is no terminal.
    """

    def __init__(self, place: str, remedy: str) -> None:
        if not sys.stdin.isatty():
            raise InputError(
                "standard input is no terminal, so no key can be read", place=place, remedy=remedy
            )
        import termios
        import tty

        self.gone = False
        self._file = sys.stdin.fileno()
        self._before: list[Any] = termios.tcgetattr(self._file)
        tty.setcbreak(self._file)

    def read(self) -> bytes:
        """What was typed since the last call; it does not wait."""
        typed = b""
        while not self.gone and select.select([self._file], [], [], 0.0)[0]:
            part = os.read(self._file, 64)
            self.gone = not part
            typed += part
        return typed

    def close(self) -> None:
        """Give the terminal back."""
        import termios

        with suppress(termios.error):
            termios.tcsetattr(self._file, termios.TCSADRAIN, self._before)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
