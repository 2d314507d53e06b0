"""Reads a path file (curves in JSON) into a Program:

    {"unit": "mm", "axes": ["X", "Y", "Z"], "feed": 80.0, "rapid": true,
     "curves": [{"degree": 3, "control_points": [[0, 0, 0], …], "knots": […], "weights": […], "feed": 60.0}]}

Only "curves" is required. "unit" is "mm" (default) or "inch", for linear axes and feeds; rotary ones are in
degrees. "axes" names the columns; by default they are the first of X, Y, Z, A, B, C. If one of the names is
no letter of a program, such as "j1", all are axes of the machine in its own units, and "unit" must be left
out. "feed" is in units per second and may be given for each curve. Without "knots", degree + 1 control points
are a Bézier curve, and more points are a B-spline with clamped uniform knots; the number of knots must be
points + degree + 1. Each curve must start where the one before ends, unless "rapid": true adds a rapid to its
start. The program starts where its first curve does. Points are in machine coordinates; on a five-axis
machine they are joint positions, as without G43.4.
"""

from __future__ import annotations

import json
import math
from typing import Any, NoReturn

import numpy as np

from feedplan.arguments import shown
from feedplan.arrays import Floats
from feedplan.curves.composite import MAX_DEGREE, CompositeCurve
from feedplan.errors import InputError, ProgramError
from feedplan.machine.axis import AXIS_LETTERS, AXIS_NAME, ROTARY_LETTERS
from feedplan.machine.machine import Machine
from feedplan.program.moves import TOUCHING, Moves, program_axes
from feedplan.program.program import Program
from feedplan.units import MM_PER_INCH

MAX_BYTES = 1 << 28
MAX_POINTS = 10_000_000

_DEFAULT_AXES = "XYZABC"
_FARTHEST = 1e6  # [mm]; larger coordinates are a mistake
_FARTHEST_TURN = 1e8  # [deg]
_KEYS = {"unit", "axes", "feed", "rapid", "curves"}
_CURVE_KEYS = {"degree", "control_points", "knots", "weights", "feed"}
_ABSENT = object()


def read_path_file(
    content: bytes,
    machine: Machine | None = None,
    name: str = "path.json",
    feed: float | None = None,
    *,
    max_points: int = MAX_POINTS,
) -> Program:
    """The curves of a path file as spline moves; `line` is the number of the curve, from 1.

    `feed` [mm/s, or the unit of the axes per second] is the feed of curves that have none.

    Raises ProgramError in one sentence that names the place in the file.
    """
    return _PathFile(name, machine, feed, max_points).read(content)


