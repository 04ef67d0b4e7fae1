"""Find the servos of a vendor on a serial port, at the usual baud rates."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from idtool.errors import RigFault
from idtool.rig.bus.port import open_port

#: Asks one open port who is there: id, model number and name of each, None for one that this package cannot
#: drive.
Who = Callable[[Any], Iterator[tuple[int, int, str | None]]]


@dataclass(frozen=True)
class Found:
    """A servo on a port.

    Attributes:
        kind: the word before the colon of a rig.
        device, baud, id: where.
        model_number: what it says it is.
        model: its name; None for one that this package cannot drive.
    """

    kind: str
    device: str
    baud: int
    id: int
    model_number: int
    model: str | None

    @property
    def spec(self) -> str:
        """What to pass as `--rig`."""
        return f"{self.kind}:{self.device},id={self.id},baud={self.baud}"


@dataclass(frozen=True)
class Scanner:
    """How to find the servos of one vendor.

    Attributes:
        kind: the word before the colon of a rig.
        sdk: the vendor's.
        baud_rates: that the servos come with or are set to.
        who: asks a port.
    """

    kind: str
    sdk: Any
    baud_rates: tuple[int, ...]
    who: Who


def scan(
    device: str, scanner: Scanner, *, progress: Callable[[str], None] | None = None
) -> Iterator[Found | RigFault]:
    """Ask on one device at every rate who is there.

    Args:
        device: port.
        scanner: of which vendor.
        progress: told what is being asked.

    Yields:
        What answered, and a fault where the device cannot be opened or disappears.
    """
    try:
        port = open_port(scanner.sdk, device, scanner.baud_rates[0], scanner.baud_rates)
    except RigFault as fault:
        yield fault
        return
    try:
        for baud in scanner.baud_rates:
            if progress is not None:
                progress(f"{device} at {baud} baud for {scanner.kind}")
            port.setBaudRate(baud)
            for id, number, name in scanner.who(port):
                yield Found(scanner.kind, device, baud, id, number, name)
    except OSError as error:
        yield RigFault(f"{device} has disappeared ({error}); plug the adapter in and scan again")
    finally:
        port.closePort()
