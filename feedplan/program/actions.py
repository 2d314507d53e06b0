"""Computes from the words of a program's events what each event does on a machine.

| kind | words | channel | value |
|---|---|---|---|
| spindle | M3 M4 M5 S | | speed from now on, as programmed (S): negative for M4, 0 while it stands |
| coolant | M7 M8 M9 | | what flows from now on: 0 nothing, 1 mist, 2 flood, 3 both |
| select | T | | number of the tool that is made ready |
| tool | M6, M61 Q | | number of the tool that is in the spindle from now on |
| dwell | G4, P of a cycle | | seconds |
| stop | M0 M1 M60, M2 M30 | | number of the code; 2 and 30 end the program |
| output | M62 to M65 P | P | 1 on, 0 off |
| analog | M67 M68 E Q | E | Q |
| input | M66 P (or E) Q | P (or E) | longest wait Q [s] |
| message, comment | (MSG, …) M117, ( ) ; | | |
| other | other M codes | | number of the code |

All events stop the tool except S, T, M61, messages, comments and the outputs that are synchronised with the
motion, M62, M63 and M67: these happen while the tool moves. Cycles that reverse or stop the spindle (G33.1,
G74, G84, G86) have their own M3, M4, M5. Laser power is given by M67, or by S with the spindle on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feedplan.arrays import Flags, Floats, Integers
from feedplan.program.events import COMMENT, MESSAGE, Events

KINDS = (
    "spindle", "coolant", "select", "tool", "dwell", "stop", "output", "analog", "input", "message",
    "comment", "other",
)  # fmt: skip

# M codes that act without stopping the tool, and those that stop the program.
_PASSING = (61, 62, 63, 67)
_STOPS = (0, 1, 2, 30, 60)


@dataclass(frozen=True, eq=False)
class Actions:
    """The effect of m events: `kind`, `channel` and `value` (m,), NaN where they have none; `stops` (m,): the
    tool stands still for the event."""

    kind: NDArray[np.str_]
    channel: Floats
    value: Floats
    stops: Flags


def actions(events: Events) -> Actions:
    """The effect of each event, in their order."""
    p, q, number = events.p, events.q, events.number
    letter = {name: events.letter == ord(name) for name in ("M", "S", "T", "G", MESSAGE, COMMENT)}

    def code(*codes: int) -> Flags:
        return np.asarray(letter["M"] & np.isin(number, codes))

    spindle = letter["S"] | code(3, 4, 5)
    turns = np.where(code(3), 1.0, np.where(code(4), -1.0, 0.0))
    speed = _latest(turns, code(3, 4, 5)) * _latest(number, letter["S"])
    coolant = code(7, 8, 9)
    off = _last(code(9))
    flows = (_last(code(7)) > off) + 2.0 * (_last(code(8)) > off)
    outputs = code(62, 63, 64, 65)
    analog = code(67, 68)
    # The first kind that matches a row is taken.
    cases: list[tuple[str, Flags, Floats]] = [
        ("spindle", spindle, speed),
        ("coolant", coolant, flows),
        ("select", letter["T"], number),
        ("tool", code(6), p),
        ("tool", code(61), q),
        ("dwell", letter["G"], p),
        ("stop", code(*_STOPS), number),
        ("output", outputs, code(62, 64).astype(np.float64)),
        ("analog", analog, q),
        ("input", code(66), q),
        ("message", letter[MESSAGE], np.full(len(number), np.nan)),
        ("comment", letter[COMMENT], np.full(len(number), np.nan)),
    ]
    which = [marks for _, marks, _ in cases]
    return Actions(
        kind=np.select(which, [np.array(kind) for kind, _, _ in cases], "other"),
        channel=np.where(outputs | analog | code(66), p, np.nan),
        value=np.select(which, [values for _, _, values in cases], number),
        stops=(letter["M"] & ~code(*_PASSING)) | letter["G"],
    )


def _last(marks: Flags) -> Integers:
    """Index of the last marked row at or before each row; −1 before the first."""
    return np.maximum.accumulate(np.where(marks, np.arange(len(marks)), -1))


def _latest(values: Floats, marks: Flags) -> Floats:
    """The value of the last marked row at or before each row; 0 before the first."""
    last = _last(marks)
    return np.where(last >= 0, values[last], 0.0)
