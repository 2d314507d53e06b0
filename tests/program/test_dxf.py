"""Drawings: each entity of a model space becomes moves that follow its own definition."""

import io
import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import feedplan
from feedplan.errors import MachineError, MissingPackageError, ProgramError
from feedplan.geometry.build import build_path
from feedplan.machine.machine import Machine
from feedplan.program.dxf import read_dxf
from feedplan.program.moves import NO_FEED
from feedplan.program.program import MoveKind, Program
from feedplan.program.read import read_program
from tests.continuity import at, breakpoints

ezdxf = pytest.importorskip("ezdxf")

MILLIMETRES, INCHES = 4, 1
RAPID, LINE, ARC, SPLINE = (kind.value for kind in MoveKind)


def drawing(draw: Callable[[Any], object], units: int = MILLIMETRES) -> bytes:
    document = ezdxf.new(units=units)
    draw(document.modelspace())
    stream = io.StringIO()
    document.write(stream)
    return stream.getvalue().encode()


def read(draw: Callable[[Any], object], units: int = MILLIMETRES) -> Program:
    return read_dxf(drawing(draw, units), "part.dxf")


def test_a_feed_is_that_of_all_moves_of_a_drawing() -> None:
    content = drawing(lambda space: space.add_line((0, 0), (10, 0)), 4)
    program = feedplan.read_program(content, name="part.dxf", feed=20.0)
    assert (program.feed.tolist(), program.warnings) == ([20.0], ())


def test_lines_that_touch_are_one_path_in_either_direction() -> None:
    def draw(space: Any) -> None:
        space.add_line((1, 2, 3), (10, 2, 3))
        space.add_line((10, 7, 3), (10, 2, 3))
        space.add_line((0, 0), (5, 0))

    program = read(draw)
    assert program.start.tolist() == [1, 2, 3]
    assert program.kind.tolist() == [LINE, LINE, RAPID, LINE]
    assert program.target.tolist() == [[10, 2, 3], [10, 7, 3], [0, 0, 0], [5, 0, 0]]
    assert program.line.tolist() == [1, 2, 3, 3]
    assert program.feed.tolist() == [NO_FEED, NO_FEED, math.inf, NO_FEED]
    assert program.stop.tolist() == [False, False, False, True]
    assert program.warnings == ("a drawing has no feed: only the machine limits it; give --feed to set one",)


def test_units_are_the_drawings() -> None:
    assert read(lambda space: space.add_line((0, 0), (1, 0)), INCHES).target[0, 0] == 25.4
    program = read(lambda space: space.add_line((0, 0), (1, 0)), 0)
    assert program.target[0, 0] == 1
    assert program.warnings[0] == "part.dxf gives no unit ($INSUNITS): millimetres are assumed"


def test_arcs_turn_counter_clockwise_and_circles_fully() -> None:
    def draw(space: Any) -> None:
        space.add_arc((10, 0, 1), 5, 270, 90)
        space.add_circle((0, 0), 3)

    program = read(draw)
    assert program.start == pytest.approx([10, -5, 1])
    assert program.target == pytest.approx(np.array([[10, 5, 1], [3, 0, 0], [3, 0, 0]]))
    assert program.arc_centre.tolist() == [[10, 0, 1], [0, 0, 0]]
    assert program.arc_angle == pytest.approx([math.pi, 2 * math.pi])
    assert program.arc_move.tolist() == [0, 2]
    assert program.arc_normal.tolist() == [2, 2]


