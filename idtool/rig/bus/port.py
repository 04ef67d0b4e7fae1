"""A serial port of a vendor's SDK, for this process alone."""

from __future__ import annotations

import errno
from importlib import import_module
from typing import Any

from idtool.errors import InputError, RigFault
from idtool.rig.faults import DeviceGone


def import_sdk(module: str, servo: str, extra: str) -> Any:
    """A vendor's SDK, which is an extra of this package.

    Args:
        module: its name.
        servo: what needs it, for the message.
        extra: of this package.

    Raises:
        RigFault: it is not installed.
    """
    try:
        return import_module(module)
    except ImportError as error:
        raise RigFault(
            f"{servo} needs the manufacturer's SDK; install it with: pip install 'ffc-id[{extra}]'"
        ) from error


def open_port(sdk: Any, device: str, baud: int, rates: tuple[int, ...]) -> Any:
    """An open port of the SDK.

    Args:
        sdk: the vendor's; both vendors' port handlers are of one descent.
        device: the port.
        baud: bits a second.
        rates: what to take instead, for the message.

    Raises:
        InputError: the SDK has no such baud rate.
        DeviceGone: the device cannot be opened, or another program has it.
    """
    port = sdk.PortHandler(device)
    try:
        known = port.setBaudRate(baud)
    except Exception as error:  # SerialException, or what the system says of the device
        raise DeviceGone(f"cannot open {device}: {_why_not(error)}") from error
    if not known:
        *most, last = sorted(rates)
        raise InputError(
            f"the SDK has no baud rate {baud}", remedy=f"take {', '.join(map(str, most))} or {last}"
        )
    try:
        port.ser.exclusive = True  # the SDK opens a port that another program has just as well
    except Exception as error:
        port.closePort()
        raise DeviceGone(f"{device} is in use by another program; end that first") from error
    return port


def _why_not(error: Exception) -> str:
    return {
        errno.EACCES: "no permission; add yourself to the group of the device (see docs/hardware.md)",
        errno.EPERM: "no permission; add yourself to the group of the device (see docs/hardware.md)",
        errno.EBUSY: "it is in use by another program; end that first",
        errno.ENOENT: "there is no such device; is the adapter plugged in?",
    }.get(getattr(error, "errno", None) or 0, "it is no serial port that answers; check the path")
