"""Programs for the tests of planned feeds: some written by hand, and random ones of all kinds of blocks."""

from __future__ import annotations

import random

import numpy as np

import feedplan
from feedplan.curves.length import CurveLength
from feedplan.machine.axis import DIRECTION

# A square whose sides are too short for its feed, between rapids.
SQUARE = """%
(a square)
G21 G90 G17
G0 X0 Y0 Z5
N10 G1 Z0 F600 ; down
N20 X30 F60000  (along)
N30 Y30

N40 X0
N50 Y0
G0 Z5
M2
"""


def planned(text: str | bytes, machine: str = "mill", **options: object) -> feedplan.Plan:
    """The plan of a program that is given as its text."""
    content = text.encode() if isinstance(text, str) else text
    return feedplan.plan(content, machine, **options)  # type: ignore[arg-type]


def again(result: feedplan.PlannedProgram, machine: str = "mill") -> feedplan.Program:
    """The program with planned feeds, read again."""
    return feedplan.read_program(result.content, machine)


def greatest_around(plan: feedplan.Plan) -> np.ndarray:
    """The greatest planned speed on all pieces that follow each move (m,) [mm/s], from many samples.

    It shares no code with the writer of planned feeds: it samples `plan.trajectory` by length. For programs
    of X, Y and Z only.
    """
    path, profile = plan.path, plan.profile
    length = CurveLength(plan.problem.path.curve)
    count = len(path)
    piece = np.concatenate([np.repeat(np.arange(count), 41), np.repeat(profile.piece.astype(np.int64), 2)])
    u = np.concatenate(
        [
            np.outer(path.width, np.linspace(0.0, 1.0, 41)).ravel(),
            np.stack([profile.u0, profile.u1], axis=1).ravel(),
        ]
    )
    speed = plan.trajectory.speed(np.minimum(length.length(piece, u), plan.trajectory.length))
    top = np.zeros(count)
    np.maximum.at(top, piece, speed)
    assert plan.program is not None
    greatest = np.full(len(plan.program), np.nan)
    for row, (first, last) in enumerate(path.move.tolist()):
        greatest[first : last + 1] = np.fmax(greatest[first : last + 1], top[row])
    assert not set(DIRECTION) & set(path.axes)
    return greatest


