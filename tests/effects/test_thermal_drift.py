"""Without a thermometer friction that fades shows in run time, where the run tells again and again how much
there is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool import Log, identify
from idtool.effects.thermal_drift import ThermalDrift
from idtool.model.motion import Array, Motion

TIME = 0.01 * np.arange(6000)
THERE_AND_BACK = 0.5 * np.sin(2.0 * np.pi * TIME / 4.0)
#: Logarithm of cold over warm friction, and the time that it takes, s.
FADES, SECONDS = 0.3, 11.0


def motion_of(velocity: Array, time: Array = TIME, trials: int = 1) -> Motion:
    trial = np.repeat(np.arange(trials), len(time) // trials)
    return Motion(time, trial, np.cumsum(velocity) * 0.01, velocity, np.gradient(velocity, 0.01))


@pytest.mark.parametrize(
    ("velocity", "told"),
    [
        (THERE_AND_BACK, True),
        (np.abs(THERE_AND_BACK), False),
        (np.where(TIME < 40.0, THERE_AND_BACK, 0.0), False),
        (np.where(TIME < 40.0, THERE_AND_BACK, 0.3), False),
    ],
    ids=["there and back", "one way", "then it stands", "then it goes one way"],
)
def test_one_trial_shows_it_where_each_part_goes_both_ways(velocity: Array, told: bool) -> None:
    assert (ThermalDrift().untestable(motion_of(velocity)) is None) is told


@pytest.mark.parametrize(("held_out", "told"), [((1,), True), ((1, 2), False)], ids=["one", "two"])
def test_a_trial_that_was_held_out_leaves_no_part_untold(held_out: tuple[int, ...], told: bool) -> None:
    """As a search has it, of a session of four trials whose clock runs on."""
    left = ~np.isin(np.arange(len(TIME)) * 4 // len(TIME), held_out)
    motion = motion_of(THERE_AND_BACK[left], TIME[left], trials=4 - len(held_out))
    assert (ThermalDrift().untestable(motion) is None) is told


def test_trials_that_restart_the_clock_do_not() -> None:
    time = np.tile(TIME[:3000], 2)
    assert "clock that runs on" in str(ThermalDrift().untestable(motion_of(THERE_AND_BACK, time, trials=2)))


@pytest.mark.parametrize("fades", [FADES, 0.0], ids=["fades", "stays"])
def test_friction_that_fades_within_one_recording(tmp_path: Path, fades: float) -> None:
    """The time constant is much shorter than the longest that there may be: that is no bound."""
    rng = np.random.default_rng(2)
    w = 0.5 * np.sin(2.0 * np.pi * TIME / 4.0) + 0.2 * np.sin(2.0 * np.pi * TIME / 2.7)
    q = np.cumsum(w) * 0.01
    size = 0.06 * np.exp(fades * np.expm1(-TIME / SECONDS))
    friction = np.zeros(len(TIME))
    for n in range(1, len(TIME)):
        bound = np.sign(q[n] - q[n - 1]) * size[n]
        friction[n] = bound + (friction[n - 1] - bound) * np.exp(-6.0 * abs(q[n] - q[n - 1]) / size[n])
    torque = friction + size / 0.06 * 0.05 * w + 0.001 * rng.normal(size=len(TIME))
    path = tmp_path / "log.csv"
    pd.DataFrame({"time_s": TIME, "position_rad": q, "torque_nm": torque}).to_csv(path, index=False)
    found = identify([Log.read(path)])
    named = [effect.name for effect in found.parameters.effects if effect.name != "inertia"]
    assert named == (["thermal_drift"] if fades else [])
    for effect in found.parameters.effects:
        if effect.name == "thermal_drift":
            assert effect.values()["warm_up"] == pytest.approx(FADES, rel=0.1)
            assert effect.values()["time_constant"] == pytest.approx(SECONDS, rel=0.1)


@pytest.mark.parametrize(("span", "tells"), [(0.9, False), (1.1, True)])
def test_a_kelvin_is_the_least_that_a_thermometer_must_see(span: float, tells: bool) -> None:
    motion = replace(motion_of(THERE_AND_BACK), temperature=25.0 + span * np.linspace(0.0, 1.0, len(TIME)))
    effect = ThermalDrift()
    assert (effect.untestable(motion) is None) == tells
    assert bool(effect.constants(motion)) == tells
