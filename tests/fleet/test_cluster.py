"""A fleet on a Dask cluster of real processes, one of which is killed at work."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner
from idtool.cli.fleet import fleet as fleet_command

from idtool.errors import InputError
from idtool.fleet import run_fleet, scheduler
from testbench.fleet import QUICK, session
from tests.fleet.doubles import broken

distributed = pytest.importorskip("distributed", reason="the extra [fleet] is not installed")


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Callable[[int], str]]:
    """Starts a scheduler and so many workers of one thread; gives the address."""
    file = tmp_path / "scheduler.json"
    with ExitStack() as running:

        def start(part: str, *arguments: str) -> None:
            process = subprocess.Popen(
                [sys.executable, "-m", f"distributed.cli.dask_{part}", *arguments, "--no-dashboard"],
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                cwd=tmp_path,
            )
            running.callback(process.wait)
            running.callback(process.kill)

        def begin(workers: int) -> str:
            start("scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file))
            for _ in range(workers):
                start("worker", "--scheduler-file", str(file), "--nthreads", "1", "--no-nanny")
            for _ in range(600):
                if file.exists():
                    break
                time.sleep(0.1)
            with distributed.Client(scheduler_file=str(file), set_as_default=False) as client:
                if workers:
                    client.wait_for_workers(workers, timeout=60)
                return str(client.scheduler.address)

        yield begin


def test_a_worker_killed_at_work_costs_nothing(tmp_path: Path, cluster: Callable[[int], str]) -> None:
    sessions = tmp_path / "sessions"
    for k in range(3):
        session(sessions / f"A{k}_2026-01-0{k + 1}", coulomb=0.08 + 0.002 * k, seed=k)
    broken(sessions / "bad")
    address = cluster(2)
    killed: list[str] = []

    def kill_one(_: str) -> None:
        """Once a session is under way on a worker, kill that worker."""
        with distributed.Client(address, set_as_default=False) as client:
            busy = [worker for worker, tasks in client.processing().items() if tasks]
            if not killed and busy:
                pids = client.run(os.getpid)
                os.kill(pids[busy[0]], signal.SIGKILL)
                killed.append(busy[0])

    fleet = run_fleet(sessions, tmp_path / "out", QUICK, scheduler=address, tell=kill_one)
    assert len(killed) == 1
    with distributed.Client(address, set_as_default=False) as client:
        left = client.run(os.getpid)
        assert len(left) == 1
        assert killed[0] not in left
    assert [row.session for row in fleet.failed] == ["bad"]
    values = {line.key: line for line in fleet.parameters}["coulomb_nm"]
    assert (values.units, values.sessions) == (3, 3)
    assert values.median == pytest.approx(0.082, rel=0.1)
    for k in range(3):
        assert (tmp_path / "out" / "sessions" / f"A{k}_2026-01-0{k + 1}" / "params.toml").exists()


def test_a_scheduler_that_dies_is_said_and_finished_sessions_are_kept(
    tmp_path: Path, cluster: Callable[[int], str]
) -> None:
    sessions = tmp_path / "sessions"
    for k in range(3):
        session(sessions / f"A{k}", seed=k)
    address = cluster(1)

    def kill(said: str) -> None:
        if said.startswith("[1/3]"):
            with distributed.Client(address, set_as_default=False) as client:
                pid = client.run_on_scheduler(os.getpid)
            os.kill(pid, signal.SIGKILL)

    with pytest.raises(InputError, match="the cluster went away; start it and run the command again"):
        run_fleet(sessions, tmp_path / "out", QUICK, scheduler=address, tell=kill)
    told: list[str] = []
    assert not run_fleet(sessions, tmp_path / "out", QUICK, workers=1, tell=told.append).failed
    assert told[0] == "1 of 3 sessions were done before"


def test_no_cluster_and_no_workers(
    tmp_path: Path, cluster: Callable[[int], str], monkeypatch: pytest.MonkeyPatch
) -> None:
    session(tmp_path / "sessions" / "A")
    for module in ("scheduler", "engine"):
        monkeypatch.setattr(f"idtool.fleet.{module}.PATIENCE_S", 2.0)
    with socket.create_server(("127.0.0.1", 0)) as silent:  # accepts, and never says a word
        mute = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        for address in ("tcp://127.0.0.1:1", "nonsense://x", "nonsense", mute):
            with pytest.raises(InputError, match="--scheduler: no Dask scheduler answers at"):
                run_fleet(tmp_path / "sessions", tmp_path / "out", QUICK, scheduler=address)
    with pytest.raises(InputError, match="has no workers; start dask worker"):
        run_fleet(tmp_path / "sessions", tmp_path / "out", QUICK, scheduler=cluster(0))


@pytest.mark.parametrize(("imported_after", "left"), [(0.0, 10.0), (7.5, 2.5), (30.0, 2.0)])
def test_what_dask_takes_to_import_is_part_of_the_patience(
    monkeypatch: pytest.MonkeyPatch, imported_after: float, left: float
) -> None:
    instants, allowed = iter([0.0, imported_after]), []

    async def greeted(_: str, within: float) -> None:
        allowed.append(within)

    monkeypatch.setattr(scheduler, "time", SimpleNamespace(monotonic=lambda: next(instants)))
    monkeypatch.setattr(scheduler, "_greeted", greeted)
    assert scheduler.greet("tcp://127.0.0.1:8786") == scheduler.Greeted(
        "tcp://127.0.0.1:8786", distributed.Client
    )
    assert allowed == [left]


def test_the_command_greets_once(
    tmp_path: Path, cluster: Callable[[int], str], monkeypatch: pytest.MonkeyPatch
) -> None:
    session(tmp_path / "sessions" / "A")
    address, asked = cluster(1), []
    greeted = scheduler._greeted

    async def counted(at: str, within: float) -> None:
        asked.append(at)
        await greeted(at, within)

    monkeypatch.setattr(scheduler, "_greeted", counted)
    words = [str(tmp_path / "sessions"), "-o", str(tmp_path / "out"), "--friction", "coulomb", "-q"]
    done = CliRunner().invoke(fleet_command, [*words, "--scheduler", address])
    assert done.exit_code == 0, done.output
    assert asked == [address]
    assert (tmp_path / "out" / "fleet.html").exists()
