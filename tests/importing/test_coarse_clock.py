"""Recordings of which many rows share a time stamp."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool.importing import import_recording
from tests.importing.test_importing import put


def swing(time: np.ndarray) -> np.ndarray:
    return np.asarray(np.sin(3.0 * time))


@pytest.mark.parametrize("pace", ["steady", "slowing"])
@pytest.mark.parametrize("since", [0.0, 1.7e9])
def test_a_clock_that_is_coarser_than_the_rows(tmp_path: Path, pace: str, since: float) -> None:
    """As `time.time()` on Windows, which ticks every 15.6 ms: of a loop at 400 Hz five rows in six were
    dropped."""
    row = np.arange(4000)
    taken = 0.0025 * row + (2e-7 * row**2 if pace == "slowing" else 0.0)
    taken[2000:] += 0.7  # somebody paused it
    stamps = since + np.floor(taken / 0.015625) * 0.015625
    rng = np.random.default_rng(0)
    frame = {
        "time_s": stamps,
        "position_rad": swing(taken),
        "torque_nm": np.cos(3.0 * taken) + rng.normal(size=len(row)),
    }
    path = put(tmp_path, pd.DataFrame(frame).to_csv(index=False, float_format="%.9f"))
    imported = import_recording(path)
    assert any("ticks every 15.6 ms" in note and "spread evenly" in note for note in imported.notes)
    log = imported.log.frame
    assert len(log) == len(row)
    off = log["time_s"].to_numpy() - taken
    off -= off.mean()
    assert np.abs(off).max() < 0.016
    steps = np.diff(log["time_s"])
    assert steps.min() > 0.0
    inside = np.abs(row[1:] - 2000) > 200
    assert np.std((steps - np.diff(taken))[inside]) < 2e-4


def test_a_reading_that_is_logged_again_and_again_is_one(tmp_path: Path) -> None:
    taken = np.repeat(0.01 * np.arange(300), 4)
    frame = {
        "time_s": taken,
        "position_rad": swing(taken),
        "torque_nm": np.cos(3.0 * taken),
        "asked": np.arange(1200.0),
    }
    path = put(tmp_path, pd.DataFrame(frame).to_csv(index=False))
    imported = import_recording(path)
    assert len(imported.log.frame) == 300
    assert any("dropped 900 rows whose time stamp was there already" in note for note in imported.notes)
