"""A path that a hand taught on `sim:paper`, and played back: `make study-played` draws it for docs/guiding.md
and prints the figures of that page.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np

from idtool.guiding.path import TaughtPath, limited, read_path
from idtool.guiding.playback import Played, play
from idtool.model.units import STANDARD_GRAVITY
from idtool.presentation import style
from idtool.rig import open_rig
from idtool.rig.base import TrialSetup
from idtool.rig.opening import read_plant
from studies import teach_paper
from testbench.guided_axes.cases import PAYLOAD_KG

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RIG = "sim:paper"
#: Of the taught speed; the last is more than the acceleration allows.
SCALES = (0.5, 1.0, 3.0)
SETUP = TrialSetup(PAYLOAD_KG, start_position=0.0)


def played(path: TaughtPath, scale: float) -> tuple[Played, float]:
    """The path at this share of its speed, or what the limits leave of that."""
    with open_rig(RIG, seed=0) as rig:
        low, high = rig.limits.position
        inside, got = limited(path, low=low, high=high, speed=rig.limits.speed, scale=scale)
        return play(inside, rig, SETUP), got


@click.command()
@click.option(
    "--out", type=click.Path(path_type=Path), default=Path("docs/images/played.png"), show_default=True
)
def main(out: Path) -> None:
    """Draw the picture and print its figures."""
    mm = 1e3 * read_plant("paper").gravity["per_payload_nm_per_kg"] / STANDARD_GRAVITY
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "taught.csv"
        teach_paper.run("lab", 0, hand=True, log=log)
        path, *_ = read_path(log)
    runs = [played(path, scale) for scale in SCALES]
    for run, got in runs:
        worst = mm * float(np.max(np.abs(run.position - run.wanted)))
        click.echo(f"{name_of(got)}: {mm * run.rms_error:.3f} mm rms, {worst:.3f} mm at worst")
    style.save(draw(path, runs, mm), out)


def name_of(scale: float) -> str:
    """A run in words."""
    return f"played at {scale:.2g} of its speed"


@style.styled
def draw(path: TaughtPath, runs: Sequence[tuple[Played, float]], mm: float) -> Figure:
    """The taught path and the played ones over the time of the teaching, and below what they are off by.

    Args:
        path: as it was taught.
        runs: what was played, and at which share of the taught speed.
        mm: of travel per rad.
    """
    figure, (upper, lower) = style.panels(2, width=style.WIDE, height=5.6, gap=(0.3, 0.25), share="x")
    style.title(figure, "A taught path, played back")
    upper.plot(path.time, mm * path.position, color=style.UNDER, lw=5.0, label="taught, smoothed")
    for (run, got), colour in zip(runs, (style.AFTER, style.BEFORE, style.THIRD), strict=True):
        time = got * (run.time - run.time[0])  # as it was taught
        upper.plot(time, mm * run.position, color=colour, lw=1.1, label=name_of(got))
        lower.plot(time, mm * (run.position - run.wanted), color=colour, lw=1.1)
    upper.set_ylabel("Slide, mm")
    lower.set_ylabel("Error, mm")
    lower.set_xlabel("Time of the teaching, s")
    for panel in (upper, lower):
        panel.margins(x=0.0)
    style.legend(figure, upper)
    figure.align_ylabels()
    return figure


if __name__ == "__main__":
    main()
