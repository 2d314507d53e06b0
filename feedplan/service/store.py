"""Stores the jobs on disk: records in SQLite, programs and results in one folder for each job.

    STORE/jobs.sqlite            the records; files without a record are not part of the store
    STORE/lock                   held by the server that uses the store
    STORE/new/                   files that are being received or made; emptied at the start
    STORE/jobs/ID/program        the program as it was sent
    STORE/jobs/ID/tools.tbl      its tool table
    STORE/jobs/ID/result-N/      the plan of the N-th attempt, as `feedplan plan -o` writes it

The transaction that adds a record accepts a job, after its files are on the disk; the transaction that sets
the state ends it, after the result has its name. If a server ends in between, there are files without a
record, which the next server removes. A running job of a server that ended is queued again; its next attempt
has a new folder, so that a worker of the old attempt cannot change it.
"""

from __future__ import annotations

import fcntl
import json
import os
import secrets
import shutil
import sqlite3
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

from feedplan.errors import InputError
from feedplan.service.database import Database
from feedplan.service.limits import MB, Limits
from feedplan.service.refusals import BUSY, CANCELLED, DISK, INPUT, UNKNOWN, Refusal, over
from feedplan.service.requests import Order

ENDED = ("done", "failed", "cancelled")
# Size of a job's record and events, besides its files [bytes].
RECORD = 16_384
# The columns of a job that is queued again.
_WAITS: dict[str, object] = {"state": "queued", "started": None, "stage": None, "done": 0}


@dataclass(frozen=True)
class Upload:
    """A received program: its `file` below `new`, `sha256`, `bytes` and `lines`."""

    file: FilePath
    sha256: str
    bytes: int
    lines: int


@dataclass(frozen=True)
class Event:
    """Event `number` of a job, from 1: its `kind`, and `data` as JSON."""

    number: int
    kind: str
    data: str


Record = Mapping[str, Any]


