"""Runs jobs in processes of this computer.

Each sequence of jobs has a process, started in about 10 ms from a fork server that has already loaded
feedplan. A job that is killed, or runs out of memory or time, ends only its process; the jobs after it get
another process. Processes share no pipe, because a killed process could keep the lock of a shared one.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import time
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing import forkserver, resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path as FilePath
from threading import Event

from feedplan.jobs import process as work
from feedplan.jobs.executor import MB, JobLimits, JobListener
from feedplan.jobs.order import Job
from feedplan.jobs.outcome import Outcome

# Time between two checks of a process, and the longest time for it to stop when told to [s].
EVERY, GRACE = 0.05, 2.0
_PAGE = os.sysconf("SC_PAGE_SIZE")


class Processes:
    """Runs `count` processes at a time with this `niceness`."""

    depth = 1

    def __init__(self, count: int, limits: JobLimits, niceness: int = 10, grace: float = GRACE) -> None:
        self._count, self._limits, self._niceness, self._grace = count, limits, niceness, grace
        self._context = multiprocessing.get_context("forkserver")
        self._context.set_forkserver_preload(list(work.LOADED))
        _start_fork_server()

    def slots(self) -> int:
        """See `Executor`."""
        return self._count

    def close(self) -> None:
        """See `Executor`."""

    def run(self, jobs: Sequence[Job], report: JobListener, stop: Event) -> list[Outcome]:
        """See `Executor`."""
        outcomes: list[Outcome] = []
        while len(outcomes) < len(jobs):
            if stop.is_set():
                outcomes += [Outcome("stopped")] * (len(jobs) - len(outcomes))
            else:
                self._in_a_process(jobs, outcomes, report, stop)
        return outcomes

    def _in_a_process(
        self, jobs: Sequence[Job], outcomes: list[Outcome], report: JobListener, stop: Event
    ) -> None:
        """Works on the jobs without an outcome in one process until it ends; adds at least one outcome."""
        own, other = self._context.Pipe()
        process = self._context.Process(target=work.main, args=(other, self._niceness), daemon=True)
        with own:
            try:
                process.start()
                other.close()
                while len(outcomes) < len(jobs) and not stop.is_set():
                    number = len(outcomes)
                    own.send_bytes(jobs[number].text().encode())
                    outcome, lives = self._look_after(process, own, number, report, stop)
                    outcomes.append(outcome)
                    if not lives:
                        return
            except (OSError, EOFError) as error:
                sentence = f"no process could be started ({error}): send it again"
                outcomes.append(Outcome.failed("worker", sentence))
            finally:
                if process.pid is not None:
                    process.kill()
                    process.join()

    def _look_after(
        self, process: BaseProcess, connection: Connection, number: int, report: JobListener, stop: Event
    ) -> tuple[Outcome, bool]:
        """The outcome of the job in the process, and whether the process can take another job."""
        limits, end = self._limits, time.monotonic() + self._limits.max_time
        problem: Outcome | None = None
        last: float | None = None
        while True:
            ready = wait([connection, process.sentinel], EVERY)
            if connection in ready:
                try:
                    message = json.loads(connection.recv_bytes(work.LONGEST_MESSAGE))
                except (EOFError, OSError):
                    process.join()
                    return problem or _ended(process), False
                if "outcome" in message:
                    outcome = Outcome.of(message["outcome"])
                    return (problem or outcome) if outcome.state == "stopped" else outcome, last is None
                report(number, message["stage"], message["part"])
            elif ready:
                process.join()
                return problem or _ended(process), False
            now = time.monotonic()
            if now > end and problem is None and not stop.is_set():
                problem = limits.over_time()
            if (used := memory_of(process.pid)) > limits.max_memory * MB:
                return limits.over_memory(used), False
            if last is None and (stop.is_set() or problem):
                last = now + self._grace
                with suppress(OSError):  # the process may have ended
                    connection.send_bytes(work.STOP)
            if last is not None and now > last:
                return problem or Outcome("stopped"), False


def _start_fork_server() -> None:
    """Starts the fork server with SIGINT blocked; its children inherit the mask. Ctrl-C in a terminal reaches
    all processes there, but only that of the command must answer it."""
    # Started first, because its start would unblock the signal.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        forkserver.ensure_running()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _ended(process: BaseProcess) -> Outcome:
    """The outcome of a job whose process ended without one."""
    how = process.exitcode
    cause = f"by the signal {-how}" if how is not None and how < 0 else "without a word"
    return Outcome.failed("worker", f"the process of the job was ended {cause}: send it again")


def memory_of(process: int | None) -> int:
    """The resident memory of a process [bytes]; 0 if the system does not provide it."""
    try:
        return int(FilePath(f"/proc/{process}/statm").read_text("ascii").split()[1]) * _PAGE
    except (OSError, IndexError, ValueError):
        return 0
