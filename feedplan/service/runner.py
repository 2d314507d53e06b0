"""Runs the jobs that wait: as many threads as workers, each with one process at a time.

A process for each job, from a fork server that has feedplan loaded (some 10 ms): a job that is killed, or
runs out of memory or time, takes nothing with it, and no pipe is shared whose lock a killed process could
keep.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import sys
import threading
import time
import traceback
from contextlib import suppress
from multiprocessing import forkserver
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path as FilePath
from typing import Any

from feedplan.service import work
from feedplan.service.limits import MB, Limits
from feedplan.service.refusals import CANCELLED, DEFECT, LIMIT, WORKER, Refusal
from feedplan.service.store import Record, Store

# How often a process is looked after [s], and how long it may take to stop when it is told to.
EVERY, GRACE = 0.05, 2.0
# How often old jobs are looked for [s].
KEEPING = 600.0
LONGEST_MESSAGE = 1 << 20
_PAGE = os.sysconf("SC_PAGE_SIZE")


class Runner:
    """Runs the jobs of a store until `stop`."""

    def __init__(self, store: Store, limits: Limits) -> None:
        self._store, self._limits = store, limits
        self._context = multiprocessing.get_context("forkserver")
        self._context.set_forkserver_preload(list(work.LOADED))
        self._wake = threading.Condition()
        self._end = threading.Event()
        self._running: dict[str, _Run] = {}
        self._threads = [threading.Thread(target=self._work, daemon=True) for _ in range(limits.workers)]
        self._threads.append(threading.Thread(target=self._keep, daemon=True))

    def start(self) -> None:
        forkserver.ensure_running()
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        """Ends; running jobs wait again."""
        with self._wake:
            self._end.set()
            for run in self._running.values():
                run.ask("ending")
            self._wake.notify_all()
        for thread in self._threads:
            thread.join()

    def wake(self) -> None:
        """A job waits."""
        with self._wake:
            self._wake.notify()

    def cancel(self, job: str) -> None:
        """Stops a job that waits or runs; others stay as they are. Raises Refusal where there is none."""
        if not self._store.cancel_waiting(job):
            self._ask(job)

    def delete(self, job: str) -> None:
        """Forgets a job, and stops it if it runs. Raises Refusal where there is none."""
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

    def _work(self) -> None:
        while not self._end.is_set():
            try:
                self._work_on_one()
            except Exception:  # noqa: PERF203 (a full disk: what is not recorded the next server plans)
                traceback.print_exc()
                time.sleep(1.0)

    def _work_on_one(self) -> None:
        # A job is among those running before anybody can see that it runs.
        with self._wake:
            record = None if self._end.is_set() else self._store.claim()
            if record is None:
                if not self._end.is_set():
                    self._wake.wait(1.0)
                return
            run = self._running[record["id"]] = _Run(record, self._store, self._limits)
        try:
            run.execute(self._context)
        finally:
            with self._wake:
                del self._running[record["id"]]


class _Run:
    """One job while it runs."""

    def __init__(self, record: Record, store: Store, limits: Limits) -> None:
        self._record, self._store, self._limits = record, store, limits
        self._asked: str | None = None
        self._outcome: dict[str, Any] | None = None
        self._problem: Refusal | None = None

    def ask(self, why: str) -> None:
        """Stop, since the job is `cancelled` or the server is `ending`."""
        self._asked = self._asked or why

    def execute(self, context: Any) -> None:
        """Starts the process, looks after it until it ends, and records what became of the job."""
        record = self._record
        order = json.dumps(
            {
                **{name: record[name] for name in ("name", "machine", "method", "has_tools")},
                "options": json.loads(record["options"]),
            }
        )
        own, other = context.Pipe()
        folder = str(self._store.folder(record))
        arguments = (other, folder, record["attempt"], order, self._limits)
        process = context.Process(target=work.main, args=arguments, daemon=True)
        with own:
            try:
                process.start()
                other.close()
                self._look_after(process, own)
            except (OSError, EOFError) as error:
                self._problem = Refusal(WORKER, f"no process could be started ({error}): send it again")
            finally:
                if process.pid is not None:
                    process.kill()
                    process.join()
        self._record_end(process)

    def _look_after(self, process: BaseProcess, connection: Connection) -> None:
        """Until the process has told its outcome, has ended, or must be killed."""
        limits, end, last = self._limits, time.monotonic() + self._limits.max_time, None
        while True:
            ready = wait([connection, process.sentinel], EVERY)
            if connection in ready:
                try:
                    message = json.loads(connection.recv_bytes(LONGEST_MESSAGE))
                except (EOFError, OSError):
                    return
                if "stage" not in message:
                    self._outcome = message
                    return
                self._store.progress(self._record, **message)
            elif ready:
                return
            now = time.monotonic()
            if now > end and self._problem is None and self._asked is None:
                self._over(
                    f"the job has run for {limits.max_time:g} s, all of max_time: choose a quicker method"
                )
            if (used := memory_of(process.pid)) > limits.max_memory * MB:
                self._over(
                    f"the job takes {used / MB:.6g} MB of memory, more than the {limits.max_memory:g} of "
                    "max_memory: split the program"
                )
                return
            if last is None and (self._asked or self._problem):
                last = now + GRACE
                with suppress(OSError):  # it may have ended
                    connection.send_bytes(b"stop")
            if last is not None and now > last:
                return

    def _over(self, sentence: str) -> None:
        self._problem = Refusal(LIMIT, sentence, limit=self._limits.named_in(sentence))

    def _record_end(self, process: BaseProcess) -> None:
        outcome, problem, store = self._outcome or {}, self._problem, self._store
        if "result" in outcome:
            store.finish(self._record, "done", result=outcome["result"], problem=None)
        elif self._asked == "ending":
            store.wait_again(self._record)
        elif self._asked == "cancelled":
            told = Refusal(CANCELLED, "the job was cancelled while it ran: send it again").text()
            store.finish(self._record, "cancelled", result=None, problem=told)
        else:
            told = outcome.get("problem") or (problem or self._ended(outcome, process)).text()
            store.finish(self._record, "failed", result=None, problem=told)

    def _ended(self, outcome: dict[str, Any], process: BaseProcess) -> Refusal:
        """Why a process ended that told no result."""
        if "defect" in outcome:
            print(outcome["traceback"], file=sys.stderr, flush=True)
            return Refusal(
                DEFECT,
                f"this is a defect in feedplan ({outcome['defect']}): please report it with the program",
            )
        how = process.exitcode
        signal = f"by the signal {-how}" if how is not None and how < 0 else "without a word"
        return Refusal(WORKER, f"the process of the job was ended {signal}: send it again")


def memory_of(process: int | None) -> int:
    """What a process has in memory [bytes]; 0 where the system does not tell."""
    try:
        return int(FilePath(f"/proc/{process}/statm").read_text("ascii").split()[1]) * _PAGE
    except (OSError, IndexError, ValueError):
        return 0
