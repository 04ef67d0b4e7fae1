"""Where the teach button is: a key of the terminal, a pin, a line of a serial port.

    key            the space bar, held: a terminal reports no release, so the button is down as long as the
                   key repeats itself
    key:toggle     the space bar, once for down and once more for up
    gpio:17        a pin of the system, or any file that says 1 while the button is down: gpio:PATH
    serial:DEVICE  a button between RTS and CTS of a serial port
    sim            pressed half a second after the run begins, and held: for simulated axes

What cannot be read is a button that is up.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import final

from idtool.errors import InputError, RigFault, nearest
from idtool.guiding.keys import TerminalKeys

#: A key begins to repeat itself within so long (terminals wait 0.2 to 0.66 s), and then every so often, s.
FIRST_REPEAT_S, REPEAT_S = 0.7, 0.15
_KINDS = ("key", "key:toggle", "none", "sim", "gpio:17", "serial:DEVICE")


class Button(ABC):
    """Call it once per period."""

    hint: str

    @abstractmethod
    def __call__(self, run_s: float) -> bool:
        """Whether it is down now; `run_s` is the time of the run, s."""

    def close(self) -> None:  # noqa: B027 (most have nothing to let go of)
        """Let go of what it reads."""


class HeldKey:
    """A key that is held, told from its repetitions."""

    def __init__(self) -> None:
        self._pressed = self._last = -1e9

    def press(self, now: float) -> None:
        """The terminal sent the key at `now`, s."""
        if not self.down(now):
            self._pressed = now
        self._last = now

    def down(self, now: float) -> bool:
        """Whether it is held at `now`, s."""
        repeats = self._last > self._pressed
        return now - self._last <= (REPEAT_S if repeats else FIRST_REPEAT_S)


class ToggledKey:
    """A key that is pressed once for down and once more for up; one that repeats itself ends up."""

    def __init__(self) -> None:
        self._down = False
        self._last = -1e9

    def press(self, now: float) -> None:
        """The terminal sent the key at `now`, s: up at once, down only after a pause."""
        self._down = not self._down and now - self._last > FIRST_REPEAT_S
        self._last = now

    def down(self, now: float) -> bool:
        """Whether it was pressed an odd number of times."""
        return self._down


@final
class KeyButton(Button):
    """The space bar of the terminal on standard input."""

    def __init__(self, *, toggle: bool, now: Callable[[], float] = time.monotonic) -> None:
        self._keys = TerminalKeys("--button", "name a pin or a serial port, or ask for --button none")
        self.hint = "press the space bar to guide, and again to hold" if toggle else "hold the space bar down"
        self._now = now
        self._key: HeldKey | ToggledKey = ToggledKey() if toggle else HeldKey()

    def __call__(self, run_s: float) -> bool:
        now = self._now()
        if b" " in self._keys.read():
            self._key.press(now)
        return self._key.down(now)

    def close(self) -> None:
        """Give the terminal back as it was."""
        self._keys.close()


@final
class PinButton(Button):
    """A file that begins with 1 while the button is down, as the value of a GPIO pin of Linux does."""

    def __init__(self, name: str) -> None:
        self._path = Path(f"/sys/class/gpio/gpio{name}/value" if name.isdigit() else name)
        self.hint = f"press the button at {self._path}"
        if not self._path.exists():
            raise InputError(f"there is no {self._path}", place="--button", remedy="export the pin first")

    def __call__(self, run_s: float) -> bool:
        try:
            return self._path.read_bytes()[:1] == b"1"
        except OSError:
            return False


@final
class SerialButton(Button):
    """A button between RTS and CTS of a serial port."""

    def __init__(self, device: str) -> None:
        try:
            import serial
        except ImportError as error:
            raise InputError(
                "a button at a serial port needs pyserial",
                place="--button",
                remedy="pip install 'ffc-id[dynamixel]'",
            ) from error
        self.hint = f"press the button at {device}"
        try:
            self._port = serial.Serial(device)
            self._port.rts = True
        except (OSError, ValueError) as error:
            raise RigFault(f"the button's port {device} cannot be opened: {error}") from error

    def __call__(self, run_s: float) -> bool:
        try:
            return bool(self._port.cts)
        except OSError:
            return False

    def close(self) -> None:
        """Close the port."""
        self._port.close()


@final
class SimulatedButton(Button):
    """Pressed once the axis was listened to, and held."""

    hint = "the button is pressed after 0.5 s"

    def __call__(self, run_s: float) -> bool:
        return run_s >= 0.5


@contextmanager
def open_button(spec: str) -> Iterator[Button | None]:
    """The button of a word (see the head of this module); None for "none".

    Raises:
        InputError: not such a word, a key without a terminal, a pin that is not there.
        RigFault: the port cannot be opened.
    """
    button: Button | None
    kind, _, where = spec.partition(":")
    if spec == "none":
        button = None
    elif spec == "sim":
        button = SimulatedButton()
    elif spec in ("key", "key:toggle"):
        button = KeyButton(toggle=where == "toggle")
    elif kind == "gpio" and where:
        button = PinButton(where)
    elif kind == "serial" and where:
        button = SerialButton(where)
    else:
        raise InputError(f'unknown button "{spec}"', place="--button", remedy=nearest(spec, _KINDS))
    try:
        yield button
    finally:
        if button is not None:
            button.close()
