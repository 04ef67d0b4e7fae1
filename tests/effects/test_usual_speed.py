"""At one speed friction that follows the speed cannot be told from a level of friction."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool import Log, identify
from idtool.effects.base import usual_speed


@pytest.mark.parametrize(
    ("other", "share", "told"), [(0.5, 0.1, True), (0.5, 0.25, False), (0.88, 0.5, True), (0.04, 0.5, True)]
)
def test_one_speed_is_that_of_nearly_all_rows(other: float, share: float, told: bool) -> None:
    """Both ways; one close to it is the same one, and what hardly moves is none."""
    velocity = np.where(np.arange(1000) < 1000 * (1.0 - share), 1.0, other)
    velocity[::2] *= -1.0
    assert (usual_speed(velocity) is not None) == told


@pytest.mark.parametrize(("speeds", "named"), [((1.0, 1.0), False), ((0.3, 0.6, 1.0, 1.3), True)])
def test_a_drag_is_named_where_several_speeds_were_moved(
    tmp_path: Path, speeds: tuple[float, ...], named: bool
) -> None:
    """A direct-drive arm that was moved at 60 deg/s alone got one, of three quarters of its torque."""
    time, rng = 0.01 * np.arange(1200), np.random.default_rng(2)
    for number, speed in enumerate(speeds):
        way = np.clip(np.sin(2.0 * np.pi * time / 6.0) / 0.2, -1.0, 1.0)
        velocity = speed * way
        torque = 0.05 * np.tanh(velocity / 0.01) + 0.04 * velocity + 0.03 * np.abs(velocity) * velocity
        torque += 0.005 * np.gradient(velocity, 0.01) + 0.001 * rng.normal(size=len(time))
        log = {"time_s": time, "position_rad": 0.01 * np.cumsum(velocity), "torque_nm": torque}
        pd.DataFrame(log).to_csv(tmp_path / f"{number}.csv", index=False)
    result = identify([Log.read(path) for path in sorted(tmp_path.glob("*.csv"))])
    assert ("nonlinear_viscous" in {effect.name for effect in result.parameters.effects}) == named
