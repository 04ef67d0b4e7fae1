"""A load in another unit is not taken for one that moved."""

from __future__ import annotations

from dataclasses import replace

import pytest

from idtool import Axis, InputError, Log
from idtool.fit.known_load import calibrate, calibrate_by_axis
from idtool.verbs.check import check
from testbench.pendulums import Pendulum

SWING = Pendulum()


def _with(log: Log, **columns: float) -> Log:
    return replace(log, rows=log.frame.assign(**columns))


def _volts(log: Log) -> Log:
    frame = log.frame.assign(duty=log.frame["current_a"] / 12.0, supply_voltage_v=12.0)
    return replace(log, rows=frame.drop(columns="current_a"))


@pytest.mark.parametrize(
    ("log", "mass", "lever", "expected"),
    [
        (SWING.log(), 500.0, 0.1, r"makes 2\.6\de\+03 V of its own at the 2\.2 rad/s .* which no drive has"),
        (_with(SWING.log(), supply_voltage_v=12.0), 500.0, 0.1, "which its supply of 12 V has not"),
        (_with(SWING.log(), supply_voltage_v=12.0), 16.0, 0.1, "which its supply of 12 V has not"),
        (SWING.log(), 0.5, 10.0, r"a lever of 10 m would have more inertia .* allows 0\.4\d* m at most"),
        (
            SWING.log(),
            0.5,
            5.0,
            r"a lever of 5 m would have more inertia",
        ),  # more than ten times what is allowed
        (SWING.log(), 0.5, 100.0, r"a lever of 100 m would have more inertia"),
        (_volts(SWING.log()), 500.0, 0.1, r"a motor that holds 490 N m takes 1\.2e\+04 A or more"),
        (_volts(SWING.log()), 0.5, 10.0, "a lever of 10 m would have more inertia"),
    ],
    ids=["grams", "grams, supply", "below 1500 V", "cm", "tenfold", "mm", "grams by volts", "cm by volts"],
)
def test_a_load_in_another_unit_is_refused(log: Log, mass: float, lever: float, expected: str) -> None:
    with pytest.raises(InputError, match=rf"{expected}.*; masses are in kg and levers in m"):
        calibrate([log], mass=mass, lever=lever)


def test_a_payload_in_grams_is_refused() -> None:
    logs = [_with(SWING.log(seed=1), payload_kg=500.0), SWING.log(seed=2, payload=0.0)]
    with pytest.raises(InputError, match="V of its own"):
        calibrate(logs, lever=0.1)


def test_a_lever_of_the_axis_in_centimetres_is_refused() -> None:
    axis = Axis(extra={"lever_m": 10.0, "mass_kg": 0.5})
    with pytest.raises(InputError, match="more inertia than all that moves"):
        calibrate_by_axis([SWING.log(axis=axis)])


@pytest.mark.parametrize(
    ("mass", "lever", "expected"),
    [
        (0.5, 1.0, "allows 0.4 m at most: look whether it is in m."),
        (0.5, 3.5, "allows 0.4 m at most: look whether it is in m."),
        (20.0, 0.1, "with a supply of less, the mass is not in kg, or the lever not in m."),
    ],
)
def test_what_may_be_right_is_said(mass: float, lever: float, expected: str) -> None:
    found = calibrate([SWING.log()], mass=mass, lever=lever)
    assert found.notes[0].endswith(expected)


@pytest.mark.parametrize(
    "axis",
    [
        SWING,
        Pendulum(own=0.2),
        Pendulum(inertia=0.005, torque_constant=3.0),  # all the inertia is the load's
        Pendulum(inertia=0.12, mass=1.5, lever=0.25, coulomb=1.2, viscous=0.3),
        Pendulum(inertia=0.0006, mass=0.2, lever=0.05, coulomb=0.005, viscous=0.01, torque_constant=0.3),
    ],
    ids=["bench", "own weight", "direct drive", "heavy, much friction", "small"],
)
def test_what_is_right_is_not_doubted(axis: Pendulum) -> None:
    with_and_without = [axis.log(seed=1, payload=axis.mass), axis.log(seed=2, payload=0.0)]
    for logs, mass in (([axis.log()], axis.mass), (with_and_without, None)):
        said = " ".join(calibrate(logs, mass=mass, lever=axis.lever).notes)
        assert "of its own" not in said
        assert "inertia" not in said


def test_check_says_that_one_payload_on_an_arm_tells_nothing_per_kilogram() -> None:
    cannot = {one.what: one.why for one in check([SWING.log(payload=0.5)]).cannot}
    assert cannot["gravity: per payload"] == "one payload only"
