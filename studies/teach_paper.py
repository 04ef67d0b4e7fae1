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
from pages import markdown
from testbench.guided_axes.cases import PAYLOAD_KG, file_of

#: The average force that is printed, N.
FORCE_N = 5.56
PRINTED_GAINS = Controller(2.05, 1.68, 0.01)
_COUNT = 2.0 * np.pi / 4096


def run(
    sensors: str, seed: int, *, hand: bool, seconds: float | None = None, log: Path | None = None
) -> TeachResult:
    """One run of the printed law."""
    file = file_of(read_plant("paper"), PRINTED_GAINS, effects=False)
    ratio = file.gravity["per_payload"].value / STANDARD_GRAVITY
    with open_rig(f"sim:paper,sensors={sensors}", seed=seed) as rig:
        law = ForceFreeController(file, limits=limits_of(rig))
        push = ConstantForceHand(FORCE_N * ratio) if hand else None
        setup = TrialSetup(PAYLOAD_KG, start_position=0.0)
        return teach(file, law, rig, setup, hand=push, duration_s=seconds, log=log)


#: What is told: its words, what is printed, the figure, its form, and whether it is the worst or the mean.
_TOLD = (
    ("force, N", "5.56", "force_n", ".2f", np.mean),
    ("speed, mm/s", "19.20", "speed_mm_s", ".2f", np.mean),
    ("stop after release, ms, worst", "48", "stop_ms", ".0f", max),
    ("overshoot, encoder counts, worst", "none", "overshoot_counts", ".1f", max),
    ("ripple after the stop, counts, worst", "none", "ripple_counts", ".1f", max),
    ("energy given to the hand, J, worst push", "", "energy_to_hand", ".3f", max),
)


def table(images: Path) -> list[str]:
    """The published figures beside ours, ten seeds each; draws the picture of the first into `images`."""
    guided = {s: [run(s, seed, hand=True) for seed in range(10)] for s in ("lab", "dynamixel")}
    still = [[run(s, seed, hand=False, seconds=5.0).record for seed in range(10)] for s in guided]
    assert not any(State.GUIDING in one.state for ten in still for one in ten)
    figures = [[one.figures for one in ten if one.figures is not None] for ten in guided.values()]
    rows = [
        (title, printed, *(format(of([getattr(one, name) for one in ten]), form) for ten in figures))
        for title, printed, name, form, of in _TOLD
    ]
    moved = (f"{max(float(np.ptp(one.position)) for one in ten) / _COUNT:.1f}" for ten in still)
    rows.append(("moved in 5 s without a hand, counts, worst", "still", *moved))
    ratio = read_plant("paper").gravity["per_payload_nm_per_kg"] / STANDARD_GRAVITY
    draw(guided["dynamixel"][0].record, travel_ratio=ratio).savefig(images / "teach_paper.png", dpi=130)
    return markdown.table(("", "printed", "fine sensors", "a DYNAMIXEL's sensors"), rows, "lrrr")