class _PathFile:
    def __init__(self, name: str, machine: Machine | None, feed: float | None, max_points: int) -> None:
        self.name = name
        self.machine = machine
        self.feed = feed
        self.max_points = max_points
        self.curve: int | None = None

    def read(self, content: bytes) -> Program:
        table = self._parse(content)
        self._known(table, _KEYS, "")
        unit = table.get("unit", "mm")
        self._require(unit in ("mm", "inch"), "unit", unit, '"mm" or "inch"')
        scale = MM_PER_INCH if unit == "inch" else 1.0
        feed = self._feed(table, "feed", None)
        rapid = table.get("rapid", False)
        self._require(isinstance(rapid, bool), "rapid", rapid, "true or false")
        curves = table.get("curves", _ABSENT)
        self._require(isinstance(curves, list) and bool(curves), "curves", curves, "a list of curves")
        names = self._names(table, curves)
        lettered = set(names) <= set(AXIS_LETTERS)
        self._require(lettered or "unit" not in table, "unit", unit, "none: these axes have their own")
        axes = program_axes(names) if lettered else names
        columns = [axes.index(name) for name in names]
        linear = np.array([lettered and name not in ROTARY_LETTERS for name in names])
        scales, reach = np.where(linear, scale, 1.0), np.where(linear, _FARTHEST, _FARTHEST_TURN)

        moves = Moves(axes, self.feed)
        count, unlimited = 0, 0
        for i, row in enumerate(curves):
            self.curve = i + 1
            place = f"curves[{i}]"
            self._require(isinstance(row, dict), place, row, "a table with degree and control_points")
            self._known(row, _CURVE_KEYS, f"{place}.")
            points = self._points(row, f"{place}.control_points", len(names)) * scales
            if not (np.abs(points) <= reach).all():
                k, column = (int(place) for place in np.argwhere(np.abs(points) > reach)[0])
                far = f"{reach[column]:g} {'mm' if linear[column] else 'deg' if lettered else 'of its unit'}"
                self._fail(f"{place}.control_points[{k}] is farther than {far}: check the unit")
            count += len(points)
            if count > self.max_points:
                self._fail(f"there are more than {self.max_points} control points: split the file")
            wide = np.zeros((len(points), len(axes)))
            wide[:, columns] = points
            curve = self._curve(row, place, wide)
            own = self._feed(row, f"{place}.feed", feed)
            unlimited += own is None and self.feed is None
            self._join(moves, curve, rapid, place, i + 1)
            moves.spline(curve, None if own is None else own * scale, i + 1)
        self.curve = None
        if not len(moves):
            self._fail("curves move nothing: give curves of some length")
        missing = f"{unlimited} of {len(curves)} curves have no feed: only the machine limits them; give feed"
        return moves.program(self.name, (missing,) if unlimited else ())

    def _join(self, moves: Moves, curve: CompositeCurve, rapid: bool, place: str, line: int) -> None:
        start = curve.control_points[0]
        gap = moves.gap(start)
        if gap > TOUCHING and not rapid:
            self._fail(
                f"{place} starts {gap:.6g} mm from the end of the curve before: join them, or set "
                '"rapid": true to go there by a rapid'
            )
        moves.go_to(start, line)

    def _curve(self, row: dict[str, Any], place: str, points: Floats) -> CompositeCurve:
        degree = row.get("degree", _ABSENT)
        good = type(degree) is int and 1 <= degree <= MAX_DEGREE
        self._require(good, f"{place}.degree", degree, f"an integer from 1 to {MAX_DEGREE}")
        self._require(
            len(points) > degree, f"{place}.control_points", f"{len(points)} points", f"more than {degree}"
        )
        n = len(points)
        # Clamped uniform knots; degree + 1 points are a Bézier curve.
        knots = np.clip(np.arange(n + degree + 1, dtype=np.float64), degree, n) - degree
        if row.get("knots") is not None:
            knots = self._numbers(row["knots"], f"{place}.knots", n + degree + 1)
        weights = None
        if row.get("weights") is not None:
            weights = self._numbers(row["weights"], f"{place}.weights", n)
        try:
            return CompositeCurve.from_nurbs(points, knots, degree, weights)
        except InputError as error:
            self._fail(f"{place}: {error}")

    def _parse(self, content: bytes) -> dict[str, Any]:
        def refuse(word: str) -> None:
            self._fail(f"the number {word} is not finite: give a number")

        def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
            table = dict(pairs)
            if len(table) < len(pairs):
                keys = [key for key, _ in pairs]
                twice = next(key for key in keys if keys.count(key) > 1)
                self._fail(f"{shown(twice)} is given twice in one table: give it once")
            return table

        try:
            table = json.loads(content, parse_constant=refuse, object_pairs_hook=once)
        except RecursionError:
            self._fail("its lists are nested too deep: give a path file")
        except UnicodeDecodeError:
            self._fail("it is no text: give a path file in UTF-8")
        except ValueError as error:
            self._fail(f"it is not valid JSON ({error}): correct it there")
        if not isinstance(table, dict):
            self._fail('it holds no table: give {"unit": "mm", "curves": […]}')
        return table

    def _names(self, table: dict[str, Any], curves: list[Any]) -> tuple[str, ...]:
        """The names of the columns."""
        given = table.get("axes")
        if given is None:
            first = curves[0].get("control_points") if isinstance(curves[0], dict) else None
            row = first[0] if isinstance(first, list) and first else None
            good = isinstance(row, list) and 2 <= len(row) <= len(_DEFAULT_AXES)
            remedy = f"2 to {len(_DEFAULT_AXES)} numbers, or name the columns by axes"
            self._require(good, "curves[0].control_points[0]", row, remedy)
            names = tuple(_DEFAULT_AXES[: len(row or [])])
        else:
            good = isinstance(given, list) and all(
                isinstance(v, str) and AXIS_NAME.fullmatch(v) for v in given
            )
            good = good and 0 < len(set(given)) == len(given) <= len(AXIS_LETTERS)
            remedy = f"up to {len(AXIS_LETTERS)} different names of axes, such as X or j1"
            self._require(good, "axes", given, remedy)
            names = tuple(given)
        for name in names if self.machine else ():
            known = self.machine.program_letters if self.machine else ()
            if name not in known:
                self._fail(
                    f"axes has {name} and the machine does not: use {', '.join(known)}, or another machine"
                )
        return names

    def _points(self, row: dict[str, Any], place: str, width: int) -> Floats:
        rows = row.get("control_points", _ABSENT)
        self._require(isinstance(rows, list), place, rows, "a list of points")
        for k, point in enumerate(rows):
            good = isinstance(point, list) and len(point) == width and all(map(_is_number, point))
            self._require(good, f"{place}[{k}]", point, f"{width} finite numbers")
        return np.array(rows, dtype=np.float64).reshape(-1, width)

    def _numbers(self, values: Any, place: str, count: int) -> Floats:
        self._require(isinstance(values, list), place, values, f"a list of {count} numbers")
        self._require(len(values) == count, place, f"{len(values)} numbers", f"{count}")
        for k, value in enumerate(values):
            self._require(_is_number(value), f"{place}[{k}]", value, "a finite number")
        return np.array(values, dtype=np.float64)

    def _feed(self, table: dict[str, Any], place: str, default: float | None) -> float | None:
        value = table.get("feed")
        if value is None:
            return default
        self._require(_is_number(value) and 1e-9 <= value <= 1e9, place, value, "a positive feed per second")
        return float(value)

    def _known(self, table: dict[str, Any], keys: set[str], place: str) -> None:
        for key in table:
            if key not in keys:
                self._fail(f"{place}{_shown(key)} is not understood: use {', '.join(sorted(keys))}")

    def _require(self, condition: bool, place: str, value: object, remedy: str) -> None:
        if not condition:
            shown = "missing" if value is _ABSENT else _shown(value)
            self._fail(f"{place} is {shown}: give {remedy}")

    def _fail(self, sentence: str) -> NoReturn:
        raise ProgramError(f"{self.name}: {sentence}", self.curve)


def _is_number(value: object) -> bool:
    if type(value) is int:
        return abs(value) < 1 << 1000
    return type(value) is float and math.isfinite(value)


def _shown(value: object) -> str:
    """A value as JSON in one short line."""
    text = value if isinstance(value, str) and value.endswith((" points", " numbers")) else json.dumps(value)
    return text if len(text) <= 40 else f"{text[:37]}..."
