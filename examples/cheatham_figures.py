"""Repeat the experiment of Cheatham 2007, chapter 6: an automotive panel on the Tarus styling mill.

Table 6.1 of the thesis has the mill's limits; the feed is 80 mm/s and the chord tolerance 0.0254 mm. The
panel is our own (`panel.py`), because the thesis's geometry is not published. The criteria of the thesis are:
error of the interpolated step at most 1e-6 of the step, speed never above the allowed one, chord error far
below the tolerance, and every axis within its limits (the thesis exceeded the limit of jerk by up to 40 %).

The figures show the speed by each method (Figures 6.4 to 6.7 of the thesis) and, for the method that is
closest to the optimum, the chord error (6.19) and velocity, acceleration and jerk of the axes (6.23 to 6.31),
each over its limit.

    python examples/cheatham_figures.py --output out/cheatham
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from panel import FEED, panel

import feedplan

plt.style.use(Path(__file__).with_name("figures.mplstyle"))
Array = NDArray[np.float64]

SHADE, AMBER, BLUE, RED = "#9aa3ad", "#e8a33d", "#1f6fd0", "#d1495b"
# Methods with their colours; the last method is closest to the optimum.
METHODS = {"s-curve": SHADE, "ruckig": AMBER, "jerk-limited": BLUE}
CLOSE = 4.0  # duration of the detailed figure, as in the thesis [s]


@dataclass(frozen=True)
class Motion:
    """The motion at the setpoints: `t` (n,) [s]; `use` of the limits of velocity, acceleration and jerk by
    each axis (3, n, axes); the `speed` along the path, and the speed that feed, velocities and chord error
    `allow` (n,) [mm/s]; the `chord` error (n,) [mm]; the greatest relative error of the interpolated step."""

    t: Array
    use: Array
    speed: Array
    allow: Array
    chord: Array
    step_error: float
    axes: tuple[str, ...]


def motion_of(plan: feedplan.Plan) -> Motion:
    """The motion at the setpoints of a plan."""
    stream, problem = plan.setpoints(), plan.problem
    setpoints = stream.all()
    limits = np.array(
        [[axis.max_velocity, axis.max_acceleration, axis.max_jerk] for axis in plan.machine.axes]
    ).T
    moved = np.stack([setpoints.velocity, setpoints.acceleration, setpoints.jerk])
    speed = np.linalg.norm(setpoints.velocity, axis=1)
    first, second = problem.derivatives(setpoints.piece, setpoints.u, 2)[1:]
    length = np.linalg.norm(first, axis=1)
    tangent = first / length[:, None]
    across = second - tangent * (second * tangent).sum(axis=1)[:, None]
    curvature = np.linalg.norm(across, axis=1) / length**2
    # The chord error on a circle: δ = 1/κ − √(1/κ² − (v T/2)²), about κ (v T)²/8.
    chord = curvature * (speed * plan.machine.period) ** 2 / 8.0
    with np.errstate(divide="ignore"):
        allow = np.minimum.reduce(
            [
                problem.feed[setpoints.piece],
                (limits[0] / np.abs(tangent)).min(axis=1),
                np.sqrt(8.0 * plan.machine.chord_tolerance / curvature) / plan.machine.period,
            ]
        )
    return Motion(
        setpoints.t,
        moved / limits[:, None],
        speed,
        allow,
        chord,
        stream.stats.length_error,
        setpoints.axes,
    )


def save(drawing: Figure, path: Path) -> Path:
    drawing.tight_layout()
    drawing.savefig(path)
    plt.close(drawing)
    return path


def draw_speed(motions: dict[str, Motion], path: Path) -> Path:
    """Draws the speed by each method and the allowed speed: the whole program above, its first seconds
    below."""
    drawing, (whole, close) = plt.subplots(2, 1, figsize=(9.0, 6.0), height_ratios=(1.0, 1.4))
    *_, best = motions.values()
    for axes in (whole, close):
        for method, motion in motions.items():
            axes.plot(motion.t, motion.speed, color=METHODS[method], linewidth=1.2, label=method)
        axes.plot(
            best.t, best.allow, color=RED, linewidth=0.9, label="allowed", linestyle=(0, (4, 3)), zorder=1
        )
        axes.set_ylim(0.0, 1.15 * FEED)
        axes.set_ylabel("speed [mm/s]")
    whole.set_title("Speed of the tool")
    whole.axvspan(0.0, CLOSE, color="#fff3c4", zorder=0)
    whole.set_xlim(0.0, max(motion.t[-1] for motion in motions.values()))
    close.set_xlim(0.0, CLOSE)
    close.set_xlabel("time [s]")
    close.legend(loc="lower center", framealpha=0.95, fontsize=9, ncols=4)
    return save(drawing, path)


def draw_use(motion: Motion, order: int, title: str, path: Path) -> Path:
    """Draws a derivative of every axis, divided by its limit."""
    drawing, rows = plt.subplots(len(motion.axes), 1, figsize=(9.0, 6.0), sharex=True)
    for axes, use, name in zip(rows, motion.use[order].T, motion.axes, strict=True):
        for limit in (-1.0, 1.0):
            axes.axhline(limit, color=RED, linewidth=0.9, linestyle=(0, (4, 3)))
        axes.plot(motion.t, use, color=BLUE, linewidth=0.6)
        axes.set_ylim(-1.2, 1.2)
        axes.set_ylabel(f"{name} axis")
    rows[0].set_title(title)
    rows[-1].set_xlim(0.0, motion.t[-1])
    rows[-1].set_xlabel("time [s]")
    return save(drawing, path)


def draw_chord(motion: Motion, tolerance: float, path: Path) -> Path:
    drawing, axes = plt.subplots(figsize=(9.0, 3.0))
    axes.plot(motion.t, motion.chord / tolerance, color=BLUE, linewidth=0.7)
    axes.set_title("Chord error over its tolerance")
    axes.set_xlim(0.0, motion.t[-1])
    axes.set_ylim(0.0, None)
    axes.set_xlabel("time [s]")
    return save(drawing, path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--passes", type=int, default=4, help="over the panel (default 4)")
    parser.add_argument("--output", type=Path, default=Path("out/cheatham"), help="directory of the figures")
    arguments = parser.parse_args()
    output = arguments.output

    output.mkdir(parents=True, exist_ok=True)
    source = output / "panel.json"
    source.write_text(json.dumps(panel(arguments.passes)), encoding="ascii")
    machine = feedplan.Machine.load("tarus")

    print("method         time  mean speed  step error  speed  velocity  acceleration    jerk   chord  audit")
    motions = {}
    for method in METHODS:
        plan = feedplan.plan(source, machine, method)
        motion = motions[method] = motion_of(plan)
        velocity, acceleration, jerk = (np.abs(use).max() for use in motion.use)
        print(
            f"{method:12s} {plan.time:6.2f} {motion.speed.mean():11.2f} {motion.step_error:11.1e} "
            f"{(motion.speed / motion.allow).max():6.3f} {velocity:9.4f} {acceleration:13.4f} {jerk:7.4f} "
            f"{motion.chord.max() / machine.chord_tolerance:7.4f}  {'ok' if plan.audit().ok else 'broken'}"
        )
    print(
        "time [s], mean speed [mm/s], error of a step in parts of it, and the most that is used of each limit"
    )
    print(draw_speed(motions, output / "speed.png"))
    print(draw_chord(motion, machine.chord_tolerance, output / "chord.png"))
    for order, name in enumerate(("velocity", "acceleration", "jerk")):
        title = f"{name.capitalize()} of the axes over its limit"
        print(draw_use(motion, order, title, output / f"{name}.png"))


if __name__ == "__main__":
    main()
