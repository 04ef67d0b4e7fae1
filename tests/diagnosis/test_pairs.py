"""Two effects of which each leaves what the other does."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.ndimage import gaussian_filter1d

from idtool import Log, identify
from idtool.diagnosis.candidates import best_start
from idtool.diagnosis.pairs import hidden_pairs
from idtool.effects import registry
from idtool.signals import record
from idtool.verbs.base_model import base_of_rows


def _swept(folder: Path, offset: float, asymmetry: float, seed: int) -> Log:
    """Back and forth at five speeds, around the one at which an offset and an asymmetry cancel."""
    rng = np.random.default_rng(seed)
    t = 0.01 * np.arange(800)
    trials = []
    for trial, speed in enumerate((0.3, 0.6, 0.9, 1.2, 1.5)):
        w = speed * gaussian_filter1d(np.where((t // 2.0) % 2.0 == 0.0, 1.0, -1.0), 8, mode="nearest")
        position = np.round(0.01 * np.cumsum(w), 5)
        torque = 0.07 * np.tanh(w / 0.005) + 0.09 * w + offset + asymmetry * np.abs(w)
        torque += 0.002 * rng.normal(size=len(t))
        trials.append(
            pd.DataFrame({"trial": trial, "time_s": t, "position_rad": position, "torque_nm": torque})
        )
    pd.concat(trials).to_csv(folder / "log.csv", index=False)
    return Log.read(folder / "log.csv")


def test_an_offset_and_an_asymmetry_that_hide_each_other(tmp_path: Path) -> None:
    found = identify([_swept(tmp_path, -0.022, 0.025, 0)]).diagnosis
    values = {effect["name"]: effect["parameters"] for effect in found["effects"]}
    assert set(values) == {"torque_offset", "direction_asymmetry", "inertia"}
    assert values["torque_offset"]["offset_nm"]["value"] == pytest.approx(-0.022, abs=0.002)
    assert values["direction_asymmetry"]["asymmetry_nm_s_per_rad"]["value"] == pytest.approx(0.025, abs=0.002)
    p_values = {candidate["name"]: candidate["p_value"] for candidate in found["candidates"]}
    assert max(p_values["torque_offset"], p_values["direction_asymmetry"]) < 1e-6


def test_each_alone_looks_like_chance(tmp_path: Path) -> None:
    """... and both together do not, on any curve that the base model starts from."""
    fits = base_of_rows(record([_swept(tmp_path, -0.022, 0.025, 0)]), "lugre", "none").fits
    effects = [registry.get(name) for name in ("torque_offset", "direction_asymmetry")]
    for fit in fits:
        scored = [(effect, best_start(fit, effect)) for effect in effects]
        assert min(start.p_value for _, start in scored) > 0.05
        assert hidden_pairs(fit, scored, 0.01, 1) == [(0, 1)]


def test_a_pair_that_takes_next_to_nothing_is_none(tmp_path: Path) -> None:
    """... however surely it is there: rows enough show anything."""
    fits = base_of_rows(record([_swept(tmp_path, -0.022, 0.025, 0)]), "lugre", "none").fits
    effects = [registry.get(name) for name in ("torque_offset", "direction_asymmetry")]
    fit = fits[0]
    # beside a residual of something else, a hundred times as much
    wave = np.sin(0.9 * np.arange(len(fit.residual)))
    loud = replace(fit, residual=fit.residual + 20.0 * float(np.std(fit.residual)) * wave)
    scored = [(effect, best_start(fit, effect)) for effect in effects]
    assert hidden_pairs(fit, scored, 0.01, 1) == [(0, 1)]
    assert hidden_pairs(loud, scored, 0.01, 1) == []


@pytest.mark.parametrize("seed", range(4))
def test_where_there_is_none_no_pair_is_found(tmp_path: Path, seed: int) -> None:
    found = identify([_swept(tmp_path, 0.0, 0.0, seed)]).diagnosis
    assert [effect["name"] for effect in found["effects"]] == ["inertia"]
