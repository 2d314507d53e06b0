"""Makes the program of a plan with planned feeds, as an object and as a file."""

from __future__ import annotations

import hashlib
import os
import secrets
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from feedplan.arguments import file_path, flag, number, one_of, positive, refuse
from feedplan.arrays import Floats, Integers
from feedplan.errors import InputError
from feedplan.planned_feeds.blocks import Blocks, Exclusion, blocks_of
from feedplan.planned_feeds.dialects import DIALECTS, DialectName, gone, lacks, writes_points
from feedplan.planned_feeds.expand import expanded
from feedplan.planned_feeds.feeds import Changes, Feeds, LineSpeeds, exclusions_of, line_speeds, planned_feeds
from feedplan.planned_feeds.inverse_time import inverse_feeds, require_no_splines
from feedplan.planned_feeds.part_lines import Sense, may_be_split, part_lines
from feedplan.planned_feeds.parts import Parts, motions, parts_of
from feedplan.planned_feeds.read_back import SAME, require_same
from feedplan.planned_feeds.speeds import SpeedsAlong, speeds_along
from feedplan.planned_feeds.text import rewritten, usual_blank
from feedplan.planning import Plan
from feedplan.program.program import MoveKind, PathControl, Program
from feedplan.program.read import read_program
from feedplan.program.source import MAX_BYTES, content_of, require_other
from feedplan.units import counted, duration_text

# Number of lines that a summary shows one by one.
_SHOWN = 20


@dataclass(frozen=True, eq=False)
class PlannedProgram:
    """A program with planned feeds.

    `content` is its text; `lines` is the number of lines of the program; `changes` are the lines with another
    F; `split` is the number of lines that were split; `left` (line, reason) are the lines whose F could not
    be changed; `notes` are words that the control of the `dialect` does not understand, and words that are
    lost when a program is written anew; `time` [s] is that of the plan.
    """

    name: str
    content: bytes
    lines: int
    changes: Changes
    split: int
    left: tuple[tuple[int, str], ...]
    notes: tuple[str, ...]
    dialect: DialectName
    time: float

    def __repr__(self) -> str:
        return f"<PlannedProgram {self.name}: {counted(self.changed, 'line')} of {self.lines} changed>"

    @property
    def changed(self) -> int:
        """The number of lines with another F."""
        return len(np.unique(self.changes.line))

    @property
    def sha256(self) -> str:
        """The hash of the text."""
        return hashlib.sha256(self.content).hexdigest()

    def write(self, file: str | os.PathLike[str]) -> None:
        """Writes the text to a file, completely or not at all; to a device or a pipe it is written directly.

        Raises InputError where the file cannot be written.
        """
        given = file_path(file, "the file", "the path of a file")
        try:
            # A symbolic link stays; the file that it points to is replaced.
            place = given.resolve()
            if place.exists() and not place.is_file():
                place.write_bytes(self.content)
                return
            beside = place.with_name(f".feedplan-{secrets.token_hex(6)}")
            try:
                beside.write_bytes(self.content)
                os.replace(beside, place)
            finally:
                beside.unlink(missing_ok=True)
        except (OSError, RuntimeError, ValueError) as error:  # also circular links, impossible names
            reason = (getattr(error, "strerror", None) or str(error)).lower()
            raise InputError(f"{given} cannot be written ({reason}): choose another file") from error

    def to_json(self) -> dict[str, Any]:
        """The program's entry in plan.json."""
        return {
            "sha256": self.sha256,
            "dialect": self.dialect,
            "lines": self.lines,
            "changed": self.changed,
            "split": self.split,
            "left": len(self.left),
            "notes": list(self.notes),
        }

    def summary(self, shown: int = _SHOWN) -> str:
        """The changes in words: at most `shown` lines of each kind one by one."""
        rows = [
            f"{self.name}: {counted(self.changed, 'line')} of {self.lines} with another F, "
            f"{self.split} split, {len(self.left)} left as they were; "
            f"the plan takes {duration_text(self.time)}"
        ]
        lines, first = np.unique(self.changes.line, return_index=True)
        for line, row in zip(lines[:shown].tolist(), first.tolist(), strict=False):
            after = self.changes.after[self.changes.line == line]
            text = " ".join(f"{feed:g}" for feed in after[:6]) + (" ..." if len(after) > 6 else "")
            before = self.changes.before[row]
            rows.append(f"  line {line}: {'no F' if np.isnan(before) else f'F{before:g}'} -> F{text}")
        if len(lines) > shown:
            rows.append(f"  and {len(lines) - shown} more")
        reasons: dict[str, list[int]] = {}
        for line, reason in self.left:
            reasons.setdefault(reason, []).append(line)
        for reason, own in reasons.items():
            where = ", ".join(map(str, own[:shown])) + (" ..." if len(own) > shown else "")
            rows.append(f"  left: {reason}: line {where}")
        rows += [f"  {note}" for note in self.notes]
        return "\n".join(rows)


