"""Readings that cannot be: found where they are, and nothing else is taken for one."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from idtool.errors import InputError
from idtool.importing import import_recording
from idtool.log import Log, impossible
from idtool.log.effort import effort_of
from idtool.log.row_counter import lost_rows
from idtool.log.stale import stale
from idtool.model.motion import Array
from idtool.parameters.axis import Axis
from idtool.signals import record
from idtool.verbs.base_model import base_model
from idtool.verbs.check import check

from .support import document, ffc_id

COLUMN = {"position": "position_rad", "velocity": "velocity_rad_s", "effort": "current_a"}
#: Recordings of real machines and how they are imported.
RECORDINGS: dict[str, dict[str, Any]] = {
    "emps/emps_identification.csv.gz": {},
    "emps/emps_validation_pulses.csv.gz": {},
    "cicese_dd2dof/test1_breakaway_torque_ramps.csv.gz": {"trial_by": "run", "where": {"joint": ["1"]}},
    "cicese_dd2dof/test2_constant_speed_both_joints.csv.gz": {
        "mapping": {"position_rad": "position2_rad", "torque_nm": "torque2_cmd_nm"},
        "trial_by": "run",
    },
    "cicese_dd2dof/test3_presliding_sigma0_sigma1.csv.gz": {"trial_by": "run", "where": {"joint": ["1"]}},
    "dfki_pendulum_ak80/direct_collocation.csv.gz": {},
    "dfki_pendulum_ak80/gravity_compensation_hand_moved.csv.gz": {},
    "dfki_pendulum_ak80/pd_system_identification.csv.gz": {},
    "hsm150_servo/torque_step_neg_0.04.csv.gz": {"trial_by": "run"},
    "damiao_motors/motor01_dm8009.csv.gz": {"unwrap": 25.0},
    "damiao_motors/motor05_dm4310.csv.gz": {"unwrap": 25.0},
    "laas_bldc_cogging/speed_test.csv.gz": {"torque_constant": 0.03},
    "laas_bldc_cogging/stopped_mapping.csv.gz": {"torque_constant": 0.03},
    "servo_motor_lugre/breakaway_torque_ramp.csv.gz": {"trial_by": "run"},
    "servo_motor_lugre/inertia_viscous_torque_triangle.csv.gz": {"trial_by": "run"},
    "servo_motor_lugre/presliding_torque_triangle.csv.gz": {"trial_by": "run"},
    "dvrk_mtm_cable_joint4/mtm_joint4_slow_sweep.csv.gz": {"mapping": {"time": "time_nominal_s"}},
    "brfd_friction_damper/d2_1hz_30lb_1in.csv.gz": {},
    "sts3215_backlash/motor_telemetry_single.csv": {"torque_constant": 1.0, "where": {"servo_id": ["3"]}},
    "ur10e/joint_2.csv.gz": {"torque_constant": 10.0},
    **{
        f"xl330/kp{gain}_{path}.json.gz": {}
        for gain in (100, 200, 800)
        for path in ("sin_sin", "lift_and_drop", "up_and_down")
    },
}
#: Three speeds that the counter lost with 0.07 rad: 36 to 41 rad/s between 15 and 14.
GENUINE = {"inertia_viscous_torque_triangle.csv.gz": [5019, 5020, 5021]}
#: Recordings in which the speed sensor is dead.
REFUSED = ("laas_bldc_cogging/stopped_mapping.csv.gz",)


def find(log: Log) -> impossible.Impossible:
    trial = log.frame["trial"].to_numpy()
    first = np.concatenate([[True], trial[1:] != trial[:-1]])
    time = log.frame["time_s"].to_numpy(dtype=float)
    return impossible.find(time, first, log.column("position"), log.column("velocity"), effort_of(log).values)


def flagged(found: impossible.Impossible) -> list[int]:
    return np.flatnonzero(found.position | found.velocity | found.effort).tolist()


def nothing_impossible(log: Log, genuine: Sequence[int] = ()) -> bool:
    """Whether no reading of a log is taken for impossible but these rows, no row for lost, none for stale."""
    found = find(log)
    position, time = log.column("position"), log.values_of("time_s")
    first = np.diff(log.trial_of_rows, prepend=-1) != 0
    if position is not None:
        assert not lost_rows(time, first, position).any()
        assert not stale(first, position).any()
    return flagged(found) == [*genuine] and [*found.slips] == [*genuine][:1]


@pytest.mark.parametrize("name", REFUSED)
def test_nothing_genuine_is_taken_for_impossible(measured: Path, name: str) -> None:
    """Of a recording that is refused for another reason; tests/verbs/test_wiring.py has all others."""
    assert nothing_impossible(import_recording(measured / name, **RECORDINGS[name]).log)


def spoilt(log: Log, role: str, size: float, length: int, count: int, seed: int) -> tuple[Log, set[int]]:
    """A log with so many faults of a column, and the rows that they are in."""
    rng = np.random.default_rng(seed)
    frame = log.frame.copy()
    values = frame[COLUMN[role]].to_numpy(dtype=float).copy()
    trial = frame["trial"].to_numpy()
    rows: set[int] = set()
    while len(rows) < count * length:
        begin = int(rng.integers(10, len(values) - length - 10))
        near = set(range(begin - 9, begin + length + 9))
        if trial[begin - 9] == trial[begin + length + 9] and not near & rows:
            values[begin : begin + length] += size * rng.choice([-1.0, 1.0]) * rng.uniform(0.8, 1.2, length)
            rows |= set(range(begin, begin + length))
    frame[COLUMN[role]] = values
    return replace(log, rows=frame), rows


#: role, size, rows that it lasts
FAULTS = [
    ("position", 0.05, 1),
    ("position", 0.05, 3),
    ("position", 2 * np.pi, 1),
    ("position", 1.0, 8),
    ("position", 1e9, 2),
    ("velocity", 1.0, 1),
    ("velocity", 3.0, 2),
    ("velocity", 3.0, 12),
    ("velocity", 1e9, 3),
    ("effort", 1.0, 1),
    ("effort", 1e30, 1),
    ("effort", 1e30, 6),
]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("role", "size", "length"), FAULTS)
def test_every_fault_is_found_and_hardly_a_row_beside_it(
    session: list[Log], role: str, size: float, length: int, seed: int
) -> None:
    for number, log in enumerate(session):
        bad, rows = spoilt(log, role, size, length, 4, 10 * seed + number)
        found = find(bad)
        assert set(np.flatnonzero(getattr(found, role)).tolist()) >= rows
        beside = set(flagged(found)) - rows
        assert all({row - 1, row + 1} & rows for row in beside)
        assert len(beside) <= 1


@pytest.fixture(scope="module")
def reference(session: list[Log]) -> dict[str, tuple[float, float]]:
    return numbers(session)


def numbers(logs: list[Log]) -> dict[str, tuple[float, float]]:
    """Value and standard error of what the base model's fit determines."""
    from idtool.fit.results import dynamic_parameters, gravity_parameters, static_parameters

    fit = base_model(record(logs), "lugre", "auto").fits[0]
    found = static_parameters(fit) | dynamic_parameters(fit) | gravity_parameters(fit)
    return {k: (p.value, p.stderr) for k, p in found.items() if p.identified and p.stderr}


