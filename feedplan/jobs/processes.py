"""Jobs in processes of this computer.

A process for each sequence of jobs, from a fork server that has feedplan loaded (some 10 ms): a job that is
killed, or runs out of memory or time, takes nothing with it but its process, the jobs after it get another
one, and no pipe is shared whose lock a killed process could keep.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import time
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing import forkserver
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path as FilePath
from threading import Event

from feedplan.jobs import process as work
from feedplan.jobs.order import Job
from feedplan.jobs.outcome import Outcome
from feedplan.jobs.place import MB, JobLimits, Told

# How often a process is looked after [s], and how long it may take to stop when it is told to.
EVERY, GRACE = 0.05, 2.0
_PAGE = os.sysconf("SC_PAGE_SIZE")


class Processes:
    """`count` processes at a time; the system hands them time later than others by `niceness`."""

    depth = 1

    def __init__(self, count: int, limits: JobLimits, niceness: int = 10, grace: float = GRACE) -> None:
        self._count, self._limits, self._niceness, self._grace = count, limits, niceness, grace
        self._context = multiprocessing.get_context("forkserver")
        self._context.set_forkserver_preload(list(work.LOADED))
        forkserver.ensure_running()

    def slots(self) -> int:
        """See `Place`."""
        return self._count

    def close(self) -> None:
        """See `Place`."""

    def run(self, jobs: Sequence[Job], told: Told, stop: Event) -> list[Outcome]:
        """See `Place`."""
        outcomes: list[Outcome] = []
        while len(outcomes) < len(jobs):
            if stop.is_set():
                outcomes += [Outcome("stopped")] * (len(jobs) - len(outcomes))
            else:
                self._in_a_process(jobs, outcomes, told, stop)
        return outcomes

    def _in_a_process(self, jobs: Sequence[Job], outcomes: list[Outcome], told: Told, stop: Event) -> None:
        """Works on the jobs that have no outcome; adds one at least, and as many as the process lives."""
        own, other = self._context.Pipe()
        process = self._context.Process(target=work.main, args=(other, self._niceness), daemon=True)
        with own:
            try:
                process.start()
                other.close()
                while len(outcomes) < len(jobs) and not stop.is_set():
                    number = len(outcomes)
                    own.send_bytes(work.message_of(jobs[number]))
                    outcome, lives = self._look_after(process, own, number, told, stop)
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
        self, process: BaseProcess, connection: Connection, number: int, told: Told, stop: Event
    ) -> tuple[Outcome, bool]:
        """What became of the job that the process works on, and whether the process is good for another."""
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
                told(number, message["stage"], message["part"])
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
                with suppress(OSError):  # it may have ended
                    connection.send_bytes(work.STOP)
            if last is not None and now > last:
                return problem or Outcome("stopped"), False


def _ended(process: BaseProcess) -> Outcome:
    """What a process leaves that ended without an outcome."""
    how = process.exitcode
    signal = f"by the signal {-how}" if how is not None and how < 0 else "without a word"
    return Outcome.failed("worker", f"the process of the job was ended {signal}: send it again")


def memory_of(process: int | None) -> int:
    """What a process has in memory [bytes]; 0 where the system does not tell."""
    try:
        return int(FilePath(f"/proc/{process}/statm").read_text("ascii").split()[1]) * _PAGE
    except (OSError, IndexError, ValueError):
        return 0
