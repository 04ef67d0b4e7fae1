"""The vendors whose servos can be found, and the ports to look on."""

from __future__ import annotations

from idtool.errors import RigFault
from idtool.rig.bus.scan import Scanner
from idtool.rig.dynamixel.scan import dynamixel_scanner
from idtool.rig.feetech.scan import feetech_scanner


def scanners() -> list[Scanner]:
    """Those whose SDK is installed.

    Raises:
        RigFault: none is.
    """
    made: list[Scanner] = []
    missing: list[RigFault] = []
    for make in (dynamixel_scanner, feetech_scanner):
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
