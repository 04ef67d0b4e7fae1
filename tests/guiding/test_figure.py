"""The picture of a run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from idtool.guiding.figure import draw
from idtool.guiding.record import Record

_TIME = np.linspace(0.0, 4.0, 200)
_PUSH = np.where(_TIME < 2.0, 0.1, -0.03)
_RUN = Record(
    time=_TIME,
    position=0.3 + 0.2 * np.sin(_TIME),
    velocity=0.2 * np.cos(_TIME),
    current=0.1 + 0.0 * _TIME,
    temperature=np.full(200, np.nan),
    command=0.3 + 0.2 * np.sin(_TIME),
    hand=_PUSH,
    estimated=0.9 * _PUSH,
    motor=0.3 + 0.0 * _TIME,
    compensated=0.28 + 0.0 * _TIME,
    state=("guided",) * 200,
)


@pytest.mark.parametrize("ratio", [None, 0.05])
def test_the_zeros_of_both_sides_are_at_one_height(ratio: float | None) -> None:
    figure = draw(_RUN, travel_ratio=ratio)
    upper, lower, *right = figure.axes
    for panel, beside in zip((upper, lower), right, strict=True):
        left_zero = panel.transData.transform((0.0, 0.0))[1]
        assert beside.transData.transform((0.0, 0.0))[1] == pytest.approx(left_zero, abs=0.01)
        low, high = beside.get_ylim()
        values = beside.lines[0].get_ydata()
        assert low < np.min(values) < np.max(values) < high


def test_a_hand_that_nobody_measured_is_not_drawn() -> None:
    figure = draw(replace(_RUN, hand=np.zeros(200)))
    assert len(figure.axes) == 2
    assert "hand" not in [text.get_text() for text in figure.legends[0].get_texts()]
