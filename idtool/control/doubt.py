"""How far the model may be wrong at this motion, kept up to date a piece a sample.

The covariance of `Certainty` is most of the light law's arithmetic, more than a small board has time for in
one period. Little of it is urgent: what the axis learns lasts for minutes, and the doubt of a motion changes
as slowly as the motion does. So each sample takes one turn of it,

    FADE, SPARE, VARIANCE, DEVIATION, FADE, ...     what the bristle forgot; nothing; the doubt of this motion

and what is learned takes the turns from LEARN to LEARNT, after which it counts. Only the mean, which the
hand's torque is read with, fades at every sample. Until the turn comes a new doubt is stated by its bound.
"""

from __future__ import annotations

import math
from typing import final

from idtool.control.certainty import BRISTLE, Certainty

#: So many standard deviations are left for the hand to carry.
COVERAGE = 2.0
#: How stiff a bristle is, is not known well: the doubt forgets this share of what the mean does.
FORGETS = 0.75
#: The turns. What is learned takes those from LEARN to LEARNT.
FADE, SPARE, VARIANCE, DEVIATION, LEARN, LEARNT = 0, 1, 2, 3, 4, 9
#: So many samples from a turn to the next of its kind, and from one that a motion teaches to the next.
TURNS, LEARN_EVERY = 4, 8


@final
class Doubt:
    """`Certainty`, and what it says of the motion.

    Attributes:
        certainty: what is known.
        value: COVERAGE standard deviations of the corrected model, N m (N).
        unexplained: what an axis that hardly moves may be wrong by beside that, a deviation too, N m (N).
        turn: which this sample took.
    """

    def __init__(self, certainty: Certainty) -> None:
        self.certainty = certainty
        self._held: tuple[float, float, float, float] | None = None
        self.turn = DEVIATION
        self.reset()

    def reset(self) -> None:
        """Nothing was learned."""
        self._held = None
        self.certainty.reset()
        self.unexplained = 0.0
        self.begin()

    def begin(self) -> None:
        """The bristle is unknown; what was learned counts, what was felt at this very sample does not."""
        if self.turn >= LEARN:
            self.finish()
        self._held = None
        self.certainty.unsettle_bristle()
        self.value = self._variance = 0.0
        self._kept = 1.0
        self._rests = self._sure = True
        self.turn = DEVIATION

    def follow(self, kept: float, elastic: float, damping: float, slow: float) -> None:
        """Take one turn.

        Args:
            kept: share of a bristle's deflection that outlived the travel since the last sample.
            elastic, damping: the model's friction torques now, N m (N).
            slow: 1 at rest, 0 from the speed on at which `unexplained` does not count.
        """
        self.certainty.mean[BRISTLE] *= kept
        self._kept *= kept
        if self.turn == FADE:
            self.turn = SPARE
        elif self._held is not None:
            self.turn = max(self.turn + 1, LEARN)
        else:
            self.turn = self.turn + 1 if self.turn < DEVIATION else FADE
        if self.turn == FADE:
            self._fade()
        elif self.turn == VARIANCE:
            self._variance = self.certainty.variance(elastic, damping)
        elif self.turn == DEVIATION:
            self.value = COVERAGE * math.hypot(math.sqrt(self._variance), slow * self.unexplained)
        elif self.turn == LEARNT:
            self.finish()

    def _fade(self) -> None:
        self.certainty.fade_covariance(1.0 - FORGETS * (1.0 - self._kept))
        self._kept = 1.0

    def learn(self, surprise: float, elastic: float, damping: float, noise: float) -> None:
        """Learn from a sample in motion while no hand touches, in the turns to come: `Certainty.learn`."""
        self.finish()
        self._fade()
        self._held = surprise, elastic, damping, noise
        self._rests = False
        self.turn = min(self.turn, DEVIATION)

    def settle(self, surprise: float, elastic: float, damping: float, noise: float, *, sure: bool) -> None:
        """Explain all of a surprise at rest: put it on the bristle now, and in the turns to come what of it
        is not the bristle's where it belongs. Unless it is `sure`, what stays is in doubt."""
        self.learn(surprise, elastic, damping, noise)
        self._rests, self._sure = True, sure
        self.certainty.shift(surprise)
        if not sure:
            self.value += abs(surprise)

    def drift(self, load: float, friction: float) -> None:
        """`Certainty.drift`."""
        self.finish()
        self.certainty.drift(load, friction)

    def unsettle(self, deviation: float) -> None:
        """The bristle may hold more by this standard deviation, N m (N)."""
        self.finish()
        self._fade()
        self.certainty.shift(0.0, deviation)
        self.value += COVERAGE * deviation

    def finish(self) -> None:
        """Learn now what is held."""
        if self._held is None:
            return
        surprise, elastic, damping, noise = self._held
        bristle = self.certainty.mean[BRISTLE]
        left = self.certainty.take_in(surprise, elastic, damping, noise)
        if self._rests:
            self.certainty.shift(left - surprise, 0.0 if self._sure else abs(left) / COVERAGE)
        # what was put on the bristle has faded since
        change = self.certainty.mean[BRISTLE] - bristle
        self.certainty.mean[BRISTLE] = bristle + self._kept * change
        self._held = None
        self.turn = LEARNT

    def restore(self, certainty: Certainty) -> None:
        """Go back to what was known; what is held is dropped."""
        self.certainty = certainty
        self._held = None
        self._kept = 1.0
        self.turn = LEARNT
