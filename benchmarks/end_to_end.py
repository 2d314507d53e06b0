"""From half a million blocks to audited setpoints: time of each step [s] and peak memory."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.named import example
from benchmarks.results import Cell, Result

# Example, its machine, number of blocks. The lettering has a tenth of the blocks, because its strokes are so
# much longer: this already makes hours of machining and millions of setpoints.
PARTS = (("vase", "vase", 500_000), ("head", "mill", 500_000), ("lettering", "router", 50_000))
QUICK = 100  # times fewer blocks


def run(quick: bool = False) -> Result:
    """Runs the command `feedplan plan` on every part."""
    rows: list[dict[str, Cell]] = []
    with tempfile.TemporaryDirectory() as directory:
        for part, machine, blocks in PARTS:
            program = Path(directory, f"{part}.ngc")
            program.write_text(example(part).program(blocks // (QUICK if quick else 1)), encoding="ascii")
            rows.append(_plan(program, machine, Path(directory, part)))
            shutil.rmtree(Path(directory, part))
    return Result(
        f"From program to audited setpoints at 1 kHz, {os.cpu_count()} cores",
        tuple(rows),
        ("command: the whole of `feedplan plan`, with Python's start, the report and all files.",),
    )


def _plan(program: Path, machine: str, output: Path) -> dict[str, Cell]:
    command = [str(Path(sys.executable).with_name("feedplan")), "plan", str(program)]
    command += ["--machine", machine, "-o", str(output)]
    begin = time.perf_counter()
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        complaint = process.stderr.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    seconds = time.perf_counter() - begin
    if process.returncode:
        raise RuntimeError(f"{' '.join(command)} ended with {process.returncode}: {complaint}")
    plan = json.loads((output / "plan.json").read_text(encoding="utf-8"))
    with program.open(encoding="ascii") as lines:
        count = sum(1 for _ in lines)
    return {
        "part": program.stem,
        "lines": count,
        "pieces": plan["pieces"],
        "motion [s]": plan["time"],
        **{f"{step} [s]": took for step, took in plan["compute"].items()},
        "command [s]": seconds,
        "CPU [s]": usage.ru_utime + usage.ru_stime,
        "peak [MB]": usage.ru_maxrss / 1024.0,
        "audit": "ok" if plan["audit"]["ok"] else "broken",
    }
