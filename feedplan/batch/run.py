"""Plans a sweep on an executor, with a limited number of jobs at a time; keeps each row when its job ends."""

from __future__ import annotations

import queue
import threading
import time
from pathlib import Path as FilePath
from typing import Any

from feedplan.batch.journal import Journal
from feedplan.batch.packing import Packing
from feedplan.batch.sweep import Item, Sweep
from feedplan.errors import InputError
from feedplan.jobs.executor import Executor
from feedplan.jobs.outcome import Outcome
from feedplan.jobs.work import of_whole
from feedplan.plan_folder import files_of_plan
from feedplan.progress import Progress

STAGE = "batch"
# Time between two updates of the progress and of the number of slots [s].
EVERY = 0.2
# Longest wait for jobs to stop [s].
STOPPING = 0.4
Row = dict[str, Any]


def run_batch(
    sweep: Sweep, folder: FilePath, executor: Executor, progress: Progress | None = None
) -> tuple[list[Row], int]:
    """Plans all jobs of a sweep into `folder`; returns a row for each plan in order, and the number of plans
    that existed already.

    `progress("batch", done)` is called with the finished share. An exception, such as KeyboardInterrupt,
    stops the running jobs; finished plans stay, and another call with the same folder continues. Raises
    InputError if the folder or the executor cannot be used any more.
    """
    journal = Journal(folder)
    try:
        return _Batch(sweep, folder, executor, journal).run(progress)
    finally:
        journal.close()


class _Batch:
    """A running batch: several threads take items and put outcomes, one thread writes the rows."""

    def __init__(self, sweep: Sweep, folder: FilePath, executor: Executor, journal: Journal) -> None:
        self._items = enumerate(sweep.items(folder))
        self._left, self._count = len(sweep), len(sweep)
        self._executor, self._journal = executor, journal
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._packing = Packing()
        self._found: queue.SimpleQueue[tuple[int, Row, bool] | BaseException] = queue.SimpleQueue()
        self._parts: dict[int, float] = {}
        self._slots = 1

    def run(self, progress: Progress | None) -> tuple[list[Row], int]:
        rows: dict[int, Row] = {}
        threads: list[threading.Thread] = []
        kept, asked = 0, 0.0
        try:
            while len(rows) < self._count:
                if time.monotonic() - asked > EVERY:
                    asked = time.monotonic()
                    self._slots = max(self._executor.slots(), 1)  # a job reports that the cluster is lost
                    threads = [thread for thread in threads if thread.is_alive()]
                    while len(threads) < min(self._slots * self._executor.depth, self._left):
                        threads.append(threading.Thread(target=self._work, daemon=True))
                        threads[-1].start()
                    if progress is not None:
                        progress(STAGE, (len(rows) + sum(list(self._parts.values()))) / self._count)
                try:
                    found = self._found.get(timeout=EVERY)
                except queue.Empty:
                    continue
                if isinstance(found, BaseException):
                    raise found
                number, row, was_there = found
                if row["error"] is not None:
                    self._journal.remove(row["folder"])
                elif not was_there:
                    self._journal.add(row)
                kept += was_there
                rows[number] = row
                self._parts.pop(number, None)
        finally:
            self._stop.set()
            end = time.monotonic() + STOPPING
            for thread in threads:
                thread.join(max(end - time.monotonic(), 0.0))
        return [rows[number] for number in sorted(rows)], kept

    def _work(self) -> None:
        try:
            while not self._stop.is_set() and (chunk := self._next()):
                self._run(chunk)
        except BaseException as error:
            self._found.put(error)

    def _next(self) -> list[tuple[int, Item, str | None]]:
        """The items of the next task with their fingerprints; items with a finished plan are put as done."""
        chunk: list[tuple[int, Item, str | None]] = []
        with self._lock:
            size = self._packing.count(self._left, self._slots)
            for number, item in self._items:
                self._left -= 1
                fingerprint = _fingerprint(item)
                row = None if fingerprint is None else self._journal.done(item.folder, fingerprint)
                if row is not None and all(file.exists() for file in item.files):
                    self._found.put((number, row, True))
                    continue
                chunk.append((number, item, fingerprint))
                if len(chunk) == size:
                    break
        return chunk

    def _run(self, chunk: list[tuple[int, Item, str | None]]) -> None:
        def report(index: int, stage: str, part: float) -> None:
            self._parts[chunk[index][0]] = of_whole(stage, part)

        outcomes = self._executor.run([item.job for _, item, _ in chunk], report, self._stop)
        for (number, item, fingerprint), outcome in zip(chunk, outcomes, strict=True):
            if outcome.state in ("lost", "stopped"):
                if self._stop.is_set():
                    return
                raise InputError(
                    "the cluster has gone: start it, and the same batch again, which goes on where it was"
                )
            self._packing.add(outcome)
            self._found.put((number, row_of(item, fingerprint, outcome), False))


def _fingerprint(item: Item) -> str | None:
    try:
        return item.fingerprint()
    except OSError:  # the job will report it
        return None


def row_of(item: Item, fingerprint: str | None, outcome: Outcome) -> Row:
    """A row of the batch's table: times in s; `error` is None if there is a plan."""
    figures, failure = outcome.figures or {}, outcome.failure
    others = [] if failure else [file for file in files_of_plan(item.job.folder) if file not in item.files]
    return {
        "folder": item.folder,
        "program": item.program,
        "machine": figures.get("machine", item.machine),
        "tolerance": item.tolerance,
        "method": item.method,
        **{name: figures.get(name) for name in ("time", "lower_bound", "gap")},
        "computing": outcome.seconds,
        "ok": figures.get("ok"),
        "failures": figures.get("failures", []),
        "warnings": figures.get("warnings", []) + [f"{file.name} is of an earlier plan" for file in others],
        "error": failure.sentence if failure else None,
        "kind": failure.kind if failure else None,
        "fingerprint": fingerprint,
    }
