"""Write the finishing of a sculptured head as a part program: raster passes in three axes.

The surface is a height field made of smooth bumps: skull, brow, eyes, nose, lips, chin, hair. A ball-end mill
touches it along lines x = const. Its tip is the contact point, moved out along the normal by the radius and
down by the radius, so that x varies where the surface slopes. As in CAM systems, the chord error of blocks
decides the distance of points: blocks are short where the surface curves.

    python examples/head.py --blocks 5000 --output out/head.ngc
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WIDTH, HEIGHT = 84.0, 116.0  # size of the field along x and y [mm]
TOOL_RADIUS = 1.5  # [mm]
BLOCK_LENGTHS = (0.05, 1.0)  # least and greatest length of a block [mm]
SAMPLES = 512  # samples of the surface along a pass, from which the points are chosen

# Bumps on the skull: centre (x, y), half widths along both, height [mm]; mirrored where x is not 0.
BUMPS = (
    (0.0, 8.0, 4.2, 15.0, 7.0),  # bridge and back of the nose
    (0.0, -2.5, 5.5, 4.8, 8.5),  # its tip
    (5.6, -4.0, 3.0, 3.0, 4.5),  # nostrils
    (11.5, 14.0, 7.5, 5.0, -6.0),  # eye sockets
    (11.5, 13.6, 5.0, 3.6, 4.4),  # eyeballs
    (11.5, 21.5, 9.0, 2.8, 2.6),  # brows
    (19.0, 1.0, 8.0, 9.0, 3.5),  # cheeks
    (0.0, -15.2, 8.5, 3.1, 3.0),  # upper lip
    (0.0, -22.2, 7.0, 3.4, 3.6),  # lower lip
    (0.0, -18.7, 10.0, 2.8, -0.8),  # between them
    (0.0, -27.5, 8.0, 3.2, -1.2),  # under the lip
    (0.0, -36.0, 9.5, 7.0, 5.0),  # chin
    (0.0, 34.0, 18.0, 10.0, 2.5),  # forehead
)


def height(x: Array, y: Array) -> Array:
    """Height of the surface over the table [mm]."""
    # The skull: a dome that runs out to the table without an edge.
    inside = 1.0 - (x / 36.0) ** 2 - ((y - 2.0) / 52.0) ** 2
    dome = 0.5 * (inside + np.sqrt(inside**2 + 0.01))
    surface = 34.0 * dome / np.sqrt(dome + 0.12)

    features = np.zeros_like(surface)
    for centre_x, centre_y, width_x, width_y, rise in BUMPS:
        for side in (-1.0, 1.0) if centre_x else (1.0,):
            across = (x - side * centre_x) / width_x
            features += rise * np.exp(-(across**2) - ((y - centre_y) / width_y) ** 2)

    # Hair: strands that start at a parting above the forehead and run down both sides.
    hairline = y - 30.0 + (x / 9.0) ** 2
    hair = 1.0 / (1.0 + np.exp(-hairline / 2.0))
    strands = 2.0 + 0.3 * np.sin(1.2 * x + 2.0 * np.sin(0.15 * y)) + 0.2 * np.sin(0.8 * y)
    fade = dome / (dome + 0.1)
    return np.asarray(surface + fade * (features + hair * strands))


def tool_tip(x: float, y: Array) -> Array:
    """Tip of the ball that touches the surface over (x, y) [mm], shape (n, 3)."""
    step = 1e-4
    xs = np.full_like(y, x)
    slope_x = (height(xs + step, y) - height(xs - step, y)) / (2.0 * step)
    slope_y = (height(xs, y + step) - height(xs, y - step)) / (2.0 * step)
    normal = np.column_stack((-slope_x, -slope_y, np.ones_like(y)))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    contact = np.column_stack((xs, y, height(xs, y)))
    return np.asarray(contact + TOOL_RADIUS * (normal - np.array([0.0, 0.0, 1.0])))


def pass_points(x: float, chord: float) -> Array:
    """The tool tip along one pass, bottom to top, at most `chord` off the surface [mm], shape (n, 3)."""
    y = np.linspace(-0.5 * HEIGHT, 0.5 * HEIGHT, SAMPLES)
    tip = tool_tip(x, y)
    edges = np.diff(tip, axis=0)
    lengths = np.linalg.norm(edges, axis=1)
    tangents = edges / lengths[:, None]
    turn = np.linalg.norm(np.diff(tangents, axis=0), axis=1)
    curvature = np.concatenate(([0.0], turn / (0.5 * (lengths[1:] + lengths[:-1]))))

    # The error of a chord of length l is κ l²/8, with the greatest κ of the samples nearby, because a block
    # spans several samples.
    padded = np.pad(curvature, 2, mode="edge")
    curvature = np.max([padded[i : i + len(curvature)] for i in range(5)], axis=0)
    spacing = np.clip(np.sqrt(8.0 * chord / np.maximum(curvature, 1e-9)), *BLOCK_LENGTHS)
    station = np.concatenate(([0.0], np.cumsum(lengths / spacing)))
    count = max(2, int(np.ceil(station[-1])) + 1)
    return tool_tip(x, np.interp(np.linspace(0.0, station[-1], count), station, y))


def program(
    blocks: int = 5000, *, chord: float = 0.002, feed: float = 4000.0, tolerance: float = 0.01
) -> str:
    """The part program with about `blocks` blocks; they determine the number of passes over the head.

    `chord` error of a block [mm], `feed` [mm/min], `tolerance` of the path control [mm].
    """
    sample = np.linspace(-0.5 * WIDTH, 0.5 * WIDTH, 41)
    per_pass = float(np.mean([len(pass_points(x, chord)) for x in sample]))
    xs = np.linspace(-0.5 * WIDTH, 0.5 * WIDTH, max(1, round(blocks / per_pass)) + 2)[1:-1]
    start = pass_points(xs[0], chord)[0]
    lines = [
        "%",
        f"(Head, {len(xs)} finishing passes, blocks of at most {chord:g} mm chord error)",
        f"(Ball end mill, radius {TOOL_RADIUS:g} mm; zero: middle of the field, on the table)",
        "G21 G90 G17 G40 G49 G80 G94",
        f"G64 P{tolerance:g}",
        "T1 M6",
        "S20000 M3",
        "G0 Z60.",
        f"G0 X{start[0]:.4f} Y{start[1]:.4f}",
        f"G0 Z{start[2] + 5.0:.4f}",
        f"G1 Z{start[2]:.4f} F1000.",
        f"G1 F{feed:g}",
    ]
    for index, plane in enumerate(xs):
        points = pass_points(plane, chord)
        if index % 2:
            points = points[::-1]
        lines.append(f"(pass {index + 1})")
        lines.extend(f"X{x:.4f} Y{y:.4f} Z{z:.4f}" for x, y, z in points.tolist())
    lines += ["G0 Z60.", "M5", "M30", "%"]
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--blocks", type=int, default=5000, help="about how many blocks (default 5000)")
    parser.add_argument("--chord", type=float, default=0.002, help="that a block may cut off [mm] (0.002)")
    parser.add_argument("--feed", type=float, default=4000.0, help="[mm/min] (default 4000)")
    parser.add_argument("--tolerance", type=float, default=0.01, help="G64 P [mm] (default 0.01)")
    parser.add_argument("--output", type=Path, default=Path("out/head.ngc"))
    options = vars(parser.parse_args())
    output: Path = options.pop("output")

    text = program(**options)
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_text(text, encoding="ascii")
    print(f"{output}: {text.count(chr(10))} lines")


if __name__ == "__main__":
    main()