def planned_program(
    plan: Plan,
    *,
    feed_step: float | None = None,
    inverse_time: bool = False,
    dialect: DialectName = "linuxcnc",
    expand: bool = False,
) -> PlannedProgram:
    """The program of a plan, in which no block asks for more than the plan's greatest speed in it.

    `feed_step` [mm/s, deg/s]: lines and arcs are split where the planned speed varies by more. `inverse_time`
    gives every block an F in 1/min (G93). `dialect` is the dialect of the control: `linuxcnc`, `grbl` or
    `fanuc`; `notes` name the words that the control does not understand. `expand` writes the moves as plain
    blocks in the order in which they run. The text is read back to verify that its moves are the same bit for
    bit, or within 1e-9 mm where lines are split. Raises InputError for a plan without a program, for a
    program that was changed since, and for moves that cannot be written.
    """
    program = plan.program if isinstance(plan, Plan) else None
    if feed_step is not None:
        feed_step = number(feed_step, "feed_step", "a positive number", positive, "mm/s")
    inverse_time, expand = flag(inverse_time, "inverse_time"), flag(expand, "expand")
    dialect = one_of(dialect, "dialect", DIALECTS)
    if not isinstance(program, Program):
        raise refuse("the plan", plan, "the plan of a program, as feedplan.plan returns it")
    along = speeds_along(plan.problem, plan.profile, program)
    left_out: tuple[str, ...] = ()
    if expand:
        if program.reading is not None:
            left_out = gone(dialect, _text_of(program))
        content, program, along, source_lines = _expanded(program, along, dialect)
    else:
        content, source_lines = _text_of(program), program.line
    if inverse_time:
        require_no_splines(program, source_lines)
    blocks = blocks_of(content, bool((program.reading or {}).get("block_delete", True)))
    # Only rounding can make a plan exceed the requested feed.
    greatest = np.fmin(along.greatest(), plan.problem.request.of(program.feed))
    speeds, exclusion = line_speeds(program, greatest, along.group), exclusions_of(blocks, program)
    parts: dict[int, Parts] = {}
    if feed_step is not None:
        candidates = _candidates(blocks, program, exclusion)
        found = parts_of(plan.problem, plan.profile, program, along, candidates, feed_step)
        moving = program.moving()
        parts = {
            m: own
            for m, own in found.items()
            if may_be_split(blocks.line(int(program.line[m]) - 1), program.axes, moving[m])
        }
    point = writes_points(dialect)
    if inverse_time:
        feeds = inverse_feeds(blocks, program, exclusion, greatest, parts, point)
    else:
        by_line = {
            int(program.line[m]) - 1: (own.speed / program.feed[m]).tolist() for m, own in parts.items()
        }
        feeds = planned_feeds(blocks, speeds, exclusion, by_line, point)
        # A line whose F could not be changed is not split.
        parts = {m: own for m, own in parts.items() if int(program.line[m]) - 1 not in feeds.left}
    result = rewritten(blocks, feeds, _split(blocks, program, parts, feeds))
    if result != content:
        require_same(result, program, parts, _most(blocks, program, feeds, speeds))
    return PlannedProgram(
        name=program.name,
        content=result,
        lines=len(blocks),
        changes=feeds.changes,
        split=len(parts),
        left=tuple((line + 1, why) for line, why in sorted(feeds.left.items())),
        notes=(*left_out, *lacks(dialect, result)),
        dialect=dialect,
        time=plan.time,
    )


def write_program(
    plan: Plan,
    file: str | os.PathLike[str],
    *,
    feed_step: float | None = None,
    inverse_time: bool = False,
    dialect: DialectName = "linuxcnc",
    expand: bool = False,
) -> PlannedProgram:
    """Writes the program with planned feeds to a file, completely or not at all; see `planned_program`.

    Raises InputError also if the file cannot be written, or is the program or tool table that was read.
    """
    place = file_path(file, "the file", "the path of a file")
    if isinstance(plan, Plan) and plan.program is not None:
        require_other(plan.program.text, place)
        require_other((plan.program.reading or {}).get("tool_table"), place, what="tool table")
    planned = planned_program(
        plan, feed_step=feed_step, inverse_time=inverse_time, dialect=dialect, expand=expand
    )
    planned.write(place)
    return planned


def _text_of(program: Program) -> bytes:
    """The text of a program; raises InputError if it was not read from a text, or has changed since."""
    if program.reading is None or program.text is None:
        raise InputError(
            f"{program.name} is no G-code that was read from a text: "
            "--expand (expand=True) writes its moves anew"
        )
    content = content_of(program.text, program.name, MAX_BYTES).content
    if hashlib.sha256(content).hexdigest() != program.sha256:
        raise InputError(f"{program.name} was changed since it was planned: plan it again")
    return content


