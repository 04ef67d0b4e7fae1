"""A program in a pseudo-terminal: keys go in, what a person would see comes out."""

from __future__ import annotations

import fcntl
import os
import pty
import select
import signal
import struct
import termios
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType


class Terminal:
    """A program that runs in a pseudo-terminal of so many columns.

    Attributes:
        seen: everything that it printed so far.
    """

    def __init__(
        self,
        command: Sequence[str | Path],
        *,
        columns: int = 80,
        cwd: Path | None = None,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        self.seen = ""
        self.pid, self._fd = pty.fork()
        if self.pid == 0:
            try:
                os.chdir(cwd or ".")
                # the size is set before anything looks at it
                fcntl.ioctl(0, termios.TIOCSWINSZ, struct.pack("HHHH", 40, columns, 0, 0))
                names = ("COLUMNS", "LINES", "NO_COLOR", "FORCE_COLOR", "TTY_COMPATIBLE")
                inherited = {key: value for key, value in os.environ.items() if key not in names}
                arguments = [str(word) for word in command]
                os.execvpe(
                    arguments[0], arguments, {**inherited, "TERM": "xterm-256color", **(environment or {})}
                )
            finally:
                os._exit(127)

    def __enter__(self) -> Terminal:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            os.kill(self.pid, signal.SIGKILL)
            os.waitpid(self.pid, 0)
        except (ProcessLookupError, ChildProcessError):
            pass
        os.close(self._fd)

    def send(self, keys: str) -> None:
        """Type."""
        os.write(self._fd, keys.encode())

    def until(self, text: str, timeout: float = 60.0) -> str:
        """Read until `text` appears; what came up to then."""
        start = len(self.seen)
        end = time.monotonic() + timeout
        while text not in self.seen[start:]:
            if not self._read(end - time.monotonic()):
                raise AssertionError(f"{text!r} did not appear in {self.seen[start:]!r}")
        return self.seen[start:]

    def finish(self, timeout: float = 60.0) -> int:
        """Read to the end; the exit code."""
        end = time.monotonic() + timeout
        while self._read(end - time.monotonic()):
            pass
        code = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
        return code

    def _read(self, seconds: float) -> bool:
        """Read what is there; False at the end, or when nothing came in time."""
        if seconds <= 0 or not select.select([self._fd], [], [], seconds)[0]:
            return False
        try:
            part = os.read(self._fd, 65536)
        except OSError:  # Linux says so when the program has ended
            return False
        self.seen += part.decode("utf-8", "replace")
        return bool(part)
