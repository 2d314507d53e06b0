"""Runs jobs in a worker of a cluster: the same work as in a process, with files that are sent both ways."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

from feedplan.jobs.executor import JobLimits
from feedplan.jobs.identity import identity
from feedplan.jobs.order import Job, Order
from feedplan.jobs.outcome import Outcome
from feedplan.jobs.work import Stopped, paced, work_on

TOPIC = "feedplan"


@dataclass(frozen=True)
class Sent:
    """A job as it is sent to a worker: text of its order, program, tool table, files that the program
    calls."""

    order: str
    program: bytes
    tool_table: bytes | None
    called: dict[str, bytes]


@dataclass(frozen=True)
class Returned:
    """The result that a worker sends: text of the outcome, and files of the plan by name."""

    outcome: str
    files: dict[str, bytes]


def run(name: str, expected: str, limits: tuple[float, float], jobs: Sequence[Sent]) -> list[Returned]:
    """Works on these jobs in order, and reports their progress under the `name` of the task.

    Refuses them if this feedplan is not the `expected` one, because its plans may differ.
    """
    from distributed import get_worker

    worker = get_worker()
    if (sentence := other_feedplan(worker, expected)) is not None:
        return [Returned(Outcome.failed("worker", sentence).text(), {}) for _ in jobs]
    most = JobLimits(*limits)
    return [_run_one(_JobProgress(worker, name, number, most), job) for number, job in enumerate(jobs)]


def _run_one(progress: _JobProgress, job: Sent) -> Returned:
    """Works on a job; errors are in the outcome, so that no exception is sent."""
    try:
        with tempfile.TemporaryDirectory(prefix="feedplan-") as temporary:
            scratch = FilePath(temporary)
            program, folder, called = scratch / "program", scratch / "plan", scratch / "called"
            program.write_bytes(job.program)
            called.mkdir()
            for name, content in job.called.items():
                (called / name).write_bytes(content)
            table = None
            if job.tool_table is not None:
                table = scratch / "tools.tbl"
                table.write_bytes(job.tool_table)
            own = Job(Order.of(job.order), program, folder, table, (called,) if job.called else ())
            outcome = work_on(own, progress.progress)
            if outcome.state == "stopped" and progress.over_time:
                outcome = progress.limits.over_time()
            text = outcome.text().replace(f"{scratch}/", "")
            files = {file.name: file.read_bytes() for file in folder.iterdir()} if folder.exists() else {}
            return Returned(text, files)
    except Exception as error:
        return Returned(Outcome.of_error(error).text(), {})


class _JobProgress:
    """Takes the progress of a job; ends the job when its time is over or its client is gone."""

    def __init__(self, worker: Any, name: str, number: int, limits: JobLimits) -> None:
        self._worker, self._name, self.limits = worker, name, limits
        self._end = time.monotonic() + limits.max_time
        self.over_time = False
        send = worker.log_event
        self._tell = paced(lambda stage, part: send(TOPIC, {"task": name, "progress": [number, stage, part]}))

    def progress(self, stage: str, part: float) -> None:
        """Reports the finished share of a stage. Raises Stopped."""
        self.over_time = time.monotonic() > self._end
        if self.over_time:
            raise Stopped
        require_wanted(self._worker, self._name)
        self._tell(stage, part)


def require_wanted(worker: Any, name: str) -> None:
    """Raises Stopped if the worker has removed or marked the task, because its client has cancelled it or is
    gone."""
    task = worker.state.tasks.get(name)
    if task is None or task.state == "cancelled":
        raise Stopped


def other_feedplan(worker: Any, expected: str) -> str | None:
    """A sentence about a worker whose feedplan is not the expected one; None if it is."""
    own = identity()
    if own == expected:
        return None
    return f"the worker {worker.address} has another feedplan, {own}, than {expected}: install that"
