"""Packets of Feetech's protocol: FF FF, id, length, body, checksum.

The body is an instruction and its parameters, or in an answer the error byte and data; the length counts the
body and the checksum, which is the complement of the sum of all from the id on. Source: Feetech, "SCS
protocol manual".
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

HEADER = b"\xff\xff"
BROADCAST = 0xFE
#: Header, id and length; then at least an instruction and the checksum.
_PREFIX, _SHORTEST, _LONGEST = 4, 2, 250


@dataclass(frozen=True)
class Packet:
    """One packet without its framing.

    Attributes:
        id: of the servo, 0 to 253, or BROADCAST.
        code: what to do; in an answer the error byte.
        parameters: what follows it.
    """

    id: int
    code: int
    parameters: bytes = b""


def checksum(data: bytes) -> int:
    """The complement of the sum of all bytes, of those from the id on.

    >>> hex(checksum(bytes.fromhex("010201")))
    '0xfb'
    """
    return ~sum(data) & 0xFF


def encode(packet: Packet) -> bytes:
    """The bytes on the wire."""
    body = bytes([packet.id, len(packet.parameters) + 2, packet.code]) + packet.parameters
    return HEADER + body + bytes([checksum(body)])


class Decoder:
    """Finds packets in a stream of bytes, whatever stands between them; damaged ones are nobody's."""

    def __init__(self) -> None:
        self._buffer = b""

    def feed(self, data: bytes) -> Iterator[Packet]:
        """Packets that these bytes complete, in order."""
        self._buffer += data
        while True:
            start = self._buffer.find(HEADER)
            if start < 0:
                self._buffer = self._buffer[-1:]  # a header may be arriving
                return
            self._buffer = self._buffer[start:]
            if len(self._buffer) < _PREFIX:
                return
            length = self._buffer[3]
            # a third FF belongs to a longer run of them, and no id is that high
            if self._buffer[2] == 0xFF or not _SHORTEST <= length <= _LONGEST:
                self._buffer = self._buffer[1:]
                continue
            end = _PREFIX + length
            if len(self._buffer) < end:
                return
            whole = self._buffer[:end]
            if checksum(whole[2:-1]) != whole[-1]:
                # its length may be what is wrong, and a good packet may begin inside it
                self._buffer = self._buffer[1:]
                continue
            self._buffer = self._buffer[end:]
            yield Packet(whole[2], whole[4], whole[5:-1])
