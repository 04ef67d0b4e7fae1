"""`kill -9` of a run that moves a virtual servo, and what is left of it."""

from __future__ import annotations

import random
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from idtool.log import Log
from idtool.rig.clock import HostClock
from idtool.rig.opening import read_plant
from idtool.virtual_servo.axis import VirtualAxis
from idtool.virtual_servo.dynamixel.packet import Damaged, Packet
from idtool.virtual_servo.dynamixel.servo import VirtualDynamixel
from idtool.virtual_servo.terminal import VirtualTerminal
from testbench.bench import BAUD, FLAT

RECIPE = """
schema = "ffc-id/recipe/1"
name = "reliability"
experiment = "sweep"
[setup]
tilt_alpha_rad = 1.5707963267948966
rest_s = 0.1
[[trials]]
kind = "back_and_forth"
speed_rad_s = 0.5
travel_rad = {travel}
repeats = {repeats}
"""


@dataclass(frozen=True)
class Killed:
    """One process that was killed while it moved the axis.

    Attributes:
        stood_after_s: from the last word that the servo heard to standstill.
        tripped: the servo's own watchdog stopped it.
        rows: rows of the log, which was read back.
        whole: its last row is whole.
        behind_s: from the last row to the last word that the servo heard, told by the way between.
    """

    stood_after_s: float
    tripped: bool
    rows: int
    whole: bool
    behind_s: float


def killed(seed: int, scale: float = 1.0) -> Killed:
    """`kill -9` of `ffc-id run` at a random instant of its motion; `scale` seconds of the servo take one.

    Where the computer is so busy that the run ends by itself before, it is begun again.
    """
    for _ in range(5):
        with suppress(_TooBusy):
            return _killed(seed, scale)
    raise RuntimeError("this computer is too busy for a run in real time")


class _TooBusy(Exception):  # noqa: N818 (no error: the computer's state)
    """The run to be killed ended before."""


def _killed(seed: int, scale: float) -> Killed:
    rng = random.Random(seed)
    clock = HostClock(scale)
    servo = VirtualDynamixel(VirtualAxis(read_plant("bench"), setup=FLAT), baud=BAUD, now=clock.now())
    place = _places(servo)
    with VirtualTerminal(servo, clock=clock) as terminal, tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "recipe.toml").write_text(RECIPE.format(travel=1.6, repeats=20))
        log = folder / "log.csv"
        rig = f"dynamixel:{terminal.path},baud={BAUD},scale={scale}"
        arguments = ["run", "--recipe", str(folder / "recipe.toml"), "--rig", rig, "--yes", "-o", str(log)]
        program = [sys.executable, "-c", "from idtool.cli.main import main; main()"]
        with subprocess.Popen([*program, *arguments], stderr=subprocess.DEVNULL) as process:
            try:
                _wait(lambda: log.exists() and log.read_bytes().count(b"\n") > 30, process)
                time.sleep(rng.uniform(0.0, 2.0) / scale)
                if process.poll() is not None:
                    raise _TooBusy
            finally:
                process.kill()
                process.wait()
        time.sleep(1.5 / scale)
        with terminal.lock:
            now = clock.now()
            servo.pass_time(now)
            stood = now - servo.axis.still_s - servo.heard
            tripped = servo.table["bus_watchdog"] == -1
        frame = Log.read(log).frame
        behind = abs(place[-1] - float(frame["position_rad"].iloc[-1])) / 0.5
        return Killed(max(stood, 0.0), tripped, len(frame), log.read_bytes().endswith(b"\n"), behind)


def _places(servo: VirtualDynamixel) -> deque[float]:
    """Where the axis was at the last word that the servo heard, rad; kept up to date."""
    places: deque[float] = deque(maxlen=1)
    answer = servo.answer

    def listen(packet: Packet | Damaged, now: float) -> list[Packet]:
        answers = answer(packet, now)
        places.append(servo.axis.position)
        return answers

    servo.answer = listen  # type: ignore[method-assign]
    return places


def _wait(ready: Callable[[], bool], process: subprocess.Popen[bytes]) -> None:
    until = time.monotonic() + 60.0
    while not ready():
        if process.poll() is not None or time.monotonic() > until:
            raise _TooBusy
        time.sleep(0.01)
