"""Draw the tool path of the head, coloured by the planned speed.

The passes are seen from the front and a little from the side; where the surface turns quickly, at the nose,
the lips and the eyes, an axis reaches its acceleration limit and the tool slows down.

    python examples/speed_picture.py --blocks 60000 --output out/head_speed.png
"""

from __future__ import annotations

import argparse
from io import BytesIO
from pathlib import Path

import head
import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize
from numpy.typing import NDArray
from PIL import Image

import feedplan

Array = NDArray[np.float64]

PERIOD = 0.004  # time between drawn points [s]
SIDEWAYS, DOWNWARD = np.radians(24.0), np.radians(16.0)  # angles of the view from straight above
LINE_WIDTH = 1.3
TABLE = 2.0  # points below this height are not drawn [mm]
SLOW_TO_FAST = LinearSegmentedColormap.from_list(
    "slow to fast", ("#ff2e63", "#ff8c42", "#ffe66d", "#6fe3d4", "#4ea8f5")
)
BACKGROUND, INK = "#10151c", "#dfe6ee"


def project(points: Array) -> tuple[Array, Array]:
    """Positions (n, 2) on the picture of points (n, 3), and their nearness to the viewer (n,)."""
    x, y, z = points.T
    side, down = (
        np.array([np.cos(SIDEWAYS), np.sin(SIDEWAYS)]),
        np.array([np.cos(DOWNWARD), np.sin(DOWNWARD)]),
    )
    across, near = side[0] * x + side[1] * z, side[0] * z - side[1] * x
    return np.column_stack((across, down[0] * y + down[1] * near)), down[0] * near - down[1] * y


def brightness(points: Array) -> Array:
    """Brightness (n,), 0 to 1, of the surface under the points (n, 3), with light from the upper left."""
    x, y = points[:, 0], points[:, 1]
    slope_x = (head.height(x + 0.05, y) - head.height(x - 0.05, y)) / 0.1
    slope_y = (head.height(x, y + 0.05) - head.height(x, y - 0.05)) / 0.1
    normal = np.column_stack((-slope_x, -slope_y, np.ones_like(x)))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    light = np.array([-0.45, 0.4, 0.8])
    return np.asarray(0.3 + 0.7 * np.clip(normal @ light, 0.0, 1.0))


def draw(points: Array, speed: Array, output: Path) -> None:
    """Draw the path through `points` (n, 3) [mm] coloured by `speed` (n,) [mm/s] as a PNG file."""
    place, near = project(points)
    scale = ScalarMappable(Normalize(0.0, float(speed.max())), SLOW_TO_FAST)
    colours = scale.to_rgba(speed)
    colours[:, :3] *= brightness(points)[:, None]

    # Farthest segments first; without the steps from pass to pass, and without points on the table.
    drawn = np.flatnonzero((np.abs(np.diff(points[:, 1])) > 1e-9) & (points[1:, 2] > TABLE))
    drawn = drawn[np.argsort(near[drawn], kind="stable")]
    segments = np.stack((place[drawn], place[drawn + 1]), axis=1)
    drawing = plt.figure(figsize=(7.0, 7.2), facecolor=BACKGROUND)
    axes = drawing.add_axes((0.0, 0.0, 0.86, 1.0))
    axes.add_collection(
        LineCollection(list(segments), colors=colours[drawn], linewidths=LINE_WIDTH, capstyle="round")
    )
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_axis_off()

    bar = drawing.colorbar(scale, cax=drawing.add_axes((0.86, 0.2, 0.02, 0.6)))
    bar.set_label("planned speed [mm/s]", color=INK)
    bar.ax.tick_params(colors=INK)
    bar.outline.set_visible(False)
    pixels = BytesIO()
    drawing.savefig(pixels, dpi=110, facecolor=BACKGROUND)
    plt.close(drawing)
    # With a palette the file has a third of the size.
    output.parent.mkdir(parents=True, exist_ok=True)
    Image.open(pixels).convert("RGB").quantize(256, Image.Quantize.FASTOCTREE).save(output, optimize=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--blocks", type=int, default=4000, help="about how many blocks (default 4000)")
    parser.add_argument("--machine", default="router", help="bundled name or TOML file (default router)")
    parser.add_argument("--output", type=Path, default=Path("out/head_speed.png"))
    arguments = parser.parse_args()

    source = arguments.output.with_suffix(".ngc")
    source.parent.mkdir(parents=True, exist_ok=True)
    program = head.program(arguments.blocks)
    source.write_text(program, encoding="ascii")
    plan = feedplan.plan(source, feedplan.Machine.load(arguments.machine))
    setpoints = plan.setpoints(period=PERIOD).all()
    # Only the passes, without the first approach and the last retract.
    lines = program.splitlines()
    on_part = (setpoints.line > lines.index("(pass 1)") + 2) & (setpoints.line < lines.index("M5"))
    draw(setpoints.position[on_part], np.linalg.norm(setpoints.velocity[on_part], axis=1), arguments.output)
    print(f"{arguments.output}: {plan.time:.1f} s of machining")


if __name__ == "__main__":
    main()
