"""How long an identification still takes at least, from what it says while it goes.

How many effects there are nobody knows before. Certain are the stages to come, each with one round of
effects at least, and how long a stage takes beside those that are over.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from idtool.diagnosis.diagnose import BASE, FINAL
from idtool.diagnosis.selection import ACCEPTED
from idtool.presentation.pace import LEAST_TOLD_S, spoken
from idtool.verbs.identify import READING, SEARCHING

#: Stages that come whatever the logs hold; a round of effects that ends with one is followed by another.
_STAGES = (READING, SEARCHING, BASE, FINAL)
#: Least times of later stages in times of an earlier one: what some sessions took, rounded down. The base
#: model's stage holds the first round.
_OF_READING = {SEARCHING: 4.0}
_OF_SEARCHING = {BASE: 0.8, ACCEPTED: 0.4, FINAL: 0.1}


class Expected:
    """The time that is left, as far as it is certain, and how much is done.

    `hear` is told each sentence.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._began = self._since = clock()
        self._stage = ""
        self._took: dict[str, float] = {}
        self._done = 0.0

    def hear(self, sentence: str) -> None:
        """A sentence on what is being done now."""
        stage = next((one for one in (*_STAGES, ACCEPTED) if sentence.startswith(one)), None)
        if stage is None:
            return
        now = self._clock()
        if self._stage:
            self._took[self._stage] = now - self._since
        self._stage, self._since = stage, now

    @property
    def left_s(self) -> float | None:
        """Seconds that it takes at least; None before anything is known."""
        if READING not in self._took:
            return None
        times, stage = self._times, self._stage
        to_come = _STAGES[_STAGES.index(BASE if stage == ACCEPTED else stage) + 1 :]
        rest = max(times[stage] - (self._clock() - self._since), 0.0)
        return rest + sum(times[one] for one in to_come)

    @property
    def words(self) -> str:
        """The time that is left, for a person; nothing once what was certain has passed."""
        left = self.left_s
        return "" if left is None or left < LEAST_TOLD_S else f"at least {spoken(left)} left"

    @property
    def share(self) -> float | None:
        """How much is done, from 0 to 1, if two more effects are found; never less than it was.

        None before anything is known.
        """
        left = self.left_s
        if left is None:
            return None
        more = 0.0 if self._stage == FINAL else 2.0 * self._times[ACCEPTED]
        passed = self._clock() - self._began
        self._done = max(self._done, passed / max(passed + left + more, 1e-9))
        return self._done

    @property
    def _times(self) -> dict[str, float]:
        """Least time of each stage, s."""
        search = self._took.get(SEARCHING, _OF_READING[SEARCHING] * self._took[READING])
        times = {SEARCHING: search} | {stage: share * search for stage, share in _OF_SEARCHING.items()}
        # a round is as long as the one before
        return times | {ACCEPTED: self._took.get(ACCEPTED, times[ACCEPTED])}
