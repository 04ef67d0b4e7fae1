"""Units that a person gives for a column."""

from __future__ import annotations

import math

import pytest

from idtool.importing.conversion import given_unit


@pytest.mark.parametrize(
    ("text", "role", "factor"),
    [
        ("-A", "current", -1.0),
        ("-2.69mA", "current", -2.69e-3),
        ("-1", "torque", -1.0),
        ("-deg", "position", -math.pi / 180),
    ],
)
def test_a_minus_before_a_unit_turns_the_column_round(text: str, role: str, factor: float) -> None:
    """It was taken for one of the marks in which spellings of a unit differ, and told nobody."""
    assert given_unit(text, role, "rotary").factor == pytest.approx(factor)
