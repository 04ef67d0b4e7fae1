"""Jog an axis with keys, for fine positioning: a tap moves it by a step, a key that is held moves it on.

A terminal reports no release: a key is held once it repeats itself, until the repetitions end. Speed and
acceleration are bounded, and a move that is let go brakes to rest and stays there.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Unpack

from idtool.guiding.button import REPEAT_S
from idtool.guiding.player import Player, Stop, Watching
from idtool.rig.base import Rig, TrialSetup
from idtool.rig.clock import Clock

#: A tap's way and the speed of a held key unless told otherwise: m and m/s where the travel of the part is
#: known, else rad and rad/s.
STEP_M, SPEED_M_S, STEP_RAD, SPEED_RAD_S = 0.5e-3, 5e-3, 0.01, 0.1
#: Time in which a jogged axis brakes from its speed, s.
BRAKE_S = 0.25
#: Keys of a terminal (ECMA-48, and as an application keypad sends them) and their directions.
_ARROWS = {
    begin + letter: direction
    for begin in (b"\x1b[", b"\x1bO")
    for letter, direction in ((b"A", 1), (b"C", 1), (b"B", -1), (b"D", -1))
}
_END = b"q"


class ArrowKeys:
    """Arrow keys out of what a terminal sends.

    Attributes:
        ended: q was pressed, or `gone` says that the terminal went away.
    """

    def __init__(self, read: Callable[[], bytes], gone: Callable[[], bool] = lambda: False) -> None:
        self._read, self._gone = read, gone
        self._left = b""
        self.ended = False

    def __call__(self) -> list[int]:
        """Directions that were pressed since the last call, +1 or -1."""
        typed, self._left = self._left + self._read(), b""
        pressed = []
        while typed and not self.ended:
            if typed[:3] in _ARROWS:
                pressed.append(_ARROWS[typed[:3]])
                typed = typed[3:]
            elif any(arrow.startswith(typed) for arrow in _ARROWS):
                self._left, typed = typed, b""  # the rest of an arrow is still on its way
            else:
                self.ended = typed[:1] == _END
                typed = typed[1:]
        self.ended = self.ended or self._gone()
        return pressed


class JogMotion:
    """Where the keys want the axis.

    Args:
        place: where it stands, rad (m).
        step: of a tap, rad (m).
        speed: greatest, rad/s (m/s).
        low, high: of the position, rad (m).

    Attributes:
        goal: position command, rad (m).
    """

    def __init__(self, place: float, *, step: float, speed: float, low: float, high: float) -> None:
        self.goal = self._target = place
        self._step, self._speed, self._braking = step, speed, speed / BRAKE_S
        self._low, self._high = low, high
        self._moves = 0.0
        self._direction, self._last, self._held = 0, -math.inf, False

    def press(self, direction: int, now: float) -> None:
        """A key came at `now`, s."""
        repeats = direction == self._direction and now - self._last <= REPEAT_S
        if not repeats:
            if self._held or direction != self._direction:
                self._target = self._rest()
            self._target += direction * self._step
        self._direction, self._last, self._held = direction, now, repeats

    def advance(self, now: float, period: float) -> float:
        """The goal one period later, `now` being the time of the keys, s."""
        if self._held and now - self._last > REPEAT_S:
            self._held, self._target = False, self._rest()
        wanted = self._direction * math.inf if self._held else self._target
        target = min(max(wanted, self._low), self._high)
        if not self._held:
            self._target = target
        left = target - self.goal
        most = min(self._speed, math.sqrt(2.0 * self._braking * abs(left)))
        # twice what braking needs, so that a period more or less leads nowhere beyond the target
        change = 2.0 * self._braking * period
        self._moves = min(max(math.copysign(most, left), self._moves - change), self._moves + change)
        if abs(left) <= change * period and abs(self._moves) <= change:
            self.goal, self._moves = target, 0.0
        else:
            self.goal += self._moves * period
        return self.goal

    def _rest(self) -> float:
        """Where it comes to rest if it brakes now."""
        return self.goal + self._moves * abs(self._moves) / (2.0 * self._braking)


@dataclass(frozen=True)
class Jogged:
    """A run.

    Attributes:
        start, position: where the axis stood first and last, rad (m).
        stopped: None if a person ended it.
        interrupted: by Ctrl-C.
    """

    start: float
    position: float
    stopped: Stop | None
    interrupted: bool


def jog(
    rig: Rig,
    setup: TrialSetup,
    keys: ArrowKeys,
    *,
    step: float,
    speed: float,
    tell: Callable[[float], None] | None = None,
    clock: Clock | None = None,
    now: Callable[[], float] = time.monotonic,
    **watching: Unpack[Watching],
) -> Jogged:
    """Move an axis by keys until q, Ctrl-C or a contact ends it.

    Args:
        rig, setup, watching: as of `Player`, whose errors these are.
        keys: asked once per period.
        step: of a tap, rad (m).
        speed: of a held key, rad/s (m/s); the rig's limit holds as well.
        tell: called with every position, rad (m).
        clock: paces a rig that does not pace itself.
        now: time of the keys, s.
    """
    low, high = rig.limits.position
    player = Player(rig, setup, "jog", **watching)
    stopped: Stop | None = None
    start = position = math.nan
    with player:
        sample = player.listen(player.begin())
        start = position = sample.position
        motion = JogMotion(
            player.commanded, step=step, speed=min(speed, rig.limits.speed), low=low, high=high
        )
        due = clock.now() if clock is not None else 0.0
        while stopped is None and not keys.ended:
            at = now()
            for direction in keys():
                motion.press(direction, at)
            sample = player.step(motion.advance(at, rig.period_s))
            position = sample.position
            stopped = player.met(sample, motion.goal)
            if tell is not None:
                tell(position)
            if clock is not None:
                due += rig.period_s
                clock.wait_until(due)
    return Jogged(start, position, stopped, player.interrupted)
