"""How a rig with a real drive fails; each is a `RigFault`, so a program may catch one or all."""

from __future__ import annotations

from collections.abc import Mapping

from idtool.errors import RigFault


class NotAnswering(RigFault):
    """Nobody answers on the bus, or no longer."""


class DeviceGone(RigFault):
    """The serial device cannot be opened or has disappeared."""


class WrongServo(RigFault):
    """What answers is not a servo that this package knows."""


class ServoRefused(RigFault):
    """The servo refused an instruction."""


class ServoShutdown(RigFault):
    """The servo reports a hardware error; it may have switched its motor off."""


class ServoRestarted(RigFault):
    """The servo lost its power for a moment; it holds nothing any more."""


class WatchdogTripped(RigFault):
    """The servo stopped by itself because it heard nothing for too long."""


class NotFollowing(RigFault):
    """The position does not change although it should: blocked, or a broken encoder."""


class LimitExceeded(RigFault):
    """The axis left its limits and was stopped."""


class BadReading(RigFault):
    """A sensor returned something that cannot be."""


def shutdown(bits: int, words: Mapping[int, str]) -> ServoShutdown:
    """The fault of a servo whose status has these bits, which have these words."""
    errors = ", ".join(word for bit, word in words.items() if bits & bit) or f"unknown error 0x{bits:02x}"
    return ServoShutdown(
        f"the servo reports {errors} and may have switched its motor off; "
        "remove the cause, then switch its power off and on"
    )
