"""Recordings of real machines: published models reproduced, and what goes beyond them."""

from __future__ import annotations

from pathlib import Path

import pytest

from idtool import identify
from idtool.importing import import_recording


@pytest.fixture(scope="module")
def emps(measured: Path) -> Path:
    return measured / "emps" / "emps_identification.csv.gz"


def test_reproduces_the_published_model_of_emps(emps: Path) -> None:
    """Janot, Gautier & Brunot 2019: M 95.1089, Fv 203.5034, Fc 20.3935, offset -3.1648; 4.0834 %."""
    result = identify([import_recording(emps).log], friction="coulomb")
    parameters = result.parameters
    inertia, offset = parameters.effect("inertia"), parameters.effect("torque_offset")
    assert inertia is not None
    assert offset is not None
    assert inertia.values()["inertia"] == pytest.approx(95.1089, rel=0.01)
    assert parameters.static["viscous"].value == pytest.approx(203.5034, rel=0.01)
    assert parameters.static["coulomb"].value == pytest.approx(20.3935, rel=0.01)
    assert offset.values()["offset"] == pytest.approx(-3.1648, rel=0.01)
    assert result.diagnosis["error"]["relative_percent"]["all_rows_after"] == pytest.approx(4.0834, abs=0.25)


def test_goes_beyond_the_published_extension_of_emps(emps: Path) -> None:
    """The authors' asymmetric friction reaches 3.1117 %."""
    diagnosis = identify([import_recording(emps).log]).diagnosis
    named = [effect["name"] for effect in diagnosis["effects"]]
    assert named[0] == "direction_asymmetry"
    error = diagnosis["error"]
    assert error["blocks_stand_in_for_trials"]
    assert error["held_out"]["after"] < 0.2 * error["held_out"]["before"]
    assert error["relative_percent"]["all_rows_after"] < 3.1117
    # what is left is above the sensor's noise, and it says so
    assert diagnosis["verdict"] == "unexplained"


def test_constant_speed_runs_of_a_direct_drive_arm(measured: Path) -> None:
    """CICESE DD2DOF, joint 1: gravity 9.81 * 3.921 N m, Coulomb 12.4 and 10.9 N m."""
    recording = import_recording(
        measured / "cicese_dd2dof" / "test2_constant_speed_both_joints.csv.gz",
        mapping={"position_rad": "position1_rad", "torque_nm": "torque1_cmd_nm"},
        trial_by="run",
    )
    result = identify([recording.log])
    assert result.parameters.gravity_model == "arm"
    assert result.parameters.gravity["sin"].value == pytest.approx(9.81 * 3.921, rel=0.05)
    assert result.parameters.static["coulomb"].value == pytest.approx(11.7, rel=0.3)
    assert result.diagnosis["verdict"] == "unexplained"
