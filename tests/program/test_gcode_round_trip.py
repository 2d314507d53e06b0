"""Known moves that are written as G-code in random ways are read back unchanged."""

import math
import random
from dataclasses import dataclass, field

import numpy as np
import pytest

from feedplan.program.gcode import read_gcode
from feedplan.program.program import MoveKind, PathControl

MM_PER_INCH = 25.4
CENTRE = "IJK"


def number(value: float) -> str:
    """A decimal within 1e-13 of the value, with the variations of posts."""
    text = f"{value:.13f}".rstrip("0")
    return text if random.random() < 0.5 else text.rstrip(".")


@dataclass
class Writer:
    """Writes moves as blocks and records the expected result; positions are machine coordinates in mm."""

    rng: random.Random
    lines: list[str] = field(default_factory=lambda: ["G21"])
    position: np.ndarray = field(default_factory=lambda: np.zeros(3))
    work: dict[str, np.ndarray] = field(default_factory=lambda: {f"G{n}": np.zeros(3) for n in range(54, 60)})
    system: str = "G54"
    shift: np.ndarray = field(default_factory=lambda: np.zeros(3))
    unit: float = 1.0
    absolute: bool = True
    absolute_centres: bool = False
    normal: int = 2
    motion: str = "G80"
    feed: float = 0.0
    control: int = PathControl.TOLERANCE
    moves: list[tuple[int, list[float], float, int, int]] = field(default_factory=list)
    arcs: list[tuple[int, list[float], int, float]] = field(default_factory=list)
    stops: dict[int, float] = field(default_factory=dict)

    @property
    def zero(self) -> np.ndarray:
        return self.work[self.system] + self.shift

    def block(self, *words: str) -> None:
        """The words as one block, in random order, case and spacing."""
        mixed = [word if self.rng.random() < 0.7 else word.lower() for word in words if word]
        self.rng.shuffle(mixed)
        gap = self.rng.choice(["", " ", "\t", "  "])
        start = f"N{len(self.lines)} " if self.rng.random() < 0.2 else ""
        end = self.rng.choice(["", "", "(note)", " ; note"])
        self.lines.append(start + gap.join(mixed) + end)

    def change_modes(self) -> None:
        rng = self.rng
        kind = rng.randrange(10)
        if kind == 0:
            self.unit = rng.choice([1.0, MM_PER_INCH])
            self.block("G21" if self.unit == 1.0 else "G20")
        elif kind == 1:
            self.absolute = rng.random() < 0.5
            self.block("G90" if self.absolute else "G91")
        elif kind == 2:
            self.absolute_centres = rng.random() < 0.5
            self.block("G90.1" if self.absolute_centres else "G91.1")
        elif kind == 3:
            self.system = rng.choice(sorted(self.work))
            self.block(self.system)
        elif kind == 4:
            place = rng.choice(sorted(self.work))
            self.work[place] = np.array([rng.uniform(-50, 50) for _ in range(3)])
            words = [
                f"{axis}{number(v / self.unit)}" for axis, v in zip("XYZ", self.work[place], strict=True)
            ]
            self.block("G10", "L2", f"P{int(place[1:]) - 53}", *words)
        elif kind == 5:
            place = np.array([rng.uniform(-50, 50) for _ in range(3)])
            self.shift = self.position - self.work[self.system] - place
            words = [f"{axis}{number(v / self.unit)}" for axis, v in zip("XYZ", place, strict=True)]
            self.block("G92", *words)
        elif kind == 6:
            self.shift = np.zeros(3)
            self.block("G92.1")
        elif kind == 7:
            code, self.control = rng.choice([("G61", 1), ("G61.1", 0), ("G64", 2)])
            self.block(code)
        elif kind == 8 and self.moves:
            seconds = rng.choice([0.0, 0.5, 2.0])
            last = len(self.moves) - 1
            self.stops[last] = self.stops.get(last, 0.0) + seconds
            self.block("G4", f"P{seconds}")
        elif kind == 9 and self.moves:
            self.stops.setdefault(len(self.moves) - 1, 0.0)
            self.block(rng.choice(["M3", "M5", "M8", "M0"]))

    def axis_words(self, target: np.ndarray, needed: str = "") -> list[str]:
        """Words of the axes that move, and sometimes of axes that do not."""
        words = []
        for k, axis in enumerate("XYZ"):
            if target[k] == self.position[k] and axis not in needed and self.rng.random() < 0.5:
                continue
            value = target[k] - self.zero[k] if self.absolute else target[k] - self.position[k]
            words.append(axis + number(value / self.unit))
        return words

    def motion_word(self, code: str) -> str:
        word = "" if self.motion == code and self.rng.random() < 0.7 else code
        self.motion = code
        return word

    def feed_word(self) -> str:
        if self.feed and self.rng.random() < 0.7:
            return ""
        written = round(self.rng.uniform(100, 5000), 3)
        self.feed = written * self.unit / 60
        return f"F{written}"

    def add(self, kind: int, target: np.ndarray, feed: float) -> None:
        self.moves.append((kind, target.tolist(), feed, len(self.lines) + 1, self.control))
        self.position = target

    def straight(self) -> None:
        rng = self.rng
        target = self.position.copy()
        for k in rng.sample(range(3), rng.randint(1, 3)):
            target[k] = round(rng.uniform(-100, 100), 3)
        rapid = rng.random() < 0.3
        words = [self.motion_word("G0" if rapid else "G1"), *self.axis_words(target)]
        feed = math.inf
        if not rapid:
            words.append(self.feed_word())
            feed = self.feed
        self.add(MoveKind.RAPID if rapid else MoveKind.LINE, target, feed)
        self.block(*words)

    def arc(self) -> None:
        rng = self.rng
        plane = ""
        if rng.random() < 0.3:
            self.normal = rng.randrange(3)
            plane = f"G{19 - self.normal}"
        u, v = (self.normal + 1) % 3, (self.normal + 2) % 3
        radius, start = rng.uniform(0.5, 60), rng.uniform(-math.pi, math.pi)
        form = rng.choice(["centre", "radius", "circle"])
        sweep = 2 * math.pi if form == "circle" else rng.uniform(0.05, 6.2)
        if form == "radius" and abs(sweep - math.pi) < 0.05:
            sweep = 1.0
        clockwise = rng.random() < 0.5
        turns = rng.choice([1, 1, 1, 2, 5])
        sign = -1 if clockwise else 1
        centre = self.position.copy()
        centre[u] -= radius * math.cos(start)
        centre[v] -= radius * math.sin(start)
        target = self.position.copy()
        if form != "circle":
            target[u] = centre[u] + radius * math.cos(start + sign * sweep)
            target[v] = centre[v] + radius * math.sin(start + sign * sweep)
        if rng.random() < 0.4:
            target[self.normal] += round(rng.uniform(-20, 20), 3)
        words = [plane, self.motion_word("G2" if clockwise else "G3")]
        if form == "radius":
            words += self.axis_words(target, needed="XYZ"[u])
            words.append("R" + number((radius if sweep < math.pi else -radius) / self.unit))
        else:
            words += self.axis_words(target)
            for k in (u, v):
                value = centre[k] - (self.zero[k] if self.absolute_centres else self.position[k])
                words.append(CENTRE[k] + number(value / self.unit))
        if turns > 1:
            words.append(f"P{turns}")
        words.append(self.feed_word())
        angle = sign * (sweep + 2 * math.pi * (turns - 1))
        self.arcs.append((len(self.moves), centre.tolist(), self.normal, angle))
        self.add(MoveKind.ARC, target, self.feed)
        self.block(*words)


