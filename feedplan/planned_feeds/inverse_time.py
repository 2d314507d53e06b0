"""Computes F as inverse time (G93) in 1/min, so that each block has its own F.

A control multiplies F by the length of the block to get the feed. So F is the greatest planned speed in the
block divided by its length; 1 / (planned time of the block) would limit the speed to its mean.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from feedplan.arrays import Floats, Integers
from feedplan.errors import InputError
from feedplan.planned_feeds.blocks import REASONS, Blocks, Exclusion
from feedplan.planned_feeds.feeds import Changes, Feeds
from feedplan.planned_feeds.number import feed_texts, rounded_down
from feedplan.planned_feeds.parts import Motion, Parts, motions
from feedplan.program.program import MoveKind, Program
from feedplan.units import mm_per_min

_REMEDY = "leave out --inverse-time, or give --expand"
# A line that moves nothing also needs an F if it has axis words and no codes other than these.
_AXIS = re.compile(rb"[XYZABCUVWxyzabcuvw][ \t]*[-+.\d\[#]")
_CODE = re.compile(rb"[Gg][ \t]*0*(\d*(?:\.\d+)?)")
_MOVING = {b"1", b"2", b"3", b"17", b"18", b"19", b"20", b"21", b"90", b"91", b"90.1", b"91.1", b"93", b"94"}


def require_no_splines(program: Program, lines: NDArray[np.int32]) -> None:
    """Raises InputError if a feed move is a spline, which cannot have an F as inverse time; `lines` are the
    source lines of the moves in the user's program."""
    splines = np.flatnonzero((program.kind == MoveKind.SPLINE) & np.isfinite(program.feed))
    if len(splines):
        raise InputError(
            f"{program.name} line {lines[splines[0]]}: a spline: inverse time (G93) is for lines and arcs: "
            "leave out --inverse-time"
        )


def inverse_feeds(
    blocks: Blocks,
    program: Program,
    exclusion: NDArray[np.uint8],
    greatest: Floats,
    parts: Mapping[int, Parts],
    point: bool = False,
) -> Feeds:
    """An F for each line with a feed move, from the greatest planned speed in it; `exclusion` (n,) is that of
    each line, `parts` are the parts of split moves.

    Raises InputError where a line has several lengths: in loops and cycles, and where only the tool's
    direction turns.
    """
    if not np.isfinite(program.feed).any():
        raise InputError(
            f"{program.name} has no feed moves: inverse time (G93) is for them: leave out --inverse-time"
        )
    counts = np.bincount(program.line.astype(np.int64) - 1, minlength=len(blocks))
    idle = _idle(blocks, counts)
    away = idle[(exclusion[idle] != Exclusion.NO) & (exclusion[idle] != Exclusion.DELETED)]
    if len(away):
        raise _refused(program, int(away[0]), REASONS[Exclusion(exclusion[away[0]])])
    first: dict[int, int] = {}
    for m in np.flatnonzero(np.isfinite(program.feed)).tolist():
        line = int(program.line[m]) - 1
        why = None
        if exclusion[line]:
            why = REASONS[Exclusion(exclusion[line])]
        elif counts[line] > 1:
            why = "several moves, as of a cycle"
        elif not blocks.plain[line]:
            why = "compensation, polar words, diameters or directions of the tool"
        if why is not None:
            raise _refused(program, line, why)
        first[line] = m
    motion_of = motions(program)
    rows: list[tuple[int, float, float]] = []
    sizes: dict[int, int] = {}
    given = np.flatnonzero((blocks.feed_at[:, 0] >= 0) & (exclusion != Exclusion.DELETED))
    for line, m in sorted(first.items()):
        motion = motion_of(m)
        cut = parts.get(m)
        shares = [0.0, 1.0] if cut is None else [0.0, *cut.shares]
        tops = [greatest[m]] if cut is None else cut.speed
        sizes[line] = len(shares) - 1
        # The F of a line may be on an earlier line that moves nothing.
        last = int(np.searchsorted(given, line, side="right")) - 1
        programmed = blocks.feed[given[last]] if last >= 0 else np.nan
        for begin, end, top in zip(shares[:-1], shares[1:], tops, strict=True):
            speed = float(top if top > 0.0 else program.feed[m])
            rows.append((line + 1, programmed, mm_per_min(speed) / feed_length(program, motion, begin, end)))
    lines, before, wanted = (np.array(column) for column in zip(*rows, strict=True))
    after = rounded_down(wanted)
    written = iter(feed_texts(after, point))
    texts: dict[int, list[bytes | None]] = {
        line: [next(written) for _ in range(size)] for line, size in sizes.items()
    }
    # Where the tool does not move, the value of F is irrelevant.
    texts |= {line: [b"1"] for line in idle.tolist()}
    modes = set(np.flatnonzero(blocks.modes[:, 0] >= 0).tolist())
    if min(modes, default=len(blocks)) > min(first):
        modes.add(min(first))
    return Feeds(texts, {}, Changes(lines.astype(np.int64), before, after), {}, modes)


def _refused(program: Program, line: int, why: str) -> InputError:
    place = f"{program.name} line {line + 1}"
    return InputError(f"{place}: {why}: inverse time (G93) is for plain moves: {_REMEDY}")


def _idle(blocks: Blocks, counts: Integers) -> Integers:
    """Lines whose moves have no length, or that do not run: they also need an F."""
    found = []
    for line in np.flatnonzero((counts == 0) & (blocks.feed_at[:, 0] < 0)).tolist():
        text = re.sub(rb"\([^()\r\n]*\)?|;.*", b"", blocks.line(line))
        if _AXIS.search(text) and set(_CODE.findall(text)) <= _MOVING:
            found.append(line)
    return np.array(found, dtype=np.int64)


def feed_length(program: Program, motion: Motion, begin: float, end: float) -> float:
    """The length [mm, deg] along the axes of the feed, between two shares of a motion. Raises InputError for
    other motions."""
    first, last = motion.at(begin), motion.at(end)
    if motion.turn:
        radii = [math.hypot(*(place[motion.plane] - motion.centre)) for place in (first, last)]
        rise = float((last - first)[motion.normal])
        turn = abs(motion.turn * (end - begin))
        return math.hypot(0.5 * sum(radii) * turn, radii[1] - radii[0], rise)
    for letters in ("XYZ", "UVW", "ABC"):
        own = [column for column, name in enumerate(program.axes) if name in letters]
        length = float(np.linalg.norm((last - first)[own]))
        if length > 0.0:
            return length
    raise InputError(
        f"{program.name}: a move turns the tool alone: inverse time (G93) is not for it: {_REMEDY}"
    )
