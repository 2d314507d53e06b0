"""Every limit is enforced; the error names the limit, its value and a remedy."""

from __future__ import annotations

import re
import socket
import time
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

import feedplan
from feedplan.service.limits import Limits
from tests.service.servers import LONG, PART, Server, long_part, running

LOOP = b"G21 G91 F600\nO1 repeat [3000]\nG1 X0.1\nX-0.1\nO1 endrepeat\nM2\n"
BIG = 300_000


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server with small limits."""
    options = {
        "max-upload": 0.2,
        "max-upload-time": 0.5,
        "max-blocks": 5000,
        "max-moves": 4500,
        "max-setpoints": 20_000,
        "max-time": 1.5,
        "max-memory": 400,
        "max-queue": 1,
        "workers": 1,
    }
    given = [word for name, value in options.items() for word in (f"--{name}", str(value))]
    with running(tmp_path_factory.mktemp("small"), *given) as found:
        yield found


def named(problem: Any) -> tuple[str, float]:
    """Name and value of the limit in a problem; asserts that the sentence names it and has a remedy."""
    limit = problem["limit"]
    assert re.search(rf"\b{limit['name']}\b", problem["detail"])
    assert problem["remedy"]
    assert problem["type"] in ("urn:feedplan:limit", "urn:feedplan:input")
    return limit["name"], limit["value"]


def test_size_of_a_request(small: Server) -> None:
    answer = small.submit(b"(" + b"x" * BIG + b")\n")
    assert (answer.status, named(answer.json)) == (413, ("max_upload", 0.2))
    # Without Content-Length the request is refused as soon as it exceeds the limit.
    parts = urlsplit(small.url)
    with socket.create_connection((parts.hostname, parts.port)) as line:
        head = "POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
        line.sendall(f"{head}Transfer-Encoding: chunked\r\n\r\n".encode())
        line.settimeout(10)
        try:
            for _ in range(40):
                line.sendall(b"2710\r\n" + b" " * 10_000 + b"\r\n")
        except OSError:
            pass
        assert b" 413 " in line.recv(1000).split(b"\r\n")[0]


def test_the_client_tells_why_a_program_is_refused_before_it_has_arrived(small: Server) -> None:
    # The program is so long that it is still being sent when the answer arrives.
    program = b"(" + b"x" * 30_000_000 + b")\n"
    with pytest.raises(feedplan.InputError, match="which is max_upload: split the program"):
        feedplan.Client(small.url).plan(program, "mill")


def test_time_of_a_request(small: Server) -> None:
    parts = urlsplit(small.url)
    with socket.create_connection((parts.hostname, parts.port)) as line:
        head = "POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
        line.sendall(f"{head}Content-Length: 1000\r\n\r\n".encode() + b"{")
        line.settimeout(10)
        start = time.monotonic()
        said = line.recv(10_000)
        assert b" 408 " in said.split(b"\r\n")[0]
        assert b"max_upload_time" in said or b"max_upload_time" in line.recv(10_000)
        assert time.monotonic() - start < 9.0


def test_lines_and_moves_and_setpoints(small: Server) -> None:
    many = small.submit(b"G0 X1\n" * 5001)
    assert (many.status, named(many.json)) == (422, ("max_blocks", 5000))
    assert named(small.planned(LOOP)["problem"]) == ("max_moves", 4500)
    slow = b"G21 F1\nG1 X10\nM2\n"
    assert named(small.planned(slow)["problem"]) == ("max_setpoints", 20_000)
    asked = small.submit(options='{"max_setpoints": 20001}')
    assert (asked.status, named(asked.json)) == (422, ("max_setpoints", 20_000))
    own = small.planned(options='{"max_setpoints": 10}')
    assert named(own["problem"]) == ("max_setpoints", 10)
    assert "more than 10: choose a longer period" in own["problem"]["detail"]


def test_time_of_a_job(small: Server) -> None:
    # With a `time_limit` the job would be refused for too many setpoints before its time is over.
    done = small.planned(long_part(), **LONG | {"options": '{"accuracy": 1e-5}'})
    assert done["state"] == "failed"
    assert named(done["problem"]) == ("max_time", 1.5)
    assert small.planned(options='{"tolerance": 0.03}')["state"] == "done"


def test_jobs_that_wait(small: Server) -> None:
    first = small.submit(long_part(1), **LONG).json["id"]
    small.wait(first, "running")
    second = small.submit(options='{"tolerance": 0.05}').json["id"]
    answer = small.submit(options='{"tolerance": 0.06}')
    assert (answer.status, named(answer.json)) == (429, ("max_queue", 1))
    assert answer.headers["retry-after"] == "5"
    assert small.submit(options='{"tolerance": 0.05}').json["id"] == second, "it has its place already"
    small.send("POST", f"/v1/jobs/{first}/cancel")
    assert small.wait(second)["state"] == "done"


def test_memory_of_a_job_and_size_of_all(tmp_path: Path) -> None:
    with running(tmp_path, "--max-memory", "20", "--max-disk", "0.016", "--workers", "1") as server:
        first = server.planned()
        assert first["state"] == "failed"
        assert named(first["problem"]) == ("max_memory", 20.0)
        answer = server.submit(options='{"tolerance": 0.03}')
        assert (answer.status, named(answer.json)) == (507, ("max_disk", 0.016))
        server.send("DELETE", f"/v1/jobs/{first['id']}")
        assert server.submit(options='{"tolerance": 0.03}').status == 202


def test_results_beyond_the_size_of_all_jobs_are_not_kept(tmp_path: Path) -> None:
    # The report alone is larger than a megabyte.
    with running(tmp_path, "--max-disk", "2.5") as server:
        assert server.planned()["state"] == "done"
        second = server.planned(options='{"tolerance": 0.03}')
        assert second["state"] == "failed"
        assert named(second["problem"]) == ("max_disk", 2.5)
        assert second["problem"]["status"] == 507
        kept = sum(file.stat().st_size for file in (tmp_path / "jobs").rglob("*") if file.is_file())
        assert kept < 2.5e6
        # There is room for requests, and for another result instead of the first.
        first = server.get("/v1/jobs").json["jobs"][-1]
        server.send("DELETE", f"/v1/jobs/{first['id']}")
        assert server.planned(options='{"tolerance": 0.03}')["state"] == "done"


def test_every_limit_is_an_option_with_a_unit(small: Server) -> None:
    told = small.get("/v1/health").json["limits"]
    assert set(told) == {own.name for own in fields(Limits)}
    assert told["max_time"] == {"value": 1.5, "unit": "s"}
    for own in fields(Limits):
        assert Limits().named_in(f"more than {own.name}: less")["name"] == own.name  # type: ignore[index]
    assert Limits().named_in("max_setpoint") is None
    assert len(PART) < 1000
