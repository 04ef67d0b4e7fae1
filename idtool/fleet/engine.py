"""Who does the work: processes of this machine, or the workers of a Dask cluster.

Both are `concurrent.futures` executors from here on. A process that dies takes its own session with it
and no other: on this machine because a process works at one session at a time and the next one gets a new
process, on a cluster because Dask gives the session to another worker.
"""

from __future__ import annotations

import gzip
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, replace
from multiprocessing import resource_tracker
from typing import Any

from idtool.errors import InputError
from idtool.fleet.scheduler import PATIENCE_S, Greeted, greet, no_scheduler
from idtool.fleet.session import Task
from idtool.fleet.work import Outcome, identify_session, version
from idtool.io.defer_signals import deferred_signals
from idtool.presentation.text import counted

#: How often an interrupt is looked for while sessions run, s.
_POLL_S = 0.1
#: After so many sessions a process is replaced.
_SESSIONS = 200


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
def open_engine(scheduler: str | Greeted | None, workers: int | None) -> Iterator[Engine]:
    """The cluster at `scheduler`, or else `workers` processes of this machine (all processors)."""
    greeted = greet(scheduler) if isinstance(scheduler, str) else scheduler
    with _cluster(greeted) if greeted else _local(workers or processors()) as engine:
        yield engine


@contextmanager
def _local(workers: int) -> Iterator[Engine]:
    threads = ThreadPoolExecutor(workers, initializer=_deaf)
    running: set[Future[Outcome]] = set()
    processes = _Processes()

    def submit(task: Task) -> Future[Outcome]:
        running.add(future := threads.submit(processes.identify, task))
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
        processes.close()


class _Processes:
    """A process for each thread that asks, kept from session to session: its imports cost more than a short
    session. It is replaced when it dies, and after `_SESSIONS` so that its memory stays bounded."""

    def __init__(self) -> None:
        self._own = threading.local()
        self._all: list[ProcessPoolExecutor] = []

    def identify(self, task: Task) -> Outcome:
        """In the process of this thread, which works at nothing else: whatever kills it kills no other."""
        process: ProcessPoolExecutor | None = getattr(self._own, "process", None)
        if process is None:
            process = self._own.process = new_process()
            self._all.append(process)
        try:
            return process.submit(identify_session, task).result()
        except BrokenProcessPool:
            self._own.process = None
            self._all.remove(process)
            process.shutdown()  # a thread of it left behind may fail as the program ends
            raise

    def close(self) -> None:
        """End the processes."""
        for process in self._all:
            process.shutdown()


def new_process() -> ProcessPoolExecutor:
    """A process to work in, which ends when this program does, however that ends."""
    # not forked: threads of this program may hold locks at any moment
    context = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(
        1, mp_context=context, initializer=_end_with_parent, max_tasks_per_child=_SESSIONS
    )


def _end_with_parent() -> None:
    """A worker of a program that was killed outright would wait for work without end."""
    parent = multiprocessing.parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _deaf() -> None:
    """Ctrl-C and a closed terminal are for the main thread: what is started here inherits that."""
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGHUP})
        resource_tracker.ensure_running()  # what starts it later would undo the next line
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


@contextmanager
def _cluster(scheduler: Greeted) -> Iterator[Engine]:
    address = scheduler.address
    try:
        client = scheduler.client(address, timeout=PATIENCE_S, set_as_default=False)
    except Exception as error:  # it went away after its greeting, for one
        raise no_scheduler(address) from error
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


def _packed(task: Task) -> Task:
    """The session as it goes over the network; a log is read gzipped or not."""
    return replace(task, logs={name: gzip.compress(content, 1) for name, content in task.logs.items()})


def _check_workers(client: Any, address: str) -> int:
    """How many threads the cluster has, all of them with this version of the package."""
    try:
        client.wait_for_workers(1, timeout=PATIENCE_S)
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
