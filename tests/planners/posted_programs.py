"""Random part programs as shops post them, with the greatest speed that each line allows.

Six kinds: zigzags of X with a rotary axis, X and Y alone on a machine without Z, inches, scan lines with the
noise of an STL mesh, inverse-time feed, and a new feed in every block. The generator computes the allowed
speeds from the numbers that it writes, without the reader and the planner.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine

INCH = 25.4
LINEAR = "XYZ"


@dataclass
class Posted:
    """A program's `text`, its `machine`, and for each source line the greatest speed of X, Y and Z together
    (`linear` [mm/s]) and, where the line moves no other axis, of the rotary axes together (`rotary` [deg/s]).

    `corners` (m, axes) are the ends of the lines if the program has lines only, else None; `tolerance` [mm]
    is how far the path may be from them.
    """

    machine: Machine
    text: str = ""
    linear: dict[int, float] = field(default_factory=dict)
    rotary: dict[int, float] = field(default_factory=dict)
    corners: NDArray[np.float64] | None = None
    tolerance: float = 0.01


def posted_program(seed: int) -> Posted:
    """The program of a seed; its kind is the seed modulo the number of kinds."""
    kinds = (_rotary_zigzag, _plotter, _inches, _mesh_noise, _inverse_time, _new_feeds)
    return kinds[seed % len(kinds)](np.random.default_rng([seed, 7]))


class _Post:
    """Writes blocks and records what they allow; positions are in the program's unit."""

    def __init__(self, rng: np.random.Generator, axes: str, unit: float = 1.0) -> None:
        self.rng, self.axes, self.unit = rng, axes, unit
        self.tolerance = float(np.round(10 ** rng.uniform(-3, -0.3), 4))
        # The word P is in the program's unit.
        written = self.tolerance / unit
        self.blocks = [f"{'G20' if unit != 1.0 else 'G21'} G90 G94 G64 P{written:.6f}"]
        self.tolerance = round(written, 6) * unit
        self.at = np.zeros(len(axes))
        self.corners = [self.at]
        self.linear: dict[int, float] = {}
        self.rotary: dict[int, float] = {}
        self.lines_alone = True

    def block(self, text: str) -> None:
        self.blocks.append(text)

    def rapid(self, **words: float) -> None:
        self._move("G0", words, np.inf)

    def line(self, words: dict[str, float], feed: float, more: str = "") -> None:
        """A line at `feed` [units/min], or [deg/min] if no linear axis moves."""
        self._move("G1", words, feed / 60.0, more)

    def timed(self, words: dict[str, float], minutes: float) -> None:
        """A line that takes at least `minutes`, in inverse time."""
        rate = float(f"{1.0 / minutes:.6g}")
        step = self._end(words) - self.at
        linear = np.linalg.norm([step[k] for k in range(len(step)) if self.axes[k] in LINEAR])
        way = linear if linear > 0 else np.linalg.norm(step)
        self._move("G1", words, float(way) * rate / 60.0, f"F{rate:.6g}")

    def arc(self, radius: float, start: float, angle: float, feed: float) -> None:
        offset = np.round(radius * np.array([np.cos(start), np.sin(start)]), 6)
        c, s = np.cos(angle), np.sin(angle)
        turned = offset @ np.array([[-c, -s], [s, -c]])
        end = np.round(self.at[:2] + offset + turned, 6)
        code = "G3" if angle > 0 else "G2"
        self.block(f"{code} X{end[0]:.6f} Y{end[1]:.6f} I{offset[0]:.6f} J{offset[1]:.6f}")
        self.at = np.concatenate([end, self.at[2:]])
        self.linear[len(self.blocks)] = feed / 60.0 * self.unit
        self.lines_alone = False

    def posted(self, machine: Machine) -> Posted:
        text = "\n".join([*self.blocks, "M2", ""])
        corners = np.array(self.corners) * self.scale() if self.lines_alone else None
        return Posted(machine, text, self.linear, self.rotary, corners, self.tolerance)

    def scale(self) -> NDArray[np.float64]:
        return np.array([self.unit if axis in LINEAR else 1.0 for axis in self.axes])

    def _end(self, words: dict[str, float]) -> NDArray[np.float64]:
        return np.array([round(words.get(axis, self.at[k]), 6) for k, axis in enumerate(self.axes)])

    def _move(self, code: str, words: dict[str, float], speed: float, more: str = "") -> None:
        end = self._end(words)
        step = end - self.at
        if not np.abs(step).max() > 0:
            return
        text = " ".join(f"{axis}{value:.6f}" for axis, value in words.items())
        self.block(f"{code} {text} {more}".rstrip())
        self.at = end
        self.corners.append(self.at)
        moves_linear = any(step[k] != 0 for k in range(len(step)) if self.axes[k] in LINEAR)
        if moves_linear:
            self.linear[len(self.blocks)] = speed * self.unit
        else:
            self.rotary[len(self.blocks)] = speed


def _machine(rng: np.random.Generator, axes: str) -> Machine:
    """Axes with different limits, rotary ones several times faster; with or without a chord tolerance."""
    velocity = 10 ** rng.uniform(1.5, 3)
    acceleration = velocity * 10 ** rng.uniform(0.5, 2)
    jerk = acceleration * 10 ** rng.uniform(0.7, 2.5)
    made = []
    for name in axes:
        own = np.array([velocity, acceleration, jerk]) * 10 ** rng.uniform(-0.4, 0.4, 3)
        own *= 1.0 if name in LINEAR else 3.0
        made.append(Axis(name, own[0], own[1], max_jerk=own[2]))

    period, chord = float(rng.choice([5e-4, 1e-3, 4e-3])), 0.01 if rng.random() < 0.3 else np.inf
    return Machine("posted", tuple(made), period=period, chord_tolerance=chord)


