"""Programs have the same moves as in LinuxCNC's interpreter, if that accepts them."""

from __future__ import annotations

import os
import random
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from feedplan.errors import ProgramError
from feedplan.program.gcode import read_gcode
from feedplan.program.tools import read_tools
from tests.program.linuxcnc import FOLDERS, difference, moves_of, needs_linuxcnc, reference
from tests.program.readings import Verdict, programs_in, readings

pytestmark = needs_linuxcnc

TOOLS = """T1 P1 Z50.25 D6 ;end mill
T2 P2 X1 Z30 D3
T3 P3 Z20 D-0.5 ;smaller than the path was made for
T4 P4 Z10 D1 Q2 ;lathe
T5 P5 D1.6 Q3
T6 P6 D1.6 Q6
T7 P7 D2
"""


@pytest.fixture(scope="module")
def tools(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("linuxcnc") / "tools.tbl"
    file.write_text(TOOLS)
    return file


def written(folder: Path, texts: dict[str, str]) -> list[Path]:
    files = []
    for i, (name, text) in enumerate(texts.items()):
        files.append(folder / f"{i}.ngc")
        files[-1].write_text(f"({name})\nG21 F100\n{text}\nM2\n")
    return files


def check(files: list[Path], tools: Path, names: list[str]) -> None:
    """Asserts that each program has the moves that LinuxCNC makes of it."""
    table = read_tools(tools)
    wrong = []
    for file, name, (moves, error) in zip(files, names, reference(files, tools), strict=True):
        if error is not None:
            wrong.append(f"{name}: LinuxCNC says {error}")
            continue
        try:
            found = difference(moves_of(read_gcode(file, tools=table)), moves)
        except ProgramError as refused:
            found = str(refused)
        if found is not None:
            wrong.append(f"{name}: {found}")
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("collection", ["codes", "compensation"])
def test_each_code_makes_linuxcncs_moves(collection: str, tmp_path: Path, tools: Path) -> None:
    """The programs of a collection, each after `=== name`: every code and every kind of corner."""
    text = Path(__file__).with_name(f"linuxcnc_{collection}.txt").read_text()
    texts = dict(part.split("\n", 1) for part in text.split("=== ")[1:])
    assert len(texts) > 19
    check(written(tmp_path, texts), tools, list(texts))


def random_path(seed: int) -> str:
    """Lines and arcs with radius compensation that meet at all angles; some are too small for the tool."""
    rng = random.Random(seed)
    code = rng.choice(("G41.1", "G42.1"))
    blocks = [f"{code} D{rng.uniform(0.2, 2):.3f}", f"G1 X{rng.uniform(4, 9):.3f} Y{rng.uniform(-9, 9):.3f}"]
    for _ in range(rng.randrange(2, 9)):
        x, y = rng.uniform(-30, 30), rng.uniform(-30, 30)
        match rng.randrange(6):
            case 0 | 1 | 2:
                blocks.append(f"G1 X{x:.3f} Y{y:.3f}")
            case 3:
                radius = rng.choice((-1, 1)) * rng.uniform(45, 90)
                blocks.append(f"G{rng.choice((2, 3))} X{x:.3f} Y{y:.3f} R{radius:.3f}")
            case 4:
                blocks.append(f"G{rng.choice((2, 3))} I{rng.uniform(1, 9):.3f} J{rng.uniform(1, 9):.3f}")
            case 5:
                blocks.append(f"G{rng.choice((0, 1))} Z{rng.uniform(-3, 3):.3f}")
    return "\n".join([*blocks, "G40 G0 X0 Y0"])


def random_block(rng: random.Random) -> str:
    number = lambda: f"{rng.uniform(-20, 20):.3f}"  # noqa: E731
    low = f"R{rng.uniform(1, 3):.2f} Z{rng.uniform(-5, 0):.2f} F90"
    return rng.choice(
        (
            f"G0 X{number()} Y{number()}",
            f"G1 X{number()} Z{number()} F{rng.randrange(10, 900)}",
            f"G1 A{number()} Y{number()}",
            f"G2 X{number()} Y{number()} R{rng.uniform(60, 90):.3f}",
            f"G3 I{number()} J{number()}",
            f"G0 @{rng.uniform(1, 20):.3f} ^{number()}",
            rng.choice(("G90", "G91", "G98", "G99", "G61", "G64", "G90.1")),
            f"G92 X{number()} Z{number()}",
            "G92.1",
            f"G10 L2 P{rng.randrange(1, 4)} X{number()} Y{number()}",
            f"G10 L20 P{rng.randrange(0, 4)} X{number()} Z{number()}",
            rng.choice(("G54", "G55", "G56")),
            f"G52 Y{number()}",
            f"T{rng.choice((1, 3))} M6\nG90 G43 G0 X{number()} Y{number()} Z{number()} A0",
            "G49 G0 X0 Y0 Z0",
            f"G81 X{number()} Y{number()} {low}\nX{number()}\nG80",
            f"G83 X{number()} Y{number()} {low} Q{rng.uniform(0.4, 2):.2f} L{rng.randrange(1, 4)}\nG80",
            f"#{rng.randrange(1, 9)}=[{number()}*{number()}-#{rng.randrange(1, 9)}/2]",
            f"G0 X#{rng.randrange(1, 9)} Y[#5420/2+#5421]",
            f"#<n>=3\no1 while [#<n> GT 0]\n#<n>=[#<n>-1]\nG0 X[#<n>*{number()}]\no1 endwhile",
            f"o2 if [#1 GT {number()}]\nG0 Z{number()}\no2 else\nG0 Y{number()}\no2 endif",
            f"G4 P{rng.uniform(0, 2):.2f}",
            f"G28.1\nG28 X{number()}",
            f"G53 G0 X{number()}",
        )
    )


def random_program(seed: int) -> str:
    """Modes, offsets, tools, cycles and flow in any order."""
    rng = random.Random(seed)
    labels = iter(range(10, 1000))
    blocks = [random_block(rng) for _ in range(rng.randrange(3, 25))]
    renamed = []
    for block in blocks:
        first, second = next(labels), next(labels)
        renamed.append(block.replace("o1 ", f"o{first} ").replace("o2 ", f"o{second} "))
    # LinuxCNC does not convert the tool length when the units change later.
    units = rng.choice(("G20", "G21"))
    return "\n".join([f"{units} #1=1 #2=2 #3=3 #4=4 #5=5 #6=6 #7=7 #8=8 G0 X1 Y1", *renamed])


@pytest.mark.parametrize("make", [random_path, random_program])
def test_random_programs_make_linuxcncs_moves(
    make: Callable[[int], str], tmp_path: Path, tools: Path
) -> None:
    """Skips what LinuxCNC refuses; feedplan alone may refuse corners without room for the tool.

    LinuxCNC checks the length that a corner leaves of a move only if the next corner has an offset of its
    own; feedplan checks it always.
    """
    seeds = range(int(os.environ.get("FEEDPLAN_SEEDS", "100")))
    files = written(tmp_path, {str(seed): make(seed) for seed in seeds})
    table = read_tools(tools)
    wrong, compared, narrow = [], 0, 0
    for file, (moves, error) in zip(files, reference(files, tools), strict=True):
        if error is not None:
            continue
        compared += 1
        try:
            found = difference(moves_of(read_gcode(file, tools=table)), moves)
        except ProgramError as refused:
            found = str(refused)
            if "does not fit into the corner" in found:
                narrow += 1
                continue
        if found is not None:
            wrong.append(f"{file.read_text()}{found}")
    assert not wrong, f"{len(wrong)} of {compared}:\n{min(wrong, key=len)}"
    assert compared > len(seeds) // 2
    assert narrow <= compared // 50


# Samples that LinuxCNC reads and feedplan refuses, with the reason.
REFUSED = {
    "gridprobe.ngc": "probing depends on the part",
    "smartprobe.ngc": "probing depends on the part",
    "lathe_g70_71_demo.ngc": "each control cuts this cycle in passes of its own",
    "lathe_g7x_face_boring.ngc": "each control cuts this cycle in passes of its own",
    "lathe_g7x_quadrants.ngc": "each control cuts this cycle in passes of its own",
}
# Its loop ends by LE between equal sums, which the interpreter treats as equal from version 2.9 on.
ROUNDED = "threading.ngc"


def test_the_samples_of_linuxcnc_make_its_moves(tmp_path: Path) -> None:
    """Each sample is read the same or is refused by name; `python -m tests.program.readings` lists them."""
    files = programs_in(FOLDERS)
    library = [file for file in files if "ngcgui_lib" in file.parts]
    files += [call for file in library if (call := call_of(file, tmp_path))]
    found = readings(files, sorted({file.parent for file in files}), tmp_path)
    wrong = [
        f"{reading.file}: {reading.reason}"
        for reading in found
        if (reading.verdict is Verdict.REFUSED and REFUSED.get(reading.file.name, "\n") not in reading.reason)
        or (reading.verdict is Verdict.DIFFERENT and reading.file.name != ROUNDED)
    ]
    assert not wrong, "\n".join(wrong)
    same = (Verdict.SAME, Verdict.SAME_AS_PRINTED, Verdict.SAME_SO_FAR)
    assert sum(reading.verdict in same for reading in found) > 60


def call_of(subroutine: Path, folder: Path) -> Path | None:
    """A program that calls a subroutine of the library with its default arguments."""
    text = subroutine.read_text(errors="replace")
    arguments = re.findall(r"^\s*#<[^>]+>\s*=\s*#(\d+)\s*(?:\(\s*=\s*([-+.\d]+))?", text, re.MULTILINE)
    values = {int(number): value or "1" for number, value in arguments}
    if not values or max(values) > 30:
        return None
    given = " ".join(f"[{values.get(number, '1')}]" for number in range(1, max(values) + 1))
    file = folder / f"call-of-{subroutine.name}"
    modes = "G20 G90 G17 G64 P.001 F100 S1000 M3"
    file.write_text(f"{modes}\nT1 M6\no<{subroutine.stem}> call {given}\nM2\n")
    return file
