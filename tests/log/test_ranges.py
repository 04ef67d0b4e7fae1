"""What a column may hold: beyond it is another unit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool import InputError, Log


@pytest.mark.parametrize(
    ("column", "within", "beyond", "said"),
    [
        ("duty", 1.0009, 1.0011, "a share from -1 to 1"),
        ("duty", -1.0009, -1.0011, "a share from -1 to 1"),
        ("supply_voltage_v", 1499.0, 1501.0, "it may be in millivolts"),
        ("supply_voltage_v", 0.0, -0.1, "it may be in millivolts"),
        ("payload_kg", 0.0, -0.1, "a mass"),
        ("temperature_degc", 999.0, 1001.0, "a temperature"),
        ("temperature_degc", -273.0, -274.0, "a temperature"),
        ("tilt_alpha_rad", 6.2840, 6.2843, "it is in degrees"),
        ("tilt_beta_rad", -6.2840, -6.2843, "it is in degrees"),
    ],
)
def test_beyond_its_range_is_another_unit(
    tmp_path: Path, column: str, within: float, beyond: float, said: str
) -> None:
    time = 0.01 * np.arange(100)
    rows = {"trial": 0, "time_s": time, "position_rad": np.sin(time), "torque_nm": np.cos(time), "duty": 0.1}

    def log(value: float) -> Log:
        frame = pd.DataFrame(rows | {column: np.where(time == time[50], value, 0.0)})
        frame.to_csv(tmp_path / "log.csv", index=False)
        return Log.read(tmp_path / "log.csv")

    log(within)
    with pytest.raises(InputError, match=f'column "{column}" holds .*{said}'):
        log(beyond)
