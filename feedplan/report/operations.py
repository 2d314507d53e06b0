"""Computes the time of a program by tool and operation: feed motion, rapids, dwells and tool changes [s].

An operation begins at a comment that is alone in its line, as CAM systems post them; of several such
consecutive lines the first one gives the name. An operation continues in subprograms without such comments.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from feedplan.arrays import Integers
from feedplan.constraints.problem import Problem
from feedplan.profile import SpeedProfile
from feedplan.program.program import Program
from feedplan.program.source import content_of

# Consecutive lines that consist of a comment; the first one gives the name.
_COMMENTS = re.compile(
    rb"^(?:[ \t]*(?:N\d+[ \t]*)?(?:\([^)\r\n]*\)|;[^\r\n]*)[ \t]*\r?\n)+", re.MULTILINE | re.IGNORECASE
)
_TITLE = re.compile(rb"(?:N\d+[ \t]*)?[(;][ \t;]*([^)\r\n]*)", re.IGNORECASE)
# Comments that are commands, or that end an operation, are not names.
_NO_TITLE = re.compile(
    rb"(?:MSG|DEBUG|PRINT|LOG\w*|PROBE\w*|ABORT)\s*,|(?:FINISH|END)\w*\s+(?:OF\s+)?OPERATION\b|\W*\Z",
    re.IGNORECASE,
)
# Lines that begin or end a subprogram.
_SUBPROGRAM = re.compile(
    rb"^[ \t]*(?:N\d+[ \t]*)?(?:[O:]\d+[ \t]*(?=[(;\r\n])|O(?:\d+|<[^>\r\n]*>)[ \t]*(?:END)?SUB\b)",
    re.MULTILINE | re.IGNORECASE,
)
# The parts of the time of an operation.
PARTS = ("feed", "rapid", "dwell", "change")
_LONGEST = 48
# Bound of the relative rounding error of sums of dwells.
_ROUNDING = 1e-9
_TOOL_CHANGE = ord("M"), 6
_TOOL = ord("T")
_DWELL = ord("G"), 4


@dataclass(frozen=True)
class OperationTime:
    """The time of one operation with one tool [s]: motion at a `feed`, `rapid` motion, `dwell`s, and tool
    `change`s if their duration is given. `tool` is the tool's number, None before the first tool; `name` is
    the comment, `line` its line; without a comment they are empty and 0."""

    tool: int | None
    name: str
    line: int
    feed: float = 0.0
    rapid: float = 0.0
    dwell: float = 0.0
    change: float = 0.0

    @property
    def time(self) -> float:
        """The whole time [s]."""
        return self.feed + self.rapid + self.dwell + self.change

    def to_json(self) -> dict[str, Any]:
        """The numbers by name."""
        return {**asdict(self), "time": self.time}


def operation_times(
    problem: Problem, profile: SpeedProfile, program: Program, tool_change: float = 0.0
) -> tuple[OperationTime, ...]:
    """The operations of a program in the order in which they begin; their times add up to the whole.

    `tool_change` [s] is the duration of each tool change, which is not in the plan.
    """
    path, events = problem.path, program.events
    changes = (events.letter == _TOOL_CHANGE[0]) & (events.number == _TOOL_CHANGE[1])
    numbers = events.p
    if not changes.any():
        # On lathes a T word changes the tool.
        changes, numbers = events.letter == _TOOL, events.number
    of_move, of_event, lines, names = _operations(program)
    _begin_with_changes(of_move, of_event, program, np.flatnonzero(changes))
    # Tool and operation are combined to one number.
    before = np.searchsorted(events.move[changes], np.arange(len(program)), "right")
    of_move += before * (len(lines) + 1)
    of_event += np.cumsum(changes) * (len(lines) + 1)
    dwells = (events.letter == _DWELL[0]) & (events.number == _DWELL[1]) & np.isfinite(events.p)
    # A dwell on a line of its own belongs to the operation of that line, not to the move before it.
    pauses = np.concatenate(([program.start_dwell], program.dwell))
    rest = pauses.copy()
    np.subtract.at(rest, events.move[dwells], events.p[dwells])
    rest[np.abs(rest) <= _ROUNDING * pauses] = 0.0
    of_rest = np.concatenate((of_move[:1] if len(of_move) else of_event[:1], of_move))
    duration = np.bincount(profile.piece.astype(np.int64), profile.duration, len(path))
    rapid = ~np.isfinite(path.feed)
    of_piece = of_move[path.move[:, 0]] if len(path) else np.empty(0, np.int64)
    parts = (
        ("feed", of_piece[~rapid], duration[~rapid]),
        ("rapid", of_piece[rapid], duration[rapid]),
        ("dwell", of_event[dwells], events.p[dwells]),
        ("dwell", of_rest, rest),
        ("change", of_event[changes], np.full(int(changes.sum()), tool_change)),
    )
    keys, row_of = np.unique(np.concatenate([of_move, of_event]), return_inverse=True)
    spent = {name: np.zeros(len(keys)) for name in PARTS}
    for name, of_part, time in parts:
        spent[name] += np.bincount(np.searchsorted(keys, of_part), time, len(keys))
    # The number of moves before the start of each.
    first = np.full(len(keys), len(program))
    np.minimum.at(first, row_of, np.concatenate([np.arange(len(program)), events.move]))
    tools = [None, *(int(number) if np.isfinite(number) else None for number in numbers[changes])]
    rows: dict[tuple[int | None, int], OperationTime] = {}
    for k in np.lexsort((keys, first)):
        changed, title = divmod(int(keys[k]), len(lines) + 1)
        tool, line = tools[changed], int(lines[title - 1]) if title else 0
        row = OperationTime(
            tool, names[title - 1] if title else "", line, *(float(spent[n][k]) for n in PARTS)
        )
        if row.time > 0.0:
            rows[tool, line] = _sum(rows[tool, line], row) if (tool, line) in rows else row
    return tuple(rows.values())


def _begin_with_changes(of_move: Integers, of_event: Integers, program: Program, changes: Integers) -> None:
    """Moves after a tool change that continue the operation of the old tool get the next operation with the
    new tool, or none if there is no such operation. Changes both arrays in place."""
    count, at = len(program), program.events.move
    ends = np.flatnonzero((np.diff(of_move) != 0) | (np.diff(program.line) < 0)) + 1
    for k, row in enumerate(changes):
        first, earlier = at[row], at[changes[k - 1]] if k else 0
        later = at[changes[k + 1]] if k + 1 < len(changes) else count
        own = of_event[row]
        if first == earlier or of_move[first - 1] != own:
            continue
        last = first
        if first < count and of_move[first] == own:
            end = np.searchsorted(ends, first, "right")
            last = min(ends[end] if end < len(ends) else count, later)
        name = of_move[last] if last < later else 0
        of_move[first:last] = name
        following = np.arange(row, len(at)) if k + 1 == len(changes) else np.arange(row, changes[k + 1])
        of_event[following[(of_event[following] == own) & (at[following] <= last)]] = name


def _sum(one: OperationTime, other: OperationTime) -> OperationTime:
    return replace(one, **{name: getattr(one, name) + getattr(other, name) for name in PARTS})


def by_tool(operations: Iterable[OperationTime]) -> tuple[OperationTime, ...]:
    """The times of each tool, in the order of first use; the names are empty."""
    tools: dict[int | None, OperationTime] = {}
    for own in operations:
        tools[own.tool] = _sum(tools.get(own.tool, OperationTime(own.tool, "", 0)), own)
    return tuple(tools.values())


def _operations(
    program: Program,
) -> tuple[Integers, Integers, Integers, list[str]]:
    """The number of the operation of each move and of each event, from 1 (0 for none), and the lines and
    names of the operations."""
    content = b"" if program.text is None else content_of(program.text, program.name).content
    lines, names = _titles(content)
    ends = _line_numbers(content, [match.start() for match in _SUBPROGRAM.finditer(content)])
    # Sorted by time: an event after k moves comes before move k + 1.
    order = np.argsort(
        np.concatenate([2 * np.arange(len(program)) + 1, 2 * program.events.move]), kind="stable"
    )
    line = np.concatenate([program.line, program.events.line])[order].astype(np.int64)
    number = np.searchsorted(lines, line, "right")
    subprogram = np.searchsorted(ends, line, "right")
    # A comment of another subprogram is ignored: the current operation continues.
    named = np.append(0, np.searchsorted(ends, lines, "right"))[number] == subprogram
    named[number == 0] = False
    latest = np.maximum.accumulate(np.where(named, np.arange(len(order)), -1))
    result = np.zeros(len(order), dtype=np.int64)
    result[order] = np.where(latest >= 0, number[latest], 0)
    return result[: len(program)], result[len(program) :], lines, names


def _titles(content: bytes) -> tuple[Integers, list[str]]:
    """The lines of the comments that name operations, and their texts."""
    offsets: list[int] = []
    names: list[str] = []
    for block in _COMMENTS.finditer(content):
        offset = block.start()
        for comment in block[0].splitlines(keepends=True):
            title = _TITLE.match(comment.strip())
            if title and not _NO_TITLE.match(title[1]):
                text = title[1].decode("utf-8", "replace")
                printable = "".join(letter if letter.isprintable() else " " for letter in text)
                names.append(" ".join(printable.split())[:_LONGEST])
                offsets.append(offset)
                break
            offset += len(comment)
    return _line_numbers(content, offsets), names


def _line_numbers(content: bytes, offsets: list[int]) -> Integers:
    """The line numbers, from 1, of offsets in a text."""
    breaks = np.flatnonzero(np.frombuffer(content, np.uint8) == ord("\n"))
    return np.asarray(np.searchsorted(breaks, offsets, "left") + 1, dtype=np.int64)