@pytest.mark.parametrize(
    ("role", "size", "length"),
    [
        ("position", 2 * np.pi, 1),
        ("position", 1.0, 8),
        ("position", 0.003, 1),
        ("velocity", 3.0, 1),
        ("velocity", 3.0, 12),
        ("velocity", 0.05, 1),
        ("effort", 1.0, 1),
        ("effort", 1e30, 6),
    ],
)
def test_no_fault_moves_a_number_by_its_standard_error(
    session: list[Log], reference: dict[str, tuple[float, float]], role: str, size: float, length: int
) -> None:
    """Large ones are found; small ones must not matter."""
    spoilt_logs = [spoilt(log, role, size, length, 3, number)[0] for number, log in enumerate(session)]
    found = numbers(spoilt_logs)
    assert set(found) == set(reference)
    for name, (value, stderr) in reference.items():
        assert abs(found[name][0] - value) < stderr, name


def test_said_with_line_and_reason(
    session: list[Log], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    frame = session[1].frame.copy()
    frame.loc[500, "position_rad"] += 6.3
    frame.loc[900, "velocity_rad_s"] = 3.0
    replace(session[1], rows=frame).write(tmp_path / "sweep.csv")
    lines = (tmp_path / "sweep.csv").read_text().split("\n")
    header = next(k for k, line in enumerate(lines) if not line.startswith("#"))
    log = document(capsys, "check", tmp_path / "sweep.csv")["logs"][0]
    told = {(one["line"], one["column"]): one for one in log["impossible"]}
    assert set(told) == {(header + 502, "position_rad"), (header + 902, "velocity_rad_s")}
    assert told[header + 902, "velocity_rad_s"]["value"] == 3.0
    assert abs(told[header + 902, "velocity_rad_s"]["expected"]) < 0.5
    assert any(f"line {header + 902}: velocity_rad_s 3 cannot be" in one for one in log["findings"])
    _, said, _ = ffc_id(capsys, "check", tmp_path / "sweep.csv")
    assert "impossible position 1" in said
    assert "impossible speed 1" in said
    assert json.loads(json.dumps(log["impossible"]))[0]["row"] == 500


@pytest.mark.parametrize("standing", [False, True])
def test_a_position_that_slips_is_said_and_made_continuous(session: list[Log], standing: bool) -> None:
    """... but for the shorter side of it where the reading stood still before, and its place is not known."""
    frame = session[2].frame.copy()
    rows = np.flatnonzero(frame["trial"] == frame["trial"].iloc[0])
    position = frame["position_rad"].to_numpy().copy()
    slip = next(k for k in range(rows[-1] - 100, rows[-1]) if position[k - 1] != position[k - 2])
    if standing:
        position[slip - 1] = position[slip - 2]
    position[slip : rows[-1] + 1] += 0.8
    bad = record([replace(session[2], rows=frame.assign(position_rad=position))])
    shorter = rows[-1] + 1 - slip
    assert bad.lost.get("position slipped", 0) == (shorter if standing else 0)
    (said,) = (remark for remark in bad.remarks if "jumps by " in remark and "stays there" in remark)
    assert (f"{shorter} rows on the shorter side left out" in said) == standing
    clean = record([session[2]])
    assert np.allclose(bad.motion.position, clean.motion.position, atol=5e-3)


def test_most_of_a_trial_that_slips_stays_where_it_was_read(session: list[Log]) -> None:
    """A slip near its beginning moves that beginning alone."""
    frame = session[2].frame.copy()
    position = frame["position_rad"].to_numpy().copy()
    slip = next(k for k in range(100, 200) if position[k - 1] != position[k - 2])
    position[:slip] -= 0.8
    bad = record([replace(session[2], rows=frame.assign(position_rad=position))])
    assert np.allclose(bad.motion.position, record([session[2]]).motion.position, atol=5e-3)


def test_readings_of_nothing_are_no_counter_that_wraps(session: list[Log]) -> None:
    """Twice as far from where the axis was, to within what it went in 40 rows."""
    frame = session[2].frame.assign(position_rad=session[2].frame["position_rad"] + 3.3)
    fast = int(np.flatnonzero(np.abs(frame["velocity_rad_s"]) > 0.2)[0])
    frame.loc[[0, 1, 2, *range(fast, fast + 6)], "position_rad"] = 0.0
    found = find(replace(session[2], rows=frame))
    assert not found.wraps
    frame["position_rad"] = (session[2].frame["position_rad"] + 0.05) % 0.5
    assert find(replace(session[2], rows=frame)).wraps


def test_a_counter_that_slips_by_less_than_three_rows_of_motion_is_seen(measured: Path) -> None:
    """One row at five times the top speed: no reading lies outside the stroke, and the speed comes back."""
    log = import_recording(measured / "emps/emps_identification.csv.gz").log
    frame = log.frame.iloc[::5].reset_index(drop=True)
    clean = record([replace(log, rows=frame)])
    frame.loc[2485:, "position_m"] += 2.5e-3
    bad = record([replace(log, rows=frame)])
    assert any("position_m jumps by 0.0025" in remark for remark in bad.remarks)
    both = bad.usable & clean.usable
    assert np.abs(bad.motion.acceleration - clean.motion.acceleration)[both].max() < 0.5


@pytest.mark.parametrize("late", [0.9, 0.6, -0.7])
def test_one_time_that_is_no_reading_of_the_clock_is_set_right(measured: Path, late: float) -> None:
    """Taken as it is, the axis darts, and the inertia of this recording goes from 95.7 to 21 kg."""
    log = import_recording(measured / "emps/emps_identification.csv.gz").log
    frame = log.frame.iloc[::5].reset_index(drop=True)
    clean = record([replace(log, rows=frame)])
    frame.loc[700, "time_s"] += late * 0.005
    bad = record([replace(log, rows=frame)])
    assert bad.lost["impossible time"] == 1
    (reading,) = bad.impossible[0]
    assert (reading.row, reading.column) == (700, "time_s")
    assert any("ms off the clock of the rows around it" in remark for remark in bad.remarks)
    assert not any("missing" in remark for remark in bad.remarks)
    both = bad.usable & clean.usable
    assert np.abs(bad.motion.acceleration - clean.motion.acceleration)[both].max() < 0.05


def test_a_row_that_was_read_late_keeps_its_time(measured: Path) -> None:
    log = import_recording(measured / "emps/emps_identification.csv.gz").log
    rows = 5 * np.arange(len(log.frame) // 5 - 1)
    rows[700] += 4
    record_ = record([replace(log, rows=log.frame.iloc[rows].reset_index(drop=True))])
    assert "impossible time" not in record_.lost


def test_a_clock_of_another_unit_is_refused(session: list[Log]) -> None:
    for factor, word in ((1e3, "milli"), (1e9, "nano"), (1e-7, "hours")):
        frame = session[1].frame.assign(time_s=session[1].frame["time_s"] * factor)
        with pytest.raises(InputError, match=f"no rate at which a servo is recorded.*{word}"):
            record([replace(session[1], rows=frame)])


def test_a_gap_in_which_the_axis_could_have_been_anywhere_begins_a_trial(session: list[Log]) -> None:
    frame = session[2].frame.copy()
    frame.loc[300:, "time_s"] += 1e6
    cut = record([replace(session[2], rows=frame)])
    assert cut.trials == record([session[2]]).trials + 1
    assert any("the axis can go all its way" in remark for remark in cut.remarks)
    assert not any("rows are missing" in remark for remark in cut.remarks)
    assert check([replace(session[2], rows=frame)]).logs[0].facts["gaps"] == 0
    frame.loc[300:, "time_s"] -= 1e6 - 0.05
    assert record([replace(session[2], rows=frame)]).trials == cut.trials - 1


def dead(frame: object) -> dict[str, Array]:
    return {"position_rad": 0.2 * np.ones(len(frame)), "velocity_rad_s": np.zeros(len(frame))}  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "columns", [("position_rad",), ("velocity_rad_s",), ("position_rad", "velocity_rad_s")]
)
def test_a_dead_encoder_is_refused(session: list[Log], columns: tuple[str, ...]) -> None:
    kept = session[1].frame.drop(columns=[c for c in ("position_rad", "velocity_rad_s") if c not in columns])
    still = {name: values for name, values in dead(kept).items() if name in columns}
    with pytest.raises(InputError, match=r"never changes?: the axis was held, or its encoder is dead"):
        record([replace(session[1], rows=kept.assign(**still))])


SHAPES: dict[str, Callable[[Array], Array]] = {
    "staircase": lambda t: np.floor(t),
    "triangle": lambda t: np.abs((t % 2.0) - 1.0),
    "pulses of a row": lambda t: (np.arange(len(t)) % 50 == 0).astype(float),
    "square": lambda t: np.sign(np.sin(t)),
    "noise": lambda t: np.random.default_rng(0).standard_normal(len(t)),
    "heavy noise": lambda t: np.random.default_rng(1).standard_t(5, len(t)),
    "counter": lambda t: np.round(3.0 * np.sin(t)),
    "still": lambda t: 0.0 * t,
}


@pytest.mark.parametrize("shape", SHAPES)
def test_no_shape_by_itself_is_impossible(shape: str) -> None:
    t = np.arange(0.0, 60.0, 0.01)
    first = np.zeros(len(t), dtype=bool)
    first[[0, 2000]] = True
    assert not impossible.beyond(SHAPES[shape](t), first).any()


def test_rows_that_a_counter_of_rows_lost_get_their_time_back(session: list[Log]) -> None:
    """Taken as they are, the axis darts at each: the acceleration there is many times its own."""
    kept = np.random.default_rng(0).uniform(size=len(session[2].frame)) > 0.03
    kept[0] = True
    frame = session[2].frame[kept].reset_index(drop=True)
    true = record([replace(session[2], rows=frame)])
    period = float(np.median(np.diff(frame["time_s"])))
    number = frame.groupby("trial").cumcount()
    start = frame.groupby("trial")["time_s"].transform("first")
    counted = record([replace(session[2], rows=frame.assign(time_s=start + period * number))])
    (said,) = (remark for remark in counted.remarks if "rows were lost and time_s counts those" in remark)
    assert "log the time of each measurement" in said
    away = counted.motion.acceleration - true.motion.acceleration
    fast = np.abs(true.motion.velocity) > 0.1
    assert np.sqrt(np.mean(away[fast] ** 2)) < 0.1 * np.sqrt(np.mean(true.motion.acceleration[fast] ** 2))


def test_a_burst_of_readings_that_stayed_is_left_out_and_told(session: list[Log]) -> None:
    """... of all columns at once: 12 rows, which no bound of time would tell from an axis at rest."""
    frame = session[2].frame.copy()
    columns = ["position_rad", "velocity_rad_s", "current_a"]
    fast = np.flatnonzero(np.abs(frame["velocity_rad_s"]) > 0.2)
    begins = [int(row) for row in fast[[100, 500, 900]]]
    for begin in begins:
        frame.loc[begin + 1 : begin + 12, columns] = frame.loc[begin, columns].to_numpy()
    bad, clean = record([replace(session[2], rows=frame)]), record([session[2]])
    assert bad.lost["position stuck"] == 36
    (said,) = (remark for remark in bad.remarks if "repeats its last reading" in remark)
    assert f"{session[2].place(begins[0] + 1)}: position_rad repeats its last reading" in said
    assert "(3 such, 36 rows in all)" in said
    away = (bad.motion.velocity - clean.motion.velocity)[bad.usable & clean.usable]
    assert np.abs(away).max() < 0.05


def test_an_effort_that_is_read_every_tenth_row_is_told_and_kept() -> None:
    time, rng = 0.005 * np.arange(4000), np.random.default_rng(0)
    position = 0.5 * time + np.sin(time)  # never at rest
    torque = 0.1 + 0.05 * np.cos(time) + rng.normal(0.0, 0.01, len(time))
    slow = torque[np.arange(len(time)) // 10 * 10]
    frame = pd.DataFrame({"trial": 0, "time_s": time, "position_rad": position, "torque_nm": slow})
    recording = record([Log(frame, Axis())])
    (said,) = (remark for remark in recording.remarks if "read anew more slowly" in remark)
    assert "torque_nm repeats its last reading on 89 % of the rows" in said
    assert "torque not read anew" not in recording.lost
