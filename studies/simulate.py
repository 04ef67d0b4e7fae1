"""How far off simulated positions are, on recordings of real machines: docs/simulation.md.

python -m studies.simulate [--folder FOLDER]        (make study-simulate, some minutes)

The recordings are not shipped; the folder is `$FFC_ID_SHARED/measured`, or `shared/measured` beside the
project.
"""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np

from idtool import Log, Parameters
from idtool.experiment.recipe import read_recipe
from idtool.importing import import_recording
from idtool.presentation import style
from idtool.presentation.text import words
from idtool.rig.opening import read_plant
from idtool.rig.simulated import SimulatedRig
from idtool.simulation.stage import Source
from idtool.verbs.fit_motion import fit_motion
from idtool.verbs.simulate import simulate
from pages import markdown
from pages.simulation import BAM, SOURCES, WHOLE, Fits, LeftOut, verdict
from studies.measured import BY_NAME, default_folder
from testbench.bam import SPLITS, TRAJECTORIES, bam_logs
from testbench.guided_axes.cases import file_of
from testbench.plants import recorded

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PICTURE = Path("docs/images/simulation.png")
#: Recording -> (name, rms over windows of 1 s that MuJoCo's own identification reaches, unit).
MUJOCO = {
    "emps": ("EMPS", 1.4, "mm"),
    "ur_1": ("UR10e, joint 1", 10.0, "mrad"),
    "ur_3": ("UR10e, joint 3", 20.0, "mrad"),
}
_MUJOCO_HEAD = (
    *("machine", "ours", "MuJoCo's", "better"),
    *("fit, processor time", "fit, times real time", "`simulate`"),
)
_BAM_HEAD = (
    *("left out", "goals: ours", "BAM's best", "ratio", "duty: ours", "BAM's best", "ratio"),
    *("our fit", "one of BAM's 18"),
)
#: Of these the picture shows a log.
DRAWN = ("gain 200", *(f"trajectory {kind}" for kind in TRAJECTORIES))


def main_table(folder: Path) -> list[str]:
    """The comparison with MuJoCo."""
    rows = []
    for name, (title, theirs, unit) in MUJOCO.items():
        log = import_recording(folder / BY_NAME[name].file, **BY_NAME[name].options).log
        begin = time.process_time()
        fit = fit_motion([log])
        spent = time.process_time() - begin
        begin = time.process_time()
        found = simulate(log, fit.parameters)
        pace = found.seconds / (time.process_time() - begin)
        ours = 1e3 * found.rms_windows
        rows.append(
            (
                title,
                f"{ours:.2f} {unit}",
                f"{theirs:g} {unit}",
                "yes" if ours < theirs else "**no**",
                f"{spent:.1f} s",
                f"{fit.evaluations * found.seconds / max(spent, 1e-9):,.0f}",
                f"{pace:,.0f}",
            )
        )
    return markdown.table(_MUJOCO_HEAD, rows)


def left_out(title: str, logs: dict[tuple[int, str], Log], theirs: Fits) -> LeftOut:
    """Fit without some logs and simulate these; all of them where none is left out."""
    out = SPLITS.get(title, [])
    begin = time.process_time()
    fit = fit_motion([log for key, log in logs.items() if key not in out])
    spent = time.process_time() - begin
    ours: dict[Source, list[float]] = {
        source: [1e3 * simulate(logs[key], fit.parameters, source).mean_abs for key in out or logs]
        for source in SOURCES
    }
    return LeftOut(title, fit.parameters, fit.evaluations, spent, ours, theirs)


def plant_agreement() -> tuple[float, float]:
    """Ours beside the independent plant on the same current: rms over windows of 1 s and the way, mrad."""
    file = replace(read_plant("bench"), effects={}, sensors="ideal")
    (log,) = recorded(SimulatedRig(file, seed=0), [read_recipe("sine")])
    found = simulate(log, file_of(file))
    return 1e3 * found.rms_windows, 1e3 * float(np.ptp(log.frame["position_rad"]))


@style.styled
def picture(drawn: Sequence[tuple[str, Log, Parameters]]) -> Figure:
    """Measured and simulated position of logs that no fit saw; what was left out, the log, the file."""
    count = len(drawn)
    figure, axes = style.panels(
        count, width=style.WIDE, height=1.4 + 1.9 * count, gap=(0.3, 0.56), top=0.88, share="x"
    )
    style.title(figure, "Position of logs that no fit saw")
    for panel, (out, log, parameters) in zip(axes, drawn, strict=True):
        frame = log.frame
        panel.plot(frame["time_s"], frame["position_rad"], color=style.UNDER, lw=4.2, label="measured")
        goal = frame["position_command_rad"]
        panel.plot(frame["time_s"], goal, color=style.MEASURED, lw=1.0, ls=(0, (4, 2)), label="goal")
        for source, colour, name in (
            ("goal", style.AFTER, "simulated from the goal"),
            ("effort", style.BEFORE, "simulated from the duty"),
        ):
            path = simulate(log, parameters, source).frame["position_simulated_rad"]  # type: ignore[arg-type]
            panel.plot(frame["time_s"], path, color=colour, lw=1.1, label=name)
        gain = f"gain {log.header['drive']['gain_setting']:g}"
        panel.set_title(f"{gain}, {words(log.experiment)}; fitted without {out}")
        panel.set_ylabel("Position, rad")
        panel.margins(x=0.01)
    axes[-1].set_xlabel("Time, s")
    style.legend(figure, axes[0])
    figure.align_ylabels()
    return figure


@click.command()
@click.option("--folder", type=click.Path(path_type=Path), default=default_folder)
def main(folder: Path) -> None:
    """Write the page and its picture."""
    plant, way = plant_agreement()
    mujoco = main_table(folder)
    logs = bam_logs(folder)
    theirs = json.loads(BAM.read_text())
    found = [left_out(title, logs, theirs[title]) for title in (*SPLITS, WHOLE)]
    drawn = [
        (words(one.title), logs[SPLITS[one.title][1]], one.parameters) for one in found if one.title in DRAWN
    ]
    style.save(picture(drawn), PICTURE)
    parts = {
        "mujoco": mujoco,
        "bam": [*markdown.table(_BAM_HEAD, (one.cells for one in found)), "", verdict(found[:-1])],
        "plant": [
            f"With the true numbers and its logged current our simulation is {plant:.2f} mrad off",
            f"(rms over windows of one second) on a motion over {way:.0f} mrad.",
        ],
    }
    markdown.write_made("docs/simulation.md", parts, "study-simulate")


if __name__ == "__main__":
    main()
