"""The pseudo-terminal through which a host sees the virtual servo as a serial device."""

from __future__ import annotations

import heapq
import os
import select
import termios
import threading
import tty
from typing import Self

from idtool.rig.bus.transactions import BITS_PER_BYTE
from idtool.rig.clock import Clock, HostClock
from idtool.virtual_servo.base import VirtualServo
from idtool.virtual_servo.faults import Mishaps

#: How often the axis moves while nobody asks, s.
_IDLE_S = 0.1
#: What is written to its own thread: look at the device once more, or end.
_LOOK, _END = b"l", b"e"
_SPEEDS = {
    getattr(termios, name): int(name[1:])
    for name in dir(termios)
    if name[0] == "B" and name[1:].isdigit() and name != "B0"
}


class VirtualTerminal:
    """Serves one virtual servo from a thread of its own until it is closed. Use it as a context manager.

    Args:
        servo: who answers; nobody else may touch it while it is served, except under `lock`.
        mishaps: what goes wrong.
        clock: the servo's; None is the host's.

    Attributes:
        path: of the device.
        lock: held while the servo moves or answers.
    """

    def __init__(
        self, servo: VirtualServo, *, mishaps: Mishaps | None = None, clock: Clock | None = None
    ) -> None:
        self.servo = servo
        self.mishaps = mishaps or Mishaps([])
        self.lock = threading.Lock()
        self._clock = clock or HostClock()
        # our own handle of the far end keeps the device alive between two hosts
        self._near, self._far = os.openpty()
        tty.setraw(self._far)
        self.path = os.ttyname(self._far)
        self._wake, self._waker = os.pipe()
        self._looked = threading.Semaphore(0)
        self._due: list[tuple[float, int, bytes]] = []
        self._sent = 0
        self._thread = threading.Thread(target=self._serve, name="virtual servo", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Stop serving; safe to call twice."""
        if self._waker < 0:
            return
        os.write(self._waker, _END)
        self._thread.join()
        for handle in (self._wake, self._waker):
            os.close(handle)
        self._waker = -1

    def take_turn(self) -> None:
        """Return when its thread has looked at the device once more, and its answer can be read there."""
        if self._waker < 0:
            return
        os.write(self._waker, _LOOK)
        while not self._looked.acquire(timeout=_IDLE_S):
            if not self._thread.is_alive():
                return

    def _serve(self) -> None:
        try:
            while not self.mishaps.unplugged:
                wait = self._due[0][0] - self._clock.now() if self._due else _IDLE_S * self._clock.scale
                ready, _, _ = select.select(
                    [self._near, self._wake], [], [], max(0.0, wait / self._clock.scale)
                )
                told = os.read(self._wake, 1) if self._wake in ready else b""
                if told == _END:
                    return
                if not ready:
                    self._idle()
                if self._near in ready:
                    self._receive(os.read(self._near, 4096))
                while self._due and self._due[0][0] <= self._clock.now():
                    os.write(self._near, heapq.heappop(self._due)[2])
                if told:
                    # the kernel passes bytes on when it finds the time; asking for them waits for that
                    select.select([self._far], [], [], 0.0)
                    self._looked.release()
        finally:
            os.close(self._near)
            os.close(self._far)

    def _idle(self) -> None:
        """Move also while nobody asks, so that an hour of silence is not made up for in one answer."""
        with self.lock:
            now = self._clock.now()
            self.servo.pass_time(now)
            self.mishaps.happen(self.servo, now)

    def _receive(self, data: bytes) -> None:
        if self._line_speed() != self.servo.baud:
            return  # at another speed there is only noise
        self._pass(len(data) * BITS_PER_BYTE / self.servo.baud)
        for packet in self.servo.decoder.feed(data):
            with self.lock:
                now = self._clock.now()
                self.servo.pass_time(now)
                self.mishaps.happen(self.servo, now)
                if self.mishaps.unplugged:
                    return
                if not self.mishaps.arrives(now):
                    continue
                answers = self.servo.reply(packet, now)
            for answer in answers:
                self._pass(self.servo.return_delay_s + len(answer) * BITS_PER_BYTE / self.servo.baud)
                self._send(answer)

    def _pass(self, seconds: float) -> None:
        """Take the time that something takes on the wire."""
        self._clock.wait_until(self._clock.now() + seconds)

    def _send(self, answer: bytes) -> None:
        for delay, arriving in self.mishaps.pass_on(answer):
            due = self._clock.now() + delay * self._clock.scale
            heapq.heappush(self._due, (due, self._sent, arriving))
            self._sent += 1

    def _line_speed(self) -> int:
        """The speed that the host has set, bits a second."""
        return _SPEEDS.get(termios.tcgetattr(self._near)[5], 0)