@pytest.mark.parametrize("seed", range(150))
def test_random_programs_come_back_as_they_were(seed: int) -> None:
    random.seed(seed)
    writer = Writer(random.Random(seed))
    for _ in range(60):
        choice = writer.rng.random()
        if choice < 0.35:
            writer.change_modes()
        elif choice < 0.7:
            writer.straight()
        else:
            writer.arc()
    writer.block("M30")
    line_end = writer.rng.choice(["\n", "\r\n", "\r"])
    program = read_gcode((line_end.join(writer.lines) + line_end).encode())

    kind, target, feed, line, control = zip(*writer.moves, strict=True)
    assert program.kind.tolist() == list(kind)
    np.testing.assert_allclose(program.target, target, rtol=0, atol=1e-9)
    np.testing.assert_allclose(program.feed, feed, rtol=1e-13)
    assert program.line.tolist() == list(line)
    assert program.control.tolist() == [int(code) for code in control]
    stops = {**writer.stops, len(kind) - 1: writer.stops.get(len(kind) - 1, 0.0)}
    assert np.flatnonzero(program.stop).tolist() == sorted(stops)
    assert program.dwell.tolist() == [stops.get(i, 0.0) for i in range(len(kind))]
    move, centre, normal, angle = zip(*writer.arcs, strict=True)
    assert program.arc_move.tolist() == list(move)
    np.testing.assert_allclose(program.arc_centre, centre, rtol=0, atol=1e-7)
    assert program.arc_normal.tolist() == list(normal)
    np.testing.assert_allclose(program.arc_angle, angle, rtol=0, atol=1e-7)
    assert program.warnings == ()