def _expanded(
    program: Program, along: SpeedsAlong, dialect: DialectName
) -> tuple[bytes, Program, SpeedsAlong, NDArray[np.int32]]:
    """The program written anew, the result of reading it back, the speeds of its moves, and their lines in
    the original program.

    Raises InputError as `expanded` does, and where the moves are not the same.
    """
    machine = (program.reading or {}).get("machine")
    content, of = expanded(program, machine, dialect)
    # Its text is G-code, so it must not have the ending of a drawing or a path file.
    name = program.name if program.reading is not None else f"{program.name}.ngc"
    again = read_program(content, machine, name=name)
    again = again.with_others(reading={"machine": machine})
    begin = dict(zip(program.axes, program.start.tolist(), strict=True))
    if any(abs(begin.get(axis, 0.0) - at) > SAME for axis, at in zip(again.axes, again.start, strict=True)):
        place = " ".join(f"{axis}{value:.6g}" for axis, value in begin.items())
        raise InputError(
            f"{program.name} begins at {place}, and G-code where the tool is: let it begin at 0, or leave "
            "out --expand"
        )
    if len(again) != len(of):
        raise InputError(
            f"{program.name} is not the same when its moves are written anew ({len(again)} moves, "
            f"not {len(of)}): leave out --expand"
        )
    last = np.append(of[1:] != of[:-1], True)
    columns = [program.axes.index(name) for name in again.axes if name in program.axes]
    # A straight piece of a spline is a line.
    kind = np.where(again.kind == MoveKind.LINE, MoveKind.LINE, program.kind[of])
    pairs = (
        (again.kind, kind),
        (again.target[last], program.target[:, columns]),
        (again.arc_angle, program.arc_angle),
        (again.arc_centre, program.arc_centre),
        (_curved(again), _curved(program)[:, columns]),
        (again.stop[last], program.stop),
        (again.dwell[last], program.dwell),
    )
    if len(columns) != len(again.axes) or not all(
        own.shape == other.shape and np.allclose(own, other, rtol=0.0, atol=SAME) for own, other in pairs
    ):
        raise InputError(
            f"{program.name} is not the same when its moves are written anew: leave out --expand"
        )
    taken = replace(along, first=along.first[of], last=along.last[of], group=along.group[of])
    return content, again, taken, program.line[of]


def _curved(program: Program) -> Floats:
    """The control points (k, axes) of the curved pieces of splines."""
    if program.splines is None:
        return np.empty((0, len(program.axes)))
    counts = np.diff(program.splines.offsets)
    return program.splines.control_points[np.repeat(counts > 2, counts)]


def _candidates(blocks: Blocks, program: Program, exclusion: NDArray[np.uint8]) -> Integers:
    """Moves that may be split: lines and arcs with a feed, each the only move of a line that runs once."""
    line = program.line.astype(np.int64) - 1
    alone = np.bincount(line, minlength=len(blocks))[line] == 1
    plain = (exclusion == Exclusion.NO) & blocks.plain & ~blocks.inverse
    kinds = (program.kind == MoveKind.LINE) | (program.kind == MoveKind.ARC)
    return np.flatnonzero(alone & plain[line] & kinds & (program.control != PathControl.EXACT_STOP))


def _split(blocks: Blocks, program: Program, parts: Mapping[int, Parts], feeds: Feeds) -> dict[int, bytes]:
    """The split lines, written anew, by index."""
    motion_of = motions(program)
    replaced: dict[int, bytes] = {}
    usual = usual_blank(blocks.content)
    for m, own in parts.items():
        line = int(program.line[m]) - 1
        motion = motion_of(m)
        plane = sorted(zip(motion.plane, motion.centre.tolist(), strict=True))
        centre = {program.axes[column]: value for column, value in plane} if motion.turn else None
        sense = Sense(
            bool(blocks.absolute[line]), bool(blocks.absolute_centres[line]), bool(blocks.inches[line])
        )
        texts = feeds.texts.get(line, [None] * len(own))
        replaced[line] = part_lines(
            blocks.line(line), sense, program.axes, motion.start, own, centre, texts, usual
        )
    return replaced


def _most(blocks: Blocks, program: Program, feeds: Feeds, speeds: LineSpeeds) -> Floats:
    """The greatest feed of each move (m,): that of the plan in its line, or the program's own."""
    ratio = np.ones(len(blocks))
    own = np.isin(speeds.line, feeds.changes.line - 1) & ~np.isnan(speeds.ratio)
    ratio[speeds.line[own]] = speeds.ratio[own]
    return np.asarray(program.feed * ratio[program.line.astype(np.int64) - 1])
