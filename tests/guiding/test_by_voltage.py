"""Guiding and playing where the voltage at the motor stands for its torque."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from idtool.cli.common import Output
from idtool.cli.guiding import check_axis

from idtool.control.force_free import ForceFreeController
from idtool.control.guard import Limits as ControlLimits
from idtool.control.online import OnlineModel
from idtool.errors import InputError
from idtool.export.c_controller import export_c
from idtool.guiding.hand import SEQUENCE, ConstantForceHand
from idtool.guiding.path import read_path
from idtool.guiding.playback import play
from idtool.guiding.session import limits_of, teach
from idtool.log import Log
from idtool.log.effort import effort_of
from idtool.parameters import Parameter, Parameters
from idtool.parameters.axis import Axis
from idtool.rig import open_rig
from idtool.rig.base import Rig, TrialSetup
from idtool.rig.opening import read_plant
from tests.rig.dynamixel.support import parameters_of

FLAT = TrialSetup(tilt_alpha_rad=math.pi / 2)
PLANT = read_plant("bench")
K, R = 2.67, PLANT.motor.resistance


def by_voltage(resistance: float | None) -> Parameters:
    """A perfect file of the bench: without the resistance the back-EMF is one with viscous friction."""
    file = parameters_of("bench")
    viscous = file.static["viscous"].value + (0.0 if resistance else K * K / R)
    static = file.static | {"viscous": Parameter(viscous)}
    return replace(
        file, static=static, axis=Axis("rotary", torque_per_volt=K / R, resistance=resistance), effects=()
    )


def rig() -> Rig:
    return open_rig("sim:bench,sensors=feetech", seed=1)


def test_a_hand_guides_by_the_voltage(tmp_path: Path) -> None:
    parameters = by_voltage(R)
    with rig() as axis:
        controller = ForceFreeController(parameters, 0.01, limits=limits_of(axis))
        hand = ConstantForceHand(0.2, SEQUENCE[:2])
        run = teach(parameters, controller, axis, FLAT, hand=hand, log=tmp_path / "taught.csv")
    assert run.figures is not None
    assert all(push.speed > 0.05 and push.stop_ms < 500 for push in run.figures.pushes)
    log = Log.read(tmp_path / "taught.csv")
    assert {"duty", "supply_voltage_v"} <= set(log.frame)
    assert "current_a" not in log.frame
    effort = effort_of(log)
    assert effort.unit == "torque"
    volts = log.frame["duty"] * log.frame["supply_voltage_v"]
    assert np.allclose(effort.values / (K / R), volts)
    path, _ = read_path(tmp_path / "taught.csv")
    with rig() as axis:
        played = play(path, axis, FLAT, parameters=parameters, log=tmp_path / "played.csv")
    assert played.stopped is None
    assert "duty" in Log.read(tmp_path / "played.csv").frame


def test_the_back_emf_brakes_where_the_resistance_is_known() -> None:
    known, unknown = OnlineModel(by_voltage(R)), OnlineModel(by_voltage(None))
    assert known.viscous == pytest.approx(unknown.viscous)
    assert unknown.viscous > K * K / R


def test_a_file_of_a_current_is_refused_on_a_rig_of_a_voltage() -> None:
    with rig() as axis, pytest.raises(InputError, match="reads the torque from the motor's current"):
        check_axis(parameters_of("bench"), Path("params.toml"), axis, Output(json=False, quiet=True))


def test_the_c_controller_reads_a_current_only(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="from a voltage, and the C controller from a current"):
        export_c(by_voltage(R), tmp_path / "board", limits=ControlLimits(-1.0, 1.0))


def test_a_file_in_volts_needs_no_constant() -> None:
    file = replace(by_voltage(None), axis=Axis("rotary", effort="voltage"))
    assert OnlineModel(file).torque_constant == 1.0
    with pytest.raises(InputError, match="has no torque constant"):
        OnlineModel(replace(file, axis=Axis("rotary")))
