"""Random programs with rotary and parallel axes: zigzags, arcs, splines, indexing, all kinds of feeds."""

from __future__ import annotations

import numpy as np

from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine

AXES = ("XYZA", "XYZAB", "XYZUVW", "XA", "XYZUA")
TOLERANCES = (0.001, 0.01, 0.1, 1.0)


def rotary_machine(seed: int, axes: str) -> Machine:
    """Axes with different limits, mostly fast enough for the feeds."""
    rng = np.random.default_rng([seed, 2])
    velocity = 10 ** rng.uniform(2.0, 3.5)
    limits = np.array([velocity, 20.0 * velocity, 800.0 * velocity]) * 10 ** rng.uniform(
        -0.3, 0.3, (len(axes), 3)
    )
    chord_tolerance = 0.05 if rng.random() < 0.3 else np.inf
    rows = (Axis(name, *own[:2], max_jerk=own[2]) for name, own in zip(axes, limits, strict=True))
    return Machine("rotary", tuple(rows), period=1e-3, chord_tolerance=chord_tolerance)


def rotary_program(seed: int, axes: str, feeds: tuple[float, float, float], inverse: bool = False) -> str:
    """Random blocks; `feeds` are for moves of X, Y, Z, of U, V, W without these, and of rotary axes alone
    [mm/min, mm/min, deg/min].

    With `inverse` some blocks are in inverse time. Every block has its own feed.
    """
    rng = np.random.default_rng([seed, len(axes)])
    at = dict.fromkeys(axes, 0.0)
    lines = [f"G21 G90 G94 G64 P{rng.choice(TOLERANCES)}", "G0 " + " ".join(f"{name}0" for name in axes)]
    linear, parallel = [[name for name in axes if name in letters] for letters in ("XYZ", "UVW")]
    rotary = [name for name in axes if name in "ABC"]
    size = 10 ** rng.uniform(-0.5, 1.5)

    def words(names: list[str]) -> str:
        for name in names:
            step = size * rng.normal() * (10 ** rng.uniform(0.0, 1.5) if name in "ABC" else 1.0)
            at[name] = round(at[name] + step, 4)
        return " ".join(f"{name}{at[name]:.4f}" for name in names)

    def some(names: list[str]) -> list[str]:
        return [name for name in names if rng.random() < 0.6] or names[:1]

    def feed(moved: list[str]) -> str:
        group = next(i for i, names in enumerate((linear, parallel, rotary)) if set(names) & set(moved))
        if inverse and rng.random() < 0.5:
            return f"G93 F{10 ** rng.uniform(0.5, 2.5):.3f}"
        return f"G94 F{feeds[group]:.4f}"

    for _ in range(int(rng.integers(6, 16))):
        kind = rng.choice(5, p=[0.45, 0.2, 0.15, 0.1, 0.1])
        if kind == 0 or (kind == 1 and not (parallel or rotary)):
            moved = some(linear) + (
                some(rotary + parallel) if rng.random() < 0.7 and rotary + parallel else []
            )
            lines.append(f"{feed(moved)} G1 {words(moved)}")
        elif kind == 1:
            moved = some(rotary or parallel)
            lines.append(f"{feed(moved)} G1 {words(moved)}")
        elif kind == 2 and "Y" in axes:
            radius, angle = size * rng.uniform(0.3, 1.0), rng.uniform(0.0, 2.0 * np.pi)
            offset = np.round(radius * np.array([np.cos(angle), np.sin(angle)]), 4)
            at["X"], at["Y"] = (round(at[name] + 2.0 * o, 4) for name, o in zip("XY", offset, strict=True))
            turned = some(rotary) if rotary else []
            lines.append(
                f"{feed(['X'])} {rng.choice(['G2', 'G3'])} X{at['X']:.4f} Y{at['Y']:.4f} "
                f"I{offset[0]:.4f} J{offset[1]:.4f} {words(turned)}"
            )
        elif kind == 3 and "Y" in axes:
            (i, j), (p, q) = size * rng.normal(size=(2, 2))
            lines.append(f"G94 F{feeds[0]:.4f} G5 I{i:.4f} J{j:.4f} P{p:.4f} Q{q:.4f} {words(['X', 'Y'])}")
        else:
            # Small similar steps, which the reader fits by one curve.
            moved = some(linear) + some(rotary or parallel)
            steps = {name: 0.1 * size * rng.normal() for name in moved}
            for n in range(12):
                for name in moved:
                    at[name] = round(at[name] + steps[name] * (1.0 + 0.2 * np.sin(n)), 5)
                place = " ".join(f"{name}{at[name]:.5f}" for name in moved)
                lines.append(f"G94 F{feeds[0]:.4f} G1 {place}")
    return "\n".join([*lines, "M2", ""])
