"""What the names of columns say."""

from __future__ import annotations

import pytest

from idtool.importing.names import meaning

NAMES = [
    ("t", "time", "", False),
    ("Time (ms)", "time", "ms", False),
    ("timestamp_us", "time", "us", False),
    ("elapsed_time", "time", "", False),
    ("q", "position", "", False),
    ("qm", "position", "", False),
    ("Pos", "position", "", False),
    ("jointPosition", "position", "", False),
    ("position_deg", "position", "deg", False),
    ("Angle [°]", "position", "°", False),
    ("position1_rad", "position", "rad", False),
    ("position_m", "position", "m", False),
    ("q_ref", "position", "", True),
    ("dq", "velocity", "", False),
    ("motorSpeed [rpm]", "velocity", "rpm", False),
    ("present_velocity", "velocity", "", False),
    ("vel_deg_per_s", "velocity", "deg_per_s", False),
    ("velocity.mm/s", "velocity", "mm_s", False),
    ("rpm", "velocity", "rpm", False),
    ("speed_ref_rad_s", "velocity", "rad_s", True),
    ("i", "current", "", False),
    ("Iq", "current", "", False),
    ("i_q", "current", "", False),
    ("Current(mA)", "current", "mA", False),
    ("iq_ref", "current", "", True),
    ("tau", "torque", "", False),
    ("tau_m", "torque", "", False),
    ("motor_torque_mNm", "torque", "mNm", False),
    ("effort", "torque", "", False),
    ("torque_cmd_nm", "torque", "nm", True),
    ("force_n", "torque", "n", False),
    ("mos_temperature_degc", "temperature", "degc", False),
    ("Temp_C", "temperature", "C", False),
    ("payload_kg", "payload", "kg", False),
    ("vbus_V", "supply_voltage", "V", False),
    ("run", "trial", "", False),
    ("cur_mA", "current", "mA", False),
]


@pytest.mark.parametrize(("name", "role", "unit", "commanded"), NAMES)
def test_names_that_say_what_they_are(name: str, role: str, unit: str, commanded: bool) -> None:
    found = meaning(name)
    assert found is not None
    assert (found.role, found.unit, found.commanded) == (role, unit, commanded)


@pytest.mark.parametrize(
    "name",
    [
        "",
        "x",
        "load",
        "phase",
        "position_error_rad",
        "torque_ramp_nm_per_s",
        "supply_raw",
        "command",
        "kp",
        "7",
    ],
)
def test_names_that_say_nothing(name: str) -> None:
    assert meaning(name) is None
