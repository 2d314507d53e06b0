"""After kill -9 of the server and of workers at random moments no job is lost or done twice."""

from __future__ import annotations

import json
import os
import random
import signal
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import feedplan
from feedplan.outputs.npz import load
from tests.campaign import seeds
from tests.service.servers import PART, Answer, Server, events_of

JOBS = seeds(20)
KILLS = JOBS // 10


def program(number: int) -> bytes:
    """A short program, different for each number; every seventh is longer."""
    rows = "".join(f"X{k % 23}.{number % 10} Y{k % 17}\n" for k in range(300 if number % 7 == 0 else 5))
    return b"(%d)\n" % number + PART.replace(b"M2\n", b"") + f"G1\n{rows}M2\n".encode()


def kill(process: int) -> None:
    with suppress(ProcessLookupError):
        os.kill(process, signal.SIGKILL)


def sent(server: Server, number: int) -> Answer | None:
    """The answer to a request; None if the server ended before it answered."""
    try:
        return server.submit(program(number), key=f"key-{number}")
    except (OSError, ValueError):
        return None


def test_no_job_is_lost_or_done_twice(tmp_path: Path) -> None:
    draw = random.Random(1)
    server = Server(tmp_path, "--workers", "2", "--max-queue", str(JOBS + 1))
    accepted: dict[int, str] = {}
    killed: set[str] = set()
    kills = {"server": 0, "worker": 0}
    waiting = list(range(JOBS))
    moments = sorted(draw.sample(range(JOBS), KILLS))
    while waiting:
        number = waiting.pop(0)
        if moments and number >= moments[0]:
            moments.pop(0)
            time.sleep(draw.uniform(0.0, 0.3))
            if len(moments) % 2:
                kills["server"] += 1
                kill(server.process.pid)
                server.process.communicate()
                server.start()
            else:
                for worker in server.workers[:1]:
                    kills["worker"] += 1
                    kill(worker)
        if number == 2:  # once, the server ends in order
            assert server.end() == ""
            server.start()
        answer = sent(server, number)
        if answer is None:
            waiting.append(number)
            continue
        assert answer.status in (200, 202)
        job = answer.json["id"]
        assert accepted.setdefault(number, job) == job
    # The server is killed once more while jobs wait and run; the next server completes them.
    kill(server.process.pid)
    server.process.communicate()
    server.start()
    for number, job in accepted.items():
        done = server.wait(job, seconds=300)
        if done["state"] == "failed":
            assert done["problem"]["type"] == "urn:feedplan:worker", done["problem"]
            assert "was ended by the signal 9: send it again" in done["problem"]["detail"]
            killed.add(job)
            job = accepted[number] = server.submit(program(number), key=f"again-{number}").json["id"]
            done = server.wait(job, seconds=300)
        require_whole(server, done, program(number))
    assert len(killed) <= kills["worker"]
    listed: list[Any] = server_jobs(server)
    assert sorted(job["id"] for job in listed) == sorted({*accepted.values(), *killed})
    assert len({job["program"]["sha256"] for job in listed}) == JOBS
    folders = {
        folder.name: {own.name for own in folder.iterdir()} for folder in (tmp_path / "jobs").iterdir()
    }
    assert set(folders) == {job["id"] for job in listed}
    for job in listed:
        results = {name for name in folders[job["id"]] if name.startswith("result")}
        assert len(results) == (job["state"] == "done")
    assert server.end() == ""


def require_whole(server: Server, done: dict[str, Any], text: bytes) -> None:
    """Asserts that the job was planned once and has the plan of its own program."""
    assert done["state"] == "done", done
    states = [data["state"] for _, kind, data in events_of(server, done["id"]) if kind == "state"]
    assert states.count("done") == 1
    assert states[-1] == "done"
    folder = server.store / "jobs" / done["id"]
    [result] = folder.glob("result-*")
    summary = json.loads((result / "plan.json").read_text("utf-8"))
    assert summary["program_sha256"] == done["program"]["sha256"]
    assert len(load(result / "setpoints.npz")) == summary["setpoints"]["count"]
    assert (result / "report.html").read_bytes().rstrip().endswith(b"</html>")
    assert (folder / "program").read_bytes() == text
    assert feedplan.check(result).ok


def server_jobs(server: Server) -> list[Any]:
    found, before = [], None
    while True:
        page = server.get("/v1/jobs", count=200, **({} if before is None else {"before": before})).json
        found += page["jobs"]
        before = page["before"]
        if before is None:
            return found


def test_a_killed_fork_server_is_started_again(server: Server) -> None:
    assert server.planned()["state"] == "done"
    kill(server.fork_server)
    assert server.planned(options='{"tolerance": 0.071}')["state"] == "done"
