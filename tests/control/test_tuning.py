"""Gains for a wanted feel: what is promised holds on the simulated axis, what is refused oscillates there."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from idtool.control.admittance.tuning import margins_of, tune, tuned, uncertainty_after_tare
from idtool.control.online import OnlineModel
from idtool.errors import InputError
from idtool.guiding.hand import travel_per_position
from idtool.parameters import Controller, Parameter
from idtool.rig.opening import read_plant
from testbench.guided_axes.cases import AXES, corner, file_of
from testbench.guided_axes.pushes import GAINS, guide


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize(("force", "speed"), [(2.0, 19.2), (3.0, 19.2), (2.5, 15.0)])
def test_the_feel_is_what_was_asked_for(axis: str, force: float, speed: float) -> None:
    file = file_of(read_plant(axis))
    ratio = travel_per_position(file)
    assert ratio is not None
    tuning = tune(file, force=force, speed=1e-3 * speed, ratio=ratio)
    assert tuning.controller.loop_gain == pytest.approx(tuning.speed / (tuning.torque - tuning.uncertainty))
    assert tuning.worst.gain >= 1.1
    case = corner(axis, GAINS, (0, 0, 0), stiff=False, delay=0.0, late=False)
    case = replace(case, file=tuned(file, tuning), bristle=0.0, stiffness=1000.0, damping=20.0)
    run = guide(case, tared=True, ramps=False)
    felt = run.force * speed / 19.2 if speed != 19.2 else run.force
    assert felt == pytest.approx(force, rel=0.25)
    assert run.swing < 1.5


@pytest.mark.parametrize("axis", AXES)
def test_margins_say_where_it_oscillates(axis: str) -> None:
    """A gain beyond the margin swings on the simulated axis, one well inside it does not."""
    model = OnlineModel(file_of(read_plant(axis)))
    ratio = read_plant(axis).gravity["per_payload_nm_per_kg"] / 9.80665
    base = corner(axis, GAINS, (0, 0, 0), stiff=True, delay=0.02, late=True)
    margins = margins_of(model, 1.0, ratio, 0.01, 20.0)
    (critical,) = [m.gain for m in margins if (m.hand, m.delay, m.friction) == ("stiff", 0.02, 1.0)]
    swings = {}
    for share in (0.6, 1.7):
        gains = Controller(2.05, share * critical, 0.01, mode="light")
        run = guide(replace(base, file=replace(base.file, controller=gains)), tared=True, ramps=False)
        swings[share] = 99.0 if run.note else run.swing  # its tare was disturbed by its own shaking
    assert swings[0.6] < 1.5
    assert swings[1.7] > 3.0


def test_refuses_what_cannot_be_and_says_why() -> None:
    file = file_of(read_plant("paper"))
    ratio = travel_per_position(file)
    assert ratio is not None
    with pytest.raises(InputError, match=r"oscillates: against a stiff hand .* ask for \d\.\d+ N or more"):
        tune(file, force=1.2, speed=0.0192, ratio=ratio)
    with pytest.raises(InputError, match="the model is uncertain by"):
        tune(file, force=0.3, speed=0.0192, ratio=ratio)
    with pytest.raises(InputError, match="above zero"):
        tune(file, force=-1.0, speed=0.0192, ratio=ratio)


@pytest.mark.parametrize(
    ("asked", "brakes"),
    [
        ({}, False),
        ({"force": 5.56}, False),  # the paper's: twice as heavy as bare friction
        ({"force": 0.9e3}, True),  # given in mN
        ({"speed": 19.2e-6}, True),  # given in m/s
        ({"ratio": 4.5}, True),  # in cm
    ],
    ids=["usual", "the paper's", "mN", "m/s", "cm"],
)
def test_gains_that_brake_the_hand_are_said(asked: dict[str, float], brakes: bool) -> None:
    file = file_of(read_plant("paper"))
    ratio = travel_per_position(file)
    assert ratio is not None
    tuning = tune(file, **({"force": 2.0, "speed": 0.0192, "ratio": ratio} | asked))
    assert bool(tuning.notes) == brakes
    assert tuning.to_document()["notes"] == list(tuning.notes)
    assert all("they brake the hand (forces in N" in note for note in tuning.notes)


def test_the_force_that_is_said_is_the_one_at_guiding_speed() -> None:
    file = file_of(read_plant("paper"))
    tuning = tune(file, force=200.0, speed=0.0192, ratio=0.0454)
    bare = (0.07 - 0.04 * math.exp(-((0.0192 / 0.0454 / 0.09) ** 2)) + 0.155 * 0.0192 / 0.0454) / 0.0454
    assert f"these gains take 200 N, and friction with the drive off {bare:.3g} N" in tuning.notes[0]


def test_a_less_certain_file_leaves_more_to_the_hand() -> None:
    file = file_of(read_plant("paper"))
    static = dict(file.static)
    static["coulomb"] = Parameter(0.07, stderr=0.05)
    vague = replace(file, static=static)
    assert uncertainty_after_tare(vague, 0.4225, 0.01) > 1.05 * uncertainty_after_tare(file, 0.4225, 0.01)
