"""Response times of a service that plans, and overhead of a job over its plan alone."""

from __future__ import annotations

import http.client
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from typing import Any
from urllib.parse import urlsplit

import numpy as np

from benchmarks.named import example
from benchmarks.results import Cell, Result
from feedplan import Client, plan
from feedplan.client.transport import form

SMALL = "G21 G90 G64 P0.01\nF1200\nG1 X10 Y5\nX20 Y0\nM2\n"
# Time between requests [s], like that of a page that follows a job.
PAUSE = 0.01


def run(quick: bool = False) -> Result:
    """Times requests of each kind to an idle service, and to one with as many jobs as cores."""
    blocks, count = (2000, 20) if quick else (100_000, 120)
    with tempfile.TemporaryDirectory() as store, _server(store) as url:
        client = Client(url)
        done = client.plan(SMALL, "mill")
        rows = _latencies(url, done.id, count, "at rest", quick)
        with closing(_Line(url)) as ask:
            for number in range(os.cpu_count() or 1):
                ask("POST", "/v1/jobs", *_long(blocks, number))
        rows += _latencies(url, done.id, count, "while planning", quick)
        busy = [job["state"] for job in client.jobs() if job["id"] != done.id]
        for job in client.jobs():
            client.cancel(job["id"])
        rows.append(_overhead(client, 3 if quick else 30))
    return Result(
        f"Requests to the service, {os.cpu_count()} cores",
        tuple(rows),
        (
            f"{count} requests of each kind, one every {PAUSE:g} s, on a line that is kept open.",
            f"while planning: {busy.count('running')} jobs of {blocks} blocks by jerk-limited, to its end.",
            "a job: from its request to its files, less what the same plan takes without a service.",
        ),
    )


@contextmanager
def _server(store: str) -> Iterator[str]:
    """The address of a newly started service."""
    command = [sys.executable, "-m", "feedplan", "serve", "--port", "0", "--store", store]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().strip()
        finally:
            process.terminate()


def _long(blocks: int, number: int) -> tuple[bytes, str]:
    program = f"({number})\n" + example("vase").program(blocks)
    fields = {"machine": "mill", "method": "jerk-limited", "options": '{"accuracy": 1e-5}'}
    return form(fields, program.encode(), "vase.ngc")


class _Line:
    """A connection to the service that is kept open, as browsers do."""

    def __init__(self, url: str) -> None:
        parts = urlsplit(url)
        self._connection = http.client.HTTPConnection(str(parts.hostname), parts.port, timeout=60)

    def __call__(self, method: str, address: str, body: bytes | None = None, kind: str = "") -> None:
        """Sends a request and reads its whole answer."""
        self._connection.request(method, address, body, {"Content-Type": kind} if kind else {})
        answer = self._connection.getresponse()
        answer.read()
        assert answer.status < 400

    def close(self) -> None:
        self._connection.close()


def _latencies(url: str, job: str, count: int, when: str, quick: bool) -> list[dict[str, Cell]]:
    again = json.dumps({"program": SMALL, "machine": "mill"}).encode()
    part = f"/v1/jobs/{job}/setpoints?axes=X&to=0.1&format=csv"
    kinds: dict[str, tuple[Any, ...]] = {
        "health": ("GET", "/v1/health"),
        "a job": ("GET", f"/v1/jobs/{job}"),
        "list of jobs": ("GET", "/v1/jobs"),
        "setpoints of one axis, csv": ("GET", part),
        "an equal program": ("POST", "/v1/jobs", again, "application/json"),
    }
    taken: dict[str, list[float]] = {name: [] for name in kinds}
    with closing(_Line(url)) as ask:
        for _ in range(count):
            for name, request in kinds.items():
                start = time.perf_counter()
                ask(*request)
                taken[name].append(1e3 * (time.perf_counter() - start))
                time.sleep(0.0 if quick else PAUSE)
    return [_row(name, when, times) for name, times in taken.items()]


def _overhead(client: Client, count: int) -> dict[str, Cell]:
    """One row: time of a small job in the service minus the time of its plan and files in this process."""
    from feedplan.plan_folder import write_plan

    more = []
    for number in range(count):
        options = {"tolerance": 0.02 + 1e-4 * number}
        start = time.perf_counter()
        client.plan(SMALL, "mill", **options)
        middle = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            write_plan(plan(SMALL, "mill", **options), folder)
        more.append(1e3 * (2.0 * middle - start - time.perf_counter()))
    return _row("a job", "overhead", more)


def _row(request: str, service: str, times: list[float]) -> dict[str, Cell]:
    return {
        "request": request,
        "service": service,
        "median [ms]": float(np.median(times)),
        "p99 [ms]": float(np.percentile(times, 99)),
        "worst [ms]": max(times),
    }
