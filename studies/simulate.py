"""How far off simulated positions are, on recordings of real machines: docs/simulation.md.

python -m studies.simulate [--folder FOLDER]        (make study-simulate, some minutes)

The recordings are not shipped; the folder is `$FFC_ID_SHARED/measured`, or `shared/measured` beside the
project.
"""

from __future__ import annotations

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
from idtool.io.atomic import atomic_write
from idtool.presentation import style
from idtool.presentation.text import words
from idtool.rig.opening import read_plant
from idtool.rig.simulated import SimulatedRig
from idtool.verbs.fit_motion import MotionFit, fit_motion
from idtool.verbs.simulate import simulate
from studies.measured import BY_NAME, default_folder
from testbench.guided_axes.cases import file_of
from testbench.plants import recorded

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE = Path("docs/simulation.md")
PICTURE = Path("docs/images/simulation.png")
#: Recording -> (name, rms over windows of 1 s that MuJoCo's own identification reaches, unit).
MUJOCO = {
    "emps": ("EMPS", 1.4, "mm"),
    "ur_1": ("UR10e, joint 1", 10.0, "mrad"),
    "ur_3": ("UR10e, joint 3", 20.0, "mrad"),
}
GAINS = (100, 200, 800)
TRAJECTORIES = ("lift_and_drop", "sin_sin", "up_and_down")
#: The best of BAM's own models refitted to these logs, mean absolute error on a gain, and a trajectory,
#: that are not among them, mrad: driven by the goals, by the duty.
BAM = {"gain": (39.5, 60.0), "trajectory": (29.5, 50.0)}
#: What of it is aimed at.
GOAL = 0.8


def main_table(folder: Path) -> list[str]:
    """Rows of the comparison with MuJoCo."""
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
            f"| {title} | {ours:.2f} {unit} | {theirs:g} {unit} | {'yes' if ours < theirs else '**no**'} | "
            f"{spent:.0f} s | {fit.evaluations * found.seconds / max(spent, 1e-9):,.0f} | {pace:,.0f} |"
        )
    return rows


def bam_logs(folder: Path) -> dict[tuple[int, str], Log]:
    """The nine logs of the XL330."""
    return {
        (gain, kind): import_recording(folder / "xl330" / f"kp{gain}_{kind}.json.gz").log
        for gain in GAINS
        for kind in TRAJECTORIES
    }


def left_out(
    logs: dict[tuple[int, str], Log], out: Sequence[tuple[int, str]]
) -> tuple[MotionFit, float, dict[str, list[float]]]:
    """Fitted without some logs: the fit, its processor time, and the errors on those, mrad."""
    begin = time.process_time()
    fit = fit_motion([log for key, log in logs.items() if key not in out])
    spent = time.process_time() - begin
    errors = {
        source: [1e3 * simulate(logs[key], fit.parameters, source).mean_abs for key in out]  # type: ignore[arg-type]
        for source in ("goal", "effort")
    }
    return fit, spent, errors


def bam_table(logs: dict[tuple[int, str], Log], drawn: list[tuple[str, Log, Parameters]]) -> list[str]:
    """Rows of what was left out."""
    rows = []
    for gain in GAINS:
        out = [(gain, kind) for kind in TRAJECTORIES]
        rows.append(_bam_row(f"gain {gain}", "gain", out, logs, drawn if gain == 200 else None))
    for kind in TRAJECTORIES:
        out = [(gain, kind) for gain in GAINS]
        rows.append(_bam_row(f"trajectory {kind}", "trajectory", out, logs, drawn))
    return rows


def _bam_row(
    title: str,
    what: str,
    out: list[tuple[int, str]],
    logs: dict[tuple[int, str], Log],
    drawn: list[tuple[str, Log, Parameters]] | None,
) -> str:
    fit, spent, errors = left_out(logs, out)
    if drawn is not None:
        drawn.append((words(title), logs[out[1]], fit.parameters))
    cells = []
    for source, limit in zip(("goal", "effort"), BAM[what], strict=True):
        mean = float(np.mean(errors[source]))
        each = ", ".join(f"{one:.0f}" for one in errors[source])
        cells += [f"{mean:.1f} ({each})", "yes" if mean <= GOAL * limit else "**no**"]
    return f"| {title} | {' | '.join(cells)} | {spent:.0f} s |"


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
the duty. BAM's own models (M4 to M6) refitted to these nine logs reach at best {gain_goal:g} and
{gain_duty:g} mrad on a gain that is none of these, and {trajectory_goal:g} and {trajectory_duty:g} on such
a trajectory; "reached" is 0.8 of that. What is left out here are other logs than theirs, and a third of
what there is to fit from.

| left out | from the goals | reached | from the duty | reached | processor time |
|---|---|---|---|---|---|
{bam}

All nine fitted: {all_goal:.1f} mrad from the goals, {all_duty:.1f} from the duty, in {all_time:.0f} s. Gain
800 is the only one at which the duty goes beyond 0.6, so that leaving it out asks for the bend of the line
from duty to torque where nothing showed it.

![Measured and simulated position of logs that no fit saw](images/simulation.png)

## Beside the independent plant

The simulated rig integrates its own formulas in steps of 0.1 ms (`idtool/rig/plant.py`). With the true
numbers and its logged current our simulation is {plant:.2f} mrad off (rms over windows of one second) on a
motion over {way:.0f} mrad; the current is logged every 5 ms and taken as straight between.
"""


@click.command()
@click.option("--folder", type=click.Path(path_type=Path), default=default_folder)
def main(folder: Path) -> None:
    """Write the page and its picture."""
    plant, way = plant_agreement()
    mujoco = main_table(folder)
    logs = bam_logs(folder)
    drawn: list[tuple[str, Log, Parameters]] = []
    bam = bam_table(logs, drawn)
    begin = time.process_time()
    whole = fit_motion(list(logs.values()))
    spent = time.process_time() - begin
    every = {
        source: float(
            np.mean([1e3 * simulate(log, whole.parameters, source).mean_abs for log in logs.values()])
        )  # type: ignore[arg-type]
        for source in ("goal", "effort")
    }
    style.save(picture(drawn), PICTURE)
    text = TEXT.format(
        mujoco="\n".join(mujoco),
        bam="\n".join(bam),
        gain_goal=BAM["gain"][0],
        gain_duty=BAM["gain"][1],
        trajectory_goal=BAM["trajectory"][0],
        trajectory_duty=BAM["trajectory"][1],
        all_goal=every["goal"],
        all_duty=every["effort"],
        all_time=spent,
        plant=plant,
        way=way,
    )
    with atomic_write(PAGE) as stream:
        stream.write(text)


if __name__ == "__main__":
    main()
