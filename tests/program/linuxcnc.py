"""Reads programs with LinuxCNC's interpreter and with feedplan, as lists of moves that can be compared."""

from __future__ import annotations

import json
import math
import re
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from feedplan.program.program import MoveKind, Program

PYTHON = "/usr/bin/python3"
FOLDERS = (Path("/usr/share/linuxcnc/ncfiles"), Path("/usr/share/doc/linuxcnc/examples/sample-configs"))
ABSENT = "LinuxCNC is not installed: apt-get install linuxcnc-uspace"

# Allowed difference of moves [mm, deg].
TOLERANCE = 1e-9
AXES = "XYZABCUVW"

needs_linuxcnc = pytest.mark.skipif(shutil.which("rs274") is None, reason=ABSENT)

Move = list[Any]


def reference(
    programs: Sequence[Path], tools: Path, ini: Path | None = None
) -> list[tuple[list[Move], str | None]]:
    """The moves of each program in LinuxCNC's interpreter with a tool table, and its error if it stops."""
    requests = [
        json.dumps({"program": str(program), "tools": str(tools), "ini": str(ini) if ini else None})
        for program in programs
    ]
    done = subprocess.run(
        [PYTHON, str(Path(__file__).with_name("linuxcnc_moves.py"))],
        input="\n".join(requests),
        capture_output=True,
        text=True,
        errors="replace",
        check=True,
    )
    answers = [json.loads(line) for line in done.stdout.splitlines() if line.startswith('{"moves"')]
    assert len(answers) == len(programs), done.stdout[-1000:]
    return [
        (answer["moves"], answer["error"] and f"line {answer['error'][1]}: {answer['error'][0]}")
        for answer in answers
    ]


def printed(program: Path, tools: Path) -> list[Move]:
    """The moves of a program as the command `rs274` prints them, with four decimals in its units.

    After a tool change the Python module assumes that the tool is at the end of the last straight move; this
    command does not.
    """
    with tempfile.TemporaryDirectory() as folder:
        # This command reads the lengths of the table as inches.
        table = Path(folder, "tools.tbl")
        table.write_text(re.sub(r"([XYZUVWD])([-+.\d]+)", _in_inches, tools.read_text()))
        done = subprocess.run(
            ["rs274", "-t", str(table), "-g", str(program)],
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
        )
    state = _Printed()
    for call, text in re.findall(r"N\S+ +([A-Z_0-9]+)\((.*)\)$", done.stdout, re.MULTILINE):
        state.take(call, text)
    return state.moves


def _in_inches(word: re.Match[str]) -> str:
    return f"{word[1]}{float(word[2]) / 25.4:.12f}"


class _Printed:
    """Collects the moves that `rs274` prints."""

    def __init__(self) -> None:
        self.unit = 1.0
        self.normal = 2
        self.offsets = {
            name: np.zeros(9) for name in ("SET_G5X_OFFSET", "SET_G92_OFFSET", "USE_TOOL_LENGTH_OFFSET")
        }
        self.turn = 0.0
        self.moves: list[Move] = []

    def take(self, call: str, text: str) -> None:
        numbers = [float(number) for number in re.findall(r"-?\d+(?:\.\d+)?", text)]
        if call == "USE_LENGTH_UNITS":
            self.unit = 25.4 if "INCHES" in text else 1.0
        elif call == "SELECT_PLANE":
            self.normal = {"XY": 2, "YZ": 0, "XZ": 1}[text[-2:]]
        elif call in self.offsets:
            self.offsets[call] = self.scaled(numbers[1:] if call == "SET_G5X_OFFSET" else numbers)
        elif call == "SET_XY_ROTATION":
            self.turn = math.radians(numbers[0])
        elif call in ("STRAIGHT_TRAVERSE", "STRAIGHT_FEED"):
            kind = "rapid" if call == "STRAIGHT_TRAVERSE" else "feed"
            self.moves.append([kind, 0, self.machine(numbers)])
        elif call == "ARC_FEED":
            end, centre = [0.0] * 9, [0.0] * 9
            u, v = (self.normal + 1) % 3, (self.normal + 2) % 3
            end[u], end[v], centre[u], centre[v], turns, end[self.normal] = numbers[:6]
            end[3:6] = numbers[6:9]
            middle = self.machine(centre)
            self.moves.append(["arc", 0, self.machine(end), self.normal, [middle[u], middle[v]], int(turns)])
        elif call == "DWELL":
            self.moves.append(["dwell", 0, numbers[0]])

    def scaled(self, numbers: Sequence[float]) -> np.ndarray:
        place = np.zeros(9)
        place[: len(numbers)] = numbers
        place[[0, 1, 2, 6, 7, 8]] *= self.unit
        return place

    def machine(self, numbers: Sequence[float]) -> list[float]:
        place = self.scaled(numbers) + self.offsets["SET_G92_OFFSET"]
        x, y = place[:2]
        place[:2] = (
            x * math.cos(self.turn) - y * math.sin(self.turn),
            x * math.sin(self.turn) + y * math.cos(self.turn),
        )
        moved = place + self.offsets["SET_G5X_OFFSET"] + self.offsets["USE_TOOL_LENGTH_OFFSET"]
        return [float(value) for value in moved]


