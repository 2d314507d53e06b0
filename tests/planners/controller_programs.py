"""Programs of several kinds, whose time in LinuxCNC's simulator was measured."""

from __future__ import annotations

import math

HEAD = "G21 G90 G17 G94 G40 G49 G80 G64 P{tolerance:g}\nG0 X0 Y0 Z0\n"


def trochoid(tolerance: float = 0.1) -> str:
    """Twenty loops of a trochoid by lines of 0.3 to 0.5 mm, at 60 mm/s."""
    lines = [HEAD.format(tolerance=tolerance) + "F3600"]
    for i in range(1, 20 * 40 + 1):
        turn = 2.0 * math.pi * i / 40
        x = 3.0 * math.sin(turn) + 1.5 * i / 40
        lines.append(f"G1 X{x:.5f} Y{3.0 * (1.0 - math.cos(turn)):.5f}")
    return "\n".join([*lines, "M2"]) + "\n"


def zigzag(tolerance: float = 0.05) -> str:
    """Sixty corners with various angles between lines of 2 to 9 mm in space, at 80 mm/s."""
    lines = [HEAD.format(tolerance=tolerance) + "F4800"]
    x = y = 0.0
    for i in range(60):
        length, way = 2.0 + 7.0 * (i * 0.618034 % 1.0), 2.0 * math.pi * (i * 0.381966 % 1.0)
        x, y = x + length * math.cos(way), y + length * math.sin(way)
        lines.append(f"G1 X{x:.4f} Y{y:.4f} Z{i % 4 * 0.5:.4f}")
    return "\n".join([*lines, "M2"]) + "\n"


def pause() -> str:
    """Twenty of these corners with a pause in the middle."""
    lines = zigzag().splitlines()
    return "\n".join([*lines[:12], "G4 P0.2", *lines[12:20], "M2"]) + "\n"


def slots(tolerance: float = 0.02) -> str:
    """Slots made of lines and half circles, tangent to each other, at 50 mm/s."""
    lines = [HEAD.format(tolerance=tolerance) + "F3000"]
    for i in range(8):
        y, radius = 10.0 * i, 1.0 + 0.4 * i
        lines += [
            f"G1 X0 Y{y:.4f}",
            f"G1 X20 Y{y:.4f}",
            f"G3 X20 Y{y + 2.0 * radius:.4f} J{radius:.4f} I0",
            f"G1 X0 Y{y + 2.0 * radius:.4f}",
            f"G3 X0 Y{y:.4f} J{-radius:.4f} I0",
        ]
    return "\n".join([*lines, "M2"]) + "\n"
