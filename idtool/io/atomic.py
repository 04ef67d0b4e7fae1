"""Files that are written whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from idtool.errors import InputError, UsageError
from idtool.io.lock import refuse_held

if TYPE_CHECKING:
    import pandas as pd


def refuse_existing(path: Path, force: bool, *read: Path | None) -> None:
    """Raise unless `path` may be written: absent, or an ordinary file and `force` given; and none of what is
    `read` on the way.

    Raises:
        InputError: it is a folder, a device or "-", exists without `force`, is being written by another
            program, or its folder is missing.
        UsageError: it is one of `read`.
    """
    if str(path) == "-":
        raise InputError("is no file (--json prints the result)", file=path, remedy="name a file")
    try:
        if path.is_dir():
            raise InputError("is a folder where a file should be", file=path, remedy="name a file")
        if path.exists() and not path.is_file():
            raise InputError("is not an ordinary file", file=path, remedy="name another file")
        if path.exists():
            if any(one is not None and one.exists() and one.samefile(path) for one in read):
                raise UsageError(f"{path} is what is read here; name another file for what is written.")
            refuse_held(path)
        if path.exists() and not force:
            raise InputError("already exists", file=path, remedy="pass force=True to overwrite it")
        if not path.parent.is_dir():
            raise InputError(
                "its folder does not exist", file=path, remedy=f"make the folder {path.parent} first"
            )
    except OSError as error:  # a name that is too long, a folder that may not be entered
        raise cannot_write(path, error) from error


def cannot_write(path: Path, error: OSError) -> InputError:
    """The one sentence about a file that the system does not let us write."""
    return InputError(
        f"cannot be written ({error.strerror or error})", file=path, remedy="free space or pick another place"
    )


@contextmanager
def atomic_write(path: str | os.PathLike[str], mode: str = "w") -> Iterator[IO[Any]]:
    """Open a temporary file beside `path`; on success fsync it and rename it over `path`.

    On any exception the temporary file goes and `path` is as it was. A symbolic link stays one: the
    file it points to is replaced.

    Raises:
        InputError: the folder cannot be written or the disk is full.
    """
    target = Path(os.path.realpath(path))
    temporary = None
    try:
        encoding = None if "b" in mode else "utf-8"
        newline = None if "b" in mode else "\n"
        handle, temporary = tempfile.mkstemp(
            dir=target.parent, prefix=f".{target.name[:60]}.", suffix=".part"
        )
        with os.fdopen(handle, mode, encoding=encoding, newline=newline) as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        os.chmod(temporary, _permissions(target))
        os.replace(temporary, target)
        temporary = None
        _sync_folder(target.parent)
    except OSError as error:
        raise cannot_write(Path(path), error) from error
    finally:
        if temporary is not None:
            Path(temporary).unlink(missing_ok=True)


def write_whole(path: str | os.PathLike[str], content: str | bytes) -> None:
    """Write a file whole or not at all, see `atomic_write`."""
    with atomic_write(path, "w" if isinstance(content, str) else "wb") as stream:
        stream.write(content)


def write_table(path: Path, frame: pd.DataFrame) -> None:
    """A table as CSV, with nine digits."""
    with atomic_write(path) as stream:
        frame.to_csv(stream, index=False, lineterminator="\n", float_format="%.9g")


def _permissions(target: Path) -> int:
    """Those of the file that is replaced, else those that a new file gets."""
    with suppress(OSError):
        return target.stat().st_mode & 0o7777
    umask = os.umask(0)
    os.umask(umask)
    return 0o666 & ~umask


def _sync_folder(folder: Path) -> None:
    """Make the rename itself survive a power cut, where the system has folders that can be synced."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
