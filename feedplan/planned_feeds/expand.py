"""Writes a program as plain blocks: one block for each move, in the order in which the moves run.

Loops, calls, cycles and compensation become the resulting lines and arcs; drawings and path files become
G-code. Coordinates are machine coordinates in millimetres minus the work offset G54 of the machine file. Each
polynomial or rational piece of a spline becomes a block: G1 for a line, else G5.2 in X and Y for LinuxCNC, or
G6.2 for Fanuc. Spindle, coolant, tools, outputs, dwells, stops, messages and comments keep their places;
round brackets in a text become square ones.
"""

from __future__ import annotations

import math

import numpy as np

from feedplan.arrays import Floats, Integers
from feedplan.errors import InputError
from feedplan.machine.machine import Machine
from feedplan.planned_feeds.dialects import DialectName, has_path_control
from feedplan.planned_feeds.number import place_text
from feedplan.program.events import COMMENT, MESSAGE, Events
from feedplan.program.program import PathControl, Program

_HEADER = b"G21 G90 G17 G94 G40 G49 G80 G54"
_PLANES = {2: b"G17", 1: b"G18", 0: b"G19"}
_CONTROL = {PathControl.EXACT_STOP: b"G61.1", PathControl.EXACT_PATH: b"G61"}


class _Blocks:
    """The blocks, and the codes in force: a code is written only where it changes."""

    def __init__(self) -> None:
        self.lines: list[bytes] = []
        self._force: dict[str, bytes] = {}

    def add(self, *words: bytes) -> None:
        text = b" ".join(word for word in words if word)
        if text:
            self.lines.append(text)

    def changed(self, group: str, word: bytes) -> bytes:
        """The word, or nothing if it is in force already."""
        if self._force.get(group) == word:
            return b""
        self._force[group] = word
        return word


def expanded(program: Program, machine: Machine | None, dialect: DialectName) -> tuple[bytes, Integers]:
    """The program as plain blocks, and the move (k,) that each moving block belongs to.

    Raises InputError for words of the tool's tip (G43.4, G43.5), and for splines that the dialect lacks.
    """
    if len(program.change_move) and program.coordinate_mode is not None and program.coordinate_mode.any():
        raise InputError(
            f"{program.name}: words of the tool's tip (G43.4, G43.5) are not expanded: leave out --expand"
        )
    zero = _zero(program, machine)
    out = _Blocks()
    out.add(b"(" + _plain(program.name) + b", expanded)")
    out.add(_HEADER)
    starts = program.starts() - zero
    ends = program.target - zero
    arcs = {int(m): row for row, m in enumerate(program.arc_move)}
    splines = {int(m): row for row, m in enumerate(program.spline_move)}
    events = _events(program.events, dialect)
    of: list[int] = []
    if program.start_dwell and 0 not in events:
        out.add(_dwell(program.start_dwell, dialect))
    for m in range(len(program)):
        out.lines += events.pop(m, [])
        if has_path_control(dialect):
            out.add(out.changed("control", _control(program, m)))
        rapid = not np.isfinite(program.feed[m])
        # Written so that reading gives exactly the same number.
        feed = b"" if rapid else out.changed("F", b"F" + place_text(60.0 * float(program.feed[m])))
        if m in splines:
            of += [m] * _spline(out, program, splines[m], zero, dialect, feed)
        else:
            moved = [
                name.encode() + place_text(float(ends[m, column]))
                for column, name in enumerate(program.axes)
                if ends[m, column] != starts[m, column] or (m in arcs and name in "XYZ")
            ]
            if m in arcs:
                code = _arc(out, program, arcs[m], starts[m] + zero)
            else:
                code = [out.changed("motion", b"G0" if rapid else b"G1")]
            out.add(*code[:2], *moved, *code[2:], feed)
            of.append(m)
        if program.stop[m] and m + 1 < len(program) and m + 1 not in events:
            # A stop that no word causes, for example at a change of the tool length.
            out.add(_dwell(float(program.dwell[m]), dialect))
    for lines in events.values():
        out.lines += lines
    if not out.lines[-1].startswith((b"M2", b"M30")):
        out.add(b"M2")
    return b"\n".join(out.lines) + b"\n", np.array(of, dtype=np.int64)


def _zero(program: Program, machine: Machine | None) -> Floats:
    """G54 of the machine file in the program's axes (axes,)."""
    offsets = dict(machine.offsets).get("G54") if machine is not None else None
    if machine is None or offsets is None:
        return np.zeros(len(program.axes))
    known = dict(zip(machine.program_letters, offsets, strict=False))
    return np.array([float(known.get(name, 0.0)) for name in program.axes])


def _control(program: Program, m: int) -> bytes:
    if program.control[m] != PathControl.TOLERANCE:
        return _CONTROL[PathControl(program.control[m])]
    words = [b"G64"]
    for letter, value in ((b"P", program.blend_tolerance[m]), (b"Q", program.fit_tolerance[m])):
        if not math.isnan(value):
            words.append(letter + place_text(float(value)))
    return b" ".join(words)


