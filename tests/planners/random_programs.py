"""Random part programs of lines, arcs, splines and dense points, and machines with limits of jerk."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine

CONTROLS = ["", "G64", "G64 P0.05", "G64 P0.01 Q0.01", "G61", "G61.1"]


def random_program(seed: int) -> str:
    """Some dozens of moves of 0.03 to 100 mm, some of them a hundred times smaller than the others."""
    rng = np.random.default_rng(seed)
    walk = _Walk(rng, 10 ** rng.uniform(-1.5, 2.0))
    walk.lines += [f"G21 G90 {rng.choice(CONTROLS)}", "G0 X0 Y0 Z0", f"G1 F{10 ** rng.uniform(1.5, 4.3):.1f}"]
    moves = [walk.line, walk.arc, walk.points, walk.spline, walk.rapid, walk.feed, walk.dwell]
    for move in rng.choice(len(moves), int(rng.integers(3, 60)), p=[0.5, 0.2, 0.08, 0.07, 0.05, 0.06, 0.04]):
        moves[move]()
    return "\n".join([*walk.lines, "M2", ""])


def random_machine(seed: int) -> Machine:
    """Three axes with different limits, with or without a chord tolerance."""
    rng = np.random.default_rng([seed, 1])
    velocity = 10 ** rng.uniform(1.3, 3)
    acceleration = velocity * 10 ** rng.uniform(0.5, 2)
    jerk = acceleration * 10 ** rng.uniform(0.7, 2.5)
    own = np.array([velocity, acceleration, jerk]) * 10 ** rng.uniform(-0.4, 0.4, (3, 3))
    axes = tuple(Axis("XYZ"[k], *own[k, :2], max_jerk=own[k, 2]) for k in range(3))
    chord_tolerance = 0.01 if rng.random() < 0.3 else np.inf
    period = float(rng.choice([5e-4, 1e-3, 4e-3]))
    return Machine("random", axes, period=period, chord_tolerance=chord_tolerance)


class _Walk:
    """The position and the direction at which a program has arrived."""

    def __init__(self, rng: np.random.Generator, size: float) -> None:
        self.rng, self.size, self.at, self.turn = rng, size, np.zeros(3), 0.0
        self.lines: list[str] = []

    def step(self) -> float:
        """A random length [mm]; three in ten are much smaller."""
        small = 10 ** self.rng.uniform(-2, 0) if self.rng.random() < 0.3 else 1.0
        return float(self.size * small * self.rng.uniform(0.2, 1))

    def to(self, code: str, place: NDArray[np.float64], more: str = "") -> None:
        self.at = np.round(place, 5)
        words = " ".join(f"{axis}{x:.5f}" for axis, x in zip("XYZ", self.at, strict=True))
        self.lines.append(f"{code} {words} {more}".rstrip())

    def line(self) -> None:
        sharp = self.rng.random() < 0.3
        self.turn += self.rng.uniform(-np.pi, np.pi) if sharp else 0.7 * self.rng.normal()
        rise = 0.1 * self.rng.normal()
        self.to("G1", self.at + self.step() * np.array([np.cos(self.turn), np.sin(self.turn), rise]))

    def arc(self) -> None:
        """A circle or helix; its radius is at least 0.01 mm, so that the reader accepts it."""
        radius, start, angle = max(self.step(), 0.01), *self.rng.uniform([0, 0.1], [2 * np.pi, 6.1])
        offset = np.round(radius * np.array([np.cos(start), np.sin(start)]), 5)
        left = self.rng.random() < 0.5
        turned = -offset @ _rotation(angle if left else -angle).T
        rise = 0.1 * self.step() if self.rng.random() < 0.3 else 0.0
        place = self.at + np.array([*(offset + turned), rise])
        self.to("G3" if left else "G2", place, f"I{offset[0]:.5f} J{offset[1]:.5f}")

    def points(self) -> None:
        step = 0.02 * self.step()
        for _ in range(int(self.rng.integers(5, 40))):
            self.turn += 0.15 * self.rng.normal()
            self.to("G1", self.at + step * np.array([np.cos(self.turn), np.sin(self.turn), 0.0]))

    def spline(self) -> None:
        (i, j), (p, q), end = self.step() * self.rng.normal(size=(3, 2))
        self.at = np.round(self.at + np.array([*end, 0.0]), 5)
        self.lines.append(f"G5 I{i:.5f} J{j:.5f} P{p:.5f} Q{q:.5f} X{self.at[0]:.5f} Y{self.at[1]:.5f}")

    def rapid(self) -> None:
        self.to("G0", self.at + np.array([0.0, 0.0, 5.0]))

    def feed(self) -> None:
        self.lines.append(f"F{10 ** self.rng.uniform(1.5, 4.3):.1f}")

    def dwell(self) -> None:
        self.lines.append("G4 P0.01")


def _rotation(angle: float) -> NDArray[np.float64]:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])
