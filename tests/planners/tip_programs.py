"""Random five-axis programs: G43.4, G43.5 and G49 in any order, turns, retracts, and the way home."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from feedplan.machine.machine import Machine

TIP, VECTOR, JOINTS = "G43.4", "G43.5", "G49"


def random_tip_program(seed: int, machine: Machine) -> str:
    """Five to twelve random blocks, some of them unusual for a machinist."""
    rng = np.random.default_rng([seed, *machine.name.encode()])
    return _Program(rng, machine).text()


class _Program:
    """Writes blocks and keeps the coordinate mode in which words are read."""

    def __init__(self, rng: np.random.Generator, machine: Machine) -> None:
        self.rng, self.machine = rng, machine
        self.rotary = [axis for axis in machine.axes if axis.kind == "rotary"]
        self.coordinate_mode = JOINTS
        self.lines: list[str] = []

    def text(self) -> str:
        rng = self.rng
        control = rng.choice(["", "", "G64 P0.05", "G64 P0.5", "G61", "G61.1"])
        self.lines.append(f"G21 G90 G94 {control} F{10 ** rng.uniform(2.7, 4.2):.0f}".strip())
        if rng.random() < 0.8:
            self.retract()
        if rng.random() < 0.5:
            self.turn()
        steps: list[tuple[Callable[[], None], float]] = [
            (self.change, 0.25),
            (self.move, 0.25),
            (self.turn, 0.2),
            (self.retract, 0.1),
            (self.both, 0.1),
            (self.away, 0.05),
            (self.small, 0.05),
        ]
        chances = np.array([chance for _, chance in steps])
        for step in rng.choice(len(steps), int(rng.integers(5, 11)), p=chances / chances.sum()):
            steps[step][0]()
        return "\n".join([*self.lines, "M30", ""])

    def number(self, low: float, high: float) -> str:
        """A random number, sometimes a round one."""
        value = self.rng.uniform(low, high)
        return f"{value:.0f}" if self.rng.random() < 0.3 else f"{value:.3f}"

    def code(self) -> str:
        return str(self.rng.choice(["G0", "G0", "G1"]))

    def place(self) -> str:
        """Words of X, Y and Z, some left out."""
        if self.coordinate_mode == JOINTS:
            low, high = self.machine.axis("Z").travel
            z = self.number(low + 0.6 * (high - low), low + 0.95 * (high - low))
        else:
            z = self.number(0, 80)
        words = [f"X{self.number(-60, 60)}", f"Y{self.number(-60, 60)}", f"Z{z}"]
        kept = self.rng.random(3) < 0.7
        return " ".join(word for word, keep in zip(words, kept, strict=True) if keep) or words[0]

    def angles(self) -> str:
        """Rotary words, of one axis or of all."""
        words = []
        for axis in self.rotary:
            tilts = len(self.rotary) > 1 and axis.name != "C"
            low, high = np.clip(axis.travel, *((-60, 60) if tilts else (-180, 180)))
            words.append(f"{axis.name}{self.number(low, high)}")
        kept = self.rng.random(len(words)) < 0.6
        return " ".join(word for word, keep in zip(words, kept, strict=True) if keep) or words[0]

    def direction(self) -> str:
        """I, J, K for a tool that is upright or tilted."""
        if self.rng.random() < 0.15:
            return "K1"
        lean = self.rng.uniform(0.05, 0.9)
        about = self.rng.uniform(0, 2 * np.pi)
        return f"I{np.sin(lean) * np.cos(about):.6f} J{np.sin(lean) * np.sin(about):.6f} K{np.cos(lean):.6f}"

    def turned(self) -> str:
        return self.direction() if self.coordinate_mode == VECTOR else self.angles()

    def change(self) -> None:
        codes = [TIP, TIP, TIP, JOINTS, JOINTS] + [VECTOR] * (len(self.rotary) > 1)
        code = str(self.rng.choice(codes))
        if code == JOINTS and self.rng.random() < 0.2:
            self.lines.append(str(self.rng.choice(["G43 H1", f"G43.1 Z{self.number(20, 150)}"])))
        elif code != JOINTS and self.rng.random() < 0.3:
            # A tool of another length.
            self.lines += [f"G43.1 Z{self.number(20, 150)}", code]
        else:
            self.lines.append(code if code == JOINTS else f"{code} H1")
        self.coordinate_mode = code

    def move(self) -> None:
        self.lines.append(f"{self.code()} {self.place()}")

    def turn(self) -> None:
        self.lines.append(f"{self.code()} {self.turned()}")

    def both(self) -> None:
        self.lines.append(f"{self.code()} {self.place()} {self.turned()}")

    def retract(self) -> None:
        low, high = self.machine.axis("Z").travel
        top = f"Z{self.number(low + 0.7 * (high - low), low + 0.95 * (high - low))}"
        if self.coordinate_mode == JOINTS:
            self.lines.append(f"{self.rng.choice(['G0', 'G53 G0'])} {top}")
        else:
            self.lines.append(f"G91 G0 Z{self.number(5, 60)}\nG90")

    def small(self) -> None:
        """A step so short that the tool only starts and stops."""
        letters = ["X", "Y", "Z", *(axis.name for axis in self.rotary if self.coordinate_mode != VECTOR)]
        step = self.rng.choice([-1, 1]) * 10 ** self.rng.uniform(-3, 0)
        self.lines.append(f"G91 {self.code()} {self.rng.choice(letters)}{step:.4f}\nG90")

    def away(self) -> None:
        """The way home, mostly after G49."""
        if self.coordinate_mode != JOINTS and self.rng.random() < 0.9:
            self.lines.append("G49")
            self.coordinate_mode = JOINTS
        letters = "".join(axis.name for axis in self.rotary)
        words = [f"{letter}0" for letter in f"Z{letters}" if letter == "Z" or self.rng.random() < 0.5]
        self.lines.append(f"G91 {self.rng.choice(['G28', 'G30'])} {' '.join(words)}\nG90")
