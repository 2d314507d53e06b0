"""Repeat Figures 4 to 7 of Zhang et al. 2010 on one pass of the vase: fit, limit curve, speed, accelerations.

The pass has 486 points in a plane x = const; the machine has A_y = 3000 and A_z = 1000 mm/s². The figures
show the fitted curve with its polynomial pieces, the limit curve with the planned speed and the setpoints of
a 1 ms servo, and the accelerations of the y and z axes. Wherever the speed is below the feed one of the
accelerations is at its limit ("bang-bang"). All are drawn over y, which grows along the pass; each figure
shows the whole pass above and a detail of it below.

    python examples/zhang_figures.py --output out/zhang
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray
from vase import LENGTH, pass_points

import feedplan

plt.style.use(Path(__file__).with_name("figures.mplstyle"))
Array = NDArray[np.float64]

PLANE = 0.0  # x of the pass [mm]
FEED = 6000.0  # [mm/min]
DETAIL = (57.0, 69.0)  # y of the detail [mm]
FINE = 2e-5  # time between the points of drawn curves [s]
SAMPLES = 24  # number of points at which a piece is drawn

INK, SHADE, BLUE, RED = "#1b1f24", "#9aa3ad", "#1f6fd0", "#d1495b"


def program() -> str:
    """One pass of the vase, after a pause at its start, as a part program."""
    points = np.round(pass_points(PLANE), 4).tolist()
    lines = ["(One pass of the vase)", "G21 G90 G17 G94", "G64 P0.02"]
    lines += [f"G0 X{PLANE} Y{points[0][0]:.4f} Z{points[0][1]:.4f}", "G4 P0.1", f"G1 F{FEED:g}"]
    lines += [f"Y{y:.4f} Z{z:.4f}" for y, z in points[1:]]
    return "\n".join([*lines, "M30"]) + "\n"


@dataclass(frozen=True)
class Motion:
    """The motion at times: `y` [mm], `speed` [mm/s], `acceleration` (n, 2) in y and z [mm/s²]."""

    y: Array
    speed: Array
    acceleration: Array


def curve_of(path: feedplan.Path, begin: int, samples: int) -> tuple[Array, Array, Array]:
    """The pass from piece `begin` on, at equally spaced parameters of each piece: y and z and their first and
    second derivatives, each (pieces, samples, 2)."""
    piece = np.arange(begin, len(path))
    u = path.width[begin:, None] * np.linspace(0.0, 1.0, samples)
    found = path.curve.evaluate(np.repeat(piece, samples), u.ravel(), 2)
    axes = [path.axes.index("Y"), path.axes.index("Z")]
    place, first, second = (values[:, axes].reshape(*u.shape, 2) for values in found)
    return place, first, second


def speed_limit(first: Array, second: Array, acceleration: Array) -> Array:
    """The limit curve [mm/s]: at a higher speed no acceleration along the path keeps both limits.

    By equations 7 and 8 of the paper the squared parameter speed is at most
    (A_y |z'| + A_z |y'|) / |y'' z' - z'' y'|.
    """
    twist = np.abs(second[..., 0] * first[..., 1] - second[..., 1] * first[..., 0])
    reach = np.abs(first[..., 1]) * acceleration[0] + np.abs(first[..., 0]) * acceleration[1]
    straight = twist <= 1e-12 * reach
    limit_sq = np.where(straight, np.inf, reach / np.where(straight, 1.0, twist))
    return np.asarray(np.linalg.norm(first, axis=-1) * np.sqrt(limit_sq))


def motion_of(plan: feedplan.Plan, begin: int, period: float) -> Motion:
    """The motion at the setpoints from piece `begin` on."""
    setpoints = plan.setpoints(period=period).all()
    kept = (setpoints.piece >= begin) & (setpoints.t <= plan.time)
    axes = [setpoints.axes.index("Y"), setpoints.axes.index("Z")]
    return Motion(
        setpoints.position[kept, axes[0]],
        np.linalg.norm(setpoints.velocity[kept], axis=1),
        setpoints.acceleration[kept][:, axes],
    )


def axis_limits(machine: feedplan.Machine) -> Array:
    """Greatest accelerations of y and z [mm/s²]."""
    return np.array([machine.axis(name).max_acceleration for name in "YZ"])


def figure(path: Path, title: str, unit: str, draw: Callable[[Axes, bool], None]) -> None:
    """A figure with the whole pass above and the detail below; `draw(axes, close)` fills both."""
    drawing, (whole, close) = plt.subplots(2, 1, figsize=(9.0, 6.4), height_ratios=(1.0, 1.5))
    for axes in (whole, close):
        draw(axes, axes is close)
        axes.set_ylabel(unit)
    whole.set_title(title)
    whole.axvspan(*DETAIL, color="#fff3c4", zorder=0)
    whole.set_xlim(0.0, LENGTH)
    close.set_xlim(*DETAIL)
    close.set_xlabel("y [mm]")
    drawing.tight_layout()
    drawing.savefig(path)
    plt.close(drawing)


def draw_all(plan: feedplan.Plan, begin: int, output: Path) -> list[Path]:
    """Draws the four figures of the pass that starts at piece `begin`."""
    machine = plan.machine
    limits = axis_limits(machine)
    place, first, second = curve_of(plan.path, begin, SAMPLES)
    fine, servo = motion_of(plan, begin, FINE), motion_of(plan, begin, machine.period)
    programmed = np.round(pass_points(PLANE), 4)

    def fit(axes: Axes, close: bool) -> None:
        for shade, colour in enumerate((BLUE, RED)):
            alternate = np.insert(place[shade::2], SAMPLES, np.nan, axis=1).reshape(-1, 2)
            axes.plot(*alternate.T, color=colour, linewidth=1.4)
        if close:
            axes.plot(*programmed.T, "o", markersize=3.4, fillstyle="none", color=INK, markeredgewidth=0.7)
            axes.plot(*place[:, 0].T, "|", markersize=11, color=SHADE, zorder=1)
            seen = (programmed[:, 0] >= DETAIL[0]) & (programmed[:, 0] <= DETAIL[1])
            low, high = programmed[seen, 1].min(), programmed[seen, 1].max()
            axes.set_ylim(low - 0.06 * (high - low), high + 0.06 * (high - low))

    def speed(axes: Axes, close: bool) -> None:
        ceiling = 1.6 * fine.speed.max()
        y, limit = place[..., 0], np.minimum(speed_limit(first, second, limits), 10.0 * ceiling)
        width = 0.9 if close else 0.5
        axes.plot(y.ravel(), limit.ravel(), color=SHADE, linewidth=width, label="velocity limit curve")
        axes.plot(fine.y, fine.speed, color=BLUE, linewidth=1.5, label="planned speed")
        axes.axhline(FEED / 60.0, color=INK, linewidth=0.8, linestyle=(0, (4, 3)), label="programmed feed")
        if close:
            axes.plot(
                servo.y, servo.speed, "o", markersize=3.2, fillstyle="none", color=RED,
                markeredgewidth=0.7, label=f"interpolation points, every {1e3 * machine.period:g} ms",
            )  # fmt: skip
            axes.legend(loc="upper right", framealpha=0.95, fontsize=9)
        axes.set_ylim(0.0, ceiling)

    def acceleration(axis: int) -> Callable[[Axes, bool], None]:
        def draw(axes: Axes, close: bool) -> None:
            for sign in (-1.0, 1.0):
                axes.axhline(sign * limits[axis], color=RED, linewidth=0.9, linestyle=(0, (4, 3)))
            axes.plot(fine.y, fine.acceleration[:, axis], color=BLUE, linewidth=1.1 if close else 0.5)
            axes.set_ylim(-1.15 * limits[axis], 1.15 * limits[axis])

        return draw

    output.mkdir(parents=True, exist_ok=True)
    drawings: tuple[tuple[str, str, str, Callable[[Axes, bool], None]], ...] = (
        ("figure4", "Fitted curve, pieces in turn blue and red, and programmed points", "z [mm]", fit),
        ("figure5", "Velocity limit curve, planned speed and interpolation points", "speed [mm/s]", speed),
        ("figure6", "Acceleration of the y axis", "a_y [mm/s²]", acceleration(0)),
        ("figure7", "Acceleration of the z axis", "a_z [mm/s²]", acceleration(1)),
    )
    written = []
    for name, title, unit, draw in drawings:
        written.append(output / f"{name}.png")
        figure(written[-1], title, unit, draw)
    return written


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--output", type=Path, default=Path("out/zhang"), help="directory of the figures")
    output = parser.parse_args().output

    output.mkdir(parents=True, exist_ok=True)
    source = output / "pass.ngc"
    source.write_text(program(), encoding="ascii")
    begin = time.perf_counter()
    plan = feedplan.plan(source, feedplan.Machine.load("vase"))
    seconds = time.perf_counter() - begin
    audit = plan.audit()

    fit = plan.path.fit
    print(f"points {fit.points}, B-splines {fit.splines}, quadratic polynomials {fit.polynomials}")
    print(f"compression ratios {fit.spline_ratio:.1f} and {fit.polynomial_ratio:.1f} (paper: 14.3 and 2.8)")
    print(f"deviation {1000.0 * fit.deviation:.2f} µm")
    print(f"machining time {plan.time:.4f} s, planned in {1000.0 * seconds:.1f} ms")
    print(f"audit: {'every limit holds' if audit.ok else 'a limit is broken'}")
    # The pass begins after the pause, at the start of the second run.
    first = int(plan.path.runs[1])
    fine = motion_of(plan, first, FINE)
    limits = axis_limits(plan.machine)
    axis_share = np.mean((np.abs(fine.acceleration) > 0.9999 * limits).any(axis=1))
    feed_share = np.mean(fine.speed > 0.9999 * FEED / 60.0)
    print(f"an axis at its acceleration limit {axis_share:.1%} of the time, at the feed {feed_share:.1%}")
    for path in draw_all(plan, first, output):
        print(path)


if __name__ == "__main__":
    main()
