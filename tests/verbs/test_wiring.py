"""Columns that contradict each other are said before any number; those that agree are not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from idtool.errors import InputError
from idtool.importing import import_recording
from idtool.log import Log
from idtool.log.wiring import contradictions
from idtool.model.motion import Array
from idtool.parameters.axis import Axis
from idtool.signals import record
from idtool.verbs.check import check

from .support import document, ffc_id
from .test_impossible import GENUINE, RECORDINGS, REFUSED, nothing_impossible

#: What the source's speed and position contradict each other by, said of the recording as it is.
WRONG = {
    "motor05_dm4310.csv.gz": "the position moves 1.658 times as far as the speed says",
    "motor_telemetry_single.csv": '"current_a" was recorded without its sign',
}


@pytest.mark.parametrize("name", [name for name in RECORDINGS if name not in REFUSED])
def test_silent_on_machines_that_are_wired_well(measured: Path, name: str) -> None:
    """Nor is a reading impossible: counters, coarse and late speeds, stick-slip, cogging, saturation,
    commanded torques."""
    log = import_recording(measured / name, **RECORDINGS[name]).log
    assert nothing_impossible(log, GENUINE.get(Path(name).name, ()))
    said = record([log]).wiring[0]
    expected = WRONG.get(Path(name).name)
    assert len(said) == (expected is not None)
    assert all(expected in one for one in said if expected)


def test_silent_on_an_independent_axis(measured: Path) -> None:
    """Nor is a reading impossible."""
    logs = sorted((measured.parent / "sessions").glob("*/*.csv.gz"))
    assert len(logs) > 50
    for path in logs:
        log = Log.read(path)
        assert nothing_impossible(log), path
        assert record([log]).wiring == ((),), path


def spoilt(log: Log, column: str, factor: float) -> Log:
    return replace(log, rows=log.frame.assign(**{column: log.frame[column] * factor}))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_current_without_its_sign(session: list[Log], sign: float) -> None:
    for log in session[1:]:
        bad = replace(log, rows=log.frame.assign(current_a=sign * log.frame["current_a"].abs()))
        (said,) = record([bad]).wiring[0]
        assert said.endswith('"current_a" was recorded without its sign.')


@pytest.mark.parametrize(("near", "said"), [(4, 0), (5, 1)])
def test_a_sign_is_missed_by_five_readings_near_zero_each_way(near: int, said: int) -> None:
    """... of a few rows: an axis that goes to and fro under a load has a torque of one sign too."""
    time = np.arange(0.0, 8.0, 0.1)
    position = np.sin(2.0 * np.pi * time / 4.0)
    forwards = np.gradient(position) > 0.0
    effort = np.where(forwards, 1.0, 0.6) + 0.01 * np.sin(40.0 * time)
    for way in (forwards, ~forwards):
        fast = np.flatnonzero(way & (np.abs(position) < 0.8))
        effort[fast[2 : 2 + near]] = 0.01
    first = np.arange(len(time)) == 0
    found = contradictions(time, first, position, None, effort, "current_a")
    assert ["without its sign" in one for one in found] == [True] * said
    # the drive was off there
    effort[effort < 0.1] = np.nan
    assert contradictions(time, first, position, None, effort, "current_a") == []


@pytest.mark.parametrize("column", ["velocity_command_rad_s", "velocity_rad_s"])
def test_a_current_that_was_computed(session: list[Log], column: str) -> None:
    for log in session[1:]:
        computed = (0.3 + 2.0 * log.frame[column]).round(3)
        (said,) = (s for s in record([spoilt_by(log, computed)]).wiring[0] if "computed" in s)
        assert said.endswith(
            f"the torque is {column} times a number, to its last digit: it was commanded or "
            "computed from it, not measured."
        )
        # measured, however little the axis has beside its damping
        noisy = computed + np.random.default_rng(0).normal(0.0, 0.01, len(computed))
        assert not any("computed" in s for s in record([spoilt_by(log, noisy)]).wiring[0])


def spoilt_by(log: Log, current: pd.Series) -> Log:
    return replace(log, rows=log.frame.assign(current_a=current))


@pytest.mark.parametrize(
    ("column", "factor", "expected"),
    [
        ("position_rad", 57.29578, "one is in degrees"),
        ("velocity_rad_s", 57.29578, "one is in degrees"),
        ("velocity_rad_s", 9.549297, "turns a minute"),
        ("velocity_rad_s", 1000.0, "thousandths"),
        ("velocity_rad_s", 60.0, "the time is in minutes"),
        ("velocity_rad_s", -1.0, "opposite signs"),
        ("position_rad", -1.0, "opposite signs"),
        ("current_a", -1.0, "the torque pushes along with the motion"),
    ],
)
def test_what_is_wrong_is_said_first(session: list[Log], column: str, factor: float, expected: str) -> None:
    for log in session[1:]:  # where gravity acts with loads that change, its power is not certain
        bad = spoilt(log, column, factor)
        assert record([log]).wiring == ((),)
        assert any(expected in one for one in record([bad]).wiring[0]), log.experiment
    assert expected in check([bad]).logs[0].findings[0] or "opposite" in expected


@pytest.mark.parametrize("factor", [57.29578, 9.549297])
def test_a_motion_in_another_unit_than_its_command(session: list[Log], factor: float) -> None:
    for log in session:
        bad = spoilt(spoilt(log, "position_rad", factor), "velocity_rad_s", factor)
        (said,) = (s for s in record([bad]).wiring[0] if "velocity_command_rad_s says" in s)
        assert ("in degrees" if factor > 10.0 else "turns a minute") in said


def test_a_drive_that_falls_short_of_its_command_is_not_in_another_unit(session: list[Log]) -> None:
    for log in session:
        slow = spoilt(spoilt(log, "position_rad", 0.6), "velocity_rad_s", 0.6)
        assert not any("velocity_command_rad_s says" in s for s in record([slow]).wiring[0])


def test_a_current_that_no_drive_gives(session: list[Log]) -> None:
    (said,) = record([spoilt(session[0], "current_a", 1000.0)]).wiring[0]
    assert "which no drive of an axis gives: it may be in mA" in said


@pytest.mark.parametrize(("supply", "factor"), [(None, 1e4), (12.0, 1e3)])
@pytest.mark.parametrize("columns", [["velocity_rad_s"], ["position_rad"], []])
def test_a_torque_constant_that_no_motor_has(
    session: list[Log], supply: float | None, factor: float, columns: list[str]
) -> None:
    log = session[2]
    assert log.axis.torque_constant is not None
    bad = replace(
        log,
        axis=replace(log.axis, torque_constant=factor * log.axis.torque_constant),
        rows=log.frame.drop(columns=columns).assign(**{} if supply is None else {"supply_voltage_v": supply}),
    )
    (said,) = record([bad]).wiring[0]
    why = "no drive is fed with" if supply is None else "its supply of 12 V does not give"
    assert "V of its own at a speed of" in said
    assert f"which {why}: the constant is per mA" in said


def test_millimetres_that_are_taken_for_metres() -> None:
    """A stroke of 80 m was asked whether its speed is in degrees."""
    time = np.arange(4000) * 0.005
    way = 0.5 * np.pi * time
    rows = pd.DataFrame(
        {"time_s": time, "position_m": 40.0 * np.sin(way), "velocity_m_s": 20.0 * np.pi * np.cos(way)}
    )
    current = 0.5 * np.cos(way) + 0.2 * np.sign(np.cos(way))
    log = Log(rows.assign(trial=0, current_a=current), Axis("linear", 75.4))
    (said,) = record([log]).wiring[0]
    assert "makes 4737 V of its own at a speed of 62.8, which no drive is fed with" in said
    assert "(on a linear axis in mm)" in said


def test_noise_in_place_of_the_current(session: list[Log]) -> None:
    for log in session[1:]:
        noise = pd.Series(np.random.default_rng(0).normal(0.0, 0.1, len(log.frame)))
        (said,) = record([spoilt_by(log, noise)]).wiring[0]
        assert "the torque has nothing to do with the motion" in said


def test_another_payload_while_the_axis_moves(session: list[Log]) -> None:
    frame = session[0].frame
    rows = np.flatnonzero(np.abs(frame["velocity_rad_s"]) > 0.1)
    frame = frame.assign(payload_kg=np.where(frame.index >= rows[50], frame["payload_kg"] + 0.5, 0.0))
    (said,) = record([replace(session[0], rows=frame)]).wiring[0]
    place = session[0].place(int(rows[50]))
    assert f"another payload is told while the axis moves, first on {place} (1 such)" in said


@pytest.mark.parametrize(
    ("name", "effort"),
    [
        ("emps/emps_identification.csv.gz", "force_n"),
        ("ur10e/joint_2.csv.gz", "current_a"),
        ("dfki_pendulum_ak80/pd_system_identification.csv.gz", "torque_nm"),
    ],
)
def test_a_torque_without_its_sign_where_inertia_or_gravity_outweigh_friction(
    measured: Path, name: str, effort: str
) -> None:
    log = import_recording(measured / name, **RECORDINGS[name]).log
    (said,) = record([replace(log, rows=log.frame.assign(**{effort: log.frame[effort].abs()}))]).wiring[0]
    assert said.endswith(f'"{effort}" was recorded without its sign.')


def test_another_tilt_while_the_axis_moves(session: list[Log]) -> None:
    frame = session[0].frame
    row = int(np.flatnonzero(np.abs(frame["velocity_rad_s"]) > 0.1)[50])
    moved = np.where(frame.index == row, 1.2, 0.01 * np.sin(frame.index / 300.0))
    (said,) = record([replace(session[0], rows=frame.assign(tilt_alpha_rad=moved))]).wiring[0]
    assert f"another tilt is told while the axis moves, first on {session[0].place(row)} (2 such)" in said


@pytest.mark.parametrize(
    ("column", "factor", "lever"), [("payload_kg", 1000.0, "4.3e-05 m"), ("current_a", 1000.0, "43 m")]
)
def test_a_lever_that_no_axis_has(session: list[Log], column: str, factor: float, lever: str) -> None:
    assert "odd_lever" not in {one.code for one in check([session[0]]).findings}
    (found,) = (
        one for one in check([spoilt(session[0], column, factor)]).findings if one.code == "odd_lever"
    )
    assert f"means a lever of {lever}, which no axis has" in found.why


def test_every_command_says_it_before_any_number_and_goes_on_with_a_look(
    session: list[Log], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, params = tmp_path / "sweep.csv", tmp_path / "p.toml"
    spoilt(session[1], "position_rad", 57.29578).write(log)
    commands = (
        ("check", log),
        ("fit-static", log, "-p", params),
        ("fit-dynamic", log, "-p", params),
        ("predict", log, "-p", params, "-o", tmp_path / "o.csv"),
    )
    for words in commands:
        code, out, err = ffc_id(capsys, *words)
        assert code == 0, err
        first = out.splitlines()[1] if words[0] == "check" else err.splitlines()[0]
        assert "the position moves 57.3 times as far as the speed says" in first
        assert err.splitlines()[-1] == f"next: ffc-id plot {log}"
    notes = document(capsys, "compare", params, params, log)["notes"]
    assert any("the position moves 57.3 times as far" in note for note in notes)


def test_a_log_given_twice_is_refused(session: list[Log]) -> None:
    with pytest.raises(InputError, match=r"holds the rows of .*sine\.csv; give each log once"):
        record([*session, replace(session[2], source="copy.csv")])


def test_a_prediction_of_another_axis_is_said_to_be_none(
    session: list[Log], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine, other, params = (tmp_path / name for name in ("sweep.csv", "other.csv", "p.toml"))
    session[1].write(mine)
    spoilt(session[1], "current_a", 20.0).write(other)
    document(capsys, "fit-static", mine, "-p", params)
    assert not any("is not predicted" in n for n in of(capsys, mine, params)["notes"])
    assert any(
        "most of the torque of sweep is not predicted" in n for n in of(capsys, other, params)["notes"]
    )
    _, _, err = ffc_id(capsys, "predict", other, "-p", params, "-o", tmp_path / "o.csv", "--force")
    assert err.splitlines()[-1] == f"next: ffc-id check {other}"


def of(capsys: pytest.CaptureFixture[str], log: Path, params: Path) -> dict[str, Any]:
    return document(capsys, "predict", log, "-p", params, "-o", log.with_suffix(".out.csv"), "--force")


def test_identify_says_it_before_any_number(
    session: list[Log], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spoilt(session[1], "current_a", -1.0).write(tmp_path / "sweep.csv")
    code, _, err = ffc_id(capsys, "identify", tmp_path / "sweep.csv", "-o", tmp_path / "result", "-q")
    assert code == 0
    assert "the torque pushes along with the motion" in err.splitlines()[0]
    assert "the torque pushes along with the motion" in (tmp_path / "result" / "diagnosis.json").read_text()


def test_a_torque_that_is_a_speed(session: list[Log]) -> None:
    """Its two columns swapped, and one made of the other; an axis that is viscous has friction too."""
    for log in session[1:]:
        frame, speed = log.frame, log.frame["velocity_rad_s"].to_numpy()
        rng = np.random.default_rng(1)
        swapped = frame.assign(velocity_rad_s=frame["current_a"], current_a=speed)
        assert any("are two columns swapped" in s for s in record([replace(log, rows=swapped)]).wiring[0])
        for level, told in ((0.0, True), (0.1, False)):
            current = speed + level * np.sign(speed) + rng.normal(0.0, 0.003, len(speed))
            spoilt = replace(log, rows=frame.assign(current_a=current))
            assert any("are two columns swapped" in s for s in record([spoilt]).wiring[0]) == told


def pendulum(
    rate: float, friction: float, weight: float, faster: float, seconds: float = 15.0
) -> tuple[Array, ...]:
    """A pendulum of 0.05 kg m^2 under a swing that becomes faster; time, counted position and torque."""
    time = np.arange(0.0, seconds, 1.0 / rate)
    phase, pace = 0.5 * faster * time**2, faster * time
    position, velocity = np.sin(phase), pace * np.cos(phase)
    acceleration = faster * np.cos(phase) - pace**2 * np.sin(phase)
    noise = 0.01 * np.random.default_rng(1).normal(size=len(time))
    torque = 0.05 * acceleration + weight * np.sin(position) + friction * np.sign(velocity) + noise
    return time, np.round(position / 4e-4) * 4e-4, torque


@pytest.mark.parametrize("rate", [48.0, 100.0, 200.0])
@pytest.mark.parametrize("weight", [3.0, 0.3])
@pytest.mark.parametrize("faster", [0.5, 1.0, 2.0])
def test_a_light_pendulum_is_not_inverted(rate: float, weight: float, faster: float) -> None:
    """Seen on a quasi-direct drive at 48 Hz: with the speed of half a row before, its inertia was friction
    that gives power, and a torque of the right sign was called inverted."""
    time, position, torque = pendulum(rate, 0.03, weight, faster)
    assert contradictions(time, np.arange(len(time)) == 0, position, None, torque, "torque_nm") == []


@pytest.mark.parametrize("rate", [100.0, 400.0])
@pytest.mark.parametrize(("friction", "weight"), [(0.0, 3.0), (0.03, 3.0), (0.003, 0.1)])
def test_an_inverted_light_pendulum_is_told_by_its_inertia(
    rate: float, friction: float, weight: float
) -> None:
    time, position, torque = pendulum(rate, friction, weight, 0.24, 30.0)
    (said,) = contradictions(time, np.arange(len(time)) == 0, position, None, -torque, "torque_nm")
    assert "its inertia would be below zero" in said or "friction would drive the axis" in said
    assert '"torque_nm" or the position is inverted' in said


def test_inertia_says_nothing_of_a_torque_that_friction_tells() -> None:
    """A torque that is read late has a part against the acceleration, of its viscous friction."""
    time = np.arange(0.0, 20.0, 0.005)
    phase = 2.0 * np.pi * 1.5 * time
    position, velocity = np.sin(phase), np.cos(phase)
    late = np.cos(phase - 2.0 * np.pi * 1.5 * 0.03)
    torque = 0.2 * np.sign(velocity) + 0.5 * late
    first = np.arange(len(time)) == 0
    assert contradictions(time, first, position, velocity * 2.0 * np.pi * 1.5, torque, "torque_nm") == []
