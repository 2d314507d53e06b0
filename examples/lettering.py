"""Write an engraved text as a part program: sharp corners, arcs, plunges, retracts and rapids.

In lettering a planner must often stop, or nearly stop: strokes have corners and short arcs between short
lines, and between strokes are a retract, a rapid and a plunge. The single-stroke font consists of lines and
arcs. The text is repeated, line by line in a square field, until there are enough blocks.

    python examples/lettering.py --text "FEEDPLAN" --blocks 1000 --output out/lettering.ngc
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

# Strokes of each glyph, separated by "|", as points on a grid 4 wide and 6 high. A third number is the bulge
# of the arc that leads to the point: the tangent of a quarter of the arc's angle, positive counter-clockwise
# (1 is a half circle, 0.4142 a quarter circle).
FONT = {
    "A": "0,0 2,6 4,0 | 0.6667,2 3.3333,2",
    "B": "0,3 2.5,3 2.5,6,1 0,6 0,0 2.5,0 2.5,3,1",
    "C": "4,1.5 2.5,0,-0.4142 1.5,0 0,1.5,-0.4142 0,4.5 1.5,6,-0.4142 2.5,6 4,4.5,-0.4142",
    "D": "0,0 0,6 2,6 4,4,-0.4142 4,2 2,0,-0.4142 0,0",
    "E": "4,0 0,0 0,6 4,6 | 0,3 3,3",
    "F": "0,0 0,6 4,6 | 0,3 3,3",
    "G": "4,4.5 2.5,6,0.4142 1.5,6 0,4.5,0.4142 0,1.5 1.5,0,0.4142 2.5,0 4,1.5,0.4142 4,3 2.5,3",
    "H": "0,0 0,6 | 4,0 4,6 | 0,3 4,3",
    "I": "1,0 3,0 | 2,0 2,6 | 1,6 3,6",
    "J": "1.5,6 4,6 4,2 0,2,-1",
    "K": "0,0 0,6 | 4,6 0,2.5 | 1.2,3.55 4,0",
    "L": "0,6 0,0 4,0",
    "M": "0,0 0,6 2,2.5 4,6 4,0",
    "N": "0,0 0,6 4,0 4,6",
    "O": "2,6 0,4,0.4142 0,2 4,2,1 4,4 2,6,0.4142",
    "P": "0,0 0,6 2.5,6 2.5,3,-1 0,3",
    "Q": "2,6 0,4,0.4142 0,2 4,2,1 4,4 2,6,0.4142 | 2.5,1.5 4,0",
    "R": "0,0 0,6 2.5,6 2.5,3,-1 0,3 | 2,3 4,0",
    "S": "4,4.5 2.5,6,0.4142 1.5,6 1.5,3,1 2.5,3 2.5,0,-1 1.5,0 0,1.5,-0.4142",
    "T": "0,6 4,6 | 2,6 2,0",
    "U": "0,6 0,2 4,2,1 4,6",
    "V": "0,6 2,0 4,6",
    "W": "0,6 1,0 2,3.5 3,0 4,6",
    "X": "0,0 4,6 | 0,6 4,0",
    "Y": "0,6 2,3 4,6 | 2,3 2,0",
    "Z": "0,6 4,6 0,0 4,0",
    "0": "0,4 4,4,-1 4,2 0,2,-1 0,4 | 0.6,0.6 3.4,5.4",
    "1": "0.5,4.5 2,6 2,0 | 0.5,0 3.5,0",
    "2": "0,4.5 1.5,6,-0.4142 2.5,6 3.5607,3.4393,-0.6682 0,0 4,0",
    "3": "0,6 4,6 1.75,3.5 2.25,3.5 2.25,0,-1 1.75,0 0,1.75,-0.4142",
    "4": "3,0 3,6 0,2 4,2",
    "5": "4,6 0,6 0,3.5 2.25,3.5 2.25,0,-1 1.5,0 0,1.5,-0.4142",
    "6": "3.5,6 2,6 0,4,0.4142 0,2 4,2,1 0,2,1",
    "7": "0,6 4,6 1.5,0",
    "8": "2,3 2,6,1 2,3,1 2,0,-1 2,3,-1",
    "9": "0.5,0 2,0 4,2,0.4142 4,4 0,4,1 4,4,1",
    "-": "0.5,3 3.5,3",
    ".": "1.8,0 2.2,0 2.2,0.4 1.8,0.4 1.8,0",
    "/": "0,0 4,6",
    " ": "",
}
ADVANCE = 5.6  # distance from one letter to the next, on the grid
LINE_ADVANCE = 9.5  # distance from one line of text to the next, on the grid
SAFE_HEIGHT = 2.0  # height of the rapids over the plate [mm]

Point = tuple[float, float]
Segment = tuple[float, float, float]  # end point and bulge


def strokes(glyph: str) -> list[tuple[Point, list[Segment]]]:
    """The strokes of a glyph on the grid: start, then segments (x, y, bulge)."""
    found = []
    for stroke in glyph.split("|"):
        numbers = [[float(number) for number in point.split(",")] for point in stroke.split()]
        if numbers:
            segments = [(p[0], p[1], p[2] if len(p) == 3 else 0.0) for p in numbers[1:]]
            found.append(((numbers[0][0], numbers[0][1]), segments))
    return found


def centre(start: Point, end: Point, bulge: float) -> Point:
    """Centre of the arc between two points."""
    chord_x, chord_y = end[0] - start[0], end[1] - start[1]
    offset = 0.5 * (1.0 / bulge - bulge) / 2.0
    return 0.5 * (start[0] + end[0]) - offset * chord_y, 0.5 * (start[1] + end[1]) + offset * chord_x


def letter(character: str, x: float, y: float, scale: float, depth: float, feed: float) -> Iterator[str]:
    """The blocks that engrave one letter with its lower left corner at (x, y) [mm]."""
    for start, segments in strokes(FONT[character]):
        yield f"G0 X{x + scale * start[0]:.4f} Y{y + scale * start[1]:.4f}"
        yield f"G1 Z{-depth:.4f} F{0.3 * feed:g}"
        points = [start, *((s[0], s[1]) for s in segments)]
        speed = f" F{feed:g}"
        for (before, after), (_, _, bulge) in zip(pairwise(points), segments, strict=True):
            target = f"X{x + scale * after[0]:.4f} Y{y + scale * after[1]:.4f}"
            if bulge == 0.0:
                yield f"G1 {target}{speed}"
            else:
                middle = centre(before, after, bulge)
                i, j = scale * (middle[0] - before[0]), scale * (middle[1] - before[1])
                yield f"G{3 if bulge > 0.0 else 2} {target} I{i:.4f} J{j:.4f}{speed}"
            speed = ""
        yield f"G0 Z{SAFE_HEIGHT:.4f}"


def program(
    blocks: int = 1000,
    *,
    text: str = "FEEDPLAN 0123456789",
    height: float = 8.0,
    depth: float = 0.4,
    feed: float = 2400.0,
    tolerance: float = 0.05,
) -> str:
    """The part program with about `blocks` blocks: the text, repeated.

    `height` of the letters and `depth` of the grooves [mm]; `feed` [mm/min], of which plunges have a third;
    `tolerance` at the corners (G64 P) [mm].
    """
    text = text.upper()
    unknown = sorted(set(text) - set(FONT))
    if unknown or not text.strip():
        raise ValueError(
            f"the font has {''.join(sorted(FONT))!r}: the text {text!r} has other letters or none"
        )
    scale = height / 6.0
    lines = [
        "%",
        f"(Engraving of {text})",
        "(V bit; zero: lower left corner, on the plate)",
        "G21 G90 G17 G40 G49 G80 G94",
        f"G64 P{tolerance:g}",
        "T1 M6",
        "S24000 M3",
        f"G0 Z{SAFE_HEIGHT:.4f}",
    ]
    per_letter = sum(len(list(letter(c, 0.0, 0.0, 1.0, 1.0, 1.0))) for c in text) / len(text)
    # The number of letters in a line is chosen so that the field is about square.
    columns = math.ceil(math.sqrt(blocks / per_letter * LINE_ADVANCE / ADVANCE))
    count = 0
    while len(lines) < blocks or count < len(text):
        row, column = divmod(count, columns)
        x, y = scale * ADVANCE * column, -scale * LINE_ADVANCE * row
        lines.extend(letter(text[count % len(text)], x, y, scale, depth, feed))
        count += 1
    lines += ["G0 Z30.", "M5", "M30", "%"]
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--blocks", type=int, default=1000, help="about how many blocks (default 1000)")
    parser.add_argument("--text", default="FEEDPLAN 0123456789", help="letters, digits, space and -./")
    parser.add_argument("--height", type=float, default=8.0, help="of the letters [mm] (default 8)")
    parser.add_argument("--depth", type=float, default=0.4, help="of the grooves [mm] (default 0.4)")
    parser.add_argument("--feed", type=float, default=2400.0, help="[mm/min] (default 2400)")
    parser.add_argument("--tolerance", type=float, default=0.05, help="G64 P [mm] (default 0.05)")
    parser.add_argument("--output", type=Path, default=Path("out/lettering.ngc"))
    options = vars(parser.parse_args())
    output: Path = options.pop("output")

    try:
        text = program(**options)
    except ValueError as error:
        parser.error(str(error))
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_text(text, encoding="ascii")
    print(f"{output}: {text.count(chr(10))} lines")


if __name__ == "__main__":
    main()