def _rotary_zigzag(rng: np.random.Generator) -> Posted:
    post = _Post(rng, "XYZA")
    feed = round(10 ** rng.uniform(1.5, 4), 1)
    post.rapid(X=0.0, Y=0.0, Z=2.0, A=float(np.round(rng.uniform(-90, 90), 3)))
    post.block(f"G1 F{feed:.1f}")
    step, turn = 10 ** rng.uniform(-1, 1.3), 10 ** rng.uniform(0, 2.3)
    x = 0.0
    for k in range(int(rng.integers(3, 25))):
        x += step * rng.uniform(0.3, 1.0)
        words = {"X": x, "A": turn * (k % 2) * rng.uniform(0.5, 1.0)}
        if rng.random() < 0.2:
            words["Z"] = 2.0 * rng.normal()
        if rng.random() < 0.15:
            words = {"A": turn * rng.normal()}
        post.line(words, feed)
    return post.posted(_machine(rng, "XYZA"))


def _plotter(rng: np.random.Generator) -> Posted:
    post = _Post(rng, "XY")
    feed = round(10 ** rng.uniform(2, 4.3), 1)
    post.block(f"F{feed:.1f}")
    size = 10 ** rng.uniform(-0.5, 2)
    for _ in range(int(rng.integers(3, 40))):
        kind = rng.random()
        if kind < 0.15:
            x, y = size * rng.normal(size=2)
            post.rapid(X=x, Y=y)
        elif kind < 0.3:
            radius = max(0.05, 0.3 * size * rng.random())
            post.arc(radius, rng.uniform(0, 2 * np.pi), rng.choice([-1, 1]) * rng.uniform(0.3, 6.0), feed)
        else:
            dx, dy = size * rng.normal(size=2)
            # An axis whose word is left out rests.
            words = {"X": post.at[0] + dx, "Y": post.at[1] + dy}
            if rng.random() < 0.3:
                words.pop(str(rng.choice(["X", "Y"])))
            post.line(words, feed)
    return post.posted(_machine(rng, "XY"))


def _inches(rng: np.random.Generator) -> Posted:
    post = _Post(rng, "XYZ", INCH)
    feed = round(10 ** rng.uniform(0.3, 2.7), 2)
    post.rapid(Z=0.25)
    post.block(f"G1 F{feed:.2f}")
    size = 10 ** rng.uniform(-1.5, 0.5)
    for _ in range(int(rng.integers(3, 30))):
        kind = rng.random()
        if kind < 0.3:
            radius = max(0.004, 0.3 * size * rng.random())
            post.arc(radius, rng.uniform(0, 2 * np.pi), rng.choice([-1, 1]) * rng.uniform(0.3, 6.0), feed)
        elif kind < 0.4:
            post.rapid(Z=0.1 + 0.2 * rng.random())
        else:
            place = post.at + size * rng.normal(size=3) * [1, 1, 0.1]
            post.line(dict(zip("XYZ", place.tolist(), strict=True)), feed)
    return post.posted(_machine(rng, "XYZ"))


def _mesh_noise(rng: np.random.Generator) -> Posted:
    post = _Post(rng, "XYZ")
    feed = round(10 ** rng.uniform(2.5, 4), 1)
    post.block(f"G1 F{feed:.1f}")
    noise, step = 10 ** rng.uniform(-4, -1.5), 10 ** rng.uniform(-2, -0.3)
    height, period = 10 ** rng.uniform(-1, 1), 10 ** rng.uniform(0, 1.5)
    x, y, way = 0.0, 0.0, 1.0
    for _ in range(int(rng.integers(1, 4))):
        for _ in range(int(rng.integers(20, 120))):
            x += way * step * 10 ** rng.uniform(-0.5, 0.5)
            z = height * np.sin(x / period) + noise * rng.normal()
            post.line({"X": x, "Y": y + noise * rng.normal(), "Z": z}, feed)
        y, way = y + 0.3, -way
    return post.posted(_machine(rng, "XYZ"))


def _inverse_time(rng: np.random.Generator) -> Posted:
    axes = str(rng.choice(["XYZ", "XYZA", "XYZBC"]))
    post = _Post(rng, axes)
    post.block("G93")
    size, turn = 10 ** rng.uniform(-1, 1.5), 10 ** rng.uniform(-0.5, 1.7)
    for _ in range(int(rng.integers(3, 30))):
        chosen = [name for name in axes if rng.random() < 0.7] or [axes[-1]]
        words = {
            name: float(post.at[axes.index(name)] + (size if name in LINEAR else turn) * rng.normal())
            for name in chosen
        }
        if rng.random() < 0.1:
            post.rapid(**words)
        else:
            post.timed(words, 10 ** rng.uniform(-4, -1))
    return post.posted(_machine(rng, axes))


def _new_feeds(rng: np.random.Generator) -> Posted:
    post = _Post(rng, "XYZ")
    dense = rng.random() < 0.5
    size = 10 ** (rng.uniform(-1.5, 0) if dense else rng.uniform(0, 1.5))
    turn = rng.uniform(0, 2 * np.pi)
    feed = 10 ** rng.uniform(1.5, 4)
    for _ in range(int(rng.integers(5, 80))):
        turn += rng.normal() * (0.15 if dense else 1.0)
        feed = float(np.clip(feed * 10 ** (rng.normal() * rng.choice([0.05, 1.0])), 1.0, 3e4))
        written = float(f"{feed:.2f}")
        place = post.at + size * rng.uniform(0.3, 1) * np.array(
            [np.cos(turn), np.sin(turn), 0.05 * rng.normal()]
        )
        post.line(dict(zip("XYZ", place.tolist(), strict=True)), written, f"F{written:.2f}")
    return post.posted(_machine(rng, "XYZ"))
