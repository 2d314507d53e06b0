"""Overhead of a job over its plan alone: in one process, in several processes, and on a Dask cluster."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from benchmarks.results import Cell, Result
from feedplan import Machine, plan, write_plan

WORKERS = 2


def run(quick: bool = False) -> Result:
    """Plans many small programs in each of the three ways; the files must be equal."""
    count = 10 if quick else 500
    with tempfile.TemporaryDirectory() as home:
        folder = Path(home)
        programs = _programs(folder / "programs", count)
        here, one = _one_process(programs, folder / "one"), folder / "one"
        rows = [_row("one process", 1, here, here, count, count)]
        own, many = _batch(programs, folder / "many", "--jobs", str(WORKERS)), folder / "many"
        rows.append(_row("processes", WORKERS, *own, _equal(one, many), count))
        with _cluster(folder / "cluster") as address:
            other = _batch(programs, folder / "spread", "--cluster", address)
        rows.append(_row("Dask cluster", WORKERS, *other, _equal(one, folder / "spread"), count))
    return Result(
        f"{count} programs of 40 moves, bang-bang on mill, with setpoints and report",
        tuple(rows),
        (
            "planning: from the program to its files, inside a worker.",
            "overhead: what a worker takes for a job besides, its time over all jobs less their planning.",
            "equal: folders whose files are those of one process, but for the computing times in them.",
        ),
    )


def _programs(folder: Path, count: int) -> list[Path]:
    """Writes `count` programs of 40 moves along a circle, each circle at another centre."""
    folder.mkdir()
    files = [folder / f"part{number:04}.ngc" for number in range(count)]
    for number, file in enumerate(files):
        points = (
            f"X{10 * math.cos(0.3 * k) + 0.01 * number:.3f} Y{10 * math.sin(0.3 * k) + 0.02 * number:.3f}\n"
            for k in range(40)
        )
        file.write_text(f"G21 G90 G64 P0.01\nF3000\nG1 {''.join(points)}M2\n", encoding="ascii")
    return files


def _one_process(programs: list[Path], folder: Path) -> float:
    """The time of planning all programs one after the other [s]."""
    machine = Machine.load("mill")
    start = time.perf_counter()
    for file in programs:
        write_plan(plan(file, machine), folder / file.stem)
    return time.perf_counter() - start


def _batch(programs: list[Path], folder: Path, *options: str) -> tuple[float, float]:
    """The time of a batch, and the sum of the times of its plans in the workers [s]."""
    command = [sys.executable, "-m", "feedplan", "batch", *map(str, programs), "-o", str(folder), *options]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    told: dict[str, Any] = json.loads((folder / "batch.json").read_text("utf-8"))
    return told["seconds"], sum(row["computing"] for row in told["rows"])


def _row(name: str, workers: int, wall: float, planning: float, equal: int, count: int) -> dict[str, Cell]:
    return {
        "way": name,
        "workers": workers,
        "time [s]": wall,
        "a job [ms]": 1e3 * wall / count,
        "planning [ms]": 1e3 * planning / count,
        "overhead [ms]": 1e3 * (workers * wall - planning) / count,
        "equal": f"{equal} of {count}",
    }


def _equal(one: Path, other: Path) -> int:
    """The number of folders with equal files."""
    return sum(_content(folder) == _content(other / folder.name) for folder in one.iterdir())


def _content(folder: Path) -> dict[str, Any]:
    files: dict[str, Any] = {file.name: file.read_bytes() for file in folder.iterdir()}
    files["plan.json"] = {**json.loads(files["plan.json"]), "compute": None}
    files["report.html"] = re.sub(rb"(<td>Time to \w+</td><td[^>]*>)[^<]*", rb"\1", files["report.html"])
    return files


@contextmanager
def _cluster(folder: Path) -> Iterator[str]:
    """The address of a cluster of two worker processes with one thread each."""
    from distributed import Client, LocalCluster

    with (
        LocalCluster(
            n_workers=WORKERS,
            threads_per_worker=1,
            dashboard_address=":0",
            local_directory=str(folder),
            silence_logs=50,
        ) as cluster,
        Client(cluster) as client,
    ):
        client.wait_for_workers(WORKERS)
        yield cluster.scheduler_address
