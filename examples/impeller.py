"""Write a five-axis program: the blades of a small impeller, finished by the flank of the tool.

Each blade is a ruled surface: straight lines from the hub outwards, to which the tool is parallel. A pass
goes along one side of a blade, around its edge and back along the other side. Passes go level by level down
to the hub; then follows the next blade.

The same motion is written in one of three forms:

    tip      G43.4, the tool's tip with the angles of the rotary axes
    vector   G43.5, the tool's tip with its direction I J K
    joints   positions of the machine's axes, from its kinematics

    python examples/impeller.py --machine trunnion-ac --form vector --output out/impeller.ngc
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from feedplan import Machine
from feedplan.machine.path_derivatives import positions
from feedplan.machine.rotary import RotaryChain, ToolVector

Array = NDArray[np.float64]

FORMS = ("tip", "vector", "joints")
BLADES = 5
HEIGHT = 18.0  # height of a blade along its rulings [mm]
THICKNESS = 1.6  # [mm]
TOOL_RADIUS = 4.0  # [mm]
CLEARANCE = 40.0  # distance from the hub between blades, along the tool [mm]
EDGE_POINTS = 13  # number of points of the half circle around the edge of a blade


def ruling(u: Array, blade: int) -> tuple[Array, Array]:
    """Points of a blade's middle line on the hub (n, 3) [mm] and unit directions of its rulings (n, 3), for
    parameters u (n,) from 0 to 1."""
    angle = 2.0 * np.pi * blade / BLADES + 0.9 * u**2
    radius, height = 18.0 + 32.0 * u, 46.0 - 30.0 * u**2
    hub = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])
    lean, towards = np.radians(18.0 + 24.0 * u), angle + 0.5
    direction = np.column_stack(
        [np.sin(lean) * np.cos(towards), np.sin(lean) * np.sin(towards), np.cos(lean)]
    )
    return hub, direction


def blade_pass(blade: int, level: float, points: int) -> tuple[Array, Array]:
    """Tips and directions (n, 3) around a blade, `level` mm up its rulings, with `points` on each side."""
    u = np.linspace(0.0, 1.0, points)
    hub, direction = ruling(u, blade)
    middle = hub + level * direction
    along = np.gradient(middle, u, axis=0)
    across = np.cross(direction, along)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    beside = (TOOL_RADIUS + 0.5 * THICKNESS) * across
    # A half circle around the edge, at right angles to the last ruling.
    turn = np.linspace(0.0, np.pi, EDGE_POINTS)[1:-1, None]
    ahead = np.cross(across[-1], direction[-1])
    edge = middle[-1] + np.cos(turn) * beside[-1] + np.sin(turn) * np.linalg.norm(beside[-1]) * ahead
    tips = np.concatenate([middle + beside, edge, (middle - beside)[::-1]])
    last = np.repeat(direction[-1:], len(edge), axis=0)
    return tips, np.concatenate([direction, last, direction[::-1]])


def passes(blocks: int, levels: int) -> list[tuple[Array, Array]]:
    """All passes, with about `blocks` points in total; each approaches and retracts along the tool."""
    points = max(4, round((blocks / (BLADES * levels) - EDGE_POINTS) / 2.0))
    found = []
    for blade in range(BLADES):
        for level in np.linspace(HEIGHT, 0.0, levels + 1)[1:]:
            tips, directions = blade_pass(blade, float(level), points)
            out = tips[[0, -1]] + CLEARANCE * directions[[0, -1]]
            found.append(
                (
                    np.concatenate([out[:1], tips, out[1:]]),
                    np.concatenate([directions[:1], directions, directions[-1:]]),
                )
            )
    return found


def rotary_words(machine: Machine, directions: Array) -> Array:
    """The angles (n, 2) [deg] by which the two rotary axes point the tool, without jumps.

    Takes the first of the two poses, perhaps with one turn of C less, that stays within the axes' travel.
    """
    chain = five_axis(machine)
    axes = machine.axes[3:]
    low, high = (np.array([axis.travel[end] for axis in axes]) for end in (0, 1))
    for side in (1.0, -1.0):
        found = ToolVector(chain, side).angles(tuple(directions.T))
        angles = np.column_stack([np.asarray(found[axis.name]) for axis in axes])
        angles = np.unwrap(angles, axis=0, period=360.0)
        for turn in (0.0, -360.0):
            turned = angles + turn * np.array([axis.name == "C" for axis in axes])
            if ((turned >= low) & (turned <= high)).all():
                return turned
    raise SystemExit(f"machine {machine.name} cannot tilt its tool so far: use another machine")


def five_axis(machine: Machine) -> RotaryChain:
    """The kinematics of a five-axis machine."""
    chain = machine.inverse
    if not isinstance(chain, RotaryChain) or len(chain.joint_names) != 5:
        raise SystemExit(f"machine {machine.name} has no two rotary axes: use trunnion-ac or the like")
    return chain


def program(
    machine: Machine, form: str = "tip", blocks: int = 2000, *, levels: int = 3, feed: float = 3000.0
) -> str:
    """The part program with about `blocks` blocks in one of the `FORMS`; `feed` of the tip [mm/min].

    In the form `joints` each block has its feed as inverse time (G93), so that the tip moves at its feed.
    """
    chain = five_axis(machine)
    names = machine.axis_names
    all_passes = passes(blocks, levels)
    safe = min(machine.axis("Z").travel[1] - 10.0, 480.0)
    lines = [
        "%",
        f"(Impeller, {BLADES} blades, flank of the tool, radius {TOOL_RADIUS:g} mm)",
        f"(machine {machine.name}, tool {chain.tool_length:g} mm; zero: centre of the table's face)",
        "G21 G90 G17 G40 G49 G80 G94",
        "G64 P0.01",
        "T1 M6",
        "S18000 M3",
        f"G0 {words('Z', [safe])}",
    ]
    every = rotary_words(machine, np.concatenate([directions for _, directions in all_passes]))
    ends = np.cumsum([len(tips) for tips, _ in all_passes])
    for number, (tips, directions) in enumerate(all_passes, 1):
        angles = every[ends[number - 1] - len(tips) : ends[number - 1]]
        places = np.column_stack([tips, angles])
        if number == 1:
            lines.append(f"G0 {words(names[3:], angles[0])}")
            lines += [f"{'G43.4' if form == 'tip' else 'G43.5'} H1"] if form != "joints" else []
        lines.append(f"(pass {number})")
        if form == "joints":
            joints = positions(chain, places)
            rows = [words(names, row) for row in joints]
            steps = np.linalg.norm(np.diff(tips, axis=0), axis=1)
            lines.append(f"G0 {rows[0]}")
            lines += [
                f"G93 G1 {row} F{feed / step:.4f}" for row, step in zip(rows[1:-1], steps[:-1], strict=True)
            ]
            lines.append(f"G94 G0 {rows[-1]}")
            continue
        rows = [words(names, row) for row in places]
        if form == "vector":
            rows = [
                f"{words('XYZ', tip)} {words('IJK', direction, 6)}"
                for tip, direction in zip(tips, directions, strict=True)
            ]
        lines += [f"G0 {rows[0]}", f"G1 {rows[1]} F{feed:g}", *rows[2:-1], f"G0 {rows[-1]}"]
    lines += [] if form == "joints" else ["G49"]
    lines += [f"G0 {words('Z', [safe])}", "M5", "M30", "%"]
    return "\n".join(lines) + "\n"


def words(letters: Sequence[str], values: Sequence[float] | Array, decimals: int = 4) -> str:
    """Words of a block, such as `X1.0000 Y2.0000`."""
    return " ".join(
        f"{letter}{round(float(value), decimals) + 0.0:.{decimals}f}"
        for letter, value in zip(letters, values, strict=True)
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--machine", default="trunnion-ac", help="a five-axis machine (default trunnion-ac)")
    parser.add_argument("--form", choices=FORMS, default="tip", help="(default tip)")
    parser.add_argument("--blocks", type=int, default=2000, help="about how many blocks (default 2000)")
    parser.add_argument("--levels", type=int, default=3, help="passes a blade (default 3)")
    parser.add_argument("--feed", type=float, default=3000.0, help="of the tip [mm/min] (default 3000)")
    parser.add_argument("--output", type=Path, default=Path("out/impeller.ngc"))
    options = vars(parser.parse_args())
    machine, output = Machine.load(options.pop("machine")), options.pop("output")

    text = program(machine, **options)
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_text(text, encoding="ascii")
    print(f"{output}: {text.count(chr(10))} lines")


if __name__ == "__main__":
    main()
