"""Options of the command line for reading a program, and the machine that they are for."""

from __future__ import annotations

from typing import IO

import click

from feedplan.cli.options import as_one, given_only
from feedplan.machine.machine import Machine
from feedplan.program.machine_for import AUTO, smallest_machine
from feedplan.program.program import Program
from feedplan.program.read import Reading, read_program


def _reading(tool_table: str | None, subprograms: tuple[str, ...], whole_step: float | None) -> Reading:
    given = given_only(tool_table=tool_table, subprograms=subprograms or None, whole_step=whole_step)
    return Reading(**given)  # type: ignore[no-any-return,typeddict-item]


# The command gets these options as one argument, `reading`.
reading_options = as_one(
    "reading",
    _reading,
    (
        click.option(
            "--tool-table", metavar="FILE", help="LinuxCNC's tool table (.tbl), for G43, G41 and G42."
        ),
        click.option(
            "--subprograms",
            multiple=True,
            metavar="DIR",
            help="Folder with files that the program calls, searched after the program's own folder; may be "
            "given several times.",
        ),
        click.option(
            "--whole-step",
            type=float,
            metavar="UNITS",
            help="Unit of lengths that have no decimal point, such as 0.001.  [default: 1]",
        ),
    ),
)


def machine_for(
    name: str, source: str | IO[bytes], reading: Reading, feed: float | None = None
) -> tuple[Machine, str | IO[bytes] | Program, Reading]:
    """The machine of that name or file, the source and its reading options. For `auto` these are the smallest
    machine that the program fits, the program, which has then been read, and no options."""
    if name != AUTO:
        return Machine.load(name), source, reading
    given = source if isinstance(source, str) else source.read()
    title = None if isinstance(source, str) else source.name
    machine, program = smallest_machine(
        lambda machine: read_program(given, machine, name=title, feed=feed, **reading)
    )
    return machine, program, Reading()
