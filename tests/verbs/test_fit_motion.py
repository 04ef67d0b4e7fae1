"""The fit of the motion finds what bends the line from duty to torque, and predicts what it did not see."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool import Axis, InputError, Log, Parameters
from idtool.importing import import_recording
from idtool.parameters import EffectEntry, Parameter
from idtool.verbs.fit_motion import MotionFit, fit_motion
from idtool.verbs.simulate import simulate
from testbench.duty_servo import DutyServo

from .support import SWEEP, changed, ffc_id, record

SERVO = DutyServo(dead_band=0.05)
SHARES: list[float] = []
PLAIN = DutyServo(share=0.0)


@cache
def logs() -> tuple[Log, ...]:
    return SERVO.log(1.0, 0.25), SERVO.log(2.2, 0.35), SERVO.log(1.6, 0.25, seconds=5.0, off_after=1.2)


@cache
def fitted() -> MotionFit:
    return fit_motion(logs(), progress=SHARES.append)


def test_it_says_how_far_it_is() -> None:
    fitted()
    assert sorted(SHARES) == SHARES
    assert SHARES[0] < 0.05
    assert SHARES[-1] > 0.95
    assert max(b - a for a, b in pairwise(SHARES)) < 0.15


def test_it_finds_the_axis_behind_the_duty() -> None:
    found = fitted().parameters
    assert found.drive is not None
    assert found.drive.bend is not None
    assert found.drive.bend.value == pytest.approx(SERVO.bend, rel=0.25)
    assert found.drive.bend.ci95 is not None
    assert found.drive.dead_band is not None
    assert found.drive.dead_band.value == pytest.approx(SERVO.dead_band, rel=0.2)
    assert found.static["coulomb"].value == pytest.approx(
        SERVO.coulomb, rel=0.3
    )  # none of it the dead band's
    assert found.gravity["sin"].value == pytest.approx(SERVO.gravity, rel=0.06)
    assert found.drive.back_emf is not None
    assert found.static["viscous"].value == pytest.approx(SERVO.viscous + SERVO.back_emf, rel=0.25)
    assert found.drive.gain_at(None) == pytest.approx(SERVO.gain, rel=0.02)
    assert fitted().after < 0.2 * fitted().before
    assert any("20 ms later" in note for note in fitted().notes)


def test_the_error_that_it_tells_is_that_of_simulate() -> None:
    """In the same steps, though most of the search takes longer ones."""
    again = simulate(logs(), fitted().parameters)
    assert again.rms_windows == pytest.approx(fitted().after, rel=1e-6)


def test_it_simulates_a_motion_that_no_fit_saw() -> None:
    unseen = SERVO.log(1.9, 0.45)
    found = fitted().parameters
    assert simulate(unseen, found, "goal").mean_abs < 0.02
    without = replace(found, drive=replace(found.drive, bend=None))
    assert simulate(unseen, without, "goal").mean_abs > 2.0 * simulate(unseen, found, "goal").mean_abs


def test_the_file_comes_back_as_it_was_written(tmp_path: Path) -> None:
    file = tmp_path / "motion.toml"
    fitted().parameters.write(file)
    again = Parameters.read(file)
    assert again.drive == fitted().parameters.drive
    assert again.to_document() == fitted().parameters.to_document()
    assert fitted().parameters.drive is not None
    wrong = replace(fitted().parameters.drive, bend=Parameter(-1.0))
    with pytest.raises(InputError, match=r"drive\.bend\.value: expected a number >= 0"):
        replace(fitted().parameters, drive=wrong).write(file, force=True)


def test_from_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "servo.csv"
    SERVO.log(1.0, 0.25, seconds=4.0).write(log)  # one way and back
    params = tmp_path / "motion.toml"
    fitted().parameters.write(params)
    code, out, _ = ffc_id(capsys, "fit-motion", log, "-p", params, "--json")
    assert code == 0
    document = json.loads(out)
    assert document["rms_1s_windows_mrad"]["after"] < 15.0
    assert document["parameters"]["drive"]["command"] == "duty"
    assert Parameters.read(params).static


def test_a_file_without_friction_is_refused() -> None:
    with pytest.raises(InputError, match=r"no \[friction.static\]"):
        fit_motion(logs(), Parameters(axis=fitted().parameters.axis))


def test_constant_speeds_tell_no_inertia_and_write_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The best match would be an inertia of tons, which no torque moves and no friction stops."""
    log, params = tmp_path / "sweep.csv", tmp_path / "motion.toml"
    gentle = changed(SWEEP, speed_rad_s=[0.2], travel_rad=[2.0]) + "acceleration_rad_s2 = 0.1\n"
    record(gentle, log, "sim:paper")
    code, _, err = ffc_id(capsys, "fit-motion", log, "-p", params)
    assert code == 3
    assert "tell no inertia" in err
    assert not params.exists()


@pytest.fixture(scope="module")
def never_off() -> Parameters:
    """The fit of an axis whose gears take nothing of a load, and whose drive was on throughout."""
    return fit_motion((PLAIN.log(1.0, 0.25, seconds=4.0), PLAIN.log(2.2, 0.35, seconds=4.0))).parameters


def test_gears_that_take_nothing_of_a_load_are_not_in_the_file(never_off: Parameters) -> None:
    assert never_off.effect("load_dependent_friction") is None


