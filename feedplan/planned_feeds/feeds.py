"""Computes the F of each line: the greatest planned speed in it, where that is below the programmed feed.

A control uses F as an upper limit, and accelerates and brakes at the ends of a block by itself. So the F of a
block is the greatest planned speed in it, rounded down, or the program's own F where the plan reaches it. The
new F is in the program's units and feed mode: the F in force there × planned speed / programmed feed. F is
modal: it is written where it changes, and the program's own F is restored before a line that relies on it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from feedplan.arrays import Flags, Floats, Integers
from feedplan.geometry.feed_groups import GROUPS
from feedplan.planned_feeds.blocks import REASONS, Blocks, Exclusion
from feedplan.planned_feeds.number import FEED_ROUNDING, exact_text, feed_texts, rounded_down
from feedplan.program.program import Program
from feedplan.units import MM_PER_INCH, SECONDS_PER_MINUTE

UNKNOWN_FEED = "the F in force, by G93 or G95, is computed, or set where lines run more than once"


@dataclass(frozen=True, eq=False)
class Changes:
    """Feeds that differ from the program's, one row for each block, in order.

    `line` (k,) is the 1-based line of the program, repeated where it is split; `before` (k,) is the F in
    force in the program and `after` (k,) the new F, in the program's units.
    """

    line: Integers
    before: Floats
    after: Floats


@dataclass(frozen=True, eq=False)
class Feeds:
    """Edits of lines, by line index from 0.

    `texts`: the new F of each part of a line (one part if it is not split); None where the F in force stays.
    `restore`: the F of a new line before the line; `modes`: lines that get G93; `left`: the reason why a line
    keeps its F.
    """

    texts: dict[int, list[bytes | None]]
    restore: dict[int, bytes]
    changes: Changes
    left: dict[int, str]
    modes: set[int] = field(default_factory=set)


@dataclass(frozen=True, eq=False)
class LineSpeeds:
    """Lines with feed moves, by index from 0 in order: `line` (k,); `ratio` (k,) is the greatest planned
    speed over the programmed `feed` (k,) [mm/s, deg/s], NaN where the line has moves of different feeds or no
    plan; `turns` (k,) whether this feed is in deg/s of rotary axes."""

    line: Integers
    ratio: Floats
    feed: Floats
    turns: Flags


def line_speeds(program: Program, greatest: Floats, group: Integers) -> LineSpeeds:
    """The greatest planned speed of each line from that of each move, `greatest` (m,); `group` (m,) is the
    group of axes that its feed counts along (`SpeedsAlong`)."""
    ratio = greatest / program.feed
    feeds = np.flatnonzero(np.isfinite(program.feed))
    line = program.line.astype(np.int64) - 1
    order = feeds[np.argsort(line[feeds], kind="stable")]
    lines, first = np.unique(line[order], return_index=True)
    most = np.maximum.reduceat(program.feed[order], first)
    least = np.minimum.reduceat(program.feed[order], first)
    top = np.fmax.reduceat(ratio[order], first)
    ratio = np.where((most == least) & (top > 0.0), top, np.nan)
    return LineSpeeds(lines, ratio, most, group[order[first]] == GROUPS - 1)


def planned_feeds(
    blocks: Blocks,
    speeds: LineSpeeds,
    exclusion_of: NDArray[np.uint8],
    parts: Mapping[int, Sequence[float]],
    point: bool = False,
) -> Feeds:
    """The edits of the F of each line.

    `exclusion_of` (n,) is the Exclusion of each line; `parts` are the ratios (planned over programmed feed)
    of the parts of split lines, by index from 0; `point`: a new F has a decimal point.
    """
    own_of = blocks.feed_at[:, 0] >= 0
    row_of = np.full(len(blocks), -1, dtype=np.int64)
    row_of[speeds.line] = np.arange(len(speeds.line))
    lines = np.flatnonzero((exclusion_of != Exclusion.NO) | own_of | blocks.voids | (row_of >= 0))
    exclusion, row = exclusion_of[lines], row_of[lines]

    programmed, source = _programmed_feeds(blocks, lines, exclusion, own_of[lines])
    # If F is in units per minute, an unknown F follows from the feed of the move.
    feeds = (row >= 0) & (exclusion == Exclusion.NO)
    fed = np.flatnonzero(feeds)
    units = np.where(blocks.inches[lines[fed]] & ~speeds.turns[row[fed]], MM_PER_INCH, 1.0)
    from_feed = np.where(
        blocks.per_minute[lines[fed]], speeds.feed[row[fed]] * SECONDS_PER_MINUTE / units, np.nan
    )
    programmed[fed] = np.where(np.isnan(programmed[fed]), from_feed, programmed[fed])
    # Before its first F, a program has no F that could stay: the feed is the user's.
    has_feed = np.cumsum(own_of[lines] & (exclusion != Exclusion.DELETED)) > 0
    none = feeds & ~has_feed & ~blocks.calls_set_feed & ~np.isnan(programmed)
    unknown = feeds & np.isnan(programmed)
    ratio = np.ones(len(lines))
    ratio[fed] = speeds.ratio[row[fed]]
    ratio[np.isnan(ratio) | unknown] = 1.0

    # A row for each part of a line.
    counts = np.ones(len(lines), dtype=np.int64)
    places = {line: int(np.searchsorted(lines, line)) for line in parts}
    for line, place in places.items():
        if not unknown[place]:
            counts[place] = len(parts[line])
    of = np.repeat(np.arange(len(lines)), counts)
    first = np.append(True, of[1:] != of[:-1])
    ratio, starts = ratio[of], np.cumsum(counts) - counts
    for line, place in places.items():
        if counts[place] > 1:
            ratio[starts[place] : starts[place] + counts[place]] = parts[line]
    # The wanted F, and the F in force before the line; 0 stands for the program's own F.
    reached = np.abs(ratio - 1.0) <= FEED_ROUNDING
    ratio[reached] = 1.0
    other = feeds[of] & (~reached | none[of])
    wanted = np.where(other, rounded_down(np.where(other, programmed[of] * ratio, 1.0)), 0.0)
    # After a block with G93, and after a change of the meaning of F, no new F is in force.
    before = np.append(0.0, np.where(blocks.inverse[lines[of]], 0.0, wanted)[:-1])
    before[first & blocks.voids[lines[of]]] = 0.0
    own = own_of[lines[of]] & first
    write = np.where(other, own | (wanted != before), feeds[of] & ~own & (before != 0.0))

    texts: dict[int, list[bytes | None]] = {}
    rows = np.flatnonzero(write)
    for k, text in zip(rows.tolist(), feed_texts(wanted[rows], point), strict=True):
        place = int(of[k])
        new = text if wanted[k] else _text(blocks, source[place], programmed[place])
        texts.setdefault(int(lines[place]), [None] * int(counts[place]))[k - int(starts[place])] = new
    restore: dict[int, bytes] = {}
    for k in np.flatnonzero((exclusion[of] != Exclusion.NO) & (before != 0.0)).tolist():
        # The F that is restored is that of the line before.
        last = int(of[k - 1])
        restore[int(lines[of[k]])] = _text(blocks, source[last], programmed[last])
    left = {int(lines[place]): UNKNOWN_FEED for place in np.flatnonzero(unknown)}
    for place in np.flatnonzero((row >= 0) & (exclusion != Exclusion.NO)).tolist():
        left[int(lines[place])] = REASONS[Exclusion(exclusion[place])]
    changed = np.flatnonzero(other)
    changes = Changes(lines[of[changed]] + 1, programmed[of[changed]], wanted[changed])
    return Feeds(texts, restore, changes, left)


def _programmed_feeds(
    blocks: Blocks, lines: Integers, exclusion: NDArray[np.uint8], own: Flags
) -> tuple[Floats, Integers]:
    """The program's F in force on each line (k,), NaN if unknown, and the line with this F (k,), or −1."""
    number = blocks.feed[lines]
    own = own & (exclusion != Exclusion.DELETED)
    lost = blocks.voids[lines] & ~own
    if blocks.calls_set_feed:
        lost |= (exclusion == Exclusion.FLOW) | (exclusion == Exclusion.MODES)
    event = np.maximum.accumulate(np.where(own | lost, np.arange(len(lines)), -1))
    known = (event >= 0) & ~lost[event] & (number[event] > 0.0)
    return np.where(known, number[event], np.nan), np.where(known, lines[event], -1)


def _text(blocks: Blocks, source: int, value: float) -> bytes:
    """The program's F in force as text: as in the line `source`, or from its `value` if `source` < 0."""
    if source < 0:
        return exact_text(value)
    return blocks.content[slice(*blocks.feed_at[source])]


def exclusions_of(blocks: Blocks, program: Program) -> NDArray[np.uint8]:
    """The Exclusion of each line (n,): that of its text, or REPEATED because of the order of the moves."""
    exclusion, line = blocks.exclusion.copy(), program.line.astype(np.int64) - 1
    starts = np.append(True, line[1:] != line[:-1])
    again = np.bincount(line[starts], minlength=len(blocks)) > 1
    # A line that runs after a later line was called.
    straight = line[exclusion[line] == Exclusion.NO]
    again[straight[straight < np.maximum.accumulate(straight)]] = True
    exclusion[again & (exclusion == Exclusion.NO)] = Exclusion.REPEATED
    return exclusion