class Store:
    """The jobs of a service; all methods may be called from any thread.

    `changed(job)` is called after each change of a job. Raises InputError if the folder cannot be used or
    another server uses it.
    """

    def __init__(
        self, folder: FilePath, limits: Limits, changed: Callable[[str], None] = lambda job: None
    ) -> None:
        self._folder, self._limits, self.changed = folder, limits, changed
        self._jobs, self.new = folder / "jobs", folder / "new"
        try:
            for own in (folder, self._jobs, self.new):
                own.mkdir(mode=0o700, parents=True, exist_ok=True)
            self._lock = os.open(folder / "lock", os.O_CREAT | os.O_RDWR, 0o600)
        except OSError as error:
            raise InputError(
                f"the store {folder} cannot be used ({error.strerror}): choose another folder with --store"
            ) from None
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(self._lock)
            raise InputError(
                f"another server works on {folder}: choose another folder with --store"
            ) from None
        try:
            self._database = Database(folder / "jobs.sqlite")
        except InputError:
            os.close(self._lock)
            raise
        self._tidy()

    def close(self) -> None:
        """Closes the store; no method may be called after it."""
        self._database.close()
        os.close(self._lock)

    def _tidy(self) -> None:
        """Removes the files and resets the states that a server left when it ended."""
        for left in self.new.iterdir():
            _remove(left)
        with self._database.change() as db:
            running = [row["id"] for row in db.execute("SELECT id FROM jobs WHERE state = 'running'")]
            for job in running:
                _set(db, job, "running", **_WAITS)
            rows = db.execute("SELECT id, state, attempt FROM jobs").fetchall()
        results = {row["id"]: f"result-{row['attempt']}" if row["state"] == "done" else None for row in rows}
        for folder in self._jobs.iterdir():
            if folder.name not in results:
                _remove(folder)
                continue
            for left in folder.iterdir():
                if left.name not in ("program", "tools.tbl", results[folder.name]):
                    _remove(left)

    # Requests for records.

    def job(self, job: str) -> Record:
        """The record of a job. Raises Refusal for an unknown job."""
        with self._database.read() as db:
            row = db.execute("SELECT * FROM jobs WHERE id = ?", (job,)).fetchone()
        if row is None:
            raise Refusal(UNKNOWN, "there is no such job: GET /v1/jobs lists those there are")
        return dict(row)

    def jobs(self, state: str | None, before: int | None, count: int) -> list[Record]:
        """Records of jobs in a state (None: any) that are older than number `before`, the newest first."""
        where = "WHERE (? IS NULL OR state = ?) AND (? IS NULL OR number < ?)"
        asked = (state, state, before, before, count)
        with self._database.read() as db:
            rows = db.execute(f"SELECT * FROM jobs {where} ORDER BY number DESC LIMIT ?", asked)
            return [dict(row) for row in rows]

    def counts(self) -> dict[str, int]:
        """The number of jobs in each state."""
        with self._database.read() as db:
            rows = db.execute("SELECT state, COUNT(*) AS count FROM jobs GROUP BY state")
            return {row["state"]: row["count"] for row in rows}

    def events(self, job: str, after: int) -> list[Event]:
        """The events of a job after the event of that number."""
        query = "SELECT number, kind, data FROM events WHERE job = ? AND number > ? ORDER BY number"
        with self._database.read() as db:
            return [Event(*row) for row in db.execute(query, (job, after))]

    def folder(self, record: Record) -> FilePath:
        """The folder of a job."""
        return self._jobs / str(record["id"])

    def result(self, record: Record) -> FilePath:
        """The folder of the plan of a job's last attempt."""
        return self.folder(record) / f"result-{record['attempt']}"

    # Changes of jobs.

    def accept(self, upload: Upload, order: Order, key: str | None = None) -> tuple[Record, bool]:
        """The record of a new job, or of a job with the same fingerprint that has not failed.

        The flag is true for a new job. The same `key` always gives the same job. Raises Refusal if the queue
        or the disk is full, or if the key was used for another request.
        """
        fingerprint = order.fingerprint(upload.sha256)
        if key is None:
            with self._database.read() as db:
                known = self._known(db, fingerprint, key)
            if known is not None:
                return self.job(known), False
        job = secrets.token_hex(16)
        folder = self._jobs / job
        folder.mkdir(mode=0o700)
        accepted = False
        try:
            sync(upload.file)
            os.replace(upload.file, folder / "program")
            if order.tool_table is not None:
                (folder / "tools.tbl").write_bytes(order.tool_table.encode())
                sync(folder / "tools.tbl")
            sync(folder)
            sync(self._jobs)
            with self._database.change() as db:
                known = self._known(db, fingerprint, key)
                if known is None:
                    self._require_room(db, upload.bytes)
                    accepted = True
                    known = job
                    columns = {
                        "id": job,
                        "fingerprint": fingerprint,
                        "state": "queued",
                        "created": time.time(),
                        "name": order.name or "program",
                        "sha256": upload.sha256,
                        "bytes": upload.bytes,
                        "lines": upload.lines,
                        "machine_name": order.machine_name,
                        "machine": order.machine,
                        "method": order.method,
                        "options": json.dumps(order.options),
                        "has_tools": order.tool_table is not None,
                        "size": upload.bytes + RECORD,
                    }
                    places = ", ".join("?" * len(columns))
                    db.execute(
                        f"INSERT INTO jobs ({', '.join(columns)}) VALUES ({places})", tuple(columns.values())
                    )
                    _add_event(db, job, "state", {"state": "queued"})
                if key is not None:
                    db.execute(
                        "INSERT OR IGNORE INTO keys (key, job, fingerprint) VALUES (?, ?, ?)",
                        (key, known, fingerprint),
                    )
        finally:
            if not accepted:
                _remove(folder)
        return self.job(known), accepted

    def _known(self, db: sqlite3.Connection, fingerprint: str, key: str | None) -> str | None:
        """The job of an earlier, equal request, or None."""
        row = None if key is None else db.execute("SELECT * FROM keys WHERE key = ?", (key,)).fetchone()
        if row is not None:
            if row["fingerprint"] != fingerprint:
                raise Refusal(
                    INPUT, "this Idempotency-Key was used for another request: choose a new key for each"
                )
            return str(row["job"])
        query = "SELECT id FROM jobs WHERE fingerprint = ? AND state IN ('queued', 'running', 'done')"
        row = db.execute(query, (fingerprint,)).fetchone()
        return None if row is None else str(row["id"])

    def _require_room(self, db: sqlite3.Connection, size: int) -> None:
        limits = self._limits
        waiting = db.execute("SELECT COUNT(*) FROM jobs WHERE state = 'queued'").fetchone()[0]
        if waiting >= limits.max_queue:
            said = f"{waiting} jobs wait, as many as max_queue allows: send it again in a while"
            raise over(limits, BUSY, said)
        full = self._full(db, size)
        if full is not None:
            raise full

    def _full(self, db: sqlite3.Connection, size: int, job: str = "") -> Refusal | None:
        """The refusal of a job with `size` bytes if all jobs would exceed max_disk; None if there is room."""
        limits = self._limits
        query = "SELECT COALESCE(SUM(size), 0) FROM jobs WHERE id != ?"
        kept = db.execute(query, (job,)).fetchone()[0]
        if kept + size <= limits.max_disk * MB:
            return None
        said = (
            f"the jobs that are kept take {kept / MB:.6g} MB of the {limits.max_disk:g} MB of max_disk, and "
            f"this one {size / MB:.6g} MB: delete some of them"
        )
        return over(limits, DISK, said)

    def _size(self, record: Record) -> int:
        """The size of a job's files, record and events [bytes]."""
        files = (file for file in self.folder(record).rglob("*") if file.is_file())
        return RECORD + sum(file.stat().st_size for file in files)

    def claim(self) -> Record | None:
        """Sets the job that has waited longest to running and returns it; None if no job waits."""
        with self._database.change() as db:
            query = "SELECT id, attempt FROM jobs WHERE state = 'queued' ORDER BY number LIMIT 1"
            row = db.execute(query).fetchone()
            if row is None:
                return None
            job, attempt = str(row["id"]), row["attempt"] + 1
            running = {"state": "running", "started": time.time(), "stage": "read", "done": 0}
            _set(db, job, "queued", attempt=attempt, **running)
        self.changed(job)
        return self.job(job)

    def progress(self, record: Record, stage: str, part: float, done: float) -> None:
        """Records the progress of a running job: the finished shares of the stage and of the whole job."""
        with self._database.change() as db:
            if _set(db, record["id"], "running", record["attempt"], stage=stage, done=done):
                told = {"stage": stage, "part": round(part, 4), "done": round(done, 4)}
                _add_event(db, record["id"], "progress", told)
        self.changed(record["id"])

    def finish(
        self, record: Record, state: str, *, result: Mapping[str, Any] | None, problem: str | None
    ) -> None:
        """Records the end of a running job; without a result its result folder is removed. A job whose result
        does not fit within max_disk fails."""
        self._end_run(
            record,
            state=state,
            finished=time.time(),
            done=1.0 if state == "done" else record["done"],
            result=None if result is None else json.dumps(result),
            problem=problem,
        )

    def wait_again(self, record: Record) -> None:
        """Sets a running job to waiting: the server ends, or the executor was lost."""
        self._end_run(record, **_WAITS)

    def _end_run(self, record: Record, **columns: object) -> None:
        """Sets columns of a running job, and its size. If `columns` have no `result`, or it does not fit, the
        result folder is removed."""
        with self._database.change() as db:
            full = None
            if columns.get("result") is not None:
                full = self._full(db, self._size(record), record["id"])
            if full is not None:
                columns.update(state="failed", result=None, problem=full.text())
            if columns.get("result") is None:
                _remove(self.result(record))
            size = self._size(record)
            known = _set(db, record["id"], "running", record["attempt"], size=size, **columns)
        if not known:  # the job was deleted
            _remove(self.folder(record))
        self.changed(record["id"])

    def cancel_waiting(self, job: str) -> bool:
        """Cancels a job if it waits; else returns False. Raises Refusal for an unknown job."""
        self.job(job)
        told = Refusal(CANCELLED, "the job was cancelled before it ran: send it again").text()
        with self._database.change() as db:
            waited = _set(db, job, "queued", state="cancelled", finished=time.time(), problem=told)
        self.changed(job)
        return waited

    def delete(self, job: str) -> None:
        """Deletes a job; the folder of a running job is removed when its process has ended. Raises Refusal
        for an unknown job."""
        record = self.job(job)
        with self._database.change() as db:
            row = db.execute("SELECT state FROM jobs WHERE id = ?", (job,)).fetchone()
            db.execute("DELETE FROM jobs WHERE id = ?", (job,))
        if row is not None and row["state"] != "running":
            _remove(self.folder(record))
        self.changed(job)

    def delete_old(self) -> None:
        """Deletes the jobs that ended more than `keep_days` ago."""
        last = time.time() - 86_400.0 * self._limits.keep_days
        with self._database.read() as db:
            rows = db.execute("SELECT id FROM jobs WHERE finished < ?", (last,)).fetchall()
        for row in rows:
            self.delete(str(row["id"]))