def test_back_emf_that_no_log_showed_apart_is_a_bound(never_off: Parameters) -> None:
    found = never_off
    assert found.drive is not None
    assert found.drive.back_emf is not None
    assert not found.drive.back_emf.identified
    assert found.drive.back_emf.ci95 is None
    assert found.drive.back_emf.at_most == found.static["viscous"].value
    assert found.static["viscous"].ci95 is not None
    low, high = found.static["viscous"].ci95
    assert high - low < 0.5 * found.static["viscous"].value
    off = PLAIN.log(1.6, 0.25, seconds=5.0, off_after=1.2)
    assert any("with the drive off" in note for note in simulate(off, found).notes)
    assert not any("with the drive off" in note for note in simulate(off, fitted().parameters).notes)
    assert not any("with the drive off" in note for note in simulate(PLAIN.log(1.0, 0.25), found).notes)


def read_late(log: Log, by: float) -> Log:
    time = log.frame["time_s"]
    moved = {name: np.interp(time - by, time, log.frame[name]) for name in ("position_rad", "velocity_rad_s")}
    return replace(log, rows=log.frame.assign(**moved))


def test_a_motion_that_is_read_late_is_put_in_step() -> None:
    """Duty and position of different instants: the inertia took the delay times the back-EMF for its own."""
    plain = [PLAIN.log(1.0, 0.25, seconds=6.0), PLAIN.log(2.2, 0.35, seconds=6.0)]
    late = [read_late(log, 0.015) for log in plain]
    found, true = fit_motion(late), fit_motion(plain)
    (delay,) = found.parameters.effect("transport_delay").parameters.values()  # type: ignore[union-attr]
    assert delay.value == pytest.approx(0.015, abs=0.002)
    assert delay.ci95 is not None
    assert delay.ci95[0] < 0.015 < delay.ci95[1]
    assert "ms later than the effort" in found.notes[-1]
    assert true.parameters.effect("transport_delay") is None
    one, other = (fit.parameters.effect("inertia") for fit in (found, true))
    assert one is not None
    assert other is not None
    assert one.parameters["inertia"].value == pytest.approx(other.parameters["inertia"].value, rel=0.03)
    assert found.after < 1.3 * true.after
    drives = [fit.parameters.drive for fit in (found, true)]
    assert drives[0] is not None
    assert drives[1] is not None
    assert drives[0].gain_at(None) == pytest.approx(drives[1].gain_at(None), rel=0.05)


@pytest.mark.long
def test_of_two_minima_of_a_real_servo_it_finds_the_lower(measured: Path) -> None:
    """Stiction that fades within the slowest motion, which the fit of two gains had missed."""
    kinds = ("lift_and_drop", "sin_sin", "up_and_down")
    of = {
        gain: [import_recording(measured / "xl330" / f"kp{gain}_{kind}.json.gz").log for kind in kinds]
        for gain in (100, 200, 800)
    }
    found = fit_motion([*of[100], *of[200]]).parameters
    for source, most in (("goal", 0.050), ("effort", 0.050)):
        assert np.mean([simulate(log, found, source).mean_abs for log in of[800]]) < most  # type: ignore[arg-type]


def _plain_arm() -> Log:
    """An arm with Coulomb friction alone, whose servo reads 0.01 degrees a hundred times a second."""
    step, friction = 1e-3, 0.4
    rng, q, w, rows = np.random.default_rng(3), 0.0, 0.0, []
    for k in range(24_000):
        t = k * step
        goal = 1.2 * math.sin(0.2 * math.pi * t) + 0.2 * math.sin(0.74 * math.pi * t) * min(0.5 * t, 1.0)
        duty = min(max(6.0 * (goal - q) - 0.05 * w, -1.0), 1.0)
        if k % 10 == 0:
            rows.append((t, q, goal, duty, 12.0 + 0.05 * rng.standard_normal()))
        free = w + step / 0.0489 * (12.0 * duty - 0.9444 * w - 1.8413 * math.sin(q))
        w = math.copysign(max(abs(free) - friction * step / 0.0489, 0.0), free)
        q += step * w
    time, position, goals, duties, volts = np.array(rows).T
    grain = math.radians(0.01)
    frame = {
        "time_s": time,
        "position_rad": grain * np.round(position / grain),
        "position_command_rad": goals,
        "duty": np.round(duties, 3),
        "supply_voltage_v": np.round(volts, 1),
    }
    return Log(pd.DataFrame({"trial": 0} | frame), Axis(), source="arm.csv")


def test_friction_that_does_not_fall_with_the_speed_has_no_stribeck_velocity() -> None:
    """Nothing tells Coulomb friction from one that rises to it below every speed that is read."""
    static = fit_motion([_plain_arm()]).parameters.static
    assert static["coulomb"].value == pytest.approx(0.4, rel=0.02)
    assert static["static"].value == pytest.approx(0.4, rel=0.05)
    assert not static["stribeck_velocity"].identified


def test_it_starts_from_one_file_and_writes_another(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, start, motion = tmp_path / "log.csv", tmp_path / "start.toml", tmp_path / "motion.toml"
    PLAIN.log(1.0, 0.25, seconds=4.0).frame.to_csv(log, index=False)
    asymmetric = EffectEntry("direction_asymmetry", {"asymmetry": Parameter(0.01)})
    known = fitted().parameters
    replace(known, effects=(*known.effects, asymmetric)).write(start)
    before = start.read_bytes()
    code, *_ = ffc_id(capsys, "fit-motion", log, "-p", motion, "--start", start)
    assert code == 0
    assert start.read_bytes() == before
    assert Parameters.read(motion).effect("direction_asymmetry") is not None
