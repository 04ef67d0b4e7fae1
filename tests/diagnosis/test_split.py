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
