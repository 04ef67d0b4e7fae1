"""Experiments: which trials a session consists of."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from testbench.other_plants.axes import Machine
from testbench.other_plants.motion import TICK
from testbench.other_plants.physics import Array
from testbench.other_plants.profiles import (
    HARD,
    SMOOTH,
    back_and_forth,
    hold,
    move,
    multisine,
    staircase,
    swing_up,
)

_SIDE = round(math.pi / 2.0, 6)


@dataclass(frozen=True)
class Trial:
    """One trial: commanded positions and how the axis stands."""

    wanted: Array
    payload: float = 0.0
    alpha: float = 0.0
    beta: float = 0.0

    @property
    def seconds(self) -> float:
        """How long it is."""
        return len(self.wanted) * TICK


Run = tuple[str, list[Trial]]


class Planner:
    """Makes runs that suit one machine."""

    def __init__(self, machine: Machine, rng: np.random.Generator) -> None:
        self.machine, self.rng = machine, rng
        self.half = machine.axis.half_stroke
        self.middle = machine.axis.middle
        self.alpha = _SIDE if machine.kind == "slide" else 0.0

    def style(self) -> str:
        """How moves begin and end; soft machines never know a corner."""
        return str(self.rng.choice(SMOOTH if self.machine.soft else HARD))

    def _ramp(self) -> float:
        return self.rng.uniform(0.2, 0.5) if self.machine.soft else self.rng.uniform(0.05, 0.15)

    def _trial(self, wanted: Array, payload: float = 0.0, alpha: float | None = None) -> Trial:
        return Trial(wanted, payload, self.alpha if alpha is None else alpha)

    def _moves(
        self, travel: float, speed: float, times: int, style: str, ramp: float, rest: float = 0.2
    ) -> Array:
        """Back and forth over a share of half the stroke at a share of the speed."""
        travel, speed = travel * self.half, speed * self.machine.speed
        return back_and_forth(self.middle, travel, speed, times, style, ramp, rest)

    def payloads(self, several_tilts: bool) -> Run:
        """Slowly up and down at each payload."""
        trials = []
        style = "s-curve" if self.machine.soft else "trapezoid"
        for number, payload in enumerate(np.linspace(0.0, 1.5, 6)):
            for alpha in (0.0, 0.6) if several_tilts and number % 2 else (0.0,):
                moves = self._moves(0.6, 0.35, 1, style, self._ramp())
                trials.append(self._trial(moves, round(float(payload), 3), alpha))
        return "payloads", trials

    def side_payloads(self) -> Run:
        """The same lying on its side, where a payload should not matter."""
        moves = self._moves(1.0, 0.5, 1, "s-curve", 0.3)
        return "side", [self._trial(moves, payload, _SIDE) for payload in (0.0, 0.7, 1.4)]

    def speeds(self) -> Run:
        """Constant speeds both ways over most of the stroke."""
        trials = []
        style = "s-curve" if self.machine.soft else str(self.rng.choice(HARD))
        for share, way in ((0.1, 0.5), (0.2, 0.9), (0.35, 1.3), (0.6, 1.7), (1.0, 1.7)):
            trials.append(self._trial(self._moves(way, share, 1 if share < 0.9 else 2, style, self._ramp())))
        return "speeds", trials

    def sweep(self) -> Run:
        """Slowly over the whole stroke."""
        return "slow_sweep", [self._trial(self._moves(1.9, 0.3, 1, "s-curve", 0.3))]

    def sines(self) -> Run:
        """A ladder of frequencies."""
        trials = []
        for f in (0.15, 0.4, 1.0):
            reach = min(0.8 * self.half, 0.8 * self.machine.speed / (2.0 * math.pi * f))
            seconds = max(5.0, 2.0 / f)
            t = np.arange(0.0, seconds, TICK)
            fade = 0.5 - 0.5 * np.cos(math.pi * np.clip(t * f, 0.0, 1.0)) if self.machine.soft else 1.0
            trials.append(self._trial(self.middle + reach * fade * np.sin(2.0 * math.pi * f * t)))
        return "sines", trials

    def fast(self) -> Run:
        """Faster sines, where a resonance or a late reading shows."""
        frequencies = tuple(f for f in (2.0, 3.2, 5.0, 7.0) if f < self.machine.rate / 14.0)
        trials = []
        for f in frequencies:
            reach = 0.5 * self.machine.speed / (2.0 * math.pi * f)
            t = np.arange(0.0, 4.0, TICK)
            fade = np.clip(t * f / 2.0, 0.0, 1.0)
            trials.append(self._trial(self.middle + reach * fade * np.sin(2.0 * math.pi * f * t)))
        return "fast_sines", trials

    def multi(self) -> Run:
        """Random multi-sines."""
        trials = []
        for _ in range(2):
            frequencies = self.rng.uniform((0.08, 0.2, 0.4, 0.8), (0.15, 0.4, 0.8, 1.5)).tolist()
            wanted = multisine(
                self.rng,
                self.middle,
                0.85 * self.half,
                self.machine.speed,
                frequencies,
                10.0,
                self.machine.soft,
            )
            trials.append(self._trial(wanted))
        return "multisine", trials

    def swings(self) -> Run:
        """Swings of an arm that grow."""
        reach = 0.9 * self.half
        f = 0.8 * self.machine.speed / (2.0 * math.pi * reach)
        return "swings", [self._trial(swing_up(self.middle, reach, f * k, 10.0)) for k in (0.8, 1.2)]

    def nested(self) -> Run:
        """Reversals inside reversals."""
        trials = [
            self._trial(self._moves(share, 0.25, max(2, int(0.4 / share)), "s-curve", 0.1, 0.05))
            for share in (0.03, 0.06, 0.12, 0.25, 0.5)
        ]
        return "nested", trials

    def pauses(self) -> Run:
        """Starts after rests of different length."""
        trials = []
        for dwell, times in ((0.1, 4), (0.5, 4), (2.0, 3), (6.0, 2)):
            at, way = self.middle - 0.2 * self.half, 0.15 * self.half
            parts = [hold(at, 0.2)]
            for _ in range(times):
                for end in (at + way, at):
                    start = float(parts[-1][-1])
                    parts += [move(start, end, 0.2 * self.machine.speed, "s-curve", 0.4), hold(end, dwell)]
            trials.append(self._trial(np.concatenate(parts)))
        return "pauses", trials

    def validation(self) -> Run:
        """A run of another kind: random point-to-point moves, with payloads where there are any."""
        payloads = (0.0, 0.45, 1.2) if self.machine.kind == "slide" else (0.0, 0.0)
        trials = []
        for number, payload in enumerate(payloads):
            style = "minimum jerk" if self.machine.soft else "trapezoid"
            wanted = staircase(self.rng, self.middle, 0.85 * self.half, 0.9 * self.machine.speed, 6, style)
            trials.append(self._trial(wanted, payload, self.alpha if number == 0 else 0.0))
        return "validation", trials

    def session(self, needs: frozenset[str]) -> list[Run]:
        """A session that shows what `needs` names, with something of its own besides."""
        kind = self.machine.kind
        runs = []
        if kind == "slide":
            runs.append(self.payloads("tilt" in needs or bool(self.rng.random() < 0.3)))
        if kind == "arm":
            runs.append(self.sweep())
        runs.append(self.speeds())
        choice = [self.sines, self.multi] + ([self.swings] if kind == "arm" else [])
        runs += [choice[k]() for k in self.rng.permutation(len(choice))[: 2 if kind == "arm" else 1]]
        extra = {"pauses": self.pauses, "nested": self.nested, "fast": self.fast}
        if kind == "slide":
            extra["tilt"] = self.side_payloads
        if kind != "arm":
            extra["sweep"] = self.sweep
        for name, make in extra.items():
            if name in needs or (not needs and self.rng.random() < 0.15):
                runs.append(make())
        order = self.rng.permutation(len(runs)) if "warm" not in needs else range(len(runs))
        runs = [runs[k] for k in order]
        if "warm" in needs:  # the first run once more, when it is warm
            runs.append((f"{runs[0][0]}_again", runs[0][1]))
        return runs
