"""Advisory locks of the operating system: one writer at a time, and none left behind by a killed one.

The lock belongs to the open file, so it ends with the process that holds it, however that ends. Where a file
system has no locks (some network shares), nothing is refused.
"""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from idtool.errors import InputError

if sys.platform == "win32":
    import msvcrt

    #: Far behind the content: a locked byte cannot be read on this system.
    _BYTE = 0x7FFF0000

    def _take(handle: int) -> None:
        position = os.lseek(handle, 0, os.SEEK_CUR)
        os.lseek(handle, _BYTE, os.SEEK_SET)
        try:
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        finally:
            os.lseek(handle, position, os.SEEK_SET)

    _HELD = (errno.EACCES, errno.EDEADLOCK)
    #: A folder cannot be opened there; a file in it stands for it.
    _IN_FOLDER = ".ffc-id.lock"
else:
    import fcntl

    def _take(handle: int) -> None:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)

    _HELD = (errno.EWOULDBLOCK, errno.EACCES)
    _IN_FOLDER = ""


def hold(handle: int, path: Path) -> None:
    """Lock an open file until it is closed.

    Raises:
        InputError: another program, or another part of this one, holds it.
    """
    try:
        _take(handle)
    except OSError as error:
        if error.errno in _HELD:
            raise _busy(path) from error


def refuse_held(path: Path) -> None:
    """Raise if somebody is writing this file.

    Raises:
        InputError: so it is.
    """
    with suppress(OSError):
        handle = os.open(path, os.O_RDWR)
        try:
            hold(handle, path)
        finally:
            os.close(handle)


@contextmanager
def held_folder(folder: Path) -> Iterator[None]:
    """Lock a folder that exists, until the end.

    Raises:
        InputError: another program writes into it.
    """
    try:
        if _IN_FOLDER:
            handle = os.open(folder / _IN_FOLDER, os.O_RDWR | os.O_CREAT)
        else:
            handle = os.open(folder, os.O_RDONLY)
    except OSError:  # not to be opened, so not to be written either: said where that is tried
        yield
        return
    try:
        hold(handle, folder)
        yield
    finally:
        os.close(handle)
        if _IN_FOLDER:
            with suppress(OSError):
                os.unlink(folder / _IN_FOLDER)


def _busy(path: Path) -> InputError:
    return InputError(
        "is being written by another program",
        file=path,
        remedy="wait for it to end, or name another place (--force does not help)",
    )
