"""docs/simulation.md: how far off simulated positions are, ours beside those of other programs."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from idtool.parameters import Parameters
from idtool.simulation.stage import Source

WHOLE = "none"
Fits = Sequence[Mapping[str, Any]]
SOURCES: tuple[Source, ...] = ("goal", "effort")
#: What BAM's own models leave on the same, by `make study-bam`.
BAM = Path("docs/bam.json")
#: What of that is aimed at.
GOAL = 0.8


@dataclass(frozen=True)
class LeftOut:
    """What was left out, fitted without it.

    Attributes:
        title: its name.
        parameters: our file, of the other logs.
        evaluations, seconds: how often our fit simulated these, and its processor time.
        ours: from what it is driven -> mean absolute error on each log left out, mrad.
        theirs: BAM's fits, as docs/bam.json holds them.
    """

    title: str
    parameters: Parameters
    evaluations: int
    seconds: float
    ours: dict[Source, list[float]]
    theirs: Fits

    @property
    def cells(self) -> list[str]:
        """Of its row of the table."""
        cells = [self.title]
        for source, errors in self.ours.items():
            each = f" ({', '.join(f'{one:.0f}' for one in errors)})" if self.title != WHOLE else ""
            ratio = self.ratio(source)
            cells += [f"{np.mean(errors):.1f}{each}", self._best(source)]
            cells.append(f"{ratio:.3f}" if ratio <= GOAL else f"**{ratio:.3f}**")
        work = [float(np.mean([one[key] for one in self.theirs])) for key in ("evaluations", "seconds")]
        cells += [f"{self.evaluations:,} in {self.seconds:.0f} s", f"{work[0]:,.0f} in {work[1]:.0f} s"]
        return cells

    def ratio(self, source: Source) -> float:
        """Our error over that of BAM's best fit."""
        return float(np.mean(self.ours[source])) / min(_mean(one, source) for one in self.theirs)

    def nearest(self, source: Source) -> float:
        """What that fit of BAM's leaves that is nearest to the logs that it was fitted to, mrad."""
        return _mean(min(self.theirs, key=lambda one: one["fitted"]), source)

    def _best(self, source: Source) -> str:
        best = min(self.theirs, key=lambda one: _mean(one, source))
        seeds = [_mean(one, source) for one in self.theirs if one["model"] == best["model"]]
        return f"{_mean(best, source):.1f} ({best['model']}: {min(seeds):,.0f} to {max(seeds):,.0f})"


def _mean(one: Mapping[str, Any], source: Source) -> float:
    return float(np.mean(one[source]))


def verdict(found: Sequence[LeftOut]) -> str:
    """In how many ours is near enough, and what BAM's leave to one who does not know the answer."""
    sentences = []
    for source, name in zip(SOURCES, ("goals", "duty"), strict=True):
        far = [f"{one.title} ({one.ratio(source):.3f})" for one in found if one.ratio(source) > GOAL]
        sentences.append(
            f"From the {name} ours is at most {GOAL:g} of BAM's best in {len(found) - len(far)} of "
            f"{len(found)}{', not with ' + ', '.join(far) if far else ''}."
        )
    nearest = (", ".join(f"{one.nearest(source):.0f}" for one in found) for source in SOURCES)
    sentences.append(
        "One who does not know the answer takes the fit that is nearest to its own logs; of BAM's that one "
        "leaves, in the order of the rows, {} mrad from the goals and {} from the duty.".format(*nearest)
    )
    return textwrap.fill(" ".join(sentences), 110)
