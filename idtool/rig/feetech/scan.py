"""Find Feetech servos on a port: one question to each id, since the answers to one to all would collide."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from idtool.rig.bus.scan import Scanner
from idtool.rig.feetech.bus import BAUD_RATES, vendor_sdk
from idtool.rig.feetech.models import MODELS

#: Ids that are asked; each that is not there costs a twentieth of a second.
IDS = range(0, 21)


def feetech_scanner() -> Scanner:
    """The scanner.

    Raises:
        RigFault: the SDK is not installed.
    """
    sdk = vendor_sdk()

    def who(port: Any) -> Iterator[tuple[int, int]]:
        handler = sdk.sms_sts(port)
        for id in IDS:
            number, result, _ = handler.ping(id)
            if result == sdk.COMM_SUCCESS:
                yield id, number

    return Scanner("feetech", sdk, BAUD_RATES, who, lambda number: MODELS.get(number, f"model {number}"))
