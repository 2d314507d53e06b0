"""Starts batches as users do, and reads the files that they write."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

PART = "G21 G90 G64 P0.01\nF1200\nG1 X10 Y5\nX20 Y0\nG2 X30 Y10 R10\nM2\n"


@dataclass(frozen=True)
class Done:
    """The result of a command: exit code and output."""

    code: int
    said: str
    told: str


def start(*arguments: str | Path) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "feedplan", "batch", *map(str, arguments)]
    return subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # The process that runs the tests may ignore this signal, and children inherit that.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


def run(*arguments: str | Path) -> Done:
    return end(start(*arguments))


def end(process: subprocess.Popen[str]) -> Done:
    said, told = process.communicate(timeout=120)
    return Done(process.returncode, said, told)


def rows(folder: Path) -> list[dict[str, Any]]:
    """The rows of batch.json."""
    found: list[dict[str, Any]] = json.loads((folder / "batch.json").read_text("utf-8"))["rows"]
    return found


def write(folder: Path, count: int) -> list[Path]:
    """Writes `count` short programs, all different."""
    folder.mkdir(exist_ok=True)
    files = [folder / f"part{number}.ngc" for number in range(count)]
    for number, file in enumerate(files):
        file.write_text(PART.replace("X10", f"X{8 + 0.01 * number:.2f}"))
    return files


def content(folder: Path) -> dict[str, Any]:
    """The files of a plan's folder, without the computing times in them."""
    files: dict[str, Any] = {file.name: file.read_bytes() for file in folder.iterdir()}
    summary = json.loads(files["plan.json"])
    del summary["compute"]
    report = files["report.html"].decode()
    files["plan.json"] = summary
    files["report.html"] = re.sub(r"(<td>Time to \w+</td><td[^>]*>)[^<]*", r"\1", report)
    return files


def wait_for(what: Any, seconds: float = 60.0) -> Any:
    """Calls `what` until its result is true, and returns that result."""
    last = time.monotonic() + seconds
    while time.monotonic() < last:
        if found := what():
            return found
        time.sleep(0.02)
    raise AssertionError("it did not happen")
