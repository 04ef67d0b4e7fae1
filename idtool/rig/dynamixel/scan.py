"""Find servos: every serial port, at every usual baud rate."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from idtool.errors import RigFault
from idtool.rig.dynamixel.bus import import_sdk, open_port
from idtool.rig.dynamixel.models import MODELS

#: Baud rates that the servos come with or are set to.
BAUD_RATES = (57600, 1_000_000, 115200, 2_000_000, 3_000_000, 4_000_000)


@dataclass(frozen=True)
class Found:
    """A servo on a port.

    Attributes:
        device, baud, id: where.
        model_number: what it says it is.
    """

    device: str
    baud: int
    id: int
    model_number: int

    @property
    def model(self) -> str | None:
        """Its name; None for one that this package cannot drive."""
        return MODELS[self.model_number].name if self.model_number in MODELS else None

    @property
    def spec(self) -> str:
        """What to pass as `--rig`."""
        return f"dynamixel:{self.device},id={self.id},baud={self.baud}"


def ports() -> list[str]:
    """Serial ports that may lead to a bus.

    Raises:
        RigFault: the SDK is not installed.
    """
    import_sdk()
    from serial.tools import list_ports

    # a port without a USB vendor is one of the mainboard, present or not
    return sorted(port.device for port in list_ports.comports() if port.vid is not None)


def scan(
    devices: Iterable[str],
    *,
    baud_rates: Iterable[int] | None = None,
    progress: Callable[[str], None] | None = None,
) -> Iterator[Found | RigFault]:
    """Ask on every device at every rate who is there.

    Args:
        devices: ports.
        baud_rates: bits a second; None is the usual ones.
        progress: told what is being asked.

    Yields:
        What answered, and a fault for each device that cannot be opened.
    """
    sdk = import_sdk()
    handler = sdk.Protocol2PacketHandler()
    for device in devices:
        try:
            port = open_port(sdk, device, BAUD_RATES[0])
        except RigFault as fault:
            yield fault
            continue
        try:
            for baud in baud_rates or BAUD_RATES:
                if progress is not None:
                    progress(f"{device} at {baud} baud")
                port.setBaudRate(baud)
                answers, _ = handler.broadcastPing(port)
                for id, (model, _firmware) in sorted(answers.items()):
                    yield Found(device, baud, id, model)
        except OSError as error:
            yield RigFault(f"{device} has disappeared ({error}); plug the adapter in and scan again")
        finally:
            port.closePort()