def moves_of(program: Program) -> list[Move]:
    """The moves of a program that feedplan has read, in the form of `reference`."""
    columns = [AXES.index(name) for name in program.axes]
    arcs = iter(range(len(program.arc_move)))
    curves = iter(range(len(program.spline_move)))
    ends = np.zeros((len(program), len(AXES)))
    ends[:, columns] = program.target
    starts = np.zeros_like(ends)
    starts[:, columns] = program.starts()
    moves: list[Move] = []
    if program.start_dwell:
        moves.append(["dwell", 0, program.start_dwell])
    for row, (kind, line) in enumerate(zip(program.kind, program.line, strict=True)):
        end = ends[row].tolist()
        if kind == MoveKind.ARC:
            arc = next(arcs)
            normal = int(program.arc_normal[arc])
            plane = ((normal + 1) % 3, (normal + 2) % 3)
            centre = [float(program.arc_centre[arc][axis]) for axis in plane]
            angle = float(program.arc_angle[arc])
            moves.append(["arc", int(line), end, normal, centre, _turns(angle)])
        elif kind == MoveKind.SPLINE:
            moves += _points_of_spline(program, next(curves), int(line), starts[row])
        else:
            moves.append(["rapid" if kind == MoveKind.RAPID else "feed", int(line), end])
        if program.dwell[row]:
            moves.append(["dwell", int(line), float(program.dwell[row])])
    return moves


def _turns(angle: float) -> int:
    """The number of turns that an arc begins, as LinuxCNC counts them, with the sign of its direction."""
    whole = math.ceil(abs(angle) / math.tau - 1e-6)
    return int(math.copysign(max(whole, 1), angle))


def _points_of_spline(program: Program, row: int, line: int, start: np.ndarray) -> list[Move]:
    """The points of a spline in LinuxCNC's preview: 15 per control point, evenly spaced in the parameter."""
    assert program.splines is not None
    first, last = program.spline_pieces[row : row + 2]
    widths = program.splines.width[first:last]
    knots = np.concatenate([[0.0], np.cumsum(widths)])
    degree = int(np.diff(program.splines.offsets[first : first + 2])[0]) - 1
    count = 15 * (last - first + degree)
    columns = [AXES.index(name) for name in program.axes]
    moves: list[Move] = []
    for step in range(1, count + 1):
        u = knots[-1] * step / count
        piece = min(int(np.searchsorted(knots, u, side="right")) - 1, len(widths) - 1)
        end = start.copy()
        end[columns] = _bezier(program, first + piece, (u - knots[piece]) / widths[piece])
        moves.append(["feed", line, end.tolist()])
    return moves


def _bezier(program: Program, piece: int, t: float) -> np.ndarray:
    splines = program.splines
    assert splines is not None
    span = slice(splines.offsets[piece], splines.offsets[piece + 1])
    points = splines.control_points[span]
    weights = np.ones(len(points)) if splines.weights is None else splines.weights[span]
    rows = np.column_stack([points * weights[:, None], weights])
    while len(rows) > 1:
        rows = (1 - t) * rows[:-1] + t * rows[1:]
    return np.asarray(rows[0, :-1] / rows[0, -1])


def difference(
    ours: Sequence[Move], theirs: Sequence[Move], tolerance: float = TOLERANCE, so_far: bool = False
) -> str | None:
    """The first difference of two lists of moves, in a sentence; straight moves of no length are ignored.

    With `so_far` the second list may end earlier.
    """
    mine, others = _moving(ours), _moving(theirs)
    for i in range(len(others) if so_far else max(len(mine), len(others))):
        a = mine[i] if i < len(mine) else None
        b = others[i] if i < len(others) else None
        if a is None or b is None or not _same(a, b, tolerance):
            return f"move {i}: feedplan has {a}, LinuxCNC {b}"
    return None


def _moving(moves: Sequence[Move]) -> list[Move]:
    position = [0.0] * 9
    kept = []
    for move in moves:
        if move[0] in ("rapid", "feed"):
            if max(abs(a - b) for a, b in zip(move[2], position, strict=True)) > TOLERANCE:
                kept.append(move)
        elif move[0] == "dwell" and kept and kept[-1][0] == "dwell":
            kept[-1] = ["dwell", move[1], kept[-1][2] + move[2]]
        elif move[0] == "arc" or (move[0] == "dwell" and move[2] > 0.0):
            kept.append(move)
        if isinstance(move[2], list):
            position = move[2]
    return kept


def _same(a: Move, b: Move, tolerance: float) -> bool:
    if a[0] != b[0]:
        return False
    if a[0] == "dwell":
        return bool(abs(a[2] - b[2]) <= tolerance)
    numbers = [*zip(a[2], b[2], strict=True)]
    if a[0] == "arc":
        if a[3] != b[3] or a[5] != b[5]:
            return False
        numbers += zip(a[4], b[4], strict=True)
    return all(abs(x - y) <= tolerance for x, y in numbers)
