"""One entry of a servo's table, whoever made it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Entry:
    """One entry.

    Attributes:
        address, size: where, bytes.
        writable: RW, else R.
        initial: value after switching on.
        range: lowest and highest value that may be written, None for whatever fits.
    """

    address: int
    size: int
    writable: bool = True
    initial: int = 0
    range: tuple[int, int] | None = None
