"""The paper's hand-guiding experiment on its simulated axis, and what an effect in the file is worth."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import idtool.rig
from idtool.control import ForceFreeController, State
from idtool.guiding import ConstantForceHand, ImpedanceHand, TeachFigures, teach
from idtool.guiding.hand import travel_per_position
from idtool.guiding.session import limits_of
from idtool.parameters import Controller, Parameters
from idtool.rig import open_rig
from idtool.rig.base import TrialSetup

from .double import PAPER, parameters

SETUP = TrialSetup(0.4, start_position=0.0)
#: what the package prints as the paper's plant
PRINTED = PAPER | {"base": 0.2295, "per_payload": 0.4457}
FORCE = 5.56
GAINS = Controller(2.05, 1.68, 0.01)


def printed(**effects: dict[str, float]) -> Parameters:
    from dataclasses import replace

    return replace(parameters(PRINTED, **effects), controller=GAINS)


def guide(spec: str, file: Parameters, seed: int, *, stiff: bool = False) -> TeachFigures:
    rig = open_rig(spec, seed=seed)
    ratio = travel_per_position(file)
    assert ratio is not None
    hand = ImpedanceHand.at_slide(file) if stiff else ConstantForceHand(FORCE * ratio)
    controller = ForceFreeController(file, limits=limits_of(rig))
    figures = teach(file, controller, rig, SETUP, hand=hand).figures
    assert figures is not None
    return figures


@pytest.mark.parametrize("sensors", ["lab", "dynamixel"])
@pytest.mark.parametrize("seed", range(4))
def test_the_published_feel(sensors: str, seed: int) -> None:
    """5.56 N, 19.20 mm/s, at rest within 48 ms, no overshoot (paper, section 4.2)."""
    figures = guide(f"sim:paper,sensors={sensors}", printed(), seed)
    assert figures.force_n == pytest.approx(FORCE, rel=1e-6)
    assert figures.speed_mm_s == pytest.approx(19.20, rel=0.04)
    assert figures.stop_ms <= 48.0
    assert figures.overshoot_counts <= 1.01
    assert figures.ripple_counts <= 1.01
    assert abs(figures.drift_counts_per_s) < 0.5
    assert figures.energy_to_hand < 0


@pytest.mark.parametrize("sensors", ["lab", "dynamixel"])
def test_stands_still_without_a_hand(sensors: str) -> None:
    file = printed()
    for seed in range(5):
        rig = open_rig(f"sim:paper,sensors={sensors}", seed=seed)
        controller = ForceFreeController(file, limits=limits_of(rig))
        record = teach(file, controller, rig, SETUP, duration_s=5.0).record
        assert np.ptp(record.position) <= 1.01 * 2 * np.pi / 4096
        assert State.GUIDING not in record.state


EFFECTS = {
    "torque_offset": ("offset_nm = 0.08", {"offset": 0.08}),
    "position_ripple": (
        "cycles_per_turn = 6.0\namplitude_1_nm = 0.05",
        {"cycles": 6.0, "amplitude_1": 0.05, "phase_1": 0.0, "amplitude_2": 0.0, "phase_2": 0.0},
    ),
    "position_stiffness": (
        "stiffness_nm_per_rad = 0.15\nneutral_rad = -0.5",
        {"stiffness": 0.15, "neutral": -0.5},
    ),
}


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_in_the_file_pays(tmp_path: Path, name: str) -> None:
    """The hand must spread its force less, and the estimate of it gets better."""
    lines, numbers = EFFECTS[name]
    assert idtool.rig.__file__ is not None
    text = (Path(idtool.rig.__file__).parent / "paper.toml").read_text(encoding="utf-8")
    (tmp_path / "plant.toml").write_text(f'{text}\n[[effects]]\nname = "{name}"\n{lines}\n', encoding="utf-8")

    def most(figures: TeachFigures) -> float:
        return max(push.peak_torque for push in figures.pushes)

    base = guide(f"sim:{tmp_path}/plant.toml", printed(), 1, stiff=True)
    extended = guide(f"sim:{tmp_path}/plant.toml", printed(**{name: numbers}), 1, stiff=True)
    assert extended.estimate_rmse < 0.6 * base.estimate_rmse
    assert most(extended) <= most(base)


def test_a_hand_that_leans_on_the_end_of_the_stroke_is_held() -> None:
    """The command stops at the limit, the drive reports no fault, and nothing vibrates there."""
    from idtool.guiding import Push

    file = printed()
    rig = open_rig("sim:paper")
    ratio = travel_per_position(file)
    assert ratio is not None
    hand = ConstantForceHand(FORCE * ratio, (Push(1, push_s=4.0, rest_s=0.5),))
    controller = ForceFreeController(file, limits=limits_of(rig))
    record = teach(file, controller, rig, TrialSetup(0.4, start_position=1.5), hand=hand).record
    at_end = record.position[(record.time > 3.5) & (record.time < 4.5)]
    assert record.command.max() <= rig.limits.position[1]
    assert at_end.mean() == pytest.approx(rig.limits.position[1], abs=0.01)
    assert np.ptp(at_end) < 0.003
