"""Coverage-guided fuzzing of everything that reads what others wrote: files, and packets on a bus.

A reader may refuse (InputError) and nothing else; anything else, a hang or a memory blow-up is a finding,
which libFuzzer leaves as a file `crash-...`. Needs atheris (Linux): pip install 'ffc-id[fuzz]'.

python -m studies.fuzz TARGET [libFuzzer options]        (make fuzz: a minute each)
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import atheris

with atheris.instrument_imports(include=["idtool", "tomllib", "dynamixel_sdk"]):
    import dynamixel_sdk

    from idtool.errors import InputError, UsageError
    from idtool.experiment.recipe import parse_recipe, recipe_text
    from idtool.log import Log
    from idtool.parameters import Parameters
    from idtool.parameters.axis_file import AxisFile
    from idtool.rig.clock import SkippingClock
    from idtool.rig.plant_file import read_plant_file
    from idtool.virtual_servo.dynamixel.packet import Decoder, Packet, encode

_FOLDER = tempfile.TemporaryDirectory()
_FILE = Path(_FOLDER.name) / "any"


def _file(read: Callable[[Path], Any]) -> Callable[[bytes], None]:
    def target(data: bytes) -> None:
        _FILE.write_bytes(data)
        with suppress(InputError, UsageError):
            read(_FILE)

    return target


def recipe(data: bytes) -> None:
    """A recipe; one that is taken makes arrays as long as it says, so only its limits are tried."""
    with suppress(InputError):
        parse_recipe(data.decode("utf-8", "replace"), "any.toml")


def packets(data: bytes) -> None:
    """Bytes for the virtual servo: whatever comes, a packet after it is found."""
    decoder = Decoder()
    list(decoder.feed(data))
    ping = encode(Packet(1, 1))
    assert any(Packet(1, 1) in list(decoder.feed(ping)) for _ in range(120))


class _Port:
    """A port of the SDK on which these bytes arrive and then nothing."""

    is_using = False
    packet_timeout = 20.0

    def __init__(self, data: bytes) -> None:
        self._data = data

    def readPort(self, length: int) -> bytes:
        taken, self._data = self._data[:length], self._data[length:]
        return taken

    def getBytesAvailable(self) -> int:
        return len(self._data)

    def isPacketTimeout(self) -> bool:
        return not self._data


def answers(data: bytes) -> None:
    """Bytes for the backend: what the SDK takes for an answer must be one."""
    from idtool.rig.bus.transactions import Transactions
    from idtool.rig.dynamixel.bus import Bus

    bus = Bus.__new__(Bus)
    handler, success = dynamixel_sdk.Protocol2PacketHandler(), dynamixel_sdk.COMM_SUCCESS
    Transactions.__init__(bus, _Port(data), handler, success, "fuzz", 1, 57_600, SkippingClock())
    answer = bus._answer(4)
    if answer is not None:
        error, content = answer
        assert 0 <= error <= 255
        assert error & 0x7F or len(content) == 4


TARGETS: dict[str, tuple[Callable[[bytes], None], list[bytes]]] = {
    "log": (
        _file(Log.read),
        [
            b'# ffc-id-log = 1\n# experiment = "sweep"\n# [axis]\n# kind = "rotary"\n'
            b"trial,time_s,velocity_rad_s,torque_nm\n0,0,0.1,1\n0,0.1,0.1,1\n"
        ],
    ),
    "parameters": (_file(Parameters.read), [b'schema = "ffc-id/params/1"\n[axis]\nkind = "rotary"\n']),
    "axis": (_file(AxisFile.read), [b'schema = "ffc-id/axis/1"\n[axis]\nkind = "linear"\n[limits]\n']),
    "plant": (_file(read_plant_file), [Path("idtool/rig/bench.toml").read_bytes()]),
    "recipe": (recipe, [recipe_text(name).encode() for name in ("sweep", "sine", "validation")]),
    "packets": (packets, [encode(Packet(1, 2, b"\x84\x00\x04\x00"))]),
    "answers": (answers, [encode(Packet(1, 0x55, b"\x00\x01\x02\x03\x04"))]),
}


def main() -> None:
    """Fuzz one target until it is told to stop."""
    if len(sys.argv) < 2 or sys.argv[1] not in TARGETS:
        sys.exit(f"name one of {', '.join(TARGETS)}")
    target, seeds = TARGETS[sys.argv[1]]
    corpus = Path(_FOLDER.name) / "corpus"
    corpus.mkdir()
    for index, seed in enumerate(seeds):
        (corpus / f"seed{index}").write_bytes(seed)
    atheris.Setup([sys.argv[0], *sys.argv[2:], str(corpus)], target)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
