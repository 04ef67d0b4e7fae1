"""Rows for PlotJuggler's UDP server, or for any program that takes JSON datagrams.

    with UdpStream(Row.of(rig), ("127.0.0.1", 9870)) as stream:
        stream.show(time_s, position, effort, hand)      # from the loop; ten microseconds

A datagram holds one row, as `{"timestamp": 1.25, "position_rad": 0.3, "current_a": 0.1, ...}`. One that
nobody receives is lost, and the loop does not wait for it.
"""

from __future__ import annotations

import json
import math
import socket
from contextlib import suppress
from typing import Self

from idtool.errors import RigFault
from idtool.live.row import Row


class UdpStream:
    """Sends each row that it is shown."""

    def __init__(self, row: Row, to: tuple[str, int]) -> None:
        """Open the socket.

        Args:
            row: what is sent.
            to: host and port.

        Raises:
            RigFault: no such host.
        """
        self._row = row
        self._keys = row.keys
        try:
            family, _, _, _, address = socket.getaddrinfo(*to, type=socket.SOCK_DGRAM)[0]
        except OSError as error:
            raise RigFault(f"rows cannot be sent to {to[0]}: no such host; take 127.0.0.1.") from error
        self._to = address
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)

    def show(self, time_s: float, position: float, effort: float, hand: float = math.nan) -> None:
        """Send a row, without what is not known (NaN); returns at once and raises nothing.

        Args:
            time_s: of the rig.
            position: rad (m).
            effort: A or V.
            hand: torque of the hand, N m (N).
        """
        named = zip(self._keys, self._row.values(position, effort, hand), strict=True)
        line = json.dumps({"timestamp": time_s} | {key: value for key, value in named if value is not None})
        with suppress(OSError):
            self._socket.sendto(line.encode(), self._to)

    def close(self) -> None:
        """Send nothing more."""
        self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
