"""The controller before, between and after its motions: what it takes for granted, holds, cuts and says."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from idtool.control import ForceFreeController, Limits, Reason, State
from idtool.control.admittance import kernel, tare
from idtool.control.admittance.law import AdmittanceLaw
from idtool.control.paper import PaperLaw
from idtool.errors import InputError
from idtool.parameters import Controller, Parameters
from idtool.parameters.axis import Axis
from idtool.parameters.correction import Correction

from .double import BENCH, parameters

PULL = BENCH["base"] + 0.4 * BENCH["per_payload"]
#: The current that holds 0.4 kg, A.
HOLDS = PULL / 2.67


def file(kind: str = "rotary", mode: str = "paper") -> Parameters:
    gains = Controller(2.05, 1.68, 0.01, mode="light") if mode == "light" else None
    return replace(parameters(BENCH), axis=Axis(kind, 2.67), controller=gains)


def resting(controller: ForceFreeController, samples: int = 60, position: float = 0.5) -> list[float]:
    """The commands of a rest without a hand."""
    return [controller.step(position, 0.0, HOLDS, 0.4) for _ in range(samples)]


@pytest.mark.parametrize(
    ("kind", "yielding", "step"),
    [("rotary", 1.68, 2.0 * math.pi / 4096), ("linear", 0.0192 / 5.56, 1e-5)],
)
def test_what_the_published_law_takes_where_nobody_says(kind: str, yielding: float, step: float) -> None:
    controller = ForceFreeController(file(kind))
    assert (controller.mode, controller.period, controller.rest_window) == ("paper", 0.01, 20)
    assert (controller.command_gain, controller.loop_gain) == (2.05, yielding)
    assert controller.resolution == step
    assert controller.start_torque == pytest.approx(0.3 * 0.075)
    assert isinstance(controller.law, PaperLaw)
    settings = controller.law.settings
    assert (settings.servo_time, settings.filter_time, settings.settle) == (0.05, 0.015, 0.2)
    assert controller.servo_time == 0.05


@pytest.mark.parametrize(("kind", "travel", "speed"), [("rotary", 0.2, 0.4), ("linear", 0.01, 0.02)])
def test_what_the_admittance_law_takes_where_nobody_says(kind: str, travel: float, speed: float) -> None:
    controller = ForceFreeController(file(kind, "light"))
    assert isinstance(controller.law, AdmittanceLaw)
    settings = controller.law.settings
    noise = 0.003 * 2.67
    assert settings.noise == pytest.approx(noise)
    assert controller.start_torque == settings.start_torque == pytest.approx(1.4 * noise)
    assert (settings.tare_travel, settings.tare_speed, settings.settle) == (travel, speed, 0.2)
    assert (settings.level, settings.damping) == pytest.approx((0.22, 0.22))
    payload = 0.04 * BENCH["per_payload"]
    assert (settings.refuse, settings.load) == pytest.approx((payload, 0.75 * payload))
    assert controller.rest_uncertainty.friction == pytest.approx(0.22 * 0.075)
    assert settings.per_kilogram == BENCH["per_payload"]
    volts = ForceFreeController(replace(file(kind, "light"), axis=Axis(kind, torque_per_volt=0.5)))
    assert isinstance(volts.law, AdmittanceLaw)
    assert volts.law.settings.noise == pytest.approx(0.036 * 0.5)


def test_a_period_that_is_told_wins_over_the_file_s() -> None:
    told = ForceFreeController(replace(file(), controller=Controller(1.0, 3.0, 0.02)), 0.005)
    assert (told.period, told.rest_window) == (0.005, 40)
    assert ForceFreeController(file(), 0.005, settle_s=0.001).rest_window == 1
    with pytest.raises(InputError, match="unknown mode 'heavy'"):
        ForceFreeController(file(), mode="heavy")


def test_it_begins_where_the_axis_is_and_says_what_it_waits_for() -> None:
    controller = ForceFreeController(file())
    assert controller.status.state is State.STARTING
    assert not controller.status.command_valid
    assert not controller.ready
    assert not controller.tare()
    assert controller.learned is None
    commands = resting(controller)
    assert np.ptp(commands) < 0.002
    assert commands[-1] == pytest.approx(0.5, abs=0.002)
    status = controller.status
    assert (status.state, status.command_valid, status.fault) == (State.RESTING, True, None)
    assert controller.ready
    assert status.gravity == pytest.approx(PULL)
    assert status.message == "rests until a hand pushes"
    assert not controller.tare(), "the published law learns nothing"


def test_a_fault_holds_the_last_good_position_until_somebody_recovers_it() -> None:
    controller = ForceFreeController(file())
    resting(controller)
    held = controller.step(0.502, 0.0, math.nan, 0.4)
    assert held == pytest.approx(0.5, abs=1e-9)
    assert [controller.step(0.7, 0.0, HOLDS, 0.4) for _ in range(3)] == [held] * 3
    status = controller.status
    assert status.fault is not None
    assert (status.state, status.velocity_wanted, status.command_valid) == (State.FAULT, 0.0, True)
    assert status.message.endswith("holds the last safe position; call recover() to go on")
    assert len(status.fault.history) == 50
    times = [sample.time for sample in status.fault.history]
    np.testing.assert_allclose(np.diff(times), 0.01)
    assert times[-1] == pytest.approx(0.61)
    assert not controller.ready
    controller.recover()
    assert controller.status.fault is None
    assert controller.step(0.5, 0.0, HOLDS, 0.4) == pytest.approx(held, abs=0.002)


def test_a_fault_before_any_good_sample_has_no_position_to_hold() -> None:
    controller = ForceFreeController(file())
    controller.step(math.nan, 0.0, HOLDS, 0.4)
    status = controller.status
    assert not status.command_valid
    assert "has no safe position yet, send nothing" in status.message


@pytest.mark.parametrize("value", [None, "fast", 10**400])
def test_what_is_no_number_is_a_fault_and_no_error(value: object) -> None:
    controller = ForceFreeController(file())
    resting(controller)
    controller.step(0.5, value, HOLDS, 0.4)  # type: ignore[arg-type]
    fault = controller.status.fault
    assert fault is not None
    assert fault.reason is Reason.NOT_FINITE


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_the_command_steps_no_further_than_its_limit_and_stays_in_range(direction: float) -> None:
    """A hand that pushes hard at a command that may go 0.2 mrad a period; then at the end of the range."""
    push = direction * 1.0 / 2.67
    for limits, word in (
        (Limits(command_step=2e-4), "step"),
        (Limits(0.4995, 0.5005), "range"),
    ):
        controller = ForceFreeController(file(), limits=limits)
        before = resting(controller)[-1]
        cut = set()
        for _ in range(20):
            command = controller.step(0.5, 0.0, HOLDS - push, 0.4)
            if word == "step":
                assert abs(command - before) <= 2e-4 + 1e-12
            else:
                assert 0.4995 <= command <= 0.5005
            before = command
            cut |= set(controller.status.limited)
        assert word in cut
        assert direction * (before - 0.5) > 0.0
        assert controller.status.message.endswith(
            f"cut by the limit of {', '.join(controller.status.limited)}"
        )


@pytest.mark.parametrize(("kind", "unit", "effort"), [("rotary", "rad", "N m"), ("linear", "m", "N")])
def test_a_fault_is_told_in_the_units_of_the_axis(kind: str, unit: str, effort: str) -> None:
    for limits, sample, told in (
        (Limits(0.0, 1.0), (1.5, 0.0, HOLDS), unit),
        (Limits(torque=0.1), (0.5, 0.0, HOLDS - 1.0), effort),
        (Limits(guided_speed=0.02), (0.5, 0.3, HOLDS - 0.5), f"{unit}/s"),
    ):
        controller = ForceFreeController(file(kind), limits=limits)
        resting(controller)
        position, velocity, current = sample
        for k in range(40):
            controller.step(position + 0.01 * k * velocity, velocity, current, 0.4)
        fault = controller.status.fault
        assert fault is not None
        assert re.search(rf"\d {told}\b(?!/| m)", fault.message), fault.message


def test_reset_forgets_where_it_was_and_when() -> None:
    controller = ForceFreeController(file(), limits=Limits(0.2, 1.0))
    resting(controller)
    controller.reset()
    assert controller.status.position_command == 0.2, "zero is outside the range"
    assert not controller.status.command_valid
    assert controller.step(0.7, 0.0, HOLDS, 0.4) == pytest.approx(0.7)
    controller.step(math.nan, 0.0, HOLDS, 0.4)
    fault = controller.status.fault
    assert fault is not None
    assert [sample.time for sample in fault.history] == pytest.approx([0.01, 0.02])


def test_a_time_that_is_told_is_checked() -> None:
    controller = ForceFreeController(file())
    controller.step(0.5, 0.0, HOLDS, 0.4, time_s=1.0)
    controller.step(0.5, 0.0, HOLDS, 0.4, time_s=1.5)
    fault = controller.status.fault
    assert fault is not None
    assert fault.history[-1].time == 1.5


def test_an_idle_axis_says_that_its_button_must_go_up() -> None:
    controller = ForceFreeController(file(), limits=Limits(idle_s=0.5))
    resting(controller, 100)
    assert controller.status.state is State.HELD
    assert controller.status.velocity_wanted == 0.0
    assert any("nobody guided the axis for a while" in note for note in controller.status.notes)
    for enabled in (False, True):
        controller.step(0.5, 0.0, HOLDS, 0.4, enabled=enabled)
    assert not any("nobody guided" in note for note in controller.status.notes)


def test_a_correction_over_the_temperature_is_left_out_without_one() -> None:
    correction = Correction("temperature", False, np.array([20.0, 30.0]), np.array([0.05, 0.05]))
    controller = ForceFreeController(file(), correction=correction)
    controller.step(0.5, 0.0, HOLDS, 0.4, temperature_degc=25.0)
    assert controller.status.effects == pytest.approx(0.05)
    assert controller.status.external_torque == pytest.approx(0.0, abs=0.2)


def test_only_the_admittance_law_learns_and_tares() -> None:
    controller = ForceFreeController(file(mode="light"))
    assert not controller.tare(), "nothing was measured yet"
    resting(controller)
    assert controller.learned == pytest.approx((0.0, 1.0, 1.0), abs=0.05)
    assert controller.tare()
    controller.step(0.5, 0.0, HOLDS, 0.4)
    assert controller.status.state is State.TARING
    held = ForceFreeController(file(mode="light"))
    for _ in range(60):
        held.step(0.5, 0.0, HOLDS, 0.4, enabled=False)
    assert not held.tare(), "the button is up"


def test_what_is_compiled_is_loaded_before_a_servo_waits_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """A first call that compiles or loads takes longer than a bus may be silent, and its watchdog trips."""
    ForceFreeController(file(mode="light"))  # from here on no call compiles, which a double would be in
    names = set(re.findall(r"\b(kernel|tare)\.([a-z_]+)\(", inspect.getsource(AdmittanceLaw)))
    assert {name for _, name in names} >= {"act_in", "watch_in", "hold_in", "tare", "told"}
    called: list[tuple[str, str]] = []

    def counted(name: tuple[str, str], function: Callable[..., object]) -> Callable[..., object]:
        return lambda *given: (called.append(name), function(*given))[1]

    for module, name in names:
        own = {"kernel": kernel, "tare": tare}[module]
        monkeypatch.setattr(own, name, counted((module, name), getattr(own, name)))
    ForceFreeController(file(mode="light"))
    assert set(called) == names
