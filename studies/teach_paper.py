"""The published hand-guiding experiment on `sim:paper` with the printed gains, and its figures."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from idtool.control import ForceFreeController, State
from idtool.guiding import ConstantForceHand, teach
from idtool.guiding.figure import draw
from idtool.guiding.session import TeachResult, limits_of
from idtool.model.units import STANDARD_GRAVITY
from idtool.parameters import Controller
from idtool.rig import open_rig
from idtool.rig.base import TrialSetup
from idtool.rig.opening import read_plant
from testbench.guided_axes.cases import PAYLOAD_KG, file_of

#: The average force that is printed, N.
FORCE_N = 5.56
PRINTED_GAINS = Controller(2.05, 1.68, 0.01)
_COUNT = 2.0 * np.pi / 4096


def run(sensors: str, seed: int, *, hand: bool, seconds: float | None = None) -> TeachResult:
    """One run of the printed law."""
    file = file_of(read_plant("paper"), PRINTED_GAINS, effects=False)
    ratio = file.gravity["per_payload"].value / STANDARD_GRAVITY
    with open_rig(f"sim:paper,sensors={sensors}", seed=seed) as rig:
        law = ForceFreeController(file, limits=limits_of(rig))
        push = ConstantForceHand(FORCE_N * ratio) if hand else None
        setup = TrialSetup(PAYLOAD_KG, start_position=0.0)
        return teach(file, law, rig, setup, hand=push, duration_s=seconds)


def section(images: Path) -> list[str]:
    """The part of docs/teach.md; draws its figures into `images`."""
    lines = [
        "## The published law, reproduced",
        "",
        "`sim:paper`, 0.4 kg, the printed gains, a hand of 5.56 N that rises within 50 ms, pushes both ways",
        "for two seconds and lets go at once (mode `paper`, which is the default; ten seeds each).",
        "",
        "| | printed | fine sensors | a DYNAMIXEL's sensors |",
        "|---|---:|---:|---:|",
    ]
    figures = {s: [run(s, seed, hand=True).figures for seed in range(10)] for s in ("lab", "dynamixel")}
    still = {s: [run(s, seed, hand=False, seconds=5.0) for seed in range(10)] for s in ("lab", "dynamixel")}

    def row(title: str, printed: str, read: object, form: str, worst: bool) -> str:
        cells = []
        for sensors in ("lab", "dynamixel"):
            values = [getattr(f, str(read)) for f in figures[sensors] if f is not None]
            cells.append(form.format(max(values) if worst else float(np.mean(values))))
        return f"| {title} | {printed} | {' | '.join(cells)} |"

    lines += [
        row("force, N", "5.56", "force_n", "{:.2f}", False),
        row("speed, mm/s", "19.20", "speed_mm_s", "{:.2f}", False),
        row("stop after release, ms, worst", "48", "stop_ms", "{:.0f}", True),
        row("overshoot, encoder counts, worst", "none", "overshoot_counts", "{:.1f}", True),
        row("ripple after the stop, counts, worst", "none", "ripple_counts", "{:.1f}", True),
        row("energy given to the hand, J, worst push", "", "energy_to_hand", "{:.3f}", True),
    ]
    moved = [max(float(np.ptp(r.record.position)) for r in still[s]) / _COUNT for s in ("lab", "dynamixel")]
    guided = any(State.GUIDING in r.record.state for s in still for r in still[s])
    lines.append(f"| moved in 5 s without a hand, counts, worst | still | {moved[0]:.1f} | {moved[1]:.1f} |")
    assert not guided
    first = run("dynamixel", 0, hand=True).record
    ratio = read_plant("paper").gravity["per_payload_nm_per_kg"] / STANDARD_GRAVITY
    draw(first, travel_ratio=ratio).savefig(images / "teach_paper.png", dpi=130)
    return [
        *lines,
        "",
        "The stop is timed on the readings, at 200 Hz, until the axis stays within one encoder count.",
        "",
        "![Torque, stroke and force over time, after the paper's Figures 10 and 11](images/teach_paper.png)",
        "",
        "Above as the paper's Figure 10a and 11a: what the motor does, what the model takes off, and what is",
        "left, the hand. Below as 10b and 11b: stroke and force; after each release the slide stands.",
        "",
        "How the gains are read. K_c (1.68 rad/s per N m) is the admittance gain: with a stiff position loop",
        "Eq. 11 is w = K_c tau_ext, and 5.56 N at the slide then give 19.20 mm/s for a pulley of 26.5 mm.",
        "K_r (2.05 s) turns a missing speed into a lead of the position command. On a servo whose position",
        "loop has the time constant T the equation settles at w = K_c tau_ext K_r / (K_r + T), 2.4 % below",
        "that for T = 50 ms. Sent literally it closes a loop of gain K_r / T = 41 through a velocity that is",
        "a period old, and vibrates; it is solved for its own velocity instead: the same steady state.",
        "",
    ]
