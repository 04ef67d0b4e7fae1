"""Magnitudes that no axis has."""

from __future__ import annotations

import numpy as np
import pytest

from idtool import InputError
from idtool.log.columns import _refuse_magnitude


@pytest.mark.parametrize(
    ("size", "said"),
    [(1.2e12, "which no axis reaches"), (0.8e12, ""), (1.2e-12, ""), (0.8e-12, "which no sensor sees")],
)
def test_a_column_of_no_axis(size: float, said: str) -> None:
    values = np.array([0.0, size, -size, size])
    if said:
        with pytest.raises(InputError, match=said):
            _refuse_magnitude(values, "torque_nm", "log.csv")
    else:
        _refuse_magnitude(values, "torque_nm", "log.csv")
    _refuse_magnitude(np.zeros(4), "torque_nm", "log.csv")
