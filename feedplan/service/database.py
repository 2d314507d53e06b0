"""The records of jobs in SQLite: their tables, and connections that threads share."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path as FilePath

from feedplan.errors import InputError

VERSION = 1

_TABLES = f"""
CREATE TABLE jobs (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT NOT NULL UNIQUE,
    fingerprint TEXT NOT NULL,
    state TEXT NOT NULL,
    created REAL NOT NULL, started REAL, finished REAL,
    attempt INTEGER NOT NULL DEFAULT 0,
    name TEXT NOT NULL, sha256 TEXT NOT NULL, bytes INTEGER NOT NULL, lines INTEGER NOT NULL,
    machine_name TEXT NOT NULL, machine TEXT NOT NULL, method TEXT NOT NULL, options TEXT NOT NULL,
    has_tools INTEGER NOT NULL,
    stage TEXT, done REAL NOT NULL DEFAULT 0,
    result TEXT, problem TEXT,
    size INTEGER NOT NULL
);
CREATE UNIQUE INDEX planned_once ON jobs (fingerprint) WHERE state IN ('queued', 'running', 'done');
CREATE INDEX by_state ON jobs (state, number);
CREATE TABLE keys (
    key TEXT PRIMARY KEY,
    job TEXT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    fingerprint TEXT NOT NULL
);
CREATE INDEX keys_of ON keys (job);
CREATE TABLE events (
    job TEXT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    number INTEGER NOT NULL, kind TEXT NOT NULL, data TEXT NOT NULL,
    PRIMARY KEY (job, number)
) WITHOUT ROWID;
PRAGMA user_version = {VERSION};
"""


class Database:
    """The database in a file, which is created if missing. Raises InputError if it has another version."""

    def __init__(self, file: FilePath) -> None:
        self._file = file
        self._idle: list[sqlite3.Connection] = []
        try:
            with self.read() as db:
                db.execute("PRAGMA journal_mode = WAL")
                version = db.execute("PRAGMA user_version").fetchone()[0]
                if version == 0:
                    db.executescript(f"BEGIN;{_TABLES}COMMIT;")
            said = "" if version in (0, VERSION) else f"is of another feedplan (version {version})"
        except sqlite3.DatabaseError as error:
            said = f"cannot be used ({error})"
        if said:
            self.close()
            raise InputError(f"{file} {said}: choose another folder with --store")

    def close(self) -> None:
        """Closes the connections."""
        for connection in self._idle:
            connection.close()

    @contextmanager
    def read(self) -> Iterator[sqlite3.Connection]:
        """A connection for the block; blocks that run at the same time have different connections."""
        try:
            db = self._idle.pop()
        except IndexError:
            db = self._connect()
        try:
            yield db
        finally:
            self._idle.append(db)

    def _connect(self) -> sqlite3.Connection:
        db = sqlite3.connect(self._file, timeout=30.0, isolation_level=None, check_same_thread=False)
        db.row_factory = sqlite3.Row
        db.execute("PRAGMA foreign_keys = ON")
        # An accepted job survives a power failure.
        db.execute("PRAGMA synchronous = FULL")
        return db

    @contextmanager
    def change(self) -> Iterator[sqlite3.Connection]:
        """A transaction: all changes of the block are kept, or none."""
        with self.read() as db, db:  # leaving `with db` commits, or rolls back after an exception
            db.execute("BEGIN IMMEDIATE")
            yield db