def test_an_arc_that_ends_where_the_tool_is_turns_back() -> None:
    def draw(space: Any) -> None:
        space.add_line((0, 0), (10, 5))
        space.add_arc((10, 0), 5, 270, 90)

    program = read(draw)
    assert program.kind.tolist() == [LINE, ARC]
    assert program.target[-1] == pytest.approx([10, -5, 0])
    assert program.arc_angle == pytest.approx([-math.pi])


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("kind", ["add_lwpolyline", "add_polyline2d"])
def test_bulges_of_polylines_are_arcs(kind: str, closed: bool) -> None:
    def draw(space: Any) -> None:
        points = [(0, 0, 0), (10, 0, 1), (10, 10, -math.tan(math.pi / 8)), (0, 20, 0)]
        getattr(space, kind)(points, format="xyb", close=closed)

    program = read(draw)
    assert program.kind.tolist() == [LINE, ARC, ARC] + [LINE] * closed
    for row, centre, angle in zip(program.arc_move, program.arc_centre, program.arc_angle, strict=True):
        a, b = program.starts()[row] - centre, program.target[row] - centre
        assert np.hypot(*a[:2]) == pytest.approx(np.hypot(*b[:2]))
        turned = math.atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1])
        assert math.cos(turned) == pytest.approx(math.cos(angle))
        assert math.sin(turned) == pytest.approx(math.sin(angle), abs=1e-9)
    assert program.arc_angle == pytest.approx([math.pi, -math.pi / 2])
    assert (program.target[-1] == program.start).all() == closed


def test_entities_seen_from_below_are_mirrored() -> None:
    def draw(space: Any) -> None:
        space.add_lwpolyline([(0, 0, 0), (10, 0, 1), (10, 10, 0)], format="xyb", dxfattribs={"elevation": 2})
        space[-1].dxf.extrusion = (0, 0, -1)
        space.add_arc((5, 0), 2, 0, 90, dxfattribs={"extrusion": (0, 0, -1)})

    program = read(draw)
    assert program.target[:2] == pytest.approx(np.array([[-10, 0, -2], [-10, 10, -2]]))
    assert program.arc_angle == pytest.approx([-math.pi, -math.pi / 2])
    assert program.target[2:] == pytest.approx(np.array([[-7, 0, 0], [-5, 2, 0]]))


@pytest.mark.parametrize(("first", "last"), [(0.0, math.tau), (0.3, 5.0), (5.0, 1.0)])
def test_ellipses_are_exact(first: float, last: float) -> None:
    def draw(space: Any) -> None:
        space.add_ellipse((5, 6, 7), (4, 3, 0), 0.5, first, last)

    program = read(draw)
    curve = program.splines
    assert curve is not None
    t = np.linspace(0, breakpoints(curve)[-1], 200)[:-1]
    places = at(curve, t)[0] - (5, 6, 7)
    along, across = places @ (0.8, 0.6, 0) / 5, places @ (-0.6, 0.8, 0) / 2.5
    assert np.hypot(along, across) == pytest.approx(np.ones(199))
    assert places[0] == pytest.approx(
        np.array([4, 3, 0]) * math.cos(first) + np.array([-1.5, 2, 0]) * math.sin(first)
    )
    turned = np.unwrap(np.arctan2(across, along))
    assert (np.diff(turned) > 0).all()
    assert turned[-1] - turned[0] == pytest.approx((last - first) % math.tau or math.tau, rel=0.02)


def test_splines_are_their_nurbs_curves() -> None:
    points = [(0, 0, 0), (1, 5, 0), (4, -3, 1), (8, 2, 0), (9, 0, 0)]
    weights = [1, 2, 1, 3, 1]

    def draw(space: Any) -> None:
        space.add_rational_spline(points, weights, degree=3)

    program = read(draw)
    assert program.kind.tolist() == [SPLINE]
    assert program.splines is not None
    expected = [tuple(p) for p in ezdxf.math.BSpline(points, 4, weights=weights).approximate(20)]
    t = np.linspace(0, breakpoints(program.splines)[-1], 21)
    assert at(program.splines, t)[0] == pytest.approx(np.array(expected), abs=1e-9)


def test_fit_points_are_passed_through() -> None:
    points = [(0, 0, 0), (5, 5, 0), (10, 0, 0)]
    program = read(lambda space: space.add_spline(points))
    assert program.splines is not None
    ends = at(program.splines, breakpoints(program.splines))[0]
    for point in points:
        assert np.abs(ends - point).max(axis=1).min() < 1e-9


