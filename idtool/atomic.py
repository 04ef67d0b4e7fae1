"""Files that are written whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from idtool.errors import InputError


def refuse_existing(path: Path, force: bool) -> None:
    """Raise unless `path` may be written: absent, or a file and `force` given.

    Raises:
        InputError: it is a folder, exists without `force`, or its folder is missing.
    """
    if path.is_dir():
        raise InputError("is a folder where a file should be", file=path, remedy="name a file")
    if path.exists() and not force:
        raise InputError("already exists", file=path, remedy="pass --force to overwrite it")
    if not path.parent.is_dir():
        raise InputError(
            "its folder does not exist", file=path, remedy=f"make the folder {path.parent} first"
        )


@contextmanager
def atomic_write(path: str | os.PathLike[str], mode: str = "w") -> Iterator[IO[str]]:
    """Open a temporary file beside `path`; on success fsync it and rename it over `path`.

    On any exception the temporary file goes and `path` is as it was.

    Raises:
        InputError: the folder cannot be written or the disk is full.
    """
    target = Path(path)
    temporary = None
    try:
        encoding = None if "b" in mode else "utf-8"
        newline = None if "b" in mode else "\n"
        handle, temporary = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.", suffix=".part")
        with os.fdopen(handle, mode, encoding=encoding, newline=newline) as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(temporary, 0o666 & ~umask)
        os.replace(temporary, target)
        temporary = None
    except OSError as error:
        raise InputError(
            f"cannot be written ({error.strerror or error})", file=target, remedy="free space or pick another place"
        ) from error
    finally:
        if temporary is not None:
            Path(temporary).unlink(missing_ok=True)
