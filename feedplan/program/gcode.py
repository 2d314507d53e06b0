"""Reads G-code (RS-274/NGC, as CAM systems post it) into a Program, as LinuxCNC's interpreter does.

| words | meaning |
|---|---|
| G0 G1 | rapid, feed |
| G2 G3 | arc or helix by I J K or R, turns by P; planes G17 G18 G19; centre incremental or G90.1 |
| G5 I J P Q, G5.1 I J | cubic and quadratic Bézier curve in X and Y, G17; G5 after G5 may leave out I J |
| G5.2 X Y P L … G5.3 | NURBS in X and Y, weights P, order L from 3, knots clamped and uniform; G17 |
| G6.2 P K X… R, then K X… R, then K | Fanuc's NURBS: order P (4), knots K, weights R, any axes |
| G4 P, G4 X | dwell [s] |
| G7 G8 | X words are diameters, radii |
| G10 L2 L20, L1 L10 L11 | work offsets and their rotation R, tools of the table |
| G15 G16, @ ^ | polar coordinates of Fanuc; radius and angle as LinuxCNC writes them |
| G20 G21 | inch, mm (mm without either, with a warning) |
| G28 G30, G28.1 G30.1 | rapid by the place named to home: the axes named, or all; this place is home |
| G28.2 to G28.4 | finding the machine's zero: rapid to home |
| G33, G33.1, G76 | moves that follow the spindle (S and M3 before): one pass, a tap, a whole thread |
| G40, G41 G42 D, G41.1 G42.1 D | the tool beside the path by its radius, from the table or D; G17, G18 |
| G43 H, G43.1, G43.2, G49 | tool length; without a tool table lengths by H count as 0, with a warning |
| G43.4, G43.5, G49 | X Y Z are the tool's tip on the part, with rotary words or with I J K, its direction |
| G52, G92 to G92.3 | shifts of all work offsets |
| G53, G54 to G59.3 | machine coordinates, work offsets (from the machine file, else 0) |
| G54.1 P, G154 P | further work offsets 1 to 99 (`"G54.1 P1"` in the machine file, else 0); #7001, #7021 … |
| G60 | alone exact stop; with a place a rapid that ends with one |
| G61.1, G61, G64 P Q | exact stop, exact path, blending within P, fitting within Q |
| G73 G74 G81 to G86 G89, G80, G98 G99 | canned cycles with R Z Q P L D, as moves; G99 unless G98 is given |
| G90 G91 | absolute, incremental |
| G93 G94 G95 | F is 1/min, units/min, units a turn (with a known spindle speed) |
| G96 G97 S | surface or spindle speed |
| G68 X Y R, G69 | coordinates turned by R degrees about a place, or about where the tool is; G17, G90 |
| G65 P, letters, L | macros of Fanuc: A B C I J K D E F H are #1 to #6, #7 to #9, #11, Q to Z #17 to #26 |
| G5 P, G5.1 Q alone in a block | Fanuc's look-ahead, with a warning: no effect |
| M0 M1 M2 M30 M60 | full stop; M2 and M30 end the program |
| M3 to M9, M19, M62 to M68 | spindle, coolant, outputs: a stop (none for M62, M63, M67) |
| T, M6, M61 Q | tool of the table, if one is given |
| M48 to M53 | overrides: no effect on the path |
| M70 to M73 | save and restore modes |
| M97 M98 M99 | Fanuc's subprograms by P, L times; without parameters of their own; M99 P goes to a line |
| IF[ ] GOTO, IF[ ] THEN, GOTO, WHILE[ ] DO1 … END1, EQ #0 | Fanuc's statements; GOTO by N in its program |
| other M codes | a stop of no duration, with a warning; the words after it are its own |
| E | an extruder: left out, with a warning |
| O… sub, call, if, while, do, repeat | subroutines, branches and loops, also with names and in files |
| #1 = [...], #<name>, + - * / ** MOD, EQ to XOR, ABS to TAN | parameters and arithmetic, in any word |
| F, N, O1234 or :1234 at the start, %, ( ) and ; comments | as usual |
| / at the start of a block | left out, with a warning, unless `block_delete=False` |

Parameters: #1 to #30 and #<name> belong to one call; #31 to #5602, #7001 to #8980 and #<_name> are global.
#5161 to #5390 are home and offsets, #5400 to #5428 tool and position, #<_x>, #<_metric> and similar ones the
modes. A numbered parameter that is not set is 0, with a warning; a named one must be set. In a macro called
by G65, words that use an argument which is not given are left out; values of the control (#1000 to #5160)
that nothing sets, and alarms (#3000), are errors. Loops and calls are limited by `max_moves`, by four
executed lines for each of `max_moves` in addition to the lines of the text, and by 100 nested calls. Files of
subprograms are looked for in the folder of the program, then in `subprograms`; their moves have the line of
the call.

These words are refused; the message has the word, the line and the remedy:

| words | reason |
|---|---|
| G38.2 to G38.5 | where a probe stops depends on the part |
| G50 G51, G68.2 | scaling and tilted planes differ from control to control: post places as they are cut |
| G66 G67 | macros that each move calls: call them by G65 |
| G70 to G72 | each control cuts these lathe cycles in passes of its own: post the passes |
| G87, G88 | the angle at which the spindle stops, and what the operator does by hand, are not known |
| G17.1 to G19.1 | arcs and cycles of U, V, W |
| G41 G42 in G19, with splines, cycles, G28, G53, G92 | there the tool has no offset |
| an arc in G18, G19 where coordinates are turned | it is no arc in a plane of the machine |
| G10, G52, G92, G55 … under G68 | controls refuse these too: G69 comes first |
| #<_ini[…]>, #<_hal[…]>, #4003 in a macro | values of one machine's configuration, or of one control |
| a tool that a given tool table lacks | its length and diameter are not known |
| a subprogram that is in no file | what it moves is not known |
| a word that no code of its block uses | it would mean something else than is planned |
| Heidenhain, Siemens, other languages | another language, named |

To compare with LinuxCNC's interpreter, `python -m tests.program.readings FOLDER...` prints a table. Numbers
that differ by less than 1e-6 are equal in comparisons with LE and GE, as in LinuxCNC 2.9; in older
interpreters they are not.

Within a block the order is LinuxCNC's, with differences that posts rely on: F is in the units of its own
block, G80 is ignored if the block has another motion code, and G0 in a block with G28 only stays in force.
All axes start at zero, or at home where words always mean the tip; a change of offsets moves nothing. A stop
or dwell belongs to the move before it, and a dwell before the first move is kept as `start_dwell`.

A spline of several blocks is one move, with the line and the feed of its first block; no other words may be
between its blocks. Knots and control points are read as LinuxCNC and Fanuc do: with G91, the points of G5.2
are relative to its start, those of G6.2 to the point before. G93 is not allowed with splines.

G43.4 and G43.5 need a machine with rotary axes. In these modes no word includes the tool's length, which is
that of G43.1 Z before, else that of the machine file, with a warning. The change of mode moves nothing: the
positions of the joints are expressed in the new words, and axes that the next block does not name keep them.
G49, and G43 or G43.1, return to joint positions. After directions, the joint positions are those of following
the directions move by move, in the pose in which they began and by the shortest turn. I, J, K point from the
tip to the spindle and may have any length; missing ones are 0, and without all three the direction stays.
G28, G30, G53 and cycles need G49 before. On machines whose words always mean the tip, such as cylindrical and
CoreXY machines, home and work offsets are in the program's letters, and G43 adds to Z as elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from feedplan._solvers import read_gcode as read_native
from feedplan.arrays import Floats
from feedplan.curves.composite import CompositeCurve
from feedplan.errors import MachineError
from feedplan.machine.axis import AXIS_LETTERS
from feedplan.machine.machine import Machine
from feedplan.program.events import Events
from feedplan.program.machine_for import names_of_machines_with
from feedplan.program.program import Program
from feedplan.program.source import MAX_BYTES, Source, content_of
from feedplan.program.subprograms import finder
from feedplan.program.tools import Tool
from feedplan.progress import Listener

if TYPE_CHECKING:
    from feedplan.program.tip import TipControl

WORK_OFFSETS = (
    *("G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3"),
    *(f"G54.1 P{number}" for number in range(1, 100)),
)

MAX_MOVES = 50_000_000


@dataclass(frozen=True, eq=False)
class Options:
    """The arguments of the native reader besides the program.

    `places` (n, 9) are the home position, the start of the program, and the work offsets G54 to G59.3 and
    G54.1 P1 on, in X Y Z A B C U V W; without a machine `machine_axes` is empty and `tip_control` None.
    `machines_with` names the machines that have the axis of a letter; `tools` are rows of the tool table,
    None where it is not known; `subprograms` returns the file's name and bytes for a name, or None; the other
    fields are those of `read_gcode`.
    """

    places: Floats
    machine_axes: str
    machines_with: Callable[[str], str]
    tip_control: TipControl | None
    block_delete: bool
    max_moves: int
    tools: Sequence[Tool] | None
    subprograms: Callable[[str], tuple[str, bytes] | None] | None
    feed: float | None
    whole_step: float


def read_gcode(
    source: Source,
    machine: Machine | None = None,
    name: str | None = None,
    *,
    block_delete: bool = True,
    tools: Sequence[Tool] | None = None,
    subprograms: Sequence[Path] = (),
    feed: float | None = None,
    whole_step: float = 1.0,
    max_bytes: int = MAX_BYTES,
    max_moves: int = MAX_MOVES,
    progress: Listener | None = None,
) -> Program:
    """The moves of a G-code program.

    `source` is a path, a stream, or the program itself: bytes, or a str with a line break. `machine` gives
    the work offsets, the home position and the axes that exist; without it offsets and home are 0. `name`
    replaces the file's name in messages. `block_delete` leaves out blocks that start with `/`, as LinuxCNC
    does. `tools` is the tool table; without one lengths by H are 0. `subprograms` are folders with files that
    the program calls; the program's own folder is searched first. `feed` [mm/s, deg/s] is the feed of moves
    before the first F. `whole_step` is the unit of lengths and angles without a decimal point, in units of
    the program: 0.001 on controls with that setting. `max_bytes` and `max_moves` limit the program.

    `progress` is called with the finished share. Raises ProgramError naming file, line, word and remedy,
    MachineError where an offset's name is unknown.
    """
    content, name, text = content_of(source, name, max_bytes)
    folders = [*([text.parent] if isinstance(text, Path) else []), *subprograms]
    # Imported here, so that `import feedplan` does not load kinematics.
    from feedplan.program.tip import TipControl

    control = None if machine is None else TipControl(machine)
    options = Options(
        places=_places(machine),
        machine_axes="" if machine is None else "".join(machine.program_letters),
        machines_with=names_of_machines_with,
        tip_control=control,
        block_delete=block_delete,
        max_moves=max_moves,
        tools=tools,
        subprograms=finder(folders, max_bytes) if folders else None,
        feed=feed,
        whole_step=whole_step,
    )
    moves, columns = read_native(content, name, options, progress)
    columns["events"] = Events(*columns.pop("event_columns"))
    if columns["splines"] is not None:
        columns["splines"] = CompositeCurve.of(columns["splines"])
    if control is None or not control.applies:
        columns["coordinate_mode"] = columns["tool_length"] = None
    return Program.of(moves, name=name, **columns)


def _places(machine: Machine | None) -> Floats:
    """Home, the start of the program and the work offsets as rows (110, 9), in the order XYZABCUVW."""
    places = np.zeros((2 + len(WORK_OFFSETS), len(AXIS_LETTERS)))
    if machine is None:
        return places
    # Axes with other names cannot be programmed.
    own = [k for k, letter in enumerate(machine.program_letters) if letter in tuple(AXIS_LETTERS)]
    columns = [AXIS_LETTERS.index(machine.program_letters[k]) for k in own]
    for key, row in machine.offsets:
        if key not in WORK_OFFSETS:
            names = "G54 to G59, G59.1 to G59.3, G54.1 P1 to P99"
            raise MachineError(f"machine {machine.name}: offsets has {key!r}: use {names}")
        places[2 + WORK_OFFSETS.index(key), columns] = np.array(row)[own]
    if machine.home:
        places[0, columns] = np.array(machine.home)[own]
    if not machine.words_are_joints:
        # The tip may be unable to reach zero, for example on the axis of a turning column.
        places[1] = places[0]
    return places
