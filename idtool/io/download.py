"""A file of the network, whole or not at all; what was cut short is gone on with."""

from __future__ import annotations

import hashlib
import http.client
import urllib.error
import urllib.request
from collections.abc import Callable
from pathlib import Path

from idtool.errors import InputError
from idtool.io.atomic import cannot_write

#: Bytes that are asked for at a time.
_PIECE = 1 << 16
#: A server that says nothing for so long is gone, s.
_TIMEOUT_S = 30.0
#: No recording of one axis comes near.
_LARGEST = 1 << 30
#: HTTP's status of a part (RFC 9110).
_PARTIAL = 206
_RESUME = "check the network; the same command goes on where this one stopped"


def download(
    url: str, path: Path, *, sha256: str | None = None, progress: Callable[[int, int], None] | None = None
) -> str:
    """Fetch a file; what an earlier attempt left in `PATH.part` is gone on with where the server can.

    Args:
        url: http or https.
        path: where it goes once it is whole.
        sha256: what it must be, hexadecimal; None where nobody has said.
        progress: called with the bytes that are there and those of the whole file (0 if not told).

    Returns:
        The SHA-256 of the file, hexadecimal.

    Raises:
        InputError: no connection, no such file there, too large, not what `sha256` says, or no room.
    """
    if not url.startswith(("http://", "https://")):
        raise InputError("is no http address", file=url, remedy="correct the catalogue")
    part = path.with_name(f"{path.name}.part")
    try:
        _fetch(url, part, progress)
        found = hashlib.sha256(part.read_bytes()).hexdigest()
        if sha256 is not None and found != sha256:
            part.unlink()
            raise InputError(
                f"is not the file that was expected (SHA-256 {found[:12]}..., expected {sha256[:12]}...)",
                file=url,
                remedy="fetch it again; if that does not help, it was changed at its source",
            )
        part.replace(path)
    except urllib.error.HTTPError as error:
        raise InputError(
            f"the server answers {error.code} {error.reason}", file=url, remedy="see whether the source moved"
        ) from error
    except (urllib.error.URLError, http.client.HTTPException, TimeoutError, ConnectionError) as error:
        reason = getattr(error, "reason", None) or error
        raise InputError(f"cannot be fetched ({reason})", file=url, remedy=_RESUME) from error
    except OSError as error:
        raise cannot_write(path, error) from error
    return found


def _fetch(url: str, part: Path, progress: Callable[[int, int], None] | None) -> None:
    there = part.stat().st_size if part.exists() else 0
    request = urllib.request.Request(url, headers={"Range": f"bytes={there}-"} if there else {})
    try:
        answer = urllib.request.urlopen(request, timeout=_TIMEOUT_S)
    except urllib.error.HTTPError as error:
        if not there or error.code != http.HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE:
            raise
        if error.headers.get("Content-Range") != f"bytes */{there}":  # RFC 9110: the whole file's length
            part.unlink()  # what is there is of another file
            _fetch(url, part, progress)
        return
    with answer:
        if answer.status != _PARTIAL:
            there = 0  # this server cannot go on: from the start
        length = int(answer.headers.get("Content-Length") or 0)
        total = there + length if length else 0
        with open(part, "ab" if there else "wb") as stream:
            while piece := answer.read(_PIECE):
                stream.write(piece)
                there += len(piece)
                if there > _LARGEST:
                    raise InputError("is over 1 GiB, no recording", file=url, remedy="correct the catalogue")
                if progress is not None:
                    progress(there, total)
    if total and there < total:
        raise ConnectionError(f"it ended after {there} of {total} bytes")
