"""What runs in a worker of a cluster: the same work as in a process, with files that are sent both ways."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

from feedplan.jobs.identity import identity
from feedplan.jobs.order import Order
from feedplan.jobs.outcome import Outcome, failure_of
from feedplan.jobs.place import JobLimits
from feedplan.jobs.work import Pace, Stopped, work_on

TOPIC = "feedplan"


@dataclass(frozen=True)
class Sent:
    """A job as a worker gets it: the text of its order, the program, its tool table, the files it calls."""

    order: str
    program: bytes
    tool_table: bytes | None
    called: dict[str, bytes]


@dataclass(frozen=True)
class Returned:
    """What comes back: the text of the outcome, and the files of the plan by name."""

    outcome: str
    files: dict[str, bytes]


def run(name: str, expected: str, limits: tuple[float, float], jobs: Sequence[Sent]) -> list[Returned]:
    """Works on these jobs, one after the other, and tells their progress under the `name` of the task.

    Refuses them where feedplan is not the `expected` one: its plans would be others.
    """
    from distributed import get_worker

    worker = get_worker()
    if (sentence := other_feedplan(worker, expected)) is not None:
        return [Returned(Outcome.failed("worker", sentence).text(), {}) for _ in jobs]
    most = JobLimits(*limits)
    return [_run_one(_Told(worker, name, number, most), job) for number, job in enumerate(jobs)]


def _run_one(told: _Told, job: Sent) -> Returned:
    """Works on a job; what goes wrong is in the outcome, so that no exception has to go over the line."""
    try:
        return _worked(told, job)
    except Exception as error:
        return Returned(Outcome("failed", failure=failure_of(error)).text(), {})


def _worked(told: _Told, job: Sent) -> Returned:
    with tempfile.TemporaryDirectory(prefix="feedplan-") as scratch:
        place = FilePath(scratch)
        folder, called, table = place / "plan", place / "called", place / "tools.tbl"
        called.mkdir()
        for name, content in job.called.items():
            (called / name).write_bytes(content)
        if job.tool_table is not None:
            table.write_bytes(job.tool_table)
        outcome = work_on(
            Order.of(job.order),
            job.program,
            folder,
            told.progress,
            tool_table=None if job.tool_table is None else table,
            subprograms=[called] if job.called else [],
        )
        if outcome.state == "stopped" and told.over_time:
            outcome = told.limits.over_time()
        text = outcome.text().replace(f"{scratch}/", "")
        files = {file.name: file.read_bytes() for file in folder.iterdir()} if folder.exists() else {}
        return Returned(text, files)


class _Told:
    """Is told of the progress of a job; ends it where its time is over or nobody waits for it."""

    def __init__(self, worker: Any, name: str, number: int, limits: JobLimits) -> None:
        self._worker, self._name, self.limits = worker, name, limits
        self._end = time.monotonic() + limits.max_time
        self.over_time = False
        send = worker.log_event
        self._pace = Pace(lambda stage, part: send(TOPIC, {"task": name, "told": [number, stage, part]}))

    def progress(self, stage: str, part: float) -> None:
        """The part of a stage is done. Raises Stopped."""
        self.over_time = time.monotonic() > self._end
        if self.over_time:
            raise Stopped
        require_wanted(self._worker, self._name)
        self._pace.progress(stage, part)


def require_wanted(worker: Any, name: str) -> None:
    """Raises Stopped where nobody waits for a task: the worker forgets it, or marks it, when its client has
    cancelled it or is gone."""
    task = worker.state.tasks.get(name)
    if task is None or task.state == "cancelled":
        raise Stopped


def other_feedplan(worker: Any, expected: str) -> str | None:
    """What is wrong with a worker whose feedplan is not the expected one: its plans would be others."""
    own = identity()
    if own == expected:
        return None
    return f"the worker {worker.address} has another feedplan, {own}, than {expected}: install that"
