"""Recordings from elsewhere: what is taken for what, what is converted, mended and refused."""

from __future__ import annotations

import gzip
import math
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from idtool.errors import InputError, UsageError
from idtool.importing import Imported, import_recording
from idtool.log import Log
from tests.importing.test_names import NAMES

SLOW = settings(
    max_examples=80,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


def put(folder: Path, content: str | bytes, name: str = "run.csv") -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def sources(imported: Imported) -> dict[str, str]:
    return {item.column: item.source for item in imported.taken}


UNITS = [
    ("position", "deg", 180, math.pi),
    ("position", "rev", 1, 2 * math.pi),
    ("position", "turn", 1, 2 * math.pi),
    ("position", "count:4096", 1024, math.pi / 2),
    ("velocity", "rpm", 60, 2 * math.pi),
    ("velocity", "rev/min", 60, 2 * math.pi),
    ("velocity", "deg/s", 180, math.pi),
    ("velocity", "0.229rpm", 1, 0.229 * math.pi / 30),
    ("current", "mA", 1500, 1.5),
    ("current", "2.69mA", 100, 0.269),
    ("current", "0.01", 150, 1.5),
    ("torque", "mNm", 70, 0.07),
    ("torque", "Ncm", 70, 0.7),
    ("torque", "kgf.cm", 1, 0.0980665),
    ("time", "ms", 1500, 1.5),
    ("time", "us", 1500, 0.0015),
    ("temperature", "degF", 77, 25),
    ("temperature", "K", 300, 26.85),
]


@pytest.mark.parametrize(("role", "unit", "value", "expected"), UNITS)
def test_units_are_converted(tmp_path: Path, role: str, unit: str, value: float, expected: float) -> None:
    columns = {
        "time": 0.0,
        "position": 0.0,
        "velocity": 0.0,
        "current": 0.0,
        "torque": 0.0,
        "temperature": 0.0,
    }
    columns[role] = value
    text = ",".join(columns) + "\n" + ",".join(map(str, columns.values())) + "\n"
    log = import_recording(put(tmp_path, text), units={role: unit}).log
    found = log.column(role)
    assert found is not None
    assert found[0] == pytest.approx(expected, rel=1e-12)


def test_linear_axis_and_units_in_names(tmp_path: Path) -> None:
    log = import_recording(put(tmp_path, "t_ms,pos [mm],force_kN\n0,1,2\n10,2,3\n")).log
    assert log.axis.kind == "linear"
    assert log.frame.to_numpy(float) == pytest.approx(np.array([[0, 0, 0.001, 2000], [0, 0.01, 0.002, 3000]]))


def test_the_header_tells_where_it_came_from(tmp_path: Path) -> None:
    path = put(tmp_path, "t,angle,tau_cmd,joint,run\n0,90,1,1,a\n1,91,1,1,a\n0,1,1,1,b\n0,1,1,2,b\n")
    imported = import_recording(
        path, units={"position": "deg"}, trial_by="run", where={"joint": ["1"]}, experiment="sweep"
    )
    imported.log.write(tmp_path / "log.csv")
    log = Log.read(tmp_path / "log.csv")
    assert log.experiment == "sweep"
    assert log.header == {
        "imported_from": "run.csv",
        "effort": "commanded",
        "import": {
            "where": ["joint=1"],
            "trial_by": "run",
            "columns": {
                "trial": "run", "time_s": "t", "position_rad": "angle", "torque_nm": "tau_cmd",
            },
            "units": {"position_rad": "deg"},
        },
    }  # fmt: skip
    assert log.frame["trial"].tolist() == [0, 0, 1]
    assert log.frame["run"].tolist() == ["a", "a", "b"]
    assert any("COMMANDED" in note for note in imported.notes)
    assert str(tmp_path) not in (tmp_path / "log.csv").read_text()


def test_a_measured_torque_goes_before_a_commanded_one(tmp_path: Path) -> None:
    imported = import_recording(put(tmp_path, "t,q,tau_cmd,tau_meas\n0,1,2,3\n1,1,2,3\n"))
    assert sources(imported)["torque_nm"] == "tau_meas"
    assert imported.kept == ("tau_cmd",)
    assert not any(item.commanded for item in imported.taken)


def test_options_go_before_guesses(tmp_path: Path) -> None:
    path = put(tmp_path, "t,q1,q2,velocity_rad_s,v2,torque_nm\n0,1,2,3,4,5\n1,1,2,3,4,5\n")
    with pytest.raises(
        InputError, match='"q1", "q2" may all be the position; choose with --map position_rad=q1'
    ):
        import_recording(path)
    imported = import_recording(path, mapping={"position": "q2", "velocity_rad_s": "v2"})
    assert sources(imported)["velocity_rad_s"] == "v2"
    assert imported.log.frame["source_velocity_rad_s"].tolist() == [3, 3]
    assert imported.log.frame["q1"].tolist() == [1, 1]


ROWS = "0,1,2\n0.01,1,2\n0.02,1,3\n"


@pytest.mark.parametrize(
    "content",
    [
        "t,q,tau\n" + ROWS,
        gzip.compress(("t,q,tau\n" + ROWS).encode()),
        ("t,q,tau\n" + ROWS).replace(",", ";"),
        ("t,q,tau\n" + ROWS).replace(",", "\t"),
        ("t,q,tau\n" + ROWS).replace(",", "  "),
        ("t,q,tau\n" + ROWS).replace(",", ";").replace(".", ","),
        ("t,q,tau\n" + ROWS).encode("utf-16"),
        "# t,q,tau\n" + ROWS,
        "% made by hand\nt,q,tau\n" + ROWS.replace("\n", "\r\n"),
        "t,q,tau\n" + ROWS + "0.03,1",
    ],
    ids=[
        "comma",
        "gzip",
        "semicolon",
        "tab",
        "blanks",
        "decimal comma",
        "UTF-16",
        "savetxt",
        "Windows",
        "cut",
    ],
)
def test_text_however_it_was_saved(tmp_path: Path, content: str | bytes) -> None:
    frame = import_recording(put(tmp_path, content)).log.frame
    assert frame["time_s"].tolist() == [0, 0.01, 0.02]
    assert frame["torque_nm"].tolist() == [2, 2, 3]


@pytest.mark.parametrize("row", ["ms;deg;Nmm;A", "[ms];[deg];[Nmm];[A]", "ms;(deg);Nmm;-"])
def test_a_row_of_units_under_the_names(tmp_path: Path, row: str) -> None:
    text = f"t;q;tau;fan\n{row}\n" + "0;180;2000;1,5\n10;90;2000;1,5\n20;0;3000;1,5\n"
    found = import_recording(put(tmp_path, text))
    np.testing.assert_allclose(found.log.frame["time_s"], [0.0, 0.01, 0.02])
    np.testing.assert_allclose(found.log.frame["position_rad"], [np.pi, np.pi / 2, 0.0], atol=1e-12)
    np.testing.assert_allclose(found.log.frame["torque_nm"], [2.0, 2.0, 3.0])
    assert {item.why for item in found.taken if item.role != "trial"} == {"named"}
    assert any("units" in note for note in found.notes)
    mapped = import_recording(put(tmp_path, text.replace("tau", "x12")), mapping={"torque_nm": "x12"})
    np.testing.assert_allclose(mapped.log.frame["torque_nm"], [2.0, 2.0, 3.0])


def test_parquet_and_matlab(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    time = np.arange(50) * 1e-3
    frame = pd.DataFrame({"t": time, "qm": time**2, "vir": time, "tau": np.cos(time)})
    frame.to_parquet(tmp_path / "a.parquet")
    savemat(tmp_path / "b.mat", {name: frame[name].to_numpy()[:, None] for name in frame} | {"gtau": 35.15})
    savemat(tmp_path / "c.mat", {"rec": {"t": time, "qm": time**2, "vir": time, "tau": np.cos(time)}})
    logs = [import_recording(tmp_path / name).log for name in ("a.parquet", "b.mat")]
    logs.append(import_recording(tmp_path / "c.mat", mapping={
        "time_s": "rec.t", "position_rad": "rec.qm", "torque_nm": "rec.tau"}).log)  # fmt: skip
    for log in logs:
        np.testing.assert_array_equal(log.frame["time_s"], time)
        np.testing.assert_array_equal(log.frame["torque_nm"], np.cos(time))


def test_dates_and_times_since_1970(tmp_path: Path) -> None:
    dates = "time,q,tau\n2026-01-01T00:00:00.00Z,1,2\n2026-01-01T00:00:00.25Z,1,2\n"
    assert import_recording(put(tmp_path, dates)).log.frame["time_s"].tolist() == [0, 0.25]
    imported = import_recording(put(tmp_path, "time,q,tau\n1760000000.5,1,2\n1760000000.75,1,2\n"))
    assert imported.log.frame["time_s"].tolist() == [0, 0.25]
    assert any("counts from the first row" in note for note in imported.notes)


def test_a_bad_cell_is_named_by_its_line_whatever_stands_above_it(tmp_path: Path) -> None:
    text = (
        "# by a rig\nt,q,tau,joint\ns,rad,Nm,\n0,1,2,1\n\n0.01,1,2,2\n0.02,1,x1,2\n0.03,1,inf,2\n0.04,1,2,2"
    )
    imported = import_recording(put(tmp_path, text), where={"joint": ["2"]})
    (told,) = (note for note in imported.notes if "finite" in note)
    assert told == 'column "tau", line 7: "x1" is no finite number (and 1 more), taken as missing'
    assert imported.log.frame["time_s"].tolist() == [0.01, 0.04]


def test_what_is_mended_is_counted(tmp_path: Path) -> None:
    text = (
        "t,q,tau,temp\n0,1,2,\n0.01,,2,25\n0.02,1,bad,25\n0.03,1,2,\n0.03,1,2,25\n0.05,1,2,26\n0.04,1,2,26\n"
    )
    imported = import_recording(put(tmp_path, text))
    assert imported.rows_read == 7
    assert imported.log.frame["time_s"].tolist() == [0, 0.03, 0.04, 0.05]
    assert imported.log.frame["temperature_degc"].tolist() == [26, 26, 26, 26]
    told = "\n".join(imported.notes)
    for part in (
        'column "tau", line 4: "bad" is no finite number, taken as missing',
        "dropped 2 rows without a number in position_rad, torque_nm",
        "sorted by time: 1 row came",
        "dropped 1 row whose time stamp",
        "temperature_degc: 2 gaps filled",
        "no unit is named, presumed",
    ):
        assert part in told


def test_a_clock_that_restarts_begins_a_trial(tmp_path: Path) -> None:
    thrice = "".join(f"{k / 100},{k},{run}\n" for run in range(3) for k in range(5))
    imported = import_recording(put(tmp_path, "t,q,tau\n" + thrice))
    assert [len(rows) for rows in imported.log.trials] == [5, 5, 5]
    assert any("starts again 2 times" in note for note in imported.notes)


@pytest.mark.parametrize("twice", ["a b a b", "a a b b"], ids=["a block again", "each row again"])
def test_rows_that_are_there_twice_count_once(tmp_path: Path, twice: str) -> None:
    """As a second trial, or under a clock that restarts, they would halve every variance."""
    rows = {"a": "0,1,2\n", "b": "0.01,2,3\n"}
    imported = import_recording(put(tmp_path, "t,q,tau\n" + "".join(rows[name] for name in twice.split())))
    assert imported.log.frame["time_s"].tolist() == [0, 0.01]
    assert imported.log.frame["trial"].tolist() == [0, 0]
    assert "dropped 2 rows met before, to the last digit" in imported.notes


def test_interleaved_trials_are_brought_together(tmp_path: Path) -> None:
    log = import_recording(put(tmp_path, "run,t,q,tau\nb,0,1,1\na,0,2,1\nb,1,1,1\na,1,2,1\n")).log
    assert log.frame["run"].tolist() == ["b", "b", "a", "a"]
    assert log.frame["trial"].tolist() == [0, 0, 1, 1]


@pytest.mark.parametrize("name", ["motor_id", "Joint", "servo no", "id", "dxl_id", "Axis"])
def test_a_table_of_several_servos_asks_which(tmp_path: Path, name: str) -> None:
    rows = "".join(f"{servo},{0.1 * k},{servo * k},1\n" for k in range(20) for servo in (1, 2))
    path = put(tmp_path, f"{name},t,q,tau\n{rows}")
    with pytest.raises(InputError) as caught:
        import_recording(path)
    assert f'holds several axes: column "{name}" is 1, 2' in str(caught.value)
    assert f'--where "{name}=1"' in str(caught.value)
    one = import_recording(path, where={name: ["2"]}).log.frame
    assert one["position_rad"].tolist() == [2.0 * k for k in range(20)]
    assert import_recording(path, trial_by=name).log.frame["trial"].nunique() == 2


@pytest.mark.parametrize("name", ["index", "number", "drive_mode", "valid", "axle", "identity", "no"])
def test_a_column_that_names_no_servo_parts_nothing(tmp_path: Path, name: str) -> None:
    rows = "".join(f"{k % 2},{0.1 * k},{k},1\n" for k in range(20))
    assert len(import_recording(put(tmp_path, f"{name},t,q,tau\n{rows}")).log.frame) == 20


def test_an_id_that_numbers_trials_is_no_servo(tmp_path: Path) -> None:
    rows = "".join(f"{trial},{0.1 * k},{k},1\n" for trial in (1, 2, 3) for k in range(20))
    path = put(tmp_path, "id,t,q,tau\n" + rows)
    assert import_recording(path).log.frame["trial"].nunique() == 3
    with pytest.raises(InputError, match='column "motor id" is 1, 2, 3'):
        import_recording(put(tmp_path, "motor id,t,q,tau\n" + rows))


def test_a_count_of_rows_is_no_servo(tmp_path: Path) -> None:
    rows = "".join(f"{k},{0.1 * k},{k},1\n" for k in range(20))
    assert len(import_recording(put(tmp_path, "id,t,q,tau\n" + rows)).log.frame) == 20


def test_wrapped_positions(tmp_path: Path) -> None:
    angle = np.arange(200) * 5.0
    rows = "".join(f"{k / 100},{a % 360},1\n" for k, a in enumerate(angle))
    path = put(tmp_path, "t,angle_deg,tau\n" + rows)
    assert any("give --unwrap" in note for note in import_recording(path).notes)
    imported = import_recording(path, unwrap=360)
    np.testing.assert_allclose(imported.log.frame["position_rad"], np.deg2rad(angle), atol=1e-9)
    assert "unwrapped 2 jumps of the position with period 360 deg" in imported.notes


BAD: dict[str, tuple[str | bytes, dict[str, Any], str]] = {
    "empty": ("", {}, "the file is empty"),
    "header only": ("t,q,tau\n", {}, "has no data rows"),
    "no header": ("1,2,3\n4,5,6\n", {}, "has no header row"),
    "binary": (bytes(range(256)) * 4, {}, "is neither text, Parquet nor a MATLAB file"),
    "excel": (b"PK\x03\x04" + bytes(99), {}, "zip archive"),
    "hdf5": (b"\x89HDF\r\n\x1a\n" + bytes(99), {}, "is a damaged HDF5 file"),
    "numpy": (b"\x93NUMPY" + bytes(99), {}, "NumPy array"),
    "parquet": (b"PAR1" + bytes(99), {}, "damaged Parquet"),
    "matlab": (b"MATLAB 5.0 MAT-file" + bytes(200), {}, "not a MATLAB file that can be read"),
    "matlab 7.3": (b"MATLAB 7.3 MAT-file" + bytes(200), {}, "is a damaged HDF5 file"),
    "no time": (
        "q,tau\n1,2\n",
        {},
        "no column looks like time (it has q, tau); say which is it with --map time_s=",
    ),
    "a counter": ("t,pos_counts,i\n1,2,3\n", {}, "of a counter --unit position=count:COUNTS_PER_TURN"),
    "nothing": (
        "Zeit,Winkel,Strom\n1,2,3\n",
        {},
        "no column looks like time, nor like position or velocity, nor like torque or current (it has Zeit, "
        "Winkel, Strom); say which they are with --map time_s=COLUMN, --map position_rad=COLUMN or "
        "velocity_rad_s=COLUMN, --map ",
    ),
    "no motion": ("t,tau\n1,2\n", {}, "no column looks like position or velocity"),
    "no effort": ("t,q\n1,2\n", {}, "say which is it with --map torque_nm=COLUMN or current_a=COLUMN"),
    "no effort, linear": ("t,pos_mm\n1,2\n", {}, "no column looks like force or current"),
    "bad K": ("t,q,i\n1,2,3\n", {"torque_constant": 0.0}, "torque_constant: the torque constant must be"),
    "two kinds": (
        "t,pos_mm,tau_nm\n1,2,3\n",
        {},
        '"tau_nm" belongs to a rotary axis and "pos_mm" to a linear one',
    ),
    "slow clock": (
        "t,q,tau\n0,1,1\n10,1,1\n20,1,1\n",
        {},
        "steps by 10, which is slow for seconds; say its unit",
    ),
    "stamps without digits": (
        "t,q,tau\n" + "".join(f"1.7e9,{k},1\n" for k in range(50)),
        {},
        "its 50 rows have 1 time stamp only; export the time with all its digits",
    ),
    "text": ("t,q,tau\n0,a,1\n1,b,1\n", {}, 'column "q" holds text ("a"), not numbers'),
    "no row": ("t,q,tau\n0,,1\n1,1,\n", {}, "no row has a number in each of position_rad, torque_nm"),
    "doubled": ("t,q,q,tau\n0,1,1,1\n", {}, 'column "q" appears twice'),
    "long row": ("t,q,tau\n0,1,1\n0,1,1,1,1\n", {}, "line 3: a row has too many fields"),
    "map source": ("t,q,tau\n0,1,1\n", {"mapping": {"position_rad": "Q1"}}, 'has no column "Q1"'),
    "other kind": (
        "t,q,tau,force_n\n0,1,1,1\n",
        {"mapping": {"torque_nm": "force_n"}},
        '"force_n" is in n, no unit',
    ),
    "trial by": ("t,q,tau,run\n0,1,1,1\n", {"trial_by": "runs"}, 'has no column "runs"; did you mean "run"'),
    "where column": ("t,q,tau,joint\n0,1,1,1\n", {"where": {"joints": ["1"]}}, 'did you mean "joint"'),
    "where value": (
        "t,q,tau,joint\n0,1,1,1\n",
        {"where": {"joint": ["7"]}},
        "no row has joint = 7; it holds 1",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_sentence(tmp_path: Path, case: str) -> None:
    content, options, expected = BAD[case]
    with pytest.raises(InputError) as caught:
        import_recording(put(tmp_path, content), **options)
    text = str(caught.value)
    assert expected in text
    assert "\n" not in text
    assert text.endswith((".", "?"))


USAGE: dict[str, tuple[dict[str, Any], str]] = {
    "unknown column": ({"mapping": {"positoin_rad": "q"}}, 'no column of a log; did you mean "position_rad"'),
    "far from any": ({"mapping": {"zzz": "q"}}, "no column of a log; name trial, time, position"),
    "unknown unit": ({"units": {"position": "dge"}}, '"dge" is no unit of angle; use one of'),
    "unit of trial": ({"units": {"trial": "s"}}, "is no unit of that column"),
    "unit of what is not there": ({"units": {"payload": "kg"}}, "no column was taken for payload"),
    "twice": ({"mapping": {"position": "q", "position_rad": "q"}}, "names the position twice"),
    "two kinds": ({"mapping": {"position_m": "q", "torque_nm": "tau"}}, "do not fit one axis"),
    "kind": ({"mapping": {"position_m": "q"}, "kind": "rotary"}, "do not fit one axis"),
}


@pytest.mark.parametrize("case", USAGE)
def test_options_that_make_no_sense(tmp_path: Path, case: str) -> None:
    options, expected = USAGE[case]
    with pytest.raises(UsageError) as caught:
        import_recording(put(tmp_path, "t,q,tau\n0,1,1\n"), **options)
    assert expected in str(caught.value)


def test_paths_that_are_no_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        import_recording(tmp_path / "absent.csv")
    with pytest.raises(InputError, match="is a folder where a recording should be"):
        import_recording(tmp_path)


@SLOW
@given(content=st.binary(max_size=200), name=st.sampled_from(["a.csv", "a.mat", "a.parquet", "a.csv.gz"]))
def test_arbitrary_bytes_are_an_input_error_or_a_log(tmp_path: Path, content: bytes, name: str) -> None:
    for data in (
        content,
        b"PAR1" + content + b"PAR1",
        b"t,q,tau\n0,1,2\n" + content,
        gzip.compress(content)[:-3],
    ):
        with suppress(InputError):
            import_recording(put(tmp_path, data, name))


@SLOW
@given(
    names=st.lists(
        st.sampled_from([name for name, *_ in NAMES] + ["x", "note"]), min_size=3, max_size=9, unique=True
    ),
    data=st.data(),
)
def test_what_is_imported_can_be_read(tmp_path: Path, names: list[str], data: st.DataObject) -> None:
    cells = st.sampled_from(["0", "1", "-2.5", "1e300", "", "nan", "inf", "a", "7"])
    rows = data.draw(
        st.lists(st.lists(cells, min_size=len(names), max_size=len(names)), min_size=1, max_size=6)
    )
    text = "\n".join([";".join(names), *(";".join(row) for row in rows)])
    with suppress(InputError):
        log = import_recording(put(tmp_path, text), torque_constant=1.0).log
        log.write(tmp_path / "log.csv", force=True)
        again = Log.read(tmp_path / "log.csv")
        assert len(again.frame) == len(log.frame)
        assert again.header == log.header


def test_a_log_can_be_imported_again(tmp_path: Path) -> None:
    log = import_recording(put(tmp_path, "t,q,i\n0,1,2\n1,2,3\n"), torque_constant=2.5, experiment="sine").log
    log.write(tmp_path / "log.csv")
    again = import_recording(tmp_path / "log.csv").log
    pd.testing.assert_frame_equal(again.frame, log.frame)
    assert (again.axis, again.experiment) == (log.axis, log.experiment)


#: recording, options, rows, trials, kind of axis
REAL: dict[str, tuple[str, dict[str, Any], int, int, str]] = {
    "emps": ("emps/emps_identification.csv.gz", {}, 24841, 1, "linear"),
    "emps pulses": ("emps/emps_validation_pulses.csv.gz", {}, 24841, 1, "linear"),
    "cicese 2": (
        "cicese_dd2dof/test2_constant_speed_both_joints.csv.gz",
        {"mapping": {"position_rad": "position1_rad", "torque_nm": "torque1_cmd_nm"}, "trial_by": "run"},
        47577, 71, "rotary",
    ),
    "cicese 1": (
        "cicese_dd2dof/test1_breakaway_torque_ramps.csv.gz",
        {"where": {"joint": ["1"]}, "trial_by": "run"}, 12702, 6, "rotary",
    ),
    "damiao": ("damiao_motors/motor05_dm4310.csv.gz", {"unwrap": 25.0}, 14670, 6, "rotary"),
    "dfki": ("dfki_pendulum_ak80/ddp.csv.gz", {}, 3000, 1, "rotary"),
    "hsm150": ("hsm150_servo/torque_step_neg_0.04.csv.gz", {}, 15000, 3, "rotary"),
    "laas": ("laas_bldc_cogging/speed_test.csv.gz", {"torque_constant": 0.03}, 16001, 1, "rotary"),
    "lugre": ("servo_motor_lugre/presliding_torque_triangle.csv.gz", {}, 80000, 10, "rotary"),
    "sts3215": (
        "sts3215_backlash/motor_telemetry_single.csv",
        {"where": {"servo_id": ["3"]}, "torque_constant": 1.0}, 273, 1, "rotary",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", REAL)
def test_recordings_of_real_machines(measured: Path, tmp_path: Path, case: str) -> None:
    name, options, rows, trials, kind = REAL[case]
    path = measured / name
    if not path.exists():
        pytest.skip(f"{path} is absent")
    imported = import_recording(path, **options)
    imported.log.write(tmp_path / "log.csv")
    log = Log.read(tmp_path / "log.csv")
    assert (len(log.frame), len(log.trials), log.axis.kind) == (rows, trials, kind)
    source = pd.read_csv(path)
    position = next(item.source for item in imported.taken if item.role == "position")
    if not options.get("where") and "unwrap" not in options:
        np.testing.assert_array_equal(log.column("position"), source[position])
    if "unwrap" in options:
        found = log.column("position")
        assert found is not None
        steps = np.abs(np.diff(found))[np.diff(log.frame["trial"]) == 0]
        assert steps.max() < 12.5


def test_a_role_without_a_unit_is_said_to_be_presumed(tmp_path: Path) -> None:
    """A column of the log names its unit; "current" does not, and neither does "cur_cnt"."""
    rows = "".join(f"{0.01 * k},{0.001 * k},{k % 7}\n" for k in range(60))
    file = tmp_path / "counts.csv"
    file.write_text("time_s,position_rad,cur_cnt\n" + rows)
    bare = import_recording(file, mapping={"current": "cur_cnt"})
    assert any('presumed: "cur_cnt" A; if not so, give --unit current=UNIT' in note for note in bare.notes)
    for mapping, units in (({"current_a": "cur_cnt"}, {}), ({"current": "cur_cnt"}, {"current": "mA"})):
        assert not any(
            "presumed" in note for note in import_recording(file, mapping=mapping, units=units).notes
        )
