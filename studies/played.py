"""A path that a hand taught on `sim:paper`, and played back: `make study-played` draws it for docs/guiding.md
and prints the figures of that page.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import click
import numpy as np

from idtool.control import ForceFreeController
from idtool.guiding import ConstantForceHand, teach
from idtool.guiding.path import TaughtPath, limited, read_path
from idtool.guiding.playback import Played, play
from idtool.guiding.session import limits_of
from idtool.model.units import STANDARD_GRAVITY
from idtool.rig import open_rig
from idtool.rig.base import TrialSetup
from studies.teach_paper import FORCE_N, PRINTED_GAINS
from testbench.guided_axes.cases import PAYLOAD_KG, file_of, plant_of

RIG = "sim:paper"
#: Of the taught speed; the last is more than the acceleration allows.
SCALES = (0.5, 1.0, 3.0)
SETUP = TrialSetup(PAYLOAD_KG, start_position=0.0)


def taught(folder: Path) -> TaughtPath:
    """What the simulated hand taught."""
    file = file_of(plant_of("paper"), PRINTED_GAINS, effects=False)
    hand = ConstantForceHand(FORCE_N * file.gravity["per_payload"].value / STANDARD_GRAVITY)
    with open_rig(RIG, seed=0) as rig:
        law = ForceFreeController(file, limits=limits_of(rig))
        teach(file, law, rig, SETUP, hand=hand, log=folder / "taught.csv")
    return read_path(folder / "taught.csv")[0]


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
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    mm = 1e3 * plant_of("paper").gravity["per_payload_nm_per_kg"] / STANDARD_GRAVITY
    with tempfile.TemporaryDirectory() as folder:
        path = taught(Path(folder))
    figure = Figure(figsize=(8.0, 5.2), layout="constrained")
    FigureCanvasAgg(figure)
    upper, lower = figure.subplots(2, 1, sharex=True)
    upper.plot(path.time, mm * path.position, color="0.2", lw=2.5, label="taught, smoothed")
    for scale in SCALES:
        run, got = played(path, scale)
        time = got * (run.time - run.time[0])  # as it was taught
        name = f"played at {got:.2g} of its speed"
        upper.plot(time, mm * run.position, lw=1.0, label=name)
        lower.plot(time, mm * (run.position - run.wanted), lw=1.0, label=name)
        worst = mm * float(np.max(np.abs(run.position - run.wanted)))
        click.echo(f"{name}: {mm * run.rms_error:.3f} mm rms, {worst:.3f} mm at worst")
    upper.set_ylabel("slide (mm)")
    lower.set_ylabel("error (mm)")
    lower.set_xlabel("time of the teaching (s)")
    for axes in (upper, lower):
        axes.grid(alpha=0.25)
        axes.margins(x=0.0)
    figure.legend(
        *upper.get_legend_handles_labels(),
        loc="outside upper center",
        ncols=4,
        fontsize="small",
        frameon=False,
    )
    figure.savefig(out, dpi=110)


if __name__ == "__main__":
    main()
