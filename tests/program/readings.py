"""Compares feedplan's reader with LinuxCNC's interpreter: `python -m tests.program.readings FOLDER...`.

Prints one line for each program in the folders (default: LinuxCNC's samples): read the same, refused with the
reason, or different.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from feedplan.errors import ProgramError
from feedplan.program.gcode import read_gcode
from feedplan.program.tools import read_tools
from tests.program.linuxcnc import ABSENT, FOLDERS, Move, difference, moves_of, printed, reference

ENDINGS = (".ngc", ".nc", ".gc", ".gcode", ".tap", ".h", ".mpf")

# Allowed difference of moves that `rs274` prints with four decimals of an inch [mm].
PRINTED = 0.004


class Verdict(StrEnum):
    SAME = "the same"
    SAME_AS_PRINTED = "the same as printed"  # and the Python module is wrong after a tool change
    SAME_SO_FAR = "the same so far"  # up to the place where LinuxCNC stops
    NO_MOVES = "no moves"  # refused by feedplan, and without moves in LinuxCNC
    REFUSED_BY_BOTH = "refused by both"
    REFUSED = "refused"
    DIFFERENT = "different"


@dataclass(frozen=True)
class Reading:
    """The verdict on a program, and its reason."""

    file: Path
    verdict: Verdict
    reason: str = ""


def programs_in(folders: Iterable[Path]) -> list[Path]:
    """The part programs in folders and their subfolders, found by their endings."""
    files = (file for folder in folders for file in folder.rglob("*") if file.suffix.lower() in ENDINGS)
    return sorted({file for file in files if file.is_file()})


def readings(files: Sequence[Path], folders: Sequence[Path], scratch: Path) -> list[Reading]:
    """Reads each program with LinuxCNC and feedplan, with 99 tools of 1.5 mm; `folders` have subprograms."""
    tools, ini = scratch / "tools.tbl", scratch / "samples.ini"
    tools.write_text("".join(f"T{i} P{i} Z0 D1.5\n" for i in range(1, 100)))
    ini.write_text(f"[RS274NGC]\nSUBROUTINE_PATH={':'.join(map(str, folders))}\n")
    table = read_tools(tools)
    found = []
    for file, (moves, error) in zip(files, reference(files, tools, ini), strict=True):
        try:
            ours = moves_of(read_gcode(file, tools=table, subprograms=folders))
        except ProgramError as refused:
            found.append(Reading(file, _refused(moves, error), str(refused)))
            continue
        found.append(_compared(file, tools, ours, moves, error))
    return found


def _refused(moves: list[Move], error: str | None) -> Verdict:
    if error is not None:
        return Verdict.REFUSED_BY_BOTH
    moving = difference([], [move for move in moves if move[0] != "dwell"]) is not None
    return Verdict.REFUSED if moving else Verdict.NO_MOVES


def _compared(file: Path, tools: Path, ours: list[Move], moves: list[Move], error: str | None) -> Reading:
    apart = difference(ours, moves, so_far=error is not None)
    if apart is None and error is not None:
        return Reading(file, Verdict.SAME_SO_FAR, f"LinuxCNC stops: {error}")
    if apart is None:
        return Reading(file, Verdict.SAME)
    if error is None and difference(ours, printed(file, tools), PRINTED) is None:
        return Reading(file, Verdict.SAME_AS_PRINTED)
    return Reading(file, Verdict.DIFFERENT, apart)


def main(names: Sequence[str]) -> int:
    """Prints the table; returns 1 if a program differs."""
    if shutil.which("rs274") is None:
        print(f"Nothing is compared. {ABSENT}")
        return 0
    files = programs_in([Path(name) for name in names] or FOLDERS)
    with tempfile.TemporaryDirectory() as scratch:
        found = readings(files, sorted({file.parent for file in files}), Path(scratch))
    for reading in sorted(found, key=lambda reading: reading.verdict):
        print(f"{reading.verdict:20} {reading.file}  {reading.reason}")
    totals = Counter(reading.verdict for reading in found)
    print("\n".join(f"{totals[verdict]:6} {verdict}" for verdict in Verdict))
    return int(totals[Verdict.DIFFERENT] > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
