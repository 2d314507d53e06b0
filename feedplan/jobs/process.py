"""A process of its own that works on the jobs it is told, one after the other.

It and who has started it exchange JSON, never pickled objects. The process ends by itself when the line is
cut, and stops its job at the next word of progress when it is told to.
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
from feedplan.jobs.outcome import Outcome, failure_of
from feedplan.jobs.work import Pace, Stopped, work_on
from feedplan.program.source import content_of

# What most jobs import; the fork server has it before they begin. `__main__` is that of the command.
LOADED = (
    __name__,
    *("feedplan.__main__", "feedplan.machine.kinematics", "feedplan.planners.bang_bang"),
    *("feedplan.planners.jerk_limited", "feedplan.program.tip", "feedplan.report.page"),
)
LONGEST_MESSAGE = 1 << 24
STOP = b"stop"


def message_of(job: Job) -> bytes:
    """A job as the process is told it."""
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
    """Works on jobs until the line is cut; after each its outcome is told."""
    _become_a_worker(niceness)
    line = _Line(connection)
    while True:
        outcome = _work_on(line.next_job(), line)
        line.send({"outcome": outcome.text()})


def _work_on(told: dict[str, Any], line: _Line) -> Outcome:
    try:
        content = content_of(FilePath(told["program"])).content
    except Exception as error:
        return Outcome("failed", failure=failure_of(error))
    return work_on(
        Order.of(told["order"]),
        content,
        FilePath(told["folder"]),
        line.progress(),
        tool_table=None if told["tool_table"] is None else FilePath(told["tool_table"]),
        subprograms=[FilePath(folder) for folder in told["subprograms"]],
    )


def _become_a_worker(niceness: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # What solvers print goes nowhere.
    nothing = os.open(os.devnull, os.O_RDWR)
    for stream in range(3):
        os.dup2(nothing, stream)
    with suppress(OSError):
        os.nice(niceness)
    with suppress(OSError):  # Linux: this process, not who has started it, is ended where memory runs out
        FilePath("/proc/self/oom_score_adj").write_text("1000")


class _Line:
    """The line to who has started the process: jobs come, progress and outcomes go."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._jobs: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._stop = threading.Event()
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        while True:
            try:
                message = self._connection.recv_bytes(LONGEST_MESSAGE)
            except (EOFError, OSError):  # nothing of this process is worth an orderly end
                os._exit(0)
            if message == STOP:
                self._stop.set()
            else:
                self._jobs.put(message)

    def next_job(self) -> dict[str, Any]:
        """The next job, when it comes."""
        told: dict[str, Any] = json.loads(self._jobs.get())
        return told

    def send(self, message: dict[str, Any]) -> None:
        with suppress(OSError):
            self._connection.send_bytes(json.dumps(message).encode())

    def progress(self) -> Any:
        """Who is told of the progress of one job; raises Stopped when the process was told to stop."""
        pace = Pace(lambda stage, part: self.send({"stage": stage, "part": part}))

        def told(stage: str, part: float) -> None:
            if self._stop.is_set():
                raise Stopped
            pace.progress(stage, part)

        return told
