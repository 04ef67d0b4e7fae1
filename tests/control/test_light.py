"""The light mode on the simulated axes: light, at rest when it should, and never pushing the hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from idtool.control import ForceFreeController, Limits, Reason, State
from idtool.errors import InputError
from idtool.parameters import Controller
from idtool.rig.base import TrialSetup
from idtool.rig.numbers import plant_numbers
from studies.guided_axis import NO_HAND, GuidedAxis
from studies.guided_plants import AXES, Case, corner, file_of, plant_of, random_case
from studies.teach import COUNT, GAINS, at_rest, guide

CORNERS = [(1, 1, 1), (-1, -1, -1), (1, -1, 1), (-1, 1, -1)]


@pytest.mark.parametrize("stiff", [False, True], ids=["soft", "stiff"])
@pytest.mark.parametrize("signs", CORNERS, ids=str)
@pytest.mark.parametrize("axis", AXES)
def test_light_in_the_corners(axis: str, signs: tuple[int, int, int], stiff: bool) -> None:
    """Friction 30 % off, payload 0.1 kg off, readings 10 ms late: 2 N for 19.2 mm/s, and calm."""
    run = guide(corner(axis, GAINS, signs, stiff=stiff, delay=0.01, late=False), tared=True)
    assert run.note == ""
    assert run.force <= 2.0
    assert all(push.speed == pytest.approx(19.2, rel=0.1) for push in run.pushes)
    assert run.drift < 0.1
    assert run.ripple < 1.0
    assert run.swing < 2.0
    assert run.energy < 0.0
    assert run.stop <= 90.0  # docs/teach.md has the distribution


@pytest.mark.parametrize("axis", AXES)
def test_the_file_s_own_axis_starts_below_one_newton_and_stops_at_once(axis: str) -> None:
    case = corner(axis, GAINS, (0, 0, 0), stiff=False, delay=0.0, late=False)
    run = guide(replace(case, bristle=0.0), tared=True)
    assert run.break_away < 1.0
    assert run.stop <= 48.0


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("signs", CORNERS, ids=str)
def test_without_a_tare_it_is_heavier_but_never_pushes(axis: str, signs: tuple[int, int, int]) -> None:
    run = guide(corner(axis, GAINS, signs, stiff=True, delay=0.0, late=False), tared=False)
    assert run.energy < 0.0
    assert run.drift < 1.0
    assert run.force < 5.56


def drawn(kind: str, number: int, of: int) -> Case:
    """An axis of the study: the `number`th of a kind of which there are `of`."""
    rng = np.random.default_rng(0)
    kinds = ("none", "known", "unknown")
    cases = [random_case(rng, GAINS, effects=k) for k in kinds[: kinds.index(kind) + 1] for _ in range(of)]
    return cases[of * kinds.index(kind) + number]


@pytest.mark.parametrize(
    "case",
    [
        # a stop leaves 1.2 N in the bristle of an axis whose friction is 30 % off
        corner("bench", GAINS, (1, 1, -1), stiff=False, delay=0.02, late=False),
        # a hand that leant leaves just after the stop, 1.4 N of the bristle stay
        drawn("unknown", 29, 40),
        # a push of 0.15 s ends: bent on, then back
        drawn("known", 169, 200),
        # a hand that draws the other way while it stops, and then leaves
        drawn("unknown", 146, 200),
    ],
    ids=["corner", "leaning", "short push", "drawn back"],
)
def test_nothing_starts_on_what_a_stop_left(case: Case) -> None:
    run = guide(case, tared=True)
    assert run.starts == 0
    assert run.ripple < 1.0
    assert run.energy < 0.0


def test_a_motion_does_not_turn_round_without_a_rest() -> None:
    """The friction that turns round with it, 27 % off, would look like a hand that draws it back."""
    run = guide(drawn("none", 118, 200), tared=True)
    guided = run.felt[:, 5] == list(State).index(State.GUIDING)
    ways = np.sign(run.felt[:, 4])
    turned = guided[1:] & guided[:-1] & (ways[1:] * ways[:-1] < 0.0)
    assert np.any(guided)
    assert not np.any(turned)


def test_a_ripple_that_the_tare_met_moves_nothing() -> None:
    run = guide(drawn("unknown", 137, 200), tared=True)
    assert run.drift < 1.0
    assert run.starts == 0


def test_a_tare_learns_what_is_wrong() -> None:
    """The file is 30 % off in friction and 0.1 kg in the payload; a stiff bristle tells them apart."""
    case = corner("bench", GAINS, (1, -1, 1), stiff=True, delay=0.0, late=False)
    law = rest(case)
    learned = law[1].learned
    assert learned is not None
    load, level, damping = learned
    assert load == pytest.approx(0.1 * 0.42, abs=0.012)
    assert level == pytest.approx(1.3, abs=0.12)
    assert damping == pytest.approx(0.7, abs=0.35)


def rest(
    case: Case, *, tared: bool = True, steps: int = 450
) -> tuple[GuidedAxis, ForceFreeController, float]:
    """The axis after a tare, at rest, nobody touching."""

    numbers = plant_numbers(case.truth, TrialSetup(payload_kg=case.payload))
    axis = GuidedAxis(numbers, at_rest(case, numbers), 0.01)
    law = ForceFreeController(case.file, 0.01, limits=Limits(-2.3, 2.3, speed=1.2))
    command, asked = 0.0, False
    for k in range(steps):
        _, position, velocity, current = axis.advance(command, NO_HAND)
        command = law.step(position, velocity, current, 0.4, time_s=0.01 * k)
        if tared and not asked:
            asked = law.tare()
    assert law.status.fault is None
    assert law.ready
    return axis, law, command


@pytest.mark.parametrize("axis_name", AXES)
def test_a_dropped_payload_is_a_fault(axis_name: str) -> None:
    case = corner(axis_name, GAINS, (0, 0, 0), stiff=True, delay=0.0, late=False)
    axis, law, command = rest(case)
    start = axis.place
    axis.numbers = plant_numbers(case.truth, TrialSetup(payload_kg=0.0))
    for k in range(450, 550):
        _, position, velocity, current = axis.advance(command, NO_HAND)
        command = law.step(position, velocity, current, 0.4, time_s=0.01 * k)
    fault = law.status.fault
    assert fault is not None
    assert fault.reason is Reason.LOAD_LOST
    assert "it was dropped" in law.status.message
    assert abs(axis.place - start) < 8 * COUNT
    law.recover()
    law.step(position, velocity, current, 0.0, time_s=6.0)
    assert law.status.state is State.STARTING


def test_a_torque_beyond_the_limit_is_a_fault() -> None:
    file = file_of(plant_of("paper"), GAINS)
    law = ForceFreeController(file, 0.01, limits=Limits(torque=0.5))
    for k in range(60):
        law.step(0.0, 0.0, 0.15, 0.4, time_s=0.01 * k)
    law.step(0.0, 0.0, 0.6, 0.4, time_s=0.6)
    fault = law.status.fault
    assert fault is not None
    assert fault.reason is Reason.TORQUE


def test_a_disturbed_tare_is_not_used() -> None:
    case = corner("bench", GAINS, (0, 0, 0), stiff=True, delay=0.0, late=False)
    axis, law, command = rest(case, tared=False)
    before = law.learned
    assert law.tare()
    assert law.status.state is State.TARING
    assert not law.tare()
    push = np.zeros(8)
    push[4] = 0.3
    for k in range(450, 900):
        hand = push if (k // 20) % 3 == 0 and k < 760 else NO_HAND
        _, position, velocity, current = axis.advance(command, hand)
        command = law.step(position, velocity, current, 0.4, time_s=0.01 * k)
    assert any("disturbed" in note for note in law.status.notes)
    assert before is not None
    assert law.learned is not None
    assert law.learned[2] == pytest.approx(before[2], abs=0.1)


def test_the_paper_s_law_has_no_tare() -> None:
    law = ForceFreeController(file_of(plant_of("paper"), Controller(2.05, 1.68, 0.01)), 0.01)
    for k in range(60):
        law.step(0.0, 0.0, 0.15, 0.4, time_s=0.01 * k)
    assert law.ready
    assert not law.tare()
    assert law.learned is None
    with pytest.raises(InputError, match="unknown mode"):
        ForceFreeController(file_of(plant_of("paper")), 0.01, mode="heavy")


def test_sensors_noisier_than_thought_do_not_keep_it_from_starting() -> None:
    law = ForceFreeController(file_of(plant_of("paper"), GAINS), 0.01)
    rng = np.random.default_rng(0)
    for k in range(400):
        law.step(0.0, 0.0, 0.15 + 0.02 * rng.standard_normal(), 0.4, time_s=0.01 * k)
    assert law.status.state is not State.STARTING


def test_a_linear_axis_has_it_too() -> None:
    """Metres and newtons: it rests, is tared, and moves the way of the push."""
    from idtool.parameters import Parameter, Parameters
    from idtool.parameters.axis import Axis

    def pick(**values: float) -> dict[str, Parameter]:
        return {name: Parameter(value) for name, value in values.items()}

    file = Parameters(
        axis=Axis("linear", 30.0),
        gravity_model="slide",
        gravity=pick(base=0.0, per_payload=0.0),
        static=pick(coulomb=15.0, static=18.0, stribeck_velocity=0.01, viscous=200.0),
        dynamic=pick(bristle_stiffness=1e5, bristle_damping=100.0),
        controller=Controller(2.05, 0.01, 0.01, mode="light"),
    )
    law = ForceFreeController(file, limits=Limits(-0.2, 0.2, speed=0.3))
    place = 0.0
    for k in range(80):
        command = law.step(place, 0.0, 0.0, time_s=0.01 * k)
    assert law.ready
    assert law.tare()
    tared = [law.step(place, 0.0, 0.0, time_s=0.01 * k) for k in range(80, 130)]
    assert 1e-4 < max(map(abs, tared)) < 0.02
    law.reset()
    for k in range(200):
        command = law.step(place, 0.0, -20.0 / 30.0 if k > 80 else 0.0, time_s=0.01 * k)
    assert law.status.state is State.GUIDING
    assert command > place
    assert law.status.external_torque == pytest.approx(20.0, rel=0.3)
