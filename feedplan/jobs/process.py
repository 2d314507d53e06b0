"""The process that runs jobs, one after the other.

It exchanges JSON with its parent, never pickled objects. The process ends when the connection is closed; if
told to stop, it ends its job at the job's next report of progress.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import threading
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path as FilePath
from typing import Any

from feedplan.jobs.order import Job
from feedplan.jobs.work import Stopped, paced, work_on
from feedplan.progress import Progress

# Modules that most jobs need; the fork server imports them once. `feedplan.__main__` is the command's.
LOADED = (
    __name__,
    *("feedplan.__main__", "feedplan.machine.kinematics", "feedplan.planners.bang_bang"),
    *("feedplan.planners.jerk_limited", "feedplan.program.tip", "feedplan.report.page"),
)
LONGEST_MESSAGE = 1 << 24
STOP = b"stop"


def main(connection: Connection, niceness: int) -> None:
    """Works on jobs until the connection is closed; sends the outcome of each."""
    _become_a_worker(niceness)
    parent = _Parent(connection)
    while True:
        outcome = work_on(parent.next_job(), parent.progress())
        parent.send({"outcome": outcome.text()})


def _become_a_worker(niceness: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Discards what solvers print.
    nothing = os.open(os.devnull, os.O_RDWR)
    for stream in range(3):
        os.dup2(nothing, stream)
    with suppress(OSError):
        os.nice(niceness)
    with suppress(OSError):  # Linux: if memory runs out, this process is killed instead of its parent
        FilePath("/proc/self/oom_score_adj").write_text("1000")


class _Parent:
    """The connection to the parent: receives jobs, sends progress and outcomes."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._jobs: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._stop = threading.Event()
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        while True:
            try:
                message = self._connection.recv_bytes(LONGEST_MESSAGE)
            except (EOFError, OSError):  # the parent has ended: there is nothing to clean up
                os._exit(0)
            if message == STOP:
                self._stop.set()
            else:
                self._jobs.put(message)

    def next_job(self) -> Job:
        """Waits for the next job."""
        return Job.of(self._jobs.get())

    def send(self, message: dict[str, Any]) -> None:
        with suppress(OSError):
            self._connection.send_bytes(json.dumps(message).encode())

    def progress(self) -> Progress:
        """A progress function for one job, which raises Stopped after the process was told to stop."""
        tell = paced(lambda stage, part: self.send({"stage": stage, "part": part}))

        def report(stage: str, part: float) -> None:
            if self._stop.is_set():
                raise Stopped
            tell(stage, part)

        return report
