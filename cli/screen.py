"""Where a person reads: as wide as the terminal; plain text where it is none."""

from __future__ import annotations

import os
import shutil
import sys
import textwrap
from typing import IO

import click

#: Columns of a table that another program reads: wider than any row is.
_PIPED_WIDTH = 1000


class Screen:
    """Standard output, or a file in its place.

    Attributes:
        width: columns; COLUMNS is respected. Nobody folds what another program reads.
    """

    def __init__(self, width: int | None = None, file: IO[str] | None = None) -> None:
        self._file = file
        terminal = sys.stdout.isatty() and file is None
        told = terminal or os.environ.get("COLUMNS")
        self.width = width or (shutil.get_terminal_size().columns if told else _PIPED_WIDTH)
        self._bold = terminal and os.environ.get("TERM") != "dumb"

    def print(self, text: str, *, bold: bool = False, folded: bool = True, indent: int = 0) -> None:
        """Lines of text, each folded between words where it is too long; what is folded is indented."""
        for line in text.split("\n"):
            shown = line
            if folded and len(line) > self.width:
                shown = textwrap.fill(
                    line,
                    self.width,
                    subsequent_indent=" " * indent,
                    break_long_words=False,
                    break_on_hyphens=False,
                )
            if bold and self._bold:
                click.echo(click.style(shown, bold=True))
            else:  # click would write UTF-8 where a terminal knows ASCII only
                print(shown, file=self._file, flush=True)
