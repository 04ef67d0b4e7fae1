"""What an axis brings to the admittance law, worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from idtool.control import ForceFreeController
from idtool.control.admittance.law import AdmittanceLaw, AdmittanceSettings, _axis
from idtool.control.guard import Limits, Measurement
from idtool.control.online import OnlineModel

from .double import BENCH, parameters

SETTINGS = AdmittanceSettings(
    gain=8.0,
    start_torque=0.014,
    level=0.2,
    damping=0.3,
    load=0.02,
    stribeck=0.0,
    refuse=0.05,
    noise=0.01,
    servo_time=0.06,
    settle=0.204,
    tare_travel=0.2,
    tare_speed=0.4,
    per_kilogram=0.45,
)
#: The most that friction of that file holds at rest, N m.
BOUND = 0.075


def axis(
    limits: Limits | None = None, resolution: float = 0.0005, period: float = 0.01, **changes: float
) -> dict[str, float]:
    model = OnlineModel(parameters(BENCH))
    limits = limits or Limits(-1.0, 2.0, speed=1.2)
    return _axis(model, limits, period, resolution, 0.05, replace(SETTINGS, **changes))


def test_what_is_told_is_passed_on() -> None:
    found = axis()
    told = {
        "period": 0.01,
        "torque_constant": 2.67,
        "gain": 8.0,
        "noise": 0.01,
        "servo_time": 0.06,
        "speed": 1.2,
        "rest_speed": 0.05,
        "resolution": 0.0005,
        "low": -1.0,
        "high": 2.0,
        "start_torque": 0.014,
        "refuse": 0.05,
    }
    assert {name: found[name] for name in told} == told


def test_friction_bounds_what_a_rest_may_hide() -> None:
    """Two standard deviations above the file for the zero; 1.5 counts of 8 N m/rad for a stop, and no more
    than friction holds."""
    found = axis()
    assert found["zero_most"] == pytest.approx(BOUND * 1.4)
    assert found["stop_torque"] == pytest.approx(1.5 * 0.0005 * 8.0)
    assert axis(resolution=0.1)["stop_torque"] == BOUND
    assert found["prior"] == pytest.approx((0.02, 0.2, 0.3, 0.6 * BOUND))
    assert axis(load=0.0)["prior"][0] > 0.0


def test_elements_that_hold_friction_are_bent_by_a_stop_too() -> None:
    elements = {"stiffness": 4.0, "yield": 0.03, "of_friction": 1.0}
    model = OnlineModel(parameters(BENCH, hysteresis=elements))
    found = _axis(model, Limits(), 0.01, 0.0005, 0.05, SETTINGS)
    assert found["stop_torque"] == pytest.approx(1.5 * 0.0005 * (8.0 + 4.0))


def test_times_are_whole_periods_and_one_at_least() -> None:
    found = axis()
    assert (found["settle_periods"], found["still_periods"], found["brake_periods"]) == (20, 5, 4)
    found = axis(period=0.2, settle=0.01)
    assert (found["settle_periods"], found["still_periods"], found["brake_periods"]) == (1, 1, 1)


def test_a_tare_keeps_to_its_travel_and_its_speed() -> None:
    """0.1 rad to either side at 0.4 rad/s at most: a turn takes pi / 2 s, 160 periods in eight parts."""
    found = axis()
    assert (found["tare_part"], found["tare_cycle"]) == (20, 160)
    assert found["tare_turn"] == pytest.approx(2.0 * math.pi / 160)
    assert found["tare_top"] == pytest.approx(0.1 * 2.0 * math.pi / 1.6)
    assert found["tare_top"] <= 0.4
    # of 20 samples a part: 2 + 2.2 / root(20) noises, as a current
    assert found["tare_apart"] == pytest.approx((2.0 + 2.2 / math.sqrt(20.0)) * 0.01 / 2.67)
    assert axis(tare_speed=99.0)["tare_part"] == 1


def test_a_tare_goes_towards_the_middle_if_there_is_one() -> None:
    assert axis()["tare_middle"] == 0.5
    assert axis(Limits())["tare_middle"] == math.inf


def test_a_file_that_is_unsure_of_its_friction_at_rest_leaves_more_to_the_hand() -> None:
    sure = axis()["stop_torque"]
    assert axis(stribeck=0.01)["stop_torque"] == pytest.approx(math.hypot(sure, 2.0 * 0.01))


def test_unless_told_a_motion_starts_beyond_what_readings_scatter_by() -> None:
    """1.4 standard deviations of a reading of the current."""
    law = ForceFreeController(parameters(BENCH), 0.01, mode="light").law
    assert isinstance(law, AdmittanceLaw)
    assert law.settings.start_torque == pytest.approx(1.4 * law.settings.noise)
    told = ForceFreeController(parameters(BENCH), 0.01, mode="light", start_torque=0.05).law
    assert isinstance(told, AdmittanceLaw)
    assert told.settings.start_torque == 0.05


def test_the_friction_at_rest_is_as_uncertain_as_the_fit_of_both_levels() -> None:
    """But never more than friction changes from day to day, 22 %."""
    file = parameters(BENCH)
    coulomb = file.static["coulomb"].value

    def stribeck(**errors: float) -> float:
        static = {
            name: replace(value, stderr=errors.get(name, value.stderr)) for name, value in file.static.items()
        }
        law = ForceFreeController(replace(file, static=static), 0.01, mode="light").law
        assert isinstance(law, AdmittanceLaw)
        return law.settings.stribeck

    both = {"coulomb": 0.0, "static": 0.0}
    assert stribeck(**both) == 0.0
    small = 0.01 * coulomb
    assert stribeck(**both | {"static": small}) == pytest.approx(small, rel=2e-3)
    assert stribeck(coulomb=small, static=small) == pytest.approx(math.sqrt(2.0) * small, rel=2e-3)
    assert stribeck(**both | {"static": 100.0}) == pytest.approx(0.22 * coulomb)


def law_of(**effects: dict[str, float]) -> AdmittanceLaw:
    found = ForceFreeController(parameters(BENCH, **effects), 0.01, mode="light").law
    assert isinstance(found, AdmittanceLaw)
    return found


def test_the_current_does_not_wait_for_a_motion_that_is_reported_late() -> None:
    """A hand that leaves shows in the current at once; how late the speed is read is the observer's."""
    late, plain = law_of(transport_delay={"delay": 0.02}), law_of()
    early = law_of(transport_delay={"delay": -0.02})
    assert late.constants["reports"] == pytest.approx(1.0 - math.exp(-0.5))
    assert plain.constants["reports"] == early.constants["reports"] == 1.0
    for law in (late, plain):
        for k in range(3):
            law.raw_command(Measurement(0.01 * k, 0.3, 0.0, 0.1 * (k == 2)))
    assert late.raw == plain.raw
