"""Runs programs in LinuxCNC's simulator: as they are, with planned feeds, and as the plan's stream.

A row has the time in the simulator, the time by the model of LinuxCNC, and the greatest distance of the
joints from the path of the program. Times include the program's pauses.
"""

from __future__ import annotations

import argparse
import re
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from scipy.spatial import cKDTree

import feedplan
from benchmarks import results
from benchmarks.results import Cell, Result
from benchmarks.simulator.alone import missing
from benchmarks.simulator.session import Run, SimulatorError, recorded
from feedplan import Axis, Machine, Program
from feedplan.geometry.build import build_path
from feedplan.geometry.corners import Corners
from feedplan.machine.controller import Controller
from feedplan.today import time_by

Array = NDArray[np.float64]

MACHINE = Machine("simulated", tuple(Axis(name, 100.0, 500.0) for name in "XYZ"), period=0.001)
# Distance between the points that represent a path [mm].
_APART = 0.01
_COMMENT = re.compile(rb"\([^()\r\n]*\)?|;[^\r\n]*")
_MM_PER_INCH = 25.4


def prepared(content: bytes, feeds: float, tolerance: float) -> bytes:
    """The program with its F words times `feeds`, and with P `tolerance` [mm] in each G64 without P."""
    code = _COMMENT.sub(lambda found: b" " * len(found[0]), content)
    unit = _MM_PER_INCH if re.search(rb"[Gg]0*20(?![\d.])", code) else 1.0
    edits = [
        (found.span(1), f"{feeds * float(found[1]):.6f}".rstrip("0").encode())
        for found in re.finditer(rb"[Ff][ \t]*(\d+\.?\d*|\.\d+)", code)
    ]
    edits += [
        ((found.end(), found.end()), f" P{tolerance / unit:.6f}".encode())
        for found in re.finditer(rb"[Gg]64(?![\d.])(?![^\r\n]*[Pp])", code)
    ]
    for (begin, end), text in sorted(edits, reverse=True):
        content = content[:begin] + text + content[end:]
    return content


def places(program: Program, machine: Machine) -> Array:
    """Points of the programmed path (n, 3)."""
    path = build_path(program, machine, corners=Corners.PROGRAMMED)
    # The ends of all pieces are included, so that every corner is a point.
    ends = path.lengths.length(np.arange(len(path)), path.width)
    s = np.union1d(np.arange(0.0, path.length, _APART), np.minimum(ends, path.length))
    whole = np.zeros((len(s), 3))
    whole[:, ["XYZ".index(name) for name in path.axes]] = path.evaluate(s)
    return np.vstack([np.zeros(3), whole])


def greatest_distance(points: Array, way: Array) -> float:
    """The greatest distance of points from a polyline whose lines are short [mm]."""
    near = np.clip(cKDTree(way).query(points)[1], 1, len(way) - 2)
    best = np.full(len(points), np.inf)
    for first in (near - 1, near):
        along = way[first + 1] - way[first]
        square = np.maximum((along**2).sum(axis=1), 1e-300)
        share = np.clip(((points - way[first]) * along).sum(axis=1) / square, 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(points - way[first] - share[:, None] * along, axis=1))
    return float(best.max(initial=0.0))


def row(file: Path, machine: Machine, feeds: float, tolerance: float) -> dict[str, Cell]:
    """One row of the table. Raises SimulatorError and FeedplanError."""
    original = prepared(file.read_bytes(), feeds, tolerance)
    program = feedplan.read_program(original, machine, name=file.name)
    # LinuxCNC and the plan follow a program without G64 within the same tolerance.
    own = {} if np.isfinite(program.blend_tolerance).any() else {"tolerance": tolerance}
    plan = feedplan.plan(program, machine, **own)
    rewritten = feedplan.planned_program(plan)
    again = feedplan.read_program(rewritten.content, machine, name=file.name)
    models = [
        time_by(Controller("linuxcnc"), each, machine, own.get("tolerance")) for each in (program, again)
    ]
    with tempfile.TemporaryDirectory() as place:
        feedplan.write_plan(plan, place, ["halstreamer"])
        stream = Path(place) / "setpoints.halstream"
        runs = [Run(original, models[0]), Run(rewritten.content, models[1]), Run(stream, plan.time)]
        first, second, third = recorded(machine, runs, tolerance)
    pauses = plan.path.pauses
    there = [first.motion + pauses, second.motion + pauses]
    setpoints, played = plan.setpoints().all().position, third.played
    columns = ["XYZ".index(name) for name in plan.path.axes]
    way = places(program, machine)
    for each in (first, second, third):
        for sentence in each.said:
            print(f"{file.name}: {sentence}", file=sys.stderr)
    return {
        "program": f"{file.name} F × {feeds:g}" if feeds != 1.0 else file.name,
        "original [s]": there[0],
        "model [s]": models[0],
        "model off [%]": 100.0 * (models[0] / there[0] - 1.0),
        "planned feeds [s]": there[1],
        "model of it [s]": models[1],
        "of it off [%]": 100.0 * (models[1] / there[1] - 1.0),
        "plan [s]": plan.time,
        "stream [s]": (len(played) - 1) * machine.period,
        "same rows": "yes" if np.array_equal(played[:, columns], setpoints) else "no",
        "stream saves [%]": 100.0 * (1.0 - (len(played) - 1) * machine.period / there[0]),
        "original off path [mm]": greatest_distance(first.position[first.moving], way),
        "planned off path [mm]": greatest_distance(second.position[second.moving], way),
        "stream off path [mm]": greatest_distance(played, way),
    }


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.simulator", description=__doc__)
    parser.add_argument("programs", nargs="+", type=Path, metavar="PROGRAM")
    parser.add_argument("--machine", help="of X, Y, Z (default 100 mm/s and 500 mm/s² of each axis)")
    parser.add_argument("--feeds", type=float, default=1.0, help="F words times this")
    parser.add_argument("--tolerance", type=float, default=0.05, help="[mm] where a program has no G64 P")
    parser.add_argument(
        "--output", type=Path, default=Path("out/benchmarks"), help="directory of the JSON file"
    )
    arguments = parser.parse_args()
    if (reason := missing()) is not None:
        parser.error(reason)
    machine = MACHINE if arguments.machine is None else Machine.load(arguments.machine)

    def one(file: Path) -> dict[str, Cell] | None:
        try:
            return row(file, machine, arguments.feeds, arguments.tolerance)
        except (SimulatorError, feedplan.FeedplanError) as error:
            print(f"{file.name}: {error}", file=sys.stderr)
            return None

    with ThreadPoolExecutor(2) as pool:
        rows = [found for found in pool.map(one, arguments.programs) if found is not None]
    if not rows:
        sys.exit(1)
    result = Result("LinuxCNC's simulator, and the model of LinuxCNC", tuple(rows))
    results.show(result, Console(width=240))
    results.store("simulator", result, arguments.output)


if __name__ == "__main__":
    main()
