"""The loop's end of the live page: a pipe that is written to without ever waiting.

    with LiveView(Row.of(rig)) as view:
        print(view.address)
        view.show(time_s, position, effort, hand)      # from the loop; a microsecond or ten

The page is served by a process of its own (`idtool.live.server`), so that neither a slow browser nor
Python's lock can hold the loop up. Between the two stands the pipe's buffer and nothing else: when it is
full, rows are dropped and counted. A row that comes sooner than a screen can show it is not sent at all.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Self

from idtool.errors import RigFault
from idtool.live.row import Row

#: Started as a script: it imports nothing of this package.
_SERVER = Path(__file__).with_name("server.py")
#: Rows closer than this in the axis's own time are not sent, s.
_EVERY_S = 0.02
#: A server that does not end by then, once its input has, is ended, s.
_ANSWER_S = 2.0


class LiveView:
    """A running live page.

    Attributes:
        address: of the page, on this machine only.
        dropped: rows that found the pipe full.
    """

    def __init__(self, row: Row, *, port: int = 0) -> None:
        """Start the page.

        Args:
            row: what is shown.
            port: 0 takes a free one.

        Raises:
            RigFault: the port is taken.
        """
        self._row = row
        self._next = -math.inf
        self._last = -math.inf
        self.dropped = 0
        self._server = subprocess.Popen(
            [sys.executable, "-I", str(_SERVER), str(port), json.dumps(row.names)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,  # Ctrl-C is for the loop; the page ends when the pipe does
        )
        assert self._server.stdin is not None
        assert self._server.stdout is not None
        self.address = self._server.stdout.readline().decode().strip()
        self._pipe = self._server.stdin.fileno()
        os.set_blocking(self._pipe, False)
        if not self.address:
            self.close()
            raise RigFault(f"the live page cannot be served on port {port}; take another, or none.")

    def show(self, time_s: float, position: float, effort: float, hand: float = math.nan) -> None:
        """Send a row, or drop it; returns at once and raises nothing.

        Args:
            time_s: of the rig.
            position: rad (m).
            effort: A or V.
            hand: torque of the hand, N m (N); NaN where nobody knows it.
        """
        if self._last <= time_s < self._next:
            return
        self._last, self._next = time_s, time_s + _EVERY_S
        row = time_s, *self._row.values(position, effort, hand)
        line = json.dumps([None if value is None else round(value, 6) for value in row]) + "\n"
        try:
            os.write(self._pipe, line.encode())  # shorter than PIPE_BUF: all of it or nothing
        except OSError:  # full, or nobody is there any more
            self.dropped += 1

    def close(self) -> None:
        """End the page; a browser that shows it keeps what it has."""
        for stream in (self._server.stdin, self._server.stdout):
            if stream is not None:
                with suppress(OSError):
                    stream.close()
        try:
            self._server.wait(_ANSWER_S)
        except subprocess.TimeoutExpired:
            self._server.kill()
            self._server.wait()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
