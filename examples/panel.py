"""Write a path file: finishing passes over an automotive panel in clay, each a NURBS curve.

The panel is a door skin: curved in both directions, with a character line that fades out, the flare of a
wheel arch and the recess of a handle. A ball tool follows it back and forth; one cubic spline for each pass
interpolates the tool's tip, as CAM systems do. Loops beside the panel join the passes, in one of two ways:

    tangent     cubic loops: the tangent is continuous, the curvature jumps at both ends
    curvature   quintic loops: the curvature is continuous too

    python examples/panel.py --passes 40 --output out/panel.json
    feedplan plan out/panel.json --machine tarus --method jerk-limited
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_interp_spline

Array = NDArray[np.float64]

JOINTS = ("tangent", "curvature")
LENGTH, WIDTH = 420.0, 260.0  # size of the panel along x and y [mm]
STEP = 3.0  # distance of passes; smaller if there are too many for the panel [mm]
MIDDLE = 95.0  # x of the middle of the passes if there are few, over the handle [mm]
TOOL_RADIUS = 6.0  # radius of the ball [mm]
SPACING = 4.0  # distance of the interpolated points along a pass [mm]
REACH = 12.0  # length of the loops' handles [mm]
FEED = 80.0  # [mm/s]


def height(x: Array, y: Array) -> Array:
    """The panel's surface z [mm] over x in 0 to LENGTH and y in 0 to WIDTH."""
    crown = 34.0 - 2.2e-4 * (x - 0.45 * LENGTH) ** 2 - 6.5e-4 * (y - 0.6 * WIDTH) ** 2
    # The character line rises to the left of the door and fades out.
    across = y - (150.0 + 0.05 * x)
    line = 4.0 * (1.0 + np.tanh(across / 3.5)) * np.exp(-(((x - 120.0) / 210.0) ** 2))
    arch = 7.0 * np.exp(-(((np.hypot(x - 400.0, y + 30.0) - 120.0) / 14.0) ** 2))
    handle = -5.0 / (1.0 + ((x - 95.0) / 32.0) ** 4 + ((y - 200.0) / 11.0) ** 4)
    return np.asarray(crown + line + arch + handle)


def tool_tip(x: Array, y: Array) -> Array:
    """The lowest point of a ball that touches the surface at x, y: shape (n, 3) [mm]."""
    step = 1e-3
    slope_x = (height(x + step, y) - height(x - step, y)) / (2.0 * step)
    slope_y = (height(x, y + step) - height(x, y - step)) / (2.0 * step)
    normal = np.column_stack([-slope_x, -slope_y, np.ones_like(x)])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    centre = np.column_stack([x, y, height(x, y)]) + TOOL_RADIUS * normal
    return centre - np.array([0.0, 0.0, TOOL_RADIUS])


def pass_spline(x: float) -> BSpline:
    """The pass at constant contact x, from y = 0 to WIDTH: a cubic spline over 0 to 1."""
    y = np.linspace(0.0, WIDTH, 8 * round(WIDTH / SPACING))
    length = chord_lengths(tool_tip(np.full_like(y, x), y))
    y = np.interp(np.linspace(0.0, length[-1], round(length[-1] / SPACING)), length, y)
    points = tool_tip(np.full_like(y, x), y)
    chord = chord_lengths(points)
    return make_interp_spline(chord / chord[-1], points, k=3)


def chord_lengths(points: Array) -> Array:
    """The length of the polygon up to each of its points [mm]."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def loop(before: BSpline, after: BSpline, joint: str) -> Array:
    """Control points of the Bézier loop from the end of a pass to the start of the next.

    The loop has the direction of the pass at each end; a quintic loop also has its curvature.
    """
    (start, out, bend_out), (end, into, bend_into) = at_end(before, 1.0), at_end(after, 0.0)
    if joint == "tangent":
        return np.array([start, start + REACH * out, end - REACH * into, end])
    # At the start C'' = 20 (P0 − 2 P1 + P2) = |C'|² κ with |C'| = 5 a, and correspondingly at the end.
    a = 0.6 * REACH
    b = (5.0 * a) ** 2 / 20.0
    return np.array(
        [
            start,
            start + a * out,
            start + 2.0 * a * out + b * bend_out,
            end - 2.0 * a * into + b * bend_into,
            end - a * into,
            end,
        ]
    )


def at_end(spline: BSpline, u: float) -> tuple[Array, Array, Array]:
    """Position, unit tangent and curvature vector [1/mm] at u."""
    place, first, second = (spline(u, nu=order) for order in range(3))
    speed = np.linalg.norm(first)
    tangent = first / speed
    return place, tangent, (second - tangent * (second @ tangent)) / speed**2


def panel(passes: int = 8, joint: str = "tangent", feed: float = FEED) -> dict[str, Any]:
    """The data of the path file with this number of passes, STEP apart, or less if they do not fit."""
    step = min(STEP, LENGTH / passes)
    width = step * (passes - 1)
    first = min(max(MIDDLE - 0.5 * width, 0.0), LENGTH - width)
    curves: list[dict[str, Any]] = []
    last: BSpline | None = None
    for i in range(passes):
        spline = pass_spline(first + i * step)
        if i % 2 == 1:  # back: the same spline, reversed
            spline = BSpline(1.0 - spline.t[::-1], spline.c[::-1], 3)
        if last is not None:
            curves.append(_curve(loop(last, spline, joint)))
        curves.append({**_curve(spline.c, 3), "knots": [round(float(t), 12) for t in spline.t]})
        last = spline
    return {"unit": "mm", "axes": ["X", "Y", "Z"], "feed": feed, "curves": curves}


def _curve(points: Array, degree: int | None = None) -> dict[str, Any]:
    rounded = [[round(float(value), 9) for value in point] for point in points]
    return {"degree": len(points) - 1 if degree is None else degree, "control_points": rounded}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--passes", type=int, default=8, help="how many (default 8)")
    parser.add_argument("--joint", choices=JOINTS, default="tangent", help="of passes (default tangent)")
    parser.add_argument("--feed", type=float, default=FEED, help="[mm/s] (default 80)")
    parser.add_argument("--output", type=Path, default=Path("out/panel.json"))
    arguments = parser.parse_args()

    table = panel(arguments.passes, arguments.joint, arguments.feed)
    arguments.output.parent.mkdir(parents=True, exist_ok=True)
    arguments.output.write_text(json.dumps(table), encoding="ascii")
    print(f"{arguments.output}: {len(table['curves'])} curves")


if __name__ == "__main__":
    main()
