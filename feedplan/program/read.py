"""Reads a part program from a file, in whatever language it is written."""

from __future__ import annotations

from pathlib import Path

from feedplan.machine.machine import Machine
from feedplan.program.gcode import MAX_BYTES, read_bytes, read_gcode
from feedplan.program.program import Program


def read_program(
    path: str | Path,
    machine: Machine | None = None,
    *,
    block_delete: bool = True,
    max_bytes: int = MAX_BYTES,
) -> Program:
    """The moves of the program in a file; every file is taken for G-code, the one language read.

    `machine` gives work offsets and home, see `read_gcode`. Raises ProgramError in one sentence where the
    file is missing, a directory, empty, binary, larger than `max_bytes` or not understood.
    """
    file = Path(path)
    content = read_bytes(file, max_bytes)
    return read_gcode(content, machine, file.name, block_delete=block_delete)
