"""Radius that smooth paths, as methods with limits of jerk follow them, have on programmed arcs."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from benchmarks.results import Cell, Result
from feedplan.geometry.build import build_path
from feedplan.geometry.corners import Corners
from feedplan.geometry.path import Path
from feedplan.machine.machine import Machine
from feedplan.program.gcode import read_gcode

RADII = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
TOLERANCES = (0.001, 0.01, 0.1)
# Samples per piece of the path.
PLACES = 200
# The share of an arc, about its middle, that is measured; the rest is too near its ends.
MIDDLE = 0.5

Array = NDArray[np.float64]


def full_circle(r: float) -> str:
    """A circle between two lines that touch it."""
    return f"G0 X{-2 * r - 1} Y{-r}\nG1 X0\nG3 Y{-r} I0 J{r}\nG1 X{2 * r + 1}"


def hole(r: float) -> str:
    """From the centre of a circle to it, once round, and back: corners of 90° before and after the circle."""
    return f"G0 X0 Y0\nG1 Y{-r}\nG3 Y{-r} I0 J{r}\nG1 Y0"


def alone(r: float) -> str:
    """A circle that starts and ends at rest."""
    return f"G0 X0 Y{-r}\nG3 Y{-r} I0 J{r}"


def slot(r: float) -> str:
    """Two half circles between parallel lines; the first is measured."""
    a = 2 * r + 1
    return f"G0 X{-a} Y{-r}\nG1 X0\nG3 Y{r} I0 J{r}\nG1 X{-a}\nG3 Y{-r} I0 J{-r}\nG1 X0"


def pocket(r: float) -> str:
    """A quarter of a circle between lines, as in the corner of a pocket."""
    a = 2 * r + 1
    return f"G0 X{-a} Y{-r}\nG1 X0\nG3 X{r} Y0 I0 J{r}\nG1 Y{a}"


def helix(r: float) -> str:
    """Three turns of a helix whose pitch is a tenth of its radius."""
    turns = "\n".join(f"G3 X0 Y{-r} Z{-0.1 * r * turn} I0 J{r}" for turn in (1, 2, 3))
    return f"G0 X0 Y{-r} Z0\n{turns}"


def chords(turn: float) -> Callable[[float], str]:
    """Chords that turn by `turn` [deg] around a circle, between two lines that touch it."""
    angles = np.radians(np.arange(0.0, 360.0 + 1e-9, turn))

    def text(r: float) -> str:
        points = "\n".join(f"G1 X{r * math.sin(a):.7f} Y{-r * math.cos(a):.7f}" for a in angles)
        return f"G0 X{-2 * r - 1} Y{-r}\n{points}\nG1 X{2 * r + 1}"

    return text


# Each shape with the angle of its arc around the origin from (0, −r) [rad].
SHAPES: dict[str, tuple[Callable[[float], str], float]] = {
    "circle": (full_circle, 2 * math.pi),
    "hole": (hole, 2 * math.pi),
    "alone": (alone, 2 * math.pi),
    "slot": (slot, math.pi),
    "pocket": (pocket, math.pi / 2),
    "helix": (helix, 6 * math.pi),
    "chords of 3°": (chords(3.0), 2 * math.pi),
    "chords of 10°": (chords(10.0), 2 * math.pi),
    "chords of 24°": (chords(24.0), 2 * math.pi),
}


def run(quick: bool = False) -> Result:
    """Measures all shapes, radii and tolerances on the machine `mill`."""
    radii, tolerances = ((2.0,), (0.1,)) if quick else (RADII, TOLERANCES)
    rows = [_row(shape, r, tol) for shape in SHAPES for tol in tolerances for r in radii]
    return Result(
        "Radius of arcs on smooth paths, in their middle halves [mm]",
        tuple(rows),
        (
            "Arcs: radius of the curve at many places. Chords: distance of the centre from the places of the "
            "curve that are nearest to the points.",
            "off: the greatest difference of arcs, the mean one of chords, in percent of the tolerance.",
        ),
    )


def _row(shape: str, r: float, tolerance: float) -> dict[str, Cell]:
    radius = radii(shape, r, tolerance)
    by_points = shape.startswith("chords")
    off = abs(radius.mean() - r) if by_points else np.abs(radius - r).max()
    return {
        "shape": shape,
        "tolerance": tolerance,
        "programmed": f"{r:g}",
        "median": f"{np.median(radius):.5f}",
        "least": f"{radius.min():.5f}",
        "greatest": f"{radius.max():.5f}",
        "off [%]": 100.0 * float(off) / tolerance,
    }


def radii(shape: str, r: float, tolerance: float) -> Array:
    """Distances of the path from the centre of the shape's arc, near the middle of the arc [mm]."""
    write, turn = SHAPES[shape]
    machine = Machine.load("mill")
    program = read_gcode(f"G21 G90 G64 F1000\n{write(r)}\nM2\n".encode(), machine, shape)
    path = build_path(program, machine, tolerance, corners=Corners.SMOOTH)
    place = _places(path)
    if shape.startswith("chords"):
        points = program.target[1:-1, :2]
        angle = np.unwrap(np.arctan2(points[:, 0], -points[:, 1]))
        points = points[np.abs(angle - turn / 2) <= MIDDLE * turn / 2]
        apart: Array = np.linalg.norm(place[None, :, :] - points[:, None, :], axis=2)
        place = place[apart.argmin(axis=1)]
        distance: Array = np.linalg.norm(place, axis=1)
        return distance
    distance = np.linalg.norm(place, axis=1)
    near = np.abs(distance - r) <= 2 * tolerance
    place, distance = place[near], distance[near]
    angle = np.arctan2(place[:, 0], -place[:, 1])
    # Keeps samples near the arc's middle; for one to three turns it is opposite to the arc's ends.
    off = np.abs(np.angle(np.exp(1j * (angle - turn / 2))))
    return distance[off <= MIDDLE * min(turn, 2 * math.pi) / 2]


def _places(path: Path) -> Array:
    """Points (n, 2) of the path in X and Y, without rapids [mm]."""
    piece = np.repeat(np.flatnonzero(np.isfinite(path.feed)), PLACES)
    part = np.tile(np.linspace(0.0, 1.0, PLACES), len(piece) // PLACES)
    places: Array = path.curve.evaluate(piece, part * path.width[piece], 0)[0]
    return places[:, :2]
