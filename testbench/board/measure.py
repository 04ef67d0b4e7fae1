"""One parameter file on a simulated ATmega328P (simavr), the processor of an Arduino Uno.

Needs avr-gcc, avr-libc and simavr (Debian: gcc-avr avr-libc simavr).
"""

from __future__ import annotations

import re
import shutil
import struct
import subprocess
from dataclasses import dataclass
from pathlib import Path

from idtool.control import Limits
from idtool.export.c_controller import export_c
from idtool.guiding.path import TaughtPath
from idtool.parameters import Parameters

CLOCK_HZ = 16e6
#: Flash of a Uno beside its boot loader, bytes.
UNO_FLASH = 32_256
_CHIP = "atmega328p"
_FIRMWARE = Path(__file__).parent / "firmware.c"
#: As the Arduino IDE compiles, and whatever is not used is left out.
_AVR = ("-std=gnu99", "-Os", f"-mmcu={_CHIP}", "-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections")
_WARNINGS = ("-Wall", "-Wextra", "-Werror")
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")
_STEP = re.compile(r"^step (\d+) (\d+) (\d+) ([0-9a-f]{8})", re.MULTILINE)
_SKETCH_FLASH = re.compile(r"^flash (\d+) of", re.MULTILINE)
_MEMORY = re.compile(r"^stack (\d+) state (\d+)", re.MULTILINE)


@dataclass(frozen=True)
class Figures:
    """What one file costs on the board.

    Attributes:
        cycles: of each step; the second half is tilted anew at every step.
        states: of the controller after each step, as numbers of its enum.
        commands: of each step, from the board.
        flash: bytes that the controller adds to a firmware, with what it needs of libm.
        controller: bytes of the structure.
        stack: bytes of the stack below the caller, at most.
    """

    cycles: list[int]
    states: list[int]
    commands: list[float]
    flash: int
    controller: int
    stack: int

    @property
    def ram(self) -> int:
        """Bytes."""
        return self.controller + self.stack


def missing() -> str | None:
    """The tool that is not here; None if all are."""
    return next((tool for tool in ("avr-gcc", "avr-size", "simavr") if shutil.which(tool) is None), None)


def measure(parameters: Parameters, folder: Path) -> Figures:
    """Export into `folder`, compile, simulate 1200 steps, and read what the board printed.

    Raises:
        CalledProcessError: it does not compile, or the simulator failed.
    """
    export_c(parameters, folder, force=True)
    elf = _compile(folder, "with.elf")
    text = _COLOUR.sub("", _run("simavr", "-m", _CHIP, "-f", f"{CLOCK_HZ:.0f}", elf))
    memory = _MEMORY.search(text)
    steps = _STEP.findall(text)
    assert memory, text[-500:]
    return Figures(
        # the counter has 16 bits; the firmware says 0 where it ran over
        [int(cycles) or 1 << 16 for _, cycles, _, _ in steps],
        [int(state) for _, _, state, _ in steps],
        [_number(command) for *_, command in steps],
        _flash(elf) - _flash(_compile(folder, "without.elf", "-DWITHOUT_CONTROLLER", "-Wno-unused-function")),
        int(memory[2]),
        int(memory[1]),
    )


def sketch_flash(parameters: Parameters, folder: Path, builder: Path, path: TaughtPath | None = None) -> int:
    """Bytes of the whole sketch on an Arduino Uno: core, serial port and controller, as its IDE builds it.

    Args:
        parameters: exported with a range.
        folder: to build in.
        builder: script that takes the folder of a sketch and one to build in, and prints "flash N of ...".
        path: that it is to play.

    Raises:
        RuntimeError: it does not compile.
    """
    sketch = folder / "guide"
    export_c(parameters, sketch, limits=Limits(-1.5, 1.5), path=path, force=True)
    text = _run("bash", builder, sketch, folder / "build")
    found = _SKETCH_FLASH.search(text)
    assert found, text[-500:]
    return int(found[1])


def host_commands(folder: Path) -> list[float]:
    """The commands of the same firmware on this machine."""
    program = folder / "host"
    flags = ("-std=gnu99", "-O2", *_WARNINGS, "-I", folder)
    _run("gcc", *flags, _FIRMWARE, folder / "ffc.c", "-lm", "-o", program)
    return [_number(command) for *_, command in _STEP.findall(_run(program))]


def _compile(folder: Path, name: str, *more: str) -> Path:
    out = folder / name
    _run("avr-gcc", *_AVR, *_WARNINGS, *more, "-I", folder, _FIRMWARE, folder / "ffc.c", "-lm", "-o", out)
    return out


def _flash(elf: Path) -> int:
    """Program and initialised data, bytes."""
    text, data, *_ = _run("avr-size", elf).splitlines()[1].split()
    return int(text) + int(data)


def _number(bits: str) -> float:
    return float(struct.unpack(">f", bytes.fromhex(bits))[0])


def _run(*command: str | Path) -> str:
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300, errors="replace")
    if done.returncode:
        raise RuntimeError(f"{command[0]}: {done.stderr[-2000:]}")
    return done.stdout + done.stderr
