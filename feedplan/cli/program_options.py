"""Options of the command line for the program with planned feeds."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

import click

from feedplan.cli.options import Place, as_one
from feedplan.planned_feeds.dialects import DIALECTS
from feedplan.program.source import require_other

if TYPE_CHECKING:
    from feedplan.planned_feeds.rewrite import PlannedProgram
    from feedplan.planning import Plan


@dataclass(frozen=True)
class ProgramWanted:
    """The requested files for the program with planned feeds, and its options."""

    file: str | None
    in_folder: bool
    options: dict[str, Any]

    def require_other(self, machine: str) -> None:
        """Raises InputError if the file is the machine's file, which would be overwritten."""
        if self.file is not None:
            require_other(machine, FilePath(self.file), what="machine file")

    def make(self, plan: Plan) -> PlannedProgram | None:
        """Makes the program if it is requested, and writes it to the file if one is given; else returns
        None."""
        if self.file is None and not self.in_folder:
            return None
        from feedplan.planned_feeds.rewrite import planned_program, write_program

        if self.file is not None:
            return write_program(plan, self.file, **self.options)
        return planned_program(plan, **self.options)


def _wanted(
    program_out: str | None,
    in_folder: bool,
    feed_step: float | None,
    inverse_time: bool,
    dialect: str | None,
    expand: bool,
) -> ProgramWanted:
    options = {"feed_step": feed_step, "inverse_time": inverse_time, "dialect": dialect, "expand": expand}
    given = {name: value for name, value in options.items() if value is not None and value is not False}
    if given and program_out is None and not in_folder:
        raise click.UsageError(
            "--feed-step, --inverse-time, --dialect and --expand are for the program with planned feeds: "
            "give --program-out FILE as well"
        )
    if program_out == "-":
        raise click.UsageError(
            "standard output is for the result: give --program-out a file, or use feedplan filter, which "
            "writes the program there"
        )
    return ProgramWanted(program_out, in_folder, given)


# The command gets these options as one argument, `wanted`.
program_options = as_one(
    "wanted",
    _wanted,
    (
        click.option(
            "--program-out", type=Place(), metavar="FILE", help="File for the program with planned feeds."
        ),
        click.option(
            "--program",
            "in_folder",
            is_flag=True,
            help="Write the program with planned feeds into the folder -o, as program.ngc.",
        ),
        click.option(
            "--feed-step",
            type=float,
            metavar="MM/S",
            help="In that program, split lines and arcs on which the planned speed varies by more than this.",
        ),
        click.option(
            "--inverse-time", is_flag=True, help="In that program, give feeds as inverse time (G93)."
        ),
        click.option(
            "--dialect",
            type=click.Choice(DIALECTS),
            help="Control that runs that program; words that it does not know are reported.  "
            "[default: linuxcnc]",
        ),
        click.option(
            "--expand",
            is_flag=True,
            help="In that program, write every move on its own, without loops, calls and cycles.",
        ),
    ),
)
