"""Runs waiting jobs on an executor, as many at a time as it has slots, and records their outcomes."""

from __future__ import annotations

import json
import re
import sys
import threading
import time
import traceback
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Any

from feedplan.jobs.executor import Executor
from feedplan.jobs.order import Job, Order
from feedplan.jobs.outcome import Failure, Outcome
from feedplan.jobs.work import of_whole
from feedplan.service.limits import Limits
from feedplan.service.refusals import CANCELLED, DISK, KINDS, LIMIT, Refusal
from feedplan.service.requests import READING
from feedplan.service.store import Record, Store, sync

# Time between two requests for the number of slots (EVERY), and pause after the executor was lost (AWAY) [s].
EVERY, AWAY = 1.0, 2.0
# Time between two searches for old jobs [s].
KEEPING = 600.0


class Runner:
    """Runs the jobs of a store on an executor until `stop`."""

    def __init__(self, store: Store, limits: Limits, executor: Executor) -> None:
        self._store, self._limits, self._executor = store, limits, executor
        self._wake = threading.Condition()
        self._end = threading.Event()
        self._running: dict[str, _Run] = {}
        self._threads = [threading.Thread(target=own, daemon=True) for own in (self._hand_out, self._keep)]

    def start(self) -> None:
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        """Stops the running jobs; they are queued again for the next server."""
        with self._wake:
            self._end.set()
            for run in self._running.values():
                run.ask("ending")
            self._wake.notify_all()
            self._wake.wait_for(lambda: not self._running)
        for thread in self._threads:
            thread.join()
        self._executor.close()

    def wake(self) -> None:
        """Tells the runner that a job waits."""
        with self._wake:
            self._wake.notify_all()

    def cancel(self, job: str) -> None:
        """Stops a job that waits or runs; other jobs do not change. Raises Refusal for an unknown job."""
        if not self._store.cancel_waiting(job):
            self._ask(job)

    def delete(self, job: str) -> None:
        """Deletes a job, and stops it if it runs. Raises Refusal for an unknown job."""
        self._store.delete(job)
        self._ask(job)

    def _ask(self, job: str) -> None:
        with self._wake:
            if job in self._running:
                self._running[job].ask("cancelled")

    def _keep(self) -> None:
        while True:
            self._store.delete_old()
            if self._end.wait(KEEPING):
                return

    def _hand_out(self) -> None:
        """Starts a thread for each waiting job while slots are free."""
        while not self._end.is_set():
            try:
                room = self._executor.slots()
                with self._wake:
                    if len(self._running) >= room or not self._start_one():
                        self._wake.wait(EVERY)
            except Exception:  # noqa: PERF203 (the disk may be full for a while)
                traceback.print_exc()
                time.sleep(EVERY)

    def _start_one(self) -> bool:
        # Because of the lock, a job is in `_running` before a client can see that it runs.
        record = None if self._end.is_set() else self._store.claim()
        if record is None:
            return False
        run = self._running[record["id"]] = _Run(record, self._store, self._limits)
        threading.Thread(target=self._work_on, args=(run, record["id"]), daemon=True).start()
        return True

    def _work_on(self, run: _Run, job: str) -> None:
        try:
            if run.execute(self._executor):
                self._end.wait(AWAY)
        except Exception:  # for example a full disk: the next server repeats a job that is not recorded
            traceback.print_exc()
            self._end.wait(EVERY)
        finally:
            with self._wake:
                del self._running[job]
                self._wake.notify_all()


class _Run:
    """One job while it runs."""

    def __init__(self, record: Record, store: Store, limits: Limits) -> None:
        self._record, self._store, self._limits = record, store, limits
        self._asked: str | None = None
        self._stop = threading.Event()

    def ask(self, why: str) -> None:
        """Asks the job to stop because it is `cancelled` or the server is `ending`."""
        self._asked = self._asked or why
        self._stop.set()

    def execute(self, executor: Executor) -> bool:
        """Runs the job and records its outcome; returns whether the executor was lost."""
        [outcome] = executor.run([self._job()], self._report, self._stop)
        self._record_end(outcome)
        return outcome.state == "lost"

    def _report(self, _: int, stage: str, part: float) -> None:
        self._store.progress(self._record, stage, part, of_whole(stage, part))

    @property
    def _options(self) -> dict[str, Any]:
        options: dict[str, Any] = json.loads(self._record["options"])
        # `order_of` has already refused larger values.
        options.setdefault("max_setpoints", self._limits.max_setpoints)
        return options

    def _job(self) -> Job:
        record, folder, options = self._record, self._folder, self._options
        reading = {name: options.pop(name) for name in READING if name in options}
        order = Order(
            record["name"],
            record["machine"],
            record["method"],
            options,
            {"max_moves": self._limits.max_moves, **reading},
            drawing=True,
        )
        table = folder / "tools.tbl" if record["has_tools"] else None
        return Job(order, folder / "program", self._store.result(record), table)

    @property
    def _folder(self) -> FilePath:
        return self._store.folder(self._record)

    def _record_end(self, outcome: Outcome) -> None:
        record, store = self._record, self._store
        if outcome.state == "done":
            result = store.result(record)
            for file in (*result.iterdir(), result, self._folder):
                sync(file)
            store.finish(record, "done", result=outcome.figures, problem=None)
        elif self._asked == "ending" or (self._asked is None and outcome.failure is None):
            store.wait_again(record)
        elif self._asked == "cancelled":
            problem = Refusal(CANCELLED, "the job was cancelled while it ran: send it again").text()
            store.finish(record, "cancelled", result=None, problem=problem)
        elif outcome.failure is not None:
            problem = self._refusal(outcome.failure).text()
            store.finish(record, "failed", result=None, problem=problem)

    def _refusal(self, failure: Failure) -> Refusal:
        """A failure as a problem, without the path of the store."""
        if failure.trace:
            print(failure.trace, file=sys.stderr, flush=True)
        if failure.kind == "disk":
            said = (
                "the result cannot be written, the disk of the service is full or broken: tell its operator"
            )
            return Refusal(DISK, said)
        sentence = failure.sentence.replace(f"{self._folder}/", "")
        if failure.kind in ("worker", "defect"):
            return Refusal(KINDS[failure.kind], sentence)
        # The reader's sentence does not name this limit, because only users of the service know it: its name
        # is added.
        bound = rf"than {self._limits.max_moves} (?:moves|pieces)(?: take)?"
        sentence = re.sub(bound, lambda found: f"{found[0]} (max_moves)", sentence)
        limit = replace(self._limits, max_setpoints=self._options["max_setpoints"]).named_in(sentence)
        file = self._record["name"] if failure.line is not None or failure.kind == "program" else None
        kind = LIMIT if limit else KINDS[failure.kind]
        return Refusal(kind, sentence, file=file, line=failure.line, limit=limit)