def test_what_is_left_out_is_counted_by_kind() -> None:
    def draw(space: Any) -> None:
        space.add_line((0, 0), (1, 0))
        space.add_line((3, 3), (3, 3))
        space.add_text("part")
        space.add_point((0, 0))
        space.add_point((1, 0))
        space.add_circle((0, 0), 3, dxfattribs={"extrusion": (0, 1, 0)})
        space.doc.layers.add("hidden").off()
        space.add_line((0, 0), (9, 9), dxfattribs={"layer": "hidden"})

    program = read(draw)
    assert len(program) == 1
    assert program.warnings[:-1] == (
        "part.dxf: 1 entity left out: CIRCLE (its plane is not parallel to XY)",
        "part.dxf: 2 entities left out: POINT",
        "part.dxf: 1 entity left out: TEXT",
        "part.dxf: 1 entity left out: on layers that are off or frozen",
    )


def test_kinds_that_nobody_knows_are_left_out() -> None:
    def draw(space: Any) -> None:
        space.add_line((0, 0), (1, 0))
        space.add_point((5, 5))

    program = read_dxf(drawing(draw).replace(b"\nPOINT\n", b"\nACME_PIPE\n"), "part.dxf")
    assert len(program) == 1
    assert program.warnings[0] == "part.dxf: 1 entity left out: ACME_PIPE"


def test_a_drawing_can_be_planned_at_a_feed(tmp_path: Path) -> None:
    file = tmp_path / "part.dxf"
    file.write_bytes(drawing(lambda space: space.add_lwpolyline([(0, 0), (60, 0), (60, 60)])))
    slow, free = (feedplan.plan(file, "mill", feed=feed) for feed in (10.0, None))
    assert slow.audit().ok
    assert slow.time == pytest.approx(12, rel=0.01)
    assert free.time < 1.0


def test_what_is_no_drawing_is_one_sentence() -> None:
    for content in (b"", b"G21 G0 X1\n", b"\x00\x01\x02", b"0\nSECTION\n2\nENTITIES\n0\nLINE\n10\nx\n"):
        with pytest.raises(ProgramError) as caught:
            read_dxf(content, "part.dxf")
        assert str(caught.value).startswith("part.dxf ")
        assert "\n" not in str(caught.value)
    with pytest.raises(ProgramError, match=r"part\.dxf has no line, arc or curve in its model space"):
        read(lambda space: space.add_text("part"))
    with pytest.raises(ProgramError, match=r"part\.dxf entity 1 goes farther than 1e"):
        read(lambda space: space.add_line((0, 0), (2e6, 0)))
    # Points too far away, and an arc between two near points that reaches too far.
    with pytest.raises(ProgramError, match=r"part\.dxf entity 1 goes farther than 1e"):
        read(lambda space: space.add_circle((0, 0), math.inf))
    for vertices in ([(1e30, 0), (0, 10, 0, 0, 0.5), (5, 5)], [(0, 0, 0, 0, 1e30), (0, 10)]):
        with pytest.raises(ProgramError, match=r"part\.dxf entity 1 goes farther than 1e"):
            read(lambda space, own=vertices: space.add_lwpolyline(own, format="xyseb"))


def test_a_drawing_needs_the_axes_that_it_moves() -> None:
    lathe = Machine("lathe", tuple(axis for axis in Machine.load("mill").axes if axis.name != "Y"))
    along = read(lambda space: space.add_line((0, 0), (1, 0)))
    assert build_path(along, lathe).axes == ("X", "Z")
    across = read(lambda space: space.add_line((0, 0), (1, 2)))
    with pytest.raises(MachineError, match=r"part\.dxf, line 1: axis Y moves and machine lathe has none"):
        build_path(across, lathe)


def test_without_the_package_the_command_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "part.dxf"
    file.write_bytes(b"0\nEOF\n")
    monkeypatch.setitem(sys.modules, "ezdxf", None)
    with pytest.raises(MissingPackageError, match=r"^part\.dxf: .*: pip install feedplan\[dxf\]$"):
        read_program(file)
