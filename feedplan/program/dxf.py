"""Reads a drawing (DXF) into a Program, with the package ezdxf: `pip install feedplan[dxf]`.

| entity | moves |
|---|---|
| LINE | a line |
| LWPOLYLINE, POLYLINE | lines, and arcs where they bulge |
| ARC, CIRCLE | an arc, where it is parallel to XY |
| ELLIPSE | an exact rational curve |
| SPLINE | its NURBS curve; through its fit points as CAD systems do, where it has no control points |

The entities of the model space are followed in drawing order. An open entity is followed backwards if its
end, not its start, touches the position of the tool; between entities that do not touch there is a rapid.
Coordinates are those of the drawing, in its units ($INSUNITS). Other entities, entities on layers that are
off or frozen, and arcs and polylines in a tilted plane are left out with a warning. A drawing has no feed:
the limits of the machine set the speed.
"""

from __future__ import annotations

import io
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from feedplan.arrays import Floats
from feedplan.curves.composite import CompositeCurve
from feedplan.errors import InputError, MissingPackageError, ProgramError
from feedplan.program.moves import TOUCHING, Moves
from feedplan.program.program import Program

Point = Floats

MAX_ENTITIES = 5_000_000
_FARTHEST = 1e6  # [mm]; larger coordinates are a mistake
# Errors that the package raises for an entity with missing entries or entries of a wrong type.
_DAMAGED = (ValueError, ArithmeticError, TypeError, LookupError, AttributeError)


@dataclass(frozen=True)
class _Line:
    start: Point
    end: Point

    @property
    def reach(self) -> float:
        """An upper bound of the coordinates on it [mm]."""
        return float(np.abs([self.start, self.end]).max())

    def reversed(self) -> _Line:
        return _Line(self.end, self.start)

    def add(self, moves: Moves, line: int) -> None:
        moves.line(self.end, None, line)


@dataclass(frozen=True)
class _Arc:
    """An arc through `angle` [rad] from `start`, positive counter-clockwise, in a plane parallel to XY."""

    start: Point
    end: Point
    centre: Point
    angle: float

    @property
    def reach(self) -> float:
        """An upper bound of the coordinates on it [mm]."""
        chord = 2.0 * math.sin(0.5 * min(abs(self.angle), math.pi))
        return float(np.abs(self.start).max()) + chord * math.dist(self.start, self.centre)

    def reversed(self) -> _Arc:
        return _Arc(self.end, self.start, self.centre, -self.angle)

    def add(self, moves: Moves, line: int) -> None:
        moves.arc(self.end, self.centre, self.angle, None, line)


@dataclass(frozen=True)
class _Curve:
    curve: CompositeCurve

    @property
    def start(self) -> Point:
        return np.asarray(self.curve.control_points[0])

    @property
    def end(self) -> Point:
        return np.asarray(self.curve.control_points[-1])

    @property
    def reach(self) -> float:
        """An upper bound of the coordinates on it [mm]."""
        return float(np.abs(self.curve.control_points).max())

    def reversed(self) -> _Curve:
        return _Curve(self.curve.reversed())

    def add(self, moves: Moves, line: int) -> None:
        moves.spline(self.curve, None, line)


_Segment = _Line | _Arc | _Curve


class _UnsupportedError(Exception):
    """The reason why an entity is left out."""


def read_dxf(content: bytes, name: str = "drawing.dxf", feed: float | None = None) -> Program:
    """The moves of a drawing; `line` is the number of the entity in its model space, from 1.

    All moves have the `feed` [mm/s]; without one, only the machine limits them. Raises ProgramError in one
    sentence, and MissingPackageError without ezdxf.
    """
    try:
        from ezdxf import recover
        from ezdxf.enums import InsertUnits
        from ezdxf.units import conversion_factor
    except ImportError:
        raise MissingPackageError(
            f"{name}: drawings are read with the package ezdxf, which is not installed: "
            "pip install feedplan[dxf]"
        ) from None
    try:
        document: Any = recover.read(io.BytesIO(content))[0]
        units = int(document.header.get("$INSUNITS", 0))
        # The package's factors are rounded, such as 25.400000000102.
        factor = conversion_factor(InsertUnits(units), InsertUnits.Millimeters) if units else 1.0
        scale = float(f"{factor:.9g}")
        entities = list(document.modelspace())
    except Exception as error:  # for broken files the package raises errors of any type
        what = " ".join(str(error).split()) or type(error).__name__
        raise ProgramError(f"{name} cannot be read as DXF ({what}): save the drawing anew") from None
    if len(entities) > MAX_ENTITIES:
        raise ProgramError(f"{name} has more than {MAX_ENTITIES} entities: split it")
    warnings = [] if units else [f"{name} gives no unit ($INSUNITS): millimetres are assumed"]
    skipped: Counter[str] = Counter()
    moves = Moves(("X", "Y", "Z"), feed)
    for number, entity in enumerate(entities, 1):
        if _hidden(document, entity):
            skipped["on layers that are off or frozen"] += 1
            continue
        try:
            with np.errstate(all="ignore"):  # coordinates that are not finite are refused below
                segments = _segments(entity, scale)
        except (_UnsupportedError, InputError, *_DAMAGED) as error:
            skipped[f"{entity.dxftype()} ({error})" if str(error) else str(entity.dxftype())] += 1
            continue
        if not all(segment.reach <= _FARTHEST for segment in segments):
            raise ProgramError(
                f"{name} entity {number} goes farther than {_FARTHEST:g} mm: check the units of the drawing",
                number,
            )
        _add(moves, segments, number)
    if not len(moves):
        raise ProgramError(f"{name} has no line, arc or curve in its model space: draw some there")
    for kind, count in sorted(skipped.items()):
        warnings.append(f"{name}: {count} {'entity' if count == 1 else 'entities'} left out: {kind}")
    if feed is None:
        warnings.append("a drawing has no feed: only the machine limits it; give --feed to set one")
    return moves.program(name, tuple(warnings))


