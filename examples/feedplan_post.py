"""A post-processor for FreeCAD's CAM workbench: G-code for LinuxCNC whose feeds feedplan has planned.

FreeCAD offers it as `feedplan` if a copy is in its folder of macros, where it looks for post-processors. The
text in the job's field of arguments goes to `feedplan plan`:
    --machine mine.toml --feed-step 20

`--feedplan FILE` is the path of the command feedplan, if it is not on PATH; `--unplanned` writes the program
as it is posted. Lengths are in mm, feeds in mm/min, with six digits after the point: fewer digits would bend
arcs and smooth surfaces.
"""

from __future__ import annotations

import argparse
import os
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

TOOLTIP = __doc__
TOOLTIP_ARGS = "--feedplan FILE, --unplanned, and all options of: feedplan plan"

BEGIN = "G21 G90 G17 G94 G40 G49 G80 G54"
END = "M5\nM9\nM2"
DIGITS = 6
# The order of words in a block; below, the words whose values are whole numbers.
WORDS = "XYZABCIJKRQPLHDTSF"
WHOLE = "LHDTS"
RAPIDS = ("G0", "G00")
COOLANT = {"Flood": "M8", "Mist": "M7"}


def export(objects, filename: str, arguments: str = "") -> str:
    """Writes the operations and tool changes in `objects`, in order, to a file; returns the text.

    FreeCAD calls this function. If feedplan refuses the program, it raises RuntimeError with feedplan's
    sentence and writes nothing.
    """
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--feedplan", default="feedplan")
    parser.add_argument("--unplanned", action="store_true")
    own, options = parser.parse_known_args(shlex.split(arguments))
    # FreeCAD's dialog passes this option to all post-processors.
    options = [option for option in options if option != "--no-show-editor"]
    text = program(objects)
    if not own.unplanned:
        text = planned(text, shlex.split(own.feedplan), options)
    if filename != "-":
        Path(filename).write_text(text, encoding="utf-8", newline="\n")
    return text


def program(objects) -> str:
    """The G-code of the active objects that have a path."""
    lines = [BEGIN]
    for item in objects:
        base = getattr(item, "Base", None)
        if not hasattr(item, "Path") or not getattr(item, "Active", getattr(base, "Active", True)):
            continue
        coolant = COOLANT.get(getattr(item, "CoolantMode", getattr(base, "CoolantMode", "None")))
        commands = [line for line in map(block, item.Path.Commands) if line]
        lines += [coolant, *commands, "M9"] if coolant else commands
    return "\n".join([*lines, END]) + "\n"


def block(command) -> str:
    """A block of G-code; FreeCAD has feeds in mm/s, the block in mm/min."""
    if command.Name.startswith("("):
        return comment(command.Name[1:-1])
    words = [command.Name]
    # FreeCAD also gives K0 for arcs in the plane XY, which have no word K.
    given = {word: value for word, value in command.Parameters.items() if (word, value) != ("K", 0.0)}
    for word in WORDS:
        if word not in given or (word == "F" and (command.Name in RAPIDS or not given[word])):
            continue
        value = 60.0 * given[word] if word == "F" else given[word]
        words.append(f"{word}{int(value)}" if word in WHOLE else f"{word}{number(value)}")
    return " ".join(words)


def number(value: float) -> str:
    return f"{round(value, DIGITS) + 0.0:.{DIGITS}f}".rstrip("0").rstrip(".")


def comment(text: str) -> str:
    return "(" + text.replace("(", "[").replace(")", "]").replace("\n", " ") + ")"


def planned(text: str, command: list[str], options: list[str]) -> str:
    """The program with planned feeds. Raises RuntimeError with feedplan's sentence."""
    # feedplan runs in another Python, for which the variables of FreeCAD's Python are not valid.
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    with tempfile.TemporaryDirectory() as folder:
        source, result = Path(folder, "program.ngc"), Path(folder, "planned.ngc")
        source.write_text(text, encoding="utf-8", newline="\n")
        done = subprocess.run(
            [*command, "plan", str(source), *options, "--program-out", str(result)],
            env=environment,
            capture_output=True,
            text=True,
        )
        if done.returncode:
            raise RuntimeError(done.stderr.strip() or f"feedplan ended with {done.returncode}")
        print(done.stdout, done.stderr, file=sys.stderr)
        return result.read_text(encoding="utf-8")
