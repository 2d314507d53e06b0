"""Reads a part program from a file, in whatever language it is written."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from feedplan.machine.machine import Machine
from feedplan.program import path_file
from feedplan.program.dxf import read_dxf
from feedplan.program.gcode import MAX_BYTES, read_bytes, read_gcode
from feedplan.program.path_file import read_path_file
from feedplan.program.program import Program

Reader = Callable[[bytes, Machine | None, str], Program]

# By the end of the file's name, with the most bytes that are read; everything else is G-code.
READERS: dict[str, tuple[Reader, int]] = {
    ".json": (read_path_file, path_file.MAX_BYTES),
    ".dxf": (lambda content, machine, name: read_dxf(content, name), path_file.MAX_BYTES),
}


def read_program(
    path: str | Path,
    machine: Machine | None = None,
    *,
    block_delete: bool = True,
    max_bytes: int = MAX_BYTES,
) -> Program:
    """The moves of the program in a file: a path file (.json), a drawing (.dxf), else G-code.

    `machine` gives work offsets and home, see `read_gcode`, and the axes there are. Raises ProgramError in
    one sentence where the file is missing, a directory, empty, binary, larger than `max_bytes` or not
    understood, MissingPackageError where a drawing needs a package.
    """
    file = Path(path)
    reader, most = READERS.get(file.suffix.lower(), (None, max_bytes))
    content = read_bytes(file, min(max_bytes, most))
    if reader is None:
        program = read_gcode(content, machine, file.name, block_delete=block_delete)
    else:
        program = reader(content, machine, file.name)
    return replace(program, sha256=hashlib.sha256(content).hexdigest())
