"""The controller on a small axis: which way it goes, that it rests, and what the file's effects buy."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from idtool.control import ForceFreeController, State
from idtool.control.force_free import COMMAND_GAIN, LOOP_GAIN, gains
from idtool.errors import InputError, RigFault
from idtool.guiding import ConstantForceHand, ImpedanceHand, Push, TeachResult, teach
from idtool.guiding.hand import travel_per_position
from idtool.model.units import STANDARD_GRAVITY
from idtool.parameters import Controller, Parameters
from idtool.rig.base import TrialSetup

from .double import BENCH, PAPER, Double, parameters

RATIO = PAPER["per_payload"] / STANDARD_GRAVITY
BOTH = (Push(1), Push(-1))


def guide(
    file: Parameters,
    rig: Double,
    hand: ConstantForceHand | ImpedanceHand | None = None,
    *,
    payload: float = 0.4,
    alpha: float = 0.0,
    beta: float = 0.0,
    seconds: float | None = None,
    button: Callable[[float], bool] | None = None,
) -> TeachResult:
    setup = TrialSetup(payload, alpha, beta, start_position=0.0)
    return teach(
        file, ForceFreeController(file, 0.01), rig, setup, hand=hand, duration_s=seconds, button=button
    )


@pytest.mark.parametrize("values", [PAPER, BENCH], ids=["paper", "bench"])
@pytest.mark.parametrize("direction", [1, -1])
def test_a_push_one_way_moves_that_way(values: dict[str, float], direction: int) -> None:
    hand = ConstantForceHand(0.2526, (Push(direction, push_s=1.0, rest_s=0.5),))
    result = guide(parameters(values), Double(values), hand)
    assert direction * (result.record.position[-1] - result.record.position[0]) > 0.2
    assert direction * result.record.estimated[result.record.hand != 0].mean() > 0.15


@pytest.mark.parametrize("values", [PAPER, BENCH], ids=["paper", "bench"])
def test_yields_as_the_paper_says(values: dict[str, float]) -> None:
    """With a stiff position loop Eq. 11 is w = K_c tau, less the servo's own share T / (K_r + T)."""
    torque = 5.56 * RATIO
    result = guide(parameters(values), Double(values, position_gain=8.0), ConstantForceHand(torque, BOTH * 2))
    assert result.figures is not None
    wanted = LOOP_GAIN["rotary"] * torque * COMMAND_GAIN / (COMMAND_GAIN + 1 / 8.0)
    assert result.figures.pushes[-1].speed == pytest.approx(wanted, rel=0.08)
    assert result.figures.force_n == pytest.approx(5.56, rel=0.03)
    assert result.figures.pushes[-1].stop_ms <= 200
    assert result.figures.overshoot_counts <= 6  # what the servo's own integrator springs back
    assert result.figures.ripple_counts <= 1.5


def test_the_gains_of_the_paper_and_its_figures_agree() -> None:
    """5.56 N at the slide with the inferred pulley give the printed 19.20 mm/s within one per cent."""
    assert LOOP_GAIN["rotary"] * 5.56 * RATIO * RATIO == pytest.approx(0.01920, rel=0.01)
    assert travel_per_position(parameters()) == pytest.approx(2 * 0.0265 * 6 / 7)


@pytest.mark.parametrize("values", [PAPER, BENCH], ids=["paper", "bench"])
@pytest.mark.parametrize(("payload", "alpha", "beta"), [(0.0, 0.0, 0.0), (1.5, 0.0, 0.0), (0.4, 0.7, -0.5)])
def test_holds_gravity_and_stands_without_a_hand(
    values: dict[str, float], payload: float, alpha: float, beta: float
) -> None:
    rig = Double(values, bristle=0.0, seed=3)
    result = guide(parameters(values), rig, payload=payload, alpha=alpha, beta=beta, seconds=4.0)
    later = result.record.position[100:]
    assert np.ptp(later) <= 1.01 * 2 * math.pi / 4096
    assert set(result.record.state[100:]) == {State.RESTING}
    assert abs(result.record.estimated[100:].mean()) < 0.01
    weight = (PAPER["base"] + PAPER["per_payload"] * payload) * math.cos(alpha) * math.cos(beta)
    assert result.record.compensated[-1] == pytest.approx(weight, abs=0.02)