def _add(moves: Moves, segments: Sequence[_Segment], number: int) -> None:
    """Adds an entity's moves, in reverse if its end touches the tool's position and its start does not."""
    if not segments:
        return
    ahead, back = moves.gap(segments[0].start), moves.gap(segments[-1].end)
    if len(moves) and back <= TOUCHING < ahead:
        segments = [segment.reversed() for segment in reversed(segments)]
    for segment in segments:
        moves.go_to(segment.start, number)
        segment.add(moves, number)


def _hidden(document: Any, entity: Any) -> bool:
    # Entities of kinds that the package does not know have no such attribute.
    layer = entity.dxf.layer if entity.dxf.hasattr("layer") else "0"
    if layer not in document.layers:
        return False
    row = document.layers.get(layer)
    return bool(row.is_off() or row.is_frozen())


def _segments(entity: Any, scale: float) -> list[_Segment]:
    """The moves of an entity in mm."""
    kind = entity.dxftype()
    if kind == "LINE":
        start, end = _point(entity.dxf.start, scale), _point(entity.dxf.end, scale)
        return [_Line(start, end)] if (start != end).any() else []
    if kind in ("ARC", "CIRCLE"):
        return [_arc(entity, scale)]
    if kind == "LWPOLYLINE":
        corners = [((x, y, entity.dxf.elevation), bulge) for x, y, bulge in entity.get_points("xyb")]
        return _polyline(corners, bool(entity.closed), _side(entity), scale)
    if kind == "POLYLINE" and (entity.is_2d_polyline or entity.is_3d_polyline):
        if entity.is_2d_polyline and entity.dxf.flags & 6:
            raise _UnsupportedError("a polyline with fitted vertices: explode it")
        corners = [
            (tuple(vertex.dxf.location), vertex.dxf.get("bulge", 0.0) if entity.is_2d_polyline else 0.0)
            for vertex in entity.vertices
        ]
        side = _side(entity) if entity.is_2d_polyline else 1.0
        return _polyline(corners, bool(entity.is_closed), side, scale)
    if kind in ("ELLIPSE", "SPLINE"):
        spline = entity.construction_tool()
        if kind == "ELLIPSE":
            from ezdxf.math import BSpline

            # Equal start and end parameters mean the whole ellipse.
            span = (spline.end_param - spline.start_param) % math.tau or math.tau
            spline.end_param = spline.start_param + span
            spline = BSpline.from_ellipse(spline)
        points = np.array([tuple(point) for point in spline.control_points]) * scale
        weights = list(spline.weights())
        return [_Curve(CompositeCurve.from_nurbs(points, spline.knots(), spline.degree, weights or None))]
    raise _UnsupportedError("")


def _point(point: Any, scale: float) -> Point:
    return np.array([float(value) * scale for value in tuple(point)[:3]])


def _side(entity: Any) -> float:
    """1 where the entity's plane is XY seen from above, −1 from below."""
    x, y, z = tuple(entity.dxf.get("extrusion", (0.0, 0.0, 1.0)))
    if abs(x) + abs(y) > 1e-9 * abs(z):
        raise _UnsupportedError("its plane is not parallel to XY")
    return math.copysign(1.0, z)


def _arc(entity: Any, scale: float) -> _Arc:
    side = _side(entity)
    centre = _on_side(tuple(entity.dxf.center), side) * scale
    radius = float(entity.dxf.radius) * scale
    if not radius > 0.0:
        raise _UnsupportedError("its radius is not positive")
    first, sweep = 0.0, 2.0 * math.pi
    if entity.dxftype() == "ARC":
        first, last = math.radians(entity.dxf.start_angle), math.radians(entity.dxf.end_angle)
        sweep = (last - first) % (2.0 * math.pi) or sweep

    def at(angle: float) -> Point:
        return centre + radius * np.array([side * math.cos(angle), math.sin(angle), 0.0])

    whole = entity.dxftype() == "CIRCLE"
    return _Arc(at(first), at(first) if whole else at(first + sweep), centre, side * sweep)


def _on_side(point: Sequence[float], side: float) -> Point:
    """A point in the drawing's coordinates; seen from below, an entity's X and Z have the opposite sign."""
    x, y, z = (*point, 0.0)[:3]
    return np.array([side * x, y, side * z], dtype=np.float64)


def _polyline(
    corners: Sequence[tuple[Sequence[float], float]], closed: bool, side: float, scale: float
) -> list[_Segment]:
    points = [_on_side(point, side) * scale for point, _ in corners]
    bulges = [side * float(bulge) for _, bulge in corners]
    if closed and points:
        points.append(points[0])
    segments: list[_Segment] = []
    for i in range(len(points) - 1):
        start, end = points[i], points[i + 1]
        if not (start != end).any():
            continue
        segments.append(_Line(start, end) if bulges[i] == 0.0 else _bulge(start, end, bulges[i]))
    return segments


def _bulge(start: Point, end: Point, bulge: float) -> _Arc:
    """The arc of a `bulge`, which is tan(sweep/4), positive counter-clockwise."""
    x, y = 0.5 * (end - start)[:2]
    height = (1.0 - bulge * bulge) / (2.0 * bulge)
    centre = 0.5 * (start + end) + height * np.array([-y, x, 0.0])
    return _Arc(start, end, centre, 4.0 * math.atan(bulge))
