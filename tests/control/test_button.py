"""The teach button and the load at rest, around both laws."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from idtool.control import ForceFreeController, Limits, Reason, State
from idtool.control.button import BRAKE_S
from idtool.control.rest_load import STEADY_WINDOWS, RestLoad, Uncertainty
from idtool.parameters import Controller, Parameter, Parameters
from idtool.parameters.axis import Axis
from idtool.rig.base import TrialSetup

from .double import BENCH, PAPER, Double, parameters

LIGHT = Controller(command_gain=2.05, loop_gain=8.0, period=0.01, mode="light")
LIMITS = Limits(-2.3, 2.3, speed=1.2)
COUNT = 2 * np.pi / 4096
#: The push of a hand, N m: 5.6 N at the paper's slide.
PUSH = 0.2526


def file(mode: str, values: dict[str, float] = PAPER, **effects: dict[str, float]) -> Parameters:
    return replace(parameters(values, **effects), controller=LIGHT if mode == "light" else None)


@dataclass
class Session:
    """A controller on a small axis, with a button and a hand that follow the clock.

    Attributes:
        payload: kg that hangs on the axis, of the time, s.
        told: kg.
    """

    mode: str
    values: dict[str, float] = field(default_factory=lambda: dict(PAPER))
    payload: Callable[[float], float] = lambda t: 0.4
    told: float = 0.4
    limits: Limits = LIMITS
    parameters: Parameters | None = None

    def run(
        self, seconds: float, button: Callable[[float], bool], hand: Callable[[float], float] = lambda t: 0.0
    ) -> Session:
        rig = Double(self.values, seed=5, bristle=0.004)
        rig.prepare(TrialSetup(self.payload(0.0), start_position=0.0))
        self.controller = ForceFreeController(
            self.parameters or file(self.mode, self.values), 0.01, limits=self.limits
        )
        command, rows, self.states = 0.0, [], []
        for k in range(round(seconds / 0.01)):
            t = 0.01 * k
            rig.gravity = self.values["base"] + self.values["per_payload"] * self.payload(t)
            sample = rig.step(command, hand(t))
            command = self.controller.step(
                sample.position, sample.velocity, sample.current, self.told, enabled=button(t)
            )
            rows.append((t, rig.q, rig.w, command))
            self.states.append(self.controller.status.state)
        self.time, self.position, self.velocity, self.command = np.array(rows).T
        return self

    def at(self, t: float) -> int:
        return int(np.searchsorted(self.time, t - 1e-9))

    def moved(self, start: float, end: float) -> float:
        part = self.position[self.at(start) : self.at(end)]
        return float(np.max(np.abs(part - part[0])))


MODES = pytest.mark.parametrize("mode", ["paper", "light"])


@MODES
def test_follows_only_while_the_button_is_down(mode: str) -> None:
    """A hand that pushes all the time: it moves the axis between 1 s and 2 s alone."""
    s = Session(mode).run(4.0, lambda t: 1.0 <= t < 2.0, lambda t: PUSH if t > 0.9 else 0.0)
    assert s.moved(0.0, 1.0) < 6 * COUNT
    assert s.position[s.at(2.0)] > 0.1
    stop = s.at(2.0 + 0.06)
    assert np.ptp(s.position[stop:]) < 8 * COUNT, "braked within 60 ms, though the hand pushes on"
    assert set(s.states[: s.at(1.0)]) == {State.HELD}
    assert State.GUIDING in s.states[s.at(1.0) : s.at(2.0)]
    assert set(s.states[s.at(2.0) :]) == {State.HELD}
    assert s.controller.status.velocity_wanted == 0.0


@MODES
def test_a_button_that_goes_up_stops_the_axis_as_a_hand_that_lets_go_does(mode: str) -> None:
    def way(button: Callable[[float], bool], hand: Callable[[float], float]) -> float:
        s = Session(mode).run(3.0, button, hand)
        return float(abs(s.position[-1] - s.position[s.at(2.0)]))

    pushed = way(lambda t: 0.5 <= t < 2.0, lambda t: PUSH if 0.9 < t < 2.0 else 0.0)
    let_go = way(lambda t: t >= 0.5, lambda t: PUSH if 0.9 < t < 2.0 else 0.0)
    assert pushed < let_go + 6 * COUNT


@MODES
@pytest.mark.parametrize("change", [0.4, -0.4])
@pytest.mark.parametrize("values", [PAPER, BENCH], ids=["paper", "bench"])
def test_a_load_that_changes_while_the_button_is_up_is_taken_in(
    mode: str, change: float, values: dict[str, float]
) -> None:
    s = Session(mode, dict(values), payload=lambda t: 0.4 + (change if t > 2.0 else 0.0))
    s.run(7.0, lambda t: 0.5 <= t < 1.5 or t >= 4.0, lambda t: PUSH if 0.8 < t < 1.2 else 0.0)
    assert s.controller.status.fault is None
    assert s.moved(4.0, 7.0) < 6 * COUNT, "nobody pushes"
    assert s.controller.learned is None or s.controller.learned[0] == pytest.approx(
        change * values["per_payload"], abs=0.05
    )
    assert any("was taken in" in note for note in s.controller.status.notes)


def trembling(t: float, size: float = PUSH) -> float:
    """A push of that size by a hand that trembles by a tenth of it."""
    return size * (1.0 + 0.1 * np.sqrt(2.0) * np.sin(2.0 * np.pi * 9.3 * t))


@MODES
def test_a_guided_axis_carries_the_load_that_it_took_in(mode: str) -> None:
    """Let go after a push, it stays: what was hung on is a load and not a bent bristle. The hand pushes by
    about as much as was hung on, and trembles."""
    s = Session(mode, dict(BENCH), payload=lambda t: 0.8 if t > 1.0 else 0.4)
    s.run(7.0, lambda t: t >= 3.0, lambda t: trembling(t) if 3.5 < t < 4.8 else 0.0)
    assert s.position[s.at(4.5)] - s.position[s.at(3.5)] > 0.1
    assert s.moved(5.0, 7.0) < 8 * COUNT


@MODES
def test_a_hand_that_leans_on_a_held_axis_is_no_load(mode: str) -> None:
    """Shorter than a load that stays: the push counts from the moment the button is down."""
    s = Session(mode).run(4.0, lambda t: t >= 2.0, lambda t: PUSH if t > 1.7 else 0.0)
    assert s.position[-1] > 0.2


@MODES
@pytest.mark.parametrize("up", [0.1, 0.4, 0.8, 1.5])
def test_a_push_goes_on_where_the_button_is_let_go_of_and_pressed_again(mode: str, up: float) -> None:
    s = Session(mode).run(
        5.0, lambda t: t < 2.0 or t >= 2.0 + up, lambda t: trembling(t) if 1.0 < t < 4.0 else 0.0
    )
    assert not s.controller.status.fault
    assert s.position[s.at(4.0)] - s.position[s.at(2.0 + up)] > 0.1
    assert s.moved(4.3, 5.0) < 6 * COUNT


@MODES
def test_a_hand_that_leans_on_a_held_axis_for_long_is_a_push_if_it_trembles(mode: str) -> None:
    s = Session(mode).run(6.0, lambda t: t >= 3.5, lambda t: trembling(t) if 1.0 < t < 5.0 else 0.0)
    assert not any("taken in" in note for note in s.controller.status.notes)
    assert s.position[s.at(5.0)] - s.position[s.at(3.5)] > 0.1
    assert s.moved(5.3, 6.0) < 6 * COUNT


@pytest.mark.parametrize("push", [PUSH, -PUSH])
def test_one_that_is_as_quiet_as_a_load_is_none_any_more_once_it_leaves(push: float) -> None:
    s = Session("light").run(8.0, lambda t: t < 0.9 or t >= 3.5, lambda t: push if 1.4 < t < 5.0 else 0.0)
    assert any("has left the axis again" in note for note in s.controller.status.notes)
    assert s.moved(3.5, 8.0) < 12 * COUNT
    assert not s.controller.status.fault


@MODES
def test_a_payload_that_was_never_mounted_lets_the_axis_rise_slowly(mode: str) -> None:
    s = Session(mode, payload=lambda t: 0.0).run(6.0, lambda t: 1.0 <= t < 4.0)
    assert s.moved(0.0, 1.0) < 6 * COUNT
    assert s.position[s.at(4.0)] > 0.15
    assert np.max(np.abs(s.velocity)) < 0.4
    assert s.moved(4.1, 6.0) < 6 * COUNT, "up: it stands"


@MODES
def test_it_stands_once_the_payload_hangs(mode: str) -> None:
    s = Session(mode, payload=lambda t: 0.4 if t > 3.0 else 0.0)
    s.run(7.0, lambda t: 1.0 <= t < 2.0 or t >= 5.0)
    assert s.position[s.at(2.0)] > 0.03
    assert s.moved(5.0, 7.0) < 6 * COUNT
    assert not s.controller.status.fault


@MODES
@pytest.mark.parametrize("values", [PAPER, BENCH], ids=["paper", "bench"])
def test_a_typed_gravity_is_a_fault_before_anything_moves(mode: str, values: dict[str, float]) -> None:
    wrong = {"base": Parameter(0.9), "per_payload": Parameter(0.4455)}
    s = Session(mode, dict(values), parameters=replace(file(mode, values), gravity=wrong))
    s.run(3.0, lambda t: True)
    fault = s.controller.status.fault
    assert fault is not None
    assert fault.reason is Reason.MISMATCH
    assert "carries -0.6" in fault.message
    assert "gravity of the parameter file" in fault.message
    assert s.moved(0.1, 3.0) < 6 * COUNT
    assert State.GUIDING not in s.states
    assert re.search(r"\(as -1\.[45] kg would\)", fault.message)
    assert s.time[s.states.index(State.FAULT)] == pytest.approx(1.0, abs=0.08), "five listenings of 0.2 s"


@pytest.mark.parametrize(("kind", "unit"), [("rotary", "N m"), ("linear", "N")])
def test_a_mismatch_is_told_in_the_units_of_the_axis(kind: str, unit: str) -> None:
    wrong = {"base": Parameter(0.9), "per_payload": Parameter(0.4455)}
    told = replace(file("paper"), gravity=wrong, axis=Axis(kind, 2.67))
    s = Session("paper", parameters=told).run(2.0, lambda t: True)
    fault = s.controller.status.fault
    assert fault is not None
    assert re.search(rf"carries -0\.\d+ {unit} beside its model .* explain 0\.\d+ {unit}: ", fault.message)


@MODES
def test_a_torque_that_an_effect_of_the_file_explains_is_no_mismatch(mode: str) -> None:
    """As large as the weight of a kilogram; without the effect it is one."""
    truth = PAPER | {"base": PAPER["base"] + 0.45}
    known = file(mode, PAPER, torque_offset={"offset": 0.45})
    s = Session(mode, truth, parameters=known).run(2.0, lambda t: True)
    assert s.controller.status.fault is None
    assert not any("beside its model" in note for note in s.controller.status.notes)
    assert s.moved(0.1, 2.0) < 6 * COUNT
    s = Session(mode, truth, parameters=file(mode, PAPER)).run(2.0, lambda t: True)
    assert s.controller.status.fault is not None


@MODES
@pytest.mark.parametrize("base", [3.0, 0.55, -0.1])
def test_a_gravity_that_the_file_is_not_sure_of_is_one_too(mode: str, base: float) -> None:
    """The light law drove to its limit at 2 rad/s, nobody touching it."""
    vague = {"base": Parameter(base, 5.0), "per_payload": Parameter(0.42, 5.0)}
    s = Session(mode, dict(BENCH), parameters=replace(file(mode, BENCH), gravity=vague))
    s.run(3.0, lambda t: True)
    assert s.controller.status.fault is not None
    assert s.controller.status.fault.reason is Reason.MISMATCH
    assert s.moved(0.1, 3.0) < 6 * COUNT


@MODES
def test_a_mismatch_while_the_button_is_up_waits_for_it(mode: str) -> None:
    wrong = {"base": Parameter(0.9), "per_payload": Parameter(0.4455)}
    held = Session(mode, parameters=replace(file(mode), gravity=wrong)).run(3.0, lambda t: t > 10.0)
    assert held.controller.status.fault is None
    assert not held.controller.tare()
    assert any("beside its model" in note for note in held.controller.status.notes)
    pressed = Session(mode, parameters=replace(file(mode), gravity=wrong)).run(5.0, lambda t: t > 3.0)
    assert pressed.controller.status.fault is not None
    assert pressed.moved(0.1, 5.0) < 6 * COUNT


def test_what_friction_and_uncertainties_explain_is_no_mismatch() -> None:
    """0.1 kg that nobody told of; and with `Limits.mismatch` the user draws the line."""
    s = Session("paper", payload=lambda t: 0.5).run(2.0, lambda t: True)
    assert s.controller.status.fault is None
    assert s.moved(0.1, 2.0) < 6 * COUNT
    s = Session("paper", payload=lambda t: 0.5, limits=Limits(mismatch=0.02)).run(2.0, lambda t: True)
    assert s.controller.status.fault is not None


def test_a_tare_that_the_button_ends_is_dropped() -> None:
    s = Session("light", dict(BENCH))
    controller = ForceFreeController(file("light", BENCH), 0.01, limits=s.limits)
    rig = Double(dict(BENCH), seed=1, bristle=0.004)
    rig.prepare(TrialSetup(0.5, start_position=0.0))
    command, before = 0.0, None
    for k in range(500):
        sample = rig.step(command)
        command = controller.step(sample.position, sample.velocity, sample.current, 0.4, enabled=k < 200)
        if before is None and controller.tare():
            before = controller.learned
    assert before is not None
    assert controller.status.state is State.HELD
    assert controller.ready
    assert not controller.tare(), "it waits for the button"
    assert controller.learned is not None
    assert controller.learned[1:] == pytest.approx(before[1:], abs=0.05)


UNCERTAINTY = Uncertainty(gravity=0.0, payload=0.03, per_payload=0.01, friction=0.01, noise=0.008)


def test_a_load_counts_once_it_stays() -> None:
    rest = RestLoad(20, 0.07, UNCERTAINTY, None)
    taken = [rest.watch(0.0 if k < 60 else 0.2, 0.0) for k in range(200)]
    assert taken.index(True) == 60 + 20 * (STEADY_WINDOWS + 1) - 1
    assert rest.changed == pytest.approx(0.2)
    rest.reset()
    restless = [rest.watch(0.2 * ((k // 20) % 2), 0.0) for k in range(400)]
    assert not any(restless), "a hand does not stay"


def test_the_allowance_is_friction_and_two_standard_deviations() -> None:
    rest = RestLoad(20, 0.07, UNCERTAINTY, None)
    for left, payload in ((0.0, 0.0), (0.1, 1.0)):
        rest.listen(left)
        rest.judge(payload, 0.0, 0.0, 0.0, button=False)
        assert rest.allowed == pytest.approx(0.07 + 2 * np.sqrt(0.03**2 + 0.01**2 + (0.01 * payload) ** 2))
        assert rest.excess == 0.0
    rest.listen(0.2)
    assert not rest.judge(0.4, 0.0, 0.0, 0.0, button=False)
    assert rest.excess == pytest.approx(0.2)
    rest.listen(0.2)
    rest.judge(0.4, 0.0, 0.2, 0.0, button=False)
    assert rest.excess == 0.0, "an effect of the file says that friction holds more"


def test_a_brake_lasts_until_the_axis_stands() -> None:
    """A speed that reads zero at once is no standing axis yet."""
    s = Session("paper").run(2.0, lambda t: 0.5 <= t < 1.5, lambda t: PUSH if 0.9 < t < 1.5 else 0.0)
    first = s.at(1.5)
    still = int(np.argmax(np.abs(np.diff(s.command[first:])) == 0.0))
    assert still >= round(BRAKE_S / 0.01) - 1
