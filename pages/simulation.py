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
from pages import markdown

WHOLE = "none"
Fits = Sequence[Mapping[str, Any]]
SOURCES: tuple[Source, ...] = ("goal", "effort")
#: What BAM's own models leave on the same, by `make study-bam`.
BAM = Path("docs/bam.json")
#: What of that is aimed at.
GOAL = 0.8

TEXT = """# How far off simulated positions are

You get: how far the simulated position of an identified axis strays on real machines.

Made by `make study-simulate`, from recordings of real machines that are not shipped. Definitions: an error
of the position is simulated less measured; over windows of one second each window starts from the measured
state and the rms is taken over all rows of all windows; a mean absolute error is over a whole trial,
simulated from its first row alone.

## Beside MuJoCo's own identification

Driven by the measured torque or current, rms over windows of one second, on the recording that was fitted
(as theirs): `ffc-id fit-motion LOG -p motion.toml`, `ffc-id simulate LOG -p motion.toml`. Fitting simulates
so many seconds of motion a second; the last column is `ffc-id simulate` at its fine step, reading and
smoothing the log included.

| machine | ours | MuJoCo's | better | fit, processor time | fit, times real time | `simulate` |
|---|---|---|---|---|---|---|
{mujoco}

## A servo without current sensing, on what was not fitted

BAM's own logs of a DYNAMIXEL XL330 that swings 0.49 kg on 0.1 m: three gains, three trajectories, duty and
supply voltage in place of a current. One gain, or one trajectory, is left out, the rest is fitted, what was
left out is simulated. Mean absolute error, mrad, mean (each of the three logs), driven by the goals and by
the duty times the supply.

BAM's models M1 to M6 were fitted to the same six logs and judged on the same three (`make study-bam`):
formulas, step of 5 ms, ranges and the error that is minimised are BAM's, written anew in `testbench/bam.py`;
driven by the goals, by CMA-ES with 30 points a generation, from three seeds, up to 30,000 evaluations a fit.
"BAM's best" is the least of these 18 fits on what was left out, chosen with the answer known (its model: what
the seeds of that model leave). Ours in bold is more than {goal:g} of it. The last row is no prediction: it is
fitted to all nine and judged on the same.

| left out | goals: ours | BAM's best | ratio | duty: ours | BAM's best | ratio | our fit | one of BAM's 18 |
|---|---|---|---|---|---|---|---|---|
{bam}

{verdict}

The last two columns are evaluations, each a simulation of the logs fitted, and processor time, both compiled.
Gain 800 is the only one at which the duty goes beyond 0.6, so that leaving it out asks for the bend of the
line from duty to torque where nothing showed it. At gain 800 sin_sin lifts the arm with the full duty
further up than any other log does; the fit without it stops the arm short of that.

![Measured and simulated position of logs that no fit saw](images/simulation.png)

## Beside the independent plant

The simulated rig integrates its own formulas in steps of 0.1 ms (`idtool/rig/plant.py`). With the true
numbers and its logged current our simulation is {plant:.2f} mrad off (rms over windows of one second) on a
motion over {way:.0f} mrad; the current is logged every 5 ms and taken as straight between.
"""


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
    def row(self) -> str:
        """Of the table."""
        cells = [self.title]
        for source, errors in self.ours.items():
            each = f" ({', '.join(f'{one:.0f}' for one in errors)})" if self.title != WHOLE else ""
            ratio = self.ratio(source)
            cells += [f"{np.mean(errors):.1f}{each}", self._best(source)]
            cells.append(f"{ratio:.3f}" if ratio <= GOAL else f"**{ratio:.3f}**")
        work = [float(np.mean([one[key] for one in self.theirs])) for key in ("evaluations", "seconds")]
        cells += [f"{self.evaluations:,} in {self.seconds:.0f} s", f"{work[0]:,.0f} in {work[1]:.0f} s"]
        return markdown.row(cells)

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
