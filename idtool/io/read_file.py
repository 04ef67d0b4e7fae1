"""The bytes of a file that a user named, gzipped or not, whatever state the file is in."""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator
from pathlib import Path

from idtool.errors import InputError

#: The largest file that is read, in bytes once unpacked; an hour at 1 kHz is about a third of it.
MAX_BYTES = 1 << 30
#: The longest first line that is read; a longer one is no table (and would eat the memory).
MAX_LINE = 1 << 20
#: Bytes that are unpacked at a time, and how a gzip file begins (RFC 1952).
_CHUNK = 1 << 20
_GZIP = b"\x1f\x8b"


def read_bytes(
    path: str | os.PathLike[str], *, what: str, text: bool = False, limit: int = MAX_BYTES
) -> tuple[bytes, bool]:
    """The content of a file, unpacked if it is gzipped, and whether its gzip stream was cut short.

    Args:
        path: the file; a pipe is read to its end.
        what: what the file should be ("a log"), for messages.
        text: it must be lines of text; stop at a line of over 1 MiB.
        limit: the most bytes taken.

    Raises:
        InputError: no such file, a folder, not readable, over the limit, a damaged gzip stream.
    """
    file = Path(path)
    try:
        with open(file, "rb") as stream:
            first = stream.read(_CHUNK)
            packed = first[:2] == _GZIP
            chunks: list[bytes] = []
            total = 0
            lines = _Lines(file, what)
            unpacker = _Unpacker(file)
            while first:
                for chunk in unpacker.feed(first) if packed else (first,):
                    chunks.append(chunk)
                    total += len(chunk)
                    if total > limit:
                        raise InputError(
                            f"holds over {_size(limit)}, too much for {what}",
                            file=file,
                            remedy="split it into parts",
                        )
                    if text:
                        lines.pass_on(chunk)
                first = stream.read(_CHUNK)
    except FileNotFoundError as error:
        raise InputError("no such file", file=file, remedy="check the path") from error
    except IsADirectoryError as error:
        raise InputError(
            f"is a folder where {what} should be", file=file, remedy="name the file in it"
        ) from error
    except PermissionError as error:
        raise InputError("may not be read", file=file, remedy="check its permissions") from error
    except OSError as error:
        raise InputError(
            f"cannot be read ({error.strerror or error})", file=file, remedy="check the path and the disk"
        ) from error
    except ValueError as error:  # a null character in the path
        raise InputError("is no path of a file", file=repr(str(file)), remedy="check the path") from error
    return b"".join(chunks), packed and not unpacker.whole


class _Lines:
    """Stops before a huge line, such as a disk image in a log, fills the memory."""

    def __init__(self, file: Path, what: str) -> None:
        self._file, self._what = file, what
        self._read = self._begun = 0

    def pass_on(self, chunk: bytes) -> None:
        """Look at the next bytes."""
        first = min((at for at in (chunk.find(b"\n"), chunk.find(b"\r")) if at >= 0), default=len(chunk))
        if self._read + first - self._begun >= MAX_LINE:
            where = "first line" if self._begun == 0 else f"line at byte {self._begun}"
            raise InputError(
                f"its {where} is over 1 MiB, so it is not {self._what}",
                file=self._file,
                remedy="check the path",
            )
        last = max(chunk.rfind(b"\n"), chunk.rfind(b"\r"))
        if last >= 0:
            self._begun = self._read + last + 1
        self._read += len(chunk)


def _size(count: int) -> str:
    return f"{count >> 30} GiB" if count >> 30 else f"{count >> 20} MiB" if count >> 20 else f"{count} bytes"


class _Unpacker:
    """Unpack gzip members one after the other; `gzip` itself loses what precedes a cut."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._member = zlib.decompressobj(wbits=31)

    @property
    def whole(self) -> bool:
        """Whether the last member came to its end."""
        return self._member.eof

    def feed(self, data: bytes) -> Iterator[bytes]:
        try:
            while data:
                if self._member.eof:
                    data = data.lstrip(b"\0")  # a power cut pads files with zeros
                    if not data:
                        return
                    self._member = zlib.decompressobj(wbits=31)
                chunk = self._member.decompress(data, _CHUNK)
                if chunk:
                    yield chunk
                data = self._member.unused_data if self._member.eof else self._member.unconsumed_tail
        except zlib.error as error:
            raise InputError(
                "is gzipped but damaged", file=self._file, remedy="copy it again from where it was recorded"
            ) from error
