"""A simulated hand: it grasps, pushes one way, holds, lets go and pushes back.

A hand acts at the moving part (the slide), the controller works at the shaft. The file itself says how
the two hang together: `per_payload` is the gravity torque of one kilogram at the moving part, so with
g = 9.80665 m/s^2

    travel per rad = per_payload / g,    torque = force * per_payload / g,    v = w * per_payload / g

(2 r N1 for the paper's slide, of which r was never printed). An arm has no such number: there the hand
is told in N m and rad.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

from idtool.errors import InputError
from idtool.model.units import STANDARD_GRAVITY
from idtool.parameters import Parameters

#: How fast fingers close on or leave the grip, s.
_GRIP_S = 0.05
#: How long an arm takes to speed up and to slow down, s.
_RISE_S = 0.25
#: Of a relaxed human arm: see `ImpedanceHand.at_slide`.
_DAMPING_N_S_PER_M = 20.0


def travel_per_position(parameters: Parameters) -> float | None:
    """Travel of the moving part per unit of the shaft's position, m/rad (1 on a linear axis).

    None where the file does not determine it (an arm).
    """
    if parameters.axis.kind == "linear":
        return 1.0
    slope = parameters.gravity.get("per_payload")
    if parameters.gravity_model != "slide" or slope is None or slope.value <= 0.0:
        return None
    return slope.value / STANDARD_GRAVITY


@dataclass(frozen=True)
class Push:
    """One push: grasp, move, perhaps hold still, let go, leave it alone.

    Attributes:
        direction: +1 or -1.
        push_s: how long it pushes.
        hold_s: how long it then holds the grip still before it lets go; 0 lets go while moving.
        rest_s: how long the axis is left alone afterwards.
    """

    direction: int
    push_s: float = 2.0
    hold_s: float = 0.0
    rest_s: float = 1.0

    @property
    def duration(self) -> float:
        """Whole length, s."""
        return self.push_s + self.hold_s + self.rest_s


#: Both ways, let go while moving; then both ways with a pause of the hand before it lets go.
SEQUENCE: tuple[Push, ...] = (Push(1), Push(-1), Push(1, hold_s=0.6), Push(-1, hold_s=0.6))


@dataclass(frozen=True)
class Phase:
    """Where a hand is in its sequence.

    Attributes:
        push: index of the push, -1 before the first.
        name: "rest", "push" or "hold".
        elapsed: time since the grasp, s.
    """

    push: int
    name: str
    elapsed: float


class Hand(ABC):
    """Works through a sequence of pushes; sub-classes say how hard it pushes."""

    def __init__(self, sequence: Sequence[Push] = SEQUENCE, *, start_s: float = 0.6) -> None:
        """Plan the sequence.

        Args:
            sequence: the pushes, one after another.
            start_s: hands off for so long first, s.

        Raises:
            InputError: an empty sequence, a direction other than +-1, or a length that is not positive.
        """
        if not sequence or any(
            p.direction not in (1, -1) or not p.push_s > 0 or p.hold_s < 0 or not p.rest_s > 0
            for p in sequence
        ):
            raise InputError(
                "a hand needs pushes of direction +1 or -1 and positive length", place="sequence"
            )
        self.sequence = tuple(sequence)
        self.starts: list[float] = []
        clock = start_s
        for push in self.sequence:
            self.starts.append(clock)
            clock += push.duration
        self.duration = clock

    def phase(self, time: float) -> Phase:
        """Where the hand is at `time` s."""
        for index in reversed(range(len(self.starts))):
            elapsed = time - self.starts[index]
            if elapsed >= -1e-9:
                push = self.sequence[index]
                if elapsed < push.push_s - 1e-9:
                    return Phase(index, "push", elapsed)
                if elapsed < push.push_s + push.hold_s - 1e-9:
                    return Phase(index, "hold", elapsed)
                return Phase(index, "rest", elapsed)
        return Phase(-1, "rest", time)

    def torque(self, time: float, position: float, velocity: float) -> float:
        """Torque of the hand at the shaft, N m (N), positive pushes +q; 0 while it does not touch."""
        phase = self.phase(time)
        if phase.name == "rest":
            self._leave()
            return 0.0
        return self._push(phase, self.sequence[phase.push], position, velocity)

    @abstractmethod
    def _leave(self) -> None:
        """It does not touch: forget the grasp. (It lets go at once, the hardest case for the axis.)"""

    @abstractmethod
    def _push(self, phase: Phase, push: Push, position: float, velocity: float) -> float:
        """Torque at the shaft while it touches."""


@final
class ConstantForceHand(Hand):
    """Pushes with one torque, risen to smoothly as fingers close. A hold is no push at all but a grip."""

    def __init__(
        self,
        torque: float,
        sequence: Sequence[Push] = SEQUENCE,
        *,
        start_s: float = 0.6,
        rise_s: float = _GRIP_S,
    ) -> None:
        """`torque` at the shaft, N m (N), above zero."""
        super().__init__(sequence, start_s=start_s)
        if not 0.0 < torque < math.inf:
            raise InputError("the hand's torque must be above zero", place="torque")
        self._torque = torque
        self._rise = rise_s

    def _leave(self) -> None:
        """Nothing to forget."""

    def _push(self, phase: Phase, push: Push, position: float, velocity: float) -> float:
        if phase.name == "hold":
            return 0.0
        return push.direction * self._torque * smooth(phase.elapsed / self._rise)


@final
class ImpedanceHand(Hand):
    """A spring and a damper between the grip and where the hand wants to be.

    The wanted place starts where the grip is at the grasp, speeds up smoothly, moves at `speed`, slows
    down and stands still while it holds.
    """

    def __init__(
        self,
        speed: float,
        stiffness: float,
        damping: float,
        sequence: Sequence[Push] = SEQUENCE,
    ) -> None:
        """Everything at the shaft.

        Args:
            speed: wanted speed, rad/s (m/s).
            stiffness, damping: N m/rad and N m s/rad (N/m, N s/m).
            sequence: the pushes, one after another.

        Raises:
            InputError: a speed, stiffness or damping that is not positive.
        """
        super().__init__(sequence)
        if not (speed > 0 and stiffness > 0 and damping >= 0):
            raise InputError("the hand needs speed and stiffness above zero", place="ImpedanceHand")
        self._speed, self._stiffness, self._damping = speed, stiffness, damping
        self._grasp: float | None = None

    @classmethod
    def at_slide(
        cls,
        parameters: Parameters,
        *,
        speed_mm_s: float = 20.0,
        stiffness_n_per_m: float = 1000.0,
        sequence: Sequence[Push] = SEQUENCE,
    ) -> ImpedanceHand:
        """A hand told in the units of the moving part.

        Stiffness and damping default to a relaxed human arm (Dolan, Friedman & Nagurka, IEEE Trans.
        Syst. Man Cybern. 23(3), 1993: some hundred N/m, some ten N s/m). Where the file does not say
        how the part moves, one radian counts as 0.05 m.
        """
        ratio = travel_per_position(parameters) or 0.05
        return cls(
            speed_mm_s * 1e-3 / ratio,
            stiffness_n_per_m * ratio**2,
            _DAMPING_N_S_PER_M * ratio**2,
            sequence,
        )

    def target(self, push: Push, elapsed: float) -> tuple[float, float]:
        """Wanted displacement since the grasp, and its speed; rad, rad/s (m, m/s)."""
        displacement, speed = _ramp(elapsed, self._speed)
        over = elapsed - push.push_s
        if over > 0.0:  # slow down: the ramp again, taken off
            less, slower = _ramp(over, self._speed)
            displacement, speed = displacement - less, speed - slower
        return push.direction * displacement, push.direction * speed

    def _leave(self) -> None:
        self._grasp = None

    def _push(self, phase: Phase, push: Push, position: float, velocity: float) -> float:
        if self._grasp is None:
            self._grasp = position
        wanted, speed = self.target(push, phase.elapsed)
        torque = self._stiffness * (self._grasp + wanted - position) + self._damping * (speed - velocity)
        return torque * smooth(phase.elapsed / _GRIP_S)


def smooth(share: float) -> float:
    """A step from 0 to 1 without a corner: 3 s^2 - 2 s^3, held outside 0 to 1."""
    s = min(max(share, 0.0), 1.0)
    return s * s * (3.0 - 2.0 * s)


def _ramp(elapsed: float, speed: float) -> tuple[float, float]:
    """Travel and speed of a start that reaches `speed` smoothly."""
    s = min(elapsed / _RISE_S, 1.0)
    travel = speed * _RISE_S * s**3 * (1.0 - 0.5 * s)
    return travel + speed * max(elapsed - _RISE_S, 0.0), speed * smooth(s)
