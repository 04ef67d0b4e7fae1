"""The sketch itself, compiled for this machine, on a virtual servo: what it asks for, and when it stops."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from idtool.control import Limits
from idtool.export.c_controller import export_c
from idtool.guiding.path import TaughtPath, smoothed
from idtool.model.units import Kind
from idtool.parameters import Controller
from idtool.parameters.axis import Axis
from idtool.rig.opening import read_plant
from idtool.virtual_servo.axis import VirtualAxis
from idtool.virtual_servo.dynamixel.packet import Decoder, Packet, encode
from idtool.virtual_servo.dynamixel.servo import VirtualDynamixel
from tests.control.double import BENCH, parameters

STUBS = Path(__file__).parent / "stubs"
FLAGS = ("-std=c++11", "-Wall", "-Wextra", "-Werror", "-I", str(STUBS))
WRITE = 3
STARTING, RESTING, TARING = 0, 1, 2
APPROACHING, DONE = 0, 2  # of a path
_BUS = ctypes.CFUNCTYPE(
    ctypes.c_size_t,
    ctypes.c_uint32,
    ctypes.POINTER(ctypes.c_uint8),
    ctypes.c_size_t,
    ctypes.POINTER(ctypes.c_uint8),
)

pytestmark = pytest.mark.skipif(shutil.which("g++") is None, reason="no g++ here")


def export(folder: Path, kind: Kind = "rotary", mode: str = "light", path: TaughtPath | None = None) -> Path:
    gains = Controller(2.05, 8.0 if mode == "light" else 1.68, 0.01, mode=mode)
    file = replace(parameters(BENCH), axis=Axis(kind, 2.67), controller=gains)
    export_c(file, folder, limits=Limits(-1.5, 1.5), path=path)
    (sketch,) = folder.glob("*.ino")
    return sketch


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return linked(tmp_path_factory.mktemp("guide"))


def linked(folder: Path, path: TaughtPath | None = None) -> Path:
    """The sketch as a library of this machine."""
    sketch = export(folder, path=path)
    for source, out in ((folder / "ffc.c", "ffc.o"), (STUBS / "board.cpp", "board.o")):
        compiler = ("gcc", "-std=c99") if source.suffix == ".c" else ("g++", *FLAGS, f'-DSKETCH="{sketch}"')
        command = [*compiler, "-fPIC", "-O1", "-c", "-I", str(folder), str(source), "-o", str(folder / out)]
        subprocess.run(command, check=True)
    shared = folder / "board.so"
    subprocess.run(["g++", "-shared", folder / "ffc.o", folder / "board.o", "-o", shared], check=True)
    return shared


class Board:
    """The sketch and its servo.

    Attributes:
        servo: whom it speaks to.
        wrote: addresses and values of every write, in order.
        heard: packets that it sent.
        garble: what becomes of an answer on the wire.
    """

    def __init__(self, library: Path, folder: Path) -> None:
        own = folder / "own.so"  # a library is loaded once; each test has its own
        shutil.copy(library, own)
        self._c = ctypes.CDLL(str(own))
        for name in ("led", "bus_fault", "read", "write"):
            getattr(self._c, f"board_{name}").restype = ctypes.c_bool
        self._c.board_now.restype = ctypes.c_uint32
        self._c.board_error.restype = ctypes.c_uint8
        self.servo = VirtualDynamixel(VirtualAxis(read_plant("bench"), seed=1), baud=1_000_000)
        self.servo.table["return_delay_time"] = 0
        self.wrote: list[tuple[int, int]] = []
        self.heard = 0
        self.garble: Callable[[bytes], bytes] = lambda answer: answer
        self._decoder = Decoder()
        self._bus = _BUS(self._speak)

    def _speak(self, now_us: int, sent: object, count: int, answer: object) -> int:
        raw = ctypes.string_at(sent, count)  # type: ignore[arg-type]
        out = b""
        for packet in self._decoder.feed(raw):
            self.heard += 1
            assert isinstance(packet, Packet)
            if packet.instruction == WRITE:
                address, value = packet.parameters[:2], packet.parameters[2:]
                self.wrote.append((int.from_bytes(address, "little"), int.from_bytes(value, "little")))
            out += b"".join(map(encode, self.servo.answer(packet, 1e-6 * now_us)))
        out = self.garble(out)
        ctypes.memmove(answer, out, len(out))  # type: ignore[arg-type]
        return len(out)

    def begin(self) -> Board:
        self._c.board_begin(self._bus)
        return self

    def run(self, seconds: float) -> int:
        return int(self._c.board_run(self._c.board_now() + round(1e6 * seconds)))

    def button(self, down: bool) -> None:
        self._c.board_button(down)

    def play(self, down: bool) -> None:
        self._c.board_play(down)

    @property
    def path_state(self) -> int:
        """Of the player; -1 while it does not play."""
        return int(self._c.board_path_state())

    def lights(self, seconds: float) -> int:
        """How often the LED changed."""
        seen = []
        for _ in range(round(100 * seconds)):
            self.run(0.01)
            seen.append(bool(self._c.board_led()))
        return sum(a != b for a, b in pairwise(seen))

    @property
    def bus_fault(self) -> bool:
        return bool(self._c.board_bus_fault())

    def read(self, address: int, count: int) -> bytes | None:
        data = (ctypes.c_uint8 * count)()
        return bytes(data) if self._c.board_read(address, data, count) else None

    def write(self, address: int, value: int, size: int) -> bool:
        return bool(self._c.board_write(address, ctypes.c_uint32(value & 0xFFFFFFFF), size))


@pytest.fixture
def board(library: Path, tmp_path: Path) -> Board:
    return Board(library, tmp_path)


@pytest.mark.parametrize("mode", ["paper", "light"])
@pytest.mark.parametrize("kind", ["rotary", "linear"])
def test_compiles_without_a_warning(kind: Kind, mode: str, tmp_path: Path) -> None:
    sketch = export(tmp_path, kind, mode)

    def compiled(*more: str) -> subprocess.CompletedProcess[str]:
        command = ["g++", *FLAGS, "-fsyntax-only", "-x", "c++", "-I", str(tmp_path), *more, str(sketch)]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    if kind == "linear":
        assert "METRES_PER_RAD" in compiled().stderr  # nobody but the user knows it
    done = compiled(*(["-DMETRES_PER_RAD=0.02f"] if kind == "linear" else []))
    assert done.returncode == 0, done.stderr
    assert ("ffc_tare" in sketch.read_text()) == (mode == "light")


def test_the_servo_is_limited_before_it_may_move_and_watched_last(board: Board) -> None:
    board.servo.table["bus_watchdog"] = -1  # tripped when the board was last switched off
    table = board.begin().servo.table
    assert not board.bus_fault
    assert table["operating_mode"] == 5
    assert table["goal_current"] == min(371, table["current_limit"])  # 1 A
    assert table["torque_enable"] == 1
    order = [address for address, _ in board.wrote]
    assert order.index(98) < order.index(64) < order.index(11) < order.index(102) < len(order) - 2
    assert [address for address, _ in board.wrote[-3:]] == [116, 64, 98]
    assert board.wrote[-2:] == [(64, 1), (98, 5)]


def test_a_load_that_is_held_stays_held_through_a_reset(board: Board) -> None:
    board.begin().run(0.5)
    held = board.servo.axis.position
    board.wrote.clear()
    board.begin()  # again
    assert (64, 0) not in board.wrote
    board.run(1.0)
    assert abs(board.servo.axis.position - held) < 3e-3


def test_nothing_moves_after_a_reset_until_the_button_goes_down(board: Board) -> None:
    board.button(down=True)
    board.begin()
    board.button(down=True)  # held down through the reset: does not count
    board.run(0.5)  # without torque it fell
    place = board.servo.axis.position
    assert board.run(3.0) == RESTING
    assert abs(board.servo.axis.position - place) < 3e-3
    board.button(down=False)
    board.run(1.0)
    board.button(down=True)
    states = {board.run(0.05) for _ in range(40)}
    assert TARING in states
    assert board.run(4.0) == RESTING


def test_a_silent_bus_is_latched_and_left_to_the_servo_s_watchdog(board: Board) -> None:
    board.begin().run(1.0)
    board.garble = lambda answer: b""
    board.run(0.02)
    assert not board.bus_fault  # two lost periods are noise
    board.run(0.1)
    assert board.bus_fault
    heard = board.heard
    assert board.lights(1.0) > 20
    assert board.heard == heard  # it says nothing more
    board.garble = lambda answer: answer
    board.run(0.5)
    assert board.bus_fault
    assert board.heard == heard
    board.servo.pass_time(1e-6 * board._c.board_now())
    assert board.servo.table["bus_watchdog"] == -1  # which has stopped the axis
    board.button(down=True)
    board.run(0.5)
    assert not board.bus_fault
    assert board.servo.table["torque_enable"] == 1


def test_noise_in_single_answers_is_no_fault(board: Board) -> None:
    board.begin().run(0.5)
    turn = [0]

    def noisy(answer: bytes) -> bytes:
        turn[0] += 1
        return answer[:-1] + bytes([answer[-1] ^ 1]) if turn[0] % 7 == 0 and answer else answer

    board.garble = noisy
    assert board.run(2.0) == RESTING
    assert not board.bus_fault
    board.garble = lambda answer: (
        b"\xff\xff\xfd\x00\x01\x04\x00\x02\x00\x00\x00" + answer
    )  # an echo before it
    assert board.run(1.0) == RESTING
    assert not board.bus_fault


def test_a_refusal_and_a_hardware_error_are_faults_at_once(board: Board) -> None:
    board.begin().run(0.5)
    board.servo.trip_watchdog()
    board.run(0.015)
    assert board.bus_fault
    board.button(down=False)
    board.run(0.02)
    board.button(down=True)
    board.run(0.1)
    assert not board.bus_fault  # clears the watchdog
    board.servo.fail(1 << 5)  # overload
    board.run(0.015)
    assert board.bus_fault
    board.button(down=False)
    board.run(0.02)
    board.button(down=True)
    board.run(0.1)
    assert board.bus_fault  # it needs its power switched off and on


def test_bytes_that_look_like_a_header_are_stuffed_both_ways(board: Board) -> None:
    board.begin()
    value = int.from_bytes(b"\xff\xff\xfd\x00", "little", signed=True)
    board.write(64, 0, 1)
    assert board.write(112, value, 4) or board._c.board_error() not in (0, 0x7F)
    for place in (b"\xff\xff\xfd\x00", b"\x00\xff\xff\xfd", b"\xfd\xff\xff\xfd"):
        number = int.from_bytes(place, "little", signed=True)
        if board.write(116, number, 4):
            assert board.read(116, 4) == place
    board.servo.table["goal_current"] = -1
    assert board.read(102, 2) == b"\xff\xff"


@pytest.fixture(scope="module")
def playing_library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    time = np.arange(0.0, 2.0, 0.01)
    path = smoothed(time, np.interp(time, [0.2, 1.0, 1.8], [0.2, 0.5, 0.4]), "rotary")
    return linked(tmp_path_factory.mktemp("playing"), path)


def test_the_play_button_plays_the_path_while_it_is_pressed(playing_library: Path, tmp_path: Path) -> None:
    board = Board(playing_library, tmp_path)
    board.play(down=True)
    board.begin()
    board.play(down=True)  # held down through the reset: does not count
    board.run(1.0)
    assert board.path_state == -1
    board.play(down=False)
    board.run(0.1)
    board.play(down=True)
    board.run(1.0)
    assert board.path_state == APPROACHING
    board.play(down=False)
    board.run(0.3)
    assert board.path_state == -1
    place = board.servo.axis.position
    board.run(1.0)
    assert abs(board.servo.axis.position - place) < 3e-3, "released, it stands"
    board.play(down=True)
    for _ in range(150):
        board.run(0.1)
        if board.path_state == DONE:
            break
    assert board.path_state == DONE
    board.run(0.5)
    assert board.servo.axis.position == pytest.approx(0.4, abs=0.02)
    assert not board.bus_fault
    assert board.lights(0.5) == 0
