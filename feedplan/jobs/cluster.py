"""Runs jobs on the workers of a Dask cluster, given by the address of its scheduler.

A sequence of jobs is one task. Programs are sent with the task and the files of plans come back with its
result, so that workers share no disk with this computer. When a worker is lost Dask runs its task on another
worker. A task that has lost as many workers as Dask allows fails; its jobs are then tried one by one, so that
only the job that causes the loss fails.
"""

from __future__ import annotations

import secrets
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

from feedplan.errors import InputError
from feedplan.jobs import cluster_task
from feedplan.jobs.address import ClusterAddress
from feedplan.jobs.called import called_files
from feedplan.jobs.connection import Client, Future, close, connect, require_equals
from feedplan.jobs.executor import JobLimits, JobListener
from feedplan.jobs.identity import identity
from feedplan.jobs.order import Job
from feedplan.jobs.outcome import Outcome
from feedplan.outputs._staging import staged
from feedplan.program.source import content_of

# Time between two checks for a stop while a task runs [s].
EVERY = 0.05
# Time for which a count of threads is kept [s].
COUNTED = 0.5


class Cluster:
    """The workers of a cluster. Raises InputError if the cluster cannot be reached or has another feedplan,
    and MissingPackageError without the package."""

    depth = 2

    def __init__(self, address: ClusterAddress, limits: JobLimits) -> None:
        self._address, self._limits = address, (limits.max_time, limits.max_memory)
        self._lock = threading.Lock()
        self._heard: dict[str, _Heard] = {}
        # The number of threads (None if the scheduler could not be reached), and when they were counted [s].
        self._counted: tuple[int | None, float] = (None, -COUNTED)
        self._closed = False
        self._client: Client = self._new_client()
        try:
            require_equals(self._client, address)
        except InputError:
            self.close()
            raise

    def threads(self) -> int | None:
        """The number of threads that the workers have now; None while the scheduler cannot be reached."""
        count, last = self._counted
        if time.monotonic() - last > COUNTED:
            count = None
            with suppress(OSError, RuntimeError):  # the scheduler is lost
                client = self._connected()
                count = None if client is None else sum(client.nthreads().values())
            self._counted = (count, time.monotonic())
        return count

    def slots(self) -> int:
        """See `Executor`; 1 without workers, because some clusters start workers only when there is work."""
        threads = self.threads()
        return 0 if threads is None else max(threads, 1)

    def close(self) -> None:
        """See `Executor`."""
        with self._lock:
            self._closed = True
            client, self._client = self._client, None
        if client is not None:
            close(client)

    def run(self, jobs: Sequence[Job], report: JobListener, stop: threading.Event) -> list[Outcome]:
        """See `Executor`."""
        outcomes: dict[int, Outcome] = {}
        sent: dict[int, cluster_task.Sent] = {}
        for number, job in enumerate(jobs):
            try:
                sent[number] = _sent(job)
            except Exception as error:  # noqa: PERF203
                outcomes[number] = Outcome.of_error(error)
        groups = [list(sent)] if sent else []
        doubted: set[int] = set()
        while groups:
            group = groups.pop(0)
            found = self._run_task(
                [sent[number] for number in group],
                lambda index, stage, part, group=group: report(group[index], stage, part),  # type: ignore[misc]
                stop,
            )
            if isinstance(found, _Lost):
                again = len(group) > 1 or not (found.started or group[0] in doubted)
                if again:
                    doubted.update(group if len(group) == 1 else ())
                    groups += [[number] for number in group]
                    continue
                found = [found.outcome]
            for number, returned in zip(group, found, strict=True):
                outcomes[number] = _kept(jobs[number], returned)
        return [outcomes[number] for number in range(len(jobs))]

    def _run_task(
        self, sent: Sequence[cluster_task.Sent], report: JobListener, stop: threading.Event
    ) -> Sequence[cluster_task.Returned | Outcome] | _Lost:
        """The result of one task."""
        client = None if stop.is_set() else self._connected()
        if client is None:
            return [Outcome("stopped" if stop.is_set() else "lost")] * len(sent)
        name = f"feedplan-{secrets.token_hex(8)}"
        heard = self._heard[name] = _Heard()
        try:
            future = client.submit(
                cluster_task.run, name, identity(), self._limits, sent, key=name, pure=False
            )
            future.add_done_callback(lambda _: heard.changed.set())
            while not future.done():
                if stop.is_set():
                    future.cancel()
                    return [Outcome("stopped")] * len(sent)
                heard.changed.wait(EVERY)
                for number, stage, part in heard.take():
                    report(number, stage, part)
            return _returned(future, len(sent), heard.started)
        except (OSError, RuntimeError):  # the scheduler is lost
            return [Outcome("lost")] * len(sent)
        finally:
            del self._heard[name]

    def _hear(self, event: tuple[float, Any]) -> None:
        _, message = event
        heard = self._heard.get(message.get("task"))
        if heard is not None:
            heard.add(*message["progress"])

    def _connected(self) -> Client:
        """The connection to the scheduler; a broken one is made again (all its tasks are lost). None if that
        fails."""
        with self._lock:
            if self._client is not None and self._client.status != "running":
                close(self._client)
                self._client = None
            if self._client is None and not self._closed:
                try:
                    self._client = self._new_client()
                except InputError:
                    return None
            return self._client

    def _new_client(self) -> Client:
        client = connect(self._address)
        client.subscribe_topic(cluster_task.TOPIC, self._hear)
        return client


