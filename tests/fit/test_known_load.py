"""The torque constant from a known load."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from idtool import Axis, InputError, Log
from idtool.fit.known_load import calibrate
from idtool.parameters import Parameter, Parameters
from idtool.parameters.scaling import in_torque
from testbench.pendulums import Pendulum


def test_the_constant_of_a_mass_on_a_lever() -> None:
    swing = Pendulum()
    found = calibrate([swing.log(axis=Axis("rotary", 0.6))], mass=swing.mass, lever=swing.lever)
    assert found.unit == "current"
    assert found.constant.value == pytest.approx(swing.torque_constant, rel=0.02)
    assert found.constant.ci95 is not None
    assert found.constant.ci95[0] < swing.torque_constant < found.constant.ci95[1]
    assert found.load == pytest.approx(swing.mass * 9.80665 * swing.lever)


def test_two_sessions_tell_the_load_from_the_weight_of_the_axis() -> None:
    swing = Pendulum(own=0.2)
    logs = [swing.log(seed=1, payload=0.5), swing.log(seed=2, payload=0.0)]
    found = calibrate(logs, lever=swing.lever)
    assert found.constant.value == pytest.approx(swing.torque_constant, rel=0.02)
    # the mass alone would be 40 % off
    alone = calibrate([swing.log(seed=1)], mass=swing.mass, lever=swing.lever)
    assert alone.constant.value < 0.8 * swing.torque_constant
    assert any("all the gravity in these logs" in note for note in alone.notes)


def test_a_payload_that_swings_has_inertia_of_its_own() -> None:
    """Taken for less weight, as it follows the position in a swing, it put the constant 10 % off."""
    swing = Pendulum(inertia=0.03, mass=1.0, lever=0.15)
    logs = [swing.log(seed=k, payload=payload) for k, payload in enumerate((1.0, 0.1))]
    found = calibrate(logs, lever=swing.lever)
    assert found.constant.value == pytest.approx(swing.torque_constant, rel=0.01)
    assert found.constant.ci95 is not None
    assert found.constant.ci95[0] < swing.torque_constant < found.constant.ci95[1]


def test_volts_give_the_torque_per_volt() -> None:
    swing = Pendulum()
    log = swing.log()
    frame = log.frame.assign(duty=log.frame["current_a"] / 12.0, supply_voltage_v=12.0)
    volts = Log(frame.drop(columns="current_a"), Axis(), source="volts.csv")
    found = calibrate([volts], mass=swing.mass, lever=swing.lever)
    assert (found.unit, found.key) == ("voltage", "torque_per_volt_nm_per_v")
    assert found.constant.value == pytest.approx(swing.torque_constant, rel=0.02)


def test_a_file_in_ampere_is_put_into_newton_metres_with_the_error_of_the_constant() -> None:
    known = Parameters(
        axis=Axis(effort="current"),
        static={
            "coulomb": Parameter(0.1, 0.001, (0.098, 0.102)),
            "static": Parameter(0.1),
            "stribeck_velocity": Parameter(0.2, 0.01, (0.18, 0.22)),
            "viscous": Parameter(0.3, 0.0, (0.3, 0.3)),
        },
    )
    constant = Parameter(2.0, 0.04, (1.92, 2.08))
    scaled = in_torque(known, constant, "current")
    assert scaled.axis.torque_constant == 2.0
    assert scaled.axis.effort == "torque"
    assert scaled.axis.extra["torque_constant_ci95"] == [1.92, 2.08]
    assert scaled.static["coulomb"].value == pytest.approx(0.2)
    assert scaled.static["coulomb"].stderr == pytest.approx(np.hypot(0.002, 0.2 * 0.02))
    assert scaled.static["viscous"].stderr == pytest.approx(0.6 * 0.02)
    assert scaled.static["stribeck_velocity"] == known.static["stribeck_velocity"]
    # a constant that was wrong is corrected by the ratio of the two
    again = in_torque(replace(scaled), Parameter(1.0), "current")
    assert again.static["coulomb"].value == pytest.approx(0.1)


@pytest.mark.parametrize(("swing_rad", "is_still"), [(0.19, True), (0.22, False)])
def test_a_fifth_of_a_radian_is_no_swing(swing_rad: float, is_still: bool) -> None:
    log = Pendulum().log()
    way = log.frame["position_rad"]
    still = replace(log, rows=log.frame.assign(position_rad=swing_rad / np.ptp(way) * way))
    try:
        calibrate([still], mass=0.5, lever=0.1)
        said = ""
    except InputError as error:
        said = str(error)
    assert ("never moves so that its weight shows" in said) == is_still


def test_bad_input_is_one_sentence() -> None:
    swing = Pendulum()
    log = swing.log()
    with pytest.raises(InputError, match="no mass was given"):
        calibrate([log], lever=0.1)
    still = replace(log, rows=log.frame.assign(position_rad=0.01 * log.frame["position_rad"]))
    with pytest.raises(InputError, match="the load never moves so that its weight shows"):
        calibrate([still], mass=0.5, lever=0.1)
    torque = replace(log, rows=log.frame.rename(columns={"current_a": "torque_nm"}))
    # a load that pulls both ways alike is none: likely one of the two was run without it
    loaded = swing.log(seed=1)
    turned = replace(loaded, rows=loaded.frame.assign(current_a=-loaded.frame["current_a"]))
    with pytest.raises(InputError, match=r"not to be seen in the effort; .*; a log without it says so in"):
        calibrate([loaded, turned], lever=0.1, mass=0.5)
    with pytest.raises(InputError, match="holds the torque itself"):
        calibrate([torque], mass=0.5, lever=0.1)
    with pytest.raises(InputError, match=r"payload_kg goes up to 0\.5 kg and --mass says 0\.4"):
        calibrate([swing.log(payload=0.5), swing.log(seed=1, payload=0.0)], mass=0.4, lever=0.1)
