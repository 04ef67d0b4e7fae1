"""What hands do, written down period by period before anything moves.

A hand holds the slide by its skin. A leading hand moves towards where it wants to be by an arm of spring and
damper, some hundred N/m and some ten N s/m relaxed (Dolan, Friedman & Nagurka 1993); a pressing hand has a
force. `MARK` numbers what is to be judged; a leading hand that lets go leaves at once, the hardest case.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from idtool.model.motion import Array
from testbench.guided_machines.plant import (
    DAMPING,
    FORCE,
    GRIP,
    LEAVE,
    LOAD,
    MARK,
    PLACE,
    RATE,
    SCRIPT,
    STIFFNESS,
    TARE,
)

PERIOD = 0.01
SPEED = 0.0192  # m/s, that of the published experiment


@dataclass(frozen=True)
class Arm:
    """Spring and damper of a leading hand, N/m and N s/m."""

    stiffness: float = 800.0
    damping: float = 20.0


class Script:
    """Rows of a script, appended one action after another."""

    def __init__(self) -> None:
        self._rows: list[Array] = []
        self._mark = 0

    @property
    def marks(self) -> int:
        """How many things are to be judged."""
        return self._mark

    def table(self) -> Array:
        """Shape (periods, SCRIPT)."""
        return np.concatenate(self._rows)

    def _add(self, seconds: float) -> Array:
        rows = np.zeros((max(1, round(seconds / PERIOD)), SCRIPT))
        rows[:, MARK] = self._mark
        self._rows.append(rows)
        return rows

    def mark(self) -> Script:
        """What follows is the next thing to judge."""
        self._mark += 1
        return self

    def alone(self, seconds: float, load: float = 0.0) -> Script:
        """Nobody touches; `load`: kg that hang on the slide untold."""
        self._add(seconds)[:, LOAD] = load
        return self

    def tare(self, lean: float = 0.0) -> Script:
        """Rest, tare, rest; a hand may lean on it with a steady force, N, from before the tare to its end."""
        self.alone(0.6)
        rows = self._add(4.2)
        rows[5, TARE] = 1.0
        if lean:
            rows[:, GRIP], rows[:, FORCE] = 1.0, lean
        return self

    def lead(
        self, arm: Arm, speeds: list[tuple[float, float]], rise: float = 0.25,
        tremble: tuple[float, float] = (0.0, 0.0),
    ) -> Script:  # fmt: skip
        """Lead the slide: (speed in m/s, seconds) one after another, each reached within `rise`; a tremble in
        N and Hz comes on top."""
        rows = self._add(sum(seconds for _, seconds in speeds))
        place, rate, k = 0.0, 0.0, 0
        for speed, seconds in speeds:
            first = rate
            for j in range(round(seconds / PERIOD)):
                share = min(j * PERIOD / rise, 1.0)
                rate = first + (speed - first) * share * share * (3.0 - 2.0 * share)
                rows[k, PLACE], rows[k, RATE] = place, rate
                place += rate * PERIOD
                k += 1
        time = PERIOD * np.arange(len(rows))
        closing = np.clip(time / 0.05, 0.02, 1.0)  # fingers close
        rows[:, GRIP] = 1.0
        rows[:, STIFFNESS], rows[:, DAMPING] = arm.stiffness * closing, arm.damping * closing
        rows[:, FORCE] = tremble[0] * np.sin(2.0 * math.pi * tremble[1] * time)
        return self

    def press(self, forces: list[tuple[float, float]], leave: float = 0.0) -> Script:
        """Press: (force in N, seconds to get there) one after another, straight lines between them; it
        leaves once the slide has moved by `leave` m, if that is above zero."""
        start = 0.0
        for force, seconds in forces:
            rows = self._add(seconds)
            rows[:, FORCE] = start + (force - start) * np.arange(len(rows)) / len(rows)
            rows[:, GRIP], rows[:, LEAVE] = 1.0, leave
            start = force
        return self

    def sway(self, newton: float, hertz: float, seconds: float) -> Script:
        """A zero-mean force, as of a hand that rests on a breathing chest."""
        rows = self._add(seconds)
        rows[:, GRIP] = 1.0
        rows[:, FORCE] = newton * np.sin(2.0 * math.pi * hertz * PERIOD * np.arange(len(rows)))
        return self


def kind(arm: Arm) -> Script:
    """Four pushes (two let go in motion, two after a pause), two slowly rising forces, rest."""
    script = Script().tare()
    length = 2.0 if arm.stiffness > 300.0 else 3.5
    for hold in (0.0, 0.6):
        for way in (1, -1):
            speeds = [(way * SPEED, length)] + ([(0.0, hold)] if hold else [])
            script.mark().lead(arm, speeds).alone(1.0)
    for way in (1, -1):
        script.alone(2.0).mark().press([(way * 5.0, 10.0)], leave=0.5e-3).alone(0.5)
    return script.mark().alone(2.0)


def reversing(arm: Arm) -> Script:
    """Push, push back at once or after 0.1 s without a hand, let go in motion; thrice each."""
    script = Script().tare()
    for way in (1, -1, 1):
        script.mark().lead(arm, [(way * SPEED, 1.2), (-way * SPEED, 0.8)], rise=0.15).alone(1.5)
        script.lead(arm, [(way * SPEED, 1.2)]).alone(0.1)
        script.mark().lead(arm, [(-way * SPEED, 0.8)], rise=0.15).alone(1.5)
    return script


BREATHS = (0.4, 0.6, 1.2)


def breathing(arm: Arm) -> Script:
    """Zero-mean forces at 0.3 Hz for 20 s, after a push that was let go."""
    script = Script().tare()
    for newton in BREATHS:
        script.lead(arm, [(SPEED, 1.0)]).alone(1.0).mark().sway(newton, 0.3, 20.0).alone(0.7)
    return script


def brisk(arm: Arm) -> Script:
    """5 N within 20 and 30 ms, 4 N within 10 ms, both ways."""
    script = Script().tare()
    for newton, rise in ((5.0, 0.02), (5.0, 0.03), (4.0, 0.01)):
        for way in (1, -1):
            script.mark().press([(way * newton, rise), (way * newton, 0.5)]).alone(1.2)
    return script


LEANS = (0.5, 0.75, 1.0)


def leaning(newton: float) -> Script:
    """A steady force all through the tare, and then nobody."""
    return Script().tare(newton).mark().alone(3.0)


def loading(arm: Arm) -> Script:
    """0.4 kg hung on and taken off untold, while nobody touches."""
    script = Script().tare().lead(arm, [(SPEED, 1.0)]).alone(1.5)
    return script.mark().alone(3.0, 0.4).mark().alone(3.0)


def ending(arm: Arm) -> Script:
    """3 N into the end of the stroke, held there, then back with 2.5 N."""
    script = Script().tare().press([(3.0, 0.2), (3.0, 6.0)])
    return script.mark().press([(-2.5, 0.2), (-2.5, 1.0)]).alone(1.0)


TREMBLES = (8.0, 10.0, 12.0)


def trembling(arm: Arm) -> Script:
    """A hand that leads and trembles with 0.5 N."""
    script = Script().tare()
    for hertz in TREMBLES:
        for way in (1, -1):
            script.mark().lead(arm, [(way * SPEED, 2.0)], tremble=(0.5, hertz)).alone(1.0)
    return script
