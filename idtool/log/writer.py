"""Append rows to a log while an experiment runs, so that a crash loses nothing."""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any, Self

import numpy as np

from idtool.errors import InputError
from idtool.io.atomic import cannot_write, refuse_existing
from idtool.io.lock import hold
from idtool.log.format import columns_of, header_text
from idtool.parameters.axis import Axis

#: Rows are forced onto the disk so often, s of log time.
_SYNC_S = 1.0


class LogWriter:
    """Append rows to a log while an experiment runs.

    Every `append` hands whole rows to the operating system; after every second of log time
    they are forced onto the disk in the background, and on close. A process that is killed loses
    nothing it appended; a power cut loses at most the seconds since the last sync.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        columns: Sequence[str],
        axis: Axis,
        experiment: str,
        header: Mapping[str, Any] | None = None,
        *,
        force: bool = False,
        keep_rows: int | None = None,
    ) -> None:
        """Create the file and write its header, or go on with an existing one.

        Args:
            path: the file.
            columns: names, in the order of the rows.
            axis, experiment, header: what its TOML lines say.
            force: overwrite an existing file.
            keep_rows: go on with the log that is there, after this many of its rows; what follows
                them is cut off.

        Raises:
            InputError: `path` exists and `force` is not given, cannot be written, is being written by
                another program, or is to be gone on with but begins otherwise.
        """
        self.path = Path(path)
        self.columns = list(columns)
        known = set(columns_of(axis.kind).values())
        self._known = [index for index, name in enumerate(self.columns) if name in known]
        self._time_column = self.columns.index("time_s")
        self._synced_at = -float("inf")
        self._pool = ThreadPoolExecutor(1)
        self._syncing: Future[None] | None = None
        self._written = 0
        self._rows = keep_rows or 0
        text = header_text(axis, experiment, header or {}) + ",".join(self.columns) + "\n"
        refuse_existing(self.path, force or keep_rows is not None)
        try:
            # Unbuffered: what `append` was given is the operating system's when it returns. Not emptied
            # before it is ours alone.
            handle = os.open(self.path, os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0), 0o666)
            self._stream = os.fdopen(handle, "r+b", buffering=0)
        except OSError as error:
            raise cannot_write(self.path, error) from error
        try:
            hold(self._stream.fileno(), self.path)
            if keep_rows is None:
                self._stream.truncate(0)
        except (InputError, OSError):
            self._pool.shutdown()
            self._stream.close()
            raise
        if keep_rows is not None:
            self._go_on(text.encode(), keep_rows)
            return
        try:
            self._put(text)
            self.sync()
        except InputError:
            self._stream.close()
            self.path.unlink(missing_ok=True)
            raise

    def _go_on(self, text: bytes, rows: int) -> None:
        """Stand behind the first `rows` rows of the file."""
        there = self._stream.read() or b""
        end = len(text)
        for _ in range(rows):
            end = there.find(b"\n", end) + 1 or len(there)
        if not there.startswith(text):
            self._stream.close()
            raise InputError(
                "was made by another recipe, rig or version",
                file=self.path,
                remedy="name another file, or pass force=True to overwrite it",
            )
        self._stream.truncate(end)
        self._stream.seek(end)
        self._written = end

    def append(self, rows: np.ndarray) -> None:
        """Append rows, shape (rows, columns), in the order of `columns`.

        Raises:
            InputError: a column with a meaning holds a number that is not finite, the disk is full or
                the file went away; no part of these rows is written then, and those before stay.
        """
        if len(rows) == 0:
            return
        finite = np.isfinite(rows[:, self._known])
        if not finite.all():
            column = self.columns[self._known[int(np.argmin(finite.all(axis=0)))]]
            raise InputError(
                f'column "{column}" was given a number that is not finite',
                file=self.path,
                remedy="check the sensor behind it",
            )
        self._put("".join([",".join([_number(value) for value in row]) + "\n" for row in rows.tolist()]))
        self._rows += len(rows)
        if rows[-1, self._time_column] - self._synced_at >= _SYNC_S:
            self._sync_soon()
            self._synced_at = float(rows[-1, self._time_column])

    def sync(self) -> None:
        """Force what was appended onto the disk.

        Raises:
            InputError: the disk is full or the file went away.
        """
        try:
            os.fsync(self._stream.fileno())
        except OSError as error:
            raise cannot_write(self.path, error) from error
        if not self._still_there():
            self._rescue()

    def _sync_soon(self) -> None:
        """Sync in the background: a slow disk takes longer than an axis in motion can wait."""
        if not self._still_there():
            self._rescue()
        if self._syncing is not None:
            if not self._syncing.done():
                return
            self._end_of_sync()
        self._syncing = self._pool.submit(os.fsync, self._stream.fileno())

    def _end_of_sync(self) -> None:
        """Wait for the sync in the background, and raise what it met."""
        if self._syncing is None:
            return
        error = self._syncing.exception()
        self._syncing = None
        if isinstance(error, OSError):
            raise cannot_write(self.path, error) from error

    def _still_there(self) -> bool:
        """Whether the name still leads to the file that is being written."""
        with suppress(OSError):
            return os.path.samestat(os.stat(self.path), os.fstat(self._stream.fileno()))
        return False

    def _rescue(self) -> None:
        """The file was removed or replaced: save what it holds under another name and say so."""
        self._stream.seek(0)
        content = self._stream.read() or b""
        self._pool.shutdown()
        self._stream.close()
        for folder in (self.path.parent, Path(tempfile.gettempdir())):
            with suppress(OSError):
                handle, name = tempfile.mkstemp(
                    dir=folder, prefix=f"{self.path.stem}-", suffix=self.path.suffix
                )
                with os.fdopen(handle, "wb") as stream:
                    stream.write(content)
                raise InputError(
                    "was removed or replaced while it was written",
                    file=self.path,
                    remedy=f"what it held is in {name}",
                )
        raise InputError(
            "was removed while it was written and cannot be written again",
            file=self.path,
            remedy="pick another place",
        )

    def close(self) -> None:
        """Sync and close; safe to call twice."""
        if not self._stream.closed:
            try:
                self._end_of_sync()
                self.sync()
            finally:
                self._pool.shutdown()
                self._stream.close()

    def discard(self) -> None:
        """Close and remove the file."""
        self._pool.shutdown()
        self._stream.close()
        with suppress(OSError):
            self.path.unlink(missing_ok=True)

    def _put(self, text: str) -> None:
        """Write all of it or none of it, so that the file always ends with a whole row."""
        data = memoryview(text.encode())
        try:
            done = 0
            while done < len(data):
                done += self._stream.write(data[done:]) or 0
        except OSError as error:
            with suppress(OSError):
                self._stream.truncate(self._written)
                self._stream.seek(self._written)
            if not self._rows:
                raise cannot_write(self.path, error) from error
            raise InputError(
                f"can no longer be written ({error.strerror or error})",
                file=self.path,
                remedy=f"its {self._rows} rows up to there are kept; free space or pick another place",
            ) from error
        self._written += len(data)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _number(value: float) -> str:
    """The shortest text that reads back as the same number; an empty field where there is none."""
    if not math.isfinite(value):
        return ""
    text = repr(value)
    return text.removesuffix(".0") if text != "-0.0" else text  # "-0" would come back as a whole number, 0
