"""Reads a rewritten program back and compares it with the original: the same moves, and no block above its
allowed feed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from feedplan.arrays import Floats
from feedplan.errors import FeedplanError, ProgramError
from feedplan.planned_feeds.number import FEED_ROUNDING
from feedplan.planned_feeds.parts import Parts
from feedplan.program.program import Program
from feedplan.program.read import read_program

# The greatest allowed difference of coordinates where lines are split [mm, deg].
SAME = 1e-9


def require_same(content: bytes, program: Program, parts: Mapping[int, Parts], feed: Floats) -> None:
    """Raises ProgramError unless the text `content`, read with the arguments of `program`, has the same moves
    and these feeds.

    `parts` are the parts of split moves; `feed` (m,) [mm/s, deg/s] is the wanted feed of each move of
    `program`, which may be lower by the rounding of feeds, never higher.
    """
    try:
        again = read_program(content, name=program.name, **(program.reading or {}))
    except FeedplanError as error:
        raise _differs(program, f"it is refused ({error})") from error
    counts = np.ones(len(program), dtype=np.int64)
    counts[list(parts)] = [len(own) for own in parts.values()]
    if len(again) != counts.sum():
        raise _differs(program, f"it has {len(again)} moves in place of {counts.sum()}")
    if again.axes != program.axes:
        raise _differs(program, "it has other axes")
    of = np.repeat(np.arange(len(program)), counts)
    last = np.cumsum(counts) - 1
    target, wanted = program.target[of], feed[of]
    arc_of = np.flatnonzero(np.isin(of, program.arc_move))
    share = np.ones(len(of))
    for move, own in parts.items():
        rows = slice(last[move] - len(own) + 1, last[move] + 1)
        target[rows], share[rows] = own.ends, np.diff([0.0, *own.shares])
        # A part keeps the program's F where the plan reaches it within rounding.
        kept = np.abs(own.speed / program.feed[move] - 1.0) <= FEED_ROUNDING
        wanted[rows] = np.where(kept, program.feed[move], own.speed)
    arc = np.searchsorted(program.arc_move, of[arc_of])
    # Along its axis, the centre of a part has the coordinate of the start of the part.
    centre, normal = program.arc_centre[arc], program.arc_normal[arc].astype(np.int64)
    split = share[arc_of] < 1.0
    if again.arc_centre.shape == centre.shape:
        centre[split, normal[split]] = again.arc_centre[split, normal[split]]
    # Without split lines all numbers are exactly equal; the ends of parts are rounded.
    within = SAME if parts else 0.0
    _compare(program, "kinds of moves", again.kind, program.kind[of])
    _compare(program, "places", again.target, target, within)
    _compare(program, "arcs", again.arc_move, arc_of)
    _compare(program, "centres", again.arc_centre, centre, within)
    _compare(program, "turns of arcs", again.arc_angle, program.arc_angle[arc] * share[arc_of], within)
    _compare(program, "planes", again.arc_normal, program.arc_normal[arc])
    _compare(program, "splines", again.spline_move, last[program.spline_move])
    if program.splines is not None and again.splines is not None:
        own_points = program.splines.control_points
        _compare(program, "control points", again.splines.control_points, own_points, within)
    _compare(program, "ways of following the path", again.control, program.control[of])
    _compare(program, "stops", again.stop[last], program.stop)
    _compare(program, "dwells", again.dwell[last], program.dwell)
    events, after = program.events, np.append(0, last + 1)
    _compare(program, "places of events", again.events.move, after[events.move])
    for name in ("letter", "number", "p", "q"):
        _compare(program, "events", getattr(again.events, name), getattr(events, name))
    if again.events.texts != events.texts:
        raise _differs(program, "its messages differ")
    low, high = wanted * (1.0 - FEED_ROUNDING - SAME), wanted * (1.0 + SAME)
    wrong = np.flatnonzero(~((again.feed >= low) & (again.feed <= high)))
    if len(wrong):
        move = int(wrong[0])
        line = int(program.line[of[move]])
        raise _differs(
            program, f"line {line} has the feed {again.feed[move]:.6g} in place of {wanted[move]:.6g} mm/s"
        )


def _compare(
    program: Program, what: str, found: NDArray[Any], wanted: NDArray[Any], within: float = 0.0
) -> None:
    """Raises ProgramError where arrays differ in shape or by more than `within`; NaN equals NaN."""
    if found.shape != wanted.shape:
        raise _differs(program, f"it has other {what}")
    apart = np.abs(found.astype(np.float64) - wanted.astype(np.float64))
    if (~(apart <= within) & ~(np.isnan(found) & np.isnan(wanted))).any():
        raise _differs(program, f"its {what} differ")


def _differs(program: Program, how: str) -> ProgramError:
    return ProgramError(
        f"{program.name}: the program with planned feeds would not be the same: {how}; "
        "it is not written, please report it with the program"
    )