def _set(
    db: sqlite3.Connection, job: str, was: str, attempt: int | None = None, /, **columns: object
) -> bool:
    """Sets columns of a job that is in the state `was` (and in the given attempt, if any), and adds an event
    for a new state. Returns whether there is such a job."""
    names = ", ".join(f"{name} = ?" for name in columns)
    where = "id = ? AND state = ? AND attempt = COALESCE(?, attempt)"
    changed = db.execute(f"UPDATE jobs SET {names} WHERE {where}", (*columns.values(), job, was, attempt))
    if changed.rowcount and "state" in columns:
        _add_event(db, job, "state", {"state": columns["state"]})
    return changed.rowcount > 0


def _add_event(db: sqlite3.Connection, job: str, kind: str, data: Mapping[str, Any]) -> None:
    db.execute(
        "INSERT INTO events (job, number, kind, data) "
        "SELECT ?, COALESCE(MAX(number), 0) + 1, ?, ? FROM events WHERE job = ?",
        (job, kind, json.dumps(data), job),
    )


def _remove(path: FilePath) -> None:
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def sync(path: FilePath) -> None:
    """Writes a file, or the names in a folder, to the disk, so that they survive a power failure."""
    number = os.open(path, os.O_RDONLY)
    try:
        os.fsync(number)
    finally:
        os.close(number)
