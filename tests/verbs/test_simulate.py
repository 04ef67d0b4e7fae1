"""Forward simulation: the motion comes back from the torque that made it, and what stands stays."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool import Axis, InputError, Parameters
from idtool.model import forward
from idtool.parameters import EffectEntry, Parameter
from idtool.verbs.simulate import simulate
from testbench.pendulums import GRAVITY, Pendulum

from .support import SINE, ffc_id
from .support import record as made

SWING = Pendulum()


def truth(swing: Pendulum = SWING, **more: object) -> Parameters:
    pull = swing.mass * GRAVITY * swing.lever + swing.own
    return Parameters(
        axis=Axis("rotary", swing.torque_constant),
        gravity_model="arm",
        gravity={"sin": Parameter(pull), "cos": Parameter(0.0)},
        static={
            "coulomb": Parameter(swing.coulomb),
            "static": Parameter(swing.coulomb),
            "stribeck_velocity": Parameter(0.1),
            "viscous": Parameter(swing.viscous),
        },
        effects=(EffectEntry("inertia", {"inertia": Parameter(swing.inertia)}),),
        **more,  # type: ignore[arg-type]
    )


def test_the_motion_comes_back_from_its_torque() -> None:
    log = SWING.log(seconds=10.0, noise=0.0)
    found = simulate(log, truth())
    assert list(found.frame) == ["trial", "time_s", "position_rad", "position_simulated_rad"]
    assert found.mean_abs < 0.02  # rounding of the position makes torque errors that add up
    assert found.rms_windows < 0.002
    assert found.trials[0].mean_abs == pytest.approx(found.mean_abs)


def test_from_the_goal_through_the_loop_that_is_identified() -> None:
    log = SWING.log(seconds=10.0, noise=0.0)
    effort = SWING.torque_constant * log.frame["current_a"]
    gain = 8.0  # N m/rad
    goal = log.frame["position_rad"] + effort / gain
    later = np.interp(log.frame["time_s"] + 0.02, log.frame["time_s"], goal)  # told 20 ms early
    logged = replace(log, frame=log.frame.assign(position_command_rad=later))
    found = simulate(logged, truth(), "goal")
    assert found.mean_abs < 0.002
    assert any("from these logs" in note for note in found.notes)
    with pytest.raises(InputError, match='has no column "position_command_rad"'):
        simulate(log, truth(), "goal")


def test_an_axis_below_break_away_stands_exactly() -> None:
    numbers = np.zeros(forward.NUMBERS)
    numbers[[forward.INERTIA, forward.COULOMB, forward.STATIC, forward.STRIBECK]] = 0.01, 0.1, 0.15, 0.05
    numbers[forward.EXPONENT], numbers[forward.POSITION_STEP] = 2.0, 1.0
    numbers[[forward.FIRST_POSITION, forward.VELOCITY_STEP]] = -5.0, 1.0
    plant = forward.Plant(numbers, np.zeros((2 * forward.FIELDS, 11)), np.zeros(2))
    clock = np.arange(0.0, 4.0, 0.01)
    torque = np.where(clock < 0.2, 0.6, 0.14 * np.sin(20.0 * clock))  # a push, then below break-away
    rest = np.zeros(len(clock))
    path = forward.simulate(
        plant, clock, torque, rest + 1.0, rest + 1.0, rest, (0.0, 0.0, 0.0), by_goal=False
    )
    last = path[clock > 3.0]
    assert path[clock < 0.2, 1].max() > 1.0
    assert (last[:, 1] == 0.0).all()
    assert np.ptp(last[:, 0]) == 0.0


def test_a_stiff_bristle_ends_where_plain_stiction_does() -> None:
    log = SWING.log(seconds=10.0, noise=0.0)
    stiff = {"bristle_stiffness": Parameter(500.0), "bristle_damping": Parameter(0.5)}
    plain, bristle = simulate(log, truth()), simulate(log, truth(dynamic=stiff))
    one, other = (found.frame["position_simulated_rad"] for found in (plain, bristle))
    assert np.abs(one - other).max() < 0.02


def test_a_thousand_times_as_fast_as_the_axis() -> None:
    log = SWING.log(seconds=10.0)
    file = truth()
    simulate(log, file)  # compiled
    from idtool.signals import record
    from idtool.verbs.plant import PlantFile
    from idtool.verbs.simulate import Stage

    recording = record([replace(log, axis=file.axis)], every_row=True)
    stage = Stage.of([log], recording, PlantFile.of(file, 1.0), "effort")
    used = []
    for _ in range(3):
        begin = time.process_time()
        stage.run(np.inf)
        used.append(time.process_time() - begin)
    assert min(used) < 10.0 / 1000.0


def test_the_simulated_rig_which_has_formulas_of_its_own_agrees(tmp_path: Path) -> None:
    log = made(SINE, tmp_path / "sine.csv")
    axis = {"coulomb": 0.08, "static": 0.115, "stribeck_velocity": 0.08, "viscous": 0.12}  # bench.toml
    bench = Parameters(
        axis=Axis("rotary", 2.67),
        gravity_model="slide",
        gravity={"base": Parameter(0.2), "per_payload": Parameter(0.42)},
        static={name: Parameter(value) for name, value in axis.items()},
        dynamic={"bristle_stiffness": Parameter(8.0), "bristle_damping": Parameter(0.2)},
        effects=(EffectEntry("inertia", {"inertia": Parameter(0.008)}),),
    )
    found = simulate(log, bench)
    stroke = float(np.ptp(log.frame["position_rad"]))
    assert found.rms_windows < 0.02 * stroke
    half = replace(bench, static={**bench.static, "viscous": Parameter(0.06)})
    assert simulate(log, half).rms_windows > 3.0 * found.rms_windows


def test_a_drive_that_is_off_lets_go() -> None:
    log = SWING.log(seconds=6.0, noise=0.0)
    off = log.frame["time_s"].to_numpy() > 4.0
    frame = log.frame.assign(drive_on=np.where(off, 0.0, 1.0))
    found = simulate(replace(log, frame=frame), truth()).frame["position_simulated_rad"].to_numpy()
    assert abs(found[-1]) < np.arcsin(SWING.coulomb / (SWING.mass * GRAVITY * SWING.lever)) + 0.01


def test_a_file_without_inertia_is_refused() -> None:
    with pytest.raises(InputError, match="has no inertia, so nothing says how fast"):
        simulate(SWING.log(seconds=3.0), replace(truth(), effects=()))


def test_from_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log, file, out = tmp_path / "swing.csv", tmp_path / "params.toml", tmp_path / "out.csv"
    SWING.log(seconds=6.0, axis=Axis("rotary", SWING.torque_constant)).write(log)
    truth().write(file)
    code, said, _ = ffc_id(capsys, "simulate", log, "-p", file, "-o", out)
    assert code == 0
    assert "mrad mean absolute" in said
    assert list(pd.read_csv(out)) == ["trial", "time_s", "position_rad", "position_simulated_rad"]
    code, _, said = ffc_id(capsys, "simulate", log, "-p", file, "--from", "goal", "-o", tmp_path / "b.csv")
    assert code == 3
    assert 'no column "position_command_rad"' in said
    code, _, said = ffc_id(capsys, "calibrate", log, "--lever", "0.1")
    assert code == 2
    assert "--lever without --mass" in said
    code, said, _ = ffc_id(capsys, "calibrate", log, "--mass", "0.5", "--lever", "0.1", "-p", file)
    assert code == 0
    assert float(said.split()[1]) == pytest.approx(1.2, rel=0.01)
    assert Parameters.read(file).axis.extra["torque_constant_stderr"] > 0.0
