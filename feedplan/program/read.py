"""Reads a part program in any language: G-code, a path file or a drawing."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypedDict, cast

from feedplan.arguments import callback, file_path, flag, is_text, number, positive, refuse, whole
from feedplan.errors import InputError
from feedplan.machine.machine import Machine
from feedplan.program import path_file
from feedplan.program.dxf import read_dxf
from feedplan.program.gcode import MAX_MOVES, read_gcode
from feedplan.program.path_file import read_path_file
from feedplan.program.program import Program
from feedplan.program.source import MAX_BYTES, Source, content_of
from feedplan.program.subprograms import readable_folder
from feedplan.program.tools import read_tools
from feedplan.progress import Listener


class Reading(TypedDict, total=False):
    """Keywords of `read_program`."""

    block_delete: bool
    tool_table: str | os.PathLike[str] | None
    subprograms: Sequence[str | os.PathLike[str]]
    whole_step: float
    max_moves: int


def checked_reading(reading: object) -> Reading:
    """Keywords of `read_program`; raises InputError for anything else."""
    known = Reading.__annotations__
    if reading is None:
        return Reading()
    if isinstance(reading, Mapping) and all(isinstance(name, str) and name in known for name in reading):
        return cast(Reading, dict(reading))
    raise refuse("reading", reading, f"a dictionary with {', '.join(known)}")


Reader = Callable[[bytes, Machine | None, str, float | None], Program]

# Readers by the ending of the name, with the greatest size [bytes]; all other programs are G-code.
READERS: dict[str, tuple[Reader, int]] = {
    ".json": (read_path_file, path_file.MAX_BYTES),
    ".dxf": (lambda content, machine, name, feed: read_dxf(content, name, feed), path_file.MAX_BYTES),
}
_FOLDER = "the path of a folder"
_TABLE = "the path of a tool table (.tbl)"
# How programs without an ending in their name begin; G-code never begins like this.
_BEGINNINGS = {
    ".json": re.compile(rb"(\xef\xbb\xbf)?\s*\{"),
    ".dxf": re.compile(rb"\s*(0\s+SECTION|999\s|AutoCAD Binary DXF)"),
}


def read_program(
    source: Source,
    machine: Machine | str | os.PathLike[str] | None = None,
    *,
    name: str | None = None,
    block_delete: bool = True,
    tool_table: str | os.PathLike[str] | None = None,
    subprograms: Sequence[str | os.PathLike[str]] = (),
    feed: float | None = None,
    whole_step: float = 1.0,
    max_bytes: int = MAX_BYTES,
    max_moves: int = MAX_MOVES,
    progress: Listener | None = None,
) -> Program:
    """The moves of a part program: a path file (.json), a drawing (.dxf), else G-code.

    `source`: the path of a file; or the program itself, as bytes, as a str with a line break, or as an open
    file or another stream. `name` replaces the file's name in messages, and its ending decides the language;
    without an ending the first characters decide. `machine` (a Machine, or its name or file) gives work
    offsets and home, see `feedplan.program.gcode.read_gcode`, and the axes that exist. `block_delete` leaves
    out blocks that start with `/`. `tool_table` is a file of LinuxCNC (.tbl) with lengths and diameters of
    tools; `subprograms` are folders with files that the program calls; the program's own folder is searched
    first. `feed` [mm/s, deg/s] is the feed of moves before the first F, or of moves without one; `whole_step`
    is the unit of lengths without a decimal point, in units of the program; G-code with more than `max_moves`
    moves, including those of loops and calls, is refused. `progress` is called with the finished share.
    Raises ProgramError in one sentence where the program is missing, a directory, empty, binary, larger than
    `max_bytes` or not understood, MissingPackageError where a drawing needs a package, MachineError,
    InputError for other arguments that cannot be used.
    """
    known = None if machine is None else Machine.of(machine)
    if name is not None and not is_text(name):
        raise refuse("the name", name, "a text")
    block_delete = flag(block_delete, "block_delete")
    max_bytes = whole(max_bytes, "max_bytes", "a whole number from 1")
    max_moves = whole(max_moves, "max_moves", f"a whole number from 1 to {MAX_MOVES}", most=MAX_MOVES)
    callback(progress, "the part done")
    if feed is not None:
        feed = number(feed, "the feed", "a positive number", positive, "mm/s")
    content, name, text = content_of(source, name, max_bytes)
    reader, most = READERS.get(_language(content, name), (None, max_bytes))
    if reader is None:
        if isinstance(subprograms, (str, bytes)) or not isinstance(subprograms, Iterable):
            raise refuse("subprograms", subprograms, "a list of folders")
        folders = [
            readable_folder(file_path(folder, "a folder of subprograms", _FOLDER)) for folder in subprograms
        ]
        folders = [*([text.parent] if isinstance(text, Path) else []), *folders]
        options: dict[str, Any] = {
            "block_delete": block_delete,
            "subprograms": tuple(folders),
            "feed": feed,
            "whole_step": number(whole_step, "whole_step", "a positive number", positive),
            "max_bytes": max_bytes,
        }
        tools = None if tool_table is None else read_tools(file_path(tool_table, "the tool table", _TABLE))
        program = read_gcode(
            content, known, name, tools=tools, max_moves=max_moves, progress=progress, **options
        )
        program = program.with_others(reading={"machine": known, "tool_table": tool_table, **options})
    else:
        content_of(content, name, min(max_bytes, most))
        given = {"tool_table": tool_table, "whole_step": whole_step, "block_delete": block_delete}
        for option, usual in {"tool_table": None, "whole_step": 1.0, "block_delete": True}.items():
            if given[option] != usual:
                raise InputError(f"{name} is no G-code, which alone takes {option}: leave it out")
        program = reader(content, known, name, feed)
    return program.with_others(sha256=hashlib.sha256(content).hexdigest(), text=text)


def _language(content: bytes, name: str) -> str:
    """The ending of a program's name, or the one that its first characters imply."""
    ending = Path(name).suffix.lower()
    if ending:
        return ending
    return next((own for own, begins in _BEGINNINGS.items() if begins.match(content)), "")
