"""Packets in a stream of bytes, whatever stands between them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Any, ClassVar


class Decoder(ABC):
    """Finds the packets of a protocol.

    Attributes:
        header: with which each begins.
        prefix: bytes up to its length, that included.
    """

    header: ClassVar[bytes]
    prefix: ClassVar[int]

    def __init__(self) -> None:
        self._buffer = b""

    @abstractmethod
    def _length(self) -> int | None:
        """Bytes that follow the prefix at the start of the buffer; None where no packet begins so."""

    @abstractmethod
    def _packet(self, whole: bytes) -> tuple[bool, Any]:
        """Whether these bytes are undamaged, and what is told of them; None: nothing."""

    def feed(self, data: bytes) -> Iterator[Any]:
        """Packets that these bytes complete, in order."""
        self._buffer += data
        while (start := self._buffer.find(self.header)) >= 0:
            self._buffer = self._buffer[start:]
            if len(self._buffer) < self.prefix:
                return
            length = self._length()
            if length is None:
                self._buffer = self._buffer[1:]
                continue
            whole = self._buffer[: self.prefix + length]
            if len(whole) < self.prefix + length:
                return
            good, packet = self._packet(whole)
            # of a damaged one the length may be what is wrong, and a good packet may begin inside it
            self._buffer = self._buffer[len(whole) if good else 1 :]
            if packet is not None:
                yield packet
        self._buffer = self._buffer[-(len(self.header) - 1) :]  # a header may be arriving