@dataclass(frozen=True)
class _Lost:
    """A task that has lost as many workers as Dask allows, with the outcome of its job, if the task has one
    job.

    A task that never `started` has only waited on workers that other tasks made fail.
    """

    outcome: Outcome
    started: bool


def _returned(future: Future, count: int, started: bool) -> Sequence[cluster_task.Returned | Outcome] | _Lost:
    """The result of an ended task of `count` jobs."""
    from distributed import KilledWorker

    if future.status not in ("finished", "error"):
        return [Outcome("lost")] * count
    try:
        returned: Sequence[cluster_task.Returned] = future.result()
        return returned
    except KilledWorker as error:
        sentence = (
            f"{error.allowed_failures + 1} workers of the cluster were lost with the job, the last one "
            f"{error.last_worker.address}: give workers more memory, or split the program"
        )
        return _Lost(Outcome.failed("worker", sentence), started)
    except ModuleNotFoundError as error:
        sentence = f"a worker of the cluster lacks {error.name}: install feedplan {identity()} for it"
        return [Outcome.failed("worker", sentence)] * count
    except Exception as error:
        return [Outcome.of_error(error)] * count


class _Heard:
    """The last progress of each job of a task."""

    def __init__(self) -> None:
        self.changed, self.started = threading.Event(), False
        self._last: dict[int, tuple[str, float]] = {}

    def add(self, number: int, stage: str, part: float) -> None:
        self._last[number] = (stage, part)
        self.started = True
        self.changed.set()

    def take(self) -> list[tuple[int, str, float]]:
        self.changed.clear()
        last, self._last = self._last, {}
        return [(number, *word) for number, word in last.items()]


def _sent(job: Job) -> cluster_task.Sent:
    """A job in the form that is sent to a worker. Raises FeedplanError if a file cannot be read."""
    content = content_of(job.program).content
    try:
        table = None if job.tool_table is None else job.tool_table.read_bytes()
        called = called_files(content, job.subprograms)
    except (OSError, ValueError) as error:
        raise InputError(f"{job.order.name} calls a file that cannot be sent ({error}): correct it") from None
    return cluster_task.Sent(job.order.text(), content, table, called)


def _kept(job: Job, returned: cluster_task.Returned | Outcome) -> Outcome:
    """Writes the files of a job to its folder and returns its outcome."""
    if isinstance(returned, Outcome):
        return returned
    outcome = Outcome.of(returned.outcome)
    if outcome.state != "done":
        return outcome
    try:
        with staged(job.folder, last="plan.json") as stage:
            for name, content in returned.files.items():
                (stage / FilePath(name).name).write_bytes(content)
    except InputError as error:
        return Outcome.of_error(error)
    return outcome
