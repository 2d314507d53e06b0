"""Lets a feedplan service plan a program: one file that needs only the standard library, for scripts of CAM
systems.

    python service_client.py part.ngc --machine mill --server http://127.0.0.1:8000 -o part

It sends the program, shows the progress, and loads plan.json, report.html and setpoints.csv to a folder. The
token is in the file that FEEDPLAN_TOKEN_FILE names. Copy this file: feedplan itself is not needed on this
computer.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent


class Service:
    """The service at an address."""

    def __init__(self, address: str, token: str | None) -> None:
        self.address = address.rstrip("/")
        self.headers = {} if token is None else {"Authorization": f"Bearer {token}"}

    def open(self, path: str, body: Any = None, **headers: str) -> Any:
        """The answer to a GET request, or to a POST request of JSON."""
        data = None if body is None else json.dumps(body).encode()
        content = {} if body is None else {"Content-Type": "application/json"}
        request = urllib.request.Request(self.address + path, data, {**self.headers, **content, **headers})
        try:
            return urllib.request.urlopen(request, timeout=60)
        except urllib.error.HTTPError as error:
            with error:
                sys.exit(f"error: {json.load(error)['detail']}")
        except OSError as error:
            sys.exit(f"error: {self.address} cannot be reached ({error}): start it by `feedplan serve`")

    def json(self, path: str, body: Any = None) -> Any:
        with self.open(path, body) as answer:
            return json.load(answer)

    def follow(self, job: dict[str, Any]) -> dict[str, Any]:
        """Shows the progress of a job until its end; returns the job."""
        with self.open(job["links"]["events"]) as events:
            for line in events:
                name, _, value = line.decode().rstrip("\n").partition(": ")
                if name == "data" and "stage" in (data := json.loads(value)):
                    print(f"{100 * data['done']:3.0f} % {data['stage']}", file=sys.stderr)
        ended: dict[str, Any] = self.json(job["links"]["self"])
        return ended


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("program", nargs="?", type=Path, default=HERE / "part.ngc")
    parser.add_argument("--machine", default="mill", help="a bundled machine, or a machine file (.toml)")
    parser.add_argument("--method", default="bang-bang")
    parser.add_argument("--tolerance", type=float, help="allowed distance from the programmed path [mm]")
    parser.add_argument("--server", default=os.environ.get("FEEDPLAN_SERVER", "http://127.0.0.1:8000"))
    parser.add_argument("-o", "--output", type=Path, default=Path("out/service"))
    given = parser.parse_args()

    token_file = os.environ.get("FEEDPLAN_TOKEN_FILE")
    service = Service(given.server, Path(token_file).read_text().split()[0] if token_file else None)
    machine = Path(given.machine).read_text("utf-8") if given.machine.endswith(".toml") else given.machine
    request = {
        "name": given.program.name,
        "program": given.program.read_text("utf-8", errors="replace"),
        "machine": machine,
        "method": given.method,
        "options": {} if given.tolerance is None else {"tolerance": given.tolerance},
    }
    job = service.follow(service.json("/v1/jobs", request))
    if job["state"] != "done":
        sys.exit(f"error: {job['problem']['detail']}")
    given.output.mkdir(parents=True, exist_ok=True)
    for name, link in (
        ("plan.json", job["links"]["result"]),
        ("report.html", job["links"]["report"]),
        ("setpoints.csv", job["links"]["setpoints"] + "?format=csv"),
    ):
        with service.open(link) as answer:
            (given.output / name).write_bytes(answer.read())
    result = job["result"]
    print(f"time         {result['time']:.3f} s, at least {result['lower_bound']:.3f} s")
    print(f"files        {given.output}")
    for failure in result["failures"]:
        sys.exit(f"error: the audit failed: {failure}")


if __name__ == "__main__":
    try:
        main()
    except OSError as error:  # a file that cannot be read or written
        sys.exit(f"error: {error.filename}: {error.strerror}")
