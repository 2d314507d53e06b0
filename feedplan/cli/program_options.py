"""Options of the command line that ask for the program with planned feeds."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

import click

from feedplan.cli.options import with_options
from feedplan.planned_feeds.dialects import DIALECTS

if TYPE_CHECKING:
    from feedplan.planned_feeds.rewrite import PlannedProgram
    from feedplan.planning import Plan

Command = TypeVar("Command", bound=Callable[..., Any])

_OPTIONS = (
    click.option("--program-out", metavar="FILE", help="Write the program with planned feeds there."),
    click.option(
        "--program", "in_folder", is_flag=True, help="Write that program into the folder -o, as program.ngc."
    ),
    click.option(
        "--feed-step",
        type=float,
        metavar="MM/S",
        help="In that program, split lines and arcs where the planned speed varies by more.",
    ),
    click.option("--inverse-time", is_flag=True, help="In that program, give feeds as inverse time (G93)."),
    click.option(
        "--dialect",
        type=click.Choice(DIALECTS),
        default="linuxcnc",
        show_default=True,
        help="The control that the program is for: words that it lacks are reported.",
    ),
    click.option(
        "--expand",
        is_flag=True,
        help="Write the moves of the program one by one, without loops, calls and cycles.",
    ),
)


@dataclass(frozen=True)
class ProgramWanted:
    """The files in which the program with planned feeds is wanted, and its options."""

    file: str | None
    in_folder: bool
    options: dict[str, Any]

    def make(self, plan: Plan) -> PlannedProgram | None:
        """Makes the program if it is wanted, and writes it to the file if one is given; else returns None."""
        if self.file is None and not self.in_folder:
            return None
        from feedplan.planned_feeds.rewrite import planned_program

        planned = planned_program(plan, **self.options)
        if self.file is not None:
            planned.write(self.file)
        return planned


def program_options(command: Command) -> Command:
    """Adds the options; the command gets them as one argument, `wanted`, and has an `output`."""

    @functools.wraps(command)
    def packed(
        *args: Any,
        output: str | None,
        program_out: str | None,
        in_folder: bool,
        feed_step: float | None,
        inverse_time: bool,
        dialect: str,
        expand: bool,
        **others: Any,
    ) -> Any:
        if in_folder and not output:
            raise click.UsageError("--program needs a folder to write to: give -o DIR, or --program-out FILE")
        options = {
            "feed_step": feed_step,
            "inverse_time": inverse_time,
            "dialect": dialect,
            "expand": expand,
        }
        if (feed_step or inverse_time or expand) and not (in_folder or program_out):
            raise click.UsageError(
                "--feed-step, --inverse-time and --expand are for the program with planned feeds: "
                "give --program-out FILE as well"
            )
        return command(*args, output=output, wanted=ProgramWanted(program_out, in_folder, options), **others)

    return with_options(packed, _OPTIONS)  # type: ignore[no-any-return]
