"""`ffc-id data` and `ffc-id plot`."""

from __future__ import annotations

import functools
import hashlib
import json
import re
import threading
from collections.abc import Iterator
from http.server import HTTPServer, SimpleHTTPRequestHandler
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io

from idtool.io.catalogue import Source, read_catalogue
from idtool.log import Log
from testbench.recordings import RECORDINGS

from .support import ffc_id

_MOST_BYTES = 1_000_000


@pytest.fixture
def source(tmp_path: Path) -> Iterator[str]:
    """The address of a server on this machine that serves a folder with one recording."""
    folder = tmp_path / "served"
    folder.mkdir()
    (folder / "run.csv").write_text("time_s,position_rad,torque_nm\n0,0,0.1\n0.01,0.1,0.1\n0.02,0.3,0.1\n")
    handler = functools.partial(SimpleHTTPRequestHandler, directory=str(folder))
    server = HTTPServer(("127.0.0.1", 0), handler)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    thread.join()
    server.server_close()


def test_the_session_that_comes_along_needs_no_network(tmp_path: Path) -> None:
    done = ffc_id("data", "get", "sample", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    files = sorted((tmp_path / "sample").glob("*.gz"))
    sums = (tmp_path / "sample" / "SHA256SUMS").read_text()
    assert sums.splitlines() == [f"{hashlib.sha256(f.read_bytes()).hexdigest()}  {f.name}" for f in files]
    assert [file.name.removesuffix(".csv.gz") for file in files] == ["gravity", "sine", "sweep", "validation"]
    assert sum(file.stat().st_size for file in files) < _MOST_BYTES
    assert {Log.read(file).experiment for file in files} >= {"gravity", "sweep", "sine"}
    assert "licence: MIT" in done.stderr
    command = done.stderr.splitlines()[-1]
    assert command.startswith("next: ffc-id identify sample/gravity.csv.gz sample/sweep.csv.gz")
    before = [(f, f.stat().st_mtime_ns) for f in files]
    assert ffc_id("data", "get", "sample", cwd=tmp_path).returncode == 0
    assert [(f, f.stat().st_mtime_ns) for f in files] == before
    files[0].write_bytes(b"changed")
    again = ffc_id("data", "get", "sample", cwd=tmp_path)
    assert again.returncode == 3
    assert "pass --force" in again.stderr
    assert files[0].read_bytes() == b"changed"


def test_every_recording_says_source_and_licence() -> None:
    known = read_catalogue().recordings
    document = json.loads(ffc_id("data", "list", "--json").stdout)
    assert set(document["recordings"]) == set(known)
    told = ffc_id("data", "list").stdout
    for name, entry in known.items():
        assert name in told
        assert entry.licence in told
        assert entry.page.startswith("https://") or name == "sample"
        if entry.elsewhere:
            assert entry.files == ()
            assert f"not fetched from here: {entry.elsewhere}" in told
        else:
            assert entry.next.split()[0] in ("identify", "import")
        for file in entry.files:
            assert file.url.startswith("https://")
            assert any(len(part) == 40 for part in file.url.split("/")), "the address holds no commit"
            assert f"{file.name}: SHA-256 {file.sum_in_words}" in told


def test_every_machine_that_the_page_names_is_listed() -> None:
    pages = [entry.page for entry in read_catalogue().recordings.values()]
    for recording in RECORDINGS:
        address = re.search(r"github\.com/\S+|nonlinearbenchmark\.org", recording.source)
        assert address is not None
        assert any(page.endswith(address[0]) for page in pages), recording.name


def test_what_is_not_fetched_says_why_and_where_it_is(tmp_path: Path) -> None:
    done = ffc_id("data", "get", "ur10e", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (3, "")
    entry = read_catalogue().get("ur10e")
    assert done.stderr.splitlines()[-1] == (
        f"ffc-id: {entry.page}: is not fetched from here: {entry.elsewhere}; see there."
    )
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("told", "words"),
    [
        ({}, "none published; that of your first download is kept"),
        ({"sha256": "ab"}, "ab (of our first copy; none is published)"),
        ({"sha256": "ab", "published": True}, "ab"),
    ],
)
def test_whose_checksum_it_is_is_said(told: dict[str, Any], words: str) -> None:
    assert Source(url="https://a.b/c", name="c", **told).sum_in_words == words


def test_a_public_recording_is_fetched_and_its_sum_shown(tmp_path: Path, source: str) -> None:
    content = (tmp_path / "served" / "run.csv").read_bytes()
    checksum = hashlib.sha256(content).hexdigest()
    (tmp_path / "mine.toml").write_text(
        'schema = "ffc-id/catalogue/1"\n[recordings.mine]\ntitle = "an axis"\nby = "me"\nlicence = "CC0"\n'
        f'next = "import mine/run.csv -o log.csv"\nfiles = [{{name = "run.csv", url = "{source}/run.csv"}}]\n'
    )
    done = ffc_id("data", "get", "mine", "--catalogue", "mine.toml", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert f"SHA-256 {checksum}" in done.stdout
    assert f"from {source}/run.csv" in done.stderr
    assert "licence: CC0" in done.stderr
    assert (tmp_path / "mine" / "run.csv").read_bytes() == content
    words = done.stderr.splitlines()[-1].removeprefix("next: ffc-id ").split()
    assert ffc_id(*words, cwd=tmp_path).returncode == 0
    # the sum of the first download holds: what changed at its source is refused, and the file here stays
    (tmp_path / "served" / "run.csv").write_bytes(content.replace(b"0.1", b"0.2"))
    again = ffc_id("data", "get", "mine", "--catalogue", "mine.toml", "--force", cwd=tmp_path)
    assert again.returncode == 3
    assert "is not the file that was expected" in again.stderr
    assert (tmp_path / "mine" / "run.csv").read_bytes() == content
    assert Log.read(tmp_path / "log.csv").frame["torque_nm"].tolist() == [0.1, 0.1, 0.1]


def test_of_several_files_those_that_came_stay_when_one_fails(tmp_path: Path, source: str) -> None:
    (tmp_path / "mine.toml").write_text(
        'schema = "ffc-id/catalogue/1"\n[recordings.two]\ntitle = "an axis"\nby = "me"\nlicence = "CC0"\n'
        f'next = "import two/run.csv -o log.csv"\nfiles = [{{name = "run.csv", url = "{source}/run.csv"}}, '
        f'{{name = "later.csv", url = "{source}/later.csv"}}]\n'
    )
    command = ("data", "get", "two", "--catalogue", "mine.toml", "--json")
    first = ffc_id(*command, cwd=tmp_path)
    assert (first.returncode, first.stdout) == (3, "")
    assert "later.csv: the server answers 404" in first.stderr
    written = (tmp_path / "two" / "run.csv").stat().st_mtime_ns
    (tmp_path / "served" / "later.csv").write_text("time_s\n0\n")
    again = ffc_id(*command, cwd=tmp_path)
    assert again.returncode == 0, again.stderr
    assert list(json.loads(again.stdout)["files"]) == ["two/run.csv", "two/later.csv"]
    assert (tmp_path / "two" / "run.csv").stat().st_mtime_ns == written


def test_the_import_of_a_servo_reads_duty_and_supply(tmp_path: Path) -> None:
    """What `data get xl330` tells to do next, on a file with the keys of the real one."""
    entries = [
        {"position": 0.01 * k, "speed": 1.0, "load": 65536 - k, "input_volts": 7.3, "temp": 28,
         "timestamp": 0.01 * k, "goal_position": 0.0, "torque_enable": True}
        for k in range(1, 50)
    ]  # fmt: skip
    run = {"mass": 0.49, "length": 0.1, "kp": 100, "vin": 7.4, "motor": "xl330", "trajectory": "sin_sin"}
    (tmp_path / "xl330").mkdir()
    (tmp_path / "xl330" / "sin_sin.json").write_text(json.dumps({**run, "entries": entries}))
    done = ffc_id(*read_catalogue().get("xl330").next.split(), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    log = Log.read(tmp_path / "sin_sin.csv")
    assert {"duty", "supply_voltage_v"} <= set(log.frame)
    assert log.frame["duty"].iloc[0] == pytest.approx(-1 / 885)


def test_the_import_of_the_benchmark_reads_its_variables(tmp_path: Path) -> None:
    """What `data get emps` tells to do next, on a file with the variables of the real one."""
    (tmp_path / "emps").mkdir()
    time = 1e-3 * np.arange(200.0)
    variables = {"t": time, "qm": 0.01 * time**2, "qg": 0.01 * time**2, "vir": 1.0 + time, "gtau": 35.15}
    scipy.io.savemat(tmp_path / "emps" / "DATA_EMPS.mat", variables)
    done = ffc_id(*read_catalogue().get("emps").next.split(), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    log = Log.read(tmp_path / "emps.csv")
    assert log.axis.kind == "linear"
    np.testing.assert_allclose(log.frame["force_n"], 35.15065188248547 * (1.0 + time), rtol=1e-6)


def test_what_a_catalogue_lacks_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text('schema = "ffc-id/catalogue/1"\n[recordings.x]\ntitle = 3\n')
    for words, code, expected in (
        (["get", "emsp"], 2, 'did you mean "emps"?'),
        (["get", "x", "--catalogue", "bad.toml"], 3, "bad.toml: is no catalogue"),
        (["list", "--catalogue", "no.toml"], 3, "no.toml: no such file"),
        (["fetch"], 2, 'no command "fetch"'),
    ):
        done = ffc_id("data", *words, cwd=tmp_path)
        assert (done.returncode, done.stdout) == (code, "")
        assert expected in done.stderr
        assert done.stderr.count("\n") == 1


def test_plot_draws_a_log_before_any_fit(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text(
        "trial,time_s,position_rad,torque_nm\n0,0,0,0.1\n0,0.01,0.1,0.1\n1,0.1,0.3,-0.1\n1,0.11,0.2,-0.1\n"
    )
    done = ffc_id("plot", "run.csv", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, "figure: run.png\n"), done.stderr
    assert (tmp_path / "run.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert ffc_id("plot", "run.csv", "-o", "run.svg", cwd=tmp_path).returncode == 0
    assert b"Torque, N m" in (tmp_path / "run.svg").read_bytes()
    again = ffc_id("plot", "run.csv", cwd=tmp_path)
    assert (again.returncode, again.stdout) == (3, "")