def _arc(out: _Blocks, program: Program, row: int, start: Floats) -> list[bytes]:
    """The words of an arc: plane, code, centre and number of turns."""
    normal, angle = int(program.arc_normal[row]), float(program.arc_angle[row])
    words = [out.changed("plane", _PLANES[normal]), out.changed("motion", b"G2" if angle < 0.0 else b"G3")]
    for axis in range(3):
        if axis != normal:
            here = start[program.axes.index("XYZ"[axis])]
            words.append(b"IJK"[axis : axis + 1] + place_text(float(program.arc_centre[row, axis] - here)))
    turns = math.ceil(abs(angle) / math.tau - 1e-9)
    return words if turns <= 1 else [*words, b"P%d" % turns]


def _spline(out: _Blocks, program: Program, row: int, zero: Floats, dialect: DialectName, feed: bytes) -> int:
    """Writes the pieces of a spline; returns the number of blocks that move."""
    curve = program.splines
    assert curve is not None
    m = int(program.spline_move[row])
    line = int(program.line[m])
    first, last = program.spline_pieces[row : row + 2].tolist()
    for piece in range(first, last):
        span = slice(curve.offsets[piece], curve.offsets[piece + 1])
        points = curve.control_points[span] - zero
        weights = np.ones(len(points)) if curve.weights is None else curve.weights[span]
        moved = [column for column in range(points.shape[1]) if np.ptp(points[:, column]) > 0.0]
        names = [program.axes[column] for column in moved]
        own = feed if piece == first else b""
        if len(points) == 2:
            ends = [
                name.encode() + place_text(float(points[1, c])) for name, c in zip(names, moved, strict=True)
            ]
            out.add(out.changed("motion", b"G1"), *ends, own)
            continue
        if dialect == "grbl":
            raise InputError(f"{program.name} line {line}: grbl has no splines: take another dialect")
        if dialect == "linuxcnc" and set(names) - {"X", "Y"}:
            raise InputError(
                f"{program.name} line {line}: LinuxCNC's G5.2 is for X and Y alone: take the dialect fanuc"
            )
        if dialect == "linuxcnc":
            _g52(out, points, weights, program.axes, own)
        else:
            _g62(out, points, weights, program.axes, moved, own)
    return int(last - first)


def _g52(out: _Blocks, points: Floats, weights: Floats, axes: tuple[str, ...], feed: bytes) -> None:
    """Writes a rational Bézier curve as G5.2: a NURBS whose order is the number of its points; its first
    point is the tool's position, with the weight 1."""
    out.add(out.changed("plane", b"G17"))
    columns = [axes.index(name) for name in "XY"]
    for k in range(1, len(points)):
        place = [b"XY"[i : i + 1] + place_text(float(points[k, c])) for i, c in enumerate(columns)]
        code = [b"G5.2"] if k == 1 else []
        order = [b"L%d" % len(points), feed] if k == 1 else []
        out.add(*code, *place, b"P" + place_text(float(weights[k] / weights[0])), *order)
    out.add(b"G5.3")
    out.changed("motion", b"G5.2")


def _g62(
    out: _Blocks, points: Floats, weights: Floats, axes: tuple[str, ...], moved: list[int], feed: bytes
) -> None:
    """Writes a rational Bézier curve as G6.2: the order P, a knot K and a weight R for each point, and the
    last knots in blocks of their own."""
    count = len(points)
    knots = [b"0."] * count + [b"1."] * count
    for k in range(count):
        place = [axes[c].encode() + place_text(float(points[k, c])) for c in moved]
        code = [b"G6.2", b"P%d" % count] if k == 0 else []
        out.add(*code, b"K" + knots[k], *place, b"R" + place_text(float(weights[k])), feed if k == 0 else b"")
    for knot in knots[count:]:
        out.add(b"K" + knot)
    out.changed("motion", b"G6.2")


def _dwell(seconds: float, dialect: DialectName) -> bytes:
    """G4 with seconds as P; for Fanuc as X, because its P is in milliseconds."""
    return (b"G4 X" if dialect == "fanuc" else b"G4 P") + place_text(seconds)


def _events(events: Events, dialect: DialectName) -> dict[int, list[bytes]]:
    """The blocks of the events before each move, by the index of the move."""
    before: dict[int, list[bytes]] = {}
    words = events.words()
    for row in range(len(events)):
        letter, number = chr(events.letter[row]), float(events.number[row])
        if letter == MESSAGE:
            text = b"(MSG," + _plain(events.texts[int(number)]) + b")"
        elif letter == COMMENT:
            text = b"(" + _unbracketed(events.texts[int(number)]).encode() + b")"
        elif letter == "G" and number == 4.0:
            text = _dwell(float(events.p[row]), dialect)
        elif letter == "M" and number == 6.0:
            text = b"M6"
        elif letter == "M" and number in (67.0, 68.0):
            text = b"M%d E%d Q" % (number, events.p[row]) + place_text(float(events.q[row]))
        else:
            text = words[row].encode()
        before.setdefault(int(events.move[row]), []).append(text)
    return before


def _plain(text: str) -> bytes:
    """The text without characters that a comment cannot have."""
    return _unbracketed(text).encode("ascii", "replace")


def _unbracketed(text: str) -> str:
    """The text with square instead of round brackets, which would end a comment."""
    return text.replace("(", "[").replace(")", "]")
