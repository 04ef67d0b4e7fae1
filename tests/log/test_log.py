"""The log: exact round trips, every bad input told in one sentence."""

from __future__ import annotations

import gzip
from contextlib import suppress
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from idtool.errors import InputError
from idtool.importing.cleaning import to_numbers
from idtool.io.read_file import read_bytes
from idtool.log import Log, LogWriter, columns_of
from idtool.log.clock import gap_cuts
from idtool.parameters.axis import Axis
from idtool.signals import record

AXIS = '# [axis]\n# kind = "rotary"\n# torque_constant_nm_per_a = 2.67\n'
HEAD = '# ffc-id-log = 1\n# experiment = "sweep"\n' + AXIS
NAMES = "trial,time_s,velocity_rad_s,current_a\n"
ROWS = "0,0,0.1,1\n0,0.01,0.1,1\n1,0.02,0.2,1.5\n"
SLOW = settings(
    max_examples=60,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
FINITE = st.floats(allow_nan=False, allow_infinity=False)


def put(folder: Path, content: str | bytes, name: str = "log.csv") -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def refused(path: Path, **options: float) -> str:
    with pytest.raises(InputError) as caught:
        Log.read(path, **options)
    text = str(caught.value)
    assert "\n" not in text
    assert text.endswith((".", "?"))
    return text


def test_reads_what_the_header_says(tmp_path: Path) -> None:
    log = Log.read(put(tmp_path, HEAD + NAMES + ROWS))
    assert log.experiment == "sweep"
    assert log.axis == Axis("rotary", 2.67)
    assert [len(rows) for rows in log.trials] == [2, 1]
    assert not log.incomplete
    velocity = log.column("velocity")
    assert velocity is not None
    assert velocity.tolist() == [0.1, 0.1, 0.2]
    assert log.column("position") is None


def test_row_numbers_of_pandas_are_left_out(tmp_path: Path) -> None:
    Log.read(put(tmp_path, HEAD + NAMES + ROWS)).frame.to_csv(tmp_path / "saved.csv")
    log = Log.read(tmp_path / "saved.csv")
    assert log.numbered
    assert list(log.frame.columns) == ["trial", "time_s", "velocity_rad_s", "current_a"]
    assert log.frame["time_s"].tolist() == [0.0, 0.01, 0.02]


@pytest.mark.parametrize(
    "content",
    [
        b"\xef\xbb\xbf" + (HEAD + NAMES + ROWS).encode(),
        (HEAD + NAMES + ROWS).replace("\n", "\r\n").encode(),
        (HEAD + NAMES + ROWS).replace("\n", "\r").encode(),
        gzip.compress((HEAD + NAMES + ROWS).encode()),
        gzip.compress((HEAD + NAMES).encode()) + gzip.compress(ROWS.encode()),
        (HEAD + NAMES + ROWS + "\n\n").encode(),
        (HEAD + NAMES + ROWS).replace(",", ", ").encode(),
        (HEAD + "# # a remark\n#\n" + NAMES + ROWS).encode(),
    ],
    ids=["byte order mark", "Windows", "old Mac", "gzip", "gzip in parts", "blank end", "spaces", "remark"],
)
def test_reads_the_same_log_however_it_was_saved(tmp_path: Path, content: bytes) -> None:
    log = Log.read(put(tmp_path, content))
    assert log.frame.to_numpy().tolist() == [[0, 0, 0.1, 1], [0, 0.01, 0.1, 1], [1, 0.02, 0.2, 1.5]]
    assert log.axis.torque_constant == 2.67
    assert not log.incomplete


def test_a_plain_csv_is_a_log(tmp_path: Path) -> None:
    plain = put(tmp_path, "time_s,position_m,force_n,note\n0,1,2,a\n1,1,2,b")
    log = Log.read(plain)
    assert log.axis.kind == "linear"
    assert log.frame["trial"].tolist() == [0, 0]
    assert log.frame["note"].tolist() == ["a", "b"]
    assert not log.incomplete
    current = put(tmp_path, "# made by hand\ntime_s,velocity_rad_s,current_a\n0,1,2\n")
    assert Log.read(current, torque_constant=2.5).axis.torque_constant == 2.5


BAD = {
    "empty": ("", "the file is empty; record it again"),
    "blank": ("\n\n \n", "the file is empty"),
    "header only": (HEAD + NAMES, "has no data rows"),
    "header cut": (HEAD + "trial,time_s,velo", "has no data rows"),
    "comments only": (HEAD, "has no header row"),
    "no header row": (HEAD + ROWS, "the header row is missing"),
    "binary": (
        b"\x00\x01\x02\xff" * 50,
        "is not a text file in UTF-8; `ffc-id import` reads other encodings",
    ),
    "latin": ("time_s,velocity_rad_s,torque_nm,Wärme\n0,1,2,3\n".encode("latin-1"), "is not a text file"),
    "utf-16": ((HEAD + NAMES + ROWS).encode("utf-16"), "is not a text file in UTF-8"),
    "zero byte": (HEAD + NAMES + ROWS.replace("0.2", "0\x00.2", 1), "is not a text file in UTF-8"),
    "column of NaN": (
        HEAD + NAMES + "0,0,nan,1\n0,0.01,,1\n",
        'line 7: column "velocity_rad_s" is empty or NaN; no row of it is: leave the column out',
    ),
    "header again": (
        HEAD + NAMES + ROWS + NAMES,
        'line 10: column "time_s" holds "time_s", not a finite number; correct or delete that row',
    ),
    "missing column": (HEAD + "time_s,current_a\n0,1\n", 'needs a column "velocity_rad_s" or "position_rad"'),
    "misspelt": (HEAD + "time_s,velocity_rads,current_a\n0,1,1\n", 'rename "velocity_rads"'),
    "no unit": (
        HEAD + "time_s,velocity,current_a\n0,1,1\n",
        'column "velocity" has no unit; name it "velocity_rad_s"',
    ),
    "no unit of time": (
        HEAD + "t,velocity_rad_s,current_a\n0,1,1\n",
        'column "t" has no unit; name it "time_s"',
    ),
    "no unit, linear": ("time_s,position_m,force\n0,1,1\n", 'column "force" has no unit; name it "force_n"'),
    "text": (
        HEAD + NAMES + ROWS + "1,0.03,fast,1\n",
        'line 10: column "velocity_rad_s" holds "fast", not a finite',
    ),
    "true": (HEAD + NAMES + "0,0,True,1\n", 'holds "True"'),
    "NaN": (HEAD + NAMES + ROWS + "1,0.03,nan,1\n", 'line 10: column "velocity_rad_s" is empty or NaN'),
    "empty cell": (HEAD + NAMES + ROWS + "1,0.03,0.1,\n", 'line 10: column "current_a" is empty or NaN'),
    "infinite": (HEAD + NAMES + ROWS + "1,0.03,0.1,1e999\n", "line 10"),
    "molten": (
        HEAD + NAMES.replace("current_a", "current_a,temperature_degc") + "0,0,0.1,1,25\n0,0.01,0.1,1,1e30\n",
        'line 8: column "temperature_degc" holds 1e+30, not a temperature',
    ),
    "empty trial": (HEAD + NAMES + ",0,0.1,1\n", 'line 7: column "trial" is empty'),
    "time back": (
        HEAD + NAMES + ROWS + "1,0.01,0.1,1\n",
        "line 10: time goes backwards (0.02 s, then 0.01 s)",
    ),
    "time stands": (HEAD + NAMES + ROWS + "1,0.02,0.1,1\n", "line 10: time stands still"),
    "trial returns": (HEAD + NAMES + ROWS + "0,0.03,0.1,1\n", "line 10: trial 0 starts again"),
    "long row": (HEAD + NAMES + "0,0,0.1,1,9\n" + ROWS, "line 7: has 5 fields, expected 4"),
    "short row": (HEAD + NAMES + "0,0,0.1\n" + ROWS, "line 7: has 3 fields, expected 4"),
    "blank row": (HEAD + NAMES + "\n" + ROWS, "line 7: the line is empty"),
    "doubled": (HEAD + "time_s,current_a,current_a\n0,1,1\n", 'column "current_a" appears twice'),
    "nameless": (HEAD + "time_s,,velocity_rad_s,current_a\n0,0,1,1\n", "line 6: column 2 has no name"),
    "nameless first": (HEAD + ",time_s,velocity_rad_s,current_a\n0.1,0,1,1\n", "column 1 has no name"),
    "semicolons": (
        "time_s;velocity_rad_s;torque_nm\n0;1;1\n",
        "not separated by commas; `ffc-id import` reads",
    ),
    "open quote": (HEAD + NAMES + '0,"0,0.1,1\n' + ROWS, "a quote is not closed; remove or close the quote"),
    "version": (HEAD.replace("log = 1", "log = 7") + NAMES + ROWS, "log version 7 is not known"),
    "version true": (HEAD.replace("log = 1", "log = true") + NAMES + ROWS, "log version True is not known"),
    "bad TOML": (HEAD + "# kind = = 2\n" + NAMES + ROWS, "the `# ` lines on top are not TOML"),
    "huge number": (HEAD + "# a = " + "9" * 5000 + "\n" + NAMES + ROWS, "are not TOML"),
    "experiment": (
        HEAD.replace('"sweep"', "3") + NAMES + ROWS,
        "experiment: must be a word in quotes, not 3",
    ),
    "kind": (
        HEAD.replace("rotary", "rotery") + NAMES + ROWS,
        "axis.kind: unknown kind of axis 'rotery'; did you",
    ),
    "kind list": (HEAD.replace('"rotary"', "[1]") + NAMES + ROWS, "unknown kind of axis [1]"),
    "axis no table": ("# ffc-id-log = 1\n# axis = 3\n" + NAMES + ROWS, "axis is not a table"),
    "K zero": (HEAD.replace("2.67", "0") + NAMES + ROWS, "must be a finite number above zero, not 0"),
    "K negative": (HEAD.replace("2.67", "-1.5") + NAMES + ROWS, "above zero, not -1.5"),
    "K NaN": (HEAD.replace("2.67", "nan") + NAMES + ROWS, "above zero, not nan"),
    "K huge": (HEAD.replace("2.67", "1" + "0" * 400) + NAMES + ROWS, "above zero"),
    "K of no motor": (HEAD.replace("2.67", "1e300") + NAMES + ROWS, "is 1e+300, which no motor has"),
    "K of none either": (HEAD.replace("2.67", "1e-300") + NAMES + ROWS, "is 1e-300, which no motor has"),
    "K text": (HEAD.replace("2.67", '"2.67"') + NAMES + ROWS, "above zero, not '2.67'"),
    "K of the other kind": (
        HEAD.replace("torque_constant_nm", "force_constant_n") + NAMES + ROWS,
        "does not fit a rotary",
    ),
    "long line": ("#" + "x" * (2 << 20), "over 1 MiB"),
    "one line": (b"time_s" * (1 << 18), "over 1 MiB"),
    "damaged gzip": (gzip.compress((HEAD + NAMES + ROWS).encode())[:-8] + b"\0" * 7 + b"\1", "damaged"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_sentence(tmp_path: Path, case: str) -> None:
    content, expected = BAD[case]
    text = refused(put(tmp_path, content))
    assert expected in text
    assert text.startswith(str(tmp_path / "log.csv"))


def test_paths_that_are_no_file(tmp_path: Path) -> None:
    assert "no such file" in refused(tmp_path / "absent.csv")
    assert "is a folder where a log should be" in refused(tmp_path)
    assert "cannot be read" in refused(tmp_path / ("x" * 300))
    assert "cannot be read" in refused(put(tmp_path, "a") / "below")


def test_a_file_that_may_not_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def deny(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("builtins.open", deny)
    assert "may not be read; check its permissions" in refused(tmp_path / "log.csv")


def test_size_is_limited_before_the_memory_is(tmp_path: Path) -> None:
    bomb = put(tmp_path, gzip.compress(b"1,2\n" * (1 << 20)))
    with pytest.raises(InputError, match="holds over 1 MiB, too much for a log"):
        read_bytes(bomb, what="a log", limit=1 << 20)


def test_given_torque_constant_is_checked(tmp_path: Path) -> None:
    plain = put(tmp_path, "time_s,velocity_rad_s,current_a\n0,1,1\n")
    assert "torque_constant: the torque constant must be" in refused(plain, torque_constant=float("nan"))


@pytest.mark.parametrize("cut", range(1, len("1,0.02,0.2,1.5\n")))
def test_half_a_last_row_is_left_out(tmp_path: Path, cut: int) -> None:
    log = Log.read(put(tmp_path, (HEAD + NAMES + ROWS)[:-cut]))
    assert log.incomplete
    assert len(log.frame) == 2


def test_zeros_after_a_power_cut(tmp_path: Path) -> None:
    log = Log.read(put(tmp_path, (HEAD + NAMES + ROWS)[:-3].encode() + b"\0" * 4096))
    assert log.incomplete
    assert len(log.frame) == 2


def test_gzip_cut_short_loads_up_to_its_last_whole_row(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    rows = "".join(f"0,{k / 100},{rng.normal()},1\n" for k in range(5000))
    packed = gzip.compress((HEAD + NAMES + rows).encode())
    for share in (0.2, 0.5, 0.99):
        log = Log.read(put(tmp_path, packed[: int(share * len(packed))]))
        assert log.incomplete
        assert share - 0.15 < len(log.frame) / 5000 <= 1


def test_quoted_text_may_hold_commas_and_line_breaks(tmp_path: Path) -> None:
    start = HEAD + "time_s,velocity_rad_s,current_a,note\n" + '0,1,1,"a, ""b"",\nc"\n'
    log = Log.read(put(tmp_path, start + "1,1,1,d\n"))
    assert log.frame["note"].tolist() == ['a, "b",\nc', "d"]
    assert "line 9: column" in refused(put(tmp_path, start + "1,x,1,d\n"))


@SLOW
@given(
    rows=st.lists(st.tuples(FINITE, FINITE, FINITE), min_size=1, max_size=8),
    kind=st.sampled_from(["rotary", "linear"]),
    experiment=st.text(max_size=8),
    extra=st.dictionaries(st.text(max_size=6), st.text(max_size=8) | st.integers(-9, 9) | FINITE, max_size=3),
    notes=st.text(st.characters(codec="utf-8", exclude_characters="\0\r"), max_size=6),
)
def test_round_trip_is_exact(tmp_path, rows, kind, experiment, extra, notes) -> None:  # type: ignore[no-untyped-def]
    names = columns_of(kind)
    frame = pd.DataFrame(rows, columns=[names["position"], names["torque"], "other"])
    frame.insert(0, "time_s", np.arange(len(rows)) * 0.1)
    frame.insert(0, "trial", 0)
    frame["note"] = "n" + notes
    extra = {key: value for key, value in extra.items() if key not in ("ffc-id-log", "experiment", "axis")}
    log = Log(frame, Axis(kind, 2.5), experiment, extra)
    log.write(tmp_path / "log.csv", force=True)
    again = Log.read(tmp_path / "log.csv")
    assert list(again.frame.columns) == list(frame.columns)
    for name in frame.columns[:-1]:
        assert again.frame[name].to_numpy(float).tobytes() == frame[name].to_numpy(float).tobytes(), name
    assert again.frame["note"].tolist() == frame["note"].tolist()
    assert (again.axis, again.experiment, again.header) == (log.axis, experiment, extra)
    assert not again.incomplete


@SLOW
@given(rows=st.lists(st.tuples(FINITE, FINITE), min_size=1, max_size=8))
def test_writer_round_trip_is_exact(tmp_path, rows) -> None:  # type: ignore[no-untyped-def]
    table = np.column_stack([np.arange(len(rows)), np.array(rows)])
    with LogWriter(
        tmp_path / "w.csv", ["time_s", "velocity_rad_s", "torque_nm"], Axis(), "", force=True
    ) as writer:
        for row in table:
            writer.append(row[None, :])
    log = Log.read(tmp_path / "w.csv")
    assert log.frame.iloc[:, 1:].to_numpy(float).tobytes() == table.tobytes()


@SLOW
@given(content=st.binary(max_size=300))
def test_arbitrary_bytes_are_an_input_error_or_a_log(tmp_path, content) -> None:  # type: ignore[no-untyped-def]
    for data in (content, HEAD.encode() + NAMES.encode() + content, gzip.compress(content)[: len(content)]):
        with suppress(InputError):
            Log.read(put(tmp_path, data))


def test_a_whole_number_beyond_a_float_is_no_finite_one(tmp_path: Path) -> None:
    frame = Log.read(put(tmp_path, HEAD + NAMES + ROWS)).frame
    column = frame.columns[-1]
    frame[column] = [10**400, *frame[column].iloc[1:]]
    text = HEAD + frame.to_csv(index=False)
    with pytest.raises(InputError, match=rf'column "{column}" holds "10+", not a finite number'):
        Log.read(put(tmp_path, text))
    table = frame.rename(columns={column: "iq"}).assign(iq=lambda rows: rows["iq"].astype(object))
    assert np.isnan(to_numbers(table["iq"], "iq")).sum() == 1


@SLOW
@given(data=st.data())
def test_mangled_logs_are_an_input_error_or_a_log(tmp_path, data) -> None:  # type: ignore[no-untyped-def]
    text = bytearray((HEAD + NAMES + ROWS).encode())
    for _ in range(data.draw(st.integers(1, 6))):
        spot = data.draw(st.integers(0, len(text) - 1))
        text[spot : spot + data.draw(st.integers(0, 3))] = data.draw(
            st.sampled_from(
                [b"", b",", b"\n", b'"', b"#", b"\r", b"e9", b"-", b"\xff", b"=", b"[", b"0" * 400]
            )
        )
    with suppress(InputError):
        Log.read(put(tmp_path, bytes(text)))


def test_a_parameter_file_is_no_log(tmp_path: Path) -> None:
    (tmp_path / "params.toml").write_text('schema = "ffc-id/params/1"\n[axis]\nkind = "rotary"\n')
    with pytest.raises(InputError, match=r"params\.toml: is a TOML file and no log"):
        Log.read(tmp_path / "params.toml")


@pytest.mark.parametrize(
    ("before", "across", "after", "cut"),
    [
        (1.0, 20.0, 1.0, False),  # on and on
        (1.0, 0.0, 1.0, False),  # it stood meanwhile, for all that one knows
        (1.0, 0.0, -1.0, True),  # it turned round
        (-1.0, 0.0, 1.0, True),
        (1.0, -20.0, 1.0, True),  # it went back and came on again
        (0.1, 0.0, -1.0, False),  # too slow to say which way it went
    ],
)
def test_a_gap_that_hides_a_reversal_begins_a_trial(
    before: float, across: float, after: float, cut: bool
) -> None:
    """Steps of 1 mrad in 10 ms, and 0.2 s without a row."""
    way = np.cumsum(np.repeat([1.0, before, across, after, 1.0], [40, 6, 1, 6, 40]))
    moments = 0.01 * np.arange(len(way)) + 0.2 * (np.arange(len(way)) >= 46)
    found = gap_cuts(moments, np.arange(len(way)) == 0, 1e-3 * way, None)
    assert found.tolist() == [cut and k == 46 for k in range(len(way))]


@pytest.mark.parametrize("column", ["time_s", "position_rad", "torque_nm"])
def test_a_frame_with_a_reading_that_is_no_number_is_refused(column: str) -> None:
    """A file is asked when it is read; a frame of one's own was not, and a fit fell over it."""
    time = 0.01 * np.arange(600)
    frame = pd.DataFrame({"time_s": time, "position_rad": np.sin(time), "torque_nm": np.cos(time)})
    frame.loc[7, column] = np.nan
    with pytest.raises(InputError, match=r"row 8: 1 of its rows hold no number"):
        record([Log(frame.assign(trial=0), Axis("rotary"))])
