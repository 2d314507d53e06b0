"""The store is consistent after the server ended at any moment."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest

from feedplan.errors import InputError
from feedplan.service.database import Database
from feedplan.service.limits import Limits
from feedplan.service.refusals import Refusal
from feedplan.service.requests import Order
from feedplan.service.store import Store, Upload


def order(name: str) -> Order:
    return Order(name, "auto", "auto", "bang-bang", {}, None)


def upload(store: Store, content: bytes = b"G0 X1\n") -> Upload:
    file = store.new / "received"
    file.write_bytes(content)
    return Upload(file, "hash", len(content), 1)


def test_a_running_job_of_a_server_that_ended_waits_again(tmp_path: Path) -> None:
    store = Store(tmp_path, Limits())
    first, second, third = (store.accept(upload(store), order(name))[0] for name in "abc")
    running = store.claim()
    assert running is not None
    assert running["id"] == first["id"]
    half = store.result(running)
    half.mkdir()
    (half / "plan.json").write_text("{")
    done = store.claim()
    assert done is not None
    store.result(done).mkdir()
    store.finish(done, "done", result={"time": 1.0}, problem=None)
    (tmp_path / "jobs" / ("f" * 32)).mkdir()
    (tmp_path / "new" / "left").write_text("x")
    store.close()

    store = Store(tmp_path, Limits())
    assert [job["state"] for job in store.jobs(None, None, 9)] == ["queued", "done", "queued"]
    assert not half.exists()
    assert store.result(store.job(second["id"])).exists()
    assert {folder.name for folder in (tmp_path / "jobs").iterdir()} == {
        job["id"] for job in (first, second, third)
    }
    assert list((tmp_path / "new").iterdir()) == []
    again = store.claim()
    assert again is not None
    assert (again["id"], again["attempt"]) == (first["id"], 2)
    # Progress that a surviving process of the first attempt reports is ignored.
    store.progress(running, "write", 1.0, 1.0)
    store.finish(running, "done", result={"time": 2.0}, problem=None)
    assert store.job(first["id"])["state"] == "running"
    kinds = [event.data for event in store.events(first["id"], 0)]
    assert [kind for kind in kinds if "state" in kind] == [
        f'{{"state": "{state}"}}' for state in ("queued", "running", "queued", "running")
    ]
    store.close()


def test_a_job_is_accepted_as_a_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = Store(tmp_path, Limits(max_queue=1))
    store.accept(upload(store), order("a"))
    with pytest.raises(Refusal, match="1 jobs wait, as many as max_queue allows"):
        store.accept(upload(store), order("b"))
    same, is_new = store.accept(upload(store), order("a"))
    assert not is_new
    assert [folder.name for folder in (tmp_path / "jobs").iterdir()] == [same["id"]]
    store.close()


def test_jobs_that_ended_long_ago_are_deleted(tmp_path: Path) -> None:
    store = Store(tmp_path, Limits(keep_days=0.0))
    waiting, ended = (store.accept(upload(store), order(name))[0] for name in "ab")
    assert store.cancel_waiting(ended["id"])
    store.delete_old()
    assert [job["id"] for job in store.jobs(None, None, 9)] == [waiting["id"]]
    assert [folder.name for folder in (tmp_path / "jobs").iterdir()] == [waiting["id"]]
    store.close()
    store = Store(tmp_path, Limits())
    assert store.cancel_waiting(waiting["id"])
    store.delete_old()
    assert len(store.jobs(None, None, 9)) == 1
    store.close()


def test_a_store_has_one_server_and_one_version(tmp_path: Path) -> None:
    store = Store(tmp_path, Limits())
    with pytest.raises(InputError, match=r"another server works on .*: choose another folder with --store"):
        Store(tmp_path, Limits())
    store.close()
    with sqlite3.connect(tmp_path / "jobs.sqlite") as db:
        db.execute("PRAGMA user_version = 7")
    db.close()
    with pytest.raises(InputError, match=r"is of another feedplan \(version 7\)"):
        Store(tmp_path, Limits())
    (tmp_path / "jobs.sqlite").write_bytes(b"damaged " * 1000)
    with pytest.raises(InputError, match=r"jobs.sqlite cannot be used \(.*\): choose another folder"):
        Store(tmp_path, Limits())


def test_a_change_that_cannot_be_kept_is_undone_and_the_next_one_is_made(tmp_path: Path) -> None:
    database = Database(tmp_path / "jobs.sqlite")

    def add_a_key_without_its_job() -> None:
        with database.change() as db:
            # A deferred foreign key is checked at the end of the transaction.
            db.execute("PRAGMA defer_foreign_keys = ON")
            db.execute("INSERT INTO keys (key, job, fingerprint) VALUES ('a', 'gone', 'b')")

    with pytest.raises(sqlite3.IntegrityError):
        add_a_key_without_its_job()
    with database.change() as db:
        assert db.execute("SELECT COUNT(*) FROM keys").fetchone()[0] == 0
    database.close()
