"""The admittance law: light, at rest when it should, in legal states, and never pushing the hand."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from idtool.control import ForceFreeController, Limits, Reason, State
from idtool.control.admittance import record
from idtool.control.admittance.constants import CONSTANTS
from idtool.control.admittance.states import GUIDING, ORDER, TRANSITIONS
from idtool.errors import InputError
from idtool.parameters import Controller, EffectEntry, Parameter, Parameters
from idtool.parameters.axis import Axis
from idtool.rig.base import TrialSetup
from idtool.rig.numbers import plant_numbers
from idtool.rig.opening import read_plant
from testbench.board.files import stated
from testbench.guided_axes.axis import NO_HAND, GuidedAxis
from testbench.guided_axes.cases import AXES, Case, corner, file_of, random_case
from testbench.guided_axes.pushes import COUNT, GAINS, at_rest, guide
from testbench.guided_machines import plant
from testbench.guided_machines.figures import SCENARIOS, alone
from testbench.guided_machines.hands import PERIOD, Arm, Script
from testbench.guided_machines.machines import PAYLOAD_KG, Machine, random_machine, replace_friction
from testbench.guided_machines.session import DEAD, HAND, SPEED, STATE, STEPS, Run, controller_of, session

CORNERS = [(1, 1, 1), (-1, -1, -1), (1, -1, 1), (-1, 1, -1)]


@pytest.mark.parametrize("stiff", [False, True], ids=["soft", "stiff"])
@pytest.mark.parametrize("signs", CORNERS, ids=str)
@pytest.mark.parametrize("axis", AXES)
def test_light_in_the_corners(axis: str, signs: tuple[int, int, int], stiff: bool) -> None:
    """Friction 30 % off, payload 20 g off, readings 10 ms late: light, and calm. What two standard deviations
    of a friction 30 % above the file leave to the hand comes on top of 2 N."""
    run = guide(corner(axis, GAINS, signs, stiff=stiff, delay=0.01, late=False), tared=True)
    assert run.note == ""
    assert run.force <= 2.0 * (1.3 if max(signs) > 0 else 1.0)
    assert all(push.speed == pytest.approx(19.2, rel=0.1) for push in run.pushes)
    assert run.drift < 0.1
    assert run.ripple < 1.0
    assert run.swing < 2.0
    assert run.energy < 0.0
    assert run.stop <= 90.0  # docs/teach.md has the distribution
    assert run.starts == 0


@pytest.mark.parametrize("axis", AXES)
def test_the_file_s_own_axis_starts_below_one_newton_and_stops_at_once(axis: str) -> None:
    case = corner(axis, GAINS, (0, 0, 0), stiff=False, delay=0.0, late=False)
    run = guide(replace(case, bristle=0.0), tared=True)
    assert run.break_away < 1.1  # the stiff bristle needs the hysteresis of 1.5 counts
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


@pytest.mark.parametrize("number", [29, 30, 31])
@pytest.mark.parametrize("kind", ["known", "unknown"])
def test_nothing_starts_on_what_a_stop_left(kind: str, number: int) -> None:
    run = guide(drawn(kind, number, 40), tared=True)
    assert run.starts == 0
    assert run.ripple < 1.0
    assert run.energy < 0.0


def test_a_motion_does_not_turn_round_without_a_rest() -> None:
    run = guide(drawn("none", 18, 40), tared=True)
    guided = run.felt[:, 5] == list(State).index(State.GUIDING)
    ways = np.sign(run.felt[:, 4])
    turned = guided[1:] & guided[:-1] & (ways[1:] * ways[:-1] < 0.0)
    assert np.any(guided)
    assert not np.any(turned)


def test_a_tare_learns_what_is_wrong() -> None:
    """The file is 30 % off in friction and 20 g in the payload; a stiff bristle tells them apart."""
    case = corner("bench", GAINS, (1, -1, 1), stiff=True, delay=0.0, late=False)
    law = rest(case)
    learned = law[1].learned
    assert learned is not None
    load, level, damping = learned
    assert load == pytest.approx(0.02 * 0.42, abs=0.005)
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


def test_a_torque_beyond_the_limit_is_a_fault() -> None:
    file = file_of(read_plant("paper"), GAINS)
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
    law = ForceFreeController(file_of(read_plant("paper"), Controller(2.05, 1.68, 0.01)), 0.01)
    for k in range(60):
        law.step(0.0, 0.0, 0.15, 0.4, time_s=0.01 * k)
    assert law.ready
    assert not law.tare()
    assert law.learned is None
    with pytest.raises(InputError, match="unknown mode"):
        ForceFreeController(file_of(read_plant("paper")), 0.01, mode="heavy")


def test_a_linear_axis_has_it_too() -> None:
    """Metres and newtons: it rests, is tared, and moves the way of the push."""

    file = Parameters(
        axis=Axis("linear", 30.0),
        gravity_model="slide",
        gravity=stated(base=0.0, per_payload=0.0),
        static=stated(coulomb=15.0, static=18.0, stribeck_velocity=0.01, viscous=200.0),
        dynamic=stated(bristle_stiffness=1e5, bristle_damping=100.0),
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


def declared(machine: Machine, delay: float = 0.0) -> Parameters:
    """A file that says what the machine is, as far as a file can, and how late the motion is read."""
    p, kilogram = machine.plant, machine.per_payload

    def pick(**values: float) -> dict[str, Parameter]:
        return {name: Parameter(value, stderr=0.02 * abs(value)) for name, value in values.items()}

    bristle = pick(
        bristle_stiffness=max(p.coulomb, p.static) / p.presliding, bristle_damping=p.bristle_damping
    )
    return Parameters(
        axis=Axis("rotary", p.torque_constant),
        gravity_model="slide",
        gravity=stated(base=machine.base, per_payload=kilogram),
        static=stated(
            coulomb=p.coulomb, static=p.static, stribeck_velocity=p.stribeck_velocity, viscous=p.viscous
        ),
        dynamic=bristle,
        effects=(
            EffectEntry("inertia", {"inertia": Parameter(p.inertia)}),
            *([EffectEntry("transport_delay", {"delay": Parameter(delay)})] if delay else []),
        ),
        controller=Controller(2.05, 7.0, PERIOD, mode="light"),
    )


ARM = Arm()


def machine(number: int) -> Machine:
    """A machine of the study: even ones have a soft bristle, odd ones a stiff one."""
    rng = np.random.default_rng(1)
    return [random_machine(rng, k) for k in range(number + 1)][number]


def run_of(number: int, scenario: str, arm: Arm = ARM) -> tuple[Run, dict[str, float]]:
    """A scenario of the study, friction 20 % above the file."""
    one = machine(number)
    script, judge, start = SCENARIOS[scenario]
    p = replace_friction(one.on(PAYLOAD_KG + 0.01), 1.2, 1.2)
    run = session(declared(one), p, script(arm), number, start)
    return run, judge(run, arm) | alone(run)


@pytest.mark.parametrize(("number", "delay"), [(0, 0.0), (1, 0.0), (1, 0.013), (1, -0.013)])
def test_the_study_runs_what_the_controller_runs(number: int, delay: float) -> None:
    """Sample by sample, on the plant of the study, until after the first push."""
    one, script = machine(number), SCENARIOS["kind"][0](Arm())
    p, rows = one.on(PAYLOAD_KG), script.table()
    file = declared(one, delay)
    run = session(file, p, script, 3)
    rng = np.random.default_rng(3)
    body, past = plant.at_rest(p, 0.0, float(rng.uniform(-0.9, 0.9)))
    noise = rng.standard_normal((len(rows), 3))
    law, truth = controller_of(file), np.empty((plant.KEPT, 10))
    before = command = 0.0
    commands = []
    for k, row in enumerate(rows[:900]):
        plant.advance(p, body, past, row, rows[k + 1], before, command, False, STEPS, truth, 0)
        before = command
        q, w, current = plant.reading(p, body, past, noise[k], 5)
        if row[plant.TARE]:
            assert law.tare()
        command = law.step(q, w, current, PAYLOAD_KG, time_s=(k + 1) * PERIOD)
        commands.append(command)
    assert law.status.fault is None
    assert set(run.felt[:900, 3]) == {0.0, 1.0, 2.0, 3.0, 4.0}
    np.testing.assert_allclose(commands, run.felt[:900, 0], atol=1e-9)


@pytest.mark.parametrize("number", [0, 1])
def test_every_change_of_state_is_in_the_table(number: int) -> None:
    legal = {(state, to) for state, ways in TRANSITIONS.items() for to, _ in ways}
    seen: set[tuple[State, State]] = set()
    for scenario in ("kind", "reversing", "trembling", "leaning_0.5"):
        states = [ORDER[int(k)] for k in run_of(number, scenario)[0].felt[:, 3]]
        seen |= {(a, b) for a, b in pairwise(states) if a is not b}
    assert seen == legal


@pytest.mark.parametrize("number", [0, 1, 3])
@pytest.mark.parametrize("scenario", [name for name in SCENARIOS if not name.startswith("leaning")])
def test_it_only_moves_the_way_that_is_certain(number: int, scenario: str) -> None:
    """The proof of passivity, line for line: w f > 0, or w is zero."""
    run, _ = run_of(number, scenario)
    guided = run.felt[:, STATE] == GUIDING
    certain = np.sign(run.felt[:, HAND]) * np.maximum(np.abs(run.felt[:, HAND]) - run.felt[:, DEAD], 0.0)
    speed = run.felt[:, SPEED] * guided
    assert np.any(guided)
    assert np.all(speed * certain >= 0.0)
    assert np.all((speed == 0.0) | (certain != 0.0))


@pytest.mark.parametrize("number", [0, 1, 3])
def test_unkind_hands(number: int) -> None:
    _, turned = run_of(number, "reversing")
    assert turned["turned"] < 120.0
    assert turned["starts"] == 0.0
    _, brisk = run_of(number, "brisk")
    assert brisk["followed"] > 10.0
    assert brisk["starts"] == 0.0
    for lean in ("leaning_0.5", "leaning_0.75", "leaning_1"):
        assert run_of(number, lean)[1]["ran"] < 1.0
    assert run_of(number, "ending")[1]["left"] > 5.0
    _, trembling = run_of(number, "trembling")
    assert trembling["tremble"] < 3.0
    _, breath = run_of(number, "breathing")
    assert max(breath[f"wander_{n:g}"] for n in (0.4, 0.6, 1.2)) < 30.0


def test_a_file_that_knows_how_late_the_motion_is_read_holds_no_hand_up() -> None:
    """The current tells of a hand at once: if it waited for the motion, a trembling hand would stop it."""
    one = machine(4)
    p, delay = one.on(PAYLOAD_KG), one.plant.motion_delay
    assert (delay > 0.015, one.plant.current_delay) == (True, 0.0)
    for scenario, figure, most in (("trembling", "false_stops", 0.0), ("kind", "stop", 30.0)):
        script, judge, start = SCENARIOS[scenario]
        run = session(declared(one, delay), p, script(ARM), 4, start)
        assert judge(run, ARM)[figure] <= most


def test_a_tare_that_finds_another_payload_says_which() -> None:
    one = machine(1)
    p = one.on(PAYLOAD_KG + 0.15)
    run = session(declared(one), p, SCENARIOS["leaning_0.5"][0](Arm()), 0)
    law = controller_of(declared(one))
    assert run.outcome == record.TOUCHED
    clean = session(declared(one), p, Script().tare().alone(2.0), 0)
    assert clean.outcome == record.OTHER_LOAD
    assert np.ptp(clean.truth[0, -1000:]) < COUNT
    assert law.status.notes == ()


def test_every_constant_says_what_it_is_and_where_from() -> None:
    for name, constant in CONSTANTS.items():
        assert constant.meaning, name
        assert constant.source, name
        assert constant.unit in {"s", "1", "1/s", "noises", "counts"}, name