def test_a_missing_payload_lets_the_slide_rise() -> None:
    """The paper's own observation: compensated for a camera that is not there, the slide goes up."""
    rig = Double(real_payload=0.0, bristle=0.0)
    result = guide(parameters(), rig, payload=0.4, seconds=3.0, button=lambda now: now > 1.0)
    time, position = result.record.time, result.record.position
    assert abs(position[time < 1.0][-1] - position[0]) < 0.01, "not while the button is up"
    assert position[-1] > position[0] + 0.05
    assert np.max(np.abs(result.record.velocity)) < 0.35
    assert any("not mounted" in note for note in result.notes)


def test_without_a_button_a_missing_payload_is_a_fault() -> None:
    rig = Double(real_payload=0.0, bristle=0.0)
    with pytest.raises(RigFault, match=r"carries -0\.1\d+ N m beside its model \(as -0\.\d+ kg would\)"):
        guide(parameters(), rig, payload=0.4, seconds=3.0)


@pytest.mark.parametrize("values", [PAPER, BENCH], ids=["paper", "bench"])
@pytest.mark.parametrize("stiffness", [200.0, 2000.0])
def test_gives_no_energy_to_the_hand(values: dict[str, float], stiffness: float) -> None:
    file = parameters(values)
    hand = ImpedanceHand.at_slide(file, stiffness_n_per_m=stiffness)
    result = guide(file, Double(values), hand)
    assert result.figures is not None
    assert all(push.energy_to_hand < 0 for push in result.figures.pushes)


EFFECTS = {
    "torque_offset": ({"offset": 0.07}, lambda q, w: 0.07),
    "position_stiffness": ({"stiffness": 0.25, "neutral": -0.3}, lambda q, w: 0.25 * (q + 0.3)),
    "nonlinear_viscous": ({"quadratic": 0.5}, lambda q, w: 0.5 * abs(w) * w),
    "position_ripple": (
        {"cycles": 6.0, "amplitude_1": 0.1, "phase_1": 0.0, "amplitude_2": 0.0, "phase_2": 0.0},
        lambda q, w: 0.1 * math.sin(6.0 * q),
    ),
}


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_in_the_file_makes_the_hand_lighter(name: str) -> None:
    """Same plant, same hand: how unevenly the hand must push falls when the file knows the effect."""
    numbers, truth = EFFECTS[name]
    base = parameters()
    felt = {}
    for label, file in (("base", base), ("extended", parameters(**{name: numbers}))):
        hand = ImpedanceHand.at_slide(base, sequence=BOTH)
        result = guide(file, Double(extra=truth), hand)
        pushing = np.abs(result.record.hand) > 0
        wanted = gains(base, 0.01).loop_gain
        # what the hand has to add beyond the yielding that the gains ask for
        felt[label] = float(np.mean(np.abs(result.record.hand - result.record.velocity / wanted)[pushing]))
    assert felt["extended"] < 0.6 * felt["base"]


def test_reads_the_file_s_gains_and_period() -> None:
    file = replace(parameters(), controller=Controller(1.0, 3.0, 0.02))
    controller = ForceFreeController(file)
    assert (controller.command_gain, controller.loop_gain, controller.period) == (1.0, 3.0, 0.02)


def test_says_what_it_cannot_compensate() -> None:
    file = parameters(external_periodic={"frequency": 0.3, "amplitude": 0.05, "phase": 0.0})
    (note,) = ForceFreeController(file).status.notes
    assert "external_periodic is not compensated" in note


def test_a_missing_temperature_is_said_once() -> None:
    file = parameters(thermal_drift={"rate": 0.01, "reference": 25.0})
    controller = ForceFreeController(file, 0.01)
    for k in range(5):
        controller.step(0.0, 0.0, 0.1, temperature_degc=30.0 if k < 2 else None)
    assert controller.status.notes == ()
    controller.reset()
    for _ in range(3):
        controller.step(0.0, 0.0, 0.1)
    assert controller.status.notes == ("thermal_drift is not compensated: no temperature was given",)


def test_arguments_that_cannot_be_are_told_by_name() -> None:
    with pytest.raises(InputError, match=r"^parameters: is str, not Parameters; give Parameters.read"):
        ForceFreeController("params.toml")  # type: ignore[arg-type]
    for period in (-0.01, 0.0, float("nan"), float("inf")):
        with pytest.raises(InputError, match=r"^period_s: is \S+ s; give the period in seconds"):
            ForceFreeController(parameters(), period)
