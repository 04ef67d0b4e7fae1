"""BAM's models as docs/simulation.md compares with them."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from unittest import mock

import numpy as np
import pytest

from idtool import Parameters
from idtool.simulation.stage import Source
from pages import markdown
from pages.simulation import BAM, LeftOut, verdict
from testbench.bam import ERROR_GAIN, MODELS, RANGES, SPLITS, STEP_S, Swings, bam_logs, search

SERVO = {
    "kt": 0.4,
    "R": 4.0,
    "armature": 0.0015,
    "q_offset": 0.02,
    "command_delay": 0.012,
    "friction_base": 0.004,
    "friction_viscous": 0.006,
}
STRIBECK = {"friction_stribeck": 0.01, "dtheta_stribeck": 0.4, "alpha": 1.5}
STEPS = 600


def swings(*gains: float) -> Swings:
    """A pendulum of 0.49 kg on 0.1 m that is told to swing, once a gain."""
    time = STEP_S * np.arange(STEPS)
    goals = [np.sin(2.0 * time * (1.0 + k)) + 0.5 * np.sin(5.1 * time) for k in range(len(gains))]
    told = np.array([[gain, 7.4, 0.49, 0.1] for gain in gains])
    every = STEPS * len(gains)
    return Swings(
        np.concatenate(goals),
        np.zeros(every),
        np.ones(every),
        np.zeros(every),
        STEPS * np.arange(len(gains) + 1),
        np.zeros(len(gains)),
        told,
        (),
    )


def test_a_simulated_log_is_fitted_back_to_its_numbers() -> None:
    pytest.importorskip("cma")
    truth = {**SERVO, "load_friction_base": 0.15}
    made = swings(100.0, 400.0)
    made = replace(made, position=made.path(truth))
    found, spent = search(made, "M3", seed=1, evaluations=12_000)
    assert spent <= 12_030
    assert made.cost(found) < 5e-5
    assert found["kt"] / found["R"] == pytest.approx(0.1, rel=0.02)
    assert found["q_offset"] == pytest.approx(truth["q_offset"], abs=1e-3)
    assert found["command_delay"] == pytest.approx(truth["command_delay"], abs=1e-3)
    assert found["load_friction_base"] == pytest.approx(truth["load_friction_base"], rel=0.05)
    # back-EMF and viscous friction brake alike while the drive is on
    brake = found["kt"] ** 2 / found["R"] + found["friction_viscous"]
    assert brake == pytest.approx(0.4**2 / 4.0 + truth["friction_viscous"], rel=0.05)


def test_one_step_by_hand() -> None:
    """M6 where motor and load oppose each other, the load being the larger."""
    sides = {"load_friction_motor": 0.1, "load_friction_external": 0.2}
    fading = {"load_friction_motor_stribeck": 0.3, "load_friction_external_stribeck": 0.05}
    squares = {"load_friction_motor_quad": 0.01, "load_friction_external_quad": 0.005}
    values = {**SERVO, **STRIBECK, **sides, **fading, **squares, "command_delay": 0.0}
    start, speed, goal = 1.2, 0.5, 1.5
    one = swings(100.0)
    one = replace(
        one,
        goal=np.full(STEPS, goal),
        position=np.full(STEPS, start),
        velocity=np.array([speed]),
    )
    motor = 0.4 / 4.0 * (7.4 * 100.0 * ERROR_GAIN * (goal - start) - 0.4 * speed)
    load = -0.49 * 9.80665 * 0.1 * math.sin(start + 0.02)
    assert motor * load < 0.0
    assert abs(motor) < abs(load)
    fade = math.exp(-((speed / 0.4) ** 1.5))
    level = 0.004 + abs(0.2 * load - 0.1 * motor)
    level += fade * (0.01 + abs(0.05 * load - 0.3 * motor) + 0.01 * motor**2)
    after = speed + STEP_S / (0.49 * 0.01 + 0.0015) * (motor + load - level - 0.006 * speed)
    assert one.path(values)[1] == pytest.approx(start + STEP_S * after, abs=1e-12)


def test_models_hold_one_another() -> None:
    made = swings(100.0, 400.0)
    m4 = {**SERVO, **STRIBECK, "load_friction_base": 0.15, "load_friction_stribeck": 0.1}
    m5 = {
        **SERVO,
        **STRIBECK,
        **dict.fromkeys(("load_friction_motor", "load_friction_external"), 0.15),
        **dict.fromkeys(("load_friction_motor_stribeck", "load_friction_external_stribeck"), 0.1),
    }
    m6 = {**m5, "load_friction_motor_quad": 0.0, "load_friction_external_quad": 0.0}
    for smaller, larger in ((m4, m5), (m5, m6), (SERVO, {**SERVO, **STRIBECK, "friction_stribeck": 0.0})):
        np.testing.assert_array_equal(made.path(smaller), made.path(larger))
    assert np.max(np.abs(made.path(m4) - made.path(SERVO))) > 0.01


def test_it_rests_exactly_where_friction_holds_the_load() -> None:
    held = replace(swings(100.0), on=np.zeros(STEPS), position=np.full(STEPS, 0.3))
    values = {**SERVO, "friction_base": 0.2}
    assert np.all(held.path(values) == 0.3)


def test_a_drive_that_is_off_does_not_brake() -> None:
    free = replace(swings(100.0), on=np.zeros(STEPS), position=np.full(STEPS, 0.8))
    path = free.path({**SERVO, "friction_base": 0.0, "friction_viscous": 0.0, "q_offset": 0.0})
    assert np.max(path[STEPS // 2 :]) == pytest.approx(0.8, abs=0.01)


def test_every_parameter_of_a_model_has_a_range() -> None:
    assert set().union(*MODELS.values()) == set(RANGES)


def test_the_page_s_fits_are_those_of_the_models(measured: Path) -> None:
    document = json.loads(BAM.read_text())
    assert set(SPLITS) <= set(document)
    logs = bam_logs(measured)
    for title, left_out in SPLITS.items():
        fits = document[title]
        assert {(one["model"], one["seed"]) for one in fits} == {(m, s) for m in MODELS for s in (1, 2, 3)}
        out = Swings.of([logs[key] for key in left_out])
        for one in fits:
            again = [1e3 * error for error in out.errors(one["values"], "goal")]
            assert again == pytest.approx(one["goal"], rel=1e-3)


def test_ours_is_held_against_the_best_of_bam_s_fits() -> None:
    theirs = [
        {"model": model, "seed": seed, "fitted": fitted, "goal": [goal] * 3, "effort": [effort] * 3}
        | {"evaluations": 1000, "seconds": 2.0}
        for model, seed, fitted, goal, effort in (
            ("M1", 1, 30.0, 40.0, 50.0),
            ("M1", 2, 20.0, 60.0, 45.0),
            ("M4", 1, 25.0, 50.0, 90.0),
        )
    ]
    ours: dict[Source, list[float]] = {"goal": [10.0, 20.0, 60.0], "effort": [40.0, 40.0, 40.0]}
    one = LeftOut("gain 100", mock.Mock(spec=Parameters), 1500, 21.0, ours, theirs)
    assert markdown.row(one.cells) == (
        "| gain 100 | 30.0 (10, 20, 60) | 40.0 (M1: 40 to 60) | 0.750 | 40.0 (40, 40, 40) | "
        "45.0 (M1: 45 to 50) | **0.889** | 1,500 in 21 s | 1,000 in 2 s |"
    )
    text = " ".join(verdict([one]).split())
    assert "From the goals ours is at most 0.8 of BAM's best in 1 of 1." in text
    assert "From the duty ours is at most 0.8 of BAM's best in 0 of 1, not with gain 100 (0.889)." in text
    assert "60 mrad from the goals and 45 from the duty" in text  # the fit nearest to its own logs
