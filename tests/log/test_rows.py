"""Rows as numbers and rows as a frame say the same, and what numbers cannot hold goes to the frame."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from idtool.log import Log
from idtool.log.digits import read_digits
from idtool.log.rows import Numbers
from idtool.parameters.axis import Axis

SESSION = Path(__file__).resolve().parents[2] / "data" / "session"
HEAD = "trial,time_s,velocity_rad_s,torque_nm,note\n"


def rows_of(log: Log) -> object:
    return log._latest


@pytest.mark.parametrize("name", ["gravity", "sweep", "sine"])
def test_columns_are_those_of_the_frame(name: str) -> None:
    log = Log.read(SESSION / f"{name}.csv.gz")
    assert isinstance(rows_of(log), Numbers)
    roles = ("time", "position", "velocity", "current", "payload", "temperature")
    before = {role: log.column(role) for role in roles}
    count, trials = log.row_count, log.trial_of_rows
    frame = log.frame
    assert rows_of(log) is frame
    for role in roles:
        np.testing.assert_array_equal(log.column(role), before[role], strict=True)
    assert (log.row_count, len(frame)) == (count, count)
    np.testing.assert_array_equal(log.trial_of_rows, trials, strict=True)
    assert frame["trial"].dtype.kind == "i"
    assert len(log.trials) == trials[-1] + 1


@pytest.mark.parametrize("cell", ["warm", "", "TRUE", "1e999", "0x1p3"])
def test_words_gaps_and_what_no_float_holds_go_to_the_frame(tmp_path: Path, cell: str) -> None:
    path = tmp_path / "log.csv"
    path.write_text(HEAD + f"0,0,0.1,1,{cell}\n0,0.01,0.1,1,3\n")
    log = Log.read(path)
    assert not isinstance(rows_of(log), Numbers)
    assert list(log.frame.columns) == ["trial", "time_s", "velocity_rad_s", "torque_nm", "note"]


def test_trials_are_counted_as_they_come(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("trial,time_s,velocity_rad_s,torque_nm\n7,0,0.1,1\n7,0.1,0.1,1\n-2,0,0.1,1\n3,0,0.2,1\n")
    assert Log.read(path).trial_of_rows.tolist() == [0, 0, 1, 2]
    path.write_text("time_s,velocity_rad_s,torque_nm\n0,0.1,1\n0.1,0.1,1\n")
    one = Log.read(path)
    assert one.trial_of_rows.tolist() == [0, 0]
    assert list(one.frame.columns) == ["trial", "time_s", "velocity_rad_s", "torque_nm"]


def test_what_is_changed_in_the_frame_is_changed_in_the_log(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("time_s,velocity_rad_s,torque_nm\n0,0.1,1\n0.1,0.1,2\n")
    log = Log.read(path)
    log.frame["torque_nm"] *= -1.0
    torque = log.column("torque")
    assert torque is not None
    assert torque.tolist() == [-1.0, -2.0]


def test_a_log_is_copied_with_its_rows(tmp_path: Path) -> None:
    log = Log.read(SESSION / "sine.csv.gz")
    again = pickle.loads(pickle.dumps(log))
    np.testing.assert_array_equal(again.column("position"), log.column("position"))
    other = replace(log, axis=Axis("rotary", 1.0))
    assert other.axis.torque_constant == 1.0
    np.testing.assert_array_equal(other.column("position"), log.column("position"))


@given(
    st.lists(
        st.one_of(
            st.decimals(allow_nan=False, allow_infinity=False, places=6, min_value=-999, max_value=999).map(
                str
            ),
            st.floats(allow_nan=False, allow_infinity=False).map(repr),
            st.integers(-(10**16), 10**16).map(str),
            st.sampled_from(["1e5", "-0", "+.5", "5.", "1E-7", "0.000000123456789012345", "1e22", "7e-22"]),
        ),
        min_size=2,
        max_size=8,
    )
)
def test_digits_are_read_as_float_reads_them(cells: list[str]) -> None:
    found = read_digits(f"{','.join(cells)}\n".encode() * 2, len(cells))
    if found is None:  # too many digits, or too large a power
        assert any(len(cell.strip("-+").replace(".", "").lstrip("0")) > 15 or "e" in cell for cell in cells)
    else:
        expected = [float(cell) for cell in cells]
        assert [column.tobytes() for column in found] == [np.array([v, v]).tobytes() for v in expected]


def test_fifteen_digits_are_read_and_no_more() -> None:
    found = read_digits(b"123456789.012345\n", 1)
    assert found is not None
    assert found[0, 0] == 123456789.012345
    assert read_digits(b"123456789.0123456\n", 1) is None


@pytest.mark.parametrize(
    "rows",
    [
        "1,\n",
        ",1\n",
        "1,2",
        "1,2,3\n",
        "1\n2\n",
        "1,2 \n",
        "nan,1\n",
        "1,-\n",
        "1,2e\n",
        "1,2e5555\n",
        "1,.\n",
    ],
)
def test_what_is_no_number_is_left_to_others(rows: str) -> None:
    assert read_digits(rows.encode(), 2) is None
