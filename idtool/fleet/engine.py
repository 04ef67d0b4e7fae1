"""Who does the work: processes of this machine, or the workers of a Dask cluster.

Both are `concurrent.futures` executors from here on. A process that dies takes its own session with it
and no other: on this machine because every session has a process to itself, on a cluster because Dask
gives the session to another worker.
"""

from __future__ import annotations

import asyncio
import gzip
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass, replace
from multiprocessing import resource_tracker
from typing import Any

from idtool.errors import InputError
from idtool.fleet.session import Task
from idtool.fleet.work import Outcome, identify_session, version
from idtool.io.defer_signals import deferred_signals
from idtool.presentation.text import counted

_START_TIMEOUT_S = 10
_POLL_S = 0.1
_REMEDY = "start it with dask scheduler and dask worker, and check the address"


@dataclass(frozen=True)
class Engine:
    """Something that identifies sessions.

    Attributes:
        submit: hand over a session.
        width: how many sessions it should hold at a time; more would only wait with their logs in memory.
        name: as people call it.
    """

    submit: Callable[[Task], Future[Outcome]]
    width: int
    name: str


def processors() -> int:
    """How many processors this program may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def open_engine(scheduler: str | None, workers: int | None) -> Iterator[Engine]:
    """The cluster at `scheduler`, or else `workers` processes of this machine (all processors)."""
    with _cluster(scheduler) if scheduler else _local(workers or processors()) as engine:
        yield engine


@contextmanager
def _local(workers: int) -> Iterator[Engine]:
    threads = ThreadPoolExecutor(workers, initializer=_deaf)
    running: set[Future[Outcome]] = set()

    def submit(task: Task) -> Future[Outcome]:
        running.add(future := threads.submit(_alone, task))
        future.add_done_callback(running.discard)
        return future

    try:
        yield Engine(submit, workers, counted(workers, "process", "processes"))
    except BaseException:  # interrupted, for one: nobody waits for sessions that nobody keeps
        with deferred_signals():
            threads.shutdown(wait=False, cancel_futures=True)
            while running:  # a thread may be starting its process just now
                for process in multiprocessing.active_children():
                    process.terminate()
                wait(running, _POLL_S)
        raise
    finally:
        threads.shutdown()


def _alone(task: Task) -> Outcome:
    """In a process of its own: whatever kills it kills no other."""
    # not forked: threads of this process may hold locks at any moment
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as process:
        return process.submit(identify_session, task).result()


def _deaf() -> None:
    """Ctrl-C and a closed terminal are for the main thread: what is started here inherits that."""
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGHUP})
        resource_tracker.ensure_running()  # what starts it later would undo the next line
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


@contextmanager
def _cluster(address: str) -> Iterator[Engine]:
    try:
        import distributed
    except ImportError as error:
        raise InputError(
            "a Dask cluster needs the package distributed", remedy="pip install 'ffc-id[fleet]'"
        ) from error
    connect: Any = distributed.Client  # distributed is typed in parts only
    try:
        asyncio.run(_greeted(address))
        client = connect(address, timeout=_START_TIMEOUT_S, set_as_default=False)
    except Exception as error:  # whatever another kind of server says, or its silence
        raise InputError(
            f"no Dask scheduler answers at {address}", place="--scheduler", remedy=_REMEDY
        ) from error
    with client:
        cores = _check_workers(client, address)
        executor = client.get_executor(pure=False)
        try:
            yield Engine(
                lambda task: executor.submit(identify_session, _packed(task)),
                2 * cores,
                f"the cluster at {address} ({counted(cores, 'thread')})",
            )
        finally:
            executor.shutdown(wait=False)  # which cancels what is not done


async def _greeted(address: str) -> None:
    """Ask who is there: the client itself waits without end for one that accepts and says nothing."""
    from distributed.core import rpc

    ask: Any = rpc
    async with asyncio.timeout(_START_TIMEOUT_S), ask(address) as scheduler:
        await scheduler.identity()


def _packed(task: Task) -> Task:
    """The session as it goes over the network; a log is read gzipped or not."""
    return replace(task, logs={name: gzip.compress(content, 1) for name, content in task.logs.items()})


def _check_workers(client: Any, address: str) -> int:
    """How many threads the cluster has, all of them with this version of the package."""
    try:
        client.wait_for_workers(1, timeout=_START_TIMEOUT_S)
        found: dict[str, str] = client.run(version)
        cores = int(sum(client.ncores().values()))
    except TimeoutError as error:
        raise InputError(
            f"the cluster at {address} has no workers", place="--scheduler", remedy="start dask worker"
        ) from error
    except Exception as error:  # what a worker raises that lacks the package is its own affair
        raise InputError(
            f"the workers of {address} cannot run ffc-id ({type(error).__name__})",
            place="--scheduler",
            remedy="install ffc-id in their environment",
        ) from error
    other = {worker: one for worker, one in found.items() if one != version()}
    if other:
        worker, one = next(iter(other.items()))
        raise InputError(
            f"worker {worker} has ffc-id {one}, this is {version()}",
            place="--scheduler",
            remedy="install one version everywhere",
        )
    return max(cores, 1)
