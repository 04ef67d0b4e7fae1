"""The live page: it shows what moves, and never holds the loop up."""

from __future__ import annotations

import json
import math
import re
import socket
import subprocess
import threading
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest

from idtool.errors import RigFault
from idtool.live.row import Row
from idtool.live.server import KEPT, Rows
from idtool.live.udp import UdpStream
from idtool.live.view import LiveView
from idtool.rig.opening import open_rig

from .support import PROGRAM, ffc_id

SERVO = Row("rotary", "current", 2.67)
_RECIPE = """schema = "ffc-id/recipe/1"
name = "short"
experiment = "sine"
period_s = 0.01
[[trials]]
kind = "sine"
frequency_hz = 0.5
amplitude_rad_s = 0.6
duration_s = 3.0
"""


def rows_of(address: str) -> list[list[float | None]]:
    """What a browser receives until the run is over."""
    with urllib.request.urlopen(address + "rows", timeout=20) as answer:
        text = answer.read().decode()
    assert text.rstrip().endswith("event: end\ndata: 0")
    return [row for line in text.splitlines() if line.startswith("data: [") for row in json.loads(line[6:])]


def test_a_browser_gets_the_page_and_the_rows() -> None:
    with LiveView(SERVO) as view:
        with urllib.request.urlopen(view.address, timeout=10) as answer:
            page = answer.read().decode()
        assert '["motor torque", "N m"]' in page
        assert "{{" not in page
        assert re.findall(r"(?:src|href)=.?https?:", page) == []
        for k in range(100):
            view.show(0.025 * k, 0.1 * k, 0.5)
            view.show(0.025 * k + 0.001, 0.0, 0.0)  # sooner than a screen can show it
        found: list[list[float | None]] = []
        listener = threading.Thread(target=lambda: found.extend(rows_of(view.address)))
        listener.start()
        time.sleep(0.3)
    listener.join(10)
    assert [row[0] for row in found] == pytest.approx([0.025 * k for k in range(100)])
    assert found[10] == [0.25, 1.0, 0.5, 1.335, None]


def test_a_server_that_does_not_read_costs_the_loop_nothing() -> None:
    view = LiveView(SERVO)
    view._server.send_signal(19)  # SIGSTOP: as slow as it gets
    began = time.perf_counter()
    for k in range(20_000):
        view.show(float(k), 0.0, 0.0)
    spent = time.perf_counter() - began
    view._server.send_signal(18)
    view.close()
    assert view.dropped > 1000
    assert spent / 20_000 < 1e-3


def test_a_server_that_died_is_no_matter() -> None:
    view = LiveView(Row("linear", "current", None))
    view._server.kill()
    view._server.wait()
    view.show(0.0, 0.0, 0.0)
    view.close()
    assert view.dropped == 1


def test_a_taken_port_is_told_before_anything_moves() -> None:
    with LiveView(SERVO) as view:
        port = int(view.address.rstrip("/").rpartition(":")[2])
        with pytest.raises(RigFault, match="port"):
            LiveView(SERVO, port=port)


def test_memory_is_bounded_and_a_late_browser_gets_the_newest() -> None:
    rows = Rows()
    for k in range(3 * KEPT):
        rows.add(str(k))
    last, fresh = rows.since(0)
    assert last == 3 * KEPT
    assert fresh[-1] == str(3 * KEPT - 1)
    assert len(fresh) <= KEPT


@pytest.fixture
def plotjuggler() -> Iterator[socket.socket]:
    """What receives datagrams, as PlotJuggler does."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(10.0)
        yield receiver


def test_a_datagram_holds_what_is_known_by_name(plotjuggler: socket.socket) -> None:
    with UdpStream(SERVO, plotjuggler.getsockname()) as stream:
        stream.show(1.25, 0.3, 0.1)
        stream.show(1.26, 0.3, 0.1, -0.05)
    first, second = (json.loads(plotjuggler.recv(1000)) for _ in range(2))
    assert first == {
        "timestamp": 1.25,
        "position_rad": 0.3,
        "current_a": 0.1,
        "motor_torque_nm": pytest.approx(0.267),
    }
    assert second == first | {"timestamp": 1.26, "hand_nm": -0.05}


def test_nobody_receives_and_the_loop_goes_on(plotjuggler: socket.socket) -> None:
    to = plotjuggler.getsockname()
    plotjuggler.close()
    with UdpStream(SERVO, to) as stream:
        began = time.perf_counter()
        for k in range(1000):
            stream.show(0.001 * k, 0.0, 0.0)
        assert time.perf_counter() - began < 1.0


def test_a_host_that_is_none_is_told_before_anything_moves() -> None:
    with pytest.raises(RigFault, match="no such host"):
        UdpStream(SERVO, ("no.such.host.invalid", 9870))


def test_what_a_rig_measures_is_named() -> None:
    """A servo that reports its duty shows volts, and no torque that nobody can know."""
    with open_rig("sim:sts3215", seed=0) as rig:
        row = Row.of(rig)
    assert row.names[1] == ("voltage", "V")
    assert row.values(0.1, 2.0, math.nan) == (0.1, 2.0, None, None)
    assert Row("linear", "voltage", 3.0).keys == ["position_m", "voltage_v", "motor_force_n", "hand_n"]


def test_every_sample_of_a_run_is_sent(tmp_path: Path, plotjuggler: socket.socket) -> None:
    (tmp_path / "short.toml").write_text(_RECIPE)
    host, port = plotjuggler.getsockname()
    words = [
        "run",
        "--recipe",
        "short.toml",
        "--rig",
        "sim:paper",
        "-o",
        "log.csv",
        "--live-udp",
        f"{host}:{port}",
    ]
    with subprocess.Popen([str(PROGRAM), *words], cwd=tmp_path, stderr=subprocess.DEVNULL) as run:
        rows = [json.loads(plotjuggler.recv(1000)) for _ in range(300)]
        assert run.wait(30) == 0
    times = [row["timestamp"] for row in rows]
    assert times == sorted(times)
    assert max(abs(row["motor_torque_nm"]) for row in rows) > 0.01


@pytest.mark.parametrize("wrong", ["9870", "host:", "host:0", "host:70000", ":9870"])
def test_an_address_that_is_none(wrong: str) -> None:
    ran = ffc_id("run-sine", "--rig", "sim:paper", "-o", "x.csv", "--live-udp", wrong)
    assert ran.returncode == 2
    assert "HOST:PORT" in ran.stderr


def test_a_run_of_the_real_program_is_shown(tmp_path: Path) -> None:
    """A simulated axis too, which waits for the clock: a browser needs the time to open."""
    (tmp_path / "short.toml").write_text(_RECIPE)
    words = ["run", "--recipe", "short.toml", "--rig", "sim:paper", "-o", "log.csv", "--live"]
    begun = time.monotonic()
    with subprocess.Popen(
        [str(PROGRAM), *words], cwd=tmp_path, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True
    ) as run:
        assert run.stderr is not None
        told = next(line for line in run.stderr if "live: " in line)
        found = rows_of(told.partition("live: ")[2].strip())
        run.stderr.read()
    assert run.returncode == 0
    assert time.monotonic() - begun > found[-1][0] - found[0][0]
    assert len(found) > 100
    assert all(row[4] is None for row in found)  # nobody's hand is known in a run
    assert any(abs(row[3] or 0.0) > 0.01 for row in found)
