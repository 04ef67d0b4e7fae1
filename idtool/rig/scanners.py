"""The vendors whose servos can be found, and the ports to look on."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from idtool.errors import RigFault
from idtool.rig.bus.scan import Scanner
from idtool.rig.dynamixel import bus as dynamixel
from idtool.rig.dynamixel import models as dynamixel_models
from idtool.rig.feetech import bus as feetech
from idtool.rig.feetech import models as feetech_models

#: Ids of Feetech servos that are asked; each that is not there costs a twentieth of a second.
IDS = range(0, 21)


def _dynamixel() -> Scanner:
    """One question to all; raises RigFault where the SDK is not installed, as the next one does."""
    sdk = dynamixel.vendor_sdk()
    handler = sdk.Protocol2PacketHandler()

    def who(port: Any) -> Iterator[tuple[int, int, str | None]]:
        answers, _ = handler.broadcastPing(port)
        for id, (number, _firmware) in sorted(answers.items()):
            model = dynamixel_models.MODELS.get(number)
            yield id, number, model.name if model else None

    return Scanner("dynamixel", sdk, dynamixel.BAUD_RATES, who)


def _feetech() -> Scanner:
    """One question to each id, since the answers to one to all would collide."""
    sdk = feetech.vendor_sdk()

    def who(port: Any) -> Iterator[tuple[int, int, str | None]]:
        handler = sdk.sms_sts(port)
        for id in IDS:
            number, result, _ = handler.ping(id)
            if result == sdk.COMM_SUCCESS:
                yield id, number, feetech_models.MODELS.get(number, f"model {number}")

    return Scanner("feetech", sdk, feetech.BAUD_RATES, who)


def scanners() -> list[Scanner]:
    """Those whose SDK is installed.

    Raises:
        RigFault: none is.
    """
    made: list[Scanner] = []
    missing: list[RigFault] = []
    for make in (_dynamixel, _feetech):
        try:
            made.append(make())
        except RigFault as fault:
            missing.append(fault)
    if not made:
        raise missing[0]
    return made


def ports() -> list[str]:
    """Serial ports that may lead to a bus.

    Raises:
        RigFault: no SDK is installed.
    """
    scanners()
    from serial.tools import list_ports

    # a port without a USB vendor is one of the mainboard, present or not
    return sorted(port.device for port in list_ports.comports() if port.vid is not None)
