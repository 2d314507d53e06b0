"""`feedplan compare`: one program by several methods, as a table and a page."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path as FilePath
from typing import IO, TYPE_CHECKING, Any

import click

from feedplan.cli import options as option
from feedplan.cli import terminal
from feedplan.cli.controller_options import Choice, controller_options
from feedplan.cli.ending import BROKEN, DONE
from feedplan.cli.reading_options import machine_for, reading_options
from feedplan.comparison import TIME_LIMIT
from feedplan.program.read import Reading
from feedplan.units import duration_text

if TYPE_CHECKING:
    from feedplan.comparison import Row


@click.command()
@option.PROGRAM
@option.MACHINE
@controller_options
@reading_options
@click.option("--methods", metavar="A,B,…", help="Methods to compare.  [default: all]")
@option.ACCURACY
@click.option(
    "--time-limit",
    type=option.Number(),
    default=TIME_LIMIT,
    show_default=True,
    metavar="S",
    help=option.TIME_LIMIT_HELP,
)
@option.TOLERANCE
@option.PATH
@option.FEED
@option.PERIOD
@click.option(
    "--output",
    "-o",
    type=option.Place(),
    metavar="DIR",
    help="Folder for comparison.json and comparison.html.",
)
@option.JSON
@option.QUIET
def compare(
    program: str | IO[bytes],
    machine: str,
    methods: str | None,
    output: str | None,
    as_json: bool,
    quiet: bool,
    controller: Choice,
    reading: Reading,
    **options: Any,
) -> int:
    """Plan PROGRAM by several methods: time, proven gap, computing time and audit of each.

    PROGRAM is as for plan. Exit code 0 if any method has a plan, even if the plan breaks a limit: the table
    shows it.
    """
    from feedplan.comparison import LIMITS
    from feedplan.comparison import compare as make_comparison
    from feedplan.outputs._staging import require_folder
    from feedplan.plan_folder import write_comparison
    from feedplan.report.page import missing_pictures

    folder = None if output is None else FilePath(output)
    if folder:
        require_folder(folder)
    names: Any = None if methods is None else [name.strip() for name in methods.split(",")]
    with terminal.progress_bar(quiet) as progress, terminal.silenced():
        known, source, reading = machine_for(machine, program, reading, options["feed"])
        rows = make_comparison(
            source,
            known,
            names,
            reading=reading,
            controller=controller(known),
            progress=progress,
            **option.given_only(**options),
        )
        today = next((row.plan.today for row in rows if row.plan and row.plan.today), None)
        summary = {
            "program": option.name_of(program),
            "machine": known.name,
            "today": today and today.of_controller(),
            "methods": [row.to_json() for row in rows],
        }
        files = write_comparison(rows, folder, summary, progress) if folder else ()
    if not quiet:
        terminal.warn(_warnings(rows))
        for row in rows:
            if row.error:
                print(f"{row.method}: {row.error}", file=sys.stderr)
        if output and (missing := missing_pictures()):
            terminal.warn([missing])
    if as_json:
        terminal.print_json(summary)
    elif not quiet:
        terminal.print_table(*terminal.comparison_table(rows, LIMITS))
        if today:
            print(f"today: {duration_text(today.time)} by {today.controller.name}")
        for file in files:
            print(file)
    return DONE if any(row.plan for row in rows) else BROKEN


def _warnings(rows: Sequence[Row]) -> Iterator[str]:
    """The warnings of all plans, each once; with the names of the methods if not all plans have it."""
    plans = [row.plan for row in rows if row.plan]
    for warning in dict.fromkeys(warning for plan in plans for warning in plan.warnings):
        own = [plan.method for plan in plans if warning in plan.warnings]
        yield warning if len(own) == len(plans) else f"{', '.join(own)}: {warning}"
