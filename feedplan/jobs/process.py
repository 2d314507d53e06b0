"""The process that works on jobs, one after the other.

It exchanges JSON with its parent, never pickled objects. The process ends when the connection is closed, and
stops its job at the next report of progress when it is told to.
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

from feedplan.jobs.order import Job, Order
from feedplan.jobs.outcome import Outcome
from feedplan.jobs.work import Stopped, paced, work_on
from feedplan.program.source import content_of

# Modules that most jobs need; the fork server imports them once. `__main__` is that of the command.
LOADED = (
    __name__,
    *("feedplan.__main__", "feedplan.machine.kinematics", "feedplan.planners.bang_bang"),
    *("feedplan.planners.jerk_limited", "feedplan.program.tip", "feedplan.report.page"),
)
LONGEST_MESSAGE = 1 << 24
STOP = b"stop"


def message_of(job: Job) -> bytes:
    """A job as a message to the process."""
    return json.dumps(
        {
            "order": job.order.text(),
            "program": str(job.program),
            "folder": str(job.folder),
            "tool_table": None if job.tool_table is None else str(job.tool_table),
            "subprograms": [str(folder) for folder in job.subprograms],
        }
    ).encode()


def main(connection: Connection, niceness: int) -> None:
    """Works on jobs until the connection is closed; sends the outcome of each."""
    _become_a_worker(niceness)
    parent = _Parent(connection)
    while True:
        outcome = _work_on(parent.next_job(), parent)
        parent.send({"outcome": outcome.text()})


def _work_on(message: dict[str, Any], parent: _Parent) -> Outcome:
    try:
        content = content_of(FilePath(message["program"])).content
    except Exception as error:
        return Outcome.of_error(error)
    return work_on(
        Order.of(message["order"]),
        content,
        FilePath(message["folder"]),
        parent.progress(),
        tool_table=None if message["tool_table"] is None else FilePath(message["tool_table"]),
        subprograms=[FilePath(folder) for folder in message["subprograms"]],
    )


def _become_a_worker(niceness: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Discards what solvers print.
    nothing = os.open(os.devnull, os.O_RDWR)
    for stream in range(3):
        os.dup2(nothing, stream)
    with suppress(OSError):
        os.nice(niceness)
    with suppress(OSError):  # Linux: if memory runs out, this process is killed, not its parent
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
            except (EOFError, OSError):  # the parent is gone: nothing here needs an orderly end
                os._exit(0)
            if message == STOP:
                self._stop.set()
            else:
                self._jobs.put(message)

    def next_job(self) -> dict[str, Any]:
        """Waits for the next job."""
        message: dict[str, Any] = json.loads(self._jobs.get())
        return message

    def send(self, message: dict[str, Any]) -> None:
        with suppress(OSError):
            self._connection.send_bytes(json.dumps(message).encode())

    def progress(self) -> Any:
        """A progress function for one job, which raises Stopped after the process was told to stop."""
        tell = paced(lambda stage, part: self.send({"stage": stage, "part": part}))

        def report(stage: str, part: float) -> None:
            if self._stop.is_set():
                raise Stopped
            tell(stage, part)

        return report
