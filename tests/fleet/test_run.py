"""A fleet on this machine: what is done, kept, done again, and what a failure leaves alone."""

from __future__ import annotations

import base64
import hashlib
import json
import re
import shutil
import threading
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
import pytest

from idtool.errors import InputError
from idtool.fleet import Options, engine, run_fleet
from idtool.fleet.page import _grid, page
from idtool.fleet.session import Task, find_sessions, identity, load
from idtool.fleet.summary import Fleet, SessionRow
from idtool.fleet.work import identify_session
from idtool.log import Log
from idtool.parameters import Parameters
from idtool.parameters.axis import Axis
from testbench.fleet import QUICK, session
from tests.fleet.doubles import broken, dies_of, pid_of

#: Of the session below.
OPTIONS = replace(QUICK, without=("torque_offset",), tolerance=3.0, axis=Axis(extra={"lever_m": 0.2}))


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A fleet of one session ("sessions") and its results ("out")."""
    folder = tmp_path_factory.mktemp("finished")
    session(folder / "sessions" / "A0_2026-01-01", seed=0)
    assert not run_fleet(folder / "sessions", folder / "out", OPTIONS, workers=1).failed
    return folder


@pytest.fixture
def fleet(finished: Path, tmp_path: Path) -> Path:
    """A copy of it, to be changed."""
    return Path(shutil.copytree(finished, tmp_path / "fleet"))


def test_failures_stop_no_other_and_what_is_done_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sessions = tmp_path / "sessions"
    session(sessions / "A_2026-01-01", seed=1)
    session(sessions / "dies", seed=2)
    broken(sessions / "bad")
    monkeypatch.setattr(engine, "identify_session", dies_of)
    told: list[str] = []
    fleet = run_fleet(sessions, tmp_path / "out", QUICK, workers=2, tell=told.append)
    rows = {row.session: row for row in fleet.sessions}
    assert list(rows) == ["A_2026-01-01", "bad", "dies"]
    assert (rows["A_2026-01-01"].error, rows["A_2026-01-01"].unit, rows["A_2026-01-01"].date) == (
        "", "A", "2026-01-01",
    )  # fmt: skip
    assert rows["bad"].error.startswith('bad/sine.csv: needs a column "current_a" or "torque_nm"')
    assert rows["dies"].error.startswith("dies: its process was killed, perhaps for lack of memory")
    assert [row.session for row in fleet.failed] == ["bad", "dies"]
    assert told[0] == "3 sessions on 2 processes"
    done = tmp_path / "out" / "sessions" / "A_2026-01-01"
    assert Parameters.read(done / "params.toml").static["coulomb"].value == pytest.approx(0.08, rel=0.1)
    assert str(tmp_path) not in (done / "params.toml").read_text()
    assert "A_2026-01-01/sine.csv" in (done / "params.toml").read_text()

    # the machine has its memory back, and somebody mends the bad log
    monkeypatch.undo()
    (sessions / "bad" / "sine.csv").unlink()
    (sessions / "bad").rmdir()
    session(sessions / "bad", seed=3)
    before = (done / "params.toml").stat().st_mtime_ns
    told.clear()
    fleet = run_fleet(sessions, tmp_path / "out", QUICK, workers=2, tell=told.append)
    assert told[:2] == ["1 of 3 sessions were done before", "2 sessions on 2 processes"]
    assert not fleet.failed
    assert (done / "params.toml").stat().st_mtime_ns == before

    # nothing has changed: no process is started
    told.clear()
    assert run_fleet(sessions, tmp_path / "out", QUICK, tell=told.append).sessions == fleet.sessions
    assert told == ["3 of 3 sessions were done before"]
    page = (tmp_path / "out" / "fleet.html").read_text()
    assert "3 of 3 identified, 3 units" in page
    assert "http" not in page.replace("http-equiv", "")
    table = pd.read_csv(tmp_path / "out" / "summary.csv")
    assert table["session"].tolist() == ["A_2026-01-01", "bad", "dies"]
    assert table["coulomb_nm"].to_numpy() == pytest.approx(0.08, rel=0.1)
    document = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert document["schema"] == "ffc-id/fleet/1"
    assert document["failed"] == []
    assert {line["key"]: line["units"] for line in document["parameters"]}["coulomb_nm"] == 3


def test_a_failure_leaves_no_result_of_an_earlier_run(fleet: Path) -> None:
    result = fleet / "out" / "sessions" / "A0_2026-01-01"
    assert (result / "params.toml").exists()
    (fleet / "sessions" / "A0_2026-01-01" / "sine.csv").write_text("nonsense\n")
    failed = run_fleet(fleet / "sessions", fleet / "out", OPTIONS, workers=1).failed
    assert [row.session for row in failed] == ["A0_2026-01-01"]
    assert sorted(path.name for path in result.iterdir()) == ["session.json"]


@pytest.mark.parametrize(
    "damage",
    [
        '{"schema": "ffc-id/fleet-session/1"}',
        *(pytest.param(one, marks=pytest.mark.long) for one in ("{", "[]", '{"schema": "other"}')),
    ],
)
def test_a_damaged_record_is_done_again(tmp_path: Path, damage: str) -> None:
    session(tmp_path / "sessions" / "A")
    record = tmp_path / "out" / "sessions" / "A" / "session.json"
    record.parent.mkdir(parents=True)
    record.write_text(damage)
    told: list[str] = []
    assert not run_fleet(tmp_path / "sessions", tmp_path / "out", QUICK, workers=1, tell=told.append).failed
    assert told[0] == "1 session on 1 process"


def task_of(name: str, *, unit: str = "", date: str = "", facts: str = "", folder: Path) -> Task:
    session(folder / name, unit=unit, date=date)
    if facts:
        (folder / name / "session.toml").write_text(facts)
    return load(folder / name, {})


@pytest.mark.parametrize(
    ("name", "header", "facts", "expected"),
    [
        ("A3_2026-03-01", ("", ""), "", ("A3", "2026-03-01")),
        ("2026-03-01-A3", ("", ""), "", ("A3", "2026-03-01")),
        ("2026-03-01", ("", ""), "", ("2026-03-01", "2026-03-01")),
        ("elbow", ("", ""), "", ("elbow", "")),
        ("elbow-20260301", ("", ""), "", ("elbow-20260301", "")),
        ("A3_2026-13-41", ("", ""), "", ("A3", "")),
        ("x", ("A3", "2026-03-01T10:00:00"), "", ("A3", "2026-03-01")),
        ("x_2020-01-01", ("A3", "2026-03-01"), 'unit = "B1"\ndate = 2026-05-01\n', ("B1", "2026-05-01")),
    ],
)
def test_whose_session_it_is_and_when(
    tmp_path: Path, name: str, header: tuple[str, str], facts: str, expected: tuple[str, str]
) -> None:
    task = task_of(name, unit=header[0], date=header[1], facts=facts, folder=tmp_path)
    unit, date = identity(task, [Log.read(tmp_path / name / "sine.csv")])
    assert (unit, date.isoformat() if date else "") == expected


@pytest.mark.parametrize(
    ("facts", "expected"),
    [
        ("unit = 3", "A/session.toml, unit: 3 is no unit; write unit"),
        ('date = "soon"', "A/session.toml, date: 'soon' is no date; write unit"),
        ("a = " + "[" * 9000, "A/session.toml: is not TOML (nested too deeply)"),
        ("a = " + "9" * 5000, "A/session.toml: is not TOML ("),
        ("colour = 1", "A/session.toml, colour: unknown key; known are date, unit"),
        ("unit", "A/session.toml: is not TOML ("),
    ],
)
def test_facts_that_cannot_be_used_fail_that_session(tmp_path: Path, facts: str, expected: str) -> None:
    outcome = identify_session(task_of("A", facts=facts, folder=tmp_path))
    assert outcome.row.error.startswith(expected)


def test_options_are_those_of_identify(fleet: Path) -> None:
    written = Parameters.read(fleet / "out" / "sessions" / "A0_2026-01-01" / "params.toml")
    assert written.provenance["without"] == ["torque_offset"]
    assert written.provenance["tolerance_percent"] == 3.0
    assert written.axis.extra["lever_m"] == 0.2
    told: list[str] = []
    run_fleet(fleet / "sessions", fleet / "out", OPTIONS, workers=1, tell=told.append)
    assert told == ["1 of 1 sessions were done before"]


def test_a_fingerprint_is_of_all_that_matters(tmp_path: Path) -> None:
    folder = session(tmp_path / "A")
    whole = load(folder, {"seed": 0}).fingerprint("1")
    assert load(folder, {"seed": 0}).fingerprint("1") == whole
    assert load(folder, {"seed": 1}).fingerprint("1") != whole
    assert load(folder, {"seed": 0}).fingerprint("2") != whole
    (folder / "session.toml").write_text('unit = "B"')
    assert load(folder, {"seed": 0}).fingerprint("1") != whole


def test_refusals(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such folder"):
        find_sessions(tmp_path / "absent")
    with pytest.raises(InputError, match=r"holds no folder with logs \(\*\.csv\)"):
        find_sessions(tmp_path)
    folder = session(tmp_path / "A")
    with pytest.raises(InputError, match="holds logs, but no folders with logs"):
        find_sessions(folder)
    with pytest.raises(InputError, match="is a file where a folder of sessions should be"):
        find_sessions(folder / "sine.csv")
    with pytest.raises(InputError, match="is the folder of sessions itself"):
        run_fleet(tmp_path, tmp_path, Options())


def test_a_process_serves_many_sessions_and_one_that_died_is_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for k in range(3):
        session(tmp_path / "sessions" / f"s{k}", seed=k)
    (tmp_path / "sessions" / "s1").rename(tmp_path / "sessions" / "s1-dies")
    monkeypatch.setattr(engine, "identify_session", pid_of)
    told: list[str] = []
    run_fleet(tmp_path / "sessions", tmp_path / "out", QUICK, workers=1, tell=told.append)
    first, died, last = (line.rpartition(" ")[2] for line in told[1:])
    assert first.isdigit()
    assert "killed" in told[2], died
    assert last.isdigit()
    assert first != last


def test_a_large_page_has_pages_and_a_search_and_short_tiles(tmp_path: Path) -> None:
    rows = [SessionRow(f"s{k:03d}", error="s: broken." if k < 50 else "", unit="A") for k in range(250)]
    html = page(Fleet(tuple(rows)), "many")
    assert html.count("data-failed") == 50
    assert html.count('<li class="bad">') == 9
    assert "and 42 more" in html
    script = re.search(r"<script>(.*)</script>", html, re.DOTALL)
    assert script is not None
    digest = base64.b64encode(hashlib.sha256(script[1].encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in html


def test_a_phone_reads_every_value_under_its_name(finished: Path) -> None:
    html = (finished / "out" / "fleet.html").read_text()
    assert html.count('<table class="stack') == html.count("<table") == 2
    cells = re.findall(r"<td[^>]*>", html)
    assert len(cells) > 9
    assert all(re.search('data-of="[^"]+"', cell) for cell in cells)
    assert re.search(
        r"\.stack [^{]*tr\[hidden\][^{]*\{ display: none; \}", html
    )  # rows of other pages stay away


def test_a_table_that_is_left_out_is_said(fleet: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without pyarrow there is no Parquet, and an old one would be of other sessions."""
    old = fleet / "out" / "summary.parquet"
    assert old.exists()
    monkeypatch.setattr("idtool.fleet.run.find_spec", lambda name: None)
    said: list[str] = []
    run_fleet(fleet / "sessions", fleet / "out", OPTIONS, tell=said.append)
    assert said[-1] == "summary.parquet is left out: it needs pyarrow (pip install 'ffc-id[parquet]')"
    assert not old.exists()


def test_a_process_that_died_is_gone_when_its_session_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "identify_session", pid_of)
    with engine.open_engine(None, 1) as local:
        assert local.submit(Task("lives", {}, b"", {})).result().row.error.isdigit()
        before = threading.active_count()
        with pytest.raises(BrokenProcessPool):
            local.submit(Task("dies", {}, b"", {})).result()
        assert threading.active_count() < before  # a thread left behind could fail at the program's end


def test_parameters_are_drawn_two_in_a_row() -> None:
    """So wide that forty units are told apart, and a phone scrolls little."""
    fleet: Any = SimpleNamespace(points=lambda key: None)
    lines: Any = [
        SimpleNamespace(key=key) for key in ("coulomb_nm", "viscous_nm_s_per_rad", "inertia.inertia_kg_m2")
    ]
    figure = _grid(fleet, lines, "Every parameter by unit", lambda *_: None, below=0.5)
    places = [panel.get_position() for panel in figure.axes if panel.get_visible()]
    assert [(round(at.x0, 2) < 0.5, at.y0 > 0.5) for at in places] == [
        (True, True),
        (False, True),
        (True, False),
    ]
