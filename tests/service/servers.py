"""Starts servers as users do, and checks every answer against the service's own OpenAPI document."""

from __future__ import annotations

import http.client
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlencode, urlsplit

from feedplan.client.transport import form

PART = b"G21 G90 G64 P0.01\nF1200\nG1 X10 Y5\nX20 Y0\nG2 X30 Y10 R10\nM2\n"
# Options of a job that runs long enough to test while it runs, and short enough to wait for.
LONG = {"machine": "mill", "method": "jerk-limited", "options": '{"accuracy": 1e-5, "time_limit": 60}'}
ENDED = ("done", "failed", "cancelled")


def long_part(seed: int = 0) -> bytes:
    """A program whose plan with the options `LONG` takes some seconds."""
    rows = [
        f"X{k % 97 + 0.37 * (k % 5) + 1e-3 * seed:.3f} Y{k * 7 % 89 + 0.1 * (k % 3):.3f}" for k in range(4000)
    ]
    return ("G21 G90 G64 P0.01\nF6000\nG1 X1 Y1\n" + "\n".join(rows) + "\nM2\n").encode()


@dataclass(frozen=True)
class Answer:
    """An answer of a server."""

    status: int
    headers: Mapping[str, str]
    content: bytes

    @property
    def json(self) -> Any:
        return json.loads(self.content)

    @property
    def detail(self) -> str:
        """The sentence of an answer that reports a problem; asserts that it does."""
        assert self.headers["content-type"] == "application/problem+json"
        problem = self.json
        assert problem["status"] == self.status
        assert problem["type"].startswith("urn:feedplan:")
        return str(problem["detail"])


class Server:
    """A process of `feedplan serve`."""

    def __init__(self, store: Path, *options: str, token: str | None = None) -> None:
        self._command = [
            sys.executable,
            "-m",
            "feedplan",
            "serve",
            "--store",
            str(store),
            "--port",
            "0",
            *options,
        ]
        self.token, self.store = token, store
        self.start()

    def start(self) -> None:
        """Starts the server, perhaps again, and waits until it can be reached."""
        self.process = subprocess.Popen(
            self._command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True
        )
        assert self.process.stdout is not None
        self.url = self.process.stdout.readline().decode().strip()
        if not self.url:
            said = self.process.communicate()[1].decode()
            raise AssertionError(f"the server did not start: {said}")
        self._document: dict[str, Any] | None = None

    def end(self, how: signal.Signals = signal.SIGTERM) -> str:
        """Ends the server; returns its messages about defects."""
        self.process.send_signal(how)
        _, said = self.process.communicate(timeout=30)
        return said.decode()

    def send(
        self,
        method: str,
        address: str,
        body: bytes | None = None,
        headers: Mapping[str, str] | None = None,
        query: Any = None,
    ) -> Answer:
        """Sends a request; asserts that the documentation contains the answer."""
        parts = urlsplit(self.url)
        connection = http.client.HTTPConnection(parts.hostname or "", parts.port, timeout=60)
        try:
            own = {} if self.token is None else {"Authorization": f"Bearer {self.token}"}
            target = address + (f"?{urlencode(query, doseq=True)}" if query else "")
            connection.request(method, target, body, {**own, **(headers or {})})
            response = connection.getresponse()
            answer = Answer(
                response.status,
                {name.lower(): value for name, value in response.getheaders()},
                response.read(),
            )
        finally:
            connection.close()
        self._require_documented(method, address, answer)
        return answer

    def get(self, address: str, **query: Any) -> Answer:
        return self.send("GET", address, query=query)

    def submit(
        self, program: bytes = PART, file: str = "part.ngc", key: str | None = None, **fields: str
    ) -> Answer:
        """Submits a program as a form."""
        body, kind = form({"machine": "mill", **fields}, program, file)
        headers = {"Content-Type": kind} | ({} if key is None else {"Idempotency-Key": key})
        return self.send("POST", "/v1/jobs", body, headers)

    def submit_json(self, **request: Any) -> Answer:
        body = json.dumps({"program": PART.decode(), "name": "part.ngc", **request}).encode()
        return self.send("POST", "/v1/jobs", body, {"Content-Type": "application/json"})

    def wait(self, job: str, *states: str, seconds: float = 60.0) -> dict[str, Any]:
        """Waits until the job is in one of these states (without states: until it has ended)."""
        if not states:
            self.send("GET", f"/v1/jobs/{job}/events")  # returns at the end of the job
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            found: dict[str, Any] = self.get(f"/v1/jobs/{job}").json
            if found["state"] in (states or ENDED):
                return found
            time.sleep(0.02)
        raise AssertionError(f"the job is still {found['state']}")

    def planned(self, program: bytes = PART, **fields: str) -> dict[str, Any]:
        """Submits a program and returns its job when it has ended."""
        answer = self.submit(program, **fields)
        assert answer.status in (200, 202), answer.content
        return self.wait(answer.json["id"])

    @property
    def fork_server(self) -> int:
        """The process id of the fork server, which starts the processes of jobs."""
        [own] = [
            child
            for child in _children(self.process.pid)
            if b"forkserver" in Path(f"/proc/{child}/cmdline").read_bytes()
        ]
        return own

    @property
    def workers(self) -> list[int]:
        """The process ids of the running jobs."""
        return _children(self.fork_server)

    @property
    def memory(self) -> int:
        """The memory of the server's process [bytes]."""
        pages = Path(f"/proc/{self.process.pid}/statm").read_text("ascii").split()[1]
        return int(pages) * os.sysconf("SC_PAGE_SIZE")

    def _require_documented(self, method: str, address: str, answer: Answer) -> None:
        if not address.startswith("/v1/") or address == "/v1/openapi.json":
            return
        if self._document is None:
            self._document = self.get("/v1/openapi.json").json
        for known, operations in self._document["paths"].items():
            if re.fullmatch(re.sub(r"\{\w+\}", "[^/]+", known), address) and method.lower() in operations:
                told = operations[method.lower()]["responses"]
                assert str(answer.status) in told, f"{method} {address}: {answer.status} is not documented"
                types = told[str(answer.status)].get("content", {})
                own = answer.headers.get("content-type", "").partition(";")[0]
                assert not types or own in types, f"{method} {address}: {own} is not among {list(types)}"
                return


def _children(process: int) -> list[int]:
    found = []
    for task in Path(f"/proc/{process}/task").glob("*/children"):
        try:
            found += [int(own) for own in task.read_text("ascii").split()]
        except OSError:  # noqa: PERF203 (it has ended)
            continue
    return found


@contextmanager
def running(store: Path, *options: str, token: str | None = None) -> Iterator[Server]:
    """A running server; the test fails if it prints messages about defects."""
    server = Server(store, *options, token=token)
    try:
        yield server
    finally:
        said = server.end() if server.process.poll() is None else ""
    assert said == "", said


def events_of(server: Server, job: str, last: int | None = None) -> list[tuple[int, str, dict[str, Any]]]:
    """Number, kind and data of all events of a job until its end, after the event `last`."""
    headers = {} if last is None else {"Last-Event-ID": str(last)}
    text = server.send("GET", f"/v1/jobs/{quote(job)}/events", headers=headers).content.decode()
    found = []
    for block in text.split("\n\n"):
        lines = dict(line.split(": ", 1) for line in block.splitlines() if not line.startswith(":"))
        if "data" in lines:
            found.append((int(lines["id"]), lines["event"], json.loads(lines["data"])))
    return found