class Writer:
    """Writes random blocks; the reader accepts every program of them."""

    def __init__(self, rng: random.Random) -> None:
        self.rng = rng
        self.end = rng.choice(["\n", "\r\n"])
        self.lower = rng.random() < 0.2
        self.blank = rng.choice(["", " "])
        self.lines: list[str] = []
        self.inverse = False
        self.absolute = True
        self.place = [0.0, 0.0, 0.0]
        self.unit = rng.choice([1.0, 1.0, 25.4])

    def text(self) -> str:
        rng = self.rng
        self.block("G20" if self.unit == 25.4 else "G21", "G90", "G17", "G94")
        self.block(rng.choice(["G61", "G64", f"G64 P{self.number(0.02)}", "G61.1"]))
        self.block("G0", *self.to([0.0, 0.0, 0.0]))
        self.block("G1", *self.to([1.0, 0.0, 0.0]), self.feed(force=True))
        kinds = (
            [self.line] * 8
            + [self.arc] * 3
            + [
                self.rapid,
                self.points,
                self.spline,
                self.helix,
                self.nothing,
                self.cycle,
                self.loop,
                self.call,
                self.computed,
                self.modes,
                self.inverse_time,
                self.dwell,
                self.deleted,
            ]
        )
        for _ in range(rng.randint(1, 25)):
            rng.choice(kinds)()
        self.block("M2")
        return self.end.join(self.lines) + rng.choice(["", self.end])

    def number(self, value: float) -> str:
        """A length in mm as a word's number in the unit of the program."""
        return (
            f"{value / self.unit:.4f}".rstrip("0") if self.rng.random() < 0.8 else f"{value / self.unit:+.5f}"
        )

    def block(self, *words: str) -> None:
        rng = self.rng
        text = self.blank.join(word for word in words if word)
        text = text.lower() if self.lower else text
        number = f"N{len(self.lines)}{self.blank}" if rng.random() < 0.1 else ""
        note = rng.choice(["", "", "", "", " (F1 is no feed)", " ; F2 neither", "  "])
        self.lines.append(number + text + note)

    def feed(self, force: bool = False) -> str:
        rng = self.rng
        if not force and not self.inverse and rng.random() < 0.6:
            return ""
        if self.inverse:
            return f"F{rng.choice([20, 300, 4000])}"
        value = rng.choice([400, 3000, 12000, 60000]) / self.unit
        return f"F{value:.3f}" if rng.random() < 0.5 else f"F{value:.0f}"

    def somewhere(self) -> list[float]:
        scale = self.rng.choice([0.5, 5.0, 60.0])
        return [round(value + self.rng.uniform(-scale, scale), 3) for value in self.place]

    def to(self, place: list[float], axes: str = "XYZ") -> list[str]:
        words = []
        for k, axis in enumerate("XYZ"):
            if axis in axes:
                goal = place[k] if self.absolute else place[k] - self.place[k]
                words.append(axis + self.number(goal))
        self.place = [place[k] if axis in axes else self.place[k] for k, axis in enumerate("XYZ")]
        return words

    def line(self) -> None:
        axes = self.rng.choice(["XYZ", "XY", "X", "YZ", "Z"])
        self.block("G1", *self.to(self.somewhere(), axes), self.feed())

    def points(self) -> None:
        x, y, z = self.place
        for k in range(1, self.rng.randint(3, 30)):
            self.block("G1", *self.to([x + 0.4 * k, y + 0.03 * k * k, z], "XY"), self.feed())

    def rapid(self) -> None:
        self.block("G0", *self.to(self.somewhere()))

    def arc(self, rise: float = 0.0) -> None:
        rng = self.rng
        code, plane, (first, second, along) = rng.choice(
            [("G17", "XY", (0, 1, 2)), ("G18", "XZ", (0, 2, 1)), ("G19", "YZ", (1, 2, 0))]
        )
        radius = rng.choice([0.5, 4.0, 25.0])
        goal = list(self.place)
        # A quarter, a half or nearly a whole turn, to the point opposite or beside.
        across = rng.choice([(radius, radius), (2.0 * radius, 0.0), (radius, -radius)])
        goal[first] += across[0]
        goal[second] += across[1]
        goal[along] += rise
        turns = f"P{rng.randint(2, 3)}" if rng.random() < 0.2 else ""
        motion = rng.choice(["G2", "G3"])
        if not turns and across[1] != 0.0 and rng.random() < 0.3:
            centre = ["R" + f"{1.01 * radius * 2**0.5 / self.unit:.5f}"]
        else:
            offsets = [radius, 0.0]
            centre = [
                "IJK"[axis] + f"{value / self.unit:.6f}"
                for axis, value in zip((first, second), offsets, strict=True)
            ]
        axes = plane + ("XYZ"[along] if rise else "")
        self.block(code, motion, *self.exact(goal, axes), *centre, turns, self.feed())

    def exact(self, place: list[float], axes: str) -> list[str]:
        """Words with enough digits for the ends of arcs."""
        words = []
        for k, axis in enumerate("XYZ"):
            if axis in axes:
                goal = place[k] if self.absolute else place[k] - self.place[k]
                words.append(f"{axis}{goal / self.unit:.6f}")
        self.place = [place[k] if axis in axes else self.place[k] for k, axis in enumerate("XYZ")]
        return words

    def helix(self) -> None:
        self.arc(rise=self.rng.choice([-3.0, 2.0]))

    def spline(self) -> None:
        if self.inverse:
            return
        self.block("G17")
        x, y, z = self.place
        bend = f"{4.0 / self.unit:.4f}"
        words = self.to([x + 12.0, y + 3.0, z], "XY")
        self.block("G5", *words, f"I{bend}", f"J{bend}", f"P-{bend}", f"Q-{bend}", self.feed())

    def nothing(self) -> None:
        self.lines.append(self.rng.choice(["", "   ", "(only a note F3)", "; F4", "G4 P0"]))

    def cycle(self) -> None:
        if self.inverse or not self.absolute:
            return
        x, y, z = self.place
        level, bottom = self.number(z), self.number(z - 6.0)
        self.block(
            "G17",
            "G99",
            "G81",
            f"X{self.number(x + 8.0)}",
            f"Y{self.number(y)}",
            f"Z{bottom}",
            f"R{level}",
            self.feed(),
        )
        self.block(f"X{self.number(x + 16.0)}")
        self.block("G80")
        self.block("G0", *self.to([x + 16.0, y, z]))

    def loop(self) -> None:
        if self.inverse:
            return
        name = 100 + len(self.lines)
        self.lines.append(f"o{name} repeat [{self.rng.randint(1, 3)}]")
        self.block("G91", "G1", f"X{self.number(3.0)}", self.feed())
        self.block(f"Y{self.number(2.0)}")
        self.lines.append(f"o{name} endrepeat")
        self.block("G90", "G1", *self.absolutely([1.0, 2.0, 3.0]), self.feed())
        self.absolute = True

    def absolutely(self, place: list[float]) -> list[str]:
        self.absolute = True
        return self.to(place)

    def call(self) -> None:
        if self.inverse:
            return
        name = 100 + len(self.lines)
        self.lines.append(f"o{name} sub")
        self.block("G1", *self.absolutely(self.somewhere()), self.feed())
        self.lines.append(f"o{name} endsub")
        self.block("G90")
        for _ in range(self.rng.randint(1, 2)):
            self.lines.append(f"o{name} call")

    def computed(self) -> None:
        if not self.inverse:
            self.block("G1", *self.to(self.somewhere()), f"F[{self.rng.choice([600, 9000])} / {self.unit:g}]")

    def modes(self) -> None:
        self.absolute = not self.absolute
        self.block("G90" if self.absolute else "G91")

    def inverse_time(self) -> None:
        self.inverse = not self.inverse
        self.block("G93" if self.inverse else "G94", "G1", *self.to(self.somewhere()), self.feed(force=True))

    def dwell(self) -> None:
        self.block(self.rng.choice(["G4 P0.1", "M3 S1000", "M8", "(MSG,go on)"]))

    def deleted(self) -> None:
        self.lines.append("/G1 X1 F1")
