"""Moves that LinuxCNC's interpreter makes of part programs, at full precision; runs in its module's Python.

Reads lines `{"program": path, "tools": path of a tool table, "ini": path or null}` from standard input and
writes one line of JSON for each: `moves`, a list of

    ["rapid" or "feed" or "probe", line, end (9,)]
    ["arc", line, end (9,), normal, centre (2,), turns]
    ["dwell", seconds], ["tool", number]

in machine coordinates [mm, deg], with `error`, a sentence and its line, or null.
"""

import ctypes
import json
import math
import os
import re
import signal
import sys
import tempfile
from pathlib import Path

# The interpreter keeps its tools in a file of the home folder.
os.environ["HOME"] = tempfile.mkdtemp()

import gcode

INCH = 25.4

# Some programs never end: each is stopped after this time [s].
PATIENCE = 60


class Canon:
    """Receives the interpreter's moves and converts them to machine coordinates."""

    def __init__(self, tools):
        self.tools = tools
        self.moves = []
        self.g5x = self.g92 = self.tool = [0.0] * 9
        self.angle = 0.0
        self.normal = 2
        self.line = 0
        self.parameter_file = str(Path(os.environ["HOME"], "parameters.var"))
        self.spindle = (-1,) + (0.0,) * 12 + (0,)

    # Calls by which the interpreter reports moves and modes.

    def next_line(self, state):
        self.line = state.sequence_number

    def set_g5x_offset(self, index, *offset):
        self.g5x = scaled(offset)

    def set_g92_offset(self, *offset):
        self.g92 = scaled(offset)

    def set_xy_rotation(self, angle):
        self.angle = angle

    def tool_offset(self, *offset):
        self.tool = scaled(offset)

    def set_plane(self, plane):
        self.normal = {1: 2, 2: 0, 3: 1}[plane]

    def straight_traverse(self, *end):
        self.moves.append(["rapid", self.line, self.machine(scaled(end))])

    def straight_feed(self, *end):
        self.moves.append(["feed", self.line, self.machine(scaled(end))])

    def straight_probe(self, *end):
        self.moves.append(["probe", self.line, self.machine(scaled(end))])

    def rigid_tap(self, *end):
        start = next(move[2] for move in reversed(self.moves) if isinstance(move[2], list))
        place = self.machine(scaled([*end, *[0.0] * 6]))
        self.moves += [["feed", self.line, place[:3] + start[3:]], ["feed", self.line, start]]

    def arc_feed(self, first_end, second_end, first_axis, second_axis, turns, along, a, b, c, u, v, w):
        plane = ((self.normal + 1) % 3, (self.normal + 2) % 3)
        end, centre = [0.0] * 9, [0.0] * 9
        for axis, value, middle in zip(
            plane, (first_end, second_end), (first_axis, second_axis), strict=True
        ):
            end[axis], centre[axis] = value, middle
        end[self.normal] = along
        end[3:] = a, b, c, u, v, w
        middle = self.machine(scaled(centre))
        self.moves.append(
            [
                "arc",
                self.line,
                self.machine(scaled(end)),
                self.normal,
                [middle[axis] for axis in plane],
                turns,
            ]
        )

    def dwell(self, seconds):
        self.moves.append(["dwell", self.line, seconds])

    def change_tool(self, pocket):
        self.spindle = self.get_tool(pocket)
        self.moves.append(["tool", self.line, self.spindle[0]])

    def comment(self, text):
        pass

    def message(self, text):
        pass

    def set_feed_rate(self, rate):
        pass

    def set_traverse_rate(self, rate):
        pass

    def user_defined_function(self, number, p, q):
        pass

    def check_abort(self):
        return False

    # Calls by which the interpreter asks for values.

    def get_tool(self, pocket):
        if pocket == 0:
            return self.spindle
        if pocket <= len(self.tools):
            return self.tools[pocket - 1]
        return (-1,) + (0.0,) * 12 + (0,)

    def get_external_angular_units(self):
        return 1.0

    def get_external_length_units(self):
        return 1.0

    def get_axis_mask(self):
        return 0x1FF

    def get_block_delete(self):
        return True

    def machine(self, place):
        """A position of the program in machine coordinates."""
        place = [value + shift for value, shift in zip(place, self.g92, strict=True)]
        turn = math.radians(self.angle)
        x, y = place[:2]
        if turn:
            place[:2] = x * math.cos(turn) - y * math.sin(turn), x * math.sin(turn) + y * math.cos(turn)
        return [value + work + tool for value, work, tool in zip(place, self.g5x, self.tool, strict=True)]


def scaled(values):
    """Converts X Y Z U V W from inches to mm."""
    return [value if 3 <= axis < 6 else value * INCH for axis, value in enumerate(values)]


def load_tools(library, path):
    """Loads a tool table into the interpreter; returns its tools in order."""
    assert library.tooldata_load(path.encode(), None) == 0
    tools = []
    for line in Path(path).read_text().splitlines():
        words = {
            letter: float(value) for letter, value in re.findall(r"([A-Z])\s*([-+.\d]+)", line.split(";")[0])
        }
        offset = [words.get(letter, 0.0) for letter in "XYZABCUVWDIJ"]
        tools.append((int(words["T"]), *offset, int(words.get("Q", 0))))
    return tools


def main():
    library = ctypes.CDLL("libtooldata.so.0")
    library.tooldata_load = library._Z13tooldata_loadPKcPPc
    library._Z17tool_mmap_creatorPK13EMC_TOOL_STATi(None, 0)
    library._Z13tooldata_initb(False)
    for line in sys.stdin:
        sys.stdout.flush()
        # One process per program, because the interpreter keeps modes between programs and may crash.
        child = os.fork()
        if child == 0:
            signal.alarm(PATIENCE)
            answer(json.loads(line), library)
            sys.stdout.flush()
            os._exit(0)
        if os.waitpid(child, 0)[1] != 0:
            print(
                json.dumps({"moves": [], "error": ["the interpreter crashes or does not end", 0]}), flush=True
            )


def answer(request, library):
    """Prints the moves of one program."""
    tools = load_tools(library, request["tools"])
    if request.get("ini"):
        os.environ["INI_FILE_NAME"] = request["ini"]
    Path(os.environ["HOME"], "parameters.var").unlink(missing_ok=True)
    canon = Canon(tools)
    result, line = gcode.parse(request["program"], canon, "G21", "")
    error = None if result <= gcode.MIN_ERROR else [gcode.strerror(result), line]
    print(json.dumps({"moves": canon.moves, "error": error}))


if __name__ == "__main__":
    main()
