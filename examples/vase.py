"""Write a vase relief as a part program: cutting planes in which only y and z move.

The part is like the one that Zhang et al. 2010 (section 4.3) plan for: a vase lying along y, finished by a
ball-end mill in planes x = const, 486 points a pass, back and forth with a small step-over in x. The points
are those of the tool tip: a ball rounds every convex edge and leaves a crease where it touches two features
at once, so that the path is the upper envelope of smooth features. A fit must break its splines at the
creases, and follow the beads, reeds and waves between them.

    python examples/vase.py --blocks 2000 --output out/vase.ngc
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

POINTS_PER_PASS = 486
LENGTH = 120.0  # length of the vase along y [mm]
HALF_WIDTH = 32.0  # slightly more than half the greatest width [mm]
TOOL_RADIUS = 1.5  # [mm]
SAMPLES = 4096  # samples of the surface along a pass, from which the points are chosen

# Rows of beads on the path of the tip: first and last centre along y, number of beads, height over the body,
# half width including the ball [mm].
BEADS = (
    (2.0, 7.0, 2, 0.8, 3.6),
    (20.0, 29.0, 4, 0.8, 2.4),
    (91.0, 103.0, 5, 0.8, 2.4),
    (110.5, 117.0, 2, 1.0, 4.2),
)
REED_PITCH = 3.5  # pitch of the twisted reeds on the belly along y [mm]
REEDS = 28  # number of reeds around the vase
REED_DEPTH = 0.6  # [mm]


def height(x: float, y: Array) -> Array:
    """Height of the tool tip over the table in the plane `x` [mm]."""
    body = _body(y)
    angle = np.arcsin(np.clip(x / (body + TOOL_RADIUS), -1.0, 1.0))

    # The reeds on the belly meet in creases; the waves on the collars are smooth. Both fade out towards the
    # silhouette, where the walls are steep.
    turns = y / REED_PITCH + REEDS * angle / (2.0 * np.pi)
    reeds = 1.0 - 4.0 * (turns - np.round(turns)) ** 2
    waves = np.cos(2.0 * np.pi * y / 5.0) * np.cos(12.0 * angle)
    collars = _window(y, 10.5, 17.5) + _window(y, 31.5, 37.5) + _window(y, 105.3, 108.7)
    relief = REED_DEPTH * _window(y, 39.0, 87.0) * reeds + 0.08 * collars * waves
    surface = body + relief * np.cos(angle) ** 2

    for first, last, count, rise, half_width in BEADS:
        for centre in np.linspace(first, last, count):
            reach = np.minimum(((y - centre) / half_width) ** 2, 1.0)
            bead = _body(np.array([centre])) + rise - half_width * (1.0 - np.sqrt(1.0 - reach))
            surface = np.where(reach < 1.0, np.maximum(surface, bead), surface)

    # The ball rests on the table beside the vase.
    centre_sq = (surface + TOOL_RADIUS) ** 2 - x**2
    return np.asarray(np.sqrt(np.maximum(centre_sq, TOOL_RADIUS**2)) - TOOL_RADIUS)


def pass_points(x: float, points: int = POINTS_PER_PASS) -> Array:
    """The points (y, z) of the pass in the plane `x` [mm], foot to lip, shape (points, 2).

    They are closer where the path curves, as with a chord tolerance, but not at the creases, which therefore
    lie between points, as in a real program.
    """
    y = np.linspace(0.0, LENGTH, SAMPLES)
    z = height(x, y)
    step = np.hypot(np.diff(y), np.diff(z))
    turn = np.abs(np.diff(np.arctan2(np.diff(z), np.diff(y)), prepend=0.0))
    turn[0] = 0.0
    curvature = np.minimum(turn / step, 1.0)
    station = np.concatenate(([0.0], np.cumsum(step * (1.0 + np.sqrt(curvature)))))
    chosen = np.interp(np.linspace(0.0, station[-1], points), station, y)
    return np.column_stack((chosen, height(x, chosen)))


def planes(count: int, step_over: float) -> Array:
    """The planes x = const of `count` passes about the middle [mm]; closer if the vase is too narrow."""
    step = min(step_over, 2.0 * HALF_WIDTH / max(count - 1, 1))
    return np.asarray(step * (np.arange(count) - 0.5 * (count - 1)))


def program(
    blocks: int = 2000, *, step_over: float = 0.1, feed: float = 6000.0, tolerance: float = 0.02
) -> str:
    """The part program with about `blocks` blocks: whole passes of 486 points each.

    `step_over` between passes [mm], `feed` [mm/min], `tolerance` of the path control [mm].
    """
    xs = planes(max(1, round(blocks / POINTS_PER_PASS)), step_over)
    start = pass_points(xs[0])[0]
    lines = [
        "%",
        f"(Vase relief, {len(xs)} passes of {POINTS_PER_PASS} points in planes x = const)",
        f"(Ball end mill, radius {TOOL_RADIUS:g} mm; zero: foot of the vase, on the table)",
        "G21 G90 G17 G40 G49 G80 G94",
        f"G64 P{tolerance:g}",
        "T1 M6",
        "S18000 M3",
        "G0 Z60.",
        f"G0 X{xs[0]:.4f} Y{start[0]:.4f}",
        f"G0 Z{start[1] + 5.0:.4f}",
        f"G1 Z{start[1]:.4f} F1200.",
        f"G1 F{feed:g}",
    ]
    for number, x in enumerate(xs):
        points = pass_points(x)
        if number % 2:
            points = points[::-1]
        lines.append(f"(pass {number + 1})")
        rows = [f"Y{y:.4f} Z{z:.4f}" for y, z in points.tolist()]
        lines += [f"G1 X{x:.4f} {rows[0]}", *rows[1:]]
    lines += ["G0 Z60.", "M5", "M30", "%"]
    return "\n".join(lines) + "\n"


def _body(y: Array) -> Array:
    """Radius of the vase without beads and reeds at `y` [mm]: belly, foot and lip."""
    belly = 18.0 * np.exp(-(((y - 61.0) / 24.0) ** 2))
    foot = 6.0 * np.exp(-((y / 10.0) ** 2))
    lip = 7.0 * np.exp(-(((y - LENGTH) / 10.0) ** 2))
    return np.asarray(11.0 + belly + foot + lip)


def _window(y: Array, first: float, last: float, edge: float = 1.5) -> Array:
    """A window over y: 1 between `first` and `last`, falling smoothly to 0 within `edge` inside both ends."""
    inside = np.clip(np.minimum(y - first, last - y) / edge, 0.0, 1.0)
    return np.asarray(inside**2 * (3.0 - 2.0 * inside))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--blocks", type=int, default=2000, help="about how many blocks (default 2000)")
    parser.add_argument("--step-over", type=float, default=0.1, help="between passes [mm] (default 0.1)")
    parser.add_argument("--feed", type=float, default=6000.0, help="[mm/min] (default 6000)")
    parser.add_argument("--tolerance", type=float, default=0.02, help="G64 P [mm] (default 0.02)")
    parser.add_argument("--output", type=Path, default=Path("out/vase.ngc"))
    options = vars(parser.parse_args())
    output: Path = options.pop("output")

    text = program(**options)
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_text(text, encoding="ascii")
    print(f"{output}: {text.count(chr(10))} lines")


if __name__ == "__main__":
    main()
