"""Packets of Feetech's protocol: FF FF, id, length, body, checksum.

The body is an instruction and its parameters, or in an answer the error byte and data; the length counts the
body and the checksum, which is the complement of the sum of all from the id on. Source: Feetech, "SCS
protocol manual".
"""

from __future__ import annotations

from dataclasses import dataclass

from idtool.virtual_servo import decoder

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


class Decoder(decoder.Decoder):
    """Finds packets; damaged ones are nobody's."""

    header, prefix = HEADER, _PREFIX

    def _length(self) -> int | None:
        # a third FF belongs to a longer run of them, and no id is that high
        whose, length = self._buffer[2:_PREFIX]
        return length if whose != 0xFF and _SHORTEST <= length <= _LONGEST else None

    def _packet(self, whole: bytes) -> tuple[bool, Packet | None]:
        if checksum(whole[2:-1]) != whole[-1]:
            return False, None
        return True, Packet(whole[2], whole[4], whole[5:-1])
