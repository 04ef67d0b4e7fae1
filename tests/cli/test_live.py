"""The live page: it shows what moves, and never holds the loop up."""

from __future__ import annotations

import json
import re
import subprocess
import threading
import time
import urllib.request
from pathlib import Path

import pytest

from idtool.errors import RigFault
from idtool.live.server import KEPT, Rows
from idtool.live.view import LiveView

from .support import PROGRAM

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
    with LiveView("rotary", 2.67) as view:
        with urllib.request.urlopen(view.address, timeout=10) as answer:
            page = answer.read().decode()
        assert '"torque": "N m"' in page
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
    view = LiveView("rotary", 2.67)
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
    view = LiveView("linear", None)
    view._server.kill()
    view._server.wait()
    view.show(0.0, 0.0, 0.0)
    view.close()
    assert view.dropped == 1


def test_a_taken_port_is_told_before_anything_moves() -> None:
    with LiveView("rotary", 1.0) as view:
        port = int(view.address.rstrip("/").rpartition(":")[2])
        with pytest.raises(RigFault, match="port"):
            LiveView("rotary", 1.0, port=port)


def test_memory_is_bounded_and_a_late_browser_gets_the_newest() -> None:
    rows = Rows()
    for k in range(3 * KEPT):
        rows.add(str(k))
    last, fresh = rows.since(0)
    assert last == 3 * KEPT
    assert fresh[-1] == str(3 * KEPT - 1)
    assert len(fresh) <= KEPT


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
