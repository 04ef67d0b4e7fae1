"""Which rows are held out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from idtool import Log
from idtool.diagnosis.split import split
from idtool.errors import InputError
from idtool.signals import record
from tests.diagnosis.conftest import swings


def test_blocks_of_which_too_few_are_compared_are_refused(tmp_path: Path) -> None:
    """Seen in logs of a servo whose drive was off in most rows: nothing was held out, and the diagnosis fell
    over that."""
    path = tmp_path / "log.csv"
    swings(lambda t, q, w: np.tanh(w / 0.01) + w + 0.01 * np.sin(40.0 * t)).to_csv(path, index=False)
    recording = record([Log.read(path)]).subset([0, 1, 2])
    assert split(recording).blocks
    assert split(recording).held.any()
    trial = recording.motion.trial
    rows = np.flatnonzero(recording.usable & (trial == 1))
    few = np.zeros(len(trial), dtype=bool)
    few[rows[: 9 * recording.filter.taps]] = True
    with pytest.raises(InputError, match="too few to hold any out"):
        split(replace(recording, usable=few))


def test_a_trial_that_is_most_of_the_session_is_not_held_out_whole(tmp_path: Path) -> None:
    """Seen in a session of six trials of a servo's arm: the third with rows was 41 % of them and the only one
    with the full swing; without it nothing could be told from anything, and the error held out was 20 %."""
    path = tmp_path / "log.csv"
    frame = swings(lambda t, q, w: np.tanh(w / 0.01) + w + 0.01 * np.sin(40.0 * t))
    frame.to_csv(path, index=False)
    alike = split(record([Log.read(path)]))
    assert not alike.blocks
    assert alike.held_out == (2,)
    begins = (frame["trial"] == 2) | (frame.groupby("trial").cumcount() < 160)
    frame[begins].to_csv(path, index=False)
    parts = split(record([Log.read(path)]))
    assert parts.blocks
    assert 0.1 < parts.held[parts.recording.usable].mean() < 0.4
    trial = parts.recording.motion.trial
    assert not parts.held[trial == 2].all()
