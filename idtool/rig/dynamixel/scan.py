"""Find DYNAMIXEL servos on a port: one question to all."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from idtool.rig.bus.scan import Scanner
from idtool.rig.dynamixel.bus import BAUD_RATES, vendor_sdk
from idtool.rig.dynamixel.models import MODELS


def dynamixel_scanner() -> Scanner:
    """The scanner.

    Raises:
        RigFault: the SDK is not installed.
    """
    sdk = vendor_sdk()
    handler = sdk.Protocol2PacketHandler()

    def who(port: Any) -> Iterator[tuple[int, int]]:
        answers, _ = handler.broadcastPing(port)
        for id, (model, _firmware) in sorted(answers.items()):
            yield id, model

    names = {number: model.name for number, model in MODELS.items()}
    return Scanner("dynamixel", sdk, BAUD_RATES, who, names.get)
