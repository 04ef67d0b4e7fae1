"""Forward simulation: the motion comes back from the torque that made it, and what stands stays."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool import Axis, InputError, Parameters
from idtool.model.units import STANDARD_GRAVITY
from idtool.parameters import EffectEntry, Parameter
from idtool.verbs.simulate import simulate
from testbench.pendulums import Pendulum

from .support import SINE, ffc_id
from .support import record as made

SWING = Pendulum()
TRUTH = SWING.parameters()


def test_the_motion_comes_back_from_its_torque() -> None:
    log = SWING.log(seconds=10.0, noise=0.0)
    shares: list[float] = []
    found = simulate(log, TRUTH, progress=shares.append)
    assert shares == [0.5, 1.0]  # whole trials, then windows
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
    logged = replace(log, rows=log.frame.assign(position_command_rad=later))
    found = simulate(logged, TRUTH, "goal")
    assert found.mean_abs < 0.002
    assert any("from these logs" in note for note in found.notes)
    with pytest.raises(InputError, match='has no column "position_command_rad"'):
        simulate(log, TRUTH, "goal")


def test_a_stiff_bristle_ends_where_plain_stiction_does() -> None:
    log = SWING.log(seconds=10.0, noise=0.0)
    stiff = {"bristle_stiffness": Parameter(500.0), "bristle_damping": Parameter(0.5)}
    plain, bristle = simulate(log, TRUTH), simulate(log, replace(TRUTH, dynamic=stiff))
    one, other = (found.frame["position_simulated_rad"] for found in (plain, bristle))
    assert np.abs(one - other).max() < 0.02


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
    found = simulate(replace(log, rows=frame), TRUTH).frame["position_simulated_rad"].to_numpy()
    assert abs(found[-1]) < np.arcsin(SWING.coulomb / (SWING.mass * STANDARD_GRAVITY * SWING.lever)) + 0.01


def test_a_payload_is_accelerated_too() -> None:
    """The same motion, its inertia told as half of the axis' own and half of the payload's."""
    log = SWING.log(seconds=6.0, noise=0.0)
    loaded = replace(log, rows=log.frame.assign(payload_kg=0.5))
    own = TRUTH.effects[0].parameters["inertia"].value
    apart = {"inertia": Parameter(0.5 * own), "per_payload": Parameter(own)}
    halves = TRUTH.with_effect(EffectEntry("inertia", apart))
    assert simulate(loaded, halves).mean_abs == pytest.approx(simulate(log, TRUTH).mean_abs, rel=1e-9)
    assert simulate(log, halves).mean_abs > 5.0 * simulate(log, TRUTH).mean_abs


def test_an_element_that_slips_is_friction_of_its_yield() -> None:
    """Simulated without its memory, it holds what it holds while the axis slides on, and pushes nothing."""
    log = SWING.log(seconds=10.0, noise=0.0)
    part = 0.4 * SWING.coulomb
    level = {name: Parameter(TRUTH.static[name].value - part) for name in ("coulomb", "static")}
    less = replace(TRUTH, static={**TRUTH.static, **level})
    entry = EffectEntry("hysteresis", {"stiffness": Parameter(50.0 * part), "yield": Parameter(part)})
    found = simulate(log, less.with_effect(entry))
    assert found.notes == ("the effect hysteresis acts as it does while the axis slides on.",)
    whole = simulate(log, TRUTH)
    assert found.frame["position_simulated_rad"].to_numpy() == pytest.approx(
        whole.frame["position_simulated_rad"].to_numpy(), abs=2e-5
    ), "but for tables over the position, which are finer where an effect follows it"
    assert simulate(log, less).mean_abs > 5.0 * whole.mean_abs
    carried = replace(entry, parameters=entry.parameters | {"of_friction": Parameter(1.0)})
    assert simulate(log, TRUTH.with_effect(carried)).mean_abs == pytest.approx(whole.mean_abs, abs=2e-5)


def test_a_source_that_is_none_is_refused() -> None:
    """It was taken for the effort."""
    with pytest.raises(InputError, match=r"^source: unknown source 'goals'; did you mean \"goal\"\?$"):
        simulate(SWING.log(seconds=3.0), TRUTH, "goals")  # type: ignore[arg-type]


def test_it_is_shown_by_its_errors() -> None:
    found = simulate(SWING.log(seconds=3.0), TRUTH)
    first, *notes = repr(found).splitlines()
    assert re.fullmatch(r".*, trial 0: \S+ mrad mean absolute, \S+ rms, \S+ rms over windows of 1 s", first)
    assert notes == [f"note: {note}" for note in found.notes]


def test_a_file_without_inertia_is_refused() -> None:
    with pytest.raises(InputError, match="has no inertia, so nothing says how fast"):
        simulate(SWING.log(seconds=3.0), replace(TRUTH, effects=()))


def test_from_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log, file, out = tmp_path / "swing.csv", tmp_path / "params.toml", tmp_path / "out.csv"
    SWING.log(seconds=6.0, axis=Axis("rotary", SWING.torque_constant)).write(log)
    TRUTH.write(file)
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
    code, _, said = ffc_id(capsys, "calibrate", log, "--mass", "0.5", "--lever", "100")  # millimetres
    assert code == 2
    assert "--lever" in said
    code, said, _ = ffc_id(capsys, "calibrate", log, "--mass", "0.5", "--lever", "0.1", "-p", file)
    assert code == 0
    assert float(said.split()[1]) == pytest.approx(1.2, rel=0.01)
    assert Parameters.read(file).axis.extra["torque_constant_stderr"] > 0.0


def test_an_axis_that_runs_away_is_said_to() -> None:
    """Friction that falls with the square of the speed drives it beyond all numbers."""
    falls = EffectEntry("nonlinear_viscous", {"quadratic": Parameter(-10.0)})
    found = simulate(SWING.log(seconds=10.0, noise=0.0), replace(TRUTH, effects=(*TRUTH.effects, falls)))
    assert any("runs away" in note for note in found.notes)
    assert not any("runs away" in note for note in simulate(SWING.log(seconds=10.0), TRUTH).notes)
