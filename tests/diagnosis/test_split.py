"""Which trials are held out."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from idtool.diagnosis.split import split

SWEEP, SINE, GRAVITY = "sweep", "sine", "gravity"


@pytest.mark.parametrize(
    ("experiments", "logs", "held_out"),
    [
        pytest.param([SWEEP] * 4, [0] * 4, [2], id="the third of four"),
        pytest.param([SWEEP] * 8, [0] * 8, [2, 6], id="every fourth, not the last"),
        pytest.param([SWEEP] * 4 + [SINE] * 3, [0] * 4 + [1] * 3, [2], id="each log by itself"),
        pytest.param([SWEEP] * 9, range(9), [2, 6], id="of many logs every fourth"),
        pytest.param(
            [SWEEP, SINE, GRAVITY] * 3, range(9), [2, 6], id="whatever they are, if others are alike"
        ),
        pytest.param([SWEEP, SINE, GRAVITY, SINE], range(4), None, id="not the only one of its kind"),
        pytest.param([SWEEP] * 3, range(3), None, id="too few"),
    ],
)
def test_trials_that_are_held_out(
    experiments: list[str], logs: list[int], held_out: list[int] | None
) -> None:
    """None: blocks of time stand in for trials, which takes more than is told here."""
    recording: Any = SimpleNamespace(
        trials=len(experiments),
        experiment=experiments,
        source=[f"{log}.csv" for log in logs],
        filtered_trial=np.repeat(np.arange(len(experiments)), 5),
    )
    if held_out is None:
        with pytest.raises(AttributeError, match="motion"):
            split(recording)
    else:
        assert list(split(recording).held_out) == held_out
