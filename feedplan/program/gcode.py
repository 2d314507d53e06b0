"""Reads G-code (RS-274/NGC, as CAM systems post it) into a Program.

| words | meaning |
|---|---|
| G0 G1 | rapid, feed |
| G2 G3 | arc or helix by I J K or R, turns by P; planes G17 G18 G19; centre incremental or G90.1 |
| G5 I J P Q, G5.1 I J | cubic and quadratic Bézier curve in X and Y, G17; G5 after G5 may leave out I J |
| G5.2 X Y P L … G5.3 | NURBS in X and Y, weights P, order L from 3, knots clamped and uniform; G17 |
| G6.2 P K X… R, then K X… R, then K | Fanuc's NURBS: order P (4), knots K, weights R, any axes |
| G4 P, G4 X | dwell [s] |
| G20 G21 | inch, mm (mm without either, with a warning) |
| G28 G30 | rapid by the place named to the machine's home: the axes named, or all |
| G43 H, G43.1, G43.2, G49 | tool length; lengths by H are not known and count as 0, with a warning |
| G43.4, G43.5, G49 | X Y Z are the tool's tip on the part, with rotary words or with I J K, its direction |
| G52, G92 to G92.3, G10 L2 L20 | offsets |
| G53, G54 to G59.3 | machine coordinates, work offsets (from the machine file, else 0) |
| G61.1, G61, G64 P Q | exact stop, exact path, blending within P, fitting within Q |
| G73 G74 G81 to G86 G89, G80, G98 G99 | canned cycles with R Z Q P L D, written out as moves |
| G90 G91 | absolute, incremental |
| G93 G94 G95 | F is 1/min, units/min, units a turn (with a known spindle speed) |
| G96 G97 S | surface or spindle speed |
| G8 G15 G40 G69 | what they cancel is never on: no effect |
| G5 P, G5.1 Q alone in a block | Fanuc's look-ahead, with a warning: no effect |
| M0 M1 M2 M30 M60, M3 to M9, M19, M100 to M199 | full stop; M2 and M30 end the program |
| M48 M49, S T D | no effect on the path |
| F, N, O1234 or :1234 at the start, %, ( ) and ; comments | as usual |
| / at the start of a block | left out, with a warning, unless `block_delete=False` |
| #1 = [...], #<name>, + - * / ** MOD, EQ to XOR, ABS to TAN | arithmetic, in any word |

Everything else is an error that names the line and the word: cutter radius compensation (G41 G42), threading,
probing, subprograms and flow control (O words, M97 to M99), words that no code of their block uses. Within a
block the order is LinuxCNC's, with differences that posts count on: F is in the units of its own block, G80
gives way to another motion code beside it, and G0 beside G28 only stays in force. All axes start at
zero, or at home where words always are the tip; a change of offsets moves nothing. A stop or dwell belongs
to the move before it, and a dwell before the first move is kept as `start_dwell`.

A spline of several blocks is one move, in the line and at the feed of its first block; nothing else may stand
inside it. Its knots and control points are LinuxCNC's and Fanuc's: with G91 those of G5.2 count from its
start, those of G6.2 from the one before. G93 does not go with splines.

G43.4 and G43.5 take a machine with rotary axes. Under them no word has the tool's length in it: it is that of
G43.1 Z before, else the machine file's, with a warning. The change moves nothing: where the joints are is
written in the new words, and what the next block does not name stays there. G49, and G43 or G43.1, go back to
joint positions; after directions these are followed move by move in the pose they began with, by the shortest
turn. I, J, K point from the tip to the spindle; any length will do, missing ones are 0, and without all three
the direction stays. G28, G30, G53 and cycles need G49 before. On machines whose words always are the tip, as
cylindrical and CoreXY ones, home and work offsets are in the program's letters, and G43 adds to Z as
elsewhere.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feedplan._solvers import read_gcode as read_native
from feedplan.curves.composite import CompositeCurve
from feedplan.errors import MachineError
from feedplan.machine.machine import AXIS_LETTERS, Machine
from feedplan.program.program import Program
from feedplan.program.source import MAX_BYTES, Source, content_of
from feedplan.progress import Listener

WORK_OFFSETS = ("G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3")

MAX_MOVES = 50_000_000


def read_gcode(
    source: Source,
    machine: Machine | None = None,
    name: str | None = None,
    *,
    block_delete: bool = True,
    max_bytes: int = MAX_BYTES,
    max_moves: int = MAX_MOVES,
    progress: Listener | None = None,
) -> Program:
    """The moves of a G-code program.

    `source` is a path, a stream, or the program itself: bytes, or a str with a line break. `machine` gives
    the work offsets, the home position and the axes there are; without it offsets and home are 0. `name`
    stands in messages, instead of the file's name. `block_delete` leaves out blocks that start with `/`, as
    LinuxCNC does; `max_bytes` and `max_moves` bound what is read. `progress` is told how far it is.
    Raises ProgramError naming file, line, word and remedy, MachineError where an offset's name is unknown.
    """
    content, name, _ = content_of(source, name, max_bytes)
    # Kinematics are loaded where a program is read, not where feedplan is imported.
    from feedplan.program.tip import TipControl

    control = None if machine is None else TipControl(machine)
    columns = read_native(
        content,
        name,
        _places(machine),
        "" if machine is None else "".join(machine.program_letters),
        control,
        block_delete,
        max_moves,
        progress,
    )
    splines = columns.pop("spline_columns")
    if len(columns["spline_move"]):
        columns["splines"] = CompositeCurve(*splines)
    if control is None or not control.applies:
        columns["meaning"] = columns["tool_length"] = None
    return Program(name=name, **columns)


def _places(machine: Machine | None) -> NDArray[np.float64]:
    """Work offsets, home and the start of the program as rows (11, 9) over XYZABCUVW."""
    places = np.zeros((len(WORK_OFFSETS) + 2, len(AXIS_LETTERS)))
    if machine is None:
        return places
    # A machine's other axes are none of a program's.
    own = [k for k, letter in enumerate(machine.program_letters) if letter in tuple(AXIS_LETTERS)]
    columns = [AXIS_LETTERS.index(machine.program_letters[k]) for k in own]
    for key, row in machine.offsets:
        if key not in WORK_OFFSETS:
            raise MachineError(f"machine {machine.name}: offsets has {key!r}: use {', '.join(WORK_OFFSETS)}")
        places[WORK_OFFSETS.index(key), columns] = np.array(row)[own]
    if machine.home:
        places[-2, columns] = np.array(machine.home)[own]
    if not machine.words_are_joints:
        # Zero may be a place that the tip cannot reach, as the axis of a turning column.
        places[-1] = places[-2]
    return places
