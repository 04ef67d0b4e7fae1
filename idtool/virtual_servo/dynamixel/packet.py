"""Packets of DYNAMIXEL Protocol 2.0: FF FF FD 00, id, length, body, CRC-16.

The body is an instruction and its parameters. Where it holds FF FF FD, an FD is put in after it, so
that a header never occurs inside a packet; length and CRC count the stuffed body. Source: ROBOTIS
e-Manual, "DYNAMIXEL Protocol 2.0" and "CRC Calculation".
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from idtool.virtual_servo import decoder

HEADER = b"\xff\xff\xfd\x00"
BROADCAST = 0xFE
STATUS = 0x55

_PATTERN, _STUFFED = b"\xff\xff\xfd", b"\xff\xff\xfd\xfd"
#: Header, id and length; then at least an instruction and the CRC.
_PREFIX, _SHORTEST = 7, 3
#: A packet longer than this is noise that looks like a header.
LONGEST = 1024


def _crc_table() -> tuple[int, ...]:
    table = []
    for byte in range(256):
        crc = byte << 8
        for _ in range(8):
            crc = (crc << 1) ^ 0x8005 if crc & 0x8000 else crc << 1
        table.append(crc & 0xFFFF)
    return tuple(table)


_CRC = _crc_table()


def crc16(data: bytes) -> int:
    """CRC-16 (polynomial 0x8005, start 0, most significant bit first).

    >>> hex(crc16(bytes.fromhex("fffffd00010300 01")))
    '0x4e19'
    """
    crc = 0
    for byte in data:
        crc = ((crc << 8) & 0xFFFF) ^ _CRC[(crc >> 8) ^ byte]
    return crc


@dataclass(frozen=True)
class Packet:
    """One packet without its framing.

    Attributes:
        id: of the servo, 0 to 252, or BROADCAST.
        instruction: what to do, or STATUS for an answer.
        parameters: what follows it; in an answer the first byte is the error.
    """

    id: int
    instruction: int
    parameters: bytes = b""


@dataclass(frozen=True)
class Damaged:
    """A packet whose CRC is wrong.

    Attributes:
        id: whom it seems to be for.
    """

    id: int


def encode(packet: Packet) -> bytes:
    """The bytes on the wire.

    Raises:
        ValueError: longer than a packet may be.
    """
    body = (bytes([packet.instruction]) + packet.parameters).replace(_PATTERN, _STUFFED)
    if len(body) + 2 > LONGEST:
        raise ValueError(f"a packet of {len(body) + 2} bytes is longer than {LONGEST}")
    head = HEADER + struct.pack("<BH", packet.id, len(body) + 2) + body
    return head + struct.pack("<H", crc16(head))


class Decoder(decoder.Decoder):
    """Finds packets, damaged ones too."""

    header, prefix = HEADER, _PREFIX

    def _length(self) -> int | None:
        (length,) = struct.unpack_from("<H", self._buffer, len(HEADER) + 1)
        return length if _SHORTEST <= length <= LONGEST else None

    def _packet(self, whole: bytes) -> tuple[bool, Packet | Damaged]:
        whose = whole[len(HEADER)]
        if crc16(whole[:-2]) != int.from_bytes(whole[-2:], "little"):
            return False, Damaged(whose)
        body = whole[_PREFIX:-2].replace(_STUFFED, _PATTERN)
        return True, Packet(whose, body[0], body[1:])
